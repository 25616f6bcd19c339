# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Compile the walker's functions with numba, cached on disk and reproducible to the bit.

Without fastmath, because it would let the compiler reorder sums differently wherever a function is
inlined, and the walker's results are promised to the bit. Division follows IEEE instead of raising
(a panel that runs into a stall yields infinity or NaN and is rejected there), which also allows
loops to be vectorized.
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
    Import numba without modules that the walker does not need and that slow a command's start.

    Numba uses coverage only while coverage is measured, and scipy's BLAS only for matrix products.
    A None in `sys.modules` makes the import of a module fail.
    """
    hidden = [name for name in ("coverage", "scipy.linalg") if name not in sys.modules]
    sys.modules.update(dict.fromkeys(hidden))  # type: ignore[arg-type]
    try:
        import numba
        import numba.np.arraymath  # looks for BLAS; otherwise it would do so at the first step
    finally:
        for name in hidden:
            del sys.modules[name]
    return numba


numba: Any = _load_numba()
config = numba.config


def _cache_folder() -> str:
    """
    Return the folder for the machine code of exactly these sources, or "" if there is none.

    Numba discards a cached function only if that function's own file changes. Ours are inlined
    into each other across files, so each state of the sources has its own folder: in
    NUMBA_CACHE_DIR if that is set, next to the sources, or in the user's cache.
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
        "The walker is recompiled in every process because its machine code cannot be cached. Set"
        " NUMBA_CACHE_DIR to a writable folder.",
        stacklevel=2,
    )
    return ""


CACHE_FOLDER = _cache_folder()


def compiled(function: Function) -> Function:
    """Compile on the first call, and cache the machine code on disk for the next process."""
    before, config.CACHE_DIR = config.CACHE_DIR, CACHE_FOLDER
    try:
        cached = CACHE_FOLDER != ""
        dispatcher: Any = numba.njit(cache=cached, nogil=True, error_model="numpy")(function)
    finally:
        config.CACHE_DIR = before
    return cast(Function, dispatcher)
