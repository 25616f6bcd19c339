# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The whole experiment in one process, without ROS: the same parts in the same chain of promises.

Conductor, ankle robot and walker are the objects that the nodes hold, driven in the same order as
in a lock-step run. So both give the same events to the nanosecond.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from gait_entrainment.conventions import Side
from gait_entrainment.experiment import Conductor
from gait_entrainment.gait import GaitEvent, VerdictSettings
from gait_entrainment.protocol import Protocol
from gait_entrainment.robot import (
    GuardedRobot,
    LimitError,
    Pulse,
    PulseTiming,
    PulseTrain,
    RobotState,
    make_robots,
)
from gait_entrainment.run import Run, analyze_blocks
from gait_entrainment.walker import Ending, Walker

TimingsOf = Callable[[Sequence[Pulse], Sequence[RobotState]], Sequence[PulseTiming]]


@dataclass(frozen=True)
class Simulation(Run):
    """The outcome of a simulated experiment; stamps count from its start."""

    protocol: Protocol
    train: PulseTrain | None  # as requested in the last block; None if the walk ended earlier
    ending: Ending | None  # fall or fly-off; None if every stride was walked


def simulate(
    protocol: Protocol,
    settings: VerdictSettings | None = None,
    *,
    timings_of: TimingsOf | None = None,
    measured_onsets: bool = False,
) -> Simulation:
    """
    Conduct a protocol on the simulated walker.

    ``timings_of`` finds when the pulses on an ankle began, from them and the robot's states (see
    gait_entrainment_commands.timing); with ``measured_onsets`` the analysis uses the onsets that
    it finds, instead of the commanded ones.

    Raises LimitError if the driver is unknown or the pulses are outside the protocol's limits,
    ProtocolError if the pulses would overlap at the measured period.
    """
    robots = begun_robots(protocol)
    conductor = Conductor(protocol)
    walker = Walker(protocol.walker, protocol.side, None, protocol.variation, protocol.seed)
    ended = False
    events: list[GaitEvent] = []
    pulses: dict[Side, list[Pulse]] = {side: [] for side in robots}
    states: dict[Side, list[RobotState]] = {side: [] for side in robots}
    while not ended:
        horizon = conductor.horizon(walker.time_reached)
        for side, robot in robots.items():
            profile = robot.promise(horizon.until)
            for onset in profile.onsets:
                assert robot.train is not None
                pulses[side].append(robot.train.pulses[robot.train.latest(onset)])
            states[side] += robot.read()
            walker.promise(profile)
        for transition in walker.advance(horizon.until):
            event = GaitEvent(transition.stamp, transition.kind, transition.side, transition.step)
            events.append(event)
            conductor.add_event(event)
        while train := conductor.due(walker.time_reached):
            robots[train.side].schedule(train)
        ended = horizon.last or walker.ending is not None
    timings_of = timings_of or (
        lambda sent, _: [PulseTiming(p.onset, None, None, p.torque, p.duration) for p in sent]
    )
    delivered = [(s, t) for s in robots for t in timings_of(pulses[s], states[s])]
    onsets = [(s, t.onset if measured_onsets else t.commanded) for s, t in delivered]
    analysis, blocks = analyze_blocks(conductor.blocks, events, onsets, protocol.side, settings)
    return Simulation(
        protocol=protocol,
        events=tuple(events),
        delivered=tuple(delivered),
        train=conductor.block.train,
        measured_period=conductor.block.measured_period,
        pulse_period=conductor.block.pulse_period,
        ending=walker.ending,
        analysis=analysis,
        blocks=blocks,
    )


def begun_robots(protocol: Protocol) -> dict[Side, GuardedRobot]:
    """
    Return the simulated robots of a protocol, at the start of a run.

    Raises LimitError if the driver is unknown or for a real robot, or the pulses are outside the
    protocol's limits.
    """
    robots = make_robots(protocol.driver, protocol.sides, protocol.limits, protocol.seed)
    if not all(robot.capabilities.simulated for robot in robots.values()):
        name = protocol.driver.partition(":")[0]
        raise LimitError(f"driver: {name} runs in real time only; use entrain run --real-time")
    protocol.check_limits()
    for robot in robots.values():
        robot.configure()
        robot.activate()
        robot.begin(0)
    return robots
