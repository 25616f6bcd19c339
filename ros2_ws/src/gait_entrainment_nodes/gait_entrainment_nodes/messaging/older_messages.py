# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Messages of this project recorded by earlier versions: fields added since then stay empty."""

from collections.abc import Callable
from typing import Any

from rosidl_parser.definition import AbstractNestedType, NamespacedType

from gait_entrainment_bags.decoding import decoder_for
from gait_entrainment_bags.definitions import SEPARATOR, fields_of, find_definition
from gait_entrainment_bags.metadata import TopicInfo
from gait_entrainment_nodes.messaging.raw_messages import message_class, serialize

_OWN = "gait_entrainment_msgs/"


def converter_of(topic: TopicInfo) -> Callable[[bytes], bytes] | None:
    """
    Return a function that turns a recorded message into one of the installed type, which differs.

    None unless it is a type of this project that has every recorded field. The definition decides,
    not the hash: rosbag2's writer puts the installed one into a copy, with the recorded hash.
    """
    if not topic.type.startswith(_OWN):
        return None
    texts = topic.schema_text, find_definition(topic.type).schema_text
    old, new = ({part.strip() for part in text.split(SEPARATOR)} for text in texts)
    installed, decode = message_class(topic.type), decoder_for(topic)
    recorded = {field.name for field in fields_of(topic.schema_text.partition(SEPARATOR)[0], _OWN)}
    if old == new or recorded - {*installed.get_fields_and_field_types()}:
        return None
    return lambda data: serialize(_filled(installed(), decode(data)))


def _filled(message: Any, recorded: Any) -> Any:
    fields = message.get_fields_and_field_types()
    for name, kind in zip(fields, message.SLOT_TYPES, strict=True):
        if hasattr(recorded, name):
            setattr(message, name, _converted(kind, getattr(recorded, name)))
    return message


def _converted(kind: Any, value: Any) -> Any:
    if isinstance(kind, NamespacedType):
        return _filled(message_class("/".join(kind.namespaced_name()))(), value)
    if isinstance(kind, AbstractNestedType):
        return [_converted(kind.value_type, item) for item in value]
    return value
