# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The command ``entrain``, also ``python -m gait_entrainment_commands``."""

import gc
import os
import sys
from collections.abc import Sequence

import gait_entrainment_commands


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code."""
    # What a command loads lives as long as the command. Searching it for garbage, again and again
    # during loading and once more at the end, takes a sixth of the time of a short command.
    gc.set_threshold(100_000)
    while (place := os.open(os.devnull, os.O_RDWR)) <= 2:  # a file would take a closed number
        os.set_inheritable(place, True)
    os.close(place)
    sys.stdout, sys.stderr = sys.stdout or os.fdopen(1, "w"), sys.stderr or os.fdopen(2, "w")
    try:
        return gait_entrainment_commands.main(arguments)
    finally:
        gc.freeze()


if __name__ == "__main__":
    sys.exit(main())
