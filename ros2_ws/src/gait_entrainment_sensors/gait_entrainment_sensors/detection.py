# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The interface of a detector: samples of one sensor on one foot in, heel strikes and toe-offs out.

A detector is named like a driver: NAME, or NAME:OPTION=VALUE,OPTION=VALUE. Other packages register
detectors under the entry point ``gait_entrainment.detectors``.
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
# After a walk of this length the largest values of the signal have been seen [s].
_LONG_ENOUGH = 10.0
# A moving signal that stays constant for this long has reached the end of its range [s].
_HELD = 0.05
# After this many impossible samples in a row the unit, and with it every event, is doubted; four
# good samples offset a bad one. A glitch is shorter; in degrees a third of the samples are bad.
_DOUBTED = 20
# Number of the person's own stances, swings or peaks in a median.
_OWN_STEPS = 7


@dataclass(frozen=True, slots=True)
class Detection:
    """A detected heel strike or toe-off; times in seconds since the start of the run."""

    kind: EventKind
    side: Side
    time: float  # estimated time of the event
    detected_at: float  # time of the sample that decided it
    uncertainty: float  # standard deviation of ``time`` [s]


class OwnMedian:
    """Median over the person's own latest steps; 0 until ``known`` values have been added."""

    def __init__(self, known: int = 1, latest: int = _OWN_STEPS) -> None:
        self._known = known
        self._latest: deque[float] = deque(maxlen=latest)
        self.value = 0.0

    def add(self, value: float) -> None:
        """Add the value of one step."""
        self._latest.append(value)
        if len(self._latest) >= self._known:
            self.value = statistics.median(self._latest)


@dataclass(frozen=True)
class DetectorSettings(Checked):
    """Settings of every detector."""

    hysteresis: ClassVar[tuple[str, ...]] = ()  # names of two levels, the lower one first

    longest_gap: float = setting(0.1, "longest time between two samples", "s", (1e-3, 1.0))
    longest_constant: float = setting(3.0, "longest time without change", "s", (0.1, 60.0))
    heel_strike_bias: float = setting(
        0.0, "bias against a reference, subtracted from each strike", "s", (-0.2, 0.2)
    )
    toe_off_bias: float = setting(
        0.0, "bias against a reference, subtracted from each toe-off", "s", (-0.2, 0.2)
    )

    def __post_init__(self) -> None:
        """Check every field, and that the hysteresis levels are in order."""
        super().__post_init__()
        levels = [f"{getattr(self, name):g}" for name in self.hysteresis]
        if levels and not float(levels[0]) < float(levels[1]):
            low, high = self.hysteresis
            raise SettingError(f"{low}: {levels[0]}; allowed: below {high}, {levels[1]}")


def _counted(message: str) -> Any:
    """Return a count field with the message that reports it."""
    return field(default=0, metadata={"message": message})


@dataclass(slots=True)
class SignalCounts:
    """Problems with the samples, and with the events found in them."""

    not_finite: int = _counted("samples are not numbers, skipped")
    clock_back: int = _counted("samples are not later than the previous one, skipped")
    # By more than the longest gap: the detector restarts, as after a dropout.
    clock_jumps: int = _counted("times the clock jumped back: synchronize the clocks")
    dropouts: int = _counted("dropouts: check the cable or the radio link")
    constant: int = _counted(
        "times the signal did not change: sensor dead or not worn, or nobody is walking"
    )
    held: int = _counted("times the signal got stuck in mid-movement: increase the sensor's range")
    rejected: int = _counted("events were detected but rejected")
    lost: int = _counted("samples are zeros in mid-movement: lost in transmission; check the link")
    unlikely: int = _counted("angles beyond 2 rad: in degrees?")
    impossible: int = 0  # samples skipped, as no person reaches them: units, wrong sensor


class Detector(ABC):
    """
    Finds the events of one foot in the samples of one sensor, causally and without shared state.

    Each detector's docstring gives its reference, latency and uncertainty, and when it fails. To
    write your own, derive from this class, define the name, the signals and the latency, and
    detect events in `_take`. Samples arrive in order, at any spacing up to ``longest_gap``; one
    that is not a number, or not later than the previous one, never reaches `_take`. `_restart`
    discards the state that must not carry over across a gap.

    `latency` [s] plus one sample interval bounds ``detected_at - time`` of every detection. An
    event that cannot be decided in that time is counted as rejected, and never published late.
    """

    name: ClassVar[str]
    signals: ClassVar[tuple[str, ...]]  # names of the columns, SI units, in order
    Settings: ClassVar[type[DetectorSettings]] = DetectorSettings
    # Magnitude of the deciding signal [its unit] above which it cannot stay constant.
    moving: ClassVar[float] = math.inf
    # Magnitude [unit of the signals] that no person reaches.
    impossible: ClassVar[float] = math.inf
    # Magnitude that every walk reaches.
    reached: ClassVar[float] = 0.0
    suspicion: ClassVar[str] = "check the units"  # hint if either is violated
    # Whether it notices sensors on the wrong feet.
    tells_sides: ClassVar[bool] = False
    # What its events cannot answer, reported before a run.
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
        self._constant_from = -math.inf  # since when it has been constant [s]
        self._value = math.nan  # latest value of the deciding signal
        self._held_from = -math.inf  # since when it has been constant [s]
        self._constant_counted = self._held_counted = False
        self._longest_gap = self.settings.longest_gap
        self._doubt = 0.0  # about the unit, in impossible samples
        self._found_any = False

    @classmethod
    def calibrated(cls, settings: Any, walk: Sequence[Any]) -> Any:  # noqa: ARG003
        """Return settings completed from a walk of (time, values); here they are unchanged."""
        return settings

    @property
    @abstractmethod
    def latency(self) -> float:
        """Longest time from an event to its detection, beyond one sample interval [s]."""

    @abstractmethod
    def _take(self, time: float, values: Sequence[float]) -> list[Detection]:
        """Process one good sample; return the events that it decides."""

    @abstractmethod
    def _restart(self) -> None:
        """Discard the state that must not carry over across a gap in the samples."""

    def add(self, time: float, values: Sequence[float]) -> list[Detection]:
        """
        Process one sample: its time [s since the start of the run] and the values of `signals`.

        Returns the events that it decides, usually none or one.
        """
        if not 0.0 < time - self._time <= self._longest_gap and not self._mended(time):
            return []
        total = 0.0
        for value in values:
            total += value if value >= 0.0 else -value
        if not total < math.inf:  # infinite or NaN
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
            self._total, self._constant_from, self._constant_counted = total, time, False
        elif time - self._constant_from > self.settings.longest_constant:
            self.counts.constant += not self._constant_counted
            self._constant_counted = True
        return self._take(time, values)

    def _mended(self, time: float) -> bool:
        """Restart after a gap or a clock jump; return False if the sample is to be skipped."""
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
        # The interval that ends here is not a sampling interval.
        self._time = time
        self._total = self._value = math.nan
        self._restart()
        return True

    def _passed(self, level: float, before: float, value: float) -> float:
        """Return when [s] the signal crossed a level between the latest two samples."""
        return self._time - (self._time - self._before) * (value - level) / (value - before)

    def _found(self, kind: EventKind, event: float, now: float) -> list[Detection]:
        """Return the event at a time [s] that is decided now; nothing if late or doubted."""
        if self._doubt > _DOUBTED or now - event > self.latency + (now - self._before):
            self.counts.rejected += 1
            return []
        self._found_any = True
        bias = self.settings.heel_strike_bias, self.settings.toe_off_bias
        return [Detection(kind, self.side, event - bias[kind], now, self.uncertainty[kind])]

    def _watch(self, time: float, value: float) -> None:
        """Count how often the deciding signal sticks at one value in mid-movement."""
        if value != self._value:
            self._value, self._held_from, self._held_counted = value, time, False
        elif time - self._held_from > _HELD and abs(value) > self.moving:
            self.counts.held += not self._held_counted
            self._held_counted = True

    @property
    def _walked_long(self) -> bool:
        """Whether a walk would have shown the largest values of the signal by now."""
        return self._time - self._first > _LONG_ENOUGH

    def troubles(self, now: float | None = None) -> tuple[str, ...]:
        """
        Return what a person should know about this sensor, one line each; empty if all is well.

        With ``now`` [s] a sensor that has fallen silent is also reported.
        """
        where = f"{self.side.name.lower()} {self.name}"
        lines = [
            f"{where}: {n} {count.metadata['message']}"
            for count in fields(self.counts)
            if (n := getattr(self.counts, count.name)) and count.metadata
        ]
        if self.counts.impossible:
            lines.append(
                f"{where}: {self.counts.impossible} samples of up to {self._largest:.3g} are "
                f"impossible: {self.suspicion}"
            )
        if self._walked_long and self._largest < self.reached:
            lines.append(
                f"{where}: never above {self._largest:.3g}, which a walk exceeds: {self.suspicion}"
            )
        if self._walked_long and not (lines or self._found_any):
            lines.append(f"{where}: no event yet: if the person walks, check sensor and settings")
        if now is not None and not now - self._time <= self._longest_gap:
            silent = "no sample yet" if self._time == -math.inf else "no sample for "
            seconds = "" if self._time == -math.inf else f"{now - self._time:.2f} s"
            lines.append(f"{where}: {silent}{seconds}")
        return tuple(lines)


@dataclass(frozen=True)
class ChosenDetector:
    """A detector that was chosen and loaded, with its settings."""

    name: str
    detector: type[Detector]
    settings: Any

    def make(self, side: Side) -> Detector:
        """Return a detector for one foot."""
        return self.detector(side, self.settings)


def detector_names() -> dict[str, str]:
    """Return the location of each detector by name, without loading any."""
    return dict(sorted((p.name, p.value) for p in entry_points(group=ENTRY_POINTS)))


def find_detector(text: str) -> ChosenDetector:
    """
    Load the detector named by a text, and check its settings.

    Raises UsageError if the name is unknown or the detector cannot be loaded; LimitError if an
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
            raise UsageError(f"{whose} is not a Detector: derive it from that class")
        settings = read_options(f"detector: {name}", detector.Settings, options)
        chosen = ChosenDetector(name, detector, settings)
        _ = chosen.make(Side.LEFT).latency  # raises if it cannot be made
    except EntrainmentError:
        raise
    except (Exception, SystemExit) as error:  # from code of other packages
        raise UsageError(f"{whose} cannot be loaded: {error!r}; install what it needs") from error
    return chosen
