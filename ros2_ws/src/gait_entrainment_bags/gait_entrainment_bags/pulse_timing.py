# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""When the pulses of a recorded run really came."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gait_entrainment.conventions import stamp_nanoseconds
from gait_entrainment.robot import MeasuredOnsets, PulseTiming, RobotState

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
    from gait_entrainment_bags import BagReader

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
    from gait_entrainment_bags import BagError

    try:
        yield
    except AttributeError as error:
        raise BagError(
            f"{topic}: its messages have no field {error.name}: recorded by another version"
        ) from None
