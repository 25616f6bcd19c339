# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain plan: the chance of a correct verdict by number of pulses."""

import argparse
import json
from dataclasses import asdict
from typing import Any

from gait_entrainment.settings import Setting
from gait_entrainment_commands import cli
from gait_entrainment_sessions.power import COUNTS, PowerPlan, enough_of, power
from gait_entrainment_sessions.statistics import Estimate

DESCRIPTION = (
    "Estimate the chance of a correct verdict after each number of pulses, for a variation of the "
    "stride and a pulse period, from walks that lock or ignore the pulses, judged as real ones."
)
EXAMPLES = """examples:
  entrain plan                                     2 % variation, pulses 50 ms faster
  entrain plan --variation 0.03 --period-offset -0.03 --stride 1.05
  entrain plan --pulses 30 60 120
"""
_OFFSET = Setting("pulse period minus stride period", unit="s")
_PULSES = Setting("numbers of pulses", int, least=5, most=1000)
_ENOUGH = 0.8


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    cli.add_settings(parser, PowerPlan)
    cli.add_setting(parser, "period_offset", _OFFSET, "-0.05")
    default = " ".join(map(str, COUNTS))
    cli.add_setting(parser, "pulses", _PULSES, shown=default, nargs="+")
    cli.add_json_option(parser)


def run(options: argparse.Namespace) -> int:
    """Draw, judge, print."""
    plan = cli.chosen(options, PowerPlan)
    offset = _OFFSET.parse("period_offset", options.period_offset)
    counts = [_PULSES.parse("pulses", text) for text in options.pulses or map(str, COUNTS)]
    found = power(plan, offset, counts)
    enough = enough_of(found, _ENOUGH)
    if options.json:
        rows: list[Any] = [asdict(chances) for chances in found]
        plain = {"plan": asdict(plan), "period_offset": offset, "chances": rows, "enough": enough}
        print(json.dumps(plain))
        return 0
    print(
        "| pulses | locks, judged entrained | ignores them, judged drifting |"
        " ignores them, judged entrained |\n| --- | --- | --- | --- |"
    )
    for row in found:
        cells = " | ".join(_shown(e) for e in (row.entrained, row.drifting, row.wrongly))
        print(f"| {row.pulses} | {cells} |")
    answer = f"from {enough} pulses on" if enough else "with none of these numbers"
    print(f"\nboth right with a chance of {100 * _ENOUGH:.0f} %: {answer}")
    print(
        f"95 % intervals, {plan.trials} walks of each kind. Assumed: a walker that locks corrects"
        f" {100 * plan.gain:g} % of its distance in each stride, at most {100 * plan.limit:g} % of"
        " the stride"
    )
    return 0


def _shown(chance: Estimate) -> str:
    return f"{100 * chance.value:.0f} % ({100 * chance.low:.0f} to {100 * chance.high:.0f})"
