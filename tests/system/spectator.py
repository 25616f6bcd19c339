# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A process that subscribes reliably to every topic of a run, as `ros2 topic echo` may.

Prints "listens" once it has subscribed, and "hears" once it has heard the walker.
"""

from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.client import Client

with Client("spectator") as client:
    heard: list[object] = []
    client.subscribe(topics.JOINT_STATES, heard.append)
    for topic in vars(topics).values():
        if isinstance(topic, topics.Topic) and topic is not topics.JOINT_STATES:
            client.subscribe(topic, lambda _: None)
    print("listens", flush=True)
    client.wait(lambda: heard)
    print("hears", flush=True)
    client.wait(lambda: False, 1e6)
