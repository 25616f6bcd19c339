# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Options that the commands share: the walker and its pulses."""

import argparse
from dataclasses import dataclass

from gait_entrainment.errors import UsageError
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.settings import Setting, setting
from gait_entrainment_commands.cli import add_settings, chosen
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.locking.walked import CREEP

PERIOD_OFFSET = Setting("pulse period minus the unperturbed stride period", unit="s")


@dataclass(frozen=True)
class PulseOptions:
    """The pulse, by default the paper's."""

    torque: float | None = setting(
        None, "height, plantarflexion positive", "N m", kind=float, optional=True
    )
    torque_fraction: float = setting(0.1, "the same as a fraction of the peak ankle torque")
    width: float = setting(0.1, "duration", "s")


def add_walker_options(parser: argparse.ArgumentParser) -> None:
    """Add the parameters of the walker; the defaults are Table 1."""
    add_settings(parser.add_argument_group("walker (default: Table 1)"), WalkerParameters)


def add_gait_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``chosen_gait``."""
    add_settings(parser.add_argument_group("pulse (default: the paper's)"), PulseOptions)
    add_walker_options(parser)


def chosen_gait(options: argparse.Namespace) -> PulsedGait:
    """Return the walker under its pulses; raises UsageError if there is no such gait."""
    if options.torque is not None and options.torque_fraction is not None:
        raise UsageError("torque: give either torque or torque_fraction")
    walker, pulse = chosen(options, WalkerParameters), chosen(options, PulseOptions)
    fraction = pulse.torque_fraction * walker.peak_torque
    return PulsedGait(walker, fraction if pulse.torque is None else pulse.torque, pulse.width)


def chosen_offset(text: str, gait: PulsedGait) -> float:
    """Return a PERIOD_OFFSET; raises UsageError if pulses would overlap or never lock."""
    offset: float = PERIOD_OFFSET.parse("period_offset", text)
    least = gait.width - gait.unperturbed_period
    if not offset > least:
        raise UsageError(f"period_offset: {offset:g} s; allowed: above {least:.4g} s")
    if abs(offset) <= CREEP:
        raise UsageError(
            f"period_offset: {offset:g} s is the stride period itself, at which a pulse in swing"
            f" stays there without a lock; allowed: more than {CREEP:g} s off it"
        )
    return offset
