# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The link between a robot's process and its torque loop: messages that are sent without waiting.

A message is a pickled tuple whose first element is the kind of message; a long one takes several
packets. The loop never blocks: what the other side does not take immediately is kept and sent with
the next packet, so a robot's process that was held up loses no samples.
"""

import pickle
import select
import socket
import threading
from collections import deque
from dataclasses import dataclass
from typing import Any

from gait_entrainment_drivers.device import Reading

# Most samples in one message, which must not hold up the loop.
_MESSAGE_SAMPLES = 200
# A packet must fit into a socket's buffer. Its first byte says if its message continues.
_LARGEST_PACKET = 1 << 16
_MORE, _LAST = b"+", b"."


@dataclass(frozen=True)
class Sample:
    """One command and its answer."""

    sent: int  # steady time [ns]
    commanded: float  # [N m]
    reading: Reading | None
    late: float  # delay of the command [s]


class Link:
    """One end of the link; any thread may send, for example a stop."""

    def __init__(self, end: socket.socket) -> None:
        self._socket = end
        end.setblocking(False)
        self._waiting: deque[bytes] = deque()  # packets not sent yet
        self._begun = b""  # of a message whose last packet has not arrived yet
        self._sending = threading.RLock()  # held only briefly: sends do not block

    def fileno(self) -> int:
        """Return the descriptor that becomes readable when a message arrives."""
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
        """Send as many samples as the other side takes, and remove them from the list."""
        with self._sending:
            self._flush()
            while samples and not self._waiting:
                self.send("samples", samples[:_MESSAGE_SAMPLES])
                del samples[:_MESSAGE_SAMPLES]

    def received(self) -> list[Any]:
        """Return the messages since the last call; raise EOFError if the other side has ended."""
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
        """Wait for the first message, which is short; leave later ones unread."""
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
            self._waiting.clear()  # the other side has ended, which `received` reports

    def close(self) -> None:
        """Close this end, which the other end notices."""
        self._socket.close()
