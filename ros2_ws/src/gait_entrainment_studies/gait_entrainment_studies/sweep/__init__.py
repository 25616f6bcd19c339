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
