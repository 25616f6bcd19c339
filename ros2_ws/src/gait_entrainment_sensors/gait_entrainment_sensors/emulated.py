# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What sensors on the simulated walker would measure: a pure function of its trajectory and a seed.

Each sample follows from the walker at one instant, from the events before it, and from random
numbers that are drawn sample by sample: the same however a walk is cut into stretches, so that
lock-step and offline agree.

What is modelled beyond the walker's own motion, because the model leaves it out:

- Its foot slaps down in no time, and meets the ground flat. A person's comes down on the heel with
  the toes up and turns flat within a tenth of a second. So a gyroscope on the foot also measures
  ``slap_angle`` turned in ``slap_time`` after each strike, and as much more in the swing.
- Its swing leg has no dynamics; the foot goes on turning down long after toe-off. A person's is
  pulled up at once. So the rate at toe-off fades with ``release_time``.

What is not modelled: the knee does not bend, so the shank turns like the whole leg, about half as
fast in swing as a person's, without the negative peaks at strike and toe-off by which a gyroscope on
the shank tells these events; soft tissue; shocks at impact; cross-talk of axes; forces on the other
foot's belt; the centre of pressure.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind, Side
from gait_entrainment.gait import GaitEvent
from gait_entrainment.settings import check_settings, setting
from gait_entrainment.walker import Samples

Floats = NDArray[np.float64]
Stamps = NDArray[np.int64]

HIP, ANKLE = 0, 2  # places in an array of joints, plus the side


@dataclass(frozen=True)
class EmulatedSettings:
    """How good a sensor is; noise, bias, drift, resolution and range in the unit of its signal."""

    rate: float = setting(200.0, "samples per second", "Hz", (10.0, 5000.0))
    noise: float = setting(0.0, "white noise, standard deviation", "unit", (0.0, 1e4))
    bias: float = setting(0.0, "constant offset, standard deviation", "unit", (0.0, 1e4))
    drift: float = setting(0.0, "steady change of the offset", "unit/s", (-1e3, 1e3))
    resolution: float = setting(0.0, "smallest step; 0: none", "unit", (0.0, 1e3))
    full_scale: float = setting(1e6, "largest magnitude", "unit", (1e-3, 1e6))
    jitter: float = setting(
        0.0, "of sampling, unknown to the stamp, standard deviation", "s", (0.0, 0.1)
    )
    dropouts: float = setting(0.0, "dropouts per minute", "1/min", (0.0, 600.0))
    dropout_time: float = setting(0.3, "length of a dropout", "s", (1e-3, 60.0))
    clock_offset: float = setting(0.0, "of the sensor's clock", "s", (-10.0, 10.0))
    clock_drift: float = setting(0.0, "of the sensor's clock", "1", (-1e-2, 1e-2))
    slap_angle: float = setting(0.25, "turned down after a strike", "rad", (0.0, 1.0))
    slap_time: float = setting(0.1, "from heel strike to foot flat", "s", (1e-3, 0.5))
    release_time: float = setting(0.015, "time constant of the foot after toe-off", "s", (0, 0.1))
    bounce: float = setting(0.004, "time for which a switch bounces", "s", (0.0, 0.1))

    def __post_init__(self) -> None:
        """Check every field."""
        check_settings(self)


# Kinds of sensors: the detector's signals, and what is usual. Force: an instrumented treadmill
# (noise as measured on one, docs/sensors.md) and an insole; MEMS gyroscopes of 2000 deg/s.
_GYROSCOPE = EmulatedSettings(
    noise=0.02, bias=0.03, drift=1e-5, resolution=1.07e-3, full_scale=34.9
)
KINDS: dict[str, tuple[tuple[str, ...], EmulatedSettings]] = {
    "treadmill_force": (
        ("force_z",),
        EmulatedSettings(
            rate=1000.0, noise=7.0, bias=3.0, drift=5e-3, resolution=0.5, full_scale=5e3
        ),
    ),
    "insole_force": (
        ("force_z",),
        EmulatedSettings(rate=100.0, noise=5.0, bias=5.0, resolution=2.0, full_scale=2e3),
    ),
    "foot_switch": (("heel", "toe"), EmulatedSettings()),
    "foot_gyroscope": (("gyro_x", "gyro_y", "gyro_z"), _GYROSCOPE),
    "shank_gyroscope": (("gyro_x", "gyro_y", "gyro_z"), _GYROSCOPE),
    "ankle_encoder": (("angle",), EmulatedSettings(noise=1e-3, resolution=1.5e-3, full_scale=7.0)),
}


class EmulatedSensor:
    """
    One sensor on one foot of the simulated walker.

    Ask `due` for the instants [ns] at which it samples next, sample the walker there, and give
    the samples to `measure` with the events of the stretch. Raises KeyError for an unknown kind.
    """

    def __init__(
        self, kind: str, side: Side, settings: EmulatedSettings | None = None, seed: int = 0
    ) -> None:
        self.kind, self.side = kind, side
        self.signals, usual = KINDS[kind]
        self.settings = settings or usual

    def due(self, until: int) -> Stamps:
        """Return the instants of the samples up to and including ``until`` [ns], each once."""
        raise NotImplementedError

    def measure(
        self, times: Stamps, samples: Samples, events: Iterable[GaitEvent]
    ) -> list[tuple[float, tuple[float, ...]]]:
        """
        Return what the sensor says: stamp by its own clock [s], and the values of `signals`.

        ``times`` are what `due` returned; ``events`` those of the stretch, of both feet.
        """
        raise NotImplementedError
