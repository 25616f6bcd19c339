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

"""From strides and pulse onsets to phases, phase lags and the entrainment verdict."""

from gait_entrainment.analysis.analyzer import Analysis, GaitAnalyzer, PulseCounts, analyze
from gait_entrainment.analysis.drift import Drift, drift_of
from gait_entrainment.analysis.published import published_values
from gait_entrainment.analysis.pulse_phase import PulsePhase
from gait_entrainment.analysis.verdict import Entrainment, Verdict, VerdictSettings

__all__ = [
    "published_values",
    "Analysis",
    "Drift",
    "Entrainment",
    "GaitAnalyzer",
    "PulseCounts",
    "PulsePhase",
    "Verdict",
    "VerdictSettings",
    "analyze",
    "drift_of",
]
