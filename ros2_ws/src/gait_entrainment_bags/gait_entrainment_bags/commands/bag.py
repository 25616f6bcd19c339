# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain bag: show, check, rescue and export bags."""

import argparse
import json
import sys
from dataclasses import asdict
from datetime import datetime, timezone
from pathlib import Path

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment_bags.checks import Severity, check
from gait_entrainment_bags.reader import BagReader, require_bag
from gait_entrainment_bags.recovery import recover
from gait_entrainment_bags.tables import FORMATS, ExportError, export

DESCRIPTION = "Inspect, check, rescue and export bags."
EXAMPLES = """examples:
  entrain bag info bags/paper_example
  entrain bag check bags/*/                      this project's bags or any others
  entrain bag recover bags/broken bags/rescued   after a crash
  entrain bag export bags/paper_example tables --format parquet
"""
_BAG = "folder or .mcap file"
# What each action does, with examples.
_INFO = """Show what is in a bag, from its index.

examples:
  entrain bag info bags/paper_example
  entrain bag info recording_0.mcap --json
"""
_CHECK = """Print one line for each broken rule, and what it means for readers of the bag.

examples:
  entrain bag check bags/paper_example
  entrain bag check bags/*/ --json               one JSON object per bag, one per line

Exit code 1 if a broken rule makes a reader fail; warnings alone give 0.
"""
_RECOVER = """Write everything that can be read into a new bag, and report what is missing.

examples:
  entrain bag recover bags/broken bags/rescued   into a new bag; the old one is not changed

Exit code 1 if there is nothing to rescue.
"""
_EXPORT = """Write one table per topic, with units; needs pyarrow.

examples:
  entrain bag export bags/paper_example tables
  entrain bag export bags/paper_example tables --format parquet --topics /gait/strides
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    actions = parser.add_subparsers(required=True, metavar="ACTION")
    for name, run, purpose, text in (
        ("info", _info, "what is in a bag", _INFO),
        ("check", _check, "rules of rosbag2 that a bag breaks", _CHECK),
        ("recover", _recover, "rescue what can be read from a broken bag", _RECOVER),
        ("export", _export, "a table per topic", _EXPORT),
    ):
        description, _, examples = text.partition("\n\n")
        action = actions.add_parser(
            name,
            help=purpose,
            description=description,
            epilog=examples,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        action.set_defaults(run=run)
        if name == "check":
            action.add_argument("bags", type=Path, nargs="+", metavar="BAG", help=_BAG)
        else:
            action.add_argument("bag", type=Path, metavar="BAG", help=_BAG)
        if name in ("recover", "export"):
            action.add_argument("out", type=Path, metavar="OUT", help="folder to create")
        if name == "export":
            action.add_argument("--format", choices=FORMATS, default="csv", help="default: csv")
            default = "default: all with messages"
            action.add_argument("--topics", nargs="+", metavar="TOPIC", help=default)
        action.add_argument("--json", action="store_true", help="print one JSON object per bag")


def _info(options: argparse.Namespace) -> int:
    with BagReader(options.bag) as bag:
        duration = bag.end - bag.start
        topics = [(name, bag.topics[name].type, bag.counts[name]) for name in sorted(bag.topics)]
    if options.json:
        columns = ("name", "type", "messages")
        info = {
            "path": str(bag.path),
            "files": [*map(str, bag.files)],
            "size": bag.size,
            "start": bag.start,
            "duration": duration,
            "message_count": bag.message_count,
            "topics": [dict(zip(columns, topic, strict=True)) for topic in topics],
            "custom_data": bag.custom_data,
            "ros_distro": bag.ros_distro,
        }
        print(json.dumps(info))
        return 0
    print(f"files      {len(bag.files)}, {bag.size / 1e6:.1f} MB")
    for file in bag.files:
        print(f"           {file}")
    if bag.message_count:
        print(f"start      {_date(bag.start)}")
        print(f"duration   {duration / NANOSECONDS_PER_SECOND:.3f} s")
    print(f"recorded   with ROS 2 {bag.ros_distro or '(unknown distribution)'}")
    print(f"messages   {bag.message_count}")
    width = max((len(name) for name in bag.topics), default=0)
    for name, type_name, count in topics:
        print(f"{count:>10} {name:<{width}} {type_name}")
    for key, value in bag.custom_data.items():
        lines = value.strip().splitlines() or [""]
        print(f"{key}: {lines[0]}" if len(lines) == 1 else f"{key}:")
        for line in lines if len(lines) > 1 else []:
            print(f"    {line}")
    return 0


def _check(options: argparse.Namespace) -> int:
    for bag in options.bags:
        require_bag(bag)
    broken = False
    for bag in options.bags:
        findings = check(bag)
        broken |= any(finding.severity is Severity.ERROR for finding in findings)
        if options.json:
            rules = [asdict(found) | {"severity": found.severity.value} for found in findings]
            print(json.dumps({"bag": str(bag), "findings": rules}))
            continue
        for finding in findings:
            print(finding)
        if not findings:
            print(f"{bag}: follows every rule")
    return 1 if broken else 0


def _recover(options: argparse.Namespace) -> int:
    recovery = recover(options.bag, options.out)
    count = sum(recovery.counts.values())
    code = 0 if count else 1
    if options.json:
        print(json.dumps(asdict(recovery) | {"folder": str(options.out), "messages": count}))
        return code
    print(f"{count} messages rescued into {options.out}")
    if recovery.last:
        print(f"the last one is from {_date(recovery.last)}")
    for loss in recovery.losses:
        print(f"missing: {loss}")
    if not recovery.losses:
        print("nothing is missing")
    return code


def _export(options: argparse.Namespace) -> int:
    refused: dict[str, str] = {}
    try:
        files = export(options.bag, options.out, options.format, options.topics)
    except ExportError as error:
        if not error.files:
            raise
        files, refused = error.files, error.refused
    if options.json:
        print(json.dumps({topic: str(file) for topic, file in files.items()}))
    else:
        for topic, file in files.items():
            print(f"{topic}: {file}")
    for reason in refused.values():
        print(f"entrain bag export: no table: {reason}", file=sys.stderr)
    return 1 if refused else 0


def _date(nanoseconds: int) -> str:
    """Return a time as a UTC date with nine decimals of the second."""
    seconds, rest = divmod(nanoseconds, NANOSECONDS_PER_SECOND)
    date = datetime.fromtimestamp(seconds, timezone.utc)  # 64 bits end in 2554
    return f"{date:%Y-%m-%d %H:%M:%S}.{rest:09d} UTC"
