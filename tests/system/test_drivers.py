# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Robots other than the ideal one behind the perturbator; the kit and the stop from outside."""

import os
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest
from harness import (
    PROMISED_TOPICS,
    QUICK,
    Session,
    entrain_run,
    payloads,
    probe,
    scheduled_like_a_node,
    session,
    stamp_of,
)
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_srvs.srv import Trigger

from gait_entrainment.conventions import Side
from gait_entrainment.experiment import Part
from gait_entrainment.protocol import read_protocol
from gait_entrainment.simulation import simulate
from gait_entrainment_bags import BagReader
from gait_entrainment_bags.recorded_run import read_run
from gait_entrainment_bringup.node_list import STOP_ORDER
from gait_entrainment_commands.timing import timings_of
from gait_entrainment_msgs.msg import AnkleRobotState
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_nodes.messaging.topics import (
    DIAGNOSTICS,
    EXPERIMENT_STATE,
    OPERATOR_HEARTBEAT,
    ROBOT_STATE,
    TROUBLE,
)

SHORT = ("--baseline=2", "--pulses=3", "--washout=1")
WASHED_OUT = (*QUICK, "--baseline=2", "--pulses=2", "--washout=100000")
ARMED = ("--real-time", "--arm", "--unproved")
CONFIGURE = Transition.TRANSITION_CONFIGURE
CHANNEL = "239.74.163.2"


def entrain(domain, *arguments):
    """Run a command in this domain or its own; return exit code, standard output and error."""
    chosen = {} if domain is None else {"ROS_DOMAIN_ID": str(domain)}
    done = subprocess.run(
        ["entrain", *arguments],
        capture_output=True, text=True, check=False,
        env={**os.environ, **chosen},
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr


@contextmanager
def emulated_motor(tmp_path, *options, number=0):
    """Run the emulated motor with its own watchdog on; yield the driver's text and the trace."""
    port = 20_000 + (os.getpid() + number) % 20_000
    trace = tmp_path / f"trace{number}"
    process = subprocess.Popen(
        ["ak_motor_emulator", f"--port={port}", "--timeout=0.6", f"--trace={trace}", *options],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert "ready" in process.stdout.readline()
    try:
        # Long timeouts for a shared machine.
        yield (
            f"ak_mit_can:interface=udp_multicast,channel={CHANNEL},port={port},"
            "rate=200,silence=0.9,lateness=0.9,host_silence=1",
            trace,
        )
    finally:
        process.terminate()
        process.wait(10)
        process.stdout.close()


@pytest.fixture
def motor(tmp_path):
    """Yield what emulated_motor yields."""
    with emulated_motor(tmp_path) as given:
        yield given


def torques_of(trace):
    lines = [line.split() for line in trace.read_text().splitlines(keepends=True) if "\n" in line]
    return [float(line[2]) for line in lines]


def test_emulated_robot_walks_as_in_the_simulation_and_repeats_exactly(tmp_path):
    driver = "--driver=emulated:state_rate=250"
    options = (driver, "--seed=5", "--onset=measured", "--json", *SHORT)
    bags = [tmp_path / "first", tmp_path / "second"]
    for bag in bags:
        with entrain_run(bag, *options) as run:
            outcome = run.outcome()
    with BagReader(bags[0]) as reader:
        events = [message for _, message in reader.decoded(["/gait_events"])]
        protocol = read_protocol(reader.custom_data["protocol"])
    simulation = simulate(protocol, timings_of=timings_of, measured_onsets=True)
    walked = [stamp_of(event.header) - stamp_of(events[0].header) for event in events]
    assert walked == [event.stamp for event in simulation.events]
    # Commanded, sent and measured onset of each pulse are in the bag.
    late = [
        [(t.sent - t.commanded, t.measured - t.commanded) for t in timings]
        for timings in (read_run(bags[0]).timings, simulation.timings)
    ]
    assert late[0] == late[1]
    assert len(late[0]) == 3
    first, second = (payloads(bag, PROMISED_TOPICS) for bag in bags)
    assert first == second
    assert len(first["/perturbator/state"]) > 250 * 10
    timing = outcome["pulse_timing"]
    assert timing["measured"]["pulses"] == 3
    assert 5 < timing["measured"]["median_ms"] < 20
    # Online, offline and simulated analyses all use the measured onsets, not the commanded ones.
    offline = read_run(bags[0], torques=False)
    assert (offline.onset, offline.differences) == ("measured", ())
    lags = [pulse.phase_lag for pulse in simulation.analysis.pulses]
    assert [pulse["phase_lag"] for pulse in outcome["pulses"]] == lags
    assert [pulse.phase_lag for pulse in offline.analysis.pulses] == lags
    commanded = read_run(bags[0], torques=False, onset="commanded")
    assert all(
        measured - pulse.phase_lag > 0.005
        for measured, pulse in zip(lags, commanded.analysis.pulses, strict=True)
    )
    assert commanded.differences == ()
    code, out, err = entrain(None, "replay", str(bags[0]))
    assert (code, err) == (0, ""), out
    assert "the same, byte for byte" in out


def test_motor_on_a_bus_delivers_the_experiment_in_real_time(tmp_path, motor):
    driver, trace = motor
    bag = tmp_path / "bag"
    walk = ("--real-time", "--arm-later", "--unproved", "--json", *SHORT)
    with entrain_run(bag, f"--driver={driver}", *walk) as run:
        with probe(run.domain()) as listener:
            armed = listener.client.call(
                Trigger, "perturbator/arm", accept=lambda answer: answer.success
            )
        outcome = run.outcome()
    assert "torque is possible from now on" in armed.message
    assert len(outcome["pulses"]) == 3
    assert outcome["pulse_timing"]["measured"]["pulses"] == 3
    assert outcome["pulse_timing"]["sent"]["median_ms"] > 0
    # A real robot's first pulses rise in steps of a sixth, unless the protocol says otherwise.
    assert max(torques_of(trace)) == pytest.approx(3 / 6 * 13.35, abs=0.2)
    with BagReader(bag) as reader:
        pulses = [message.torque for _, message in reader.decoded(["/perturbation/pulses"])]
        *_, (_, setup) = reader.decoded(["/perturbator/setup"])
    assert pulses == pytest.approx([13.35 / 6, 13.35 / 3, 13.35 / 2], abs=0.01)
    assert setup.driver == driver
    assert setup.armed_by.endswith("by the service ~/arm")
    limits = dict(zip(setup.limit_names, setup.limits, strict=True))
    assert (limits["rate"], limits["rising"]) == (pytest.approx(1334.6, abs=0.1), 5.0)
    assert torques_of(trace)[-1] == pytest.approx(0.0, abs=0.1)
    with BagReader(bag) as reader:
        delivered = [m.delivered[1] for _, m in reader.decoded(["/ankle_torque"])]
        faults = [m.faults for _, m in reader.decoded(["/perturbator/state"]) if m.faults]
    # What the walker felt is what the motor measured.
    assert max(delivered) == pytest.approx(13.35 / 2, abs=0.3)
    assert faults == []


SESSION = """
study: two_ankles
person: {{code: P01, mass: 10, leg_length: 0.25}}
limits: {{torque: 3, rate: 100, rising: 1}}
rest: 0
protocol:
  driver: "{driver}"
  baseline: 2
  washout: 0
  pulses: {{count: 1, torque: 1}}
blocks:
  - {{name: one leg}}
  - {{name: both legs, protocol: {{side: both}}}}
"""


def test_a_session_runs_with_a_motor_on_each_ankle(tmp_path):
    session, study = tmp_path / "session.yaml", tmp_path / "study"
    motors = [emulated_motor(tmp_path, number=number) for number in (0, 1)]
    with motors[0] as (left, left_trace), motors[1] as (right, right_trace):
        options = [text.partition(":")[2].split(",") for text in (left, right)]
        ports = [f"left.{options[0][2]}", f"right.{options[1][2]}"]
        driver = ",".join([*left.split(",")[:2], *ports, *options[0][3:]])
        session.write_text(SESSION.format(driver=driver))
        done = entrain(None, "session", str(session), "--out", str(study), *ARMED)
    assert done[0] == 0, done
    folder = study / "sub-P01/ses-1"
    rows = [row.split("\t") for row in (folder / "events.tsv").read_text().splitlines()]
    pulses = [(row[3], row[7], row[8]) for row in rows if row[6] == "pulse"]
    # Robots and middleware decide which ankle's pulse comes, and is published, first.
    both = [("both legs", "left", "1"), ("both legs", "right", "1")]
    assert [pulses[0], *sorted(pulses[1:])] == [("one leg", "right", "1"), *both]
    # On each ankle the first pulse is half as high.
    assert max(torques_of(right_trace)) == pytest.approx(0.5, abs=0.1)
    assert max(torques_of(left_trace)) == pytest.approx(0.5, abs=0.1)
    recorded = read_run(folder / "bags/block-02")
    assert recorded.differences == ()
    assert sorted(side for side, _ in recorded.delivered) == [Side.LEFT, Side.RIGHT]
    assert all(timing.measured is not None for _, timing in recorded.delivered)


def test_the_motors_own_watchdog_ends_the_torque_of_a_killed_perturbator(tmp_path, motor):
    driver, trace = motor
    pulses = ("--torque=8", "--width=0.4", "--limit-rising=1", *SHORT)
    options = (f"--driver={driver}", *ARMED, *pulses)
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


def test_frozen_command_ends_the_torque_despite_the_heartbeat_of_a_page(tmp_path, motor):
    driver, trace = motor
    quick = (*QUICK, "--baseline=4", "--limit-rising=1")
    options = (f"--driver={driver}", *ARMED, *quick, "--heartbeat")
    beats = OPERATOR_HEARTBEAT
    with (
        entrain_run(tmp_path / "bag", *options) as run,
        scheduled_like_a_node(),
        probe(run.domain()) as page,
    ):
        states, troubles = page.listen(ROBOT_STATE), page.listen(TROUBLE)
        heart = page.node.create_publisher(beats.type, beats.name, beats.qos)

        def beat_until(condition):
            def beat():
                heart.publish(beats.type(data="operator_page"))
                return condition()

            page.until(beat, "the condition", 120)

        beat_until(lambda: states and states[-1].measured_torque > 2)
        run.process.send_signal(signal.SIGSTOP)
        beat_until(lambda: troubles)
        assert "operator_silent: entrain_run silent for 0.3 s" in troubles[0].message
        beat_until(lambda: abs(torques_of(trace)[-1]) < 0.1)
        run.process.send_signal(signal.SIGCONT)
        assert run.wait() == 1
        assert "operator_silent: entrain_run silent" in run.text


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            ["--driver=ak_mit_can:interface=virtual,channel=nobody", *ARMED],
            "perturbator refused to be configured: motor 1 does not answer .* check its power",
        ),
        (
            ["--driver=emulated:peak_torque=5", *SHORT],
            "perturbator: pulse train rejected: torque: 13.* more than the .*; allowed: -5 to 5",
        ),
    ],
)
def test_refusal_by_a_robot_in_a_run_is_reported_in_one_line(tmp_path, options, words):
    with entrain_run(tmp_path / "bag", *options) as run:
        assert run.wait() == 1
        assert re.fullmatch(f"entrain run: {words}.*; the bag .*\n", run.text)
    with BagReader(run.bag) as reader:
        torques = [m.commanded_torque for _, m in reader.decoded(["/perturbator/state"])]
    assert not any(torques)


def test_node_refuses_a_real_robot_in_simulated_time(tmp_path):
    with claimed_domain() as domain:
        nodes = Session(tmp_path, domain, ["--driver=ak_mit_can"], real_time=True)
        nodes.arguments += ["-p", "use_sim_time:=true"]
        try:
            nodes.start("perturbator")
            heard = nodes.probe.listen(DIAGNOSTICS)
            request = ChangeState.Request(transition=Transition(id=CONFIGURE))
            assert not nodes.probe.call(ChangeState, "perturbator/change_state", request).success
            status = nodes.probe.until(lambda: heard and heard[-1].status[0], "a reason")
        finally:
            nodes.probe.client.close()
            nodes.supervisor.stop(STOP_ORDER)
    assert status.message == "driver: ak_mit_can runs in real time only: use_sim_time must be off"


def assert_failed_in_washout(run, words, status):
    """Check that a run ended with one line and left a readable bag that shows stop and status."""
    assert run.wait() == 1
    assert re.fullmatch(f"entrain run: .*{words}.*; the bag .*\n", run.text)
    topics = ["/experiment/state", "/perturbator/state", "/perturbation/torque_profile"]
    with BagReader(run.bag) as reader:
        phases, states, profiles = ([m for _, m in reader.decoded([topic])] for topic in topics)
    assert [state.phase for state in phases[-2:]] == [Part.WASHOUT, Part.FAILED]
    assert states[-1].status == status
    assert sum(profile.stop for profile in profiles) == 1


def test_stop_in_the_washout_fails_the_run(tmp_path):
    with entrain_run(tmp_path / "bag", "--real-time", *WASHED_OUT) as run:
        with probe(run.domain()) as listener:
            states = listener.listen(EXPERIMENT_STATE)
            listener.until(lambda: states and states[-1].phase == Part.WASHOUT, "washout")
            assert listener.call(Trigger, "perturbator/stop").success
        words = "perturbator: latched: stopped: the stop service was called"
        assert_failed_in_washout(run, words, AnkleRobotState.STOPPED)


def test_device_fault_in_the_washout_fails_the_run(tmp_path):
    with emulated_motor(tmp_path, "--error=2", "--error-after=2.5") as (driver, _):
        options = (f"--driver={driver}", *ARMED, *WASHED_OUT)
        with entrain_run(tmp_path / "bag", *options) as run:
            words = "perturbator: latched: over_current: The motor reports over-current."
            assert_failed_in_washout(run, words, AnkleRobotState.FAULT)


@pytest.mark.parametrize(
    ("driver", "options"), [("ideal", []), ("emulated:state_rate=100", ["--real-time"])]
)
def test_kit_from_outside_finds_every_promise_kept(tmp_path, driver, options):
    with session(tmp_path, f"--driver={driver}", nodes=("perturbator",), strangers=True) as nodes:
        domain = nodes.probe.node.context.get_domain_id()
        code, out, err = entrain(domain, "driver", "check", "--node", "perturbator", *options)
        assert (code, err) == (0, ""), out
        assert "17 promises kept, 0 broken" in out


BROKEN_NODE = """
import sys
from gait_entrainment_nodes.nodes import perturbator
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.nodes.loop import run_node

class Broken(perturbator.Perturbator):
    {fault}

sys.exit(run_node(Broken))
"""
FAULTS = {
    "stop and cancelling without effect": (
        "def on_stop_service(self, _, response): return response\n"
        "    def on_cancel(self): pass",
        {"stopping_in_mid_pulse": "No profile with the stop flag",
         "cancelling": "No profile with the stop flag"},
    ),
    "neither pulses nor states": (
        "def publish(self, topic, message):\n"
        "        if topic not in (topics.PULSES, topics.ROBOT_STATE):\n"
        "            super().publish(topic, message)",
        {"pulses": r"Pulses were announced at \[\]", "states": "No state shows"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_kit_from_outside_finds_a_broken_node(tmp_path, fault):
    code_text, broken = FAULTS[fault]
    script = tmp_path / "broken.py"
    script.write_text(BROKEN_NODE.format(fault=code_text))
    with claimed_domain() as domain:
        node = subprocess.Popen(
            [sys.executable, str(script)],
            env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
            stderr=subprocess.DEVNULL,
        )
        try:
            only = ("--only", ",".join(["idle", *broken]))
            code, out, err = entrain(domain, "driver", "check", "--node", "perturbator", *only)
        finally:
            node.terminate()
            node.wait(10)
    assert code == 1
    for check, words in broken.items():
        assert re.search(f"BROKEN {check}: .*\n.*{words}", out), out
    assert "kept   idle: " in out
    assert "1 promises kept, 2 broken" in out
    assert err.count("\n") == 1


UNSTOPPABLE_NODE = """
import sys
from gait_entrainment.robot import drivers
from gait_entrainment.robot.ideal import IdealAnkleRobot
from gait_entrainment_nodes.nodes import perturbator

class Unstoppable(IdealAnkleRobot):
    def stop(self):
        raise OSError("bus gone")

sys.modules["unstoppable"] = sys.modules["__main__"]
drivers.OWN_DRIVERS["unstoppable"] = "unstoppable:Unstoppable"
sys.exit(perturbator.main())
"""


def test_driver_that_cannot_stop_ends_the_process_without_confirming_a_stop(tmp_path):
    script = tmp_path / "unstoppable.py"
    script.write_text(UNSTOPPABLE_NODE)
    with claimed_domain() as domain, probe(domain) as listener:
        node = subprocess.Popen(
            [sys.executable, str(script), "--ros-args", "-p", "driver:=unstoppable"],
            env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            configure = ChangeState.Request(transition=Transition(id=CONFIGURE))
            assert listener.call(ChangeState, "perturbator/change_state", configure).success
            answer = listener.call(Trigger, "perturbator/stop")
            assert not answer.success
            assert "cut the power" in answer.message
            _, err = node.communicate(timeout=10)
        finally:
            node.kill()
    assert node.returncode == 1
    assert "cut the power" in err
