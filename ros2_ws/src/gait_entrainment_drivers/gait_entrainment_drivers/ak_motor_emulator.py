# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""ak_motor_emulator: the motor's side of MIT mode, as a process. See motor_emulator.py."""

import sys
from collections.abc import Sequence

from gait_entrainment_drivers.ak_mit import (
    ENTER,
    EXIT,
    MOTORS,
    SET_ZERO,
    AkMotor,
    Reply,
    pack_reply,
    unpack_command,
)
from gait_entrainment_drivers.motor_emulator import (
    EmulatedMotor,
    Frames,
    emulator_parser,
    run_emulator,
)


class EmulatedAkMotor(EmulatedMotor):
    """A motor that any frame feeds, and whose watchdog drops the command; it always replies."""

    def __init__(
        self, motor: AkMotor, motor_id: int, bandwidth: float, timeout: float, reply_bytes: int
    ) -> None:
        super().__init__(bandwidth, timeout)
        self.motor = motor
        self.motor_id = motor_id
        self._reply_bytes = reply_bytes

    def expire(self) -> None:
        """Drop the command."""
        self.command = 0.0

    def obey(self, identifier: int, data: bytes, *, remote: bool, now: float) -> Frames:
        """Obey a frame; replies go to the host's id, which is 0."""
        if identifier != self.motor_id or remote:
            return []
        return [(0, self.receive(data, now))]

    def receive(self, data: bytes, now: float) -> bytes:
        """Obey the data of a frame at a time [s] and return those of the reply."""
        self.feed(now)
        if data == ENTER:
            self.enabled = True
        elif data == EXIT:
            self.enabled = False
        elif data != SET_ZERO and len(data) == 8:
            self.command = unpack_command(data, self.motor).torque
        reply = Reply(self.motor_id, 0.0, 0.0, self.torque, self.error)
        return pack_reply(reply, self.motor, self._reply_bytes)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the emulator until SIGINT or SIGTERM; 1 where the bus cannot be opened."""
    parser = emulator_parser(
        "ak_motor_emulator", "The motor's side of a CubeMars AK motor in MIT mode, on a CAN bus."
    )
    parser.add_argument("--motor", choices=MOTORS, default="AK80-9", help="type of the motor")
    parser.add_argument("--motor-id", type=int, default=1, help="1 to 127")
    parser.add_argument(
        "--reply-bytes", type=int, choices=(6, 8), default=8, help="length of a reply"
    )
    options = parser.parse_args(arguments)
    motor = EmulatedAkMotor(
        MOTORS[options.motor],
        options.motor_id,
        options.bandwidth,
        options.timeout,
        options.reply_bytes,
    )
    return run_emulator(motor, parser.prog, options)


if __name__ == "__main__":
    sys.exit(main())
