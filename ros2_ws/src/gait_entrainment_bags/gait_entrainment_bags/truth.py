# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Errors of a detector: its gait events compared with the simulated walker's exact events."""

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from itertools import pairwise
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind, Side, nanoseconds
from gait_entrainment.gait import Analysis, GaitEvent
from gait_entrainment.settings import Setting
from gait_entrainment_commands.outcome import final_phase_lag, from_strikes
from gait_entrainment_sensors.scoring import score

TOE_OFF_BIAS = Setting("by how much toe-offs are detected late", unit="s", least=-0.2, most=0.2)
# An event is found if an event of its kind and side was detected within this share of a step.
WINDOW = 0.5


def without_bias(events: Iterable[GaitEvent], bias: float) -> list[GaitEvent]:
    """Return events with a known bias [s] subtracted from their toe-offs."""
    late = nanoseconds(bias)
    return [
        replace(e, stamp=e.stamp - late) if late and e.kind is EventKind.TOE_OFF else e
        for e in events
    ]


def detector_errors(
    detected: Sequence[GaitEvent], truth: Sequence[GaitEvent]
) -> dict[str, dict[str, Any]]:
    """
    Return, for heel strikes and for toe-offs, how many were found, missed and false.

    Also returns the bias and the standard deviation of the stamps, detected minus true [s]; None
    if there are too few. Events before the first detected event or after the last are not judged,
    since a detector may be started or stopped during a walk.
    """
    return {kind.name.lower(): _errors_of(kind, detected, truth) for kind in EventKind}


def lag_shift(detected: Analysis, exact: Analysis) -> dict[str, float | None]:
    """Return by how much the final phase lag is shifted [s]; None if it cannot be compared."""
    shift = final_phase_lag(detected) - final_phase_lag(exact)
    if from_strikes(detected):
        shift = math.nan
    return {"phase_lag_shift": None if math.isnan(shift) else shift}


def _errors_of(
    kind: EventKind, detected: Sequence[GaitEvent], truth: Sequence[GaitEvent]
) -> dict[str, Any]:
    start = min((e.stamp for e in truth), default=0)

    def times(events: Sequence[GaitEvent], *sides: Side) -> list[float]:
        stamps = sorted(e.stamp for e in events if e.kind is kind and e.side in sides)
        return [(stamp - start) / NANOSECONDS_PER_SECOND for stamp in stamps]

    steps = [b - a for a, b in pairwise(times(truth, *Side))]
    window = WINDOW * statistics.median(steps) if steps else 0.0
    feet = []
    for side in Side:
        if found := times(detected, side):
            first, last = found[0] - window, found[-1] + window
            feet.append(([t for t in times(truth, side) if first <= t <= last], found))
    scores = asdict(score(feet, window))
    del scores["errors"]
    return scores


def _errors_line(errors: dict[str, Any]) -> str:
    """Return a line about how far the detected events are from the exact ones."""
    parts = []
    for kind, words in (("heel_strike", "heel strikes"), ("toe_off", "toe-offs")):
        e = errors[kind]
        text = f"{e['found']} of {e['events']} {words}, {e['false']} false"
        if e["deviation"] is not None:
            text += f", {1e3 * e['bias']:+.1f} ms (SD {1e3 * e['deviation']:.1f})"
        parts.append(text)
    if errors["phase_lag_shift"] is not None:
        parts.append(f"final lag shifted by {1e3 * errors['phase_lag_shift']:+.1f} ms")
    return f"detector         {'; '.join(parts)}"


def detection_lines(outcome: dict[str, Any]) -> list[str]:
    """Return readable lines about the detection of the events; [] if they are exact."""
    lines = []
    if bias := outcome.get("toe_off_bias"):
        lines.append(f"toe-off bias     {1e3 * bias:+.1f} ms, subtracted from every toe-off")
    if uncertainty := outcome.get("final_phase_lag_uncertainty"):
        lines.append(f"uncertainty      {1e3 * uncertainty:.1f} ms of each lag, as detected")
    if errors := outcome.get("detector_errors"):
        lines.append(_errors_line(errors))
    return lines
