# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The messages that the page receives, for Foxglove without a bridge (package foxglove-sdk)."""

from typing import Any

import foxglove
from foxglove.channel import Channel

from gait_entrainment_bags import find_definition


class FoxgloveServer:
    """A Foxglove WebSocket server at a host and port; it offers a topic from its first message."""

    def __init__(self, host: str, port: int) -> None:
        self._server = foxglove.start_server(name="gait_entrainment", host=host, port=port)
        self._channels: dict[str, Any] = {}

    def send(self, topic: Any, data: bytes, received: int) -> None:
        """Send a serialized message of a topic, received at a wall time [ns]."""
        if topic.name not in self._channels:
            package, _, kind = topic.type.__module__.partition(".")
            name = f"{package}/{kind.partition('.')[0]}/{topic.type.__name__}"
            text = find_definition(name).schema_text.encode()
            self._channels[topic.name] = Channel(
                topic=f"/{topic.name.lstrip('/')}",
                message_encoding="cdr",
                schema=foxglove.Schema(name=name, encoding="ros2msg", data=text),
            )
        self._channels[topic.name].log(data, log_time=received)
