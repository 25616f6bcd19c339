# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
How the walker's functions are compiled: numba, kept on disk, to the bit the same every time.

No fastmath: it would let the compiler reorder sums, differently in every place a function is
inlined, and the walker's results are promised to the bit. Division follows IEEE (a panel that runs
into a stall yields infinity or NaN and is refused there) instead of raising, which is also what
lets loops run in vector registers.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

from gait_entrainment import geometry

Function = TypeVar("Function", bound=Callable[..., Any])


_WALKER = hashlib.sha256()
for _file in (Path(geometry.__file__), *sorted(Path(__file__).parent.glob("*.py"))):
    _WALKER.update(_file.read_bytes())


def compiled(function: Function) -> Function:
    """
    Compile at the first call, and keep the machine code on disk for the next process.

    Numba drops a kept function when that function's own file changes. Ours are inlined into one
    another across files, so each is kept under a stamp of the walker's files and its own.
    """
    stamp = _WALKER.copy()
    stamp.update(Path(function.__code__.co_filename).read_bytes())
    dispatcher: Any = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    dispatcher._cache._cache_file._source_stamp = stamp.hexdigest(), 0
    return cast(Function, dispatcher)
