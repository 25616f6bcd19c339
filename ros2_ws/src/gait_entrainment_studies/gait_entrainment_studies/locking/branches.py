# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Branches of locked gaits, their borders, and the locked gaits at one pulse period.

Along each branch (pulse begins before double stance, inside it, or outlasts it) the period is a
smooth function of where the pulse lies. The branches meet in corners, where the pulse begins or
ends at heel strike or toe-off. So the pulse periods with a stable lock are intervals that end in a
corner or a fold, and both are solved for, not searched for by simulation.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum
from functools import partial

import numpy as np

from gait_entrainment_studies.locking.pulsed_gait import Gaits, Place, PulsedGait
from gait_entrainment_studies.locking.roots import ANGLE_TOLERANCE, Floats, solve

# The scan along a branch, denser at its ends, where periods bend most, but not at the corners
# themselves, where rounding would decide. What it brackets is solved for, so its step affects only
# what may be overlooked.
_SCAN = 0.5 - 0.5 * np.cos(np.linspace(1e-3, np.pi - 1e-3, 65))

# How close to a turn the next one is looked for [rad].
_BESIDE = 1e-8

# Whether a gait is feasible, stable, and on a branch with a growing period.
_Marks = tuple[bool, bool, bool]


class Border(str, Enum):
    """What ends a piece of a branch."""

    END_AT_HEEL_STRIKE = "corner: pulse end at heel strike"
    START_AT_HEEL_STRIKE = "corner: pulse start at heel strike"
    END_AT_TOE_OFF = "corner: pulse end at toe-off"
    START_AT_TOE_OFF = "corner: pulse start at toe-off"
    FOLD = "fold"
    FLIP = "flip"
    NEIMARK_SACKER = "Neimark-Sacker"
    NO_GAIT = "fall or fly-off"


@dataclass(frozen=True)
class End:
    """One end of a piece of a branch: what it is, and the gait there."""

    border: Border
    angle: float
    """Ankle angle that parametrizes the branch [rad]."""
    period: float
    onset: float
    lag: float


@dataclass(frozen=True)
class Piece:
    """Part of a branch along which the period is monotone and stability does not change."""

    place: Place
    first: End
    last: End
    feasible: bool
    stable: bool

    @property
    def least_period(self) -> End:
        """The end with the shorter period."""
        return min(self.first, self.last, key=lambda end: end.period)

    @property
    def greatest_period(self) -> End:
        """The end with the longer period."""
        return max(self.first, self.last, key=lambda end: end.period)


@dataclass(frozen=True)
class LockedGait:
    """A 1:1 phase-locked gait: a fixed point of the map at its pulse period."""

    place: Place
    period: float
    onset: float
    """Pulse onset after the other leg's heel strike [s]."""
    lag: float
    """Pulse onset after the perturbed leg's toe-off [s]."""
    phase: float
    """Pulse onset in the perturbed leg's gait cycle."""
    speed: float
    """Speed of the mass right after the perturbed leg's push-off begins [m/s]."""
    multipliers: tuple[complex, complex]
    stable: bool


def pieces_of(gait: PulsedGait) -> list[Piece]:
    """Return all pieces of all branches, in the order of the pulse onset."""
    return [
        piece
        for place, first, last, borders in branches_of(gait)
        for piece in _split(gait, place, first, last, borders)
    ]


def locked_gaits(
    gait: PulsedGait, period: float, pieces: list[Piece] | None = None
) -> list[LockedGait]:
    """
    Return every 1:1 phase-locked gait at a pulse period [s], stable or not, by pulse onset.

    A pulse that never acts repeats itself at exactly the unperturbed period, whatever its onset;
    that neutral continuum is not a lock and is left out.
    """
    found = []
    for piece in pieces_of(gait) if pieces is None else pieces:
        low, high = piece.least_period.period, piece.greatest_period.period
        if not piece.feasible or not low <= period <= high:
            continue
        along = partial(gait.gaits, piece.place)
        angles = piece.first.angle, piece.last.angle
        angle = solve(lambda x, along=along: along(x).period - period, *angles)  # type: ignore[misc]
        lock = along(np.array([angle])).at(0)
        if lock.end > lock.start:
            first, second = lock.multipliers.tolist()
            found.append(
                LockedGait(
                    place=piece.place,
                    period=float(lock.period),
                    onset=float(lock.onset),
                    lag=float(lock.lag),
                    phase=float(lock.phase),
                    speed=gait.speed(float(lock.apex)),
                    multipliers=(first, second),
                    stable=bool(lock.stable),
                )
            )
    return found


def stable_intervals(pieces: list[Piece]) -> list[Piece]:
    """Return the stable pieces: each is an interval of pulse periods that the gait can follow."""
    return [piece for piece in pieces if piece.stable]


def basin_of(gait: PulsedGait, pieces: list[Piece]) -> tuple[float, float]:
    """Return shortest and longest period with a stable lock [s]; without one, the unperturbed."""
    stable = stable_intervals(pieces)
    return (
        min((piece.least_period.period for piece in stable), default=gait.unperturbed_period),
        max((piece.greatest_period.period for piece in stable), default=gait.unperturbed_period),
    )


def branches_of(gait: PulsedGait) -> Iterator[tuple[Place, float, float, tuple[Border, Border]]]:
    """Yield each branch: place, first and last ankle angle along it, and its corners."""
    struck, off = gait.heel_strike, gait.toe_off
    first_end, last_start = gait.first_end, gait.last_start
    if last_start > struck:
        inside = Border.START_AT_HEEL_STRIKE, Border.END_AT_TOE_OFF
        yield Place.EARLY, struck, first_end, (Border.END_AT_HEEL_STRIKE, inside[0])
        yield Place.INSIDE, struck, last_start, inside
        yield Place.LATE, last_start, off, (inside[1], Border.START_AT_TOE_OFF)
    else:
        # Between the two the pulse covers all of double stance, and its onset does not matter.
        yield Place.EARLY, struck, off, (Border.END_AT_HEEL_STRIKE, Border.END_AT_TOE_OFF)
        yield Place.LATE, struck, off, (Border.START_AT_HEEL_STRIKE, Border.START_AT_TOE_OFF)


def _split(
    gait: PulsedGait, place: Place, first: float, last: float, corners: tuple[Border, Border]
) -> Iterator[Piece]:
    """Cut a branch wherever the slope of the period or the stability changes."""
    along = partial(gait.gaits, place)
    angles = first + (last - first) * _SCAN
    marks = _marks(along(angles))
    begin, mark = _end(corners[0], first, along), marks[0]
    for i in range(1, _SCAN.size):
        for angle, border, after in _turns(along, *angles[i - 1 : i + 1], *marks[i - 1 : i + 1]):
            end = _end(border, angle, along)
            yield Piece(place, begin, end, *mark[:2])
            begin, mark = end, after
    yield Piece(place, begin, _end(corners[1], last, along), *mark[:2])


def _turns(
    along: Callable[[Floats], Gaits], low: float, high: float, before: _Marks, after: _Marks
) -> Iterator[tuple[float, Border, _Marks]]:
    """Yield each change between two angles with these marks: angle, kind and marks after it."""
    if before == after:
        return
    angle, border, here = _turn(along, low, high, before, after)
    if high - low < 4 * _BESIDE:
        yield angle, border, after
        return
    # There may be more than one, such as a flip close to a fold: look right next to it.
    beside = np.clip([angle - _BESIDE, angle + _BESIDE], low, high)
    if border is Border.FOLD:
        left, here = _marks(along(beside))
        yield from _turns(along, low, beside[0], before, left)
    yield angle, border, here
    yield from _turns(along, beside[1], high, here, after)


def _marks(gaits: Gaits) -> list[_Marks]:
    """Return for each gait whether it is feasible, stable, and whether its period grows."""
    with np.errstate(invalid="ignore"):
        growing = gaits.feasible & (gaits.slope > 0)
        return list(
            zip(gaits.feasible.tolist(), gaits.stable.tolist(), growing.tolist(), strict=True)
        )


def _turn(
    along: Callable[[Floats], Gaits], low: float, high: float, before: _Marks, after: _Marks
) -> tuple[float, Border, _Marks]:
    """Find one change between two angles with these marks: angle, kind and marks after it."""
    if before[0] and after[0] and before[2] != after[2]:
        return solve(lambda angle: along(angle).slope, low, high), Border.FOLD, after
    while high - low > ANGLE_TOLERANCE:
        middle = 0.5 * (low + high)
        marks = _marks(along(np.array([middle])))[0]
        if marks == before:
            low = middle
        else:
            high, after = middle, marks
    if before[0] != after[0]:
        return (low if before[0] else high), Border.NO_GAIT, after
    if before[2] != after[2]:
        return low, Border.FOLD, after
    largest = along(np.array([low])).multipliers[0, 0]
    return low, Border.FLIP if largest.imag == 0 else Border.NEIMARK_SACKER, after


def _end(border: Border, angle: float, along: Callable[[Floats], Gaits]) -> End:
    gait = along(np.array([angle])).at(0)
    return End(border, angle, float(gait.period), float(gait.onset), float(gait.lag))
