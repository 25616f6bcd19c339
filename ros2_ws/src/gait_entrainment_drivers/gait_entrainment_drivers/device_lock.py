# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
One device, one master: whoever opens a device holds it until it lets go, or dies in whatever way.

What is held is the name of a socket in Linux's abstract namespace, which needs no file and of
which nothing is left once its process has ended. It reaches as far as the network namespace: two
containers that share a serial line are not kept apart.
"""

import errno
import hashlib
import socket
import struct
from contextlib import suppress
from pathlib import Path

from gait_entrainment.robot.faults import DeviceError

_PREFIX = "gait_entrainment/device/"
_CREDENTIALS = struct.Struct("3i")  # process, user, group
_LONGEST_COMMAND = 80


class DeviceLock:
    """Holds a device, by its address, until released; DeviceError names who holds it already."""

    def __init__(self, address: str) -> None:
        # An address may be longer than a socket's name.
        name = f"\0{_PREFIX}{hashlib.sha256(address.encode()).hexdigest()}"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.bind(name)
            self._socket.listen()
        except OSError as error:
            self._socket.close()
            if error.errno != errno.EADDRINUSE:
                raise
            raise DeviceError(f"{address} is in use by {_holder(name)}: end that first") from None

    def release(self) -> None:
        """Let others open the device."""
        self._socket.close()


def _holder(name: str) -> str:
    """Return who listens at a socket's name, in words."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asker, suppress(OSError):
        asker.connect(name)
        data = asker.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        process = Path(f"/proc/{_CREDENTIALS.unpack(data)[0]}")
        # The torque loop itself says nothing to a person: its parent is what was started.
        parent = (process / "status").read_text().partition("PPid:")[2].split()[0]
        command = Path(f"/proc/{parent}/cmdline").read_text(errors="replace").replace("\0", " ")
        told = command.strip()[:_LONGEST_COMMAND] + "..." * (len(command) > _LONGEST_COMMAND)
        return f"process {parent} ({told})"
    return "another process"
