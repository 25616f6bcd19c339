# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What the questions share: options made from settings, and the forms of an answer."""

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from gait_entrainment.errors import UsageError
from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.settings import Setting, setting, settings_of
from gait_entrainment_commands.drawing import add_dpi_option, chosen_dpi
from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
from gait_entrainment_studies.locking.walked import CREEP

Chosen = TypeVar("Chosen")
Group = argparse._ActionsContainer  # a parser, or a group of its options

PERIOD_OFFSET = Setting("pulse period minus the unperturbed stride period", unit="s")


@dataclass(frozen=True)
class PulseOptions:
    """The pulse, by default the paper's."""

    torque: float | None = setting(
        None, "height, plantarflexion positive", "N m", kind=float, optional=True
    )
    torque_fraction: float = setting(0.1, "the same as a fraction of the peak ankle torque")
    width: float = setting(0.1, "duration", "s")


def add_setting(
    group: Group,
    name: str,
    told: Setting,
    default: str | None = None,
    shown: str | None = None,
    **more: Any,
) -> None:
    """Add the option for a setting, whose value is text; ``shown`` is its default in words."""
    unit = f" [{told.unit}]" if told.unit else ""
    text = f"; default {shown or default}" if shown or default else ""
    group.add_argument(
        "--" + name.replace("_", "-"),
        default=default,
        metavar=told.kind.__name__.upper(),
        help=told.meaning + unit + text,
        **more,
    )


def add_settings(group: Group, owner: type) -> None:
    """Add an option for each setting of a dataclass."""
    for name, told in settings_of(owner).items():
        default = getattr(owner, name)
        add_setting(group, name, told, shown=None if default is None else f"{default:g}")


def chosen(options: argparse.Namespace, owner: type[Chosen], **rest: Any) -> Chosen:
    """Return the dataclass that the options describe; raises SettingError."""
    given = {
        name: told.parse(name, text)
        for name, told in settings_of(owner).items()
        if (text := getattr(options, name)) is not None
    }
    return owner(**given, **rest)


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
            f" stays without a lock; allowed: more than {CREEP:g} s off it"
        )
    return offset


def add_output_options(
    parser: argparse.ArgumentParser, out: str, default: Path | None = None
) -> None:
    """Add the folder of figures, which `out` describes, and the form of the answer."""
    parser.add_argument("--out", type=Path, default=default, metavar="DIR", help=out)
    add_dpi_option(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def answer(
    options: argparse.Namespace,
    outcome: Any,
    text: str,
    write: Callable[[Path], list[Path]],
    label: str = "figure           ",
) -> int:
    """Print the answer, write its files if a folder is given and print their paths; return 0."""
    print(json.dumps(outcome) if options.json else text)
    if options.out is None:
        return 0
    with chosen_dpi(options):
        written = write(options.out)
    for path in written if not options.json else ():
        print(f"{label}{path}")
    return 0
