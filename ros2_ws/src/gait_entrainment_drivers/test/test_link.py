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
    sys.setswitchinterval(1e-6)  # threads take turns at every chance
    yield ours, theirs
    sys.setswitchinterval(interval)
    ours.close()
    theirs.close()


def test_what_several_threads_send_comes_once_and_in_their_order(ends):
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
        ours.send_samples([])  # nothing new: only what waits
    for thread in threads:
        thread.join()
    for name in ("alive", "stop", "cancel"):
        assert [number for kind, number in received if kind == name] == list(range(COUNT))


def test_a_message_longer_than_the_sockets_buffer_comes_whole_and_a_stop_behind_it(ends):
    ours, theirs = ends
    train = "x" * 1_000_000
    ours.send("train", train)
    ours.send("stop")
    received = []
    while len(received) < 2:
        received += theirs.received()
        ours.send_samples([])
    assert received == [("train", train), ("stop",)]
