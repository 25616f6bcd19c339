# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""What every detector guarantees for any samples: counts, no exceptions, no late events."""

import math
import sys
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from walks import fed, foot_rate, force, sampled, times

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.errors import EntrainmentError
from gait_entrainment_sensors import detection
from gait_entrainment_sensors.detection import Detector, detector_names, find_detector
from gait_entrainment_sensors.foot_gyroscope import FootGyroscopeDetector
from gait_entrainment_sensors.vertical_force import VerticalForceDetector

NAMES = ["ankle_encoder", "foot_gyroscope", "foot_switch", "shank_gyroscope", "vertical_force"]
UNTIL = 12.0


def walk():
    return sampled(lambda t: (force(t),), UNTIL)


def test_detectors_are_found_by_name_with_options():
    assert [name for name in detector_names() if name in NAMES] == NAMES
    chosen = find_detector("vertical_force:strike_force=50,toe_off_bias=0.004")
    assert (chosen.settings.strike_force, chosen.settings.toe_off_bias) == (50.0, 0.004)
    assert isinstance(chosen.make(Side.LEFT), VerticalForceDetector)


@pytest.mark.parametrize("name", NAMES)
def test_each_documents_its_latency_uncertainty_and_failures(name):
    detector = find_detector(name).make(Side.RIGHT)
    for word in ("Latency:", "Uncertainty:", "Fails:"):
        assert word in type(detector).__doc__
    assert 0.0 <= detector.latency < 0.2
    assert detector.signals
    assert detector.name == name


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nonsense", "allowed: ankle_encoder"),
        ("vertical_force:nonsense=1", "nonsense"),
        ("vertical_force:strike_force=-3", "strike_force"),
        ("foot_gyroscope:cutoff=x", "cutoff"),
    ],
)
def test_an_invalid_detector_is_refused_in_one_line(text, words):
    with pytest.raises(EntrainmentError, match=words) as refused:
        find_detector(text)
    assert "\n" not in str(refused.value)


class BrokenConstructor(FootGyroscopeDetector):
    def _restart(self):  # called by the constructor
        raise KeyError("calibration")


class WithoutSettings(FootGyroscopeDetector):
    Settings = None


@pytest.mark.parametrize(
    ("loaded", "words"),
    [
        ("1 / 0", "ZeroDivisionError"),
        ("raise SystemExit(3)", r"SystemExit\(3\)"),
        ("Detector = (", "SyntaxError"),
        ("", "AttributeError"),
        ("class Detector: pass", "is not a Detector"),
        (BrokenConstructor, "KeyError.*calibration"),
        (WithoutSettings, "TypeError.*dataclass"),
    ],
)
def test_any_failure_to_load_an_external_detector_is_reported(
    monkeypatch, tmp_path, loaded, words
):
    module = tmp_path.name  # unique to this test
    if isinstance(loaded, str):
        (tmp_path / f"{module}.py").write_text(loaded)
        monkeypatch.syspath_prepend(tmp_path)
    else:
        monkeypatch.setitem(sys.modules, module, SimpleNamespace(Detector=loaded))
    odd = {"odd": f"{module}:Detector"}
    monkeypatch.setattr(detection, "detector_names", lambda: odd)
    with pytest.raises(EntrainmentError, match=rf"odd \({module}:Detector\) .*{words}") as refused:
        find_detector("odd")
    assert "\n" not in str(refused.value)


def test_a_measured_bias_is_subtracted():
    samples = walk()
    plain = fed(VerticalForceDetector(Side.RIGHT), samples)
    settings = VerticalForceDetector.Settings(toe_off_bias=0.01, heel_strike_bias=-0.02)
    moved = fed(VerticalForceDetector(Side.RIGHT, settings), samples)
    for a, b in zip(plain, moved, strict=True):
        assert b.time - a.time == pytest.approx(-0.01 if a.kind else 0.02)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_values_that_are_not_finite_are_skipped_and_reported(bad):
    samples = walk()
    samples[500:505] = [(time, (bad,)) for time, _ in samples[500:505]]
    detector = VerticalForceDetector(Side.RIGHT)
    strikes = times(fed(detector, samples), EventKind.HEEL_STRIKE)
    assert len(strikes) >= 10
    assert detector.counts.not_finite == 5
    assert any("not numbers" in line for line in detector.troubles())


def test_a_dead_sensor_is_reported():
    detector = VerticalForceDetector(Side.RIGHT)
    fed(detector, walk()[:1000])
    assert detector.troubles(now=5.02) == ()
    assert "no sample for 1.0" in detector.troubles(now=6.0)[0]
    assert "no sample yet" in VerticalForceDetector(Side.RIGHT).troubles(now=1.0)[0]


def test_a_dropout_is_counted_and_contains_no_events():
    samples = walk()
    detector = VerticalForceDetector(Side.RIGHT)
    found = fed(detector, samples[:500] + samples[700:])
    assert detector.counts.dropouts == 1
    inside = samples[500][0], samples[699][0]
    assert not [d for d in found if inside[0] < d.time < inside[1]]


def test_a_clock_that_goes_back_or_jumps_is_counted():
    samples = walk()
    detector = VerticalForceDetector(Side.RIGHT)
    fed(detector, [*samples[:500], samples[499], *samples[500:1500], *samples[500:]])
    assert detector.counts.clock_back == 1
    assert detector.counts.clock_jumps == 1
    assert detector.counts.dropouts == 0


def test_a_constant_signal_is_counted_once():
    detector = FootGyroscopeDetector(Side.RIGHT, FootGyroscopeDetector.Settings(axis_y=1.0))
    fed(detector, sampled(lambda _: (0.0, 0.1, 0.0), UNTIL))
    assert detector.counts.constant == 1


def test_a_signal_without_events_is_reported():
    contacts = sampled(lambda t: ((force(t) > 0) * 0.5, 0.0), UNTIL)  # neither closed nor open
    detector = find_detector("foot_switch:open_below=0.1,closed_above=0.55").make(Side.RIGHT)
    detector.reached = 0.0
    assert fed(detector, contacts) == []
    assert detector.troubles() == (
        "right foot_switch: no event yet: if the person walks, check sensor and settings",
    )


SAMPLE = st.tuples(
    st.floats(-1.0, 1.0) | st.just(0.005) | st.floats(),
    st.lists(st.floats(), min_size=3, max_size=3),
)


@settings(max_examples=40, deadline=None)
@given(samples=st.lists(SAMPLE, max_size=80), name=st.sampled_from(NAMES))
def test_samples_never_cause_an_exception_or_a_late_event(samples, name):
    detector: Detector = find_detector(name).make(Side.LEFT)
    time, interval = 0.0, 0.0
    for step, values in samples:
        time = time + step if abs(step) < 10 else step
        for found in detector.add(time, values[: len(detector.signals)]):
            interval = detector._time - detector._before
            assert found.detected_at - found.time <= detector.latency + interval + 1e-9
        time = time if math.isfinite(time) else 0.0
    detector.troubles(now=time)


@settings(max_examples=15, deadline=None)
@given(cut=st.integers(1, 2399))
def test_detection_is_causal(cut):
    samples = sampled(lambda t: (0.0, foot_rate(t), 0.0), UNTIL)
    upright = FootGyroscopeDetector.Settings(axis_y=1.0)
    whole = fed(FootGyroscopeDetector(Side.RIGHT, upright), samples)
    part = fed(FootGyroscopeDetector(Side.RIGHT, upright), samples[:cut])
    assert part == [d for d in whole if d.detected_at <= samples[cut - 1][0]]
