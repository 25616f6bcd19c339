# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What sensors on the simulated walker would measure: a pure function of its trajectory and a seed.

Each sample depends on the walker at one time, on the events before it, and on random numbers
drawn sample by sample. It is the same however a walk is cut into stretches, so lock-step and
offline agree.

Effects that the walker model leaves out, and that are added here:

- The model's foot slaps down instantly and meets the ground flat. A person's lands on the heel
  with the toes up and turns flat within a tenth of a second. So a gyroscope on the foot also
  measures a rotation by ``slap_angle`` in ``slap_time`` after each strike; the matching upward
  rotation in swing is left out. A switch under the toes closes after ``slap_time``.
- The model's swing leg has no dynamics: the foot keeps turning down for a seventh of a second
  after toe-off. A person's is pulled up immediately. So that rate decays with ``release_time``.
- The model's knee does not bend. A person's bends from 5 to 40 degrees in push-off, ever faster,
  and by 20 more after toe-off (Perry and Burnfield, Gait Analysis, 2010). Thigh and shank are
  about equally long, so each turns by half of that. So a gyroscope on the shank also measures a
  rotation by half of ``knee_angle`` in the ``push_off_time`` after the other foot's strike, which
  decays with ``knee_time`` after toe-off; the matching rotation back in swing is left out.

Not modelled: the knee in the rest of the stride, so the shank swings about half as fast as a
person's, without the peak at strike; soft tissue; impact shocks; cross-talk between axes; forces
on the other foot's belt; the centre of pressure.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind, Side
from gait_entrainment.errors import UsageError
from gait_entrainment.gait import GaitEvent
from gait_entrainment.robot.drivers import read_options, split_options
from gait_entrainment.settings import Checked, setting
from gait_entrainment.walker import Samples

Floats = NDArray[np.float64]
Stamps = NDArray[np.int64]

HIP, ANKLE = 0, 2  # indices into joint arrays, plus the side
_BLOCK: Final = 1024  # sample times drawn at a time
_NEVER: Final = -(10**15)  # [ns]


@dataclass(frozen=True)
class EmulatedSettings(Checked):
    """Quality of a sensor; noise, bias, drift, resolution and range in the unit of its signal."""

    rate: float = setting(200.0, "samples per second", "Hz", (10.0, 5000.0))
    noise: float = setting(0.0, "white noise, standard deviation", "unit", (0.0, 1e4))
    bias: float = setting(0.0, "constant offset, standard deviation", "unit", (0.0, 1e4))
    drift: float = setting(0.0, "steady change of the offset", "unit/s", (-1e3, 1e3))
    resolution: float = setting(0.0, "smallest step; 0: none", "unit", (0.0, 1e3))
    full_scale: float = setting(1e6, "largest magnitude", "unit", (1e-3, 1e6))
    jitter: float = setting(
        0.0, "sampling jitter not in the stamps, standard deviation", "s", (0.0, 0.1)
    )
    dropouts: float = setting(0.0, "dropouts per minute", "1/min", (0.0, 600.0))
    dropout_time: float = setting(0.3, "length of a dropout", "s", (1e-3, 60.0))
    clock_offset: float = setting(0.0, "offset of the sensor's clock", "s", (-10.0, 10.0))
    clock_drift: float = setting(0.0, "drift of the sensor's clock", "1", (-1e-2, 1e-2))
    slap_angle: float = setting(0.25, "downward rotation after a strike", "rad", (0.0, 1.0))
    slap_time: float = setting(0.1, "from heel strike to foot flat", "s", (1e-3, 0.5))
    release_time: float = setting(0.015, "time constant of the foot after toe-off", "s", (0, 0.1))
    knee_angle: float = setting(0.6, "knee flexion in push-off", "rad", (0.0, 1.5))
    push_off_time: float = setting(0.35, "usual duration of double stance", "s", (0.05, 1.0))
    knee_time: float = setting(0.1, "time constant of the knee after toe-off", "s", (1e-3, 0.5))
    bounce: float = setting(0.004, "time for which a switch bounces", "s", (0.0, 0.1))


# Kinds of sensors: the detector's signals, and usual settings. Force: an instrumented treadmill
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
    "ankle_encoder": (
        ("angle", "torque"),
        EmulatedSettings(noise=1e-3, resolution=1.5e-3, full_scale=7.0),
    ),
}


# The emulated sensor of a detector, if their names differ.
USUAL = {"vertical_force": "treadmill_force"}


def find_sensor(text: str) -> tuple[str, EmulatedSettings]:
    """
    Return kind and settings of the emulated sensor named by a text, KIND:OPTION=VALUE,...

    Raises UsageError if the kind is unknown, LimitError for an invalid option.
    """
    kind, _, options = text.partition(":")
    if kind not in KINDS:
        raise UsageError(f"sensor: {kind!r} is unknown; allowed: {', '.join(KINDS)}")
    read = read_options(f"sensor: {kind}", EmulatedSettings, options)
    given = {part.partition("=")[0] for part in split_options(options)}
    return kind, replace(KINDS[kind][1], **{name: getattr(read, name) for name in given})


class EmulatedSensor:
    """
    One sensor on one foot of the simulated walker.

    `due` returns the times [ns] of the next samples: sample the walker there, and pass the samples
    to `measure` with the events of the stretch. Raises KeyError for an unknown kind.
    """

    def __init__(
        self, kind: str, side: Side, settings: EmulatedSettings | None = None, seed: int = 0
    ) -> None:
        self.kind, self.side = kind, side
        self.signals, usual = KINDS[kind]
        self.settings = settings or usual
        seeds = np.random.SeedSequence([seed, int(side), [*KINDS].index(kind)]).spawn(4)
        # One generator per purpose, so that the draws do not depend on the cuts.
        self._jitters, self._noises, self._gaps, self._bounces = map(np.random.default_rng, seeds)
        self._bias = self.settings.bias * self._noises.standard_normal(len(self.signals))
        self._next = 0  # number of the first sample that `due` has not returned
        self._taken = 0  # number of the first sample that `measure` has not seen
        self._instants: Stamps = np.empty(0, np.int64)  # drawn, from number `_next` on
        self._gap_from = -math.inf  # start of the latest dropout [s]
        self._strikes: list[int] = [_NEVER]  # of this foot [ns]
        self._toe_offs: list[int] = [_NEVER]
        self._pushes: list[int] = [_NEVER]  # strikes of the other foot, when this one pushes off

    def due(self, until: int) -> Stamps:
        """Return the times of the samples up to and including ``until`` [ns], each only once."""
        interval = NANOSECONDS_PER_SECOND / self.settings.rate
        while self._instants.size == 0 or self._instants[-1] <= until:
            numbers = self._next + self._instants.size + np.arange(_BLOCK)
            jitter = self._jitters.standard_normal(_BLOCK) * self.settings.jitter
            jitter = np.clip(jitter * self.settings.rate, -0.45, 0.45)
            drawn = np.maximum(np.rint((numbers + jitter) * interval), 0).astype(np.int64)
            self._instants = np.concatenate([self._instants, drawn])
        count = int(np.searchsorted(self._instants, until, "right"))
        due, self._instants = np.split(self._instants, [count])
        self._next += count
        return due

    def measure(
        self, times: Stamps, samples: Samples, events: Iterable[GaitEvent]
    ) -> list[tuple[float, tuple[float, ...]]]:
        """
        Return the sensor's output: the stamp on its own clock [s], and the values of `signals`.

        ``times`` come from `due`; ``events`` are those of both feet in the stretch.
        """
        for event in events:
            struck = event.kind is EventKind.HEEL_STRIKE
            if event.side is self.side:
                (self._strikes if struck else self._toe_offs).append(event.stamp)
            elif struck:
                self._pushes.append(event.stamp)
        settings, n = self.settings, times.size
        stamps = (self._taken + np.arange(n)) / settings.rate
        self._taken += n
        values = _SIGNALS[self.kind](self, times, samples)
        noise = settings.noise * self._noises.standard_normal(values.shape)
        if self.kind == "ankle_encoder":
            noise[:, 1] = 0.0  # the robot itself reports its torque
        elif self.kind != "foot_switch":
            noise += self._bias + settings.drift * stamps[:, np.newaxis]
        values = values + noise
        if settings.resolution > 0.0:
            values = np.rint(values / settings.resolution) * settings.resolution
        values = np.clip(values, -settings.full_scale, settings.full_scale)
        clock = stamps * (1.0 + settings.clock_drift) + settings.clock_offset
        kept = [self._there(stamp) for stamp in stamps.tolist()]
        rows = zip(clock.tolist(), map(tuple, values.tolist()), kept, strict=True)
        return [(stamp, row) for stamp, row, there in rows if there]

    def _there(self, stamp: float) -> bool:
        """Whether a sample is not lost in a dropout."""
        settings = self.settings
        if settings.dropouts == 0.0:
            return True
        if self._gap_from == -math.inf:
            self._gap_from = self._gaps.exponential(60.0 / settings.dropouts)
        while stamp >= self._gap_from + settings.dropout_time:
            self._gap_from += settings.dropout_time
            self._gap_from += self._gaps.exponential(60.0 / settings.dropouts)
        return stamp < self._gap_from

    def _since(self, stamps: list[int], times: Stamps) -> Floats:
        """Return the time [s] since the latest of some events."""
        latest = np.array(stamps)[np.searchsorted(stamps, times, "right") - 1]
        return np.asarray((times - latest) / NANOSECONDS_PER_SECOND)

    def _force(self, times: Stamps, samples: Samples) -> Floats:  # noqa: ARG002
        vertical: Floats = samples.ground_reaction[:, self.side, 1:]
        return vertical

    def _switches(self, times: Stamps, samples: Samples) -> Floats:
        leading = samples.leading == self.side
        struck = self._since(self._strikes, times)
        left = self._since(self._toe_offs, times)
        toe = np.where(leading, struck >= self.settings.slap_time, samples.double_stance)
        closed = np.stack([leading, toe], axis=1).astype(float)
        bounces = np.stack([struck, left], axis=1) < self.settings.bounce
        return np.where(bounces, self._bounces.random(closed.shape) < 0.5, closed)

    def _rates(self, times: Stamps, samples: Samples) -> Floats:
        """Axes x forward, y to the left, z up: toes down and leaning forward are +y."""
        settings = self.settings
        rate = -samples.velocity[:, HIP + self.side]
        trailing = samples.leading != self.side
        swings = trailing & ~samples.double_stance
        since = np.where(swings, self._since(self._toe_offs, times), 0.0)
        if self.kind == "shank_gyroscope":
            pushed = self._since(self._pushes, times) - since
            lean = settings.knee_angle * pushed / settings.push_off_time**2
            rate = rate + np.where(trailing, lean * np.exp(-since / settings.knee_time), 0.0)
        else:
            rate = rate + samples.velocity[:, ANKLE + self.side]
            fading = np.exp(-since / max(settings.release_time, 1e-9))
            rate = np.where(rate > 0.0, rate * fading, rate)
            phase = self._since(self._strikes, times) / settings.slap_time
            slap = settings.slap_angle * math.pi / (2 * settings.slap_time)
            rate = rate + np.where(phase < 1.0, slap * np.sin(math.pi * phase), 0.0)
        none = np.zeros_like(rate)
        return np.stack([none, rate, none], axis=1)

    def _ankle(self, times: Stamps, samples: Samples) -> Floats:  # noqa: ARG002
        angle, torque = samples.position[:, ANKLE + self.side], samples.delivered_torque
        return np.stack([angle, torque[:, self.side]], axis=1)


_SIGNALS: dict[str, Callable[[EmulatedSensor, Stamps, Samples], Floats]] = {
    "treadmill_force": EmulatedSensor._force,
    "insole_force": EmulatedSensor._force,
    "foot_switch": EmulatedSensor._switches,
    "foot_gyroscope": EmulatedSensor._rates,
    "shank_gyroscope": EmulatedSensor._rates,
    "ankle_encoder": EmulatedSensor._ankle,
}
