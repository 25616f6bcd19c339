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

"""A train of square torque pulses on one ankle."""

from dataclasses import dataclass

from gait_entrainment.conventions import Side, nanoseconds


@dataclass(frozen=True)
class PulseTrain:
    """Square pulses at a fixed period; onsets are exact integer nanoseconds."""

    side: Side
    first_onset: int  # stamp of the first onset [ns]
    period: float  # from onset to onset [s]
    count: int  # number of pulses
    torque: float  # height [N m], plantarflexion positive
    duration: float  # width [s]

    def onset(self, number: int) -> int:
        """
        Return the onset [ns] of pulse ``number``, counted from 0.

        Each onset is rounded from the first one, so that rounding never accumulates.
        """
        return self.first_onset + nanoseconds(number * self.period)

    def end(self, number: int) -> int:
        """Return the instant [ns] at which pulse ``number``, counted from 0, ends."""
        return self.onset(number) + nanoseconds(self.duration)
