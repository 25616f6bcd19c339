# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Results in the fields of the messages that publish them: for the node, and to check a record."""

from dataclasses import fields
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.gait.analyzer import Result
from gait_entrainment.gait.pulse_phase import PulsePhase
from gait_entrainment.gait.strides import Stride


def published_values(result: Result, side: Side) -> dict[str, Any]:
    """Return the values of a result's message, of this perturbed leg; instants in nanoseconds."""
    if isinstance(result, Stride):
        return {
            "header": result.end,
            "side": result.side,
            "number": result.number,
            "start": result.start,
            "period": result.period,
            "step_periods": result.step_periods,
        }
    if isinstance(result, PulsePhase):
        return {
            "header": result.onset,
            "side": side,
            "number": result.number,
            "stride": result.stride,
            "phase": result.phase,
            "phase_lag": result.phase_lag,  # NaN where the toe-off is missing
            "unwrapped_lag": result.unwrapped_lag,
            "toe_off": result.toe_off or 0,
        }
    # All fields of a verdict but one are published, and all but the stamp under the same name.
    unnamed = {"stamp", "effective_pulses"}
    values = {f.name: getattr(result, f.name) for f in fields(result) if f.name not in unnamed}
    values |= {"header": result.stamp, "side": side}
    values["entrained_since_stride"] = result.entrained_since_stride or 0
    return values
