# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""A CAN bus by python-can, with one line for whatever keeps it from opening."""

from typing import Any

from gait_entrainment.robot.faults import DeviceError


def open_bus(interface: str, channel: str, bitrate: int, port: int) -> Any:
    """
    Open a bus; python-can is loaded here, so that nobody else waits for it.

    The port is that of udp_multicast, 0 for python-can's own. It keeps two buses on one machine
    apart; two groups on one port hear each other, since Linux hands a datagram to every socket
    of the port.

    Raises
    ------
    DeviceError
        where python-can is missing, does not know the interface, or cannot open the bus.

    """
    try:
        import can
    except ImportError:
        raise DeviceError("python-can is missing: pip install python-can msgpack") from None
    try:
        # udp_multicast has no bit rate; the others take it, or ignore it where the system sets it.
        settings: dict[str, Any] = {"bitrate": bitrate}
        if interface == "udp_multicast":
            settings = {"port": port} if port else {}
        return can.Bus(interface=interface, channel=channel, ignore_config=True, **settings)
    except (
        can.CanError,
        OSError,
        ValueError,
        TypeError,
        ImportError,
        NotImplementedError,
    ) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise DeviceError(
            f"CAN bus {interface} {channel} cannot be opened: {reason}; "
            "allowed: an interface that python-can knows, and a channel that is up "
            "(ip link set can0 up type can bitrate 1000000)"
        ) from None
