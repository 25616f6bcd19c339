# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Emulated sensors by name, as detectors and drivers are named: KIND or KIND:OPTION=VALUE,..."""

from dataclasses import replace

from gait_entrainment.errors import UsageError
from gait_entrainment.robot.drivers import read_options, split_options
from gait_entrainment_sensors.emulated import KINDS, EmulatedSettings

# Sensors by the detector that reads them, where the two have different names.
USUAL = {"vertical_force": "treadmill_force"}


def find_sensor(text: str) -> tuple[str, EmulatedSettings]:
    """
    Return kind and settings of the emulated sensor that a text names.

    Raises UsageError if there is no such kind, LimitError for a wrong option.
    """
    kind, _, options = text.partition(":")
    if kind not in KINDS:
        raise UsageError(f"sensor: {kind!r} is unknown; allowed: {', '.join(KINDS)}")
    read = read_options(f"sensor: {kind}", EmulatedSettings, options)
    given = {part.partition("=")[0] for part in split_options(options)}
    return kind, replace(KINDS[kind][1], **{name: getattr(read, name) for name in given})
