# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

from importlib.util import find_spec

# A sweep is kept as Parquet: pip install pyarrow.
collect_ignore = [] if find_spec("pyarrow") else ["test_sweep.py"]
