# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Options that name a protocol and change single fields of it, for every command that runs one."""

import argparse
from dataclasses import fields
from enum import Enum
from operator import attrgetter

from gait_entrainment.parameters import WalkerParameters
from gait_entrainment.protocol import DEFAULT_PROTOCOL, Protocol, read_protocol

# Option -> (field of the protocol, type, what it says in the help)
_OPTIONS = {
    "--period-offset": ("pulses.period_offset", float, "pulse period minus stride period [s]"),
    "--period": ("pulses.period", float, "pulse period [s], instead of an offset"),
    "--initial-phase": (
        "pulses.initial_phase",
        float,
        "first pulse, as a fraction of a stride after the baseline [0, 1)",
    ),
    "--torque": ("pulses.torque", float, "height of the pulses [N m], plantarflexion positive"),
    "--torque-fraction": (
        "pulses.torque_fraction",
        float,
        "the same as a fraction of the peak ankle torque, -1 to 1",
    ),
    "--width": ("pulses.width", float, "duration of a pulse [s]"),
    "--baseline": ("baseline", int, "strides before the pulses"),
    "--pulses": ("pulses.count", int, "number of pulses"),
    "--washout": ("washout", int, "strides after the strides of the pulses"),
    "--side": ("side", str, "the perturbed leg: left or right"),
    "--name": ("name", str, "name of the experiment"),
    "--driver": ("driver", str, "ankle robot driver, as entrain driver list has them"),
    "--seed": ("seed", int, "seed of whatever is random"),
    **{
        "--" + f.name.replace("_", "-"): (
            f"walker.{f.name}",
            float,
            f"{f.metadata['meaning']} [{f.metadata['unit']}]",
        )
        for f in fields(WalkerParameters)
    },
}


def add_protocol_options(parser: argparse.ArgumentParser) -> None:
    """Add the protocol file and the options that override its fields."""
    parser.add_argument(
        "protocol", nargs="?", metavar="PROTOCOL.yaml", help="default: the paper's example"
    )
    group = parser.add_argument_group("fields of the protocol")
    for option, (field, kind, text) in _OPTIONS.items():
        group.add_argument(
            option,
            dest=field,
            type=kind,
            help=text + _default_text(field),
            metavar=kind.__name__.upper(),
        )


def _default_text(field: str) -> str:
    default = attrgetter(field)(DEFAULT_PROTOCOL)
    if default is None:  # another field says the same
        return ""
    if isinstance(default, Enum):
        default = default.name.lower()
    return f"; default {default:g}" if isinstance(default, float) else f"; default {default}"


def chosen_protocol(options: argparse.Namespace) -> Protocol:
    """
    Return the protocol that the options name.

    Raises
    ------
    ProtocolError
        One line: place, field, what is allowed.

    """
    given = vars(options)
    overrides = {
        field: (given[field], option)
        for option, (field, _, _) in _OPTIONS.items()
        if given[field] is not None
    }
    return read_protocol(options.protocol, overrides)
