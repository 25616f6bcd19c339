# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

import math
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from gait_entrainment_bags import INFINITE, QosProfile, UnreadableBagError
from gait_entrainment_bags.metadata import (
    QOS_POLICIES,
    BagDescription,
    FileInformation,
    offered_qos_text,
    parse_qos_profiles,
)

durations = st.integers(0, INFINITE)
profiles = st.builds(
    QosProfile,
    **{
        name: st.sampled_from(list(spellings.values())) for name, spellings in QOS_POLICIES.items()
    },
    depth=st.integers(0, 2**31 - 1),
    deadline=durations,
    lifespan=durations,
    liveliness_lease_duration=durations,
    avoid_ros_namespace_conventions=st.booleans(),
)


@settings(derandomize=True, deadline=None)
@given(st.lists(profiles, max_size=3))
def test_qos_survives_its_text(found: list[QosProfile]) -> None:
    assert parse_qos_profiles(offered_qos_text(found), "here") == tuple(found)


def test_an_unlimited_duration_is_written_as_ros_does() -> None:
    assert QosProfile().as_map()["deadline"] == {"sec": 9223372036, "nsec": 854775807}


def test_policies_may_be_integers_as_before_version_9() -> None:
    text = """
- history: 3
  depth: 0
  reliability: 1
  durability: 2
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: 1
  liveliness_lease_duration: {sec: 1, nsec: 5}
  avoid_ros_namespace_conventions: false
"""
    (profile,) = parse_qos_profiles(text, "here")
    assert profile == QosProfile(
        history="unknown", depth=0, liveliness_lease_duration=1_000_000_005
    )


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ("a: 1", "not a YAML sequence"),
        ("- 1", "not a map"),
        ("- {history: keep_last}", "'depth' is missing"),
        ("- [", "not valid YAML"),
        ("[" * 100_000, "nested more than|maximum nesting depth"),
        ([QosProfile().as_map() | {"deadline": {"sec": math.inf, "nsec": 0}}], "infinity"),
        (3, "not a YAML sequence"),
        ([QosProfile().as_map() | {"history": "sometimes"}], "sometimes"),
        ([QosProfile().as_map() | {"reliability": 77}], "77"),
        ([QosProfile().as_map() | {"deadline": 3}], "here"),
        ("[" * 5000, "not valid YAML"),
    ],
)
def test_errors_in_qos_profiles_are_reported(value: Any, reason: str) -> None:
    with pytest.raises(UnreadableBagError, match=reason):
        parse_qos_profiles(value, "here")


def test_interrupted_write_leaves_the_previous_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    BagDescription((), (FileInformation("a_0.mcap", 5, 9, 2),), ros_distro="jazzy").write(tmp_path)
    before = (tmp_path / "metadata.yaml").read_bytes()

    def fail(_: int) -> None:
        raise OSError("power lost")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(OSError, match="power lost"):
        BagDescription((), ()).write(tmp_path)
    assert (tmp_path / "metadata.yaml").read_bytes() == before
    found = yaml.safe_load(before)["rosbag2_bagfile_information"]
    assert found["starting_time"] == {"nanoseconds_since_epoch": 5}
    assert found["duration"] == {"nanoseconds": 4}
