# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain replay: a bag played to the gait analyzer, its results held against those recorded."""

import argparse
import json
import signal
import sys
import tempfile
from pathlib import Path

from gait_entrainment.outcome import outcome_of, summary
from gait_entrainment.protocol import ProtocolError
from gait_entrainment_bags import BagError, BagReader
from gait_entrainment_bags.recorded_run import RecordedRun, read_run
from gait_entrainment_bringup.commands.run import check_output, is_utf8
from gait_entrainment_bringup.node_list import (
    MOVED,
    REPLAY_NODES,
    parameter_arguments,
    replay_parameters,
)
from gait_entrainment_bringup.supervisor import Supervisor
from gait_entrainment_nodes.messaging.domain import DomainError, claimed_domain
from gait_entrainment_nodes.messaging.environment import set_environment

DESCRIPTION = "Play a bag to the gait analyzer, and compare with what was recorded live."
EXAMPLES = """examples:
  entrain replay bags/paper_example              as fast as the analyzer takes it
  entrain replay bags/paper_example --rate 1     at the pace of the record, to watch it in RViz
  entrain replay bags/mine --out bags/again      records the replay, with the new results
  ROS_DOMAIN_ID=42 entrain replay bags/mine --rate 2

Exit code 1 where the results differ from those that were recorded, or the replay failed.
"""
# After the replay has ended, the recorder has this long to close the bag [s].
CLOSING_TIMEOUT = 15.0
STOP_ORDER = ("bag_player", "gait_analyzer", "bag_recorder")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="folder or .mcap file")
    parser.add_argument(
        "--rate", type=float, help="seconds of the bag per second; default: as fast as it goes"
    )
    parser.add_argument("--out", type=Path, help="record the replay into this folder")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(options: argparse.Namespace) -> int:
    """Replay and print; 1 where it failed or the results differ, 2 for a wrong option."""
    wrong = ""
    if not options.bag.exists():
        wrong = f"{options.bag}: no such file or folder"
    elif options.rate is not None and not 0 < options.rate < float("inf"):
        wrong = f"--rate: {options.rate:g}; allowed: above 0; without it, as fast as it goes"
    elif not is_utf8(options.bag):
        wrong = f"{str(options.bag)!a}: allowed: a name in UTF-8"
    elif options.out is not None:
        try:
            check_output(options.out)
        except ProtocolError as error:
            wrong = str(error)
    if wrong:
        print(f"entrain replay: {wrong}", file=sys.stderr)
        return 2
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    # Imported here, so that a mistake is answered without waiting for rclpy.
    from gait_entrainment_bringup.replay_client import ReplayError

    try:
        recorded = read_run(options.bag, torques=False)
        with claimed_domain() as domain:
            results = replay(options, domain)
        return report(options, recorded, results)
    except KeyboardInterrupt:
        print("entrain replay: interrupted", file=sys.stderr)
    except (ReplayError, DomainError, BagError) as error:
        print(f"entrain replay: {error}", file=sys.stderr)
    return 1


def replay(options: argparse.Namespace, domain: int) -> dict[str, list[bytes]]:
    """Start the nodes, play the bag, stop the nodes; return the results by topic."""
    from gait_entrainment_bringup.replay_client import ReplayClient, ReplayError

    environment = set_environment(domain)
    recorder = options.out is not None
    # The analyzer listens, and where the replay is recorded the recorder.
    listeners = 2 if recorder else 1
    namespace, parameters = replay_parameters(options.bag, listeners=listeners)
    parameters["bag_player"] |= {"rate": options.rate or 0.0, "start_paused": True}
    if recorder:
        with BagReader(options.bag) as bag:
            custom_data = bag.custom_data | {"replay_of": options.bag.name}
        parameters["bag_recorder"] = {
            "output": str(options.out.absolute()),
            "publishers": ["gait_analyzer", "bag_player"],
            "custom_data": json.dumps(custom_data),
            "use_sim_time": True,
        }
    with tempfile.TemporaryDirectory(prefix="entrain_") as folder:
        common = parameter_arguments(parameters, Path(folder))
        remaps = [f"__ns:={namespace}", *(f"{name}:={name[1:]}" for name in MOVED)]
        moved = [word for remap in remaps for word in ("-r", remap)] if namespace else []
        supervisor = Supervisor(Path(folder), environment)
        client: ReplayClient | None = None
        try:
            for node in (*REPLAY_NODES, *(["bag_recorder"] if recorder else [])):
                supervisor.start(node, [*common, *moved])
            client = ReplayClient(supervisor, namespace, listeners=listeners)
            client.play(quiet=options.json)
            if recorder and supervisor.wait("bag_recorder", CLOSING_TIMEOUT) != 0:
                raise ReplayError(
                    "bag_recorder did not complete the record\n"
                    + supervisor.last_lines("bag_recorder")
                )
            return client.results
        finally:
            if client is not None:
                client.close()
            supervisor.stop(STOP_ORDER)


def report(
    options: argparse.Namespace, recorded: RecordedRun, results: dict[str, list[bytes]]
) -> int:
    """Print what came of the replay, and how it compares with the record."""
    differing, compared = differences(options.bag, results)
    names = ("strides", "pulse phases", "verdicts")
    counts = dict(zip(names, (len(messages) for messages in results.values()), strict=True))
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


def differences(path: Path, results: dict[str, list[bytes]]) -> tuple[list[str], bool]:
    """
    Compare results with those in a bag, byte for byte.

    Returns
    -------
    differing
        A line for each topic that differs.
    compared
        Whether there was anything to compare with.

    """
    differing = []
    compared = False
    with BagReader(path) as bag:
        for topic, messages in results.items():
            name = next((name for name in bag.topics if name.endswith(f"/{topic}")), None)
            if name is None:
                continue
            compared = True
            found = sorted(bag.messages([name]), key=lambda message: message.place)
            for number, (live, again) in enumerate(zip(found, messages, strict=False), start=1):
                if live.data != again:
                    differing.append(f"{topic}: message {number} is another")
                    break
            else:
                if len(found) != len(messages):
                    differing.append(
                        f"{topic}: {len(found)} messages recorded, {len(messages)} replayed"
                    )
    return differing, compared
