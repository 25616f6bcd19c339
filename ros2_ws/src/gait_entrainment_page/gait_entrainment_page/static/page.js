// SPDX-FileCopyrightText: 2026 The gait_entrainment authors
// SPDX-License-Identifier: Apache-2.0

// What must work however busy the rest of the page is: the stop, the sign of life, and the banner
// for a server that is gone. Also the legs, which are drawn many times a second.
"use strict";
const entrain = { heartbeat: false, acting: false };

(() => {
  const OFF = 2000, OLD = 4000; // tolerated clock difference, and age of what is shown [ms]
  let lost = 0; // unanswered signs of life in a row
  let toldAt = performance.now();
  const isOld = () => performance.now() - toldAt > OLD;
  entrain.told = (what) => { Object.assign(entrain, what); toldAt = performance.now(); };
  const byId = (id) => document.getElementById(id);
  const tell = (id, text) => { const box = byId(id); if (box && box.textContent !== text) box.textContent = text; };

  let asked = -1e9;
  async function stop() {
    if (performance.now() - asked < 400) return; // the click after a press
    asked = performance.now();
    tell("told", "Stopping …");
    const late = setTimeout(() => tell("told", "STOP: no answer yet. Use the switch in your hand, or cut the power."), 1000);
    try {
      const response = await fetch("/stop", { method: "POST" });
      if (!response.ok) throw new Error(await response.text());
      tell("told", "STOP: " + (await response.json()).join("\n"));
    } catch (error) {
      tell("told", "STOP DID NOT ARRIVE: cut the power. " + error.message);
    } finally { clearTimeout(late); }
  }
  // On the press: a finger may rest on the button.
  for (const kind of ["pointerdown", "click"])
    document.addEventListener(kind, (event) => { if (event.target.closest?.("#stop")) stop(); });
  // Whoever clicks on something else has read the answer.
  document.addEventListener("click", (event) => { if (event.target.closest?.(".acts .q-btn")) tell("told", ""); });

  async function alive() {
    const sent = Date.now();
    if (window.did_handshake && !window.socket?.connected) toldAt = -Infinity;
    try {
      const body = document.visibilityState === "visible" ? "watching" : "";
      const signal = AbortSignal.timeout(2000);
      const response = await fetch("/alive", { method: "POST", body, signal });
      if (!response.ok) throw new Error(await response.text());
      const now = (await response.json()).now;
      if (lost > 2) location.reload(); // it may be another server
      lost = 0;
      tell("lost", isOld() ? "What you see is old: nothing comes from the page's server. STOP works." : "");
      const off = ((sent + Date.now()) / 2 - now) / 1000;
      tell("clock", Math.abs(off) * 1000 > OFF
        ? `The clock of this browser is ${off > 0 ? "ahead" : "behind"} by ${Math.abs(off).toFixed(1)} s: times on this page are those of the host.` : "");
    } catch (error) {
      lost += 1;
      if (lost > 1) tell("lost", "No connection to the page's server: what you see is old, and STOP does not work from here. Use the switch in your hand, or entrain stop.");
    }
    setTimeout(alive, entrain.heartbeat ? 150 : 500);
  }
  const gone = () => navigator.sendBeacon("/alive", "gone");
  addEventListener("pagehide", () => { if (!document.hidden) gone(); });
  document.addEventListener("visibilitychange", () => { if (document.hidden) gone(); });
  // No prompt may cover STOP when a page that was lost is reloaded.
  addEventListener("beforeunload", (event) => { if (entrain.heartbeat && entrain.acting && !isOld()) event.preventDefault(); });
  addEventListener("DOMContentLoaded", alive);

  // Angles: hips and ankles, left and right [rad]; lengths are those of the drawing.
  let posture = [[]];
  addEventListener("resize", () => entrain.legs(...posture));
  entrain.legs = (angles, perturbed, pushes) => {
    const canvas = document.querySelector("canvas.legs");
    posture = [angles, perturbed, pushes];
    if (!angles.length || !canvas || !canvas.clientWidth) return;
    const ratio = devicePixelRatio, width = canvas.clientWidth, height = canvas.clientHeight;
    if (canvas.width !== width * ratio || canvas.height !== height * ratio) { canvas.width = width * ratio; canvas.height = height * ratio; }
    const draw = canvas.getContext("2d");
    draw.setTransform(ratio, 0, 0, ratio, 0, 0);
    draw.clearRect(0, 0, width, height);
    const length = 0.7 * Math.min(width, height), foot = 0.22 * length, ground = height - 16;
    const legs = [0, 1].map((side) => {
      const hip = angles[side], pitch = angles[2 + side] - hip; // of the foot, toe down positive
      const heel = [length * Math.sin(hip), -length * Math.cos(hip)];
      return { side, heel, toe: [heel[0] + foot * Math.cos(pitch), heel[1] - foot * Math.sin(pitch)] };
    });
    const lowest = Math.min(...legs.flatMap((leg) => [leg.heel[1], leg.toe[1]]));
    const place = ([x, z]) => [width / 2 + x, ground - (z - lowest)];
    draw.lineCap = draw.lineJoin = "round";
    draw.strokeStyle = "#8a949e"; draw.lineWidth = 3;
    draw.beginPath(); draw.moveTo(10, ground + 6); draw.lineTo(width - 10, ground + 6); draw.stroke();
    const hip = place([0, 0]);
    for (const leg of legs) {
      const ankle = place(leg.heel);
      if (leg.side === perturbed && pushes) {
        draw.fillStyle = "#E69F00"; draw.beginPath(); draw.arc(...ankle, 20, 0, 7); draw.fill();
      }
      draw.strokeStyle = leg.side === 0 ? "#0072B2" : "#D55E00"; draw.lineWidth = leg.side === perturbed ? 12 : 6;
      draw.beginPath(); draw.moveTo(...hip); draw.lineTo(...ankle); draw.lineTo(...place(leg.toe)); draw.stroke();
    }
    draw.fillStyle = "#1a1a1a"; draw.beginPath(); draw.arc(...hip, 13, 0, 7); draw.fill();
    draw.font = "700 19px sans-serif";
    draw.fillStyle = "#0072B2"; draw.fillText(perturbed === 0 ? "left (robot)" : "left", 8, 18);
    draw.fillStyle = "#b34700"; draw.fillText(perturbed === 1 ? "right (robot)" : "right", 8, 40);
  };
})();
