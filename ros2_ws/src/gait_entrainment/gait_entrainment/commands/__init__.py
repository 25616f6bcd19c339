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

"""The command line ``entrain``: one module per command."""

import argparse
import sys
from collections.abc import Sequence
from importlib.metadata import entry_points

from gait_entrainment.commands import (
    analyze,
    bag,
    cohort,
    driver,
    existence,
    lock,
    paper,
    phase_response,
    results,
    simulate,
    sweep,
)

# Commands of other packages, such as those that need ROS, are found under this entry point.
ENTRY_POINTS = "gait_entrainment.commands"
COMMANDS = {
    "simulate": simulate.add_command,
    "analyze": analyze.add_command,
    "bag": bag.add_command,
    "driver": driver.add_command,
    "paper": paper.add_command,
    "lock": lock.add_command,
    "existence": existence.add_command,
    "phase-response": phase_response.add_command,
    "sweep": sweep.add_command,
    "cohort": cohort.add_command,
    "results": results.add_command,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return 0 where it is done, 1 where it failed, 2 for wrong usage."""
    parser = argparse.ArgumentParser(
        prog="entrain", description="Rehearse, run and analyze entrainment experiments."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for add_command in COMMANDS.values():
        add_command(commands)
    for entry_point in entry_points(group=ENTRY_POINTS):
        entry_point.load()(commands)
    options = parser.parse_args(arguments)
    try:
        return int(options.run(options))
    except KeyboardInterrupt:
        print("entrain: interrupted", file=sys.stderr)
        return 1
    except BrokenPipeError:
        return 1
    except OSError as error:  # such as a folder that cannot be written
        print(f"entrain: {error}", file=sys.stderr)
        return 1
