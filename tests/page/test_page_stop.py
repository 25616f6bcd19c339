# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""STOP on the page and its heartbeat, in a real browser: both end a motor's torque."""

import os
import re
import signal
import time

from harness import entrain_run
from pages import Look, free_port, page, until_served
from test_drivers import emulated_motor
from time_to_zero import GONE, HEIGHT, WALK, rows_of, wait_for_pulse

from gait_entrainment_bringup.node_list import NODES, PAGE

# A pulse comes every 470 ms: torque that lasts longer than that has not ended.
PERIOD_MS = 470


def test_a_page_that_dies_harms_no_run_and_stop_on_the_next_one_ends_the_torque(tmp_path, browser):
    port = free_port()
    with emulated_motor(tmp_path) as (driver, trace):
        walk = (*WALK, "--pulses=300")
        options = (f"--driver={driver}", *walk, "--page", f"--port={port}")
        with entrain_run(tmp_path / "bag", *options) as run:
            domain = run.domain()
            until_served(port, run)
            look = Look(browser, port)
            look.until("pulses", "ak_mit_can")
            served = run.find_nodes((*NODES, PAGE))[PAGE]
            os.kill(served, signal.SIGSTOP)
            browser.find_element("id", "stop").click()
            look.until("STOP: no answer yet. Use the switch in your hand, or cut the power.")
            os.kill(served, signal.SIGKILL)
            look.until("No connection to the page's server", "STOP does not work from here")
            assert run.process.poll() is None, run.text
            with page(tmp_path, port=port, ROS_DOMAIN_ID=str(domain)):
                look.until_not("No connection to the page's server")
                look.until("pulses", "You are the operator")
                since = look.press_stop(lambda: wait_for_pulse(run, trace, 1))
                answer = look.until("STOP:", "measured)", "the stop is latched")
                assert run.wait() == 1
                look.until("failed", "latched: stopped")
    rows = [row for row in rows_of(trace) if row[0] >= since]
    pushing = [at for at, _, torque in rows if abs(torque) > GONE]
    print(f"zero after {(max(pushing, default=since) - since) / 1e6:.0f} ms")
    assert not pushing or (pushing[-1] - since) / 1e6 < PERIOD_MS
    assert max(command for at, command, _ in rows if at > since + PERIOD_MS * 10**6) < HEIGHT / 2
    # The page shows what the loop measured when it answered.
    assert re.search(r"motor\S*: torque .*\([-+]\d+\.\d\d N m measured\)", answer), answer


def test_leaving_a_page_with_the_heartbeat_ends_the_torque_and_the_run_reports_it(
    tmp_path, browser
):
    with emulated_motor(tmp_path) as (driver, trace):
        options = (f"--driver={driver}", *WALK, "--pulses=300", "--heartbeat")
        with page(tmp_path, *options, f"--out={tmp_path / 'bag'}") as served:
            look = Look(browser, served.port)
            look.until("closing, hiding or leaving it ends the robot's torque")
            look.click("Start")
            look.until("pulses", "ak_mit_can")
            assert wait_for_pulse(served, trace, 1), look.text
            browser.switch_to.new_window("tab")  # in front of it
            since = time.time_ns()
            look = Look(browser, served.port)
            shown = look.until("entrain run has ended with exit code 1")
    assert "operator" in shown.partition("Operator")[0]
    late = [torque for at, _, torque in rows_of(trace) if at > since + PERIOD_MS * 10**6]
    assert max(map(abs, late)) < GONE
