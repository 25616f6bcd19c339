# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""One gait event and its place in the order of a gait."""

from dataclasses import dataclass

from gait_entrainment.conventions import EventKind, Side


@dataclass(frozen=True, slots=True)
class GaitEvent:
    """
    A heel strike or a toe-off.

    Step numbers identify events, whatever order they arrive in: heel strike n closes step n, and
    the toe-off of step n is the one that begins its swing, between heel strikes n - 1 and n. Both
    are of the leg that swings. A run starts with heel strike 0. A source that cannot number its
    steps in this way is out of scope: without numbers a missing event looks like a long step.
    """

    stamp: int  # instant of the event [ns since the start of the run]
    kind: EventKind
    side: Side  # the leg that strikes or leaves the ground
    step: int

    @property
    def place(self) -> int:
        """Place in the order of a gait: 0 for heel strike 0, 1 for toe-off 1, 2 for strike 1."""
        return 2 * self.step - (1 if self.kind == EventKind.TOE_OFF else 0)
