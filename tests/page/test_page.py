# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The operator's page in a real browser: display, actions, reloading, two browsers, no server."""

import subprocess
import sys
from pathlib import Path

from browser import chromium
from pages import Look, free_port, page, request, until_served
from test_drivers import emulated_motor

from gait_entrainment_bags import BagReader
from gait_entrainment_drivers.proof import keep_proof
from gait_entrainment_nodes.messaging.topics import OPERATOR_NOTES
from gait_entrainment_sessions.folder import SessionFolder

BAG = Path(__file__).parents[2] / "bags/paper_example"
NOTE = "slowed <b>down</b> at the end"
SESSION = """\
study: pilot
person: {code: P01, mass: 5, leg_length: 1}
limits: {torque: 6}
blind: true
rest: 0
protocol:
  driver: "DRIVER"
  walker: {gravity: 156.96, mass: 5, ankle_stiffness: 87.3}
  baseline: 2
  pulses: {count: 20, torque: 5, width: 0.05, period_offset: -0.0125}
  washout: 1
blocks: [{name: pulses}]
"""


def test_a_blinded_session_with_a_robot_is_conducted_from_the_page(tmp_path, browser, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    file, study = tmp_path / "session.yaml", tmp_path / "study"
    with emulated_motor(tmp_path) as (driver, _), chromium() as tablet:
        keep_proof(driver, 0.1)
        file.write_text(SESSION.replace("DRIVER", driver))
        words = ("--session", str(file), "--real-time", "--arm", f"--out={study}")
        with page(tmp_path, *words) as served:
            operator = Look(browser, served.port)
            operator.until("You are the operator", "no run", "Blinded: torque")
            operator.click("Preflight")
            operator.until("press the stop")
            browser.find_element("id", "stop").click()
            operator.until("fit for a session", "entrain preflight has ended with exit code 0")
            operator.click("Start")
            operator.until("block 1 of 1", "baseline")
            operator.click("Arm")
            shown = operator.until("torque is possible from now on", "hidden")
            assert "N m" not in shown.replace("torque 6 N m", "")
            operator.note(NOTE)
            operator.until(NOTE)  # as text, not as HTML
            operator.type("belt stopped")
            operator.click("Pause before the next block")
            operator.until("then a pause: belt stopped")
            browser.refresh()
            operator.until("You are the operator", "of 23", NOTE, "then a pause: belt stopped")
            other = Look(tablet, served.port)
            other.until("Another browser is the operator", "paused before the end: belt stopped")
            other.click("Take over")
            other.until("You are the operator")
            operator.until("Another browser is the operator")
            other.click("Repeat the block")
            other.until("Refused: repeat: a repetition needs a reason")
            other.type("belt stopped")
            other.click("Repeat the block")
            other.until("block 1 is the next one again")
            other.click("Go on")
            operator.until("entrain session has ended with exit code 0", "finished", "23 of 23")
    folder = SessionFolder(study / "sub-P01/ses-1")
    entries = [(e.what, e.block, e.text) for e in folder.ledger]
    assert [entry for entry in entries if entry[0] in ("note", "pause", "repeat", "go on")] == [
        ("note", "1", NOTE),
        ("pause", "1", "belt stopped"),
        ("repeat", "1", "belt stopped"),
        ("go on", "1", ""),
    ]
    assert [text.partition(": ")[2] for what, _, text in entries if what == "preflight"] == [
        "passed", "passed",
    ]  # fmt: skip
    assert [e.bag for e in folder.ledger if e.what == "done"] == ["block-01", "block-01_run-2"]
    notes = []
    for bag in ("block-01", "block-01_run-2"):
        with BagReader(folder.path / "bags" / bag) as reader:
            topics = [name for name in reader.topics if name == f"/{OPERATOR_NOTES.name}"]
            notes.append([m.text for _, m in reader.decoded(topics)] if topics else [])
            assert reader.custom_data["messages_lost"] == "{}"
    assert notes == [[NOTE], []]


def test_ten_thousand_strides_do_not_grow_the_page(browser):
    port = free_port()
    program = Path(__file__).with_name("serve_strides.py")
    with subprocess.Popen(
        [sys.executable, program, str(port)], stdin=subprocess.PIPE, text=True
    ) as served:
        try:
            until_served(port)
            look = Look(browser, port)
            look.until("100 of 10000")
            nodes = "return document.querySelectorAll('*').length"
            before = browser.execute_script(nodes)
            served.stdin.write("go on\n")
            served.stdin.flush()
            look.until("10000 of 10000", "time left\n0:00")
            assert browser.execute_script(nodes) <= before + 20
        finally:
            served.kill()


def test_a_bag_is_scrubbed_and_a_wrong_browser_clock_is_reported(tmp_path, browser):
    with page(tmp_path, f"--bag={BAG}") as served:
        # Imitates a browser whose clock is an hour ahead.
        ahead = "const now = Date.now; Date.now = () => now() + 3600e3;"
        browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": ahead})
        look = Look(browser, served.port)
        look.until("entrained since stride 29", "80 of 80", "STOP")
        look.until("The clock of this browser is ahead by 3600")
        thumb = browser.find_element("css selector", ".q-slider__focus-ring, .q-slider")
        browser.execute_script(
            "const box = arguments[0].closest('.q-slider').getBoundingClientRect();"
            "for (const kind of ['mousedown', 'mouseup'])"
            "  document.elementFromPoint(box.x + box.width / 4, box.y + box.height / 2)"
            "    .dispatchEvent(new MouseEvent(kind, {bubbles: true, view: window,"
            "      clientX: box.x + box.width / 4, clientY: box.y + box.height / 2}));",
            thumb,
        )
        look.until("pulses", "19 of 80")
        browser.execute_script("window.socket.disconnect()")
        look.until("What you see is old: nothing comes from the page's server. STOP works.")


def test_refused_requests_and_a_port_in_use_are_one_line(tmp_path):
    with page(tmp_path, f"--bag={BAG}", "--token=letmeactnow") as served:
        assert request(served.port) == (
            401, "this page asks for a token: open the address that entrain page has printed"
        )  # fmt: skip
        status, text = request(served.port, "/?token=nonsense")
        assert (status, text.partition(":")[0]) == (401, "the token is wrong")
        assert request(served.port, "/?token=letmeactnow")[0] == 303
        assert request(served.port, "/stop", "POST", Origin="http://evil.example")[0] == 403
        taken = subprocess.run(
            ["entrain", "page", f"--bag={BAG}", f"--port={served.port}"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
    assert (taken.returncode, taken.stdout) == (2, "")
    assert f"--port: {served.port} is taken" in taken.stderr
    assert len(taken.stderr.splitlines()) == 1


def test_the_web_server_is_loaded_only_if_it_runs():
    program = (
        "import sys; from gait_entrainment_commands import main\n"
        "for words in (['--help'], ['run', '--help'], ['page', '--help']):\n"
        "    try: main(words)\n"
        "    except SystemExit: pass\n"
        "loaded = {'nicegui', 'fastapi', 'uvicorn', 'rclpy'} & sys.modules.keys()\n"
        "sys.exit(', '.join(loaded) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
