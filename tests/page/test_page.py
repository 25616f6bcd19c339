# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The operator's page in a real browser: followed, acted on, reloaded, shared, lost and found."""

import subprocess
import sys
import time
from pathlib import Path

from browser import chromium
from harness import QUICK, probe
from pages import Look, free_port, page, request, until_served

from gait_entrainment_bags import BagReader
from gait_entrainment_nodes.messaging.topics import OPERATOR_HEARTBEAT, OPERATOR_NOTES

BAG = Path(__file__).parents[2] / "bags/paper_example"
NOTE = "slowed <b>down</b> at the end"


def test_a_run_is_started_noted_shared_reloaded_and_followed_to_its_end(tmp_path, browser):
    walk = (*QUICK, "--real-time", "--baseline=4", "--pulses=14", "--washout=2")
    bag = tmp_path / "bag"
    with (
        page(tmp_path, *walk, f"--out={bag}") as served,
        chromium() as tablet,
    ):
        operator = Look(browser, served.port)
        operator.until("You are the operator", "no run")
        other = Look(tablet, served.port)
        other.until("Another browser is the operator")
        operator.click("Start")
        operator.until("entrain run has started", "of 20", "pulses")
        operator.note(NOTE)
        operator.until(NOTE)  # as text, not as what it says in HTML
        browser.refresh()
        operator.until("You are the operator", "of 20", NOTE)
        other.click("Take over")
        other.until("You are the operator")
        operator.until("Another browser is the operator")
        other.until("finished", "20 of 20")
        other.until("entrain run has ended with exit code 0")
        assert "no verdict yet" not in other.text
    with BagReader(bag) as reader:
        notes = [message.text for _, message in reader.decoded([f"/{OPERATOR_NOTES.name}"])]
        assert reader.custom_data["messages_lost"] == "{}"
    assert notes == [NOTE]


def test_closing_the_page_that_is_the_heartbeat_ends_it(tmp_path):
    driver = "ak_mit_can:interface=udp_multicast,port=1"
    real = ("--real-time", "--arm", "--unproved", f"--driver={driver}", "--heartbeat")
    with page(tmp_path, *real, ROS_DOMAIN_ID="99") as served, probe(99) as listener:
        beats = listener.listen(OPERATOR_HEARTBEAT)
        with chromium() as browser:
            look = Look(browser, served.port)
            look.until("closing, hiding or leaving it ends the robot's torque")
            listener.until(lambda: len(beats) > 20, "heartbeats")
        quiet = [len(beats), time.monotonic()]

        def silent():
            if len(beats) > quiet[0]:
                quiet[:] = len(beats), time.monotonic()
            return time.monotonic() - quiet[1] > 1.0

        listener.until(silent, "the end of the heartbeat")


def test_ten_thousand_strides_leave_the_page_as_small(browser):
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


def test_a_bag_is_scrubbed_and_a_clock_that_is_off_is_told(tmp_path, browser):
    with page(tmp_path, f"--bag={BAG}") as served:
        # As a browser whose clock is an hour ahead.
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


def test_who_may_not_is_told_so_in_one_line(tmp_path):
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
