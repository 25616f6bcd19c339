# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Messages taken without the executor: every one, in order, at most as many as requested."""

import time

from sensor_msgs.msg import JointState

from gait_entrainment_nodes.messaging.client import Client
from gait_entrainment_nodes.messaging.domain import claimed_domain
from gait_entrainment_nodes.messaging.raw_messages import serialize
from gait_entrainment_nodes.messaging.topics import EVERY_MESSAGE
from gait_entrainment_nodes.nodes.rclpy_internals import RawReader


def test_messages_wait_until_they_are_taken_in_order():
    sent = [serialize(JointState(position=[float(number)])) for number in range(5)]
    taken = []
    with claimed_domain() as domain, Client("reads", domain=domain) as client:
        reader = RawReader(client.node, JointState, "states", EVERY_MESSAGE)
        publisher = client.node.create_publisher(JointState, "states", EVERY_MESSAGE)
        assert client.wait(publisher.get_subscription_count, 10.0)
        begin = time.time_ns()
        for message in sent:
            publisher.publish(message)

        def take():
            found = reader.take(2)
            assert len(found) <= 2
            taken.extend(found)
            return len(taken) == len(sent)

        assert client.wait(take, 10.0)
        assert reader.take(2) == []
        reader.destroy()
    assert [data for _, data in taken] == sent
    times = [received for received, _ in taken]
    assert begin <= times[0]
    assert times == sorted(times)
