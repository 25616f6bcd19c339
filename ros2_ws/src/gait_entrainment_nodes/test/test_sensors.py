# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Values of emulated sensors survive their message; a signal without a message is an error."""

import pytest
from rclpy.serialization import deserialize_message

from gait_entrainment.conventions import Side
from gait_entrainment.errors import UsageError
from gait_entrainment_bags.messages import nanoseconds_of
from gait_entrainment_nodes.messaging.sensors import SensorWriter
from gait_entrainment_nodes.messaging.topics import sensor_topics
from gait_entrainment_sensors.detection import detector_names, find_detector
from gait_entrainment_sensors.emulated import KINDS
from gait_entrainment_sensors.sources import ENCODER, FOOT, SHANK, source_of


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("side", Side)
def test_a_detector_reads_what_the_sensor_wrote(kind, side):
    signals, _ = KINDS[kind]
    source = source_of(kind, signals)
    values = [tuple(float((k + n) % 2) for k, _ in enumerate(signals)) for n in range(3)]
    stamps = [10**18 + n for n in range(3)]
    written = SensorWriter(source, side, signals).write(list(zip(stamps, values, strict=True)))
    read = source.reader(signals)
    for data, stamp, expected in zip(written, stamps, values, strict=True):
        message = deserialize_message(data, sensor_topics(source)[side].type)
        assert nanoseconds_of(message.header.stamp) == stamp
        assert read(message) == expected
    assert not SensorWriter(source, side, signals).write([])


@pytest.mark.parametrize("name", detector_names())
def test_each_detector_has_a_topic_for_each_foot(name):
    detector = find_detector(name).make(Side.LEFT)
    source = source_of(detector.name, detector.signals)
    assert ["left" in topic for topic in source.topics] == [True, False]


def test_inertial_sensors_are_distinguished_by_name_and_unknown_signals_are_refused():
    gyroscope = ("gyro_y",)
    assert source_of("my_gyroscope", gyroscope) is FOOT
    assert source_of("shank_gyroscope", gyroscope) is SHANK
    with pytest.raises(UsageError, match="mine: no sensor's message carries gyro_y, heel"):
        source_of("mine", ("gyro_y", "heel"))
    with pytest.raises(IndexError):  # a joint state without joints
        ENCODER.reader(("angle",))(sensor_topics(ENCODER)[0].type())
    unworn = sensor_topics(ENCODER)[0].type(position=[0.3])  # not on a robot, so without torque
    assert ENCODER.reader(("angle", "torque"))(unworn) == (0.3, 0.0)
