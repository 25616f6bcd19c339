# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The Foxglove connection, tested with an independent client of its protocol."""

import contextlib
import json
import struct

import pytest
from rclpy.serialization import serialize_message

from gait_entrainment.errors import UsageError
from gait_entrainment_msgs.msg import Stride
from gait_entrainment_nodes.messaging.topics import STRIDES
from gait_entrainment_page.access import listen
from gait_entrainment_page.operator_page import Settings


def test_a_blinded_page_refuses_foxglove():
    with pytest.raises(UsageError, match="foxglove: offers what a blinded page hides"):
        Settings(blinded=True, foxglove=8765)


def test_a_client_is_offered_a_topic_and_receives_its_messages():
    pytest.importorskip("foxglove")
    client = pytest.importorskip("websockets.sync.client")
    from gait_entrainment_page.foxglove_server import FoxgloveServer

    with listen("127.0.0.1", 0) as listener:
        port = listener.getsockname()[1]
    server = FoxgloveServer("127.0.0.1", port)
    data = serialize_message(Stride(number=7, period=1.9))
    server.send(STRIDES, data, 1)
    with client.connect(f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"]) as socket:
        while (message := json.loads(socket.recv(10)))["op"] != "advertise":
            pass
        (channel,) = message["channels"]
        assert channel["topic"] == "/gait/strides"
        assert channel["schemaName"] == "gait_entrainment_msgs/msg/Stride"
        assert "float64 period" in channel["schema"]
        subscription = {"id": 1, "channelId": channel["id"]}
        socket.send(json.dumps({"op": "subscribe", "subscriptions": [subscription]}))
        frame = None
        while not isinstance(frame, bytes):  # until the server knows the subscription
            server.send(STRIDES, data, 2)
            with contextlib.suppress(TimeoutError):
                frame = socket.recv(0.1)
    # 1, subscription and time, then the serialized message.
    assert struct.unpack_from("<BIQ", frame) == (1, 1, 2)
    assert frame[13:] == data
