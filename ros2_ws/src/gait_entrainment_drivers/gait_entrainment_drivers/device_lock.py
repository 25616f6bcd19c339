# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
One device, one master: a process that opens a device holds it until it releases it or ends.

The lock is the name of a socket in Linux's abstract namespace. It needs no file, and nothing is
left of it once its process has ended in any way. It applies within one network namespace: it does
not keep apart two containers that share a serial line.
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
    """Holds a device by its address until released; DeviceError names its current holder."""

    def __init__(self, address: str) -> None:
        # An address may be longer than a socket's name can be.
        name = f"\0{_PREFIX}{hashlib.sha256(address.encode()).hexdigest()}"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.bind(name)
            self._socket.listen()
        except OSError as error:
            self._socket.close()
            if error.errno != errno.EADDRINUSE:
                raise
            raise DeviceError(f"{address} is in use by {_holder(name)}: end it first") from None

    def release(self) -> None:
        """Let other processes open the device."""
        self._socket.close()


def _holder(name: str) -> str:
    """Describe the process that listens on a socket, by the socket's name."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asker, suppress(OSError):
        asker.connect(name)
        data = asker.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        process = Path(f"/proc/{_CREDENTIALS.unpack(data)[0]}")
        # The user does not know the torque loop itself, but started its parent.
        parent = (process / "status").read_text().partition("PPid:")[2].split()[0]
        command = Path(f"/proc/{parent}/cmdline").read_text(errors="replace").replace("\0", " ")
        text = command.strip()[:_LONGEST_COMMAND] + "..." * (len(command) > _LONGEST_COMMAND)
        return f"process {parent} ({text})"
    return "another process"
