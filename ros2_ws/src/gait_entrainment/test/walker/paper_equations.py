# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The paper's equations of motion, integrated as printed: an independent reference for the walker.

Written from the paper alone and sharing no code with the package: Eq. 6 with its own psi(theta)
and phi(theta), single stance as a pendulum, collisions as cos(2 alpha), scipy's DOP853.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

Pulse = tuple[float, float, float]
"""Onset [s], end [s], torque [N m]."""

# Tighter than the 1e-9 s that is compared, because near a stall errors grow a thousandfold.
TOLERANCE = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14, "max_step": 0.01}

# Perturbation that has taken all torque from the ankle, which can only push.
UNLOADED = None


@dataclass(frozen=True)
class Table1:
    m: float = 80.0
    L: float = 1.0
    l: float = 0.2  # noqa: E741
    g: float = 9.81
    alpha: float = math.pi / 6
    mu: float = 2.576
    k: float = 87.3

    def psi(self, theta):
        s = math.sin(self.alpha)
        numerator = (
            -4 * self.L**2 * s**2
            + 4 * self.L * self.l * s
            + 2 * self.L * (2 * self.L * s - self.l) * np.sin(theta)
        )
        return np.arccos(numerator / (2 * self.L * self.l))

    def phi(self, theta):
        # The paper prints an arctangent; with atan2 it also holds if AC leans past the toe.
        base = 2 * self.L * math.sin(self.alpha) - self.l - self.L * np.sin(theta)
        return np.arctan2(self.L * np.cos(theta), base)

    def trailing_force(self, theta, torque):
        psi = self.psi(theta)
        reach = np.sqrt(self.L**2 + self.l**2 - 2 * self.L * self.l * np.cos(psi))
        return torque * reach / (self.L * self.l * np.sin(psi))

    def torque(self, theta, perturbation):
        return np.maximum(0.0, self.k * (self.mu - self.psi(theta)) + perturbation)

    def acceleration(self, theta, perturbation):
        phi = self.phi(theta)
        force = self.trailing_force(theta, self.torque(theta, perturbation))
        lever = np.sin(theta) * np.sin(phi) + np.cos(theta) * np.cos(phi)
        return (self.m * self.g * np.sin(theta) - force * lever) / (self.m * self.L)

    def leading_force(self, theta, rate, perturbation):
        phi = self.phi(theta)
        force = self.trailing_force(theta, self.torque(theta, perturbation))
        lever = np.cos(phi) * np.sin(theta) - np.sin(phi) * np.cos(theta)
        weight = self.m * self.g * np.cos(theta) - self.m * self.L * rate**2
        return force * lever + weight

    def start_rate(self):
        c = math.cos(2 * self.alpha) ** 2
        angle = self.alpha + self.mu - math.pi / 2
        return (
            -math.cos(2 * self.alpha) / self.L * math.sqrt(self.k * angle**2 / (self.m * (1 - c)))
        )


class WithoutKink(Table1):
    """The same between two kinks, because no integrator step may straddle one."""

    def torque(self, theta, perturbation):
        if perturbation is UNLOADED:
            return 0.0
        return self.k * (self.mu - self.psi(theta)) + perturbation


@dataclass
class Walk:
    """Heel strikes and toe-offs [s], and how the walk ended."""

    heel_strikes: list
    toe_offs: list
    rates_after_strike: list
    ending: str | None = None
    end_time: float | None = None
    end_angle: float | None = None


def perturbation_at(pulses: Sequence[Pulse], time: float) -> float:
    return sum(torque for onset, end, torque in pulses if onset <= time < end)


def walk(
    p: Table1, pulses: Sequence[Sequence[Pulse]], leading: int, steps: int, rate=None
) -> Walk:
    """Walk `steps` steps; pulses[side] perturb the ankle of that side."""
    p = WithoutKink(**vars(p))
    time, theta, rate = 0.0, p.alpha, p.start_rate() if rate is None else rate
    result = Walk([0.0], [], [rate])
    for _ in range(steps):
        trailing = 1 - leading
        borders = sorted({t for onset, end, _ in pulses[trailing] for t in (onset, end)})
        unloaded = False
        while True:
            stop = next((border for border in borders if border > time), time + 10.0)
            level = perturbation_at(pulses[trailing], time)
            if unloaded or p.torque(theta, level) < 0:
                level, unloaded = UNLOADED, True
            if p.leading_force(theta, rate, level) < 0:
                result.ending, result.end_time, result.end_angle = "fly_off", time, theta
                return result

            def motion(_, y, level=level):
                return [y[1], p.acceleration(y[0], level)]

            def toe_off(_, y):
                return p.psi(y[0]) - p.mu

            def stall(_, y):
                return y[1]

            def lift_off(_, y, level=level):
                return p.leading_force(y[0], y[1], level)

            def kink(_, y, level=level):
                return p.torque(y[0], level)

            bent = not unloaded and level < 0
            toe_off.terminal = stall.terminal = lift_off.terminal = kink.terminal = True
            toe_off.direction, stall.direction, lift_off.direction, kink.direction = 1, 1, -1, -1
            piece = solve_ivp(
                motion,
                (time, stop),
                [theta, rate],
                events=[toe_off, stall, lift_off, *([kink] if bent else [])],
                **TOLERANCE,
            )
            time, (theta, rate) = piece.t[-1], piece.y[:, -1]
            hit = [len(t) > 0 for t in piece.t_events]
            if hit[1] or hit[2]:
                result.ending = "fall" if hit[1] else "fly_off"
                result.end_time, result.end_angle = time, theta
                return result
            if hit[0]:
                break
            unloaded = (bent and hit[3]) or (unloaded and time < stop)
        result.toe_offs.append(time)

        def pendulum(_, y):
            return [y[1], p.g / p.L * np.sin(y[0])]

        def strike(_, y):
            return y[0] + p.alpha

        def turn(_, y):
            return y[1]

        def lift(_, y):
            return p.m * p.g * np.cos(y[0]) - p.m * p.L * y[1] ** 2

        strike.terminal = turn.terminal = lift.terminal = True
        strike.direction, turn.direction, lift.direction = -1, 1, -1
        piece = solve_ivp(
            pendulum, (time, time + 20), [theta, rate], events=[strike, turn, lift], **TOLERANCE
        )
        time, (theta, rate) = piece.t[-1], piece.y[:, -1]
        if len(piece.t_events[1]) or len(piece.t_events[2]):
            result.ending = "fall" if len(piece.t_events[1]) else "fly_off"
            result.end_time, result.end_angle = time, theta
            return result
        theta, rate = p.alpha, rate * math.cos(2 * p.alpha)
        leading = trailing
        result.heel_strikes.append(time)
        result.rates_after_strike.append(rate)
    return result
