# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A torque profile: what an ankle robot promises to deliver up to an instant."""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from gait_entrainment.conventions import Side
from gait_entrainment.errors import EntrainmentError


class ProfileError(EntrainmentError, ValueError):
    """A torque profile that breaks a promise; the message says which."""


@dataclass(frozen=True)
class TorqueProfile:
    """
    Piecewise-constant delivered torque, and the promise that nothing before its end changes.

    ``torques[i]`` [N m] holds on ``[times[i], times[i + 1])``, the last one up to
    ``valid_until`` [ns]. Profiles adjoin: ``times[0]`` is the ``valid_until`` of the one before.
    A profile without length (``times == (valid_until,)``) means that nothing new is known.
    """

    side: Side
    times: tuple[int, ...]
    torques: tuple[float, ...]
    onsets: tuple[int, ...]  # of the pulses that begin in this profile [ns]
    valid_until: int

    @classmethod
    def from_changes(
        cls,
        side: Side,
        begin: int,
        until: int,
        changes: Iterable[tuple[int, float]],
        onsets: Sequence[int],
    ) -> "TorqueProfile":
        """
        Return a profile of [begin, until) from changes of torque, (instant [ns], torque [N m]).

        The last change up to ``begin`` gives the initial torque, which is zero without one;
        changes from ``until`` on are ignored.
        """
        times, torques = [begin], [0.0]
        for instant, torque in changes:
            if instant <= begin:
                torques[0] = torque
            elif instant < until:
                times.append(instant)
                torques.append(torque)
        return cls(side, tuple(times), tuple(torques), tuple(onsets), until)

    @property
    def pieces(self) -> tuple[tuple[int, int, float], ...]:
        """Begin [ns], end [ns] and torque [N m] of each interval of constant torque, in order."""
        ends = [*self.times[1:], self.valid_until]
        return tuple(zip(self.times, ends, self.torques, strict=True))

    @property
    def has_length(self) -> bool:
        """Whether it covers any time."""
        return self.times != (self.valid_until,)

    def check(self, begin: int, until: int | None = None) -> None:
        """
        Check the profile against the contract.

        Raises ProfileError if it does not adjoin the one before, which ends at ``begin`` [ns]; if
        it goes beyond ``until`` [ns]; if its times are not ascending, or its torques not finite or
        not one per time; or if its onsets are not ascending within it.
        """
        if not self.times or len(self.times) != len(self.torques):
            raise ProfileError("a profile needs one torque for each time, and at least one")
        if self.times[0] != begin:
            raise ProfileError(
                f"a profile from {self.times[0]} ns does not adjoin the one up to {begin} ns"
            )
        if until is not None and self.valid_until > until:
            raise ProfileError(
                f"a profile up to {self.valid_until} ns goes beyond the requested {until} ns"
            )
        borders = [*self.times, self.valid_until]
        if self.has_length and any(a >= b for a, b in itertools.pairwise(borders)):
            raise ProfileError("the times of a profile are not ascending")
        begun = [begin - 1, *self.onsets, self.valid_until]
        if self.onsets and any(a >= b for a, b in itertools.pairwise(begun)):
            raise ProfileError("the onsets of a profile are not ascending, or lie outside it")
        if not all(math.isfinite(torque) for torque in self.torques):
            raise ProfileError(f"the torques of a profile are not all finite: {self.torques}")
