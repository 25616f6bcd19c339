# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The walker's events to 30 digits: time as an integral over psi, by mpmath.

Independent of the walker's quadrature, of its closed forms and of its inversion: mpmath's own
integration and root finding, at 32 digits, on the energy written in theta and psi.
"""

import math

from mpmath import asin, cos, findroot, mp, mpf, pi, quad, sin, sqrt

mp.dps = 32


class Reference:
    """Walks with torque constant between given times, far from a stall."""

    def __init__(self):
        # Table 1: the doubles that the walker is given, exactly.
        self.m, self.L, self.l, self.g = mpf(80.0), mpf(1.0), mpf(0.2), mpf(9.81)
        self.alpha, self.mu, self.k = mpf(math.pi / 6), mpf(2.576), mpf(87.3)
        self.d = 2 * self.L * sin(self.alpha) - self.l
        self.psi_0 = pi / 2 - self.alpha
        self.theta_toe_off = self.theta(self.mu)

    def theta(self, psi):
        # Law of cosines on both sides of the line from the toe to the mass.
        return asin(
            (self.d**2 - self.l**2 + 2 * self.L * self.l * cos(psi)) / (2 * self.L * self.d)
        )

    def work(self, pulse, start, end):
        """Work of max(0, spring + pulse): none once a negative pulse has unloaded the foot."""
        end = max(start, min(end, self.mu + min(pulse, mpf(0)) / self.k))
        return (end - start) * (self.k * (self.mu - (end + start) / 2) + pulse)

    def time(self, state, pulse, start, end):
        """Time from start to end; `state` is the kinetic plus potential energy at start."""

        def integrand(psi):
            theta = self.theta(psi)
            kinetic = state + self.work(pulse, start, psi) - self.m * self.g * self.L * cos(theta)
            rate = sqrt(2 * kinetic / self.m) / self.L
            return self.l * sin(psi) / (self.d * cos(theta)) / rate

        kink = min(max(start, end), max(start, self.mu + min(pulse, mpf(0)) / self.k))
        return quad(integrand, [start, (start + kink) / 2, kink, (kink + end) / 2, end])

    def pendulum_time(self, energy):
        def integrand(theta):
            return self.L / sqrt(2 * (energy / self.m - self.g * self.L * cos(theta)))

        return quad(integrand, [-self.alpha, 0, self.theta_toe_off])

    def walk(self, steps, edges):
        """
        Heel strikes and toe-offs; edges[i] = [(time, torque from then on), ...] for step i.

        The times are mpf seconds in the double stance that begins step i; None is its start.
        """
        lift = self.m * self.g * self.L * cos(self.alpha)
        c2 = cos(2 * self.alpha) ** 2
        work = self.k * (self.mu - self.psi_0) ** 2 / 2
        kinetic = c2 * work / (1 - c2)
        now, strikes, offs = mpf(0), [mpf(0)], []
        for step in range(steps):
            energy = kinetic + lift
            psi, pulse, since = self.psi_0, mpf(0), now
            for edge, torque in edges.get(step, []):
                if edge is None:
                    pulse = mpf(torque)
                    continue
                span = edge - since

                def late(x, energy=energy, psi=psi, pulse=pulse, span=span):
                    return self.time(energy, pulse, psi, x) - span

                place = findroot(late, (psi + span * 4, psi + span * 5), tol=mpf(10) ** -56)
                energy += self.work(pulse, psi, place)
                psi, pulse, since = place, mpf(torque), edge
            now = since + self.time(energy, pulse, psi, self.mu)
            energy += self.work(pulse, psi, self.mu)
            offs.append(now)
            now += self.pendulum_time(energy)
            strikes.append(now)
            kinetic = c2 * (energy - lift)
        return strikes, offs
