# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How much of a walk was locked. Separate, so that a report need not load the walker."""

from itertools import groupby

import numpy as np
from numpy.typing import NDArray


def locked_runs(
    lags: NDArray[np.float64], locked_lag: float, tolerance: float
) -> tuple[float, list[int]]:
    """
    Return the fraction of strides that are locked, and the lengths of their runs.

    A stride is locked while its pulse lies within `tolerance` [s] of the lock of the walker
    without noise.
    """
    near = np.abs(lags - locked_lag) <= tolerance
    runs = [len(list(run)) for locked, run in groupby(near.tolist()) if locked]
    return float(near.mean()) if near.size else float("nan"), runs
