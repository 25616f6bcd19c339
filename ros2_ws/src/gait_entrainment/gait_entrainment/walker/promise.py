# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The torque of one ankle robot as known to the walker: the changes promised so far."""

import itertools
import math
from collections.abc import Sequence

import numpy as np

from gait_entrainment.walker.model import Floats, Stamps

# Stamp of the first entry, torque zero: earlier than any time, so every time follows an entry.
EVER = -(2**62)


class PromisedTorque:
    """
    Torque changes of one side [ns, N m]; adjacent torques always differ.

    Past the promise the torque counts as zero until a further promise changes it.
    """

    def __init__(self) -> None:
        self.valid_until = 0
        self._changes = [EVER]
        self._torques = [0.0]
        self._arrays: tuple[Stamps, Floats] | None = None

    def extend(
        self,
        times: Sequence[int] | Stamps,
        torques: Sequence[float] | Floats,
        valid_until: int,
        reached: int,
    ) -> int:
        """
        Append pieces; arguments, result and errors as in `Walker.extend_torque`.

        What lies before `reached`, the time that the walker has reached, is too late and left out.
        """
        borders = [*(int(t) for t in times), valid_until]
        if len(borders) - 1 != len(torques):
            raise ValueError(
                f"{len(borders) - 1} times for {len(torques)} torques; one each is needed"
            )
        if any(start >= end for start, end in itertools.pairwise(borders)):
            raise ValueError(f"times {borders[:-1]} up to {valid_until} ns are not increasing")
        if not all(math.isfinite(torque) for torque in torques):
            raise ValueError(f"torques {list(torques)} are not all finite")
        promised = self.valid_until
        if valid_until < promised:
            raise ValueError(
                f"valid_until {valid_until} ns is before the promise up to {promised} ns"
            )
        if borders[0] < promised:
            raise ValueError(
                f"torque from {borders[0]} ns contradicts the promise up to {promised} ns"
            )
        if self._changes[-1] == promised >= reached:
            # The zero past the old promise has not been walked through: it was provisional.
            self._pop()
        if borders[0] > promised:
            self._change(max(promised, reached), 0.0)
        for start, end, torque in zip(borders, borders[1:], torques, strict=False):
            if end > reached:
                self._change(max(start, reached), float(torque))
        self._change(max(valid_until, reached), 0.0)
        self.valid_until = valid_until
        return max(0, min(reached, valid_until) - promised)

    def cut(self, at: int, reached: int) -> None:
        """Void the promise from `at` on, or from `reached` if that is later: zero torque."""
        at = max(at, reached)
        while self._changes[-1] >= at:
            self._pop()
        self._change(at, 0.0)
        self.valid_until = min(self.valid_until, at)

    def forget(self, before: int) -> None:
        """Drop the changes that only times before `before` need."""
        while len(self._changes) > 1 and self._changes[1] < before:
            del self._changes[0], self._torques[0]
            self._arrays = None

    def arrays(self) -> tuple[Stamps, Floats]:
        """Stamps [ns] of the changes, and the torque [N m] from each one on, for the walker."""
        if self._arrays is None:
            self._arrays = np.array(self._changes, np.int64), np.array(self._torques)
        return self._arrays

    def _change(self, stamp: int, torque: float) -> None:
        if self._changes[-1] == stamp:
            self._pop()
        if self._torques[-1] != torque:
            self._changes.append(stamp)
            self._torques.append(torque)
            self._arrays = None

    def _pop(self) -> None:
        del self._changes[-1], self._torques[-1]
        self._arrays = None
