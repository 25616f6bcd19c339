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

"""
The Arnold tongue: pulse period x torque x initial phase.

    plan       what is swept
    row        all pulse periods at one torque, solved and walked
    engine     processes, or a Dask cluster
    store      Parquet on disk, resumable
    borders    the exact borders
    figures    the picture
"""

from gait_entrainment.sweep.borders import StableInterval, exact_borders
from gait_entrainment.sweep.engine import available_cores, rows_by_dask, rows_by_processes
from gait_entrainment.sweep.plan import Axis, SweepError, SweepPlan
from gait_entrainment.sweep.row import sweep_row
from gait_entrainment.sweep.store import SweepStore, read_sweep

__all__ = [
    "Axis",
    "StableInterval",
    "SweepError",
    "SweepPlan",
    "SweepStore",
    "available_cores",
    "exact_borders",
    "read_sweep",
    "rows_by_dask",
    "rows_by_processes",
    "sweep_row",
]
