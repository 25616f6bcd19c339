# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Options of the commands that tell the outcome of one run."""

import argparse


def add_onset_option(parser: argparse.ArgumentParser, onset: str | None = "commanded") -> None:
    """Add how the onset of a pulse is taken; None as default is that of the recorded run."""
    parser.add_argument(
        "--onset",
        choices=("commanded", "measured"),
        default=onset,
        help="take the onset of a pulse from the command or from the measured torque (default: "
        f"{onset or 'as in the recorded run'})",
    )


def add_outcome_options(parser: argparse.ArgumentParser, onset: str | None = "commanded") -> None:
    """Add how the onset of a pulse is taken, and in which form the outcome is printed."""
    add_onset_option(parser, onset)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
