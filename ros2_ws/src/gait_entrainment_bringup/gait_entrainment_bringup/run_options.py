# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The options from which the parameters of the nodes follow, checked before anything starts."""

import argparse
import os
import tempfile
from pathlib import Path

from gait_entrainment.commands.outcome_options import add_onset_option
from gait_entrainment.commands.protocol_options import add_protocol_options, chosen_protocol
from gait_entrainment.errors import UsageError
from gait_entrainment.protocol import Protocol
from gait_entrainment.robot import DeviceLimits, LimitError, find_driver
from gait_entrainment.settings import Setting
from gait_entrainment_bringup.node_list import LEAD_TIME, Parameters, parameters

_SAMPLE_RATE = Setting(
    "samples per second; 0 samples at gait events only (default 200)",
    unit="Hz",
    least=0,
    most=1000,
)
_LEAD_TIME = Setting(
    f"real time: how far promised torque leads; more for a slow network (default {LEAD_TIME:g} s)",
    unit="s",
    least=0.05,
    most=10,
)


def add_run_options(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_protocol_options(parser)
    parser.add_argument(
        "--real-time", action="store_true", help="at the pace of the wall clock, not in lock-step"
    )
    for option, told in (("--lead-time", _LEAD_TIME), ("--sample-rate", _SAMPLE_RATE)):
        parser.add_argument(option, metavar="FLOAT", help=f"{told.meaning}; {told.allowed}")
    parser.add_argument(
        "--arm", action="store_true", help="let a real ankle robot deliver torque (docs/safety.md)"
    )
    parser.add_argument("--out", type=Path, help="folder of the bag; default bags/<time>_<name>")
    parser.add_argument(
        "--require-record",
        action="store_true",
        help="end the run if nothing more can be recorded, as on a full disk",
    )
    parser.add_argument(
        "--no-ground-reaction", action="store_true", help="leave out the ground reaction forces"
    )
    add_onset_option(parser)


def checked_protocol(options: argparse.Namespace) -> Protocol:
    """
    Return the protocol that the options name, checked with them.

    Raises
    ------
    UsageError, LimitError
        One line: field or option, what is allowed.

    """
    protocol = chosen_protocol(options)
    DeviceLimits().check_pulse(protocol.pulse_torque, protocol.pulses.width)
    if options.sample_rate is not None:
        options.sample_rate = _SAMPLE_RATE.parse("--sample-rate", options.sample_rate)
    if options.lead_time is not None:
        options.lead_time = _LEAD_TIME.parse("--lead-time", options.lead_time)
    return protocol


def check_driver(text: str, options: argparse.Namespace) -> None:
    """
    Check that a driver can be had and suits the run.

    Raises
    ------
    LimitError
        if there is no such driver, or it is a real one and the run is in lock-step or nobody has
        armed it.
    DeviceError
        if it cannot be loaded.

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
    """Raise UsageError if a bag cannot be made."""
    if not is_utf8(bag):
        raise UsageError(f"--out: {str(bag.absolute())!a}; allowed: a name in UTF-8")
    if os.path.lexists(bag):
        raise UsageError(f"--out: {bag} is already there; a bag is never overwritten")
    parent = next(folder for folder in bag.absolute().parents if folder.exists())
    if not parent.is_dir():
        raise UsageError(f"--out: {parent} is not a folder; allowed: a new folder in a folder")
    try:
        tempfile.TemporaryDirectory(dir=parent).cleanup()
    except OSError as error:
        raise UsageError(
            f"--out: {parent} cannot be written to: {error.strerror}; choose another folder"
        ) from None


def is_utf8(path: Path) -> bool:
    """Whether a path can be the value of a ROS parameter."""
    return not any("\ud800" <= character <= "\udfff" for character in str(path.absolute()))


def chosen_parameters(protocol: Protocol, bag: Path, options: argparse.Namespace) -> Parameters:
    """Return the parameters of every node as the options ask for them."""
    chosen = parameters(
        protocol,
        bag,
        real_time=options.real_time,
        armed=options.arm,
        onset=options.onset,
        lead_time=LEAD_TIME if options.lead_time is None else options.lead_time,
    )
    # What is not said stays as config/nodes.yaml has it.
    if options.sample_rate is not None:
        chosen["walker_sim"]["sample_rate"] = options.sample_rate
    if options.no_ground_reaction:
        chosen["walker_sim"]["ground_reaction"] = False
    if options.require_record:
        chosen["bag_recorder"]["required"] = True
    return chosen
