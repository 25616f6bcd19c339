# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Stopping without ROS: every process that drives an ankle robot listens on a local socket.

The socket has a name in Linux's abstract namespace. It needs no file, home folder or writable
disk, vanishes with its process, and is listed in /proc/net/unix. A request is one datagram; the
answer reports what the device measured. No discovery, executor or other reader can delay it. Any
process that can reach the machine's network namespace may stop a robot: stopping is safe.
"""

import errno
import itertools
import json
import os
import re
import select
import socket
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

PREFIX = "gait_entrainment/stop/"
_SOCKETS = Path("/proc/net/unix")
# Variable with the descriptor of a socket that the script ``entrain`` opened for a run.
_OPENED = "GAIT_ENTRAINMENT_STOP_SOCKET"
_LARGEST_ANSWER = 4096
# For names: a socket's name is short, and the list of sockets is split at blanks.
_LONGEST_NAME = 60
_UNFIT = re.compile(r"[^\w/.:+-]", re.ASCII)


@dataclass(frozen=True)
class StopAnswer:
    """A robot's answer to a stop."""

    done: bool  # whether the sender confirms what its message states
    message: str  # one line for people; "zero" only for a measured torque


NO_ANSWER = StopAnswer(False, "does not answer")


class StopListener:
    """
    The robot's end of the channel: requests are polled, or awaited with ``select``.

    ``name`` identifies the robot in answers, such as the driver's name. The first listener of a
    run takes the socket that the script ``entrain`` opened, with its name.
    """

    def __init__(self, name: str) -> None:
        opened = int(os.environ.pop(_OPENED, 0)) or None
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM, fileno=opened)
        self._socket.setblocking(False)
        self._socket.set_inheritable(False)
        # A stop sent to a socket that a child kept open would have no effect.
        os.register_at_fork(after_in_child=self.close)
        if opened:
            return
        short = _UNFIT.sub("_", name)[-_LONGEST_NAME:]
        # A process may hold several robots with the same name.
        for number in itertools.count(1):
            more = f"-{number}" if number > 1 else ""
            try:
                self._socket.bind(f"\0{PREFIX}{short}/{os.getpid()}{more}")
                break
            except OSError as error:
                if error.errno != errno.EADDRINUSE:
                    raise

    def fileno(self) -> int:
        """Return the descriptor that becomes readable when a request arrives."""
        return self._socket.fileno()

    def requests(self) -> list[str | bytes | None]:
        """Return the senders of stop requests since the last call, None for an unnamed one."""
        found: list[str | bytes | None] = []
        with suppress(BlockingIOError):
            while len(found) < 100:  # a flood of requests must not hold up the listener
                found.append(self._socket.recvfrom(16)[1])
        return found

    def answer(self, addresses: Iterable[str | bytes | None], answer: StopAnswer) -> None:
        """Answer requests; senders that are gone are ignored."""
        data = json.dumps(asdict(answer)).encode()
        for address in addresses:
            if address is not None:
                with suppress(OSError):
                    self._socket.sendto(data, address)

    def close(self) -> None:
        """Stop listening."""
        self._socket.close()


def listening() -> list[str]:
    """Return the names, NAME/PROCESS, of all robots on this machine that can be stopped."""
    # Sockets of other programs may have any name.
    lines = _SOCKETS.read_text(errors="replace").splitlines()[1:]
    names = (line.split()[-1] for line in lines)
    marker = f"@{PREFIX}"
    return sorted(name.removeprefix(marker) for name in names if name.startswith(marker))


def stop_all(timeout: float = 0.5) -> dict[str, StopAnswer]:
    """
    Ask every robot on this machine to bring its torque to zero, as the script ``entrain`` does.

    Returns the answers by name; one that is missing after ``timeout`` [s] is NO_ANSWER.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as asker:
        asker.setblocking(False)
        asker.bind("")  # the kernel chooses an abstract name
        names = [name for name in listening() if _ask(asker, name)]
        answers = dict.fromkeys(names, NO_ANSWER)
        give_up = time.monotonic() + timeout
        while NO_ANSWER in answers.values() and (left := give_up - time.monotonic()) > 0:
            if select.select([asker], [], [], left)[0]:
                data, address = asker.recvfrom(_LARGEST_ANSWER)
                sender = os.fsdecode(address or b"").removeprefix(f"\0{PREFIX}")
                with suppress(ValueError, TypeError):  # the sender has another version
                    if sender in answers:
                        answers[sender] = StopAnswer(**json.loads(data))
        return answers


def _ask(asker: socket.socket, name: str) -> bool:
    """Ask one robot; return False if it has ended meanwhile, and its torque with it."""
    try:
        asker.sendto(b"stop", f"\0{PREFIX}{name}")
    except ConnectionRefusedError:
        return False
    except BlockingIOError:  # its queue is full: it has not read for a long time
        pass
    return True
