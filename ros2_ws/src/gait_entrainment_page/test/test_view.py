# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The view: what it shows of a run, bounded histories, and what it must never show."""

import json
import math
from types import SimpleNamespace as Message

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment.conventions import NANOSECONDS_PER_SECOND
from gait_entrainment_page.charts import lag_chart, period_chart, torque_chart
from gait_entrainment_page.view import READINGS_DRAWN, STALE_AFTER, STRIDES_SHOWN, View

PERIOD = NANOSECONDS_PER_SECOND
LEFT, RIGHT, STRIKE, TOE_OFF = 0, 1, 0, 1


def stamp(at):
    return Message(sec=at // NANOSECONDS_PER_SECOND, nanosec=at % NANOSECONDS_PER_SECOND)


def header(at):
    return Message(stamp=stamp(at))


def state(stride, strides, phase=2, run=1):
    return Message(
        header=header(stride * PERIOD), run=run, phase=phase, stride=stride, strides=strides,
        measured_period=1.0, pulse_period=0.98, blocks=1, block=1, block_name="", message="",
    )  # fmt: skip


def event(at, kind, side):
    return Message(
        header=header(at), run=1, kind=kind, side=side, step=1, source="s", detector="",
        uncertainty=0.0, detected_at=stamp(0),
    )  # fmt: skip


def robot(at, commanded, measured, faults=(), side=RIGHT):
    return Message(
        header=header(at), run=1, side=side, status=1, commanded_torque=commanded,
        measured_torque=measured, angle=0.0, faults=list(faults),
    )  # fmt: skip


def walk(view, first, last, strides, readings=20, height=10.0, period=PERIOD):
    """Walk strides of one second: toe-off at 0.6 s, after a double stance of 0.2 s."""
    for number in range(first, last + 1):
        start = number * period
        view.take("gait_events", event(start, STRIKE, RIGHT))
        view.take("gait_events", event(start + period * 4 // 10, STRIKE, LEFT))
        view.take("gait_events", event(start + period * 6 // 10, TOE_OFF, RIGHT))
        for reading in range(readings):
            torque = height if reading == readings // 2 else 0.0
            at = start + period * reading // readings
            view.take("perturbator/state", robot(at, torque, torque / 2))
        view.take(
            "gait/pulse_phases",
            Message(header=header(start), run=1, stride=number, phase_lag=-0.1),
        )
        end, seconds = start + period, period / NANOSECONDS_PER_SECOND
        stride = Message(header=header(end), run=1, side=RIGHT, number=number, period=seconds)
        stride.start = stamp(start)
        view.take("gait/strides", stride)
        view.take("experiment/state", state(number, strides))


CHARTS = (period_chart, lag_chart, torque_chart)


def size(view):
    return sum(len(json.dumps(chart(view))) for chart in CHARTS)


def test_ten_thousand_strides_take_no_more_space_than_300():
    view = View()
    walk(view, 1, 300, 10_000)
    before = size(view)
    walk(view, 301, 10_000, 10_000, readings=2)
    assert len(view.strides) == len(view.lags) == STRIDES_SHOWN
    assert view.strides[-1] == (10_000, 1.0)
    assert size(view) < 1.1 * before
    assert view.time_left() == 0.0


def test_the_last_stride_and_its_double_stance_are_extracted():
    view = View()
    walk(view, 1, 3, 10)
    assert view.torque[0][0] == 0.0
    assert view.torque[-1][0] == pytest.approx(1.0)
    assert max(commanded for _, commanded, _ in view.torque) == 10.0
    assert max(measured for _, _, measured in view.torque) == 5.0
    assert view.toe_off == pytest.approx(0.6)
    assert view.double_stance == pytest.approx(0.2)
    assert view.time_left() == pytest.approx(7.0)
    assert "-100 ms = -10.0 % of the stride" in view.lag()
    area = lag_chart(view)["series"][0]["markArea"]["data"][0]
    assert (area[0]["yAxis"], area[1]["yAxis"]) == (pytest.approx(-200.0), 0)


def test_dense_readings_are_thinned():
    view = View()
    walk(view, 1, 2, 10, readings=2000)
    assert len(view.torque) <= READINGS_DRAWN + 2


def test_torque_that_was_not_measured_is_never_shown_as_zero():
    view = View()
    assert "0" not in view.measured()
    view.take("perturbator/state", robot(PERIOD, 0.0, math.nan))
    assert view.measured() == "not measured"
    view.take("perturbator/state", robot(2 * PERIOD, 0.0, -0.001))
    assert view.measured() == "+0.00 N m"


def test_both_ankles_are_shown_if_they_differ():
    view = View()
    walk(view, 1, 1, 10)
    for side, torque, faults in ((LEFT, 9.0, ("too much torque",)), (RIGHT, 0.0, ())):
        view.take("perturbator/state", robot(2 * PERIOD, 0.0, torque, faults, side))
    assert view.measured() == "left +9.00 N m, right +0.00 N m"
    assert view.faults() == "left too much torque, right none"
    assert dict(view.robot_words())["state"] == "active"
    # The chart shows the leg whose strides are counted.
    view.take("perturbator/state", robot(2 * PERIOD + 1, 7.0, 7.0, (), LEFT))
    assert view.pushes
    walk(view, 2, 2, 10, readings=2, height=3.0)
    assert max(commanded for _, commanded, _ in view.torque) == 3.0


def test_an_old_torque_measurement_is_shown_with_its_age():
    now = 100.0
    view = View(clock=lambda: now)
    view.take("perturbator/state", robot(PERIOD, 9.0, 9.0))
    assert view.measured() == "+9.00 N m"
    now = 107.0
    assert view.measured() == "+9.00 N m, 7 s ago"
    recorded = View()
    recorded.take("perturbator/state", robot(PERIOD, 9.0, 9.0))
    walk(recorded, 5, 5, 10, readings=0)  # across a hole in the record
    assert recorded.measured() == "+9.00 N m, 5 s ago"


def test_a_simulated_torque_is_marked_as_such_in_each_run():
    view = View()
    setup = Message(
        header=header(0), run=1, side=RIGHT, driver="ideal", armed_by="", watchdog="",
        limit_names=["torque"], limits=[30.0],
    )  # fmt: skip
    for _ in range(2):  # the second has the same number, and its robot reports first
        view.take("perturbator/setup", setup)
        view.take("experiment/state", state(0, 5, phase=1))
        view.take("perturbator/state", robot(PERIOD, 0.0, 0.0))
        assert "simulated" in view.measured()
        assert dict(view.robot_words())["limits"] == "torque 30 N m"
        walk(view, 1, 5, 5)


def test_another_run_starts_empty_even_from_another_command():
    view = View()
    walk(view, 1, 5, 10)
    view.take("experiment/state", state(0, 20, phase=1))  # another run of the same number
    assert list(view.strides) == []
    walk(view, 1, 5, 20)
    view.take("experiment/state", state(0, 20, phase=1, run=2))
    assert list(view.strides) == []
    view.take("gait/strides", Message(run=1))  # from the previous run, delayed
    assert list(view.strides) == []
    walk(view, 1, 2, 20)  # of another command, which counts its own runs
    assert len(view.strides) == 1  # from its first state on
    trouble = Message(header=header(0), run=1, message="refused: 12 N m")
    view.take("experiment/state", state(0, 20, phase=5))
    view.take("perturbator/trouble", trouble)
    assert list(view.troubles) == ["refused: 12 N m"]
    view.take("experiment/state", state(0, 20, phase=1))
    assert list(view.troubles) == []


def test_a_lag_is_shown_with_its_reference_or_as_unknown():
    view = View()
    walk(view, 1, 2, 10)
    lag = Message(header=header(PERIOD), run=1, stride=2, phase_lag=-0.1, toe_off=stamp(0))
    view.take("gait/pulse_phases", lag)
    assert lag_chart(view)["series"][0]["name"].endswith("onset minus heel strike")
    lag.phase_lag = math.nan
    view.take("gait/pulse_phases", lag)
    assert view.lag() == "unknown: no heel strike near"


def everything(view):
    """Return all that the page shows of a view, blinded or not."""
    words = (view.part_words(), view.measured(), view.pushes, view.time_left())
    return *words, view.robot_words(), view.sensor_words()


def conditioned(torque, lag, verdict, name, period=PERIOD, *, blinded, **robot_options):
    """Return the view of a run with past pulses of this torque and one under way."""
    view = View(blinded=blinded)
    view.take(
        "perturbator/setup",
        Message(header=header(0), run=1, side=RIGHT, driver="odrive_can", armed_by="A",
                watchdog="", limit_names=["torque", "rate"], limits=[30.0, abs(torque) / 0.01]),
    )  # fmt: skip
    walk(view, 1, 3, 10, height=torque, period=period)
    at = 4 * period
    view.take("gait/pulse_phases", Message(header=header(at), run=1, stride=3, phase_lag=lag))
    result = Message(header=header(at), run=1, verdict=verdict, reason=0, drift=lag, window=10)
    result.drift_interval = result.pulse_period = result.mean_period = lag
    result.entrained_since_stride = 2
    view.take("gait/entrainment", result)
    now = state(3, 10)
    now.pulse_period, now.blocks, now.block_name = 1.0 + lag, 2, name
    view.take("experiment/state", now)
    view.take("perturbator/state", robot(at, torque, 0.9 * torque, **robot_options))
    return view


CONDITIONS = st.tuples(
    st.floats(-50, 50), st.floats(-0.5, 0.5), st.integers(0, 4), st.sampled_from(["sham", "real"]),
    st.integers(PERIOD * 97 // 100, PERIOD * 103 // 100),
)  # fmt: skip


@settings(derandomize=True, deadline=None, max_examples=25)
@given(CONDITIONS, CONDITIONS)
def test_a_blinded_operator_sees_the_same_whatever_the_condition(one, other):
    views = [conditioned(*each, blinded=True) for each in (one, other)]
    assert everything(views[0]) == everything(views[1])
    assert "30 N m" in dict(views[0].robot_words())["limits"]


def test_an_operator_who_is_not_blinded_sees_the_condition():
    sham, real = (conditioned(t, 0.1, 1, str(t), blinded=False) for t in (0.5, 10.0))
    differs = [one != other for one, other in zip(everything(sham), everything(real), strict=True)]
    assert differs == [True, True, False, False, True, False]
    assert torque_chart(sham) != torque_chart(real)


def test_a_blinded_operator_also_sees_the_torque_after_a_fault():
    view = conditioned(10.0, 0.1, 1, "b", blinded=True, faults=["too much torque"])
    assert view.measured() == "+9.00 N m"
    assert ("faults", "too much torque") in view.robot_words()


def test_a_node_that_falls_silent_is_shown_as_stale():
    now = 100.0
    view = View(clock=lambda: now)
    status = Message(name="ns/walker_sim: state", level=b"\0", message="ready", values=[])
    view.take_diagnostics(Message(status=[status]))
    now = 101.0
    assert view.node_words() == [("ns/walker_sim", "ok", "ready")]
    now = 100.0 + STALE_AFTER + 1
    assert view.node_words() == [("ns/walker_sim", "stale", "silent for 6 s")]
    status.name, status.level, status.message = "camera: exposure", b"\2", "dark"
    fine = Message(name="camera: temperature", level=b"\0", message="fine", values=[])
    view.take_diagnostics(Message(status=[status, fine]))  # parts of another node: all are shown
    assert [level for _, level, _ in view.node_words()] == ["error", "ok", "stale"]


VALUES = st.floats()
KINDS = st.sampled_from(["event", "robot", "stride", "state", "verdict"])


@given(st.lists(st.tuples(KINDS, VALUES, VALUES), max_size=60))
def test_any_messages_can_be_shown(messages):
    view = View()
    for number, (kind, one, other) in enumerate(messages, start=1):
        at = number * PERIOD
        if kind == "event":  # valid and invalid kinds and sides
            view.take("gait_events", event(at, number % 3, number % 4))
        elif kind == "robot":
            view.take("perturbator/state", robot(at, one, other, side=number % 3))
        elif kind == "state":
            view.take("experiment/state", state(number % 7, 7, phase=number % 8))
        elif kind == "verdict":
            result = Message(header=header(at), run=1, verdict=number % 6, reason=number % 10)
            result.drift = one
            result.drift_interval = result.pulse_period = result.mean_period = other
            result.entrained_since_stride = result.window = number
            view.take("gait/entrainment", result)
        else:
            message = Message(header=header(at), run=1, side=number % 3, number=number)
            message.start, message.period = stamp(at - PERIOD), one
            view.take("gait/strides", message)
    assert view.part
    assert view.lag()
    assert view.verdict_words()
    assert view.robot_words()
    assert view.sensor_words()
    size(view)
