# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
When a pulse really came: commanded, sent and measured onset, from the device's own states.

The commanded onset was planned. The sent onset is the stamp of the first state in which the device
has been asked for the pulse. The measured onset is the instant at which the measured torque
crosses a fraction of the pulse's height, interpolated between two states.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

# Half the height: noise has to reach that far to be mistaken, and the instant does not depend on
# where the flank starts to be seen.
CROSSING = 0.5
# States further apart [ns] are those of a torque that jumped at the later one: there is nothing
# to interpolate over.
LONGEST_GAP = 20_000_000


def measured_onset(
    stamps: Sequence[int], torques: Sequence[float], height: float, fraction: float = CROSSING
) -> tuple[int, int] | None:
    """
    Find where a torque first rises through a fraction of a pulse's height.

    ``stamps`` [ns] ascend from before the pulse on, ``torques`` [N m] are measured at them, NaN if
    none was. A negative ``height`` [N m] is crossed downwards; ``fraction`` is in (0, 1).

    Returns the index of the first state past the crossing, and the instant of the crossing [ns],
    interpolated linearly between two states; None if the torque never gets there, or is over the
    threshold from the first state on.
    """
    before: tuple[int, float] | None = None
    for index, (stamp, torque) in enumerate(zip(stamps, torques, strict=True)):
        level = torque / height
        if math.isnan(level):
            continue
        if level >= fraction and before is not None and before[1] < fraction:
            earlier, lower = before
            if stamp - earlier > LONGEST_GAP:
                return index, stamp
            share = (fraction - lower) / (level - lower)
            return index, earlier + round((stamp - earlier) * share)
        before = (stamp, level)
    return None


@dataclass(frozen=True)
class PulseTiming:
    """Onsets of one pulse [ns]; None if the states do not show it."""

    commanded: int
    sent: int | None
    measured: int | None

    @property
    def onset(self) -> int:
        """The measured onset; the commanded one if no torque shows it."""
        return self.commanded if self.measured is None else self.measured

    def late_ms(self, kind: str) -> float | None:
        """By how many ms the "sent" or "measured" onset came after the command."""
        onset: int | None = getattr(self, kind)
        return None if onset is None else (onset - self.commanded) / 1e6


def lateness_ms(timings: Sequence[PulseTiming], kind: str) -> list[float]:
    """Return by how many ms pulses were "sent" or "measured" after their command, ascending."""
    return sorted(late for timing in timings if (late := timing.late_ms(kind)) is not None)


def distribution(
    timings: Sequence[PulseTiming], kind: str, stride: float
) -> dict[str, Any] | None:
    """
    Return how late the "sent" or "measured" onsets came; None if no pulse shows one.

    Percentages are of a stride [s], None if that is NaN: unknown.
    """
    late = lateness_ms(timings, kind)
    if not late:
        return None
    figures = {"median": quantile(late, 0.5), "p99": quantile(late, 0.99), "worst": late[-1]}
    unknown = math.isnan(stride)
    return {
        "pulses": len(late),
        "missing": len(timings) - len(late),
        **{f"{name}_ms": ms for name, ms in figures.items()},
        **{f"{n}_percent": None if unknown else ms / stride / 10 for n, ms in figures.items()},
    }


def quantile(ascending: Sequence[float], share: float) -> float:
    """Return the value below or at which a share of the values lies (nearest rank)."""
    return ascending[max(math.ceil(share * len(ascending)) - 1, 0)]
