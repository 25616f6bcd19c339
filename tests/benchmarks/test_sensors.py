# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Detectors on public data and on the simulated walker, and the cost of a sample."""

import statistics
import sys
import time
from collections import Counter
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[2] / "ros2_ws/src/gait_entrainment_sensors/test"
sys.path.insert(0, str(TESTS))

from public_data import belt, children, foot_rates, foot_reference  # noqa: E402

from gait_entrainment.conventions import EventKind, Side  # noqa: E402
from gait_entrainment.experiment import GaitError  # noqa: E402
from gait_entrainment.gait import analyze  # noqa: E402
from gait_entrainment.parameters import Variation  # noqa: E402
from gait_entrainment.protocol import Protocol  # noqa: E402
from gait_entrainment.walker import Walker  # noqa: E402
from gait_entrainment_sensors.detection import find_detector  # noqa: E402
from gait_entrainment_sensors.emulated import EmulatedSensor  # noqa: E402
from gait_entrainment_sensors.offline import detect, number  # noqa: E402
from gait_entrainment_sensors.recording import Stream  # noqa: E402
from gait_entrainment_sensors.rehearsal import Sensors, rehearse  # noqa: E402
from gait_entrainment_sensors.scoring import score  # noqa: E402

pytestmark = pytest.mark.benchmark

SEEDS = 100
UPRIGHT = "foot_gyroscope:axis_y=1"
CHAINS = [
    ("treadmill_force", "vertical_force"),
    ("insole_force", "vertical_force"),
    ("foot_switch", "foot_switch"),
    ("foot_gyroscope", UPRIGHT),
    ("shank_gyroscope", "shank_gyroscope:axis_y=1"),
    ("ankle_encoder", "ankle_encoder:strike_share=0.21"),
]


def shown(kind, total):
    return (
        f"{kind.name.lower():11} {total.found:3} of {total.events}, {total.false} false, "
        f"bias {total.bias * 1e3:+5.1f} ms, SD {total.deviation * 1e3:4.1f} ms"
    )


def times(events, kind, side):
    return [e.detection.time for e in events if (e.event.kind, e.event.side) == (kind, side)]


def test_foot_gyroscopes_against_motion_capture():
    reference = foot_reference()
    for text in ("foot_gyroscope", UPRIGHT):
        events, _ = detect(find_detector(text), foot_rates())
        latest = max(e.detection.detected_at - e.detection.time for e in events)
        print(f"\ngaitmap sample, {text}, latency at most {latest * 1e3:.1f} ms")
        for kind in EventKind:
            for sides in ((Side.LEFT,), (Side.RIGHT,), tuple(Side)):
                found = score((reference[kind, s], times(events, kind, s)) for s in sides)
                print(
                    f"{'both' if len(sides) > 1 else sides[0].name.lower():6} {shown(kind, found)}"
                )
    for what, least in (
        ("deleted", strides_left(events, delete=True)),
        ("doubled", strides_left(events)),
    ):
        print(f"right strides left with any single event {what}: at least {least}")


def strides_left(events, *, delete=False):
    """Return the fewest right strides that remain if any one detection is changed."""
    found, fewest = [e.detection for e in events], []
    for place, detection in enumerate(found):
        late = replace(
            detection, time=detection.time + 0.04, detected_at=detection.detected_at + 0.04
        )
        changed = found[:place] + found[place + 1 :] if delete else [*found, late]
        numbered = [e.event for e in number(changed, "")[0]]
        fewest.append(len(analyze(numbered, (), Side.RIGHT).strides))
    return min(fewest)


def test_a_real_belt():
    rows = belt()
    stream = Stream(Side.LEFT, [t for t, _ in rows], [v for _, v in rows])
    events, _ = detect(find_detector("vertical_force"), [stream])
    strikes = times(events, EventKind.HEEL_STRIKE, Side.LEFT)
    strides = [b - a for a, b in pairwise(strikes)]
    print(
        f"\nbelt: {len(strikes)} strikes of 46, strides {min(strides):.3f} to {max(strides):.3f} s"
    )


def test_numbering_of_children():
    total = refused = 0
    for found in children():
        total += len(found)
        refused += len(found) - len(number(found, "")[0])
    print(f"\n50 children, every tenth event lost: {refused} of {total} detections refused")


@pytest.mark.parametrize(("kind", "detector"), CHAINS)
def test_the_default_protocol_through_sensors(kind, detector):
    verdicts, outside, sizes, shifts = Counter(), 0, [], []
    errors = {event: [] for event in EventKind}
    for seed in range(SEEDS):
        protocol = replace(Protocol(), variation=Variation(0.02), seed=seed)
        sensors = Sensors(kind, find_detector(detector), protocol.side, seed=seed)
        try:
            run = rehearse(protocol, sensors)
        except GaitError:  # an unknown gait gets no torque
            verdicts["ended"] += 1
            continue
        seen, exact = (
            a.entrainments[-1].verdict.name.lower() if a.entrainments else "none"
            for a in (run.analysis, run.true_analysis)
        )
        verdicts[seen == exact] += 1
        planned = set(run.train.onsets) if run.train else set()
        outside += sum(onset not in planned for onset in run.onsets)
        for event in EventKind:
            found = score(
                [
                    [e.stamp / 1e9 for e in events if (e.kind, e.side) == (event, side)]
                    for events in (run.truth, run.events)
                ]
                for side in Side
            )
            errors[event] += found.errors
            if event is EventKind.HEEL_STRIKE:
                sizes.append(statistics.median(map(abs, found.errors)))
        pairs = zip(run.analysis.pulses[-1:], run.true_analysis.pulses[-1:], strict=False)
        shifts += [a.phase_lag - b.phase_lag for a, b in pairs if seen == exact == "entrained"]
    print(
        f"\n{kind}, {detector}: verdict as of exact events in {verdicts[True]} of {SEEDS}, "
        f"{verdicts['ended']} ended as if the gait had stopped"
    )
    for event, found in errors.items():
        mean = sum(found) / max(len(found), 1)
        print(f"  {event.name.lower():11} bias {mean * 1e3:+.1f} ms of {len(found)}")
    print(f"  median size of a strike's error: at most {max(sizes, default=0) * 1e3:.1f} ms")
    print(f"  pulses outside the plan: {outside}")
    if shifts:
        print(f"  shift of the last lag of the locked: {sum(shifts) / len(shifts) * 1e3:+.1f} ms")


@pytest.mark.parametrize(("kind", "detector"), CHAINS)
def test_cost_of_a_sample(kind, detector):
    walker, until = Walker(Protocol().walker), 60_000_000_000
    walker.advance(until)
    sensor = EmulatedSensor(kind, Side.RIGHT)
    stamps = sensor.due(until)
    samples = sensor.measure(stamps, walker.sample(stamps), ())
    costs = []
    for _ in range(5):
        instance = find_detector(detector).make(Side.RIGHT)
        begin = time.process_time()
        for stamp, values in samples:
            instance.add(stamp, values)
        costs.append((time.process_time() - begin) / len(samples))
    print(f"\n{kind}, {detector}: {min(costs) * 1e6:.2f} microseconds a sample and foot")
