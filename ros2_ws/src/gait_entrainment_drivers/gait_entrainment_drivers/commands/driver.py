# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain driver: list the ankle robot drivers, and check whether one keeps its promises."""

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from importlib.metadata import entry_points
from typing import Any

from gait_entrainment.conventions import Side
from gait_entrainment.errors import EntrainmentError
from gait_entrainment.robot import DeviceError, LimitError, driver_names, driver_on, find_driver
from gait_entrainment.settings import Setting, settings_of
from gait_entrainment_drivers.conformance.bench import DriverBench, Result, Tolerances, run_check
from gait_entrainment_drivers.conformance.checks import CHECKS, Check, chosen_checks, silent_host
from gait_entrainment_drivers.proof import keep_proof

# Entry point group of the check of a running node: it needs ROS, which this package does not.
NODE_CHECK = "gait_entrainment.node_check"
_TORQUE = Setting("pulse height", unit="N m", least=0, most=30, least_excluded=True)
DESCRIPTION = "Ankle robot drivers, given as NAME or NAME:OPTION=VALUE,OPTION=VALUE."
EXAMPLES = """examples:
  entrain driver list                       all drivers and their options
  entrain driver check emulated:delay=0.01  does it keep every promise of the contract?
  entrain driver check my_robot --arm --json
  entrain driver prove my_robot --arm       does its torque end when this computer falls silent?
  entrain driver check --node perturbator   any node with the perturbator's topics
  entrain driver check --node perturbator --real-time --arm      one that drives a real robot
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    actions = parser.add_subparsers(required=True, metavar="ACTION")
    listing = actions.add_parser(
        "list",
        help="list the installed drivers",
        description="List every installed driver and its options: NAME=DEFAULT, unit, meaning,"
        " allowed values.",
    )
    listing.set_defaults(run=list_drivers)
    check = actions.add_parser(
        "check",
        help="run the conformance kit",
        description="Check a driver or a node against every promise of the contract"
        " (docs/drivers.md). The exit code is 1 if one is broken.",
    )
    check.set_defaults(run=check_driver)
    prove = actions.add_parser(
        "prove",
        help="run only the check that arming a real robot requires",
        description="Prove that the device brings its torque to zero by itself when its host falls"
        " silent. The proof is stored on this computer, for exactly these driver options. `check`"
        " includes this proof.",
    )
    prove.set_defaults(run=prove_driver)
    prove.add_argument("driver", metavar="NAME[:OPTION=VALUE,...]", help="driver")
    for action in (listing, check, prove):
        action.add_argument("--json", action="store_true", help="print one JSON object")
    checked = check.add_mutually_exclusive_group(required=True)
    checked.add_argument("driver", nargs="?", metavar="NAME[:OPTION=VALUE,...]", help="driver")
    checked.add_argument(
        "--node",
        metavar="NAME",
        help="check a node with the perturbator's topics, in any language, from outside",
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
        help="the node drives a real robot: check it on the wall clock",
    )
    check.add_argument("--only", default="", metavar="CHECK,...", help="run only these checks")
    for action in (check, prove):
        action.add_argument(
            "--arm",
            action="store_true",
            help="let a real device deliver torque; nobody may wear it",
        )
        action.add_argument(
            "--torque",
            default="8",
            help=f"{_TORQUE.meaning} [N m], up to {_TORQUE.most:g} (default 8)",
        )


def list_drivers(options: argparse.Namespace) -> int:
    """Print every driver, or why it cannot be loaded."""
    found = {name: _description(name) for name in driver_names()}
    if options.json:
        print(json.dumps(found))
        return 0
    for name, description in found.items():
        print(f"{name}: {description['summary']}")
        for option in description["options"]:
            unit = f" {option['unit']}" if option["unit"] not in ("", "1") else ""
            default = f"{option['name']}={option['default']}{unit}"
            print(f"    {default}  {option['meaning']}; {option['allowed']}")
    return 0


def _description(name: str) -> dict[str, Any]:
    try:
        robot = find_driver(name).robot
    except EntrainmentError as error:
        return {"summary": str(error), "options": []}
    text = (robot.__doc__ or "").strip()
    if not text or text.startswith("See the module"):
        text = (sys.modules[robot.__module__].__doc__ or "").strip()
    options = [
        {
            "name": name,
            "default": getattr(robot.Options, name),
            "meaning": rule.meaning,
            "unit": rule.unit,
            "allowed": rule.allowed,
            **({"choices": rule.choices} if rule.choices else {}),
            **({"range": (rule.least, rule.most)} if rule.kind in (int, float) else {}),
        }
        for name, rule in settings_of(robot.Options).items()
    ]
    return {"summary": text.partition("\n")[0], "options": options}


def check_driver(options: argparse.Namespace) -> int:
    """Run the conformance kit on a driver or a node; return 1 if a promise is broken."""
    if options.node is not None:
        return _report(options.node, _check_node(options, _tolerances(options)), options.json)
    checks = chosen_checks(CHECKS, options.only)
    return _report(options.driver, _check_driver(options, checks), options.json)


def prove_driver(options: argparse.Namespace) -> int:
    """Run the silent-host check on a driver; return 1 if the device holds its last command."""
    if find_driver(options.driver).simulated:
        raise LimitError(f"{options.driver} applies no real torque: there is nothing to prove")
    return _report(options.driver, _check_driver(options, (silent_host,)), options.json)


def _tolerances(options: argparse.Namespace) -> Tolerances:
    return Tolerances(torque=_TORQUE.parse("--torque", options.torque))


def _check_driver(options: argparse.Namespace, checks: Iterable[Check]) -> Iterator[Result]:
    """Check a driver, and store what silent_host proves about a real device."""
    tolerances, driver = _tolerances(options), find_driver(options.driver)
    if not driver.simulated:
        if not options.arm:
            raise LimitError(
                f"{driver.name} applies real torque: make sure nobody wears it, then add --arm"
            )
        # Without this, a missing device would be reported as breaking every promise.
        with driver.make(Side.RIGHT) as robot:
            robot.configure()
    bench = DriverBench(driver, tolerances)
    for check in checks:
        result = run_check(check, bench)
        yield result
        if check is silent_host and not driver.simulated:
            within = result.figures["zero_within_ms"] / 1e3 if result.kept else None
            keep_proof(driver_on(options.driver, Side.RIGHT), within)


def _check_node(options: argparse.Namespace, tolerances: Tolerances) -> Iterator[Result]:
    found = list(entry_points(group=NODE_CHECK))
    if not found:
        raise DeviceError("--node needs the package gait_entrainment_nodes, and ROS")
    check: Callable[..., Iterator[Result]] = found[0].load()
    side, more = Side[options.side.upper()], {"arm": options.arm, "only": options.only}
    return check(options.node, side, tolerances, real_time=options.real_time, **more)


def _report(name: str, results: Iterable[Result], as_json: bool) -> int:
    """Print the results as they arrive; return the exit code."""
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
        checks = [asdict(result) for result in done]
        print(json.dumps({"checked": name, "broken": broken, "checks": checks}))
    else:
        print(f"{name}: {len(done) - broken} promises kept, {broken} broken")
    if broken:
        print(f"entrain driver: {name} breaks {broken} promises", file=sys.stderr)
    return 1 if broken else 0
