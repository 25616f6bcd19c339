# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The messages of emulated sensors."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from gait_entrainment.conventions import Side
from gait_entrainment_nodes.messaging.raw_messages import MessageTemplate, message_class
from gait_entrainment_sensors.sources import ENCODER, FOOT, SHANK, SWITCH, Source


class SensorWriter:
    """Makes the messages of an emulated sensor, as bytes and many at a time."""

    def __init__(self, source: Source, side: Side, signals: Sequence[str]) -> None:
        frame = {"left": "l", "right": "r"}[side.name.lower()] + (
            "_leg" if source is SHANK else "_sole"
        )
        self._switch = source is SWITCH

        def message(**values: Any) -> Any:
            made = message_class(source.type)(**values)
            made.header.frame_id = frame
            return made

        if source is SWITCH:
            self._templates = {
                (heel, toe): MessageTemplate(message(heel=heel, toe=toe), {})
                for heel in (False, True)
                for toe in (False, True)
            }
        else:
            joint = {"name": [frame[0] + "_ankle"]} if source is ENCODER else {}
            made = message(**joint)
            if source in (FOOT, SHANK):  # REP 145: not measured
                made.orientation_covariance[0] = made.linear_acceleration_covariance[0] = -1.0
            fields = {source.fields[signal]: 1 for signal in signals}
            self._template = MessageTemplate(made, fields)

    def write(self, samples: Sequence[tuple[int, tuple[float, ...]]]) -> list[bytes]:
        """Return one serialized message for each (stamp [ns], values)."""
        if not samples:
            return []
        if self._switch:
            return [
                self._templates[bool(values[0]), bool(values[1])].fill(np.array([stamp]))[0]
                for stamp, values in samples
            ]
        stamps = np.array([stamp for stamp, _ in samples], np.int64)
        columns = np.array([values for _, values in samples], float).T[..., None]
        return self._template.fill(stamps, *columns)
