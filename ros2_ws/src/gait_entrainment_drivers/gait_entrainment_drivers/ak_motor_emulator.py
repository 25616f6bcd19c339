# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""ak_motor_emulator: an emulated AK motor in MIT mode, as a process. See motor_emulator.py."""

import sys

from gait_entrainment_drivers import ak_mit
from gait_entrainment_drivers.motor_emulator import EmulatedMotor, Frames, run_emulator


class EmulatedAkMotor(EmulatedMotor):
    """A motor that always replies; any frame feeds its watchdog, which drops the command."""

    def __init__(
        self,
        motor: ak_mit.AkMotor,
        motor_id: int,
        bandwidth: float,
        timeout: float,
        reply_bytes: int,
    ) -> None:
        super().__init__(bandwidth, timeout)
        self.motor = motor
        self.motor_id = motor_id
        self._reply_bytes = reply_bytes

    def expire(self) -> None:
        """Drop the command."""
        self.command = 0.0

    def obey(self, identifier: int, data: bytes, *, remote: bool, now: float) -> Frames:
        """Handle a frame; replies go to host id 0."""
        if identifier != self.motor_id or remote:
            return []
        return [(0, self.receive(data, now))]

    def receive(self, data: bytes, now: float) -> bytes:
        """Handle a frame's data at a time [s]; return the reply's data."""
        self.feed(now)
        if data == ak_mit.ENTER:
            self.enabled = True
        elif data == ak_mit.EXIT:
            self.enabled = False
        elif data != ak_mit.SET_ZERO and len(data) == 8:
            self.command = ak_mit.unpack_command(data, self.motor).torque
        reply = ak_mit.Reply(self.motor_id, 0.0, 0.0, self.torque, self.error)
        return ak_mit.pack_reply(reply, self.motor, self._reply_bytes)


def main() -> int:
    """Run the emulator."""
    return run_emulator(
        "ak_motor_emulator",
        "Emulate a CubeMars AK motor in MIT mode on a CAN bus.",
        lambda options: EmulatedAkMotor(
            ak_mit.MOTORS[options.motor],
            options.motor_id,
            options.bandwidth,
            options.timeout,
            options.reply_bytes,
        ),
        motor={"choices": ak_mit.MOTORS, "default": "AK80-9", "help": "motor type"},
        motor_id={"type": int, "default": 1, "help": "1 to 127"},
        reply_bytes={"type": int, "choices": (6, 8), "default": 8, "help": "reply length"},
    )


if __name__ == "__main__":
    sys.exit(main())
