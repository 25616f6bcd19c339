# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A recorded bag at any time, checked against what is known of the committed bag."""

import contextlib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment_bags import BagError, BagReader, BagWriter
from gait_entrainment_page.bag_source import BagSource

BAG = Path(__file__).parents[4] / "bags/paper_example"


@pytest.fixture(scope="module")
def source():
    opened = BagSource(BAG)
    yield opened
    opened.close()


def test_the_end_shows_the_outcome(source):
    source.show(source.end)
    view = source.view
    assert (view.part, view.state.stride, view.state.strides) == ("finished", 80, 80)
    assert view.verdict_words()[0] == "entrained since stride 29"
    assert view.lag().startswith("-57 ms")
    assert view.stances[-1] == pytest.approx(0.345, abs=2e-3)
    assert len(view.legs) == 4
    assert source.lacking == []


@settings(max_examples=8, deadline=None)
@given(st.floats(0.0, 1.0))
def test_any_time_shows_the_strides_completed_by_then(source, share):
    time = source.start + round(share * (source.end - source.start))
    source.show(time)
    strides = [number for number, _ in source.view.strides]
    assert strides == list(range(1, len(strides) + 1))
    # A stride of the committed walk lasts 1.88 to 1.94 s.
    assert abs(len(strides) - (time - source.start) / 1.91e9) < 2
    assert source.view.now == time


def test_only_the_latest_of_the_requested_times_is_shown(source, monkeypatch):
    @contextlib.contextmanager
    def waited_for():
        with monkeypatch.context() as meanwhile:
            meanwhile.setattr(source, "_lock", contextlib.nullcontext())
            source.show(source.end)
        yield

    monkeypatch.setattr(source, "_lock", waited_for())
    source.show(source.start)
    assert source.view.now == source.end


def without(path, out, *topics):
    """Copy a bag without some topics."""
    with BagReader(path) as bag, BagWriter(out, ros_distro="jazzy") as writer:
        kept = [t for n, t in bag.topics.items() if not n.endswith(topics)]
        for topic in kept:
            writer.add_topic(topic)
        for message in bag.messages([topic.name for topic in kept]):
            writer.write(message.topic, message.data, message.log_time, message.publish_time)
    return out


def test_a_bag_without_states_reports_what_is_missing(tmp_path):
    bag = without(BAG, tmp_path / "bag", "experiment/state", "perturbator/state", "joint_states")
    source = BagSource(bag)
    assert source.lacking == ["parts of the protocol", "states of the robot", "joint angles"]
    assert source.view.measured() == "nothing heard from the robot"
    assert source.view.part == "waiting"
    assert len(source.view.strides) == 80
    source.close()


def test_a_bag_of_something_else_is_refused(tmp_path):
    bag = without(BAG, tmp_path / "bag", "gait_events")
    with pytest.raises(BagError, match="not a run of this project: no gait events"):
        BagSource(bag)
