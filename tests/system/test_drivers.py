# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Other robots than the ideal one behind the perturbator; the kit and the stop from outside."""

import os
import re
import signal
import subprocess
import sys
import time

import pytest
from harness import PROMISED_TOPICS, entrain_run, payloads, probe, session, stamp_of

from gait_entrainment.bags import BagReader
from gait_entrainment.protocol import read_protocol
from gait_entrainment.report.pulse_timing import recorded_timings
from gait_entrainment.simulation import simulate
from gait_entrainment_nodes.domain import claimed_domain
from gait_entrainment_nodes.topics import ROBOT_STATE

SHORT = ("--baseline=2", "--pulses=3", "--washout=1")
CHANNEL = "239.74.163.2"


def entrain(domain, *arguments):
    """Run one command in a domain; return exit code, standard output and error."""
    done = subprocess.run(
        ["entrain", *arguments],
        capture_output=True, text=True, check=False,
        env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr


@pytest.fixture
def motor(tmp_path):
    """Run the emulated motor, its own watchdog on; gives the driver's text and the trace."""
    port = 20_000 + os.getpid() % 20_000
    trace = tmp_path / "trace"
    process = subprocess.Popen(
        ["ak_motor_emulator", "--port", str(port), "--timeout", "0.1", "--trace", str(trace)],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert "ready" in process.stdout.readline()
    # Patience for a machine that others share.
    yield (
        f"ak_mit_can:interface=udp_multicast,channel={CHANNEL},port={port},"
        "rate=200,silence=0.9,lateness=0.9",
        trace,
    )
    process.terminate()
    process.wait(10)
    process.stdout.close()


def torques_of(trace):
    lines = [line.split() for line in trace.read_text().splitlines(keepends=True) if "\n" in line]
    return [float(line[2]) for line in lines]


def test_emulated_robot_walks_as_in_the_simulation_and_twice_the_same(tmp_path):
    options = ("--driver=emulated:state_rate=250", "--seed=5", "--json", *SHORT)
    bags = [tmp_path / "first", tmp_path / "second"]
    for bag in bags:
        with entrain_run(bag, *options) as run:
            outcome = run.outcome()
    with BagReader(bags[0]) as reader:
        events = [message for _, message in reader.decoded(["/gait_events"])]
        simulation = simulate(read_protocol(reader.custom_data["protocol"]))
    walked = [stamp_of(event.header) - stamp_of(events[0].header) for event in events]
    assert walked == [event.stamp for event in simulation.events]
    # Commanded, sent and measured onset of each pulse are in the bag.
    late = [
        [(t.sent - t.commanded, t.measured - t.commanded) for t in timings]
        for timings in (recorded_timings(bags[0]), simulation.timings)
    ]
    assert late[0] == late[1]
    assert len(late[0]) == 3
    first, second = (payloads(bag, PROMISED_TOPICS) for bag in bags)
    assert first == second
    assert len(first["/perturbator/state"]) > 250 * 10
    timing = outcome["pulse_timing"]
    assert timing["measured"]["pulses"] == 3
    assert 5 < timing["measured"]["median_ms"] < 20


def test_motor_on_a_bus_delivers_the_experiment_in_real_time(tmp_path, motor):
    driver, trace = motor
    bag = tmp_path / "bag"
    with entrain_run(bag, f"--driver={driver}", "--real-time", "--arm", "--json", *SHORT) as run:
        outcome = run.outcome()
    assert len(outcome["pulses"]) == 3
    assert outcome["pulse_timing"]["measured"]["pulses"] == 3
    assert outcome["pulse_timing"]["sent"]["median_ms"] > 0
    assert max(torques_of(trace)) == pytest.approx(13.35, abs=0.2)
    assert torques_of(trace)[-1] == pytest.approx(0.0, abs=0.1)
    with BagReader(bag) as reader:
        delivered = [m.delivered[1] for _, m in reader.decoded(["/ankle_torque"])]
        faults = [m.faults for _, m in reader.decoded(["/perturbator/state"]) if m.faults]
    # What the walker felt is what the motor measured.
    assert max(delivered) == pytest.approx(13.35, abs=0.3)
    assert faults == []


def test_killed_perturbator_leaves_zero_torque_by_the_motors_own_watchdog(tmp_path, motor):
    driver, trace = motor
    options = (f"--driver={driver}", "--real-time", "--arm", "--torque=8", "--width=0.4", *SHORT)
    with entrain_run(tmp_path / "bag", *options) as run:
        pid = run.find_nodes()["perturbator"]
        with probe(run.domain()) as listener:
            states = listener.listen(ROBOT_STATE)
            listener.until(lambda: states and states[-1].measured_torque > 7, "torque", 120)
        os.kill(pid, signal.SIGKILL)
        assert run.wait() == 1
        assert "perturbator ended unexpectedly" in run.text
    deadline = time.monotonic() + 10
    while abs(torques_of(trace)[-1]) > 0.1:
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        ([], 2, "runs in real time only; add --real-time"),
        (["--real-time"], 2, "applies real torque.*--arm"),
        (["--real-time", "--arm"], 1, "perturbator refused to be configured"),
    ],
)
def test_real_robot_is_not_started_by_mistake(tmp_path, options, code, words):
    driver = "ak_mit_can:interface=virtual,channel=nobody"
    with entrain_run(tmp_path / "bag", f"--driver={driver}", *options) as run:
        assert run.wait() == code
        assert re.search(words, run.text)
        if code == 1:
            assert "motor 1 does not answer" in run.text


@pytest.mark.parametrize("driver", ["ideal", "emulated:state_rate=100"])
def test_kit_from_outside_finds_every_promise_kept(tmp_path, driver):
    with session(tmp_path, f"--driver={driver}", nodes=("perturbator",)) as nodes:
        domain = nodes.probe.node.context.get_domain_id()
        code, out, err = entrain(domain, "driver", "check", "--node", "perturbator")
        assert (code, err) == (0, ""), out
        assert "9 promises kept, 0 broken" in out


BROKEN_NODE = """
import sys
from gait_entrainment_nodes import perturbator
from gait_entrainment_nodes.node import run_node

class Broken(perturbator.Perturbator):
    {fault}

sys.exit(run_node(Broken, sys.argv))
"""
FAULTS = {
    "stop without effect": (
        "def on_stop_service(self, _, response):\n        return response",
        "stopping: .*\n.*No profile with the stop flag",
    ),
    "cancelling without effect": (
        "def on_cancel(self, _):\n        return perturbator.CancelResponse.ACCEPT",
        "cancelling: .*\n.*No profile with the stop flag",
    ),
    "pulses not announced": (
        "def announce_pulse(self, *_):\n        pass",
        r"pulses: .*\n.*Pulses at \[\] were announced",
    ),
    "states missing": (
        "def publish_state(self, _):\n        pass",
        "states: .*\n.*No state shows",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_kit_from_outside_finds_a_broken_node(tmp_path, fault):
    code_text, words = FAULTS[fault]
    script = tmp_path / "broken.py"
    script.write_text(BROKEN_NODE.format(fault=code_text))
    with claimed_domain() as domain:
        node = subprocess.Popen(
            [sys.executable, str(script)],
            env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
            stderr=subprocess.DEVNULL,
        )
        try:
            code, out, err = entrain(domain, "driver", "check", "--node", "perturbator")
        finally:
            node.terminate()
            node.wait(10)
    assert code == 1
    assert re.search("BROKEN " + words, out), out
    assert err.count("\n") == 1


def test_stop_from_the_command_line_ends_a_run(tmp_path):
    with entrain_run(tmp_path / "bag", "--real-time", "--baseline=2") as run:
        run.wait_for_stride(2)
        code, out, err = entrain(run.domain(), "stop")
        assert code == 0, out + err
        assert "/perturbator/stop: torque is zero, latched" in out
        assert run.wait() == 1
        assert "the stop service was called" in run.text


def test_stop_that_finds_nobody_says_so():
    with claimed_domain() as domain:
        code, out, err = entrain(domain, "stop")
    assert (code, out) == (1, "")
    assert "no perturbator was found" in err
