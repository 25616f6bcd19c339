# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain run: the nodes as processes, one protocol conducted, the run recorded."""

import argparse
import json
import os
import shutil
import signal
import sys
import tempfile
from pathlib import Path
from typing import Any

from gait_entrainment.commands.outcome_options import add_onset_option
from gait_entrainment.commands.protocol_options import add_protocol_options, chosen_protocol
from gait_entrainment.protocol import Protocol, ProtocolError, write_protocol
from gait_entrainment.robot import DeviceError, DeviceLimits, LimitError, find_driver
from gait_entrainment_bags import BagError, BagReader, UnreadableBagError, recover
from gait_entrainment_bringup.node_list import (
    NODES,
    REAL_TIME_LOOKAHEAD,
    STOP_ORDER,
    bag_folder,
    parameter_arguments,
    parameters,
)
from gait_entrainment_bringup.provenance import provenance
from gait_entrainment_bringup.supervisor import Supervisor
from gait_entrainment_nodes.messaging.domain import DomainError, claimed_domain
from gait_entrainment_nodes.messaging.environment import set_environment

DESCRIPTION = "Start the nodes, conduct a protocol, record a bag, print the outcome."
EXAMPLES = """examples:
  entrain run                          the paper's example, as fast as it goes
  entrain run --real-time              the same at the pace of the wall clock
  entrain run my_protocol.yaml --out bags/mine
  ROS_DOMAIN_ID=42 entrain run         in a domain of your choice, to listen with other tools
  ROS_DOMAIN_ID=42 entrain run --elsewhere walker_sim     it runs on another host: docs/hosts.md
"""
# Nodes that may run on another host. Not those that hold the torque and the record: Ctrl-C must
# reach them without a network.
DETACHABLE = ("walker_sim", "gait_analyzer")
# After the experiment has ended, the recorder has this long to close the bag [s].
CLOSING_TIMEOUT = 15.0


class RunError(Exception):
    """The run has failed; the message says why."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_run_options(parser)
    parser.add_argument(
        "--elsewhere",
        action="append",
        choices=DETACHABLE,
        default=[],
        help="do not start this node: it runs on another host (entrain node); repeatable",
    )
    parser.add_argument("--no-figures", action="store_true", help="draw no figures")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def add_run_options(parser: argparse.ArgumentParser) -> None:
    """Add the options from which the parameters of the nodes follow."""
    add_protocol_options(parser)
    parser.add_argument(
        "--real-time", action="store_true", help="at the pace of the wall clock, not in lock-step"
    )
    parser.add_argument(
        "--lead-time",
        type=float,
        help="real time: how far promised torque leads, 0.05 to 10 s (default "
        f"{REAL_TIME_LOOKAHEAD:g}); more for a slow network",
    )
    parser.add_argument(
        "--arm", action="store_true", help="let a real ankle robot deliver torque (docs/safety.md)"
    )
    parser.add_argument("--out", type=Path, help="folder of the bag; default bags/<time>_<name>")
    parser.add_argument(
        "--require-record",
        action="store_true",
        help="end the run where nothing more can be recorded, as on a full disk",
    )
    parser.add_argument(
        "--sample-rate",
        type=float,
        help="samples per second, 0 to 1000; 0 samples at gait events only (default 200)",
    )
    parser.add_argument(
        "--no-ground-reaction", action="store_true", help="leave out the ground reaction forces"
    )
    add_onset_option(parser)


def run(options: argparse.Namespace) -> int:
    """Run one experiment; 1 where it or the robot failed, 2 for a wrong protocol or option."""
    try:
        protocol = checked_protocol(options)
        check_driver(protocol.driver, options)
        if options.elsewhere and "ROS_DOMAIN_ID" not in os.environ:
            raise ProtocolError("--elsewhere: set ROS_DOMAIN_ID, to the same number on every host")
        bag = options.out or bag_folder(protocol)
        check_output(bag)
    except (ProtocolError, LimitError, DeviceError) as error:
        print(f"entrain run: {error}", file=sys.stderr)
        return 2 if isinstance(error, ProtocolError) else 1
    # Stopping from outside takes the same path as Ctrl-C: torque first, then the rest.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with claimed_domain() as domain:
            conduct(protocol, bag, domain, options)
        return report(bag, options)
    except KeyboardInterrupt:
        print(f"entrain run: interrupted{kept(bag)}", file=sys.stderr)
    except (RunError, DomainError, BagError) as error:
        print(f"entrain run: {error}", file=sys.stderr)
    return 1


def checked_protocol(options: argparse.Namespace) -> Protocol:
    """
    Return the protocol that the options name, once it and they are seen to be right.

    Raises
    ------
    ProtocolError, LimitError
        One line: field or option, what is allowed.

    """
    protocol = chosen_protocol(options)
    DeviceLimits().check_pulse(protocol.pulse_torque, protocol.pulses.width)
    if options.sample_rate is not None and not 0 <= options.sample_rate <= 1000:
        raise ProtocolError(f"--sample-rate: {options.sample_rate:g}; allowed: 0 to 1000 Hz")
    if options.lead_time is not None and not 0.05 <= options.lead_time <= 10:
        raise ProtocolError(f"--lead-time: {options.lead_time:g}; allowed: 0.05 to 10 s")
    return protocol


def check_driver(text: str, options: argparse.Namespace) -> None:
    """
    Hold a driver against the mode of the run, before anything is started for it.

    Raises
    ------
    LimitError
        where there is no such driver, or it is a real one and the run is in lock-step, or nobody
        has armed it.
    DeviceError
        where it cannot be loaded.

    """
    driver = find_driver(text)
    if driver.simulated:
        return
    if not options.real_time:
        raise LimitError(f"driver: {driver.name} runs in real time only; add --real-time")
    if not options.arm:
        raise LimitError(
            f"driver: {driver.name} applies real torque: see that all is well, then add --arm"
        )


def check_output(bag: Path) -> None:
    """Raise ProtocolError where a bag cannot be made, before anything is started for it."""
    if not is_utf8(bag):
        raise ProtocolError(f"--out: {str(bag.absolute())!a}; allowed: a name in UTF-8")
    if os.path.lexists(bag):
        raise ProtocolError(f"--out: {bag} is already there; a bag is never overwritten")
    parent = next(folder for folder in bag.absolute().parents if folder.exists())
    if not parent.is_dir():
        raise ProtocolError(f"--out: {parent} is not a folder; allowed: a new folder in a folder")
    try:
        tempfile.TemporaryDirectory(dir=parent).cleanup()
    except OSError as error:
        raise ProtocolError(
            f"--out: {parent} cannot be written to: {error.strerror}; choose another folder"
        ) from None


def is_utf8(path: Path) -> bool:
    """Whether a path can be the value of a ROS parameter."""
    return not any("\ud800" <= character <= "\udfff" for character in str(path.absolute()))


def kept(bag: Path) -> str:
    """
    Say what is left of a run that failed, having made it readable.

    A recorder that was killed could not close the bag; what reached the file is rescued.
    """
    if not bag.exists():
        return ""
    try:
        BagReader(bag).close()
    except UnreadableBagError:
        damaged = bag.with_name(f"{bag.name}_unfinished")
        try:
            bag.rename(damaged)
            recover(damaged, bag)
            shutil.rmtree(damaged)
        except (BagError, OSError) as error:
            return f"; the bag was not closed and could not be rescued: {error}"
        return f"; the bag was not closed, what could be rescued of it is {bag}"
    return f"; the bag of the run so far is {bag}"


def chosen_parameters(
    protocol: Protocol, bag: Path, options: argparse.Namespace
) -> dict[str, dict[str, Any]]:
    """Return the parameters of every node, by its name, as the options ask for them."""
    chosen = parameters(
        protocol,
        str(bag.absolute()),
        json.dumps(provenance(protocol, real_time=options.real_time, onset=options.onset)),
        real_time=options.real_time,
        armed=options.arm,
        onset=options.onset,
    )
    if options.sample_rate is not None:
        chosen["walker_sim"]["sample_rate"] = options.sample_rate
    if options.require_record:
        chosen["bag_recorder"]["required"] = True
    if options.no_ground_reaction:
        chosen["walker_sim"]["ground_reaction"] = False
    if options.real_time and options.lead_time is not None:
        chosen["experiment"]["longest_lookahead"] = options.lead_time
    return chosen


def conduct(protocol: Protocol, bag: Path, domain: int, options: argparse.Namespace) -> None:
    """Start the nodes, conduct the protocol, stop the nodes."""
    # Imported here, so that a mistake in the protocol is answered without waiting for rclpy.
    from gait_entrainment_bringup.run_client import RunClient

    environment = set_environment(domain)
    text = write_protocol(protocol)
    node_parameters = chosen_parameters(protocol, bag, options)
    with tempfile.TemporaryDirectory(prefix="entrain_") as folder:
        arguments = parameter_arguments(node_parameters, Path(folder))
        supervisor = Supervisor(Path(folder), environment)
        try:
            for node in sorted(set(NODES) - set(options.elsewhere), key=NODES.index):
                supervisor.start(node, arguments)
            client = RunClient(supervisor, protocol, quiet=options.json)
            try:
                failure, blamed = client.conduct(text)
                if not failure and supervisor.wait("bag_recorder", CLOSING_TIMEOUT) != 0:
                    failure, blamed = "bag_recorder did not complete the record", "bag_recorder"
            finally:
                client.close()
        finally:
            supervisor.stop(STOP_ORDER)
        if failure:
            lines = supervisor.last_lines(blamed) if blamed else ""
            raise RunError(f"{failure}{kept(bag)}" + (f"\n{lines}" if lines else ""))
    (bag / "protocol.yaml").write_text(text)


def walker_timing(bag: Path) -> Any:
    """Return the walker's last word on its timing, a WalkerTiming message; None without one."""
    from gait_entrainment_nodes.messaging.topics import WALKER_TIMING

    with BagReader(bag) as reader:
        names = [name for name in reader.topics if name.endswith(f"/{WALKER_TIMING.name}")]
        timings = [message for _, message in reader.decoded(names)]
    return timings[-1] if timings else None


def report(bag: Path, options: argparse.Namespace) -> int:
    """Print the outcome from the bag and draw its figures."""
    from gait_entrainment.outcome import summary, timing_summary
    from gait_entrainment_bags.recorded_run import messages_line, read_run, recorded_outcome

    recorded = read_run(bag)
    outcome = recorded_outcome(recorded, bag)
    timing = walker_timing(bag)
    lateness = {}
    if timing is not None:
        if timing.samples:
            names = ("p50", "p99", "worst")
            lateness = {n: 1e3 * getattr(timing, f"publish_late_{n}") for n in names}
            outcome["publish_lateness_ms"] = lateness
        outcome["promises"] = {
            "late_stretches": timing.late_stretches,
            "late_ms": 1e3 * timing.late,
            "starved_stretches": timing.starved_stretches,
            "starved_ms": 1e3 * timing.starved,
        }
    figures = []
    if not options.no_figures:
        from gait_entrainment_bags.figures import draw_figures

        figures = draw_figures(recorded, bag)
    if options.json:
        print(json.dumps(outcome))
        return 0
    for line in (summary(outcome), *timing_summary(outcome["pulse_timing"])):
        print(line)
    if (factor := outcome["real_time_factor"]) is not None:
        print(f"speed            {factor:.0f} times real time")
    if lateness:
        print(
            f"real time        samples published {lateness['p50']:.2f} ms after they were due"
            f" (median), {lateness['p99']:.2f} ms (99 %), {lateness['worst']:.2f} ms (worst)"
        )
    if timing is not None and (timing.late_stretches or timing.starved_stretches):
        print(
            f"promises         of perturbator: {timing.late_stretches} late by"
            f" {1e3 * timing.late:.1f} ms in all, {timing.starved_stretches} stretches of"
            f" {1e3 * timing.starved:.1f} ms walked without torque: not reproducible"
        )
    print(messages_line(recorded))
    print(f"bag              {bag}")
    for figure in figures:
        print(f"figure           {figure}")
    return 0
