# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""entrain plan: how many pulses give which chance of a right verdict."""

import argparse
import json
from dataclasses import asdict
from typing import Any

from gait_entrainment.settings import Setting
from gait_entrainment_commands import cli
from gait_entrainment_sessions.power import COUNTS, PowerPlan, enough_of, power
from gait_entrainment_sessions.statistics import Estimate

DESCRIPTION = (
    "Say, for a variation of the stride and a pulse period, after how many pulses the verdict is "
    "right with which chance: by walks that lock or ignore the pulses, judged as real ones."
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
        rows: list[Any] = [asdict(one) for one in found]
        plain = {"plan": asdict(plan), "period_offset": offset, "chances": rows, "enough": enough}
        print(json.dumps(plain))
        return 0
    print(
        "| pulses | one that locks is called entrained | one that ignores them drifting |"
        " one that ignores them entrained |\n| --- | --- | --- | --- |"
    )
    for one in found:
        cells = " | ".join(_shown(e) for e in (one.entrained, one.drifting, one.wrongly))
        print(f"| {one.pulses} | {cells} |")
    told = f"from {enough} pulses on" if enough else "with none of these numbers"
    print(f"\nboth right with a chance of {100 * _ENOUGH:.0f} %: {told}")
    print(
        f"95 % intervals, {plan.trials} walks of each kind. Assumed: one that locks makes good"
        f" {100 * plan.gain:g} % of its distance in a stride, at most {100 * plan.limit:g} % of it"
    )
    return 0


def _shown(one: Estimate) -> str:
    return f"{100 * one.value:.0f} % ({100 * one.low:.0f} to {100 * one.high:.0f})"
