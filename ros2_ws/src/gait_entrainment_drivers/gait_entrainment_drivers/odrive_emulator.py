# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""odrive_emulator: an ODrive axis that speaks CANSimple, as a process. See motor_emulator.py."""

import sys
from collections.abc import Sequence

from gait_entrainment_drivers.motor_emulator import (
    EmulatedMotor,
    Frames,
    emulator_parser,
    run_emulator,
)
from gait_entrainment_drivers.odrive import (
    CLEAR_ERRORS,
    CLOSED_LOOP,
    ENCODER,
    HEARTBEAT,
    IDLE,
    SET_MODE,
    SET_STATE,
    SET_TORQUE,
    STOP,
    STOP_REQUESTED,
    TORQUE_MODE,
    TORQUES,
    WATCHDOG_EXPIRED,
    Heartbeat,
    frame_id,
    pack_heartbeat,
    pack_pair,
    pack_state,
    unpack_torque,
)

_HEARTBEAT_PERIOD = 0.1  # [s]


class EmulatedOdrive(EmulatedMotor):
    """An axis that an error disarms until it is cleared, and that torque commands feed."""

    def __init__(self, node: int, bandwidth: float, timeout: float) -> None:
        super().__init__(bandwidth, timeout)
        self._node = node
        self._mode = b""
        self._beat_at = 0.0

    def advance(self, now: float) -> None:
        """Let the torque follow up to a time [s]; an error disarms."""
        super().advance(now)
        if self.error:
            self.enabled = False

    def expire(self) -> None:
        """Report the watchdog where torque was possible."""
        if self.enabled:
            self.error |= WATCHDOG_EXPIRED

    def obey(self, identifier: int, data: bytes, *, remote: bool, now: float) -> Frames:
        """Obey a frame; only questions, which are remote frames, are answered."""
        node, command = divmod(identifier, 32)
        if node != self._node:
            return []
        self.advance(now)
        if remote:
            return self._tell(command)
        if command == SET_TORQUE:
            self.feed(now)
            if self._mode == TORQUE_MODE:
                self.command = unpack_torque(data)
        elif command == SET_MODE:
            self._mode = data
        elif command == SET_STATE:
            self.enabled = data == pack_state(CLOSED_LOOP) and not self.error
        elif command == CLEAR_ERRORS:
            self.error = 0
        elif command == STOP:
            self.error |= STOP_REQUESTED
        return []

    def spontaneous(self, now: float) -> Frames:
        """Return the heartbeat where it is due."""
        if now - self._beat_at < _HEARTBEAT_PERIOD:
            return []
        self._beat_at = now
        return self._tell(HEARTBEAT)

    def _tell(self, what: int) -> Frames:
        told = {
            HEARTBEAT: pack_heartbeat(
                Heartbeat(self.error, CLOSED_LOOP if self.enabled else IDLE)
            ),
            ENCODER: pack_pair(0.0, 0.0),
            TORQUES: pack_pair(self.command, self.torque),
        }
        return [(frame_id(self._node, what), told[what])] if what in told else []


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the emulator until SIGINT or SIGTERM; 1 where the bus cannot be opened."""
    parser = emulator_parser("odrive_emulator", "An ODrive axis by CANSimple, on a CAN bus.")
    parser.add_argument("--node-id", type=int, default=0, help="0 to 62")
    options = parser.parse_args(arguments)
    motor = EmulatedOdrive(options.node_id, options.bandwidth, options.timeout)
    return run_emulator(motor, parser.prog, options)


if __name__ == "__main__":
    sys.exit(main())
