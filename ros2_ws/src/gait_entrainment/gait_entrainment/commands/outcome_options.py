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

"""Options of the commands that tell the outcome of one run."""

import argparse


def add_onset_option(parser: argparse.ArgumentParser, onset: str | None = "commanded") -> None:
    """Add how the onset of a pulse is taken; None as default is that of the recorded run."""
    parser.add_argument(
        "--onset",
        choices=("commanded", "measured"),
        default=onset,
        help="take the onset of a pulse from the command or from the measured torque (default: "
        f"{onset or 'as in the recorded run'})",
    )


def add_outcome_options(parser: argparse.ArgumentParser, onset: str | None = "commanded") -> None:
    """Add how the onset of a pulse is taken, and in which form the outcome is printed."""
    add_onset_option(parser, onset)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
