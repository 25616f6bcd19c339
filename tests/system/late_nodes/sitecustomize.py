# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Nodes that hear each other late, for tests of races.

Discovery and delivery take time, but usually too little to reveal a node that does not wait for
them. Python loads this module at the start of every process that has this folder in PYTHONPATH. It
changes the nodes that are loaded later as the environment variable LATE_NODES says: a JSON object
of delays by pairs ``sender>receiver``, where ``*`` matches any name and the first match counts.
For example, with the time of matching in seconds since 1970::

    {"bag_recorder>walker_sim": {"matched": 1795708000.5}, "*>*": {"delivery": 0.02}}
"""

import importlib.abc
import importlib.util
import json
import os
import sys
import time
import zlib
from collections import deque
from fnmatch import fnmatchcase
from typing import NamedTuple

DELAYS = json.loads(os.environ["LATE_NODES"])
# How often a node checks for late messages [s].
PERIOD = 0.01


class Delay(NamedTuple):
    """
    How late a receiver hears a sender.

    Before ``matched``, wall time [s since 1970], it hears nothing, and the sender knows that.
    Afterwards each topic is late by its own share of ``delivery`` [s], so topics overtake each
    other.
    """

    matched: float = 0.0
    delivery: float = 0.0

    def of_topic(self, name):
        """Return how late a topic is delivered [s]."""
        return self.delivery * zlib.crc32(name.encode()) / 2**32


def delay_between(sender, receiver):
    """Return how late a receiver hears a sender, by the names of the nodes."""
    pair = f"{sender}>{receiver}"
    return next((Delay(**d) for p, d in DELAYS.items() if fnmatchcase(pair, p)), Delay())


def late_reader(raw_reader):
    """Return a kind of RawReader that loses what came before its sender was matched."""

    class LateReader(raw_reader):
        def __init__(self, node, message_type, topic, qos):
            super().__init__(node, message_type, topic, qos)
            self._node, self._topic = node, node.resolve_topic_name(topic)
            self._kept = deque()

        def take(self, most):
            self._kept += super().take(most)
            if not self._kept:
                return []
            delay = self._delay()
            late = round(delay.of_topic(self._topic) * 1e9)
            taken = []
            while self._kept and self._kept[0][0] + late <= time.time_ns() and len(taken) < most:
                received, data = self._kept.popleft()
                if received >= delay.matched * 1e9:
                    taken.append((received, data))
            return taken

        def _delay(self):
            """Return the publisher's delay; of several publishers none is known to be matched."""
            here = self._node.get_name()
            infos = self._node.get_publishers_info_by_topic(self._topic)
            delays = [delay_between(name, here) for name in {info.node_name for info in infos}]
            if len(delays) == 1:
                return delays[0]
            return Delay(delivery=max((delay.delivery for delay in delays), default=0.0))

    return LateReader


class LateClient:
    """A client whose answers are late, or lost if the server had not matched it in time."""

    def __init__(self, client, delay, future):
        self._client, self._delay, self._future = client, delay, future
        self._answers = deque()  # when each is due, its future, its result
        self.service_is_ready = client.service_is_ready

    def call_async(self, request):
        """Send a request; ``deliver`` delivers the answer."""
        late, known = self._future(), time.time() >= self._delay.matched

        def keep(answer):
            if known:
                self._answers.append((time.time() + self._delay.delivery, late, answer.result()))

        self._client.call_async(request).add_done_callback(keep)
        return late

    def deliver(self):
        """Complete the requests whose answers are due."""
        while self._answers and self._answers[0][0] <= time.time():
            _, late, answer = self._answers.popleft()
            late.set_result(answer)


def change_participant(module):
    """Let a node receive messages and answers late."""
    from rclpy.serialization import deserialize_message
    from rclpy.task import Future

    from gait_entrainment_nodes.nodes.rclpy_internals import RawReader

    participant, reader_type = module.Participant, late_reader(RawReader)
    make_client, publish_state = participant.client, participant.publish_state
    participant.late = ()  # functions that deliver what is due

    def subscribe(self, topic, callback, *, raw=False):
        reader = reader_type(self, topic.type, self.name_of(topic), topic.qos)

        def deliver():
            for _, data in reader.take(100):
                callback(data if raw else deserialize_message(data, topic.type))

        self.late += (deliver,)

    def client(self, service_type, name):
        delay = delay_between(name.partition("/")[0], self.get_name())
        late = LateClient(make_client(self, service_type, name), delay, Future)
        self.late += (late.deliver,)
        return late

    def deliver_and_publish_state(self):  # which the loop does each time
        for deliver in self.late:
            deliver()
        publish_state(self)

    participant.subscribe, participant.client = subscribe, client
    participant.publish_state = deliver_and_publish_state


def change_publisher(module):
    """Let a publisher know of the subscriptions that are not matched yet."""
    publisher = module.CountedPublisher
    matched = publisher.matched

    def matched_by_now(self):
        readers = self._node.get_subscriptions_info_by_topic(self.topic_name)
        here, now = self._node.get_name(), time.time()
        late = sum(now < delay_between(here, r.node_name).matched for r in readers)
        return max(matched.fget(self) - late, 0)

    publisher.matched = property(matched_by_now)


def change_recorder(module):
    """Let the recorder receive late."""
    module.RawReader = late_reader(module.RawReader)


def change_loop(module):
    """Let the loop check for late messages."""
    module.LONGEST_SLEEP = PERIOD


CHANGES = {
    "gait_entrainment_nodes.nodes.participant": change_participant,
    "gait_entrainment_nodes.messaging.publisher": change_publisher,
    "gait_entrainment_nodes.nodes.bag_recorder": change_recorder,
    "gait_entrainment_nodes.nodes.loop": change_loop,
}


class ChangingFinder(importlib.abc.MetaPathFinder):
    """Finds the modules to change, and changes each as soon as it has been loaded."""

    def find_spec(self, name, *_):
        """See `importlib.abc.MetaPathFinder`."""
        if (change := CHANGES.pop(name, None)) is None:
            return None
        spec = importlib.util.find_spec(name)
        load = spec.loader.exec_module

        def load_and_change(module):
            load(module)
            change(module)

        spec.loader.exec_module = load_and_change
        return spec


sys.meta_path.insert(0, ChangingFinder())
