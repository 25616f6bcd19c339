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

"""A torque profile: what an ankle robot promises to deliver up to an instant."""

from dataclasses import dataclass

from gait_entrainment.conventions import Side


@dataclass(frozen=True)
class TorqueProfile:
    """
    Piecewise-constant delivered torque, and the promise that nothing before its end changes.

    ``torques[i]`` [N m] holds on ``[times[i], times[i + 1])``, the last one up to
    ``valid_until`` [ns]. Profiles adjoin: ``times[0]`` is the ``valid_until`` of the one before.
    """

    side: Side
    times: tuple[int, ...]
    torques: tuple[float, ...]
    onsets: tuple[int, ...]  # of the pulses that begin in this profile [ns]
    valid_until: int
