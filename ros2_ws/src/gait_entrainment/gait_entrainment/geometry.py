# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Closed forms of the walker's linkage, each written once.

The whole model hangs on one triangle. The leading foot's heel B is the origin, x forward, z up.
The point mass C stands on the leading leg, leaned back by theta: C = L (-sin theta, cos theta).
The trailing toe A rests at (-d, 0) with d = 2 L sin(alpha) - l. The trailing ankle D joins the
foot AD = l and the leg DC = L at the angle psi. The law of cosines for the side AC gives

    L^2 + d^2 - 2 L d sin(theta) = L^2 + l^2 - 2 L l cos(psi),

so sin(theta) and cos(psi) are linear in each other, which is the paper's function psi(theta)
solved for the sine. While the walker moves on, theta falls and psi grows.

The functions take plain numbers, import only `math` and call no other: the parameters use them as
they are, the walker compiles each. Lengths are in m, angles in rad, forces in N, torques in N m,
masses in kg, rates in rad/s. Equation numbers are those of Ahn and Hogan (2012).
"""

import math


def leg_sine(cos_ankle: float, leg_length: float, foot_length: float, separation: float) -> float:
    """
    Sine of the leading leg's lean theta where the trailing ankle's angle psi has this cosine.

    `separation` is d, the distance from the trailing toe to the leading heel.
    """
    offset = (separation * separation - foot_length * foot_length) / (2 * leg_length * separation)
    return offset + foot_length / separation * cos_ankle


def ankle_cosine(
    sin_leg: float, leg_length: float, foot_length: float, separation: float
) -> float:
    """Cosine of the trailing ankle's angle psi at this sine of theta: inverse of `leg_sine`."""
    offset = (separation * separation - foot_length * foot_length) / (2 * leg_length * separation)
    return (sin_leg - offset) * separation / foot_length


def leg_per_ankle(
    sin_ankle: float, cos_leg: float, foot_length: float, separation: float
) -> float:
    """Transmission -d theta / d psi of the linkage, positive: the derivative of `leg_sine`."""
    return foot_length / separation * sin_ankle / cos_leg


def drop(sin_leg: float, cos_leg: float) -> float:
    """
    Height of the mass below the apex, 1 - cos(theta), in leg lengths.

    Written without the difference, which would lose the digits of a small drop.
    """
    return sin_leg * sin_leg / (1.0 + cos_leg)


def spring_torque(ankle: float, stiffness: float, max_plantarflexion: float) -> float:
    """Torque of the trailing ankle's spring, Eq. 1."""
    return stiffness * (max_plantarflexion - ankle)


def torque_work(angle: float, torque: float, stiffness: float) -> float:
    """Work [J] over a rotation by `angle` of a torque that falls off linearly from `torque`."""
    return angle * (torque - 0.5 * stiffness * angle)


def trailing_reach(cos_ankle: float, leg_length: float, foot_length: float) -> float:
    """Distance AC [m] from the trailing toe to the mass."""
    return math.sqrt(
        leg_length * leg_length
        + foot_length * foot_length
        - 2 * leg_length * foot_length * cos_ankle
    )


def trailing_force(
    torque: float, sin_ankle: float, reach: float, leg_length: float, foot_length: float
) -> float:
    """Ground reaction F_A at the trailing toe, along AC = reach: moments on the foot, Eq. 5."""
    return torque * reach / (leg_length * foot_length * sin_ankle)


def unloading_arm(
    sin_ankle: float, sin_leg: float, leg_length: float, foot_length: float, separation: float
) -> float:
    """
    Force that a newton metre of trailing ankle torque takes off the leading leg [1/m].

    From the paper's F_B: F_A (cos(phi) sin(theta) - sin(phi) cos(theta)), F_A from Eq. 5, where
    |AC| cos(phi) = d - L sin(theta) and |AC| sin(phi) = L cos(theta), is
    -T (L - d sin(theta)) / (L l sin(psi)).
    """
    return (leg_length - separation * sin_leg) / (leg_length * foot_length * sin_ankle)


def pendulum_force(
    cos_leg: float, squared_rate: float, mass: float, gravity: float, leg_length: float
) -> float:
    """Ground reaction [N] on an inverted pendulum, m g cos(theta) - m L theta_dot^2."""
    return mass * (gravity * cos_leg - leg_length * squared_rate)


def trailing_leg_angle(
    ankle: float, sin_leg: float, leg_length: float, foot_length: float, separation: float
) -> float:
    """
    Angle of the trailing leg from the vertical, positive with the ankle ahead of the mass.

    The direction from the mass to the toe, turned back by the angle between leg and line CA.
    """
    cos_leg = math.sqrt(1.0 - sin_leg * sin_leg)
    toe = math.atan2(leg_length * sin_leg - separation, leg_length * cos_leg)
    foot = math.atan2(foot_length * math.sin(ankle), leg_length - foot_length * math.cos(ankle))
    return toe - foot


def trailing_leg_per_ankle(
    ankle: float,
    sin_leg: float,
    transmission: float,
    reach: float,
    leg_length: float,
    foot_length: float,
    separation: float,
) -> float:
    """Derivative of `trailing_leg_angle` by psi; `transmission` and `reach` as at that posture."""
    toe = transmission * leg_length * (leg_length - separation * sin_leg)
    foot = foot_length * (leg_length * math.cos(ankle) - foot_length)
    return -(toe + foot) / (reach * reach)
