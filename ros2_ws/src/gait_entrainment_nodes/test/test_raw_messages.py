# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Bytes of messages, checked against ROS itself and an independent library."""

import math
import struct
from functools import cache

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import WrenchStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty

from gait_entrainment.conventions import EventKind, Side
from gait_entrainment.experiment import Part
from gait_entrainment.gait import Reason, Verdict
from gait_entrainment.robot import Shape
from gait_entrainment_bags import find_definition
from gait_entrainment_msgs import msg
from gait_entrainment_msgs.msg import AnkleRobotState, TorqueProfile
from gait_entrainment_nodes.messaging.raw_messages import MessageTemplate, serialize
from gait_entrainment_nodes.messaging.stamps import header, to_time

derandomized = settings(derandomize=True, deadline=None, max_examples=60)
stamps = st.integers(0, (2**31 - 1) * 10**9)
# ROS strings hold no NUL.
texts = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=12)
doubles = st.floats(allow_nan=False)


@pytest.mark.parametrize(
    ("message", "enums"),
    [
        (msg.Side, [Side]),
        (msg.GaitEvent, [EventKind]),
        (msg.Entrainment, [Verdict, Reason]),
        (msg.ExperimentState, [Part]),
        (msg.Pulse, [Shape]),
    ],
)
def test_constants_of_messages_are_those_of_the_core(message, enums):
    members = {member.name: member.value for enum in enums for member in enum}
    names = [name for name in dir(type(message)) if name.isupper() and name[0] != "_"]
    assert {name: getattr(message, name) for name in names} == members


@cache
def types_of_rosbags(name):
    """Return the types that the rosbags library knows, plus one of ours."""
    store = get_typestore(Stores.ROS2_JAZZY)
    types = get_types_from_msg(find_definition(name).schema_text, name)
    store.register({key: t for key, t in types.items() if key not in store.fielddefs})
    return store


def by_rosbags(message):
    """Serialize with the rosbags library, which pads with zeros."""
    name = "gait_entrainment_msgs/msg/" + type(message).__name__
    store = types_of_rosbags(name)
    stamp = store.types["builtin_interfaces/msg/Time"]
    head = store.types["std_msgs/msg/Header"](
        stamp=stamp(sec=message.header.stamp.sec, nanosec=message.header.stamp.nanosec),
        frame_id=message.header.frame_id,
    )
    values = {}
    for field in message.get_fields_and_field_types():
        value = getattr(message, field)
        if field == "header":
            value = head
        elif field in ("times", "onsets"):
            value = [stamp(sec=t.sec, nanosec=t.nanosec) for t in value]
        elif field == "valid_until":
            value = stamp(sec=value.sec, nanosec=value.nanosec)
        elif field == "torques":
            value = np.array(value, float)
        values[field] = value
    return bytes(store.serialize_cdr(store.types[name](**values), name))


@derandomized
@given(stamps, st.lists(st.tuples(stamps, doubles), max_size=5), st.lists(stamps, max_size=4))
def test_profile_is_what_an_independent_library_writes(instant, pieces, onsets):
    message = TorqueProfile(
        header=header(instant),
        run=3,
        revision=7,
        side=1,
        times=[to_time(t) for t, _ in pieces],
        torques=[torque for _, torque in pieces],
        onsets=[to_time(t) for t in onsets],
        valid_until=to_time(instant),
        last=True,
    )
    assert serialize(message) == by_rosbags(message)


@derandomized
@given(stamps, doubles, texts, st.lists(texts, max_size=3))
def test_state_with_texts_is_what_an_independent_library_writes(instant, torque, frame, faults):
    message = AnkleRobotState(
        header=header(instant), side=1, commanded_torque=torque, angle=torque, faults=faults
    )
    message.header.frame_id = frame
    assert serialize(message) == by_rosbags(message)


@derandomized
@given(texts, st.lists(st.tuples(texts, texts), max_size=4))
def test_nested_sequences_read_back_as_the_same_message(name, values):
    status = DiagnosticStatus(
        level=b"\1", name=name, values=[KeyValue(key=k, value=v) for k, v in values]
    )
    message = DiagnosticArray(header=header(5), status=[status, DiagnosticStatus()])
    data = serialize(message)
    assert data == serialize(deserialize_message(serialize_message(message), DiagnosticArray))
    assert deserialize_message(data, DiagnosticArray) == message


@derandomized
@given(
    st.integers(1, 5).flatmap(
        lambda n: st.tuples(
            arrays.arrays(np.int64, n, elements=stamps),
            arrays.arrays(float, (n, 4), elements=doubles),
            arrays.arrays(float, (n, 4), elements=doubles),
        )
    )
)
def test_filled_template_is_what_ros_serializes(table):
    instants, position, effort = table
    names = ["l_hip", "r_hip", "l_ankle", "r_ankle"]
    template = MessageTemplate(
        JointState(name=names, velocity=[2.5] * 4),
        {"position": 4, "effort": 4},
    )
    messages = list(template.fill(instants, position, effort))
    assert len(messages) == len(instants)
    for k, data in enumerate(messages):
        expected = JointState(
            header=header(int(instants[k])),
            name=names,
            position=position[k].tolist(),
            velocity=[2.5] * 4,
            effort=effort[k].tolist(),
        )
        assert data == serialize(expected)
        assert deserialize_message(data, JointState) == expected


def test_nan_passes_through():
    template = MessageTemplate(JointState(), {"position": 1})
    (data,) = template.fill(np.array([7]), np.array([[math.nan]]))
    assert math.isnan(deserialize_message(data, JointState).position[0])


def test_adjoining_nested_numbers_are_filled():
    template = MessageTemplate(WrenchStamped(), {"wrench.force.x": 3})
    (data,) = template.fill(np.array([7]), np.array([[1.0, 2.0, 3.0]]))
    wrench = deserialize_message(data, WrenchStamped).wrench
    assert (wrench.force.x, wrench.force.y, wrench.force.z) == (1.0, 2.0, 3.0)
    assert wrench.torque.x == 0.0


def test_stamp_is_where_the_recorder_looks_for_it():
    data = serialize(JointState(header=header(12_000_000_034)))
    assert struct.unpack_from("<iI", data, 4) == (12, 34)


def test_a_message_without_fields_has_a_placeholder_octet():
    data = serialize(Empty())
    assert data == b"\x00\x01\x00\x00\x00"
    assert deserialize_message(data, Empty) == Empty()
