# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Options that name a walker and a kind of pulse, for the commands that ask about locking."""

import argparse
import math
from dataclasses import fields
from typing import TYPE_CHECKING

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.settings import settings_of

if TYPE_CHECKING:
    from gait_entrainment_studies.locking.pulsed_gait import PulsedGait

PAPER_FRACTION = 0.1
PAPER_WIDTH = 0.1


def add_walker_options(parser: argparse.ArgumentParser) -> None:
    """Add one option per parameter of the walker; the defaults are Table 1."""
    group = parser.add_argument_group("walker (default: Table 1)")
    for name, told in settings_of(WalkerParameters).items():
        text = f"{told.meaning} [{told.unit}]; default {getattr(WalkerParameters, name):g}"
        option = "--" + name.replace("_", "-")
        group.add_argument(option, type=float, help=text, metavar="FLOAT")


def add_pulse_options(parser: argparse.ArgumentParser) -> None:
    """Add height and width of the pulse; the defaults are the paper's."""
    group = parser.add_argument_group("pulse (default: the paper's)")
    height = group.add_mutually_exclusive_group()
    height.add_argument(
        "--torque", type=float, metavar="FLOAT", help="height [N m], plantarflexion positive"
    )
    height.add_argument(
        "--torque-fraction",
        type=float,
        metavar="FLOAT",
        default=PAPER_FRACTION,
        help=f"the same as a fraction of the peak ankle torque; default {PAPER_FRACTION}",
    )
    group.add_argument(
        "--width",
        type=float,
        metavar="FLOAT",
        default=PAPER_WIDTH,
        help=f"duration [s]; default {PAPER_WIDTH}",
    )


def check_at_least(name: str, value: int, least: int) -> None:
    """Raise ValueError where a number is too small."""
    if value < least:
        raise ValueError(f"{name} {value} is out of range; allowed: at least {least}")


def check_period_offset(offset: float, gait: "PulsedGait") -> None:
    """Raise ValueError where pulses would overlap, or stay in place without a lock."""
    from gait_entrainment_studies.locking.walked import CREEP

    least = gait.width - gait.unperturbed_period
    if not least < offset < math.inf:
        raise ValueError(
            f"period_offset {offset:g} s is out of range; allowed: above {least:.4g} s"
        )
    if abs(offset) <= CREEP:
        raise ValueError(
            f"period_offset {offset:g} s is the stride period itself, where a pulse in swing stays"
            f" without a lock; allowed: more than {CREEP:g} s off it"
        )


def chosen_walker(options: argparse.Namespace) -> WalkerParameters:
    """Return the walker; raises ParameterError where it has no gait."""
    given = {field.name: getattr(options, field.name) for field in fields(WalkerParameters)}
    return WalkerParameters(**{name: value for name, value in given.items() if value is not None})


def chosen_torque(options: argparse.Namespace, walker: WalkerParameters) -> float:
    """Return the height of the pulse [N m]; raises ValueError where it is not a number."""
    torque = options.torque
    if torque is None:
        torque = options.torque_fraction * walker.peak_torque
    if not math.isfinite(torque):
        raise ValueError(f"torque {torque} N m is not a finite number")
    return float(torque)
