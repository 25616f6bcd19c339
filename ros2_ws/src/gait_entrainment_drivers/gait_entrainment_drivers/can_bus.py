# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""Open a CAN bus with python-can, and report any failure in one line."""

from typing import Any

import can

from gait_entrainment.robot.faults import DeviceError


def open_bus(interface: str, channel: str, bitrate: int, port: int) -> can.BusABC:
    """
    Open a bus; raise DeviceError if python-can does not know the interface or cannot open it.

    ``port`` is the UDP port of udp_multicast; 0 is python-can's default. Two buses on one machine
    need different ports: groups on the same port hear each other, because Linux delivers a
    datagram to every socket on its port.
    """
    # udp_multicast has no bit rate; other interfaces use it, or ignore it if the system sets it.
    settings: dict[str, Any] = {"bitrate": bitrate}
    if interface == "udp_multicast":
        settings = {"port": port} if port else {}
    try:
        return can.Bus(interface=interface, channel=channel, ignore_config=True, **settings)
    except (can.CanError, OSError, ValueError, TypeError, ImportError, NotImplementedError) as e:
        reason = " ".join(str(e).split()) or type(e).__name__
        raise DeviceError(
            f"CAN bus {interface} {channel} cannot be opened: {reason}; allowed: an interface "
            "that python-can knows, and a channel that is up "
            "(ip link set can0 up type can bitrate 1000000)"
        ) from None


def send(bus: can.BusABC, identifier: int, data: bytes = b"", *, remote: bool = False) -> None:
    """Send a frame with an 11-bit id; a remote frame requests data."""
    bus.send(
        can.Message(
            arbitration_id=identifier, data=data, is_extended_id=False, is_remote_frame=remote
        )
    )
