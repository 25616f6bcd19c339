# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
What the page shows of a run, without ROS and without a browser.

Decoded messages go in; figures, sentences and the points of the charts come out. Every history is
bounded, so the ten-thousandth stride costs as much as the first one.
"""

import contextlib
import math
import statistics
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND, EventKind, Side, nanoseconds_of
from gait_entrainment.gait.verdict import Reason, Verdict
from gait_entrainment.robot import DeviceError, DeviceLimits, find_driver
from gait_entrainment.settings import settings_of
from gait_entrainment_bags import topic_names as names
from gait_entrainment_bags.messages import MessageError, event_of, state_of
from gait_entrainment_commands.outcome import MEANINGS

# Strides and pulses in the charts: more could not be told apart on a screen.
STRIDES_SHOWN = 200
# Robot readings that are kept, and how many are drawn per stride.
READINGS_KEPT, READINGS_DRAWN = 4000, 400
# Events from which the step rate is computed.
_EVENTS_COUNTED = 10
_LINES_KEPT = 8
# Node states arrive once a second; without one for this long a node is stale [s], as in rqt.
STALE_AFTER = 5.0
# A torque that was measured longer ago is shown with its age [s].
_OLD = 1.0
PARTS = ("waiting", "baseline", "pulses", "washout", "finished", "failed", "rest")
_OVER = ("finished", "failed")
STATUSES = ("inactive", "active", "stopped", "fault")
_ACTIVE = STATUSES.index("active")
_LEVELS = ("ok", "warning", "error", "stale")
JOINTS = ("l_hip", "r_hip", "l_ankle", "r_ankle")
# Limits that are shown; one of them follows from the pulses of the block.
_LIMITS = ("torque", "duration", "rate", "rising")
_REVEALING = "rate"
SESSION = "session"  # the node that reports the state of a session
_NAN = math.nan


@dataclass(frozen=True)
class NodeState:
    """The latest state reported by a node, and when, on the view's clock [s]."""

    level: str  # ok, warning, error or stale
    message: str
    values: dict[str, str]
    heard_at: float


class View:
    """
    The current state of a run. Hold ``lock`` while reading or writing it.

    Stamps are nanoseconds, as recorded; ``version`` grows with the data of the charts. A
    ``blinded`` view hides everything about robot and protocol that would reveal a block; its
    charts, lag and verdict must not be shown. The ``clock`` [s] measures how long ago something
    was heard; by default it is the time of the record.
    """

    def __init__(self, *, blinded: bool = False, clock: Callable[[], float] | None = None) -> None:
        self.lock, self.blinded = threading.RLock(), blinded
        self._clock = clock or (lambda: self.now / NANOSECONDS_PER_SECOND)
        self.version = 0
        self.nodes: dict[str, NodeState] = {}
        self.notes: deque[tuple[int, str, str]] = deque(maxlen=_LINES_KEPT)
        # The robot of the next run may be announced before that run.
        self.setup: Any = None  # latest AnkleRobotSetup
        self.simulated = False  # the robot: what it measures is computed
        self._reset()

    def _reset(self) -> None:
        """Forget the run, as another one begins."""
        self.now = 0
        self.state: Any = None  # latest ExperimentState
        self.side: Side | None = None  # the perturbed leg
        self.strides: deque[tuple[int, float]] = deque(maxlen=STRIDES_SHOWN)  # number, period [s]
        # Of each pulse: stride, phase lag [s].
        self.lags: deque[tuple[int, float]] = deque(maxlen=STRIDES_SHOWN)
        self.lag_refers_to = "toe-off"  # or the heel strike, if no toe-offs are detected
        # The latest double stances before a toe-off of the perturbed leg [s].
        self.stances: deque[float] = deque(maxlen=_EVENTS_COUNTED)
        self.verdict: Any = None  # latest Entrainment
        self.robots: dict[Side, Any] = {}  # latest AnkleRobotState of each ankle that has one
        self._heard_at: dict[Side, float] = {}  # when it arrived
        self.legs: tuple[float, ...] = ()  # hips and ankles, left and right [rad]
        self.event: Any = None  # latest GaitEvent
        self.events = 0
        # Of the last complete stride: seconds from its start, commanded, measured [N m].
        self.torque: list[tuple[float, float, float]] = []
        self.toe_off = self.double_stance = _NAN  # of that stride, from its start [s]
        self.troubles: deque[str] = deque(maxlen=_LINES_KEPT)
        self._readings: deque[tuple[int, float, float]] = deque(maxlen=READINGS_KEPT)
        self._strikes: deque[int] = deque(maxlen=_EVENTS_COUNTED)
        self._toe_off_at = self._other_strike_at = 0

    # Input

    def take(self, topic: str, message: Any) -> None:
        """Process a message of a topic, by its relative name; an invalid one is ignored."""
        if (run := getattr(message, "run", 0)) and self.state is not None:
            # Another command counts its runs from the start; one node alone publishes its state.
            if run > self.state.run or (topic == names.EXPERIMENT_STATE and self._begins(message)):
                self._reset()
            elif run < self.state.run:
                return
        if hasattr(message, "header"):
            self.now = max(self.now, nanoseconds_of(message.header.stamp))
        with contextlib.suppress(MessageError, ValueError):
            _TAKES[topic](self, message)

    def _begins(self, state: Any) -> bool:
        """Whether an ExperimentState belongs to another run than the latest one."""
        over = not self.going_on and PARTS[min(state.phase, len(PARTS) - 1)] not in _OVER
        return state.run < self.state.run or state.stride < self.state.stride or over

    def take_diagnostics(self, message: Any) -> None:
        """Process the states that nodes report."""
        for status in message.status:
            # The suffixes of our nodes; the parts of other nodes keep theirs.
            name = status.name.removesuffix(": state").removesuffix(": run")
            level = _LEVELS[min(int.from_bytes(status.level, "little"), 3)]
            values = {pair.key: pair.value for pair in status.values}
            self.nodes[name] = NodeState(level, status.message, values, self._clock())

    def _on_state(self, message: Any) -> None:
        self.state = message
        self.version += 1

    def _on_stride(self, message: Any) -> None:
        self.side = Side(message.side)
        self.strides.append((message.number, message.period))
        start, end = nanoseconds_of(message.start), nanoseconds_of(message.header.stamp)
        self.torque = self._torque_between(start, end)
        self.toe_off = (self._toe_off_at - start) / NANOSECONDS_PER_SECOND
        self.double_stance = self.stances[-1] if self.stances else _NAN
        self.version += 1

    def _torque_between(self, start: int, end: int) -> list[tuple[float, float, float]]:
        """Return the thinned readings of a stride; it starts with the value before it."""
        within, before = [], (0, 0.0, _NAN)
        for reading in self._readings:
            if reading[0] < start:
                before = reading
            elif reading[0] <= end:
                within.append(reading)
        thin = max(1, math.ceil(len(within) / READINGS_DRAWN))
        if not within and not before[0]:
            return []
        last = within[-1] if within else before
        drawn = [(start, *before[1:]), *within[::thin], (end, *last[1:])]
        return [((at - start) / NANOSECONDS_PER_SECOND, c, m) for at, c, m in drawn]

    def _on_phase(self, message: Any) -> None:
        self.lags.append((message.stride, message.phase_lag))
        if not math.isnan(message.phase_lag):
            toe_off = getattr(message, "toe_off", None)  # which bags of earlier versions lack
            of_strike = toe_off is not None and not nanoseconds_of(toe_off)
            self.lag_refers_to = "heel strike" if of_strike else "toe-off"
        self.version += 1

    def _on_verdict(self, message: Any) -> None:
        Verdict(message.verdict), Reason(message.reason)  # raises if unknown here
        self.verdict = message
        self.version += 1

    def _on_event(self, message: Any) -> None:
        event = event_of(message)
        self.event, self.events = message, self.events + 1
        if event.kind is EventKind.HEEL_STRIKE:
            self._strikes.append(event.stamp)
            if event.side is not self.side:
                self._other_strike_at = event.stamp
        elif event.side is self.side and self._other_strike_at:
            self._toe_off_at = event.stamp
            passed = event.stamp - self._other_strike_at
            self.stances.append(passed / NANOSECONDS_PER_SECOND)

    def _on_robot(self, message: Any) -> None:
        side, reading = Side(message.side), state_of(message)
        self.robots[side], self._heard_at[side] = message, self._clock()
        if self.side in (None, side):
            self._readings.append((reading.stamp, reading.commanded, reading.measured))

    def _on_setup(self, message: Any) -> None:
        self.setup = message
        if self.side is None:
            self.side = Side(message.side)
        self.simulated = False
        with contextlib.suppress(DeviceError):  # a driver that is not installed here
            self.simulated = find_driver(message.driver).simulated

    def _on_trouble(self, message: Any) -> None:
        self.troubles.append(message.message)

    def _on_joints(self, message: Any) -> None:
        angles = dict(zip(message.name, message.position, strict=False))
        if angles.keys() >= set(JOINTS):
            self.legs = tuple(angles[joint] for joint in JOINTS)

    def _on_note(self, message: Any) -> None:
        stamp = nanoseconds_of(message.header.stamp)
        self.notes.append((stamp, message.author, message.text))

    # What is shown: sentences and figures

    @property
    def part(self) -> str:
        """The part of the protocol, one of PARTS."""
        return PARTS[min(self.state.phase, len(PARTS) - 1)] if self.state else "waiting"

    @property
    def going_on(self) -> bool:
        """Whether a run has started and not ended."""
        return self.state is not None and self.part not in _OVER

    @property
    def period(self) -> float:
        """Median period of the last strides [s]; NaN if unknown."""
        last = [period for _, period in [*self.strides][-10:] if period > 0]
        return statistics.median(last) if last else _NAN

    def part_words(self) -> str:
        """Return the part of the protocol, and the block if it has several."""
        if self.state is None:
            return "no run"
        blocks = getattr(self.state, "blocks", 1)  # which bags of earlier versions lack
        if blocks < 2:
            return self.part
        name = "" if self.blinded else self.state.block_name
        return f"{self.part}, {name or self.state.block} of {blocks} blocks"

    def time_left(self) -> float:
        """Return the time left [s], estimated from the last strides; NaN if unknown."""
        if self.part == "finished":
            return 0.0
        if not self.going_on:
            return _NAN
        left = float(max(self.state.strides - self.state.stride, 0) * self.period)
        if self.blinded and math.isfinite(left):  # more digits would reveal the period
            left = 30.0 * math.ceil(left / 30)
        return left

    def lag(self) -> str:
        """Return the latest phase lag, and where in the stride it lies."""
        if not self.lags:
            return "no pulse yet"
        stride, lag = self.lags[-1]
        if math.isnan(lag):
            return f"unknown: no {self.lag_refers_to} near"
        period = dict(self.strides).get(stride) or (self.strides[-1][1] if self.strides else _NAN)
        percent = f" = {_signed(100 * lag / period, 1)} % of the stride" if period > 0 else ""
        return f"{_signed(1e3 * lag, 0)} ms{percent}"

    def verdict_words(self) -> tuple[str, str]:
        """Return the verdict, and its figures in a sentence."""
        found = self.verdict
        if found is None:
            return "no verdict yet", "It needs a baseline and some pulses."
        verdict, reason = Verdict(found.verdict), Reason(found.reason)
        word = verdict.name.lower()
        if verdict is Verdict.ENTRAINED:
            return f"entrained since stride {found.entrained_since_stride}", (
                f"Over {found.window} pulses the lag moves by {_signed(1e3 * found.drift, 2)} ms"
                f" a stride; strides last {found.mean_period:.4f} s, pulses come every"
                f" {found.pulse_period:.4f} s."
            )
        meaning = MEANINGS.get(reason.name.lower()) or MEANINGS.get(word, word)
        figures = ""
        if not math.isnan(found.drift):
            figures = (
                f" The lag moves by {_signed(1e3 * found.drift, 1)} ms a stride, give or take"
                f" {1e3 * found.drift_interval:.1f}, over {found.window} pulses."
            )
        return word, f"{meaning[0].upper()}{meaning[1:]}.{figures}"

    @property
    def pushes(self) -> bool:
        """Whether torque is commanded now."""
        torques = [state.commanded_torque for state in self.robots.values()]
        return not self.blinded and any(torque != 0 for torque in torques)

    def measured(self) -> str:
        """Return the measured torque; never zero if none was measured."""
        return self._of_each(self._measured) or "nothing heard from the robot"

    def _measured(self, robot: Any) -> str:
        if self.blinded and robot.status == _ACTIVE and not self.faults():
            return "hidden"  # until it matters whether it falls
        torque = robot.measured_torque
        if math.isnan(torque):
            return "not measured"
        if self.simulated:  # it reports only changes
            return f"{_torque(torque)} (simulated)"
        age = self._clock() - self._heard_at[Side(robot.side)]
        return _torque(torque) + (f", {age:.0f} s ago" if age > _OLD else "")

    def faults(self) -> str:
        """Return the faults of the robot on either ankle, empty if there are none."""
        return self._of_each(lambda robot: ", ".join(robot.faults))

    def _of_each(self, describe: Callable[[Any], str]) -> str:
        """Return a text about the robot, with the ankles named if they differ."""
        texts = {side: describe(robot) for side, robot in sorted(self.robots.items())}
        if len(set(texts.values())) <= 1:
            return next(iter(texts.values()), "")
        return ", ".join(f"{side.name.lower()} {words or 'none'}" for side, words in texts.items())

    def robot_words(self) -> list[tuple[str, str]]:
        """Return names and values about the robot."""
        rows = [("state", "not heard from")]
        if self.robots:
            rows = [("state", self._of_each(lambda robot: STATUSES[min(robot.status, 3)]))]
            if not self.blinded:
                commanded = self._of_each(lambda robot: _torque(robot.commanded_torque))
                rows.append(("commanded", commanded))
            rows.append(("measured", self.measured()))
            rows.append(("faults", self.faults() or "none"))
        if (setup := self.setup) is not None:
            limits = dict(zip(setup.limit_names, setup.limits, strict=False))
            if self.blinded:
                limits.pop(_REVEALING, None)
            rows.append(("driver", setup.driver.partition(":")[0]))
            if not self.simulated:
                rows.append(("armed by", setup.armed_by or "nobody"))
                rows.append(("watchdog", setup.watchdog or "not proved"))
            units = {n: s.unit.strip("1") for n, s in settings_of(DeviceLimits).items()}
            shown = [f"{n} {limits[n]:.4g} {units[n]}".rstrip() for n in _LIMITS if limits.get(n)]
            rows.append(("limits", ", ".join(shown)))
        return rows

    def sensor_words(self) -> list[tuple[str, str]]:
        """Return names and values about the detection of gait events."""
        if (event := self.event) is None:
            return [("gait events", "none yet")]
        kind = EventKind(event.kind).name.lower().replace("_", " ")
        rows = [("last event", f"{kind}, {Side(event.side).name.lower()}, step {event.step}")]
        if hasattr(event, "detector"):  # which bags of earlier versions lack
            known = nanoseconds_of(event.detected_at) - nanoseconds_of(event.header.stamp)
            exact = not event.detector
            rows += [
                ("source", event.source),
                ("detector", "none: exact events" if exact else event.detector),
                ("uncertainty", "exact" if exact else f"{1e3 * event.uncertainty:.1f} ms"),
            ]
            rows += [] if exact else [("known after", f"{known / 1e6:.0f} ms")]
        if len(self._strikes) > 1:
            span = (self._strikes[-1] - self._strikes[0]) / NANOSECONDS_PER_SECOND
            if self.blinded:  # a rate is a stride period
                rows.append(("events", str(self.events)))
            elif span > 0:
                rows.append(("rate", f"{60 * (len(self._strikes) - 1) / span:.1f} steps a minute"))
        return rows

    def session(self) -> tuple[str, bool]:
        """Return the state of a session in progress, and whether it was paused."""
        for name, level, message in self.node_words():
            if name.endswith(SESSION) and level != "stale":
                return message, level == "warning"
        return "", False

    def node_words(self) -> list[tuple[str, str, str]]:
        """Return name, level and message of all nodes except those that ended with their run."""
        rows = []
        for name, state in sorted(self.nodes.items()):
            silent = self._clock() - state.heard_at
            stale = silent > STALE_AFTER
            if stale and self.state is not None and not self.going_on:
                continue
            level = "stale" if stale else state.level
            rows.append((name, level, f"silent for {silent:.0f} s" if stale else state.message))
        return rows


_TAKES: dict[str, Callable[[View, Any], None]] = {
    names.EXPERIMENT_STATE: View._on_state,
    names.STRIDES: View._on_stride,
    names.PULSE_PHASES: View._on_phase,
    names.ENTRAINMENT: View._on_verdict,
    names.GAIT_EVENTS: View._on_event,
    names.ROBOT_STATE: View._on_robot,
    names.ROBOT_SETUP: View._on_setup,
    names.TROUBLE: View._on_trouble,
    names.JOINT_STATES: View._on_joints,
    names.OPERATOR_NOTES: View._on_note,
}
# Sampled topics; the others have at most one message per stride or event.
SAMPLED = (names.ROBOT_STATE, names.JOINT_STATES)
KEPT = [name for name in _TAKES if name not in SAMPLED]


def _torque(value: float) -> str:
    return f"{_signed(value, 2)} N m"


def _signed(value: float, digits: int) -> str:
    """Return a number with its sign and a number of digits; no negative zero."""
    return f"{round(value, digits) + 0.0:+.{digits}f}"
