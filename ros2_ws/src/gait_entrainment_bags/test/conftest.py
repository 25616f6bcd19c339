# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Messages, topics and bags shared by the tests in this folder."""

import os
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from gait_entrainment_bags import BagWriter, QosProfile, TopicInfo, find_definition

TYPESTORE = get_typestore(Stores.ROS2_JAZZY)


@pytest.fixture(scope="session")
def prefixes() -> list[Path]:
    """Return the prefixes in AMENT_PREFIX_PATH and that of the Python that runs the tests."""
    found = [*os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep), sys.prefix]
    return [Path(prefix) for prefix in found if prefix]


@pytest.fixture(scope="session")
def topic(prefixes: list[Path]) -> Callable[..., TopicInfo]:
    """Return a function that describes a topic whose message type is installed."""

    def make(name: str, type_name: str, *qos: QosProfile) -> TopicInfo:
        found = find_definition(type_name, prefixes)
        return TopicInfo(name, type_name, found.schema_text, found.type_hash, qos)

    return make


@pytest.fixture(scope="session")
def typestore() -> Any:
    """Return the message types of `rosbags`, an independent implementation of ROS 2 formats."""
    return TYPESTORE


@cache
def _type(name: str) -> Any:
    return TYPESTORE.types[name]


@pytest.fixture(scope="session")
def joint_state() -> Callable[[int, list[float]], bytes]:
    """Return a function that serializes a JointState with one joint per position."""

    def make(stamp: int, positions: list[float]) -> bytes:
        header = _type("std_msgs/msg/Header")(
            _type("builtin_interfaces/msg/Time")(*divmod(stamp, 10**9)), ""
        )
        names = ["l_hip", "r_hip", "l_ankle", "r_ankle"][: len(positions)]
        values = np.array(positions, dtype=float)
        message = _type("sensor_msgs/msg/JointState")(header, names, values, 2 * values, -values)
        return bytes(TYPESTORE.serialize_cdr(message, "sensor_msgs/msg/JointState"))

    return make


@pytest.fixture(scope="session")
def clock() -> Callable[[int], bytes]:
    """Return a function that serializes a Clock."""

    def make(stamp: int) -> bytes:
        time = _type("builtin_interfaces/msg/Time")(*divmod(stamp, 10**9))
        message = _type("rosgraph_msgs/msg/Clock")(time)
        return bytes(TYPESTORE.serialize_cdr(message, "rosgraph_msgs/msg/Clock"))

    return make


@pytest.fixture(scope="session")
def small_bag(tmp_path_factory: pytest.TempPathFactory, clock: Callable[[int], bytes]) -> Path:
    """Write a bag with four messages in two chunks, as small as the format allows."""
    folder = tmp_path_factory.mktemp("bags") / "small"
    with BagWriter(folder, ros_distro="jazzy", custom_data={"key": "value"}) as writer:
        for name in ("/a", "/b"):
            text = "# C\nT clock\n" + "=" * 80 + "\nMSG: p/T\nint32 sec\nuint32 nanosec\n"
            writer.add_topic(TopicInfo(name, "p/msg/C", text, "RIHS01_" + "0" * 64))
        writer.write("/a", clock(1), 1, 1)
        writer.write("/b", clock(2), 2, 2)
        writer.flush()
        writer.write("/a", clock(3), 3, 3)
        writer.write("/a", clock(4), 4, 4)
    return folder
