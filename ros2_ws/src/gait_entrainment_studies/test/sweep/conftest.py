# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

from importlib.util import find_spec

# Sweeps are stored as Parquet, which needs pyarrow: pip install pyarrow.
collect_ignore = [] if find_spec("pyarrow") else ["test_sweep.py"]
