# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""How well the walker of a recorded run kept time, as it reported."""

from gait_entrainment_bags.reader import BagReader
from gait_entrainment_bags.topic_names import WALKER_TIMING


def walker_timing(reader: BagReader) -> dict[str, dict[str, float]]:
    """Return what the outcome says about it, by the walker's last report; {} without one."""
    told = list(reader.messages_of(WALKER_TIMING))[-1:]
    timing = {}
    for walker in told:
        if walker.samples:
            timing["publish_lateness_ms"] = {
                name: 1e3 * getattr(walker, f"publish_late_{name}")
                for name in ("p50", "p99", "worst")
            }
        timing["promises"] = {
            "late_stretches": walker.late_stretches,
            "late_ms": 1e3 * walker.late,
            "starved_stretches": walker.starved_stretches,
            "starved_ms": 1e3 * walker.starved,
        }
    return timing
