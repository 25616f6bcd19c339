# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain lock: all phase-locked gaits under one kind of pulse, solved."""

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gait_entrainment_studies.commands.pulse_options import (
    add_pulse_options,
    add_walker_options,
    check_at_least,
    check_period_offset,
    chosen_torque,
    chosen_walker,
)

if TYPE_CHECKING:
    from gait_entrainment_studies.locking.branches import Piece

DESCRIPTION = (
    "Solve for the 1:1 phase-locked gaits: borders of the pulse periods with a stable lock, "
    "named as what they are, and the locked gaits at one period with their Floquet "
    "multipliers and the share of initial phases that each draws."
)
EXAMPLES = """examples:
  entrain lock                                  the paper's pulses at 2 tau_0 - 50 ms
  entrain lock --period-offset -0.067           where two attractors coexist
  entrain lock --torque-fraction -0.1 --period-offset 0.02 --out figures
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "--period-offset",
        type=float,
        default=-0.05,
        metavar="FLOAT",
        help="pulse period minus the unperturbed stride period [s]; default -0.05",
    )
    parser.add_argument(
        "--phases",
        type=int,
        default=32,
        metavar="INT",
        help="initial phases walked from; default 32",
    )
    add_pulse_options(parser)
    add_walker_options(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="draw the branches into a folder")
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(options: argparse.Namespace) -> int:
    """Solve, walk, print."""
    from gait_entrainment_studies.locking.branches import locked_gaits, pieces_of
    from gait_entrainment_studies.locking.pulsed_gait import PulsedGait
    from gait_entrainment_studies.locking.walked import shares_of

    try:
        walker = chosen_walker(options)
        gait = PulsedGait(walker, chosen_torque(options, walker), options.width)
        check_period_offset(options.period_offset, gait)
        check_at_least("phases", options.phases, 1)
    except ValueError as error:
        print(f"entrain lock: {error}", file=sys.stderr)
        return 2
    period = gait.unperturbed_period + options.period_offset
    pieces = pieces_of(gait)
    locks = locked_gaits(gait, period, pieces)
    shares = shares_of(gait, period, locks, options.phases)
    outcome = {
        "unperturbed_stride_period": gait.unperturbed_period,
        "pulse_period": period,
        "torque": gait.torque,
        "width": gait.width,
        "branches": [_branch(piece) for piece in pieces],
        "locked_gaits": [
            {
                **asdict(lock),
                "multipliers": [[m.real, m.imag] for m in lock.multipliers],
                "share_of_initial_phases": shares.drawn.get(lock),
            }
            for lock in locks
        ],
        "walked": {
            str(kind.value): shares.outcomes.count(kind) for kind in dict.fromkeys(shares.outcomes)
        },
    }
    if options.json:
        print(json.dumps(outcome))
    else:
        print(_summary(outcome))
    if options.out is not None:
        from gait_entrainment_studies.locking.figures import draw_branches

        for path in draw_branches(gait, pieces, locks, options.out):
            if not options.json:
                print(f"figure           {path}")
    return 0


def _branch(piece: "Piece") -> dict[str, Any]:
    """Return a piece as JSON holds it: there is no number where there is no gait."""
    ends = {
        name: {key: None if value != value else value for key, value in asdict(end).items()}
        for name, end in (("first", piece.first), ("last", piece.last))
    }
    return {**asdict(piece), **ends}


def _summary(outcome: dict[str, Any]) -> str:
    unperturbed = outcome["unperturbed_stride_period"]
    offset = (outcome["pulse_period"] - unperturbed) * 1e3
    lines = [
        f"pulses           {outcome['torque']:.3f} N m for {outcome['width']:g} s",
        f"stride period    {unperturbed:.9f} s unperturbed",
        "",
        "Branches, by pulse onset; periods off the unperturbed one [ms]:",
    ]
    for piece in outcome["branches"]:
        ends = [
            f"{_offset(end['period'], unperturbed)} ({end['border'].value})"
            for end in (piece["first"], piece["last"])
        ]
        kind = "stable  " if piece["stable"] else "unstable" if piece["feasible"] else "no gait "
        lines.append(f"  {kind} {piece['place'].value}: {ends[0]} to {ends[1]}")
    lines += ["", f"Locked gaits at {offset:+.3f} ms:"]
    for lock in outcome["locked_gaits"]:
        first, second = (complex(*m) for m in lock["multipliers"])
        share = lock["share_of_initial_phases"]
        lines.append(
            f"  {'stable  ' if lock['stable'] else 'unstable'} lag {lock['lag'] * 1e3:+.6f} ms,"
            f" phase {lock['phase']:.6f}, speed {lock['speed']:.6f} m/s, multipliers"
            f" {first:.4f} {second:.4f}"
            + (f", draws {share:.1%} of the initial phases" if share is not None else "")
        )
    if not outcome["locked_gaits"]:
        lines.append("  none")
    walked = ", ".join(f"{count} {name}" for name, count in outcome["walked"].items())
    return "\n".join([*lines, "", f"Walked from evenly spread initial phases: {walked}"])


def _offset(period: float | None, unperturbed: float) -> str:
    return "-" if period is None else f"{(period - unperturbed) * 1e3:+.6f}"
