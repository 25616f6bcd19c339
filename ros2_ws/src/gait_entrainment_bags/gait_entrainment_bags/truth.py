# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Detected gait events beside the exact ones of the simulated walker: the errors of a detector."""

import math
import statistics
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind, Side, nanoseconds
from gait_entrainment.gait import Analysis, GaitEvent
from gait_entrainment.settings import Setting
from gait_entrainment_commands.outcome import final_phase_lag

TOE_OFF_BIAS = Setting("by how much toe-offs are detected late", unit="s", least=-0.2, most=0.2)
# An event is found if one of its kind and side was detected within this share of a stride.
WINDOW = 0.25


def without_bias(events: Iterable[GaitEvent], bias: float) -> list[GaitEvent]:
    """Return events with a known bias [s] taken off their toe-offs."""
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

    And the bias and the standard deviation of the stamps, detected minus true [s]; None where
    there are too few. What comes before the first detected event or after the last is not
    judged: a detector is put to work while somebody walks.
    """
    return {kind.name.lower(): _errors_of(kind, detected, truth) for kind in EventKind}


def lag_shift(detected: Analysis, exact: Analysis) -> dict[str, float | None]:
    """Return by how much the final phase lag is shifted [s]; None if either has none."""
    shift = final_phase_lag(detected) - final_phase_lag(exact)
    return {"phase_lag_shift": None if math.isnan(shift) else shift}


def _errors_of(
    kind: EventKind, detected: Sequence[GaitEvent], truth: Sequence[GaitEvent]
) -> dict[str, Any]:
    errors: list[float] = []
    events = false = 0
    for side in Side:
        found, real = (
            sorted(e.stamp for e in events if (e.kind, e.side) == (kind, side))
            for events in (detected, truth)
        )
        if len(real) < 2 or not found:
            continue
        window = WINDOW * statistics.median(b - a for a, b in pairwise(real))
        real = [stamp for stamp in real if found[0] - window <= stamp <= found[-1] + window]
        events += len(real)
        taken: set[int] = set()
        for stamp in found:
            place = bisect_left(real, stamp)
            near = min(real[max(place - 1, 0) : place + 1], key=lambda true: abs(stamp - true))
            if near in taken or abs(stamp - near) > window:
                false += 1
                continue
            taken.add(near)
            errors.append((stamp - near) / NANOSECONDS_PER_SECOND)
    return {
        "events": events,
        "found": len(errors),
        "missed": events - len(errors),
        "false": false,
        "bias": statistics.fmean(errors) if errors else None,
        "deviation": statistics.stdev(errors) if len(errors) > 1 else None,
    }


def _errors_line(errors: dict[str, Any]) -> str:
    """Say in one line how far the detected events are from the exact ones."""
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
    """Return lines for people about what detected the events; [] if they are exact."""
    lines = []
    if bias := outcome.get("toe_off_bias"):
        lines.append(f"toe-off bias     {1e3 * bias:+.1f} ms, taken off every toe-off")
    if uncertainty := outcome.get("final_phase_lag_uncertainty"):
        lines.append(f"uncertainty      {1e3 * uncertainty:.1f} ms of each lag, as detected")
    if errors := outcome.get("detector_errors"):
        lines.append(_errors_line(errors))
    return lines
