# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Compile the walker, so that its users do not have to wait for it.

The machine code is kept next to the sources (gait_entrainment.walker.compiled); that of earlier
sources is removed. The default experiment uses every kernel except those that sample a walk or
make a whole one, so both are also done for a stride.
"""

import shutil
import sys
from pathlib import Path

import numpy as np

from gait_entrainment.conventions import nanoseconds
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import Walker
from gait_entrainment.walker.compiled import CACHE_FOLDER
from gait_entrainment.walker.model import make_model
from gait_entrainment_commands import main
from gait_entrainment_studies.walks import walk

if __name__ == "__main__":
    if CACHE_FOLDER:
        for folder in Path(CACHE_FOLDER).parent.glob("walker-*"):
            if folder != Path(CACHE_FOLDER):
                shutil.rmtree(folder, ignore_errors=True)
    walker = Walker(WalkerParameters())
    walker.advance(nanoseconds(2.0))
    walker.sample(np.arange(0, walker.time_reached, nanoseconds(0.005)))
    walk(make_model(WalkerParameters()), 2)
    sys.exit(main(["simulate", "--json"]))
