# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The link between a robot's process and its torque loop: messages that nobody waits for.

A message is a pickled tuple, its first element the kind of message; a long one comes in several
packets. The loop never blocks: what the other side does not take at once is kept and sent with the
next packet, so that a robot's process that was held up has lost no sample.
"""

import pickle
import select
import socket
import threading
from collections import deque
from dataclasses import dataclass
from typing import Any

from gait_entrainment_drivers.device import Reading

# Samples in one message at most: the loop is not to be held up by it.
_MESSAGE_SAMPLES = 200
# It has to fit into a socket's buffer. Its first byte says whether more of its message comes.
_LARGEST_PACKET = 1 << 16
_MORE, _LAST = b"+", b"."


@dataclass(frozen=True)
class Sample:
    """One command and its answer."""

    sent: int  # steady time [ns]
    commanded: float  # [N m]
    reading: Reading | None
    late: float  # by how much the command came late [s]


class Link:
    """One end of the link; any thread may send, a stop among others."""

    def __init__(self, end: socket.socket) -> None:
        self._socket = end
        end.setblocking(False)
        self._waiting: deque[bytes] = deque()  # packets that have not been sent yet
        self._begun = b""  # of a message whose last packet has not come yet
        self._sending = threading.RLock()  # nobody waits while it is held: sends do not block

    def fileno(self) -> int:
        """Return the descriptor that becomes readable with a message."""
        return self._socket.fileno()

    def send(self, *message: Any) -> None:
        """Send a message, or keep it until the other side takes it."""
        data, size = pickle.dumps(message), _LARGEST_PACKET - 1
        with self._sending:
            for place in range(0, len(data), size):
                kind = _MORE if place + size < len(data) else _LAST
                self._waiting.append(kind + data[place : place + size])
            self._flush()

    def send_samples(self, samples: list[Any]) -> None:
        """Send samples as far as the other side takes them, and empty the list by as many."""
        with self._sending:
            self._flush()
            while samples and not self._waiting:
                self.send("samples", samples[:_MESSAGE_SAMPLES])
                del samples[:_MESSAGE_SAMPLES]

    def received(self) -> list[Any]:
        """Return the messages since the last call; EOFError if the other side has ended."""
        messages: list[Any] = []
        while True:
            try:
                packet = self._socket.recv(_LARGEST_PACKET)
            except BlockingIOError:
                return messages
            except ConnectionError:
                packet = b""
            if not packet:
                if messages:
                    return messages
                raise EOFError
            self._begun += packet[1:]
            if packet[:1] == _LAST:
                messages.append(pickle.loads(self._begun))
                self._begun = b""

    def first(self) -> Any:
        """Wait for the first message, a short one, and leave those behind it."""
        select.select([self._socket], [], [])
        return pickle.loads(self._socket.recv(_LARGEST_PACKET)[1:])

    def _flush(self) -> None:
        try:
            while self._waiting:
                self._socket.send(self._waiting[0])
                self._waiting.popleft()
        except BlockingIOError:
            pass
        except ConnectionError:
            self._waiting.clear()  # nobody is left to tell; `received` says so

    def close(self) -> None:
        """Close this end: the other one sees it."""
        self._socket.close()
