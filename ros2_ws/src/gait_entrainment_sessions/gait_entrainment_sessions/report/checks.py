# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Whether the data of a run are sound: what a reader of its results should see first."""

import hashlib
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from gait_entrainment.conventions import nanoseconds
from gait_entrainment_bags import BagReader
from gait_entrainment_bags.messages import state_of
from gait_entrainment_bags.reader import bag_files
from gait_entrainment_bags.recorded_run import RecordedRun, walker_timing
from gait_entrainment_bags.topic_names import ROBOT_SETUP, ROBOT_STATE, TROUBLE
from gait_entrainment_commands.outcome import holes_of, timing_findings, timing_outcome

GOOD, DOUBTFUL, BAD = "good", "doubtful", "bad"
ORIGIN: tuple[str, ...] = ("commit", "driver", "mode", "seed")  # of the custom data of a bag
# Number of pulses, evenly spread, whose torque is compared: a whole hour of a robot that is read
# 1000 times a second would take minutes. Each is read until this long after its end [s].
_COMPARED, _AFTER = 30, 0.2
# First words of the checks whose findings, or even state, reveal the pulses: a sham's torque is
# easily off by a tenth.
_TELLING = ("pulses", "torque", "limits")
# Measured torque this far off the commanded one, as a share of the pulse, is doubtful.
_FOLLOWS = 0.1


@dataclass(frozen=True)
class Check:
    """One check: its name, its state and what it found."""

    name: str
    state: str  # GOOD, DOUBTFUL or BAD
    finding: str


def checks_of(run: RecordedRun, reader: BagReader, *, sealed: bool = False) -> list[Check]:
    """Return the checks of a recorded run; if ``sealed``, only those that may be shown."""
    checks = [
        _record(run, sealed=sealed),
        _holes(run),
        _events(run),
        _pulses(run),
        *_timing(run),
        _torque(run, reader),
        _clocks(reader, walker_timing(reader)),
        _limits(reader),
        _faults(reader),
        _analysis(run),
    ]
    return [c for c in checks if not (sealed and c.name.startswith(_TELLING))]


def _record(run: RecordedRun, *, sealed: bool) -> Check:
    if run.ended_early:
        return Check("record", BAD, f"ended early: {run.ended_early}")
    lost = "lost ones not counted" if run.lost is None else f"{run.lost} lost"
    state = DOUBTFUL if run.lost is None else (BAD if run.lost else GOOD)
    # The number of messages would reveal a sham: a robot sends more if there is torque.
    return Check("record", state, lost if sealed else f"{run.messages} messages, {lost}")


def _holes(run: RecordedRun) -> Check:
    holes = holes_of(run)
    missing = "; ".join(sorted({hole.missing for hole in holes})) or "none"
    return Check("holes", BAD if holes else GOOD, missing)


def _events(run: RecordedRun) -> Check:
    counts = run.analysis.event_counts
    doubts = ("missing", "implausible", "contradictory", "late", "repeated")
    odd = {name: getattr(counts, name) for name in doubts}
    others = ", ".join(f"{number} {name}" for name, number in odd.items() if number)
    state = DOUBTFUL if any(odd.values()) else GOOD
    return Check("gait events", state, f"{counts.accepted} accepted; {others or 'none in doubt'}")


def _pulses(run: RecordedRun) -> Check:
    counts, given, placed = run.analysis.pulse_counts, len(run.onsets), len(run.analysis.pulses)
    finding, complete = f"{placed} placed in strides", True
    if run.protocol is not None:
        planned = run.protocol.planned.count
        in_strides = sum(block.pulses.count for block in run.protocol.sequence)
        finding += f" of {in_strides} planned"
        complete = given == planned and placed == in_strides
        if planned != in_strides:
            finding += f"; {given} of {planned} on both legs delivered"
    if counts.without_lag:
        finding += f", {counts.without_lag} without a toe-off to refer to"
    return Check("pulses", GOOD if complete and not counts.without_lag else DOUBTFUL, finding)


def _timing(run: RecordedRun) -> Iterator[Check]:
    outcome = timing_outcome(run.timings, run.measured_period)
    for kind, finding in timing_findings(outcome).items():
        yield Check(f"pulses {kind}", DOUBTFUL if outcome[kind]["missing"] else GOOD, finding)


def _torque(run: RecordedRun, reader: BagReader) -> Check:
    """Compare measured with commanded torque, over evenly spread pulses."""
    topic, pulses = reader.find_topic(ROBOT_STATE), [d for d in run.delivered if d[1].torque != 0]
    if run.protocol and not pulses and len(run.onsets) == run.protocol.planned.count:
        return Check("torque", GOOD, "none was requested")
    if topic is None or run.protocol is None or not pulses:
        return Check("torque", DOUBTFUL, "nothing to compare")
    width = run.protocol.planned.duration
    errors, resting, count = list[float](), 0.0, 0
    for side, timing in pulses[:: math.ceil(len(pulses) / _COMPARED)]:
        onset = timing.commanded
        end = onset + nanoseconds(width + _AFTER)
        found = reader.decoded([topic], onset, end)
        states = [state_of(m) for _, m in found if m.side == side]
        measured = [s for s in states if not math.isnan(s.measured)]
        count += bool(measured)
        late = [s for s in measured if s.commanded == 0 and s.stamp > onset + nanoseconds(width)]
        errors += [abs(s.measured - s.commanded) for s in measured if s.commanded != 0]
        resting = max([resting, *(abs(s.measured) for s in late[len(late) // 2 :])])
    if not errors:
        return Check("torque", DOUBTFUL, "the robot does not measure it")
    mean, height = sum(errors) / len(errors), abs(run.protocol.pulse_torque)
    finding = (
        f"measured differs from commanded by {mean:.2f} N m on average during a pulse"
        f" ({100 * mean / height if height else 0:.0f} % of it), at most {resting:.2f} N m left"
        f" {_AFTER:g} s after it; {count} of {len(pulses)} pulses compared"
    )
    follows = not height or (mean < _FOLLOWS * height and resting < _FOLLOWS * height)
    return Check("torque", GOOD if follows else DOUBTFUL, finding)


def _clocks(reader: BagReader, timing: dict[str, dict[str, float]]) -> Check:
    mode = reader.custom_data.get("mode", "unknown mode")
    promises = timing.get("promises", {})
    late, starved = promises.get("late_stretches", 0), promises.get("starved_stretches", 0)
    finding = f"{mode}; torque arrived late in {late:.0f} stretches, not at all in {starved:.0f}"
    if lateness := timing.get("publish_lateness_ms"):
        finding += f"; samples up to {lateness['worst']:.1f} ms late"
    return Check("clocks", DOUBTFUL if late or starved or not timing else GOOD, finding)


def _limits(reader: BagReader) -> Check:
    setups = list(reader.messages_of(ROBOT_SETUP))
    if not setups:
        return Check("limits", DOUBTFUL, "the robot did not report them")
    last = setups[-1]
    limits = ", ".join(f"{n} {v:g}" for n, v in zip(last.limit_names, last.limits, strict=True))
    facts: list[str] = []
    for robot in {setup.side: setup for setup in setups}.values():
        armed = f"armed by {robot.armed_by}" if robot.armed_by else ""
        known = f"{robot.driver} {robot.device}".strip(), armed, robot.watchdog, robot.preflight
        facts += filter(None, known)
    return Check("limits", GOOD, "; ".join([*facts, limits]))


def _faults(reader: BagReader) -> Check:
    found = [trouble.message or trouble.fault for trouble in reader.messages_of(TROUBLE)]
    return Check("faults", BAD if found else GOOD, "; ".join(dict.fromkeys(found)) or "none")


def _analysis(run: RecordedRun) -> Check:
    if run.differences is None:
        return Check("analysis", DOUBTFUL, "no live analysis to compare with")
    if run.differences:
        return Check("analysis", BAD, f"differs from the live one: {'; '.join(run.differences)}")
    return Check("analysis", GOOD, "repeated: identical to the live one, bit for bit")


def origin_of(reader: BagReader) -> dict[str, str]:
    """Return the origin of a run: versions, commit, driver, and the SHA-256 of its files."""
    custom = reader.custom_data
    origin = {key: custom.get(key, "not recorded") for key in ORIGIN}
    versions = _loaded(custom.get("versions", "{}"))
    origin["versions"] = ", ".join(f"{name} {number}" for name, number in versions.items())
    for file in bag_files(reader.path):
        digest = hashlib.sha256()
        with file.open("rb") as data:
            while piece := data.read(1 << 20):
                digest.update(piece)
        origin[f"SHA-256 of {file.name}"] = digest.hexdigest()
    return origin


def _loaded(text: str) -> dict[str, Any]:
    try:
        found = json.loads(text)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def worst(checks: Sequence[Check]) -> str:
    """Return the worst state of some checks."""
    return max((check.state for check in checks), key=[GOOD, DOUBTFUL, BAD].index, default=GOOD)
