# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Decoding messages by the definitions stored in the bag, without ROS.

It uses `mcap-ros2-support`, which builds a decoder from a schema's text, needs no installed
message package, and takes 9 microseconds for a JointState of four joints (`rosbags`: 12). It
reads neither wide strings nor the names of messages inside services and actions.
"""

import contextlib
import struct
from collections.abc import Callable
from functools import cache
from typing import Any

from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

from gait_entrainment_bags.errors import BagError, UnreadableBagError
from gait_entrainment_bags.metadata import TopicInfo, first_line

CDR_HEADER_SIZE = 4
# RuntimeError includes NotImplementedError, and the recursion of a type that contains itself.
_NOT_DECODED = (struct.error, ValueError, IndexError, MemoryError, RuntimeError)


@cache
def decoder_for(topic: TopicInfo) -> Callable[[bytes], Any]:
    """
    Make a decoder from CDR to an object with one attribute per field.

    Raises BagError if the definition cannot be parsed. The decoder raises UnreadableBagError
    for bytes that are not a message of the type.
    """
    encodings = topic.message_encoding, topic.schema_encoding
    if encodings != ("cdr", "ros2msg"):
        raise BagError(
            f"{topic.name}: cannot be decoded: {encodings[0]} messages with "
            f"{encodings[1] or 'no'} definition; allowed: cdr with ros2msg"
        )
    schema = Schema(1, topic.schema_text.encode(), "ros2msg", topic.type)
    try:
        # The parser also prints its errors.
        with contextlib.redirect_stdout(None), contextlib.redirect_stderr(None):
            decode: Any = DecoderFactory().decoder_for("cdr", schema)
    except Exception as error:  # on a malformed line the parser may raise anything
        raise BagError(
            f"{topic.name}: the definition of {topic.type} cannot be used: {first_line(error)}"
        ) from None

    def checked_decode(data: bytes) -> Any:
        try:
            return decode(data)
        except _NOT_DECODED as error:
            raise UnreadableBagError(
                f"{topic.name}: not a {topic.type} in CDR: {first_line(error)}"
            ) from None

    return checked_decode
