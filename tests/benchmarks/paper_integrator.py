# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""The paper's method, compiled: Runge-Kutta, fixed step of 1e-4 s, on Eq. 6. For speed only."""

import math

import numba

STEP = 1e-4


@numba.njit(cache=True)
def acceleration(theta, torque, m, length, foot, g, separation, mu, k, double):
    sine, cosine = math.sin(theta), math.cos(theta)
    if not double:
        return g / length * sine
    reach_squared = length**2 + separation**2 - 2 * length * separation * sine
    cos_psi = (length**2 + foot**2 - reach_squared) / (2 * length * foot)
    psi = math.acos(cos_psi)
    reach = math.sqrt(reach_squared)
    phi = math.atan2(length * cosine, separation - length * sine)
    effective = max(0.0, k * (mu - psi) + torque)
    force = effective * reach / (length * foot * math.sin(psi))
    return g / length * sine - force * (sine * math.sin(phi) + cosine * math.cos(phi)) / (
        m * length
    )


@numba.njit(cache=True)
def walk(strides, rate, first, period, width, torque, m, length, foot, g, alpha, mu, k):
    """Walk strides with a pulse on every other push-off; return the time they took."""
    separation = 2 * length * math.sin(alpha) - foot
    offset = (separation**2 - foot**2) / (2 * length * separation)
    toe_off = math.asin(offset + foot / separation * math.cos(mu))
    theta, t, steps, double = alpha, 0.0, 0, True
    while steps < 2 * strides:
        since = (t - first) % period
        pulse = torque if steps % 2 == 1 and t >= first and since < width else 0.0
        a = (m, length, foot, g, separation, mu, k, double)
        k1v = acceleration(theta, pulse, *a)
        k2x = rate + 0.5 * STEP * k1v
        k2v = acceleration(theta + 0.5 * STEP * rate, pulse, *a)
        k3x = rate + 0.5 * STEP * k2v
        k3v = acceleration(theta + 0.5 * STEP * k2x, pulse, *a)
        k4x = rate + STEP * k3v
        k4v = acceleration(theta + STEP * k3x, pulse, *a)
        theta += STEP / 6 * (rate + 2 * k2x + 2 * k3x + k4x)
        rate += STEP / 6 * (k1v + 2 * k2v + 2 * k3v + k4v)
        t += STEP
        if double and theta <= toe_off:
            double = False
        elif not double and theta <= -alpha:
            theta, rate, double = alpha, rate * math.cos(2 * alpha), True
            steps += 1
    return t
