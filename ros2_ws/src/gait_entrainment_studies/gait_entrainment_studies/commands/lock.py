# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain lock: all phase-locked gaits under one kind of pulse, solved."""

import argparse
import math
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gait_entrainment.settings import Setting
from gait_entrainment_commands import cli
from gait_entrainment_studies.commands import question
from gait_entrainment_studies.locking.branches import locked_gaits, pieces_of
from gait_entrainment_studies.locking.figures import draw_branches
from gait_entrainment_studies.locking.walked import shares_of

DESCRIPTION = (
    "Solve for the 1:1 phase-locked gaits: the borders of the pulse periods with a stable lock, "
    "with the kind of each, and the locked gaits at one period, with their Floquet multipliers "
    "and the share of initial phases that each draws."
)
EXAMPLES = """examples:
  entrain lock                                  the paper's pulses at 2 tau_0 - 50 ms
  entrain lock --period-offset -0.067           two attractors coexist
  entrain lock --torque-fraction -0.1 --period-offset 0.02 --out figures
"""

_PHASES = Setting("number of initial phases", int, least=1, most=10_000)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    cli.add_setting(parser, "period_offset", question.PERIOD_OFFSET, "-0.05")
    cli.add_setting(parser, "phases", _PHASES, "32")
    question.add_gait_options(parser)
    cli.add_output_options(parser, "draw the branches into a folder")


def run(options: argparse.Namespace) -> int:
    """Solve, walk, print."""
    gait = question.chosen_gait(options)
    period = gait.unperturbed_period + question.chosen_offset(options.period_offset, gait)
    phases = _PHASES.parse("phases", options.phases)
    pieces = pieces_of(gait)
    locks = locked_gaits(gait, period, pieces)
    outcomes, drawn = shares_of(gait, period, locks, phases)
    outcome = {
        "unperturbed_stride_period": gait.unperturbed_period,
        "pulse_period": period,
        "torque": gait.torque,
        "width": gait.width,
        "branches": [asdict(piece) for piece in pieces],
        "locked_gaits": [
            {
                **asdict(lock),
                "multipliers": [[m.real, m.imag] for m in lock.multipliers],
                "share_of_initial_phases": drawn.get(lock),
            }
            for lock in locks
        ],
        "walked": {kind.value: count for kind, count in Counter(outcomes).items()},
    }

    def draw(folder: Path) -> list[Path]:
        return draw_branches(gait, pieces, locks, folder)

    return cli.answer(options, outcome, _summary(outcome), draw)


def _summary(outcome: dict[str, Any]) -> str:
    unperturbed = outcome["unperturbed_stride_period"]
    offset = (outcome["pulse_period"] - unperturbed) * 1e3
    lines = [
        f"pulses           {outcome['torque']:.3f} N m for {outcome['width']:g} s",
        f"stride period    {unperturbed:.9f} s unperturbed",
        "",
        "Branches, by pulse onset; periods minus the unperturbed one [ms]:",
    ]
    for piece in outcome["branches"]:
        first, last = (
            ("-" if math.isnan(end["period"]) else f"{(end['period'] - unperturbed) * 1e3:+.6f}")
            + f" ({end['border'].value})"
            for end in (piece["first"], piece["last"])
        )
        kind = "stable  " if piece["stable"] else "unstable" if piece["feasible"] else "no gait "
        lines.append(f"  {kind} {piece['place'].value}: {first} to {last}")
    lines += ["", f"Locked gaits at {offset:+.3f} ms:"]
    for lock in outcome["locked_gaits"]:
        multipliers = " ".join(f"{complex(*m):.4f}" for m in lock["multipliers"])
        share = lock["share_of_initial_phases"]
        lines.append(
            f"  {'stable  ' if lock['stable'] else 'unstable'} lag {lock['lag'] * 1e3:+.6f} ms,"
            f" phase {lock['phase']:.6f}, speed {lock['speed']:.6f} m/s, multipliers {multipliers}"
            + ("" if share is None else f", draws {share:.1%} of the initial phases")
        )
    if not outcome["locked_gaits"]:
        lines.append("  none")
    walked = ", ".join(f"{count} {name}" for name, count in outcome["walked"].items())
    return "\n".join([*lines, "", f"Walked from evenly spread initial phases: {walked}"])
