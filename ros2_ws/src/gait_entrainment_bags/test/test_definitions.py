# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

from pathlib import Path

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from gait_entrainment_bags import DefinitionMissingError, find_definition
from gait_entrainment_bags.definitions import missing_definitions

# Printed by `ros2 topic info --verbose` of ROS 2 Jazzy.
PUBLISHED_HASHES = {
    "sensor_msgs/msg/JointState": (
        "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"
    ),
    "geometry_msgs/msg/WrenchStamped": (
        "RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77"
    ),
    "rosgraph_msgs/msg/Clock": (
        "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"
    ),
    "diagnostic_msgs/msg/DiagnosticArray": (
        "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"
    ),
}


@pytest.mark.parametrize("type_name", PUBLISHED_HASHES)
def test_hash_equals_the_published_one(type_name: str, prefixes: list[Path]) -> None:
    assert find_definition(type_name, prefixes).type_hash == PUBLISHED_HASHES[type_name]


@pytest.mark.parametrize("type_name", PUBLISHED_HASHES)
def test_another_reader_gets_the_same_hash_from_the_text(
    type_name: str, prefixes: list[Path]
) -> None:
    found = find_definition(type_name, prefixes)
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(found.schema_text, type_name))
    assert store.hash_rihs01(type_name) == found.type_hash


def test_separators_are_those_of_rosbag2(tmp_path: Path) -> None:
    messages = tmp_path / "share" / "p" / "msg"
    messages.mkdir(parents=True)
    (messages / "A.msg").write_text("B b  # [N m]\nq/C[<=3] c\nstring<=5 s\nuint8 LEFT=0\n")
    (messages / "B.msg").write_text("q/C c\n")
    (messages / "A.json").write_text(
        '{"type_hashes": [{"type_name": "p/msg/A", "hash_string": "RIHS01_1"}]}'
    )
    other = tmp_path / "other" / "share" / "q" / "msg"
    other.mkdir(parents=True)
    (other / "C.msg").write_text("float64 x\n")

    found = find_definition("p/msg/A", [tmp_path, tmp_path / "other"])

    line = "=" * 80
    assert found.schema_text == (
        "B b  # [N m]\nq/C[<=3] c\nstring<=5 s\nuint8 LEFT=0\n"
        f"\n{line}\nMSG: p/B\nq/C c\n"
        f"\n{line}\nMSG: q/C\nfloat64 x\n"
    )
    assert found.type_hash == "RIHS01_1"


def test_definition_of_every_installed_message_is_complete(prefixes: list[Path]) -> None:
    found = 0
    for prefix in prefixes:
        for path in prefix.glob("share/*/msg/*.msg"):
            type_name = f"{path.parts[-3]}/msg/{path.stem}"
            text = find_definition(type_name, prefixes).schema_text
            assert missing_definitions(type_name, text) == []
            found += 1
    assert found > 100


def test_definition_of_a_service_message_comes_from_its_type_description(
    prefixes: list[Path],
) -> None:
    found = find_definition("std_srvs/srv/SetBool_Event", prefixes)
    types = get_types_from_msg(found.schema_text, "std_srvs/srv/SetBool_Event")
    request = types["std_srvs/msg/SetBool_Request"]
    assert [name for name, _ in request[1]] == ["data"]
    assert "std_srvs/SetBool_Request[<=1] request" in found.schema_text
    assert found.type_hash.startswith("RIHS01_")


@pytest.mark.parametrize(
    "type_name", ["nothing/msg/Here", "std_srvs/srv/Trigger_Nothing", "JointState", "a/b/c/d"]
)
def test_types_that_are_not_installed_are_named(type_name: str, prefixes: list[Path]) -> None:
    with pytest.raises(DefinitionMissingError, match=type_name):
        find_definition(type_name, prefixes)


def test_without_prefixes_the_environment_is_used(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    with pytest.raises(DefinitionMissingError, match=str(tmp_path)):
        find_definition("sensor_msgs/msg/JointState")


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"type_hashes": 3}', "\ufffe"])
def test_broken_type_description_is_reported(text: str, tmp_path: Path) -> None:
    messages = tmp_path / "share" / "p" / "msg"
    messages.mkdir(parents=True)
    (messages / "A.msg").write_text("float64 x\n")
    (messages / "A.json").write_text(text)
    with pytest.raises(DefinitionMissingError, match="p/msg/A"):
        find_definition("p/msg/A", [tmp_path])
