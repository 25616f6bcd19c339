# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A CAN bus by python-can, with one line for whatever keeps it from opening."""

from typing import Any

import can

from gait_entrainment.robot.faults import DeviceError


def open_bus(interface: str, channel: str, bitrate: int, port: int) -> can.BusABC:
    """
    Open a bus; raises DeviceError if python-can does not know the interface or cannot open it.

    The port is that of udp_multicast, 0 for python-can's own. It keeps two buses on one machine
    apart; two groups on one port hear each other, since Linux hands a datagram to every socket
    of the port.
    """
    # udp_multicast has no bit rate; the others take it, or ignore it if the system sets it.
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
    """Send a frame with an 11-bit id; a remote frame asks for the data."""
    bus.send(
        can.Message(
            arbitration_id=identifier, data=data, is_extended_id=False, is_remote_frame=remote
        )
    )
