# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Compile the walker, so that nobody who uses it waits for that.

The machine code is kept beside the sources (gait_entrainment.walker.compiled). The default
experiment takes every kernel but those that sample a walk or make many, so those run beside it.
"""

import sys

from gait_entrainment.commands import main
from gait_entrainment.conventions import Side, nanoseconds
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import WalkerRun
from gait_entrainment.walker.model import make_model
from gait_entrainment_studies.walks import walk

if __name__ == "__main__":
    run = WalkerRun(WalkerParameters(), first_heel_strike=Side.RIGHT, sample_rate=200.0)
    run.advance(nanoseconds(2.0))
    walk(make_model(WalkerParameters()), 2)
    sys.exit(main(["simulate", "--json"]))
