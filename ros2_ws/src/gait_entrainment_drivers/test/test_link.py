# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The link to the torque loop: a stop from another thread is neither lost nor sent twice."""

import socket
import sys
import threading
import time

import pytest

from gait_entrainment_drivers.link import Link

COUNT = 3000


@pytest.fixture
def ends():
    ours, theirs = map(Link, socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET))
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)  # threads take turns as often as possible
    yield ours, theirs
    sys.setswitchinterval(interval)
    ours.close()
    theirs.close()


def test_messages_from_several_threads_arrive_once_and_in_order(ends):
    ours, theirs = ends

    def send(name):
        for number in range(COUNT):
            ours.send(name, number)

    threads = [threading.Thread(target=send, args=(name,)) for name in ("alive", "stop", "cancel")]
    for thread in threads:
        thread.start()
    received, give_up = [], time.monotonic() + 30
    while len(received) < 3 * COUNT and time.monotonic() < give_up:
        received += theirs.received()
        ours.send_samples([])  # nothing new, only what is still waiting
    for thread in threads:
        thread.join()
    for name in ("alive", "stop", "cancel"):
        assert [number for kind, number in received if kind == name] == list(range(COUNT))


def test_a_message_longer_than_the_socket_buffer_arrives_complete_before_a_later_stop(ends):
    ours, theirs = ends
    train = "x" * 1_000_000
    ours.send("train", train)
    ours.send("stop")
    received = []
    while len(received) < 2:
        received += theirs.received()
        ours.send_samples([])
    assert received == [("train", train), ("stop",)]
