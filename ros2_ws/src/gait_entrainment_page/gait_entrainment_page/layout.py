# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The page itself: what a browser is sent, how it is kept up to date, what a click does."""

import asyncio
import json
import shutil
import socket
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request
from fastapi.staticfiles import StaticFiles
from nicegui import ui

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment_page.access import ACT, Access, Seat, one_line
from gait_entrainment_page.actions import Command, Nodes, attempted, stop_at_once
from gait_entrainment_page.bag_source import BagSource
from gait_entrainment_page.charts import lag_chart, period_chart, torque_chart
from gait_entrainment_page.server import Server, state_of
from gait_entrainment_page.view import SESSION, View

# Legs are drawn at every tick [s], words at every fifth, charts if there is something new.
TICK = 0.1
_WORDS = 5
_CHARTS = 10
# Less free space than this on the record's disk is marked [bytes].
_LITTLE = 2 * 10**9
_HEAD = """<link rel="stylesheet" href="/static/page.css?{0}">
<script src="/static/page.js?{0}"></script>""".format(time.time_ns())  # never an earlier version
_WATCHING = {b"watching": True, b"gone": False}
_OF_SESSION = {
    "pause": "Pause before the next block",
    "go_on": "Go on",
    "repeat": "Repeat the block",
}
_BLINDED = (
    "Blinded: torque, periods, lag, verdict and block names are hidden; STOP, limits and "
    "faults are not."
)
_HEARTBEAT = (
    "This page is the operator's heartbeat: closing, hiding or leaving it ends the robot's torque."
)


class Page:
    """
    The page, served from its creation until it is closed; it prints its address.

    ``view`` returns what is shown, ``seat`` and ``access`` define who acts and who may, and
    ``listener`` is the socket to serve on. ``nodes`` take requests and ``command`` can be started;
    for a ``bag`` they are None. The page may be the operator's ``heartbeat``; it shows the free
    disk space of the folder ``record``.
    """

    def __init__(
        self,
        view: Callable[[], View],
        seat: Seat,
        access: Access,
        listener: socket.socket,
        *,
        nodes: Nodes | None = None,
        command: Command | None = None,
        heartbeat: bool = False,
        record: str = "",
        bag: BagSource | None = None,
    ) -> None:
        self.view, self.seat, self.nodes, self.command = view, seat, nodes, command
        self.heartbeat, self.record, self.bag = heartbeat, record, bag
        self._charts: tuple[Any, list[dict[str, Any]]] = (None, [])
        app = FastAPI(openapi_url=None)
        app.add_api_route("/stop", self._stop, methods=["POST"])
        app.add_api_route("/alive", self._alive, methods=["POST"])
        app.mount("/static", StaticFiles(directory=Path(__file__).with_name("static")))
        ui.page("/", title="gait_entrainment", language="en-US")(self._show)
        ui.run_with(app, show_welcome_message=False, binding_refresh_interval=None, tailwind=False)
        self._server = Server(app, listener, access)
        access.announce(self._server.port)

    def close(self) -> None:
        """Stop serving."""
        self._server.close()

    # Without NiceGUI, so that it cannot get in the way

    async def _stop(self) -> list[str]:
        """Stop every robot of this machine; anyone who may look may stop."""
        return await stop_at_once(self.nodes)

    async def _alive(self, request: Request) -> dict[str, float]:
        role, browser = state_of(request)
        # A page in the background sends neither: another page of its browser may be in front.
        watching = _WATCHING.get(await request.body())
        if role == ACT and watching is not None:
            self.seat.heard(browser, watching=watching)
        return {"now": 1e3 * time.time()}

    # The page

    def _show(self, request: Request) -> None:
        role, browser = state_of(request)
        ui.add_head_html(_HEAD)
        shown = Shown(self, browser, may_act=role == ACT)
        shown.build()
        ui.timer(TICK, shown.tick)

    def chart_options(self) -> tuple[Any, list[dict[str, Any]]]:
        """Return version and options of the charts; made once for all browsers."""
        view = self.view()
        with view.lock:
            version = (id(view), view.version)
            if version != self._charts[0]:
                charts = (period_chart, lag_chart, torque_chart)
                self._charts = (version, [chart(view) for chart in charts])
        return self._charts


@dataclass
class Shown:
    """One browser's page: its elements, and what they showed last."""

    page: Page
    browser: str
    may_act: bool
    charts: list[Any] = field(default_factory=list)
    rows: dict[str, tuple[Any, Any]] = field(default_factory=dict)
    labels: dict[str, Any] = field(default_factory=dict)
    buttons: dict[str, Any] = field(default_factory=dict)
    ticks: int = 0
    version: Any = None
    legs: Any = None
    answer: str = ""

    @property
    def acts(self) -> bool:
        """Whether this browser is the operator's."""
        return self.may_act and self.page.seat.holder == self.browser

    # Its elements

    def build(self) -> None:
        """Create the elements."""
        with ui.element("header"):
            with ui.element("div").classes("top"):
                with ui.element("div").classes("facts"):
                    self._fact("part", "part of the protocol")
                    self._fact("stride", "stride")
                    self._fact("left", "time left")
                    ui.element("div").classes("grow")
                    self._fact("measured", "torque measured")
                ui.html('<button id="stop" type="button">STOP</button>', sanitize=False)
            for banner in ("told", "lost"):
                ui.element("div").classes("banner alarm").props(f'id="{banner}" role="alert"')
            self._label("alarm", "banner alarm")
        ui.element("div").classes("banner warn").props('id="clock"')
        if self.page.heartbeat:
            self._label("heartbeat", "banner warn", _HEARTBEAT)
        if self.page.view().blinded:
            self._label("blinded", "banner warn", _BLINDED)
        if self.page.bag is not None:
            self._seek(self.page.bag)
        with ui.element("div").classes("panels"):
            if not self.page.view().blinded:
                self._gait()
            with self._panel("Legs", "w3"):
                ui.html('<canvas class="legs"></canvas>', sanitize=False).style(
                    "flex:1; display:flex"
                )
            self._table("robot", "Ankle robot", "w4")
            self._table("sensors", "Gait events", "w3")
            self._table("record", "Record", "w4")
            with self._panel("Operator", "w5 first"):
                self._operator()
        self.tick()

    def _gait(self) -> None:
        """Create what shows whether the gait follows, and what the robot does."""
        self._chart("Stride period against pulse period", "w5 first")
        self._chart("Phase lag", "w4 first")
        with self._panel("Is the gait entrained?", "w3 first"):
            self._label("verdict", "verdict")
            self._label("figures", "said")
            self._label("lag", "lag")
        self._chart("Ankle torque of the last stride", "w5")

    def _label(self, name: str, classes: str, text: str = "") -> None:
        self.labels[name] = ui.label(text).classes(classes)

    def _fact(self, name: str, what: str) -> None:
        with ui.element("div").classes("fact"):
            ui.label(what).classes("what")
            self._label(name, "big")

    def _panel(self, title: str, width: str) -> Any:
        panel = ui.element("section").classes(f"panel {width}")
        with panel:
            ui.label(title).classes("title")
        return panel

    def _chart(self, title: str, width: str) -> None:
        _, options = self.page.chart_options()
        with self._panel(title, width):
            self.charts.append(ui.echart(options[len(self.charts)]).classes("chart"))

    def _table(self, name: str, title: str, width: str) -> None:
        with self._panel(title, width):
            self.rows[name] = (ui.element("div").classes("rows"), None)

    def _operator(self) -> None:
        self._label("seat", "said")
        self._label("session", "said")
        with ui.element("div").classes("acts"):
            if (command := self.page.command) is not None and command.words:
                preflight = partial(command.start, preflight=True)
                self._button("preflight", "Preflight", partial(self._act, preflight))
                self._button("start", "Start", partial(self._act, command.start))
            if (nodes := self.page.nodes) is not None:
                self._button("arm", "Arm", partial(self._act, partial(nodes.ask, "arm")))
                for name, text in _OF_SESSION.items():
                    self._button(name, text, partial(self._say, partial(nodes.ask, name)))
            self._button("take", "Take over", self._take_over, "brown-9")
        if self.page.nodes is not None:
            with ui.element("div").classes("acts"):
                self.note = ui.input("Note or reason").props("outlined dense maxlength=500")
                self.note.on("keydown.enter", self._note)
                self._button("note", "Note it", self._note)
        self._label("answer", "said")
        self.rows["notes"] = (ui.element("div").classes("rows"), None)

    def _button(
        self, name: str, text: str, on_click: Callable[[], Any], color: str = "blue-10"
    ) -> None:
        button = ui.button(text, on_click=on_click)
        self.buttons[name] = button.props(f"unelevated no-caps color={color}")

    def _seek(self, bag: BagSource) -> None:
        seconds = (bag.end - bag.start) / NANOSECONDS_PER_SECOND

        async def seek(event: Any) -> None:
            instant = bag.start + round(event.args * NANOSECONDS_PER_SECOND)
            await asyncio.to_thread(bag.show, min(instant, bag.end))

        with ui.element("div").classes("seek"):
            slider = ui.slider(min=0, max=round(seconds, 2), step=0.05, value=round(seconds, 2))
            slider.props("color=blue-10").on("update:model-value", seek, throttle=0.2)
            self._label("instant", "big")
        if bag.lacking:
            self._label("lacking", "banner warn", f"Not in this bag: {', '.join(bag.lacking)}.")

    # What a click does

    async def _act(self, action: Callable[[], str]) -> bool:
        """Do what the operator requests and show the result; return whether it was done."""
        if not self.acts:
            self.answer = "Another browser is the operator: take over first."
            return False
        done, answer = await asyncio.to_thread(attempted, action)
        self.answer = answer if done else f"Refused: {answer}"
        return done

    def _take_over(self) -> None:
        if self.may_act:
            self.page.seat.take(self.browser)
            self.answer = ""

    async def _note(self) -> None:
        assert self.page.nodes is not None
        if one_line(self.note.value or ""):
            await self._say(self.page.nodes.note)

    async def _say(self, action: Callable[[str], str]) -> None:
        """Do something with the typed text: a note, or a reason."""
        if await self._act(partial(action, one_line(self.note.value or ""))):
            self.note.value = ""

    # How it is updated

    def tick(self) -> None:
        """Update the browser."""
        view = self.page.view()
        with view.lock:
            legs = (view.legs, view.side, view.pushes)
            if self.ticks % _WORDS == 0:
                self._words(view)
        if view.legs and legs != self.legs:
            self.legs = legs
            ui.run_javascript(f"entrain.legs({','.join(map(json.dumps, legs))})")
        if self.charts and self.ticks % _CHARTS == 0:
            version, options = self.page.chart_options()
            if version != self.version:
                self.version = version
                for chart, option in zip(self.charts, options, strict=True):
                    chart.options.clear()
                    chart.options.update(option)
                    chart.update()
        self.ticks += 1

    def _words(self, view: View) -> None:
        state, bag = view.state, self.page.bag
        self._set("part", view.part_words())
        self._set("stride", f"{state.stride} of {state.strides}" if state else "–")
        self._set("left", _clock(view.time_left()))
        self._set("measured", view.measured())
        if not view.blinded:
            verdict, figures = view.verdict_words()
            self._set("verdict", verdict)
            self.labels["verdict"].classes(replace=f"verdict {verdict.partition(' ')[0]}")
            self._set("figures", figures)
            self._set("lag", f"lag {view.lag()}")
        alarm = state.message if view.part == "failed" else ""
        if faults := view.faults():
            alarm = f"Robot: {faults}. Measured: {view.measured()}. {alarm}"
        self._set("alarm", alarm)
        if bag is not None:
            self._set("instant", _clock((view.now - bag.start) / NANOSECONDS_PER_SECOND))
        troubles = [("trouble", line) for line in view.troubles][-2:]
        self._rows("robot", view.robot_words() + troubles)
        self._rows("sensors", view.sensor_words())
        self._rows("record", self._record_words(view))
        self._rows("notes", [(_of_day(at), text) for at, _, text in view.notes][-3:])
        self._acting(view)

    def _acting(self, view: View) -> None:
        """Show who acts, and enable what can be done now."""
        if self.acts:
            seat = "You are the operator."
        elif not self.may_act:
            seat = "You are looking on. STOP also works here."
        elif not self.page.seat.holder:
            seat = "There is no operator yet."
        else:
            away = "" if self.page.seat.watched else " and is away"
            seat = f"Another browser is the operator{away}. STOP also works here."
        self._set("seat", seat)
        command, nodes = self.page.command, self.page.nodes
        offered = nodes.offered() if nodes is not None else set()
        going_on = view.going_on or (command is not None and command.runs)
        session, waits = view.session()
        self._set("session", session)
        self.labels["session"].classes(replace="said waits" if waits else "said")
        usable = {"preflight": not going_on, "start": not going_on, "note": True}
        for name, button in self.buttons.items():
            if name == "take":
                button.set_visibility(self.may_act and not self.acts)
            elif name in _OF_SESSION:
                button.set_visibility(name in offered and name != ("pause" if waits else "go_on"))
                button.set_enabled(self.acts)
            else:
                button.set_enabled(self.acts and usable.get(name, name in offered))
        lines = command.messages(outcome=not view.blinded) if command is not None else []
        self._set("answer", "\n".join([self.answer, *lines[-4:]]).strip())
        # The script must know this, and that what is shown is current.
        known = {"heartbeat": self.page.heartbeat, "acting": self.acts}
        ui.run_javascript(f"entrain.told({json.dumps(known)})")

    def _record_words(self, view: View) -> list[tuple[str, str]]:
        if self.page.bag is not None:
            return [("bag", self.page.bag.path.name), ("contents", self.page.bag.record)]
        nodes = {name.rpartition("/")[2]: state for name, state in view.nodes.items()}
        if (player := nodes.get("bag_player")) is not None:  # everything else heard was recorded
            return [("replay", player.message)]
        recorder = nodes.get("bag_recorder")
        rows = [("record", recorder.message if recorder else "no recorder heard")]
        if recorder and "messages" in recorder.values:
            rows.append(("messages", recorder.values["messages"]))
        if self.page.record:
            record = Path(self.page.record)  # which the recorder may not have made yet
            place = next(path for path in (record, *record.parents) if path.exists())
            free = shutil.disk_usage(place).free
            little = ": not much" if free < _LITTLE else ""
            rows.append(("disk", f"{free / 1e9:.1f} GB free{little}"))
        rows += [
            (name.rpartition("/")[2], f"{level}: {message}" if level != "ok" else message)
            for name, level, message in view.node_words()
            if not name.endswith(("bag_recorder", "operator_page", SESSION))
        ]
        return rows

    def _set(self, name: str, text: str) -> None:
        if self.labels[name].text != text:
            self.labels[name].set_text(text)

    def _rows(self, name: str, rows: Sequence[tuple[str, str]]) -> None:
        """Show names and values; the elements are rebuilt only if the names have changed."""
        element, cells = self.rows[name]
        keys = [key for key, _ in rows]
        if cells is None or [key for key, _ in cells] != keys:
            element.clear()
            cells = []
            with element:
                for key, value in rows:
                    ui.label(key)
                    cells.append((key, ui.label(value)))
            self.rows[name] = (element, cells)
        for (_, value), (_, label) in zip(rows, cells, strict=True):
            if label.text != value:
                label.set_text(value)
            bad = value.startswith(("error", "stale", "fault", "stopped"))
            label.classes(add="bad" if bad else "", remove="" if bad else "bad")


def _clock(seconds: float) -> str:
    """Return a time [s] as minutes and seconds."""
    if not seconds >= 0:
        return "–"
    return f"{int(seconds // 60)}:{int(seconds % 60):02d}"


def _of_day(stamp: int) -> str:
    return time.strftime("%H:%M:%S", time.localtime(stamp / NANOSECONDS_PER_SECOND))
