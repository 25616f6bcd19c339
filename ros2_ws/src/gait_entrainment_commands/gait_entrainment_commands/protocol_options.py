# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Options that name a protocol and change single fields of it, for every command that runs one."""

import argparse
from enum import Enum
from operator import attrgetter
from pathlib import Path

from gait_entrainment.protocol import DEFAULT_PROTOCOL, FIELDS, Protocol, read_protocol


def _option(field: str) -> str:
    """Return the option that changes a field of the protocol."""
    if field == "pulses.count":
        return "--pulses"
    section, _, name = field.rpartition(".")
    prefix = {"limits": "limit-", "variation": "variation-"}.get(section, "")
    return f"--{prefix}{name.replace('_', '-')}"


def add_protocol_options(parser: argparse.ArgumentParser) -> None:
    """Add the protocol file and the options that override its fields."""
    text = "default: the paper's example"
    parser.add_argument("protocol", nargs="?", type=Path, metavar="PROTOCOL.yaml", help=text)
    fields = parser.add_argument_group("fields of the protocol")
    limits = parser.add_argument_group("limits on what the person may receive")
    for field, setting in FIELDS.items():
        group = limits if field.startswith("limits.") else fields
        unit = f" [{setting.unit}]" if setting.unit not in ("", "1") else ""
        kind = str if issubclass(setting.kind, Enum) else setting.kind
        group.add_argument(
            _option(field),
            dest=field,
            help=setting.meaning + unit + _default_text(field),
            metavar=kind.__name__.upper(),
        )


def _default_text(field: str) -> str:
    default = attrgetter(field)(DEFAULT_PROTOCOL)
    if default in (None, ""):  # another field sets the same, or there is no default
        return ""
    if isinstance(default, Enum):
        default = default.name.lower()
    return f"; default {default:g}" if isinstance(default, float) else f"; default {default}"


def chosen_protocol(options: argparse.Namespace) -> Protocol:
    """Return the protocol that the options name; ProtocolError, LimitError or DeviceError."""
    given = vars(options)
    overrides = {
        field: (given[field], _option(field)) for field in FIELDS if given[field] is not None
    }
    return read_protocol(options.protocol, overrides, to_run=True)
