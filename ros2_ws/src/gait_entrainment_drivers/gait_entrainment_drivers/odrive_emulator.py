# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""odrive_emulator: an emulated ODrive axis with CANSimple, a process. See motor_emulator.py."""

import sys

from gait_entrainment_drivers import odrive
from gait_entrainment_drivers.motor_emulator import EmulatedMotor, Frames, run_emulator

_HEARTBEAT_PERIOD = 0.1  # [s]


class EmulatedOdrive(EmulatedMotor):
    """An axis that an error disarms until cleared; torque commands feed its watchdog."""

    def __init__(self, node: int, bandwidth: float, timeout: float) -> None:
        super().__init__(bandwidth, timeout)
        self._node = node
        self._mode = b""
        self._reason = 0  # of the last disarming
        self._beat_at = 0.0

    def advance(self, now: float) -> None:
        """Let the torque follow up to a time [s]; an error disarms."""
        super().advance(now)
        if self.error and self.enabled:
            self.enabled, self._reason = False, self.error

    def expire(self) -> None:
        """Report the expired watchdog if torque was possible."""
        if self.enabled:
            self.error |= odrive.WATCHDOG_EXPIRED

    def obey(self, identifier: int, data: bytes, *, remote: bool, now: float) -> Frames:
        """Handle a frame; only requests, which are remote frames, are answered."""
        node, command = divmod(identifier, 32)
        if node != self._node:
            return []
        self.advance(now)
        if remote:
            return self._answer(command)
        if command == odrive.SET_TORQUE:
            self.feed(now)
            if self._mode == odrive.TORQUE_MODE:
                (self.command,) = odrive.TORQUE.unpack(data)
        elif command == odrive.SET_MODE:
            self._mode = data
        elif command == odrive.SET_STATE:
            self.enabled = data == odrive.STATE.pack(odrive.CLOSED_LOOP) and not self.error
        elif command == odrive.CLEAR_ERRORS:
            self.error = self._reason = 0
        elif command == odrive.STOP:
            self.error |= odrive.STOP_REQUESTED
        return []

    def spontaneous(self, now: float) -> Frames:
        """Return the heartbeat if it is due."""
        if now - self._beat_at < _HEARTBEAT_PERIOD:
            return []
        self._beat_at = now
        return self._answer(odrive.HEARTBEAT)

    def _answer(self, what: int) -> Frames:
        answers = {
            odrive.HEARTBEAT: odrive.pack_heartbeat(
                odrive.Heartbeat(self.error, odrive.CLOSED_LOOP if self.enabled else odrive.IDLE)
            ),
            odrive.ERRORS: odrive.BITS.pack(self.error, self._reason),
            odrive.ENCODER: odrive.PAIR.pack(0.0, 0.0),
            odrive.TORQUES: odrive.PAIR.pack(self.command, self.torque),
            odrive.VERSION: odrive.VERSIONS.pack(2, 5, 2, 0, 0, 6, 11, 0),
        }
        return [(odrive.frame_id(self._node, what), answers[what])] if what in answers else []


def main() -> int:
    """Run the emulator."""
    return run_emulator(
        "odrive_emulator",
        "Emulate an ODrive axis with CANSimple on a CAN bus.",
        lambda options: EmulatedOdrive(options.node_id, options.bandwidth, options.timeout),
        node_id={"type": int, "default": 0, "help": "0 to 62"},
    )


if __name__ == "__main__":
    sys.exit(main())
