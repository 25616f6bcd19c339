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

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gait_entrainment.conventions import stamp_nanoseconds
from gait_entrainment.device import MeasuredOnsets, PulseTiming, RobotState
from gait_entrainment.device.timing import distribution

_PROFILES, _PULSES = "perturbation/torque_profile", "perturbation/pulses"
_STATES = "perturbator/state"


def recorded_timings(path: Path | str) -> list[PulseTiming]:
    """
    Return the timing of every pulse that was promised and not withdrawn by a stop.

    What the states do not show, or are not in the bag to show, stays unknown.

    Raises
    ------
    BagError
        where it is no bag, is damaged, or its messages lack a field.

    """
    # Imported here: a simulation has no bag, and does without the readers.
    from gait_entrainment.bags import BagReader

    onsets = MeasuredOnsets()
    with BagReader(path) as bag:
        for suffix in (_PROFILES, _PULSES, _STATES):
            names = [name for name in bag.topics if name.endswith(f"/{suffix}")]
            # In the order of reception: a stop voids only what was promised before it.
            found = sorted(bag.messages(names), key=lambda m: m.place) if names else []
            for raw in found:
                with fields_expected(raw.topic):
                    _add(onsets, suffix, bag.decoder(raw.topic)(raw.data))
    onsets.finish()
    return onsets.timings


def _add(onsets: MeasuredOnsets, suffix: str, message: Any) -> None:
    instant = stamp_nanoseconds(message.header.stamp)
    if suffix == _PULSES:
        onsets.add_pulse(instant, message.torque, message.duration)
    elif suffix == _STATES:
        torques = message.commanded_torque, message.measured_torque
        onsets.add_state(RobotState(instant, *torques, message.angle))
    elif message.stop:
        onsets.stop(instant)
    else:
        named = [stamp_nanoseconds(onset) for onset in message.onsets]
        onsets.add_promise(named, stamp_nanoseconds(message.valid_until))


@contextmanager
def fields_expected(topic: str) -> Iterator[None]:
    """Raise BagError where a message lacks a field: the bag may define it otherwise."""
    from gait_entrainment.bags import BagError

    try:
        yield
    except AttributeError as error:
        raise BagError(
            f"{topic}: its messages have no field {error.name}: recorded by another version"
        ) from None


def timing_outcome(timings: Sequence[PulseTiming], stride: float) -> dict[str, Any]:
    """Return what ``--json`` prints of the pulses' timing; percentages are of a stride [s]."""
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
        percent = figures["worst_percent"]
        share = "" if percent is None else f": {percent:.2f} % of a stride"
        lines.append(
            f"pulses {kind:<10}{figures['median_ms']:.1f} ms after their command (median), "
            f"{figures['p99_ms']:.1f} (99 %), {figures['worst_ms']:.1f} (worst{share}){missing}"
        )
    return lines


def _late(commanded: int, onset: int | None) -> float | None:
    return None if onset is None else (onset - commanded) / 1e6
