# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
An emulated ankle robot with the flaws of a real one, in simulated time.

The device has its own torque loop at 1 kHz. At each tick, counted from the start of the run, it
takes the torque requested one transport delay earlier, limits it to the peak torque and rounds it
to the resolution. Its torque follows as a first-order lag, no faster than the torque rate, and is
held until the next tick. The delivered torque is therefore piecewise constant by definition, and
the walker integrates it exactly. The rise time (10 to 90 %) of a first-order lag is
0.35 / bandwidth.

Three things are random: the lateness of each pulse (uniform, up to ``jitter``), the ticks whose
command is lost (the previous one holds), and the noise of the measured torque. Each has its own
generator, which is drawn from once per pulse or tick: the same seed gives the same numbers,
however a run is cut into promises.

Not modelled: interaction with the leg (back-drivability, inertia, friction, a joint that moves
against the torque), thermal limits, speed saturation, cable stretch and backlash, drift of the
bias, a drifting clock, and the decay of the torque after a stop or a cancellation: it is zero
immediately. Noise is white.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from gait_entrainment.conventions import Side
from gait_entrainment.robot.contract import Capabilities, RobotState
from gait_entrainment.robot.faults import LimitError
from gait_entrainment.robot.pulse_train import PulseTrain
from gait_entrainment.robot.simulated import SimulatedRobot
from gait_entrainment.settings import Checked, setting

_TICK = 1_000_000  # of the device's torque loop [ns]
_BLOCK = 1024  # random numbers drawn at a time


@dataclass(frozen=True)
class EmulatedOptions(Checked):
    """
    Flaws of the emulated robot.

    The defaults are those of a tethered ankle exoskeleton driven through Bowden cables: a torque
    bandwidth of 20 Hz, and a chain from command to torque of 5 ms.
    """

    bandwidth: float = setting(20.0, "torque bandwidth (-3 dB) of the lag", "Hz", (0.5, 300.0))
    peak_torque: float = setting(25.0, "largest torque", "N m", (0.1, 200.0))
    torque_rate: float = setting(2000.0, "steepest change of torque", "N m/s", (1.0, 1e6))
    delay: float = setting(0.005, "transport delay from command to device", "s", (0.0, 0.5))
    jitter: float = setting(0.002, "largest lateness of a pulse", "s", (0.0, 0.1))
    resolution: float = setting(0.01, "step of the torque command", "N m", (1e-4, 5.0))
    noise: float = setting(0.1, "standard deviation of the measured torque", "N m", (0.0, 10.0))
    bias: float = setting(0.0, "bias of the measured torque", "N m", (-10.0, 10.0))
    loss: float = setting(0.001, "share of the ticks whose command is lost", "1", (0.0, 0.9))
    state_rate: float = setting(500.0, "states per second; a divisor of 1000", "Hz", (1.0, 1000.0))

    def __post_init__(self) -> None:
        """Check every field, and that the states fall on ticks of the torque loop."""
        super().__post_init__()
        if 1000 % self.state_rate:
            raise LimitError(f"state_rate: {self.state_rate:g} Hz; allowed: a divisor of 1000")


class EmulatedAnkleRobot(SimulatedRobot):
    """See the module's docstring."""

    Options = EmulatedOptions

    def __init__(self, side: Side, options: EmulatedOptions, seed: int) -> None:
        super().__init__(side, options, seed)
        self._options = options
        self._seed = seed
        self.capabilities = Capabilities(
            peak_torque=options.peak_torque,
            torque_rate=options.torque_rate,
            measures_torque=True,
            simulated=True,
            state_rate=options.state_rate,
        )
        self._ticks_per_state = round(1000 / options.state_rate)
        self._follow = -math.expm1(-2 * math.pi * options.bandwidth * _TICK / 1e9)
        self._largest_step = options.torque_rate * _TICK / 1e9
        self._delay = round(options.delay * 1e9)
        self._late: list[int] = []  # lateness of each pulse of the train [ns]
        self.begin(0)

    def begin(self, start: int) -> None:
        """Start a run; its random numbers start over."""
        super().begin(start)
        jitter, loss, noise = np.random.SeedSequence(self._seed).spawn(3)
        self._jitter = np.random.default_rng(jitter)
        self._loss = _draws(np.random.default_rng(loss).random)
        self._noise = _draws(np.random.default_rng(noise).standard_normal)
        self._start = start
        self._tick = 0  # the next one

    def schedule(self, train: PulseTrain) -> None:
        """Take over a train, and draw the lateness of each of its pulses."""
        super().schedule(train)
        late = self._jitter.random(len(train.pulses)) * self._options.jitter
        self._late += [round(seconds * 1e9) for seconds in late]

    def cancel(self) -> None:
        """Drop the train; the torque is zero immediately."""
        super().cancel()
        self._late = []
        self._command = 0.0  # held by the device [N m]
        self._torque = 0.0  # delivered by it [N m]

    def _changes(self, begin: int, until: int) -> Iterator[tuple[int, float]]:
        yield begin, self._torque
        while (instant := self._start + self._tick * _TICK) < until:
            before = self._torque
            self._advance(instant)
            if self._torque != before:
                yield instant, self._torque
            self._tick += 1

    def _advance(self, instant: int) -> None:
        """Run the device's torque loop once, at a tick [ns]."""
        options = self._options
        requested = self._requested(instant - self._delay)
        if next(self._loss) >= options.loss:
            limited = min(max(requested, -options.peak_torque), options.peak_torque)
            self._command = round(limited / options.resolution) * options.resolution
        gap = self._command - self._torque
        if gap:
            if abs(gap) < options.resolution / 2:  # less than the resolution can show: arrived
                self._torque = self._command
            else:
                step = gap * self._follow
                self._torque += min(max(step, -self._largest_step), self._largest_step)
        noise = next(self._noise)
        if self._tick % self._ticks_per_state == 0:
            measured = self._torque + options.bias + options.noise * noise
            self._states.append(RobotState(instant, requested, measured, math.nan))

    def _requested(self, instant: int) -> float:
        """Return the torque [N m] that the train requests, each pulse late by its jitter."""
        train = self._train
        if train is None:
            return 0.0
        number = train.latest(instant)
        if number < 0:
            return 0.0
        if instant < train.onsets[number] + self._late[number] and number > 0:
            number -= 1  # the previous pulse may be so late that it is still on
        return train.pulses[number].torque_at(instant - self._late[number])


def _draws(draw: Callable[[int], np.ndarray]) -> Iterator[float]:
    """Yield random numbers singly, but draw them in blocks: one call per number would be slow."""
    while True:
        yield from draw(_BLOCK).tolist()
