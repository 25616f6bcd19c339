# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Results in the fields of the messages that publish them: for the node, and to check a record."""

from dataclasses import fields
from typing import Any

from gait_entrainment.analysis.analyzer import Result
from gait_entrainment.analysis.pulse_phase import PulsePhase
from gait_entrainment.conventions import Side
from gait_entrainment.events import Stride


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
