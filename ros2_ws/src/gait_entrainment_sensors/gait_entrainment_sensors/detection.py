# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What a detector owes: samples of one sensor on one foot in, heel strikes and toe-offs out.

A text names a detector as one names a driver: NAME, or NAME:OPTION=VALUE,OPTION=VALUE. Detectors
of other packages are found under the entry point ``gait_entrainment.detectors``.
"""

import math
import statistics
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from importlib.metadata import EntryPoint, entry_points
from typing import Any, ClassVar

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.errors import EntrainmentError, UsageError
from gait_entrainment.robot.drivers import read_options
from gait_entrainment.settings import Checked, SettingError, setting

ENTRY_POINTS = "gait_entrainment.detectors"
# A walk of this length has shown what the signal reaches [s].
_LONG_ENOUGH = 10.0
# A signal that moves and reads the same for so long has met the end of its range [s].
_HELD = 0.05
# Samples in a row that cannot be, of which four good ones make up for one, after which the unit is
# doubted, and with it every event: a glitch is shorter, and in degrees a third of the samples are.
_DOUBTED = 20
# Of the person's own stances, swings, peaks: so many make the median.
_OWN_STEPS = 7


@dataclass(frozen=True, slots=True)
class Detection:
    """A heel strike or a toe-off that a detector found; seconds since the start of the run."""

    kind: EventKind
    side: Side
    time: float  # estimated instant of the event
    detected_at: float  # time of the sample that decided it
    uncertainty: float  # standard deviation of ``time`` [s]


class OwnMedian:
    """The median of what the person's own latest steps show; 0 before there are so many."""

    def __init__(self, known: int = 1, latest: int = _OWN_STEPS) -> None:
        self._known = known
        self._latest: deque[float] = deque(maxlen=latest)
        self.value = 0.0

    def add(self, value: float) -> None:
        """Take what one step shows."""
        self._latest.append(value)
        if len(self._latest) >= self._known:
            self.value = statistics.median(self._latest)


@dataclass(frozen=True)
class DetectorSettings(Checked):
    """What every detector can be told."""

    hysteresis: ClassVar[tuple[str, ...]] = ()  # two levels, the first of which is the lower one

    longest_gap: float = setting(0.1, "longest time between two samples", "s", (1e-3, 1.0))
    longest_constant: float = setting(3.0, "longest time without change", "s", (0.1, 60.0))
    heel_strike_bias: float = setting(
        0.0, "measured against a reference, taken off each strike", "s", (-0.2, 0.2)
    )
    toe_off_bias: float = setting(
        0.0, "measured against a reference, taken off each toe-off", "s", (-0.2, 0.2)
    )

    def __post_init__(self) -> None:
        """Check every field, and that there is hysteresis."""
        super().__post_init__()
        levels = [f"{getattr(self, name):g}" for name in self.hysteresis]
        if levels and not float(levels[0]) < float(levels[1]):
            low, high = self.hysteresis
            raise SettingError(f"{low}: {levels[0]}; allowed: below {high}, {levels[1]}")


def _counted(told: str) -> Any:
    """Return a count that a person is told of in these words."""
    return field(default=0, metadata={"told": told})


@dataclass(slots=True)
class SignalCounts:
    """What was wrong with the samples, and with what was found in them."""

    not_finite: int = _counted("samples are not numbers, left out")
    clock_back: int = _counted("samples are not later than the one before, left out")
    # By more than the longest gap: begun anew, as after a dropout.
    clock_jumps: int = _counted("times the clock jumped back: synchronize the clocks")
    dropouts: int = _counted("dropouts: see the cable or the radio link")
    constant: int = _counted(
        "times the signal did not change: sensor dead, not worn, or nobody walks"
    )
    held: int = _counted("times the signal stuck while it moved: raise the range of the sensor")
    rejected: int = _counted("events were found and not believed")
    lost: int = _counted("samples are zeros in mid-movement: lost on the way; see the link")
    unlikely: int = _counted("angles beyond 2 rad: in degrees?")
    impossible: int = 0  # samples left out: beyond what a person can do: units, wrong sensor


class Detector(ABC):
    """
    Finds the events of one foot in the samples of one sensor: causal, its state its own.

    Its docstring gives the reference, the latency, the uncertainty, and when it fails. A detector
    of your own derives from this class: it names itself and its signals, says how long
    it may take, and does its work in `_take`. Samples come in order, at any spacing up to
    ``longest_gap``; what is not a number, or not later than the sample before, never reaches
    `_take`. `_restart` forgets what must not reach across a gap.

    `latency` [s] bounds ``detected_at - time`` of every detection, beyond one sample interval:
    what cannot be decided in that time is counted as rejected, and never published late.
    """

    name: ClassVar[str]
    signals: ClassVar[tuple[str, ...]]  # names of the columns, SI units, in order
    Settings: ClassVar[type[DetectorSettings]] = DetectorSettings
    # Magnitude of the signal that decides [its unit] from which on it cannot stand still.
    moving: ClassVar[float] = math.inf
    # Magnitude [unit of the signals] that no person reaches, and what to say of it.
    impossible: ClassVar[float] = math.inf
    # Magnitude that every walk reaches.
    reached: ClassVar[float] = 0.0
    suspicion: ClassVar[str] = "check the units"
    # Whether sensors on the wrong feet show.
    tells_sides: ClassVar[bool] = False
    # What its events cannot answer: told before a run.
    lacks: ClassVar[str] = ""
    # Standard deviation of heel strikes and toe-offs [s].
    uncertainty: ClassVar[tuple[float, float]]

    def __init__(self, side: Side, settings: Any = None) -> None:
        self.side = side
        self.settings: Any = settings if settings is not None else self.Settings()
        self.counts = SignalCounts()
        self._largest = 0.0  # sum of magnitudes seen
        self._first = math.nan  # time of the first sample
        self._time = self._before = -math.inf  # of the latest sample, and the one before
        self._total = math.nan  # the latest sum of magnitudes
        self._constant_from = -math.inf  # since when it is so [s]
        self._value = math.nan  # the latest of the signal that decides
        self._held_from = -math.inf  # since when it is so [s]
        self._told_constant = self._told_held = False
        self._longest_gap = self.settings.longest_gap
        self._doubt = 0.0  # that the signals are what they should be
        self._found_any = False

    @classmethod
    def calibrated(cls, settings: Any, walk: Sequence[Any]) -> Any:  # noqa: ARG003
        """Return settings completed by a whole walk, (time, values) each; here as they are."""
        return settings

    @property
    @abstractmethod
    def latency(self) -> float:
        """Longest time from an event to its detection, beyond one sample interval [s]."""

    @abstractmethod
    def _take(self, time: float, values: Sequence[float]) -> list[Detection]:
        """Take one good sample; return what it decides."""

    @abstractmethod
    def _restart(self) -> None:
        """Forget what must not reach across a gap in the samples."""

    def add(self, time: float, values: Sequence[float]) -> list[Detection]:
        """
        Take one sample: its time [s since the start of the run] and the values of `signals`.

        Returns the events that it decides, none or one as a rule.
        """
        if not 0.0 < time - self._time <= self._longest_gap and not self._mended(time):
            return []
        total = 0.0
        for value in values:
            total += value if value >= 0.0 else -value
        if not total < math.inf:  # nor is what is not a number
            self.counts.not_finite += 1
            return []
        if total > self._largest:
            self._largest = total
        if total >= self.impossible:
            self.counts.impossible += 1
            self._doubt = min(self._doubt + 1.0, 2.0 * _DOUBTED)
            return []
        if self._doubt > 0.0:
            self._doubt -= 0.25
        self._before, self._time = self._time, time
        if total != self._total:
            self._total, self._constant_from, self._told_constant = total, time, False
        elif time - self._constant_from > self.settings.longest_constant:
            self.counts.constant += not self._told_constant
            self._told_constant = True
        return self._take(time, values)

    def _mended(self, time: float) -> bool:
        """Begin anew after a gap or a jump of the clock; False if the sample is left out."""
        counts, gap = self.counts, time - self._time
        if math.isnan(gap):
            counts.not_finite += 1
            return False
        if -self._longest_gap <= gap <= 0.0:
            counts.clock_back += 1
            return False
        if gap == math.inf:
            self._first = time
        elif gap < 0.0:
            counts.clock_jumps += 1
        else:
            counts.dropouts += 1
        # No interval that ends here is that of the sampling.
        self._time = time
        self._total = self._value = math.nan
        self._restart()
        return True

    def _passed(self, level: float, before: float, value: float) -> float:
        """Return when [s] what the latest two samples show passed a level."""
        return self._time - (self._time - self._before) * (value - level) / (value - before)

    def _found(self, kind: EventKind, event: float, now: float) -> list[Detection]:
        """Return the event of an instant [s] that is decided now; none if late or doubted."""
        if self._doubt > _DOUBTED or now - event > self.latency + (now - self._before):
            self.counts.rejected += 1
            return []
        self._found_any = True
        bias = self.settings.heel_strike_bias, self.settings.toe_off_bias
        return [Detection(kind, self.side, event - bias[kind], now, self.uncertainty[kind])]

    def _watch(self, time: float, value: float) -> None:
        """Count that the signal that decides stays at one value although it moves."""
        if value != self._value:
            self._value, self._held_from, self._told_held = value, time, False
        elif time - self._held_from > _HELD and abs(value) > self.moving:
            self.counts.held += not self._told_held
            self._told_held = True

    @property
    def _walked_long(self) -> bool:
        """Whether a walk would have shown by now what the signal reaches."""
        return self._time - self._first > _LONG_ENOUGH

    def troubles(self, now: float | None = None) -> tuple[str, ...]:
        """
        Return what a person should know of this sensor, each in one line; empty if all is well.

        With ``now`` [s] it tells a sensor that has fallen silent, too.
        """
        where = f"{self.side.name.lower()} {self.name}"
        told = [
            f"{where}: {n} {count.metadata['told']}"
            for count in fields(self.counts)
            if (n := getattr(self.counts, count.name)) and count.metadata
        ]
        if self.counts.impossible:
            told.append(
                f"{where}: {self.counts.impossible} samples of up to {self._largest:.3g} cannot "
                f"be: {self.suspicion}"
            )
        if self._walked_long and self._largest < self.reached:
            told.append(
                f"{where}: never above {self._largest:.3g}, which a walk exceeds: {self.suspicion}"
            )
        if self._walked_long and not (told or self._found_any):
            told.append(f"{where}: no event yet: does anybody walk? else see sensor and settings")
        if now is not None and not now - self._time <= self._longest_gap:
            silent = "no sample yet" if self._time == -math.inf else "no sample for "
            seconds = "" if self._time == -math.inf else f"{now - self._time:.2f} s"
            told.append(f"{where}: {silent}{seconds}")
        return tuple(told)


@dataclass(frozen=True)
class ChosenDetector:
    """A detector that has been chosen and loaded, with its settings."""

    name: str
    detector: type[Detector]
    settings: Any

    def make(self, side: Side) -> Detector:
        """Return a detector for one foot."""
        return self.detector(side, self.settings)


def detector_names() -> dict[str, str]:
    """Return where each detector is found, by name; nothing is loaded."""
    return dict(sorted((p.name, p.value) for p in entry_points(group=ENTRY_POINTS)))


def find_detector(text: str) -> ChosenDetector:
    """
    Load the detector that a text names, and check its settings.

    Raises UsageError if there is none of that name or it cannot be loaded; LimitError if an
    option is unknown or out of range.
    """
    name, _, options = text.partition(":")
    found = detector_names()
    if name not in found:
        raise UsageError(f"detector: {name!r} is unknown; allowed: {', '.join(found)}")
    whose = f"detector: {name} ({found[name]})"
    try:
        detector = EntryPoint(name, found[name], ENTRY_POINTS).load()
        if not (isinstance(detector, type) and issubclass(detector, Detector)):
            raise UsageError(f"{whose} is no Detector: derive it from that class")
        settings = read_options(f"detector: {name}", detector.Settings, options)
        chosen = ChosenDetector(name, detector, settings)
        _ = chosen.make(Side.LEFT).latency  # what cannot be made is told here, too
    except EntrainmentError:
        raise
    except (Exception, SystemExit) as error:  # it is somebody else's package
        raise UsageError(f"{whose} cannot be loaded: {error!r}; install what it needs") from error
    return chosen
