# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""When the pulses of a run really came: distribution for outcome and summary, and from a bag."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment.device import PulseTiming, RobotState, TimingAudit
from gait_entrainment.device.timing import distribution

_STATES, _PULSES = "perturbator/state", "perturbation/pulses"


def recorded_timings(path: Path | str) -> list[PulseTiming]:
    """
    Return the timing of every pulse that a bag announces, from the states of the robot.

    Raises
    ------
    BagError
        where it is no bag, or is damaged.

    """
    # Imported here: a simulation has no bag, and does without the readers.
    from gait_entrainment.bags import BagReader

    audit = TimingAudit()
    states: list[RobotState] = []
    with BagReader(path) as bag:
        names = [name for name in bag.topics if name.endswith((f"/{_STATES}", f"/{_PULSES}"))]
        for raw, message in bag.decoded(names) if names else ():
            stamp = message.header.stamp
            instant = int(stamp.sec) * NANOSECONDS_PER_SECOND + int(stamp.nanosec)
            if raw.topic.endswith(_PULSES):
                audit.add_pulse(instant, message.torque, message.duration)
            else:
                states.append(
                    RobotState(
                        instant, message.commanded_torque, message.measured_torque, message.angle
                    )
                )
    states.sort(key=lambda state: state.stamp)
    return [*audit.add_states(states), *audit.finish()]


def timing_outcome(timings: Sequence[PulseTiming], stride: float) -> dict[str, Any]:
    """
    Return what ``--json`` prints of the pulses' timing.

    Parameters
    ----------
    timings
        Of the pulses.
    stride
        Unperturbed stride period [s]: percentages are of it.

    """
    return {
        "sent": distribution(timings, "sent", stride),
        "measured": distribution(timings, "measured", stride),
        "each_ms": [
            {"sent": _late(t.commanded, t.sent), "measured": _late(t.commanded, t.measured)}
            for t in timings
        ],
    }


def timing_summary(outcome: dict[str, Any]) -> list[str]:
    """Return lines for people; none where every pulse came at its instant."""
    lines = []
    for kind in ("sent", "measured"):
        figures = outcome[kind]
        if figures is None or not (figures["worst_ms"] or figures["missing"]):
            continue
        missing = f", {figures['missing']} never seen" if figures["missing"] else ""
        lines.append(
            f"pulses {kind:<10}{figures['median_ms']:.1f} ms after their command (median), "
            f"{figures['p99_ms']:.1f} (99 %), {figures['worst_ms']:.1f} (worst: "
            f"{figures['worst_percent']:.2f} % of a stride){missing}"
        )
    return lines


def _late(commanded: int, onset: int | None) -> float | None:
    return None if onset is None else (onset - commanded) / 1e6
