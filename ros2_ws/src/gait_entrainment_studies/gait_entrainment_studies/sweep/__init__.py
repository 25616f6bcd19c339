# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The Arnold tongue: pulse period x torque x initial phase.

    plan       what is swept
    row        all pulse periods at one torque, solved and walked
    engine     processes, or a Dask cluster
    store      Parquet on disk, resumable
    borders    the exact borders
    figures    the picture
"""

from gait_entrainment_studies.sweep.borders import StableInterval, exact_borders
from gait_entrainment_studies.sweep.engine import available_cores, rows_by_dask, rows_by_processes
from gait_entrainment_studies.sweep.plan import Axis, SweepError, SweepPlan
from gait_entrainment_studies.sweep.row import sweep_row
from gait_entrainment_studies.sweep.store import SweepStore, read_sweep

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
