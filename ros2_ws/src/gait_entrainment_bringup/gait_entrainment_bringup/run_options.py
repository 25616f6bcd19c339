# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The options that decide the parameters of the nodes, checked before anything starts."""

import argparse
import itertools
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from gait_entrainment.errors import UsageError
from gait_entrainment.protocol import Protocol
from gait_entrainment.robot import LimitError, driver_on, find_driver, make_robots
from gait_entrainment.settings import Setting
from gait_entrainment_bags.errors import is_utf8
from gait_entrainment_bags.truth import TOE_OFF_BIAS
from gait_entrainment_bringup.node_list import (
    DETECTOR,
    LEAD_TIME,
    WALKERS,
    Parameters,
    bag_folder,
    parameters,
)
from gait_entrainment_commands.cli import add_onset_option
from gait_entrainment_commands.protocol_options import add_protocol_options, chosen_protocol
from gait_entrainment_drivers.proof import require_proof
from gait_entrainment_sessions.session_file import Session, read_session

_SWITCHES = {
    "--real-time": "run at the pace of the wall clock, not in lock-step",
    "--arm": "let a real ankle robot deliver torque (docs/safety.md)",
    "--arm-later": "start unarmed; arm on the page or by perturbator/arm before the first pulse",
    "--unproved": "arm it even if its watchdog was not proved here; the bag records that",
    "--require-record": "end the run if nothing more can be recorded, as on a full disk",
    "--no-ground-reaction": "leave out the ground reaction forces",
}
SESSION_FILE = "the file is a session file"
_NUMBERS = {
    "lead_time": Setting(
        f"real time: lead of promised torque (default {LEAD_TIME:g}); more for a slow network",
        unit="s",
        least=0.05,
        most=10,
    ),
    "sample_rate": Setting(
        "samples per second (default 200); 0 samples at gait events only",
        unit="Hz",
        least=0,
        most=1000,
    ),
    "toe_off_bias": TOE_OFF_BIAS,
}


def add_run_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of one run."""
    add_protocol_options(parser)
    add_conduct_options(parser, "folder of the bag; default bags/<time>_<name>")


def add_conduct_options(parser: argparse.ArgumentParser, out: str) -> None:
    """Add the options of how a protocol is conducted, and ``--out`` with its meaning."""
    for option, text in _SWITCHES.items():
        parser.add_argument(option, action="store_true", help=text)
    for name, setting in _NUMBERS.items():
        text = f"{setting.meaning}; {setting.allowed}"
        parser.add_argument(_option(name), metavar="FLOAT", help=text)
    parser.add_argument(
        "--walker",
        choices=WALKERS,
        default="simulated",
        help="the model with exact events, the model through sensors and detectors, or a person",
    )
    parser.add_argument(
        "--detector", default=DETECTOR, help=f"detector of gait events; default {DETECTOR}"
    )
    parser.add_argument("--sensor", default="", help="sensor to emulate; default: the detector's")
    parser.add_argument("--out", type=Path, help=out)
    add_onset_option(parser)


def _option(name: str) -> str:
    return "--" + name.replace("_", "-")


def checked_run(
    options: argparse.Namespace, *, drives: bool = True, records: bool = True
) -> tuple[Protocol, Path]:
    """
    Check all options; return the protocol that they name and the folder of the bag.

    The driver is checked only if this process ``drives`` the robot, the folder if it ``records``.
    Raises UsageError, LimitError or DeviceError.
    """
    protocol = chosen_protocol(options)
    check_numbers(options)
    check_walker(options.walker, options.detector, real_time=options.real_time)
    if drives:
        _check_arming(protocol, options)
    bag = options.out or bag_folder(protocol)
    if records:
        check_output(bag, exactly=options.out is not None)
    return protocol, bag


def checked_session(file: Path | str | None, options: argparse.Namespace) -> Session:
    """
    Check all options; return the session of a file.

    Raises SessionError, UsageError, LimitError or DeviceError.
    """
    if not file:
        raise UsageError("--session: no file is given; allowed: a session file")
    session = read_session(Path(file))
    check_numbers(options)
    check_walker(options.walker, options.detector, real_time=options.real_time)
    for block in session.blocks:
        _check_arming(block.protocol, options)
    return session


def _check_arming(protocol: Protocol, options: argparse.Namespace) -> None:
    armed = options.arm or options.arm_later
    check_robot(protocol, real_time=options.real_time, armed=armed, unproved=options.unproved)


def check_walker(walker: str, detector: str, *, real_time: bool) -> None:
    """Raise UsageError if nothing would walk in this mode, or nothing would find the events."""
    if walker == "person" and not real_time:
        raise UsageError("--walker: a person walks only in real time; add --real-time")
    if walker != "simulated":
        from gait_entrainment_sensors import find_detector

        chosen = find_detector(detector)
        if chosen.detector.lacks:
            print(f"{chosen.name}: {chosen.detector.lacks}", file=sys.stderr)


def check_numbers(options: argparse.Namespace) -> None:
    """Convert the options that are numbers; raises SettingError."""
    for name, setting in _NUMBERS.items():
        if (text := getattr(options, name)) is not None:
            setattr(options, name, setting.parse(_option(name), text))


def check_robot(protocol: Protocol, *, real_time: bool, armed: bool, unproved: bool) -> None:
    """Raise LimitError or DeviceError if a run could not get torque from a protocol's robot."""
    driver = find_driver(protocol.driver)
    if driver.simulated:
        return
    if not real_time:
        raise LimitError(f"driver: {driver.name} runs in real time only; add --real-time")
    if not armed:
        raise LimitError(
            f"driver: {driver.name} applies real torque: check that all is well, then add --arm, "
            "or --arm-later to arm it once the walk has started"
        )
    for side in make_robots(protocol.driver, protocol.sides, protocol.limits):
        require_proof(driver_on(protocol.driver, side), unproved=unproved)


def check_output(bag: Path, option: str = "--out", *, exactly: bool = True) -> None:
    """
    Raise UsageError if a bag cannot be made there or, unless ``exactly``, under a similar name.

    The message begins with the option that named it.
    """
    if not is_utf8(bag):
        raise UsageError(f"{option}: {str(bag.absolute())!a}; allowed: a name in UTF-8")
    if exactly and os.path.lexists(bag):
        raise UsageError(f"{option}: {bag} already exists; a bag is never overwritten")
    parent = next(folder for folder in bag.absolute().parents if folder.exists())
    if not parent.is_dir():
        raise UsageError(f"{option}: {parent} is not a folder; allowed: a new folder in a folder")
    try:
        tempfile.TemporaryDirectory(dir=parent).cleanup()
    except OSError as error:
        raise UsageError(
            f"{option}: {parent} cannot be written to: {error.strerror}; choose another folder"
        ) from None


@contextmanager
def claimed_folder(bag: Path, *, exactly: bool) -> Iterator[Path]:
    """
    Make the folder of a bag and claim it for this run; remove it if it stays empty.

    If the folder exists, a number is appended to its name; UsageError if it must be ``exactly``
    this one.
    """
    parents = [parent for parent in bag.absolute().parents if not parent.exists()]
    for number in itertools.count(1):
        folder = bag if number == 1 else bag.with_name(f"{bag.name}_{number}")
        try:
            folder.mkdir(parents=True)
            break
        except FileExistsError:
            if exactly:
                raise UsageError(
                    f"--out: {bag} already exists; a bag is never overwritten"
                ) from None
    try:
        yield folder
    finally:
        with suppress(OSError):  # not empty
            for made in (folder, *parents):
                made.rmdir()


def chosen_parameters(protocol: Protocol, bag: Path, options: argparse.Namespace) -> Parameters:
    """Return the parameters of every node according to the options."""
    chosen = parameters(
        protocol,
        bag,
        real_time=options.real_time,
        armed=options.arm,
        unproved=options.unproved,
        onset=options.onset,
        lead_time=LEAD_TIME if options.lead_time is None else options.lead_time,
        walker=options.walker,
        detector=options.detector,
        sensor=options.sensor,
        toe_off_bias=options.toe_off_bias or 0.0,
    )
    # Everything else stays as in config/nodes.yaml.
    walker = chosen.get(WALKERS[options.walker][0], {})
    if options.sample_rate is not None:
        walker["sample_rate"] = options.sample_rate
    if options.no_ground_reaction:
        walker["ground_reaction"] = False
    if options.require_record:
        chosen["bag_recorder"]["required"] = True
    return chosen
