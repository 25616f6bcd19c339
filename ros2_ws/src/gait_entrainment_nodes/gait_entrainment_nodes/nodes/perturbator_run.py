# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
One run of the ankle robot without a node: answers horizons with promised torque.

A horizon that is not later than what is known closes the run. It is answered with a profile of no
length, after which there is no torque left to stop.
"""

import math
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.robot import (
    DeviceError,
    Fault,
    GuardedRobot,
    LimitError,
    Pulse,
    PulseTrain,
    RobotState,
    TorqueProfile,
    driver_on,
)
from gait_entrainment.robot.faults import STOPPED
from gait_entrainment_drivers.proof import preflight_of, proof_of
from gait_entrainment_msgs import msg
from gait_entrainment_msgs.action import DeliverPulseTrain
from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.goals import seal_of
from gait_entrainment_nodes.messaging.stamps import header, to_time

Result = DeliverPulseTrain.Result
_ANY = "every operator"
# Experiments decide at most 10 s ahead; a robot in simulated time computes what is requested [s].
_FARTHEST = 60.0
_OPERATOR_SILENT = Fault(
    "operator_silent",
    "An operator fell silent: a terminal or a page is closed, or a process is frozen.",
)
_DEADMAN_SILENT = Fault(
    "deadman_silent", "The emergency stop fell silent: it was let go, or its node has ended."
)


class SignsOfLife:
    """When operators and the emergency stop were last heard, on steady time [s]."""

    def __init__(self) -> None:
        self._at: dict[str | None, float] = {}  # by operator; None: the emergency stop

    def hear(self, operator: str | None = None) -> None:
        """Note a heartbeat of an operator or, without one, a message of the emergency stop."""
        self._at[operator] = self._at[operator and _ANY] = time.monotonic()

    def missing(self, settings: Any, *, button_gone: bool) -> Iterator[tuple[Fault, str]]:
        """Yield a fault and its reason for each sign that is overdue by these settings."""
        if button_gone:
            yield _DEADMAN_SILENT, "a node that can press the emergency stop has ended"
        now, wanted = time.monotonic(), list(filter(None, settings.operators)) or [_ANY]
        for watched, timeout, fault in (
            (wanted, settings.operator_timeout, _OPERATOR_SILENT),
            ([None], settings.deadman_timeout, _DEADMAN_SILENT),
        ):
            silent = [who for who in watched if now - self._at.get(who, -math.inf) > timeout > 0]
            if silent:
                names = " and ".join(who or "the emergency stop" for who in silent)
                yield fault, f"{names} silent for {timeout:g} s: {fault.meaning}"


def do_with_all(
    robots: Mapping[Side, GuardedRobot],
    do: Callable[[GuardedRobot], None],
    undo: Callable[[GuardedRobot], None],
) -> None:
    """Call ``do`` for all robots; if it raises DeviceError, call ``undo`` for all."""
    try:
        for robot in robots.values():
            do(robot)
    except DeviceError:
        for robot in robots.values():
            undo(robot)
        raise


def setups(
    robots: Mapping[Side, GuardedRobot], driver: str, armed_by: str
) -> Iterator[msg.AnkleRobotSetup]:
    """Yield for each robot what is driven, within which limits, and who allowed torque."""
    for side, robot in robots.items():
        proof, preflight = proof_of(driver_on(driver, side)), preflight_of(driver)
        limits = asdict(robot.limits)
        yield msg.AnkleRobotSetup(
            side=side,
            driver=driver_on(driver, side),
            device=robot.identity,
            armed_by=armed_by,
            watchdog=f"zero within {proof.within:g} s, {proof.at}" if proof else "",
            preflight=f"{preflight.at}: {preflight.failed or 'passed'}" if preflight else "",
            limit_names=list(limits),
            limits=[float(value) for value in limits.values()],
        )


class Run:
    """
    One run of the robot on each ankle, from its first horizon to its closing one.

    All times are [ns since 1970]. Torque is promised from ``start`` on, and only a client with the
    key of the ``seal`` gets pulses. ``end_train`` takes the result of each scheduled train and its
    ankle. Raises DeviceError, as most methods do, if a driver fails.
    """

    def __init__(
        self,
        number: int,
        seal: str,
        start: int,
        robots: Mapping[Side, GuardedRobot],
        publish: Callable[[topics.Topic, Any], None],
        end_train: Callable[[Result, Side], None],
    ) -> None:
        self.number, self.seal = number, seal
        self._ankles = {
            side: AnkleRun(number, start, robot, publish, end_train)
            for side, robot in robots.items()
        }

    @property
    def requested(self) -> int:
        """Pulses of the run that were delivered or are still to come."""
        return sum(ankle.requested for ankle in self._ankles.values())

    @property
    def closed(self) -> bool:
        """Whether the closing horizon has been answered."""
        return all(ankle.closed for ankle in self._ankles.values())

    def schedule(self, train: PulseTrain, key: str) -> None:
        """
        Schedule pulses that a client with a key requests.

        Raises LimitError if it is not the key of the run, and what `AnkleRun.schedule` raises.
        """
        if seal_of(key) != self.seal:
            raise LimitError("key: not that of the run; only its experiment gets pulses")
        if train.side not in self._ankles:
            raise LimitError(f"side: {train.side.name.lower()}; the robot is on the other ankle")
        self._ankles[train.side].schedule(train)

    def take_horizon(self, now: int, until: int, *, last: bool) -> None:
        """
        Promise torque up to a horizon; everything before ``now`` is known.

        Raises LimitError and promises nothing if it is farther ahead than any experiment decides.
        """
        ahead = (until - min(a.robot.promised_until for a in self._ankles.values())) / 1e9
        if ahead > _FARTHEST:
            raise LimitError(f"until: {ahead:.3g} s ahead; allowed: at most {_FARTHEST:g} s")
        for ankle in self._ankles.values():
            ankle.take_horizon(now, until, last=last)

    def look_after(self) -> None:
        """Promise what real robots have measured since."""
        for ankle in self._ankles.values():
            ankle.look_after()

    def end_torque(self, outcome: int, reason: str, *, fault: bool = False) -> None:
        """Bring all torque to zero now; a ``fault`` is reported even if no torque was due."""
        for ankle in self._ankles.values():
            ankle.robot.cancel()  # all robots first, even if publishing fails
        for ankle in self._ankles.values():
            ankle.report_end(outcome, reason, fault=fault)

    def interrupt(self, reason: str) -> None:
        """End the torque; real robots must be armed again, as the run ended unexpectedly."""
        self.end_torque(Result.STOPPED, reason)
        for ankle in self._ankles.values():
            ankle.robot.disarm()


class AnkleRun:
    """The robot on one ankle in a run."""

    def __init__(
        self,
        number: int,
        start: int,
        robot: GuardedRobot,
        publish: Callable[[topics.Topic, Any], None],
        end_train: Callable[[Result, Side], None],
    ) -> None:
        robot.begin(start)
        self.number, self.robot = number, robot
        self._publish, self._train_ended = publish, end_train
        self.closed = False
        self._now = self._horizon = start
        self._last = False  # the run ends at the horizon
        self._revision = 0
        self._committed = False  # torque of a scheduled train may still come
        # Trains whose result has not been reported: number of pulses, and end [ns].
        self._under_way: deque[tuple[int, int]] = deque()
        self._reported = 0  # delivered pulses of the trains whose result has been reported

    @property
    def requested(self) -> int:
        """Pulses of the run that were delivered or are still to come."""
        return self._reported + sum(count for count, _ in self._under_way)

    def schedule(self, train: PulseTrain) -> None:
        """Schedule pulses; raises LimitError or DeviceError if the robot refuses them."""
        self.robot.schedule(train)
        self._committed = True
        self._under_way.append((len(train.pulses), train.end))

    def take_horizon(self, now: int, until: int, *, last: bool) -> None:
        """
        Promise torque up to a horizon; everything before ``now`` is known.

        A robot in simulated time answers immediately and in full. A real one knows its torque only
        afterwards: ``look_after`` promises what it has measured, piece by piece.
        """
        self._now, self._horizon, self._last = now, until, last
        self.robot.heard()
        if now < until:
            self._deliver()
            return
        self._end_trains(Result.ENDED, "the run ended before the last pulse")
        self._publish_profile(TorqueProfile(self.robot.side, (until,), (0.0,), (), until), last)
        self._publish_zero(until)
        self.robot.cancel()
        self._committed = False
        self.closed = True

    def look_after(self) -> None:
        """Promise what a real robot has measured since."""
        if self.robot.promised_until < self._horizon:
            self._deliver()
        else:  # the next horizon is late, but the record must have every state
            for state in self.robot.read():
                self._publish_state(state)

    def report_end(self, outcome: int, reason: str, *, fault: bool = False) -> None:
        """
        Report to client and walker that the torque is zero now, whatever was promised.

        A ``fault`` is reported to the walker even if no torque was due.
        """
        self._end_trains(outcome, reason)
        if self._committed or fault:
            self._committed = False
            until = to_time(self.robot.promised_until)
            self._publish_revision(header=header(self._now), valid_until=until, stop=True)
            self._publish_zero(self._now)

    def _deliver(self) -> None:
        robot = self.robot
        first, train = robot.delivered, robot.train
        # An earlier horizon revokes no promise.
        profile = robot.promise(max(self._horizon, robot.promised_until))
        states = robot.read()
        if profile.valid_until > profile.times[0]:
            last = self._last and profile.valid_until == self._horizon
            self._publish_profile(profile, last)
        for number, onset in enumerate(profile.onsets, first):
            if train is not None and (place := train.latest(onset)) >= 0:
                self._publish_pulse(number + 1, train.pulses[place])
        for state in states:
            self._publish_state(state)
        if not robot.faults:
            self._end_trains(Result.DELIVERED, "every pulse was delivered", robot.promised_until)

    def _end_trains(self, outcome: int, message: str, until: float = math.inf) -> None:
        """Report the result of each train that is over at ``until`` [ns], by default of all."""
        while self._under_way and self._under_way[0][1] <= until:
            count, _ = self._under_way.popleft()
            delivered = min(self.robot.delivered - self._reported, count)
            self._reported += delivered
            result = Result(outcome=outcome, message=message, delivered=delivered)
            self._train_ended(result, self.robot.side)

    def _publish_profile(self, profile: TorqueProfile, last: bool) -> None:
        self._publish_revision(
            header=header(profile.times[0]),
            times=[to_time(instant) for instant in profile.times],
            torques=profile.torques,
            onsets=[to_time(instant) for instant in profile.onsets],
            valid_until=to_time(profile.valid_until),
            last=last,
        )

    def _publish_revision(self, **values: Any) -> None:
        side, revision = self.robot.side, self._revision
        profile = msg.TorqueProfile(run=self.number, revision=revision, side=side, **values)
        self._publish(topics.TORQUE_PROFILE, profile)
        self._revision += 1

    def _publish_pulse(self, number: int, pulse: Pulse) -> None:
        message = msg.TorquePulse(
            header=header(pulse.onset),
            run=self.number,
            side=self.robot.side,
            number=number,
            torque=pulse.torque,
            duration=pulse.duration,
        )
        self._publish(topics.PULSES, message)

    def _publish_zero(self, instant: int) -> None:
        self._publish_state(RobotState(instant, 0.0, 0.0, math.nan))

    def _publish_state(self, state: RobotState) -> None:
        robot = self.robot
        status = msg.AnkleRobotState.ACTIVE if robot.enabled else msg.AnkleRobotState.INACTIVE
        if robot.faults:
            status = msg.AnkleRobotState.FAULT
        if STOPPED in robot.faults:
            status = msg.AnkleRobotState.STOPPED
        message = msg.AnkleRobotState(
            header=header(state.stamp),
            run=self.number,
            side=robot.side,
            status=status,
            commanded_torque=state.commanded,
            measured_torque=state.measured,
            angle=state.angle,
            faults=[fault.name for fault in (state.faults or robot.faults)],
        )
        self._publish(topics.ROBOT_STATE, message)
