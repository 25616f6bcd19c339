# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Holes in the record of a run, by the numbers that its messages carry."""

import random
from pathlib import Path
from typing import Any

import pytest

from gait_entrainment_bags import BagReader
from gait_entrainment_bags.holes import RunRecord
from gait_entrainment_bags.metadata import TopicInfo

PAPER_EXAMPLE = Path(__file__).parents[4] / "bags" / "paper_example"
PROFILES = "/perturbation/torque_profile"
pytestmark = pytest.mark.skipif(not PAPER_EXAMPLE.exists(), reason="the repository is not here")


@pytest.fixture(scope="module")
def profiles() -> tuple[TopicInfo, list[bytes]]:
    """Return the topic of torque profiles in the recorded run, and its messages."""
    with BagReader(PAPER_EXAMPLE) as reader:
        return reader.topics[PROFILES], [m.data for m in reader.messages([PROFILES])]


def record_of(topic: TopicInfo, messages: Any) -> RunRecord:
    record = RunRecord()
    for data in messages:
        record.add(topic, data)
    return record


def test_a_complete_record_has_no_holes(profiles: tuple[TopicInfo, list[bytes]]) -> None:
    assert record_of(*profiles).holes() == []


def test_torque_profiles_out_of_order_are_reported(
    profiles: tuple[TopicInfo, list[bytes]],
) -> None:
    topic, messages = profiles
    swapped = [*messages]
    swapped[20], swapped[21] = messages[21], messages[20]
    assert record_of(topic, swapped).holes() == [
        f"{PROFILES}: the order of 1 torque profiles of run 1"
    ]
    shuffled = random.Random(1).sample(messages, len(messages))
    assert len(record_of(topic, shuffled).holes()) == 1


def test_a_profile_recorded_twice_is_no_hole(profiles: tuple[TopicInfo, list[bytes]]) -> None:
    topic, messages = profiles
    assert record_of(topic, [*messages[:30], *messages[29:]]).holes() == []
