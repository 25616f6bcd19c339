# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Older messages keep all their fields; a message with other fields is not converted."""

from rclpy.serialization import deserialize_message

from gait_entrainment_bags import TopicInfo, find_definition
from gait_entrainment_bags.definitions import SEPARATOR
from gait_entrainment_msgs.msg import GaitEvent
from gait_entrainment_nodes.messaging.older_messages import converter_of
from gait_entrainment_nodes.messaging.raw_messages import serialize
from gait_entrainment_nodes.messaging.stamps import header

ADDED = ("detected_at", "uncertainty", "detector")
TYPE = "gait_entrainment_msgs/msg/GaitEvent"


def topic(*lines, of_type=TYPE):
    """Return a topic of events as they were before some fields were added, plus other lines."""
    text = find_definition(TYPE).schema_text.splitlines()
    kept = [line for line in text if not any(f" {name} " in line for name in ADDED)]
    return TopicInfo(
        name="/gait_events",
        type=of_type,
        schema_text="\n".join([*lines, *kept]),
        type_hash="older",
    )


def test_recorded_fields_are_kept_and_fields_added_since_are_empty():
    event = GaitEvent(header=header(7 * 10**9 + 5), run=3, kind=1, side=1, step=12)
    event.source = "walker_sim"
    data = serialize(event)
    older = data[: data.index(b"walker_sim\0") + len(b"walker_sim\0")]
    convert = converter_of(topic())
    assert convert is not None
    assert deserialize_message(convert(older), GaitEvent) == event


def test_a_removed_field_or_another_projects_type_is_not_converted():
    assert converter_of(topic("float64 forgotten")) is None
    assert converter_of(topic(of_type="theirs/msg/GaitEvent")) is None


def test_a_copy_with_the_installed_definition_is_not_converted():
    root, *others = find_definition(TYPE).schema_text.split(SEPARATOR)
    text = SEPARATOR.join([root.rstrip() + "\n", *reversed(others)])  # rosbag2 has another order
    assert converter_of(TopicInfo("/gait_events", TYPE, text, type_hash="older")) is None
