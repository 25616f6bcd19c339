# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain preflight: the checklist before a session with a real ankle robot."""

import argparse
import json
from pathlib import Path

from gait_entrainment.errors import UsageError
from gait_entrainment.robot import find_driver
from gait_entrainment.settings import Setting
from gait_entrainment_bringup.checklist import points
from gait_entrainment_bringup.operator_console import keys_at_once
from gait_entrainment_bringup.run_options import (
    SESSION_FILE,
    add_run_options,
    checked_run,
    checked_session,
)
from gait_entrainment_drivers.proof import keep_preflight

_TIMEOUT = Setting("how long to wait for the stop", unit="s", least=0.0, most=3600.0)
DESCRIPTION = (
    "Go through the checklist before a session: the pulses of the protocol and their limits, the"
    " device's own watchdog, the stop, the loop that times the torque, the record, the clocks of"
    " other hosts. The robot is enabled at zero torque; no pulse is delivered. The result is"
    " remembered on this computer for this driver, and recorded in each bag."
)
EXAMPLES = """examples:
  entrain preflight my_protocol.yaml --arm       then press the stop when asked to
  entrain preflight my_protocol.yaml --arm --elsewhere walker_sim
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_run_options(parser)
    parser.add_argument(
        "--elsewhere",
        action="append",
        metavar="NODE",
        default=[],
        help="compare the clock of the host on which this node already runs; repeatable",
    )
    parser.add_argument("--session", action="store_true", help=SESSION_FILE)
    parser.add_argument("--timeout", default="60", help=f"{_TIMEOUT.meaning} [s] (60)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(options: argparse.Namespace) -> int:
    """Go through the checklist; return 1 if a point fails."""
    timeout = _TIMEOUT.parse("--timeout", options.timeout)
    options.real_time = options.unproved = True  # a missing proof is a failed point
    if options.session:
        session = checked_session(options.protocol, options)
        # The limits are the person's, so the block with the highest pulses represents all.
        blocks = [block.protocol for block in session.blocks]
        protocol = max(blocks, key=lambda block: abs(block.pulse_torque))
        bag = options.out or Path("sessions")
    else:
        protocol, bag = checked_run(options)
    if find_driver(protocol.driver).simulated:
        raise UsageError(
            f"driver: {protocol.driver} applies no real torque; allowed: a real robot"
        )
    found = []
    with keys_at_once():
        for point in points(protocol, bag, options.elsewhere, timeout):
            found.append(point)
            if not options.json:
                print(f"{'ok  ' if point.passed else 'FAIL'}  {point.name:<10} {point.finding}")
    failed = ", ".join(point.name for point in found if not point.passed)
    keep_preflight(protocol.driver, failed)
    if options.json:
        print(json.dumps({"passed": not failed, "points": [vars(point) for point in found]}))
    elif failed:
        print(f"not fit for a session: {failed}")
    else:
        print("fit for a session")
    return int(bool(failed))
