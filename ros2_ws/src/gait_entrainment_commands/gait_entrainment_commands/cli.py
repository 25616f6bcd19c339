# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Shared by commands: options made from settings, and output formats."""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from gait_entrainment.settings import Setting, settings_of
from gait_entrainment_commands.drawing import add_dpi_option, chosen_dpi
from gait_entrainment_commands.outcome import without_nan

Chosen = TypeVar("Chosen")
Group = argparse._ActionsContainer  # a parser, or a group of its options


def add_setting(
    group: Group,
    name: str,
    setting: Setting,
    default: str | None = None,
    shown: str | None = None,
    **more: Any,
) -> None:
    """Add the option for a setting, whose value is text; ``shown`` is its default in words."""
    unit = f" [{setting.unit}]" if setting.unit else ""
    text = f"; default {shown or default}" if shown or default else ""
    group.add_argument(
        "--" + name.replace("_", "-"),
        default=default,
        metavar=setting.kind.__name__.upper(),
        help=setting.meaning + unit + text,
        **more,
    )


def add_settings(group: Group, owner: type) -> None:
    """Add an option for each setting of a dataclass."""
    for name, setting in settings_of(owner).items():
        default = getattr(owner, name)
        add_setting(group, name, setting, shown=None if default is None else f"{default:g}")


def chosen(options: argparse.Namespace, owner: type[Chosen], **rest: Any) -> Chosen:
    """Return the dataclass that the options describe; raises SettingError."""
    given = {
        name: setting.parse(name, text)
        for name, setting in settings_of(owner).items()
        if (text := getattr(options, name)) is not None
    }
    return owner(**given, **rest)


def add_json_option(parser: argparse.ArgumentParser) -> None:
    """Add the option for machine-readable output."""
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def add_onset_option(parser: argparse.ArgumentParser, onset: str | None = "commanded") -> None:
    """Add the choice of pulse onset; None as default takes that of the recorded run."""
    parser.add_argument(
        "--onset",
        choices=("commanded", "measured"),
        default=onset,
        help="take the onset of a pulse from the command or from the measured torque (default: "
        f"{onset or 'as in the recorded run'})",
    )


def add_output_options(
    parser: argparse.ArgumentParser, out: str, default: Path | None = None
) -> None:
    """Add the options for the folder of figures, which `out` describes, and for JSON output."""
    parser.add_argument("--out", type=Path, default=default, metavar="DIR", help=out)
    add_dpi_option(parser)
    add_json_option(parser)


def answer(
    options: argparse.Namespace,
    outcome: Any,
    text: str,
    write: Callable[[Path], list[Path]],
    label: str = "figure           ",
) -> int:
    """Print the outcome; if a folder is given, write files there, print their paths; return 0."""
    print(json.dumps(without_nan(outcome)) if options.json else text)
    if options.out is None:
        return 0
    with chosen_dpi(options):
        written = write(options.out)
    for path in written if not options.json else ():
        print(f"{label}{path}")
    return 0
