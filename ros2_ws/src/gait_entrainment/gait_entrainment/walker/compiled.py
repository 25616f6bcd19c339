# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
How the walker's functions are compiled: numba, kept on disk, to the bit the same every time.

No fastmath: it would let the compiler reorder sums, differently in every place a function is
inlined, and the walker's results are promised to the bit. Division follows IEEE (a panel that runs
into a stall yields infinity or NaN and is refused there) instead of raising, which is also what
lets loops run in vector registers.
"""

import contextlib
import hashlib
import os
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from gait_entrainment import geometry

Function = TypeVar("Function", bound=Callable[..., Any])


def _load_numba() -> Any:
    """
    Load numba without what the walker has no use for, which would slow the start of a command.

    Numba uses coverage only while that measures, and scipy's BLAS only for products of matrices.
    A None among the modules is how Python is told not to find one.
    """
    hidden = [name for name in ("coverage", "scipy.linalg") if name not in sys.modules]
    sys.modules.update(dict.fromkeys(hidden))  # type: ignore[arg-type]
    try:
        import numba
        import numba.np.arraymath  # what looks for BLAS; else it would be loaded at the first step
    finally:
        for name in hidden:
            del sys.modules[name]
    return numba


numba: Any = _load_numba()
config = numba.config


def _cache_folder() -> str:
    """
    Return the folder for the machine code of these very sources; an empty text if there is none.

    Numba drops a kept function only if that function's own file changes. Ours are inlined into one
    another across files, so each state of all the sources has a folder of its own: where
    NUMBA_CACHE_DIR says, beside the sources, or in the user's cache.
    """
    here = Path(__file__).parent
    digest = hashlib.sha256()
    for file in (Path(geometry.__file__), *sorted(here.glob("*.py"))):
        digest.update(file.read_bytes())
    places = [Path(config.CACHE_DIR) if config.CACHE_DIR else here / "__pycache__"]
    if "HOME" in os.environ:
        places.append(Path.home() / ".cache" / "gait_entrainment")
    for place in places:
        folder = place / f"walker-{digest.hexdigest()[:16]}"
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return str(folder)
    warnings.warn(
        "The walker is compiled anew in every process, since its machine code cannot be kept: set"
        " NUMBA_CACHE_DIR to a folder that can be written.",
        stacklevel=2,
    )
    return ""


CACHE_FOLDER = _cache_folder()


def compiled(function: Function) -> Function:
    """Compile at the first call, and keep the machine code on disk for the next process."""
    before, config.CACHE_DIR = config.CACHE_DIR, CACHE_FOLDER
    try:
        kept = CACHE_FOLDER != ""
        dispatcher: Any = numba.njit(cache=kept, nogil=True, error_model="numpy")(function)
    finally:
        config.CACHE_DIR = before
    return cast(Function, dispatcher)
