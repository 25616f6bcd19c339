# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
Compile the walker, so that nobody who uses it waits for that.

The machine code is kept beside the sources (gait_entrainment.walker.compiled). The default
experiment takes every kernel but those that sample a walk, so one stride is sampled beside it.
"""

import sys

from gait_entrainment.commands import main
from gait_entrainment.conventions import Side, nanoseconds
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.walker import WalkerRun

if __name__ == "__main__":
    walk = WalkerRun(WalkerParameters(), first_heel_strike=Side.RIGHT, sample_rate=200.0)
    walk.advance(nanoseconds(2.0))
    sys.exit(main(["simulate", "--json"]))
