# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The report of a run, read from the bag: the outcome, how well time was kept, the figures."""

import json
from pathlib import Path

from gait_entrainment_bags import BagReader
from gait_entrainment_bags.figures import draw_figures
from gait_entrainment_bags.recorded_run import (
    messages_line,
    read_run,
    recorded_outcome,
    walker_timing,
)
from gait_entrainment_bags.truth import detection_lines
from gait_entrainment_commands.outcome import summary, timing_summary


def report(bag: Path, *, figures: bool, as_json: bool) -> None:
    """Print the outcome of a recorded run, as lines or as one JSON object; draw its figures."""
    recorded = read_run(bag, torques=figures)
    with BagReader(bag) as reader:
        outcome = recorded_outcome(recorded, bag) | walker_timing(reader)
    drawn = draw_figures(recorded, bag) if figures else []
    if as_json:
        print(json.dumps(outcome))
        return
    timing = timing_summary(outcome["pulse_timing"])
    for line in (summary(outcome), *detection_lines(outcome), *timing):
        print(line)
    if (factor := outcome["real_time_factor"]) is not None:
        print(f"speed            {factor:.0f} times real time")
    if late := outcome.get("publish_lateness_ms"):
        print(
            f"real time        samples published {late['p50']:.2f} ms after they were due"
            f" (median), {late['p99']:.2f} ms (99 %), {late['worst']:.2f} ms (worst)"
        )
    promises = outcome.get("promises", {})
    if promises.get("late_stretches") or promises.get("starved_stretches"):
        print(
            f"promises         of perturbator: {promises['late_stretches']:.0f} late by"
            f" {promises['late_ms']:.1f} ms in all, {promises['starved_stretches']:.0f} stretches"
            f" of {promises['starved_ms']:.1f} ms walked without torque: not reproducible"
        )
    print(messages_line(recorded))
    print(f"bag              {bag}")
    for figure in drawn:
        print(f"figure           {figure}")
