# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The walker in time: torque promises in, gait events and samples out.

The state is kept at the last actual switch, never at the requested time. So the result is the
same to the bit however a run is split into `advance` calls or a torque profile into promises, and
whichever times are sampled.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.parameters import Variation, WalkerParameters
from gait_entrainment.robot import TorqueProfile
from gait_entrainment.walker.model import Floats, Stamps, make_model, start_apex
from gait_entrainment.walker.promise import PromisedTorque
from gait_entrainment.walker.sampling import SAMPLE, Samples, fill_samples, samples_from
from gait_entrainment.walker.segment import SEGMENT, Log, Stance, Switch, leg_sine_at
from gait_entrainment.walker.trajectory import ENDED, SWITCHED, Torques, advance, start_walking
from gait_entrainment.walker.transitions import clock, seconds
from gait_entrainment.walker.variation import made_for_any_stiffness, push_off_stiffness


@dataclass(frozen=True)
class Transition:
    """
    A gait event of the model: its time [s] and stamp [ns] since the start of the run.

    The stamp is rounded from the walker's own clock, which has a finer resolution than `time`.
    """

    time: float
    stamp: int
    kind: EventKind
    side: Side
    step: int


class EndingKind(str, Enum):
    """How a walk ended by itself."""

    FALL = "fall"
    FLY_OFF = "fly_off"


@dataclass(frozen=True)
class Ending:
    """
    Where and why the walk ended: a limit of the model, not an error.

    For a fall, `missing` is the energy [J] needed to get through the rest of the stance; for a
    fly-off, the largest force [N] with which the leg would have to pull in the rest of the stance.
    Both assume that the perturbation does not change.
    """

    kind: EndingKind
    stance: Stance
    side: Side  # of the leading leg
    step: int
    time: float  # [s]
    stamp: int  # [ns]
    angle: float  # lean theta of the leading leg [rad], positive with the mass behind the foot
    missing: float

    @property
    def message(self) -> str:
        """One sentence for the user."""
        where = f"in {self.stance.name.lower()} stance of step {self.step}"
        when = f"at {self.time:.6f} s, leg angle {self.angle:.4f} rad"
        if self.kind == EndingKind.FALL:
            return f"The walker fell {where} {when}: {self.missing:.3g} J were missing."
        return (
            f"The walker flew off {where} {when}: the {self.side.name.lower()} leg would have"
            f" had to pull with {self.missing:.3g} N."
        )


class Walker:
    """
    The ankle-actuated walker, driven by torque promises for both ankles.

    It starts at stamp 0, right after heel strike 0 of the side `first_heel_strike`, in the
    period-one gait or with the mass at `initial_speed` [m/s]. With `variation` its strides vary.

    An event comes before a torque change of the same stamp, and a change acts only after its
    stamp: a sample shows the events of its own stamp, but the torque up to it. So everything up to
    a stamp follows from what was promised up to that stamp.
    """

    def __init__(
        self,
        parameters: WalkerParameters,
        first_heel_strike: Side = Side.RIGHT,
        initial_speed: float | None = None,
        variation: Variation | None = None,
        seed: int = 0,
    ) -> None:
        """Raise ValueError if `initial_speed` is not a positive, finite number."""
        self.parameters = parameters
        self._model = make_model(parameters)
        apex = start_apex(self._model, initial_speed)
        self._stiffness = np.empty(0)  # of each push-off, by step [N m/rad]; empty: the model's
        if variation is not None and variation.coefficient:
            self._stiffness = push_off_stiffness(self._model, variation, seed)
            self._model = made_for_any_stiffness(self._model, self._stiffness[1])
        self._promises = (PromisedTorque(), PromisedTorque())
        self._log: Log = np.zeros(16, SEGMENT)
        self._count = 1
        self._announced = 0
        self._sampled_from = 0
        self.time_reached = 0
        self.ending: Ending | None = None
        start_walking(self._model, self._log[0], int(first_heel_strike), apex)

    @property
    def valid_until(self) -> int:
        """Stamp [ns] up to which the torque of both ankles is promised."""
        return min(promise.valid_until for promise in self._promises)

    def extend_torque(
        self,
        side: Side,
        times_ns: Sequence[int] | Stamps,
        torques: Sequence[float] | Floats,
        valid_until_ns: int,
    ) -> int:
        """
        Promise the torque of one ankle up to `valid_until_ns`.

        torques[i] [N m] holds from times_ns[i] to the next time, the last to `valid_until_ns`.
        Before the first, or if there are none, the torque is zero. Returns how many nanoseconds of
        the promise came too late: the walker has passed them with zero torque.

        Raises ValueError if the pieces are out of order, not finite, or contradict an earlier
        promise.
        """
        promise = self._promises[side]
        return promise.extend(times_ns, torques, int(valid_until_ns), self.time_reached)

    def promise(self, profile: TorqueProfile) -> int:
        """Take an ankle robot's promise, as `extend_torque` does."""
        return self.extend_torque(
            profile.side, profile.times, profile.torques, profile.valid_until
        )

    def cut_torque(self, at_ns: int) -> None:
        """Stop: void both ankles' promises from `at_ns` on, but not before `time_reached`."""
        for promise in self._promises:
            promise.cut(int(at_ns), self.time_reached)

    def advance(self, until_ns: int) -> list[Transition]:
        """
        Walk up to `until_ns` and return the new events with stamps up to it, in order.

        Torque past `valid_until` counts as zero, permanently. If the walk ends before `until_ns`,
        `ending` is set and `time_reached` stays at its stamp.
        """
        if self.ending is not None:
            return []
        if until_ns < self.time_reached:
            raise ValueError(f"the walker is at {self.time_reached} ns, past {until_ns} ns")
        self._forget()
        self._sampled_from = self.time_reached
        robot, until, outcome = self._torques(), int(until_ns), SWITCHED
        while outcome == SWITCHED:
            if self._count == self._log.size:
                self._log = np.concatenate([self._log, np.zeros_like(self._log)])
            self._count, outcome = advance(
                self._model, self._log, self._count, robot, until, self._stiffness
            )
        self.time_reached = until
        if outcome == ENDED:
            self.ending = self._describe_ending(self._log[self._count - 1])
            self.time_reached = self.ending.stamp
        fresh = self._log[self._announced : self._count]
        self._announced = self._count
        events = (Switch.HEEL_STRIKE, Switch.TOE_OFF)
        return [_transition(row) for row in fresh if row["began"] in events]

    def sample(self, times_ns: Stamps) -> Samples:
        """
        Sample the stretch of the last `advance`, including both ends.

        `times_ns` (n,) are stamps [ns] in any order. Raises ValueError if one is outside.
        """
        times = np.ascontiguousarray(times_ns, np.int64)
        first, last = self._sampled_from, self.time_reached
        if times.size and not first <= times.min() <= times.max() <= last:
            raise ValueError(
                f"samples from {times.min()} to {times.max()} ns are not all within the last"
                f" stretch, {first} to {last} ns"
            )
        table = np.zeros(times.size, SAMPLE)
        log, robot = self._log[: self._count], self._torques()
        fill_samples(self._model, log, times, robot, self._stiffness, table)
        return samples_from(table)

    def _torques(self) -> Torques:
        left, right = (promise.arrays() for promise in self._promises)
        changes, torques = (np.concatenate(pair) for pair in zip(left, right, strict=True))
        return Torques(changes, torques, left[0].size)

    def _forget(self) -> None:
        """Keep only the log entries and torques that the next stretch and its samples need."""
        log = self._log[: self._count]
        first = max(0, int(np.searchsorted(log["after"], self.time_reached)) - 1)
        kept = log[first:].copy()
        self._log[: kept.size] = kept
        self._count -= first
        self._announced -= first
        for promise in self._promises:
            promise.forget(min(self.time_reached, int(kept["after"][0]) + 1))

    def _describe_ending(self, last: Any) -> Ending:
        stamp, rest = clock(last["stamp"], last["rest"], last["duration"])
        sine = leg_sine_at(self._model, last["stance"], last["end"])
        return Ending(
            kind=EndingKind.FALL if last["ends"] == Switch.FALL else EndingKind.FLY_OFF,
            stance=Stance(last["stance"]),
            side=Side(last["leading"]),
            step=int(last["step"]),
            time=seconds(stamp, rest),
            stamp=stamp,
            angle=float(np.arcsin(sine)),
            missing=float(last["shortfall"]),
        )


def _transition(segment: Any) -> Transition:
    """Event that began a segment. A heel strike closes the step before the one in progress."""
    struck = segment["began"] == Switch.HEEL_STRIKE
    leading, step = Side(segment["leading"]), int(segment["step"])
    return Transition(
        time=seconds(segment["stamp"], segment["rest"]),
        stamp=int(segment["stamp"]),
        kind=EventKind.HEEL_STRIKE if struck else EventKind.TOE_OFF,
        side=leading if struck else leading.other,
        step=step - 1 if struck else step,
    )
