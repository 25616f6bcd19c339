# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
A process that subscribes reliably to every topic of a run, as `ros2 topic echo` may.

    python spectator.py DOMAIN       prints "ready" once it has heard from the walker
"""

import sys

from gait_entrainment_nodes.messaging import topics
from gait_entrainment_nodes.messaging.client import Client

with Client("spectator", domain=int(sys.argv[1])) as client:
    heard: list[object] = []
    client.subscribe(topics.JOINT_STATES, heard.append)
    for topic in vars(topics).values():
        if isinstance(topic, topics.Topic) and topic is not topics.JOINT_STATES:
            client.subscribe(topic, lambda _: None)
    client.wait(lambda: heard, 60.0)
    print("ready", flush=True)
    client.wait(lambda: False, 1e6)
