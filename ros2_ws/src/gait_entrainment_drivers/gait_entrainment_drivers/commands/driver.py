# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain driver: which ankle robots there are, and whether one keeps its promises."""

import argparse
import json
import math
import sys
from collections.abc import Iterable
from dataclasses import asdict
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any

from gait_entrainment.conventions import Side
from gait_entrainment.robot import DeviceError, Driver, LimitError, driver_names, find_driver
from gait_entrainment.settings import Setting, settings_of

if TYPE_CHECKING:
    from gait_entrainment_drivers.conformance import Result

# Where the check of a running node is found: it needs ROS, which this package does not know.
NODE_CHECK = "gait_entrainment.node_check"
DESCRIPTION = "Ankle robot drivers: NAME, or NAME:OPTION=VALUE,OPTION=VALUE."
EXAMPLES = """examples:
  entrain driver list                       every driver, with its options
  entrain driver check emulated:delay=0.01  does it keep every promise of the contract?
  entrain driver check my_robot --arm --json
  entrain driver check --node perturbator   any node that speaks the perturbator's topics
  entrain driver check --node perturbator --real-time --arm      one that holds a real robot
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    actions = parser.add_subparsers(required=True, metavar="ACTION")
    listing = actions.add_parser(
        "list",
        help="every driver that is installed",
        description="List every driver that is installed, and its options: NAME=DEFAULT, unit,"
        " meaning, range.",
    )
    listing.add_argument("--json", action="store_true", help="print one JSON object")
    listing.set_defaults(run=list_drivers)
    check = actions.add_parser(
        "check",
        help="the conformance kit",
        description="Hold a driver, or a node, against every promise of the contract"
        " (docs/drivers.md). Exit code 1 where one is broken.",
    )
    checked = check.add_mutually_exclusive_group(required=True)
    checked.add_argument("driver", nargs="?", metavar="NAME[:OPTION=VALUE,...]", help="driver")
    checked.add_argument(
        "--node",
        metavar="NAME",
        help="check from outside a node that speaks the perturbator's topics, in any language",
    )
    check.add_argument(
        "--side",
        choices=("left", "right"),
        default="right",
        help="ankle of the node's robot (default right)",
    )
    check.add_argument(
        "--real-time",
        action="store_true",
        help="the node holds a real robot: check it by the wall clock",
    )
    check.add_argument(
        "--arm",
        action="store_true",
        help="let a real device deliver torque; nobody may wear it",
    )
    check.add_argument(
        "--torque",
        type=float,
        default=8.0,
        help="height of the pulses [N m], up to 30 (default 8)",
    )
    check.add_argument("--json", action="store_true", help="print one JSON object")
    check.set_defaults(run=check_driver)


def list_drivers(options: argparse.Namespace) -> int:
    """Print every driver; one that cannot be loaded says why."""
    found = {name: _description(name) for name in driver_names()}
    if options.json:
        print(json.dumps(found))
        return 0
    for name, description in found.items():
        print(f"{name}: {description['summary']}")
        for option in description["options"]:
            unit = f" {option['unit']}" if option["unit"] not in ("", "1") else ""
            default = f"{option['name']}={option['default']}{unit}"
            print(f"    {default}  {option['meaning']}{_allowed(option)}")
    return 0


def check_driver(options: argparse.Namespace) -> int:
    """Run the conformance kit; 1 where a promise is broken or there is no such driver."""
    from gait_entrainment_drivers.conformance import Tolerances, run_checks

    if options.node is not None:
        return check_node(options)
    try:
        driver = find_driver(options.driver)
        refuse_unarmed(driver, options.arm)
        if not 0 < options.torque <= 30:
            raise LimitError(f"--torque: {options.torque:g} N m; allowed: above 0 and at most 30")
        if not driver.simulated:
            # Without this, a device that is not there would break every promise alike.
            with driver.make(Side.RIGHT) as robot:
                robot.configure()
    except (LimitError, DeviceError) as error:
        print(f"entrain driver: {error}", file=sys.stderr)
        return 1
    results = run_checks(driver, Tolerances(torque=options.torque))
    return report(options.driver, results, options.json)


def check_node(options: argparse.Namespace) -> int:
    """Run the kit on a running node; the code that speaks ROS is in another package."""
    from gait_entrainment_drivers.conformance import Tolerances

    found = list(entry_points(group=NODE_CHECK))
    if not found:
        print(
            "entrain driver: --node needs the package gait_entrainment_nodes, and ROS",
            file=sys.stderr,
        )
        return 1
    results = found[0].load()(
        options.node,
        Side[options.side.upper()],
        Tolerances(torque=options.torque),
        real_time=options.real_time,
        arm=options.arm,
    )
    try:
        return report(options.node, results, options.json)
    except DeviceError as error:
        print(f"entrain driver: {error}", file=sys.stderr)
        return 1


def report(name: str, results: Iterable["Result"], as_json: bool) -> int:
    """Print the results as they come; 1 where a promise is broken."""
    done = []
    for result in results:
        done.append(result)
        if not as_json:
            figures = ", ".join(f"{k} {v:.3g}" for k, v in result.figures.items())
            print(
                f"{'kept  ' if result.kept else 'BROKEN'} {result.check}: {result.promise}"
                + (f" [{figures}]" if figures else "")
                + (f"\n       {result.broken}" if result.broken else ""),
                flush=True,
            )
    broken = sum(not result.kept for result in done)
    if as_json:
        content = {"checked": name, "broken": broken}
        print(json.dumps(content | {"checks": [asdict(result) for result in done]}))
    else:
        print(f"{name}: {len(done) - broken} promises kept, {broken} broken")
    if broken:
        print(f"entrain driver: {name} breaks {broken} promises", file=sys.stderr)
    return 1 if broken else 0


def refuse_unarmed(driver: Driver, armed: bool) -> None:
    """Raise LimitError where a device outside simulation has not been armed by the user."""
    if not (driver.simulated or armed):
        raise LimitError(
            f"{driver.name} applies real torque: see that nobody wears it, then say --arm"
        )


def _allowed(option: dict[str, Any]) -> str:
    if "choices" in option:
        return f"; one of {', '.join(option['choices'])}"
    if "range" not in option:
        return ""
    low, high = option["range"]
    return f"; {low:g} to {high:g}" if high < math.inf else f"; {low:g} or more"


def _told(setting: Setting) -> dict[str, Any]:
    told: dict[str, Any] = {"meaning": setting.meaning, "unit": setting.unit}
    if setting.choices:
        return told | {"choices": setting.choices}
    return told if setting.kind is str else told | {"range": (setting.least, setting.most)}


def _description(name: str) -> dict[str, Any]:
    try:
        robot = find_driver(name).robot
    except (LimitError, DeviceError) as error:
        return {"summary": str(error), "options": []}
    module = sys.modules[robot.__module__]
    text = (robot.__doc__ or "").strip()
    if not text or text.startswith("See the module"):
        text = (module.__doc__ or "").strip()
    return {
        "summary": text.splitlines()[0] if text else "",
        "options": [
            {"name": name, "default": getattr(robot.Options, name), **_told(told)}
            for name, told in settings_of(robot.Options).items()
        ],
    }
