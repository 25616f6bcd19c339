# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The whole experiment in one process, without ROS: the same parts in the same chain of promises.

Conductor, ankle robot and walker are the objects that the nodes hold, driven in the order in
which a lock-step run drives them. So both give the same events to the nanosecond.
"""

from dataclasses import dataclass

from gait_entrainment.experiment import Conductor
from gait_entrainment.gait import GaitEvent, VerdictSettings
from gait_entrainment.protocol import Protocol
from gait_entrainment.robot import (
    GuardedRobot,
    LimitError,
    MeasuredOnsets,
    PulseTrain,
    find_driver,
)
from gait_entrainment.run import Run, analyze_blocks
from gait_entrainment.walker import Ending, Walker


@dataclass(frozen=True)
class Simulation(Run):
    """What came of a simulated experiment; stamps count from its start."""

    protocol: Protocol
    train: PulseTrain | None  # as requested in the last block; None if nobody walked so far
    ending: Ending | None  # fall or fly-off; None if every stride was walked


def simulate(
    protocol: Protocol,
    settings: VerdictSettings | None = None,
    *,
    measured_onsets: bool = False,
) -> Simulation:
    """
    Conduct a protocol on the simulated walker.

    With ``measured_onsets`` the analysis takes the onset of each pulse from the torque that the
    robot measured, if that shows one, instead of from the command.

    Raises LimitError if the driver is unknown or the pulses are outside the protocol's limits,
    ProtocolError if the pulses would overlap at the measured period.
    """
    robot = begun_robot(protocol)
    conductor = Conductor(protocol)
    walker = Walker(protocol.walker, protocol.side, None, protocol.variation, protocol.seed)
    ended = False
    events: list[GaitEvent] = []
    onsets: list[int] = []
    measured = MeasuredOnsets()
    while not ended:
        horizon = conductor.horizon(walker.time_reached)
        profile = robot.promise(horizon.until)
        onsets += profile.onsets
        measured.add_promise(profile.onsets, profile.valid_until)
        for onset in profile.onsets:
            assert robot.train is not None
            pulse = robot.train.pulses[robot.train.latest(onset)]
            measured.add_pulse(onset, pulse.torque, pulse.duration)
        for state in robot.read():
            measured.add_state(state)
        walker.promise(profile)
        for transition in walker.advance(horizon.until):
            event = GaitEvent(transition.stamp, transition.kind, transition.side, transition.step)
            events.append(event)
            conductor.add_event(event)
        while train := conductor.due(walker.time_reached):
            robot.schedule(train)
        ended = horizon.last or walker.ending is not None
    measured.finish()
    if measured_onsets:
        onsets = [timing.onset for timing in measured.timings]
    analysis, blocks = analyze_blocks(conductor.blocks, events, onsets, protocol.side, settings)
    return Simulation(
        protocol=protocol,
        events=tuple(events),
        onsets=tuple(onsets),
        timings=tuple(measured.timings),
        train=conductor.block.train,
        measured_period=conductor.block.measured_period,
        pulse_period=conductor.block.pulse_period,
        ending=walker.ending,
        analysis=analysis,
        blocks=blocks,
    )


def begun_robot(protocol: Protocol) -> GuardedRobot:
    """
    Return the simulated robot of a protocol, at the start of a run.

    Raises LimitError if the driver is unknown or a real robot's, or the pulses are outside the
    protocol's limits.
    """
    driver = find_driver(protocol.driver)
    if not driver.simulated:
        raise LimitError(
            f"driver: {driver.name} runs in real time only; use entrain run --real-time"
        )
    robot = driver.make(protocol.side, protocol.limits, protocol.seed)
    protocol.check_limits()
    robot.configure()
    robot.activate()
    robot.begin(0)
    return robot
