# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain replay: play a bag to the gait analyzer and compare its results with the recorded."""

import argparse
import json
from pathlib import Path

from gait_entrainment.errors import UsageError
from gait_entrainment.settings import Setting
from gait_entrainment_bags import BagReader, find_definition
from gait_entrainment_bags.commands.record_options import add_record_options, record_overrides
from gait_entrainment_bags.errors import is_utf8
from gait_entrainment_bags.recorded_run import RecordedRun, read_run
from gait_entrainment_bringup.node_list import MOVED, parameter_arguments, replay_parameters
from gait_entrainment_bringup.run_options import check_output
from gait_entrainment_bringup.supervisor import supervised
from gait_entrainment_commands.outcome import outcome_of, summary
from gait_entrainment_nodes.messaging.domain import claimed_domain

DESCRIPTION = "Play a bag to the gait analyzer and compare its results with those recorded live."
EXAMPLES = """examples:
  entrain replay bags/paper_example              as fast as the analyzer takes it
  entrain replay bags/paper_example --rate 1     at the pace of the record, to watch it in RViz
  entrain replay bags/mine --out bags/again      records the replay, with the new results
  ROS_DOMAIN_ID=42 entrain replay bags/mine --rate 2

Exit code 1 if the results differ from those that were recorded, or if the replay failed.
"""
STOP_ORDER = ("bag_player", "gait_analyzer", "bag_recorder")
_RATE = Setting("seconds of the bag per second", least=0, least_excluded=True)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_record_options(parser)
    parser.add_argument(
        "--rate", metavar="FLOAT", help=f"{_RATE.meaning}; default: as fast as possible"
    )
    parser.add_argument("--out", type=Path, help="record the replay into this folder")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(options: argparse.Namespace) -> int:
    """Replay and print; return 1 if the results differ."""
    if not options.bag.exists():
        raise UsageError(f"{options.bag}: no such file or folder")
    if not is_utf8(options.bag):
        raise UsageError(f"{str(options.bag)!a}: allowed: a name in UTF-8")
    if options.rate is not None:
        options.rate = _RATE.parse("--rate", options.rate)
    if options.out is not None:
        check_output(options.out)
    recorded = read_run(options.bag, torques=False, **record_overrides(options))
    with claimed_domain() as domain:
        results = replay(options, domain)
    return report(options, recorded, results)


def replay(options: argparse.Namespace, domain: int) -> dict[str, list[bytes]]:
    """Start the nodes, play the bag, stop the nodes; return the results by topic."""
    namespace, given = replay_parameters(options.bag, out=options.out, **record_overrides(options))
    given["bag_player"] |= {"rate": options.rate or 0.0, "start_paused": True}
    remaps = [f"__ns:={namespace}", *(f"{name}:={name[1:]}" for name in MOVED)]
    moved = [word for remap in remaps for word in ("-r", remap)] if namespace else []
    with supervised(domain, STOP_ORDER) as supervisor:
        arguments = [*parameter_arguments(given, supervisor.folder), *moved]
        for node in STOP_ORDER:
            if node in given:
                supervisor.start(node, arguments)
        # Not at the top: it loads ROS, and errors in the options are reported without it.
        from gait_entrainment_bringup.replay_client import ReplayClient

        recorded = options.out is not None
        client = ReplayClient(supervisor, namespace, recorded=recorded)
        with client:
            client.play(quiet=options.json)
        if recorded:
            supervisor.wait_for_record()
    return client.results


def report(
    options: argparse.Namespace, recorded: RecordedRun, results: dict[str, list[bytes]]
) -> int:
    """Print the outcome of the replay, and how it compares with the record."""
    compared = differences(options.bag, results)
    differing = [difference for difference in compared.values() if difference]
    names = ("strides", "pulse phases", "verdicts")
    counts = dict(zip(names, map(len, results.values()), strict=True))
    outcome = outcome_of(recorded) | {
        "bag": str(options.bag),
        "replayed": counts,
        "as_published_live": not differing if compared else None,
        "differences": differing,
    }
    if options.json:
        print(json.dumps(outcome))
        return 1 if differing else 0
    live = "the same, byte for byte" if compared else "nothing was recorded"
    print(summary(outcome))
    print(f"replayed         {', '.join(f'{count} {name}' for name, count in counts.items())}")
    print(f"recorded live    {'differs: ' + '; '.join(differing) if differing else live}")
    if options.out is not None:
        print(f"bag              {options.out}")
    return 1 if differing else 0


def differences(path: Path, results: dict[str, list[bytes]]) -> dict[str, str]:
    """Return how results differ from those in a bag, "" if not at all, by recorded topic."""
    # Not at the top: it loads ROS.
    from gait_entrainment_nodes.messaging.older_messages import converter_of

    differing = {}
    with BagReader(path) as bag:
        for topic, again in results.items():
            name = bag.find_topic(topic)
            if name is None:
                continue
            found = sorted(bag.messages([name]), key=lambda message: message.place)
            recorded = bag.topics[name]
            convert = None
            if recorded.type_hash != find_definition(recorded.type).type_hash:
                convert = converter_of(recorded)  # from an earlier version
            live = [convert(message.data) if convert else message.data for message in found]
            differing[topic] = ""
            for number, (old, new) in enumerate(zip(live, again, strict=False), start=1):
                if old != new:
                    differing[topic] = f"{topic}: message {number} differs"
                    break
            else:
                if len(live) != len(again):
                    counts = f"{len(live)} messages recorded, {len(again)} replayed"
                    differing[topic] = f"{topic}: {counts}"
    return differing
