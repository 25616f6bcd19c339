# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Two hosts on one machine: network namespaces joined by a link that delays and loses frames.

Each end is a TAP interface, and a thread carries every Ethernet frame between the two. This does
what netem would do to a veth pair, also on kernels without netem, and counts what crosses. Each
host has its own /dev/shm, so nothing can bypass the link.
"""

import fcntl
import heapq
import os
import random
import select
import shutil
import struct
import subprocess
import threading
import time
from collections.abc import Sequence
from pathlib import Path

_TUNSETIFF = 0x400454CA
_IFF_TAP, _IFF_NO_PI = 0x0002, 0x1000
# Longer than any frame of the interface: 1500 octets and its header.
_LONGEST_FRAME = 2048


def obstacle() -> str:
    """Return why this machine cannot have two hosts, or an empty text."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if shutil.which("ip") is None:
        return "the command ip (iproute2) is not installed"
    if not Path("/dev/net/tun").exists():
        return "there is no /dev/net/tun"
    name = f"gait{os.getpid()}"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True, text=True)
    if made.returncode:
        return f"ip netns add failed: {made.stderr.strip()}"
    subprocess.run(["ip", "netns", "delete", name], check=True)
    return ""


class SlowLink:
    """
    Two namespaces and the link between them; a context manager.

    Parameters
    ----------
    delay
        One-way delay of every frame [s].
    jitter
        Standard deviation of the delay [s]; frames overtake each other.
    loss
        Fraction of the frames lost each way.

    Attributes
    ----------
    hosts
        Names of the namespaces.
    addresses
        IP addresses of the two ends.
    carried, lost, octets
        Frames carried and lost, and octets carried: [from the first host, from the second].

    """

    def __init__(self, delay: float, jitter: float = 0.0, loss: float = 0.0) -> None:
        self.delay, self.jitter, self.loss = delay, jitter, loss
        self.hosts = [f"gait{os.getpid()}{end}" for end in "ab"]
        self.addresses = ["10.77.0.1", "10.77.0.2"]
        self.carried, self.lost, self.octets = [0, 0], [0, 0], [0, 0]
        self._ends: list[int] = []
        self._chance = random.Random(1)
        self._closing = threading.Event()
        self._carrier = threading.Thread(target=self._carry)

    def __enter__(self) -> "SlowLink":
        try:
            for host, address in zip(self.hosts, self.addresses, strict=True):
                _ip("netns", "add", host)
                end = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
                self._ends.append(end)
                request = struct.pack("16sH22x", host.encode(), _IFF_TAP | _IFF_NO_PI)
                fcntl.ioctl(end, _TUNSETIFF, request)
                _ip("link", "set", host, "netns", host)
                _ip("-n", host, "link", "set", "lo", "up")
                _ip("-n", host, "address", "add", f"{address}/24", "dev", host)
                _ip("-n", host, "link", "set", host, "up", "multicast", "on")
                # Discovery uses multicast, whose packets need a route.
                _ip("-n", host, "route", "add", "224.0.0.0/4", "dev", host)
        except BaseException:
            self._remove()
            raise
        self._carrier.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.set()
        self._carrier.join()
        self._remove()

    def on(self, host: int, command: Sequence[str]) -> list[str]:
        """Return the command line that runs a command on one of the two hosts."""
        private = 'mount -t tmpfs tmpfs /dev/shm && exec "$@"'
        return ["ip", "netns", "exec", self.hosts[host], "sh", "-c", private, "sh", *command]

    def _remove(self) -> None:
        for end in self._ends:
            os.close(end)
        for host in self.hosts:
            subprocess.run(["ip", "netns", "delete", host], capture_output=True)

    def _carry(self) -> None:
        under_way: list[tuple[float, int, int, bytes]] = []  # due, number, target end, frame
        number = 0
        while not self._closing.is_set():
            wait = max(under_way[0][0] - time.monotonic(), 0.0) if under_way else 0.1
            readable, _, _ = select.select(self._ends, [], [], min(wait, 0.1))
            now = time.monotonic()
            for end in readable:
                source = self._ends.index(end)
                try:
                    while True:
                        frame = os.read(end, _LONGEST_FRAME)
                        if self._chance.random() < self.loss:
                            self.lost[source] += 1
                            continue
                        self.carried[source] += 1
                        self.octets[source] += len(frame)
                        late = max(self._chance.gauss(self.delay, self.jitter), 0.0)
                        number += 1
                        heapq.heappush(under_way, (now + late, number, 1 - source, frame))
                except BlockingIOError:
                    pass
            while under_way and under_way[0][0] <= now:
                _, _, target, frame = heapq.heappop(under_way)
                os.write(self._ends[target], frame)


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True)
