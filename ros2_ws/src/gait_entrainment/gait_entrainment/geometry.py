# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
Closed forms of the walker's linkage, each defined once.

The whole model rests on one triangle. The leading foot's heel B is the origin, x forward, z up.
The point mass C is on the leading leg, which leans back by theta: C = L (-sin theta, cos theta).
The trailing toe A rests at (-d, 0) with d = 2 L sin(alpha) - l. The trailing ankle D joins the
foot AD = l and the leg DC = L at the angle psi. The law of cosines for the side AC gives

    L^2 + d^2 - 2 L d sin(theta) = L^2 + l^2 - 2 L l cos(psi),

so sin(theta) and cos(psi) are linear in each other. This is the paper's psi(theta), solved for
the sine. As the walker moves forward, theta falls and psi grows.

`body` is any object with the attributes that a function reads, named as in the parameters:
`leg_length` L, `foot_length` l, `toe_separation` d, `max_plantarflexion` mu, `ankle_stiffness` k,
`mass`, `gravity`. The functions use only `math` and do not call each other: the parameters use
them as they are, and the walker compiles each one. Lengths are in m, angles in rad, forces in N,
torques in N m, masses in kg, rates in rad/s. Equation numbers are those of Ahn and Hogan (2012).
"""

import math
from typing import Any


def leg_sine(body: Any, cos_ankle: float) -> Any:
    """Sine of the leading leg's lean theta, from the cosine of the trailing ankle's angle psi."""
    leg, foot, gap = body.leg_length, body.foot_length, body.toe_separation
    return (gap * gap - foot * foot) / (2 * leg * gap) + foot / gap * cos_ankle


def ankle_cosine(body: Any, sin_leg: float) -> Any:
    """Cosine of the trailing ankle's angle psi, from sin(theta): the inverse of `leg_sine`."""
    leg, foot, gap = body.leg_length, body.foot_length, body.toe_separation
    return (sin_leg - (gap * gap - foot * foot) / (2 * leg * gap)) * gap / foot


def leg_per_ankle(body: Any, sin_ankle: float, cos_leg: float) -> Any:
    """Transmission -d theta / d psi of the linkage (positive): the derivative of `leg_sine`."""
    return body.foot_length / body.toe_separation * sin_ankle / cos_leg


def drop(sin_leg: float, cos_leg: float) -> float:
    """
    Height of the mass below the apex, 1 - cos(theta), in leg lengths.

    This form avoids the difference, which would lose the digits of a small drop.
    """
    return sin_leg * sin_leg / (1.0 + cos_leg)


def spring_torque(body: Any, ankle: float) -> Any:
    """Torque of the trailing ankle's spring, Eq. 1."""
    return body.ankle_stiffness * (body.max_plantarflexion - ankle)


def torque_work(angle: float, torque: float, stiffness: float) -> float:
    """Work [J] of a torque that falls off linearly from `torque`, over a rotation by `angle`."""
    return angle * (torque - 0.5 * stiffness * angle)


def trailing_reach(body: Any, cos_ankle: float) -> float:
    """Distance AC [m] from the trailing toe to the mass."""
    leg, foot = body.leg_length, body.foot_length
    return math.sqrt(leg * leg + foot * foot - 2 * leg * foot * cos_ankle)


def trailing_force(body: Any, torque: float, sin_ankle: float, reach: float) -> Any:
    """Ground reaction F_A at the trailing toe, along AC = reach: moments on the foot (Eq. 5)."""
    return torque * reach / (body.leg_length * body.foot_length * sin_ankle)


def unloading_arm(body: Any, sin_ankle: float, sin_leg: float) -> Any:
    """
    Force taken off the leading leg per unit of trailing ankle torque [1/m].

    In the paper's F_B, the term F_A (cos(phi) sin(theta) - sin(phi) cos(theta)), with F_A from
    Eq. 5, |AC| cos(phi) = d - L sin(theta) and |AC| sin(phi) = L cos(theta), equals
    -T (L - d sin(theta)) / (L l sin(psi)).
    """
    leg, foot = body.leg_length, body.foot_length
    return (leg - body.toe_separation * sin_leg) / (leg * foot * sin_ankle)


def pendulum_force(body: Any, cos_leg: float, squared_rate: float) -> Any:
    """Ground reaction [N] on an inverted pendulum, m g cos(theta) - m L theta_dot^2."""
    return body.mass * (body.gravity * cos_leg - body.leg_length * squared_rate)


def trailing_leg_angle(body: Any, ankle: float, sin_leg: float) -> float:
    """
    Angle of the trailing leg from the vertical, positive with the ankle ahead of the mass.

    It is the direction from the mass to the toe, turned back by the angle between leg and CA.
    """
    leg, foot = body.leg_length, body.foot_length
    cos_leg = math.sqrt(1.0 - sin_leg * sin_leg)
    to_toe = math.atan2(leg * sin_leg - body.toe_separation, leg * cos_leg)
    return to_toe - math.atan2(foot * math.sin(ankle), leg - foot * math.cos(ankle))


def trailing_leg_per_ankle(
    body: Any, ankle: float, sin_leg: float, transmission: float, reach: float
) -> Any:
    """Derivative of `trailing_leg_angle` with respect to psi, from `transmission` and `reach`."""
    leg, foot = body.leg_length, body.foot_length
    to_toe = transmission * leg * (leg - body.toe_separation * sin_leg)
    return -(to_toe + foot * (leg * math.cos(ankle) - foot)) / (reach * reach)
