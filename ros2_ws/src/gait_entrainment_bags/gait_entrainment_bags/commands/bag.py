# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain bag: what is in a bag, what is wrong with it, rescuing it, tables of it."""

import argparse
import json
import sys
from dataclasses import asdict
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND

DESCRIPTION = "Look into bags, check them, rescue them, make tables of them."
EXAMPLES = """examples:
  entrain bag info bags/paper_example
  entrain bag check bags/*/                      this project's bags or anybody's
  entrain bag recover bags/broken bags/rescued   after a crash
  entrain bag export bags/paper_example tables --format parquet
"""
_INFO_EXAMPLES = """examples:
  entrain bag info bags/paper_example
  entrain bag info recording_0.mcap --json
"""
_CHECK_EXAMPLES = """examples:
  entrain bag check bags/paper_example
  entrain bag check bags/*/ --json               one JSON object per bag, one per line

Exit code 1 where a rule is broken that makes a reader fail; warnings alone give 0.
"""
_RECOVER_EXAMPLES = """examples:
  entrain bag recover bags/broken bags/rescued   into a new bag; the old one is left as it is
"""
_EXPORT_EXAMPLES = """examples:
  entrain bag export bags/paper_example tables
  entrain bag export bags/paper_example tables --format parquet --topics /gait/strides
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    actions = parser.add_subparsers(required=True, metavar="ACTION")

    info = _add_parser(
        actions,
        "info",
        "what is in a bag",
        "Say what is in a bag, from its index.",
        _INFO_EXAMPLES,
    )
    _add_bag(info)
    info.set_defaults(run=_guarded("info", _info))

    check = _add_parser(
        actions,
        "check",
        "rules of rosbag2 that a bag breaks",
        "Print one line for each rule that is broken, and which reader stumbles over it.",
        _CHECK_EXAMPLES,
    )
    check.add_argument("bags", type=Path, nargs="+", metavar="BAG", help="folders or .mcap files")
    check.add_argument("--json", action="store_true", help="print one JSON object per bag")
    check.set_defaults(run=_guarded("check", _check))

    recover = _add_parser(
        actions,
        "recover",
        "rescue what can be read of a broken bag",
        "Write all that can be read into a new bag, and say what is missing.",
        _RECOVER_EXAMPLES,
    )
    _add_bag(recover)
    recover.add_argument("out", type=Path, metavar="OUT", help="folder to make")
    recover.set_defaults(run=_guarded("recover", _recover))

    export = _add_parser(
        actions,
        "export",
        "a table per topic",
        "Write one table per topic, with units; Parquet needs pyarrow.",
        _EXPORT_EXAMPLES,
    )
    _add_bag(export)
    export.add_argument("out", type=Path, metavar="OUT", help="folder to make")
    export.add_argument("--format", choices=("csv", "parquet"), default="csv", help="default: csv")
    export.add_argument("--topics", nargs="+", metavar="TOPIC", help="default: all with messages")
    export.set_defaults(run=_guarded("export", _export))


def _add_parser(
    commands: Any, name: str, help_text: str, description: str, examples: str
) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=help_text,
        description=description,
        epilog=examples,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    return parser


def _add_bag(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("bag", type=Path, metavar="BAG", help="folder or .mcap file")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def _guarded(name: str, action: Any) -> Any:
    """Return an action that answers what is wrong with one line; 2 for a path that is wrong."""

    def run(options: argparse.Namespace) -> int:
        # Imported here: other commands do without the readers.
        from gait_entrainment_bags import BagError, BagExistsError

        paths = options.bags if name == "check" else [options.bag]
        for path in paths:
            if not path.exists():
                print(f"entrain bag {name}: {path}: no such file or folder", file=sys.stderr)
                return 2
        try:
            return int(action(options))
        except BagError as error:
            print(f"entrain bag {name}: {error}", file=sys.stderr)
            return 2 if isinstance(error, BagExistsError) else 1

    return run


def _info(options: argparse.Namespace) -> int:
    from gait_entrainment_bags import info

    found = info(options.bag)
    if options.json:
        topics = [
            {"name": name, "type": type_name, "messages": count}
            for name, type_name, count in found.topics
        ]
        print(json.dumps(asdict(found) | {"topics": topics}))
        return 0
    print(f"files      {len(found.files)}, {found.size / 1e6:.1f} MB")
    for file in found.files:
        print(f"           {file}")
    if found.message_count:
        print(f"start      {_date(found.start)}")
        print(f"duration   {found.duration / NANOSECONDS_PER_SECOND:.3f} s")
    print(f"recorded   with ROS 2 {found.ros_distro or 'of unknown distribution'}")
    print(f"messages   {found.message_count}")
    width = max((len(name) for name, _, _ in found.topics), default=0)
    for name, type_name, count in found.topics:
        print(f"{count:>10} {name:<{width}} {type_name}")
    for key, value in found.custom_data.items():
        lines = value.strip().splitlines() or [""]
        print(f"{key}: {lines[0]}" if len(lines) == 1 else f"{key}:")
        for line in lines if len(lines) > 1 else []:
            print(f"    {line}")
    return 0


def _check(options: argparse.Namespace) -> int:
    from gait_entrainment_bags import Severity, check

    broken = False
    for bag in options.bags:
        findings = check(bag)
        broken |= any(finding.severity is Severity.ERROR for finding in findings)
        if options.json:
            rules = [
                asdict(finding) | {"severity": finding.severity.value} for finding in findings
            ]
            print(json.dumps({"bag": str(bag), "findings": rules}))
            continue
        for finding in findings:
            print(finding)
        if not findings:
            print(f"{bag}: follows every rule")
    return 1 if broken else 0


def _recover(options: argparse.Namespace) -> int:
    from gait_entrainment_bags import recover

    recovery = recover(options.bag, options.out)
    count = sum(recovery.counts.values())
    if options.json:
        told = asdict(recovery) | {"folder": str(options.out), "messages": count}
        print(json.dumps(told))
        return 0
    print(f"{count} messages rescued into {options.out}")
    if recovery.last:
        print(f"the last one is of {_date(recovery.last)}")
    for loss in recovery.losses:
        print(f"missing: {loss}")
    if not recovery.losses:
        print("nothing is missing")
    return 0


def _export(options: argparse.Namespace) -> int:
    from gait_entrainment_bags import export

    files = export(options.bag, options.out, options.format, options.topics)
    if options.json:
        print(json.dumps({topic: str(file) for topic, file in files.items()}))
        return 0
    for topic, file in files.items():
        print(f"{topic}: {file}")
    return 0


def _date(nanoseconds: int) -> str:
    """Return an instant as a date of nine digits, UTC."""
    seconds, rest = divmod(nanoseconds, NANOSECONDS_PER_SECOND)
    try:
        date = datetime.fromtimestamp(seconds, timezone.utc)
    except (OverflowError, ValueError, OSError):
        return f"{nanoseconds} ns since 1970"
    return f"{date:%Y-%m-%d %H:%M:%S}.{rest:09d} UTC"
