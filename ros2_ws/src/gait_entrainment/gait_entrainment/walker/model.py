# Copyright 2026 The gait_entrainment authors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""
The walker's parameters in the form that the compiled functions take.

Speeds enter them squared, through one conserved number, `apex`: the squared angular velocity that
the mass would have at the apex if no torque acted any more [1/s^2], negative if it would not get
there. So, with h = 1 - cos(theta),

    theta_dot^2 = apex + (2 g / L) h(theta),    d apex = 2 T d psi / (m L^2),

constant in single stance, and in double stance the spring's work is a parabola in psi.
"""

from typing import Any, Final, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from gait_entrainment import geometry
from gait_entrainment.parameters import WalkerParameters, greatest

Floats = NDArray[np.float64]

# Gauss-Legendre nodes of one panel of double stance, and of a whole single stance. At Table 1 the
# Legendre coefficients of the whole unperturbed double stance fall by 3 each, so 24 nodes leave
# 3^-48 of it; those of single stance, which comes near a stall at the apex, fall by 2.2 each.
PANEL_NODES = 24
SINGLE_STANCE_NODES = 32

# Rows of a quadrature rule.
NODES: Final = 0
WEIGHTS: Final = 1
TAILS: Final = 2

# A panel is accepted if its last two Legendre coefficients are this small beside its mean. They
# fall like rho^-n and the quadrature error like rho^-2n, so the error is then about their square.
TAIL_TOLERANCE = 1e-8

# Pulses up to this fraction of the peak torque are cleared of fly-off by two numbers made once.
BOUNDED_PULSE = 0.25

# What the bounds must leave before a segment is cleared without a search: far above their own
# rounding, far below anything a walker would notice [N].
FORCE_MARGIN = 1e-6


class Model(Protocol):
    """Constants of one walker. Positions in double stance are psi, in single stance -theta."""

    mass: float
    leg_length: float
    foot_length: float
    separation: float
    gravity: float
    stiffness: float
    max_plantarflexion: float
    double_stance_start: float
    strike_position: float
    toe_off_position: float
    swing_hip: float
    """Angle of the trailing leg at toe-off."""
    swing_hip_slope: float
    """Its rate at toe-off, and next the ankle's, per unit of progress through single stance."""
    swing_ankle_slope: float
    per_energy: float
    """Squared rate per energy, 2 / (m L^2)."""
    per_drop: float
    """Squared rate per relative height, 2 g / L."""
    strike_drop: float
    restitution: float
    """Squared rate after a collision over that before it."""
    start_apex: float
    """`apex` right after a collision in the period-one gait."""
    toe_off_half_sine: float
    """sin(theta / 2)^2 at toe-off."""
    strike_hold: float
    """Force on the stance leg right before heel strike, but for the centrifugal part of apex."""
    rule: Floats
    """Gauss-Legendre panel, rows: nodes, weights, and what gives the last two coefficients."""
    whole_double_stance: Floats
    """The unperturbed double stance, rows: gain in squared rate since heel strike, weights."""
    whole_double_stance_apex: float
    """From this `apex` on up that quadrature has converged."""
    whole_single_stance: Floats
    """The same for a whole single stance."""
    whole_single_stance_apex: float
    least_gain: float
    """Least gain in squared rate over the unperturbed double stance."""
    least_hold: float
    """Least force on the leading leg over double stance, but for the centrifugal part of apex."""
    bounded_pulse: float
    bounded_hold: float
    """The same with a pulse of `bounded_pulse` from heel strike on."""


# One record in memory, of which the compiled functions hand on the address only.
_SHAPES: Final[dict[str, tuple[int, ...]]] = {
    "rule": (4, PANEL_NODES),
    "whole_double_stance": (2, PANEL_NODES),
    "whole_single_stance": (2, SINGLE_STANCE_NODES),
}
MODEL = np.dtype([(name, np.float64, _SHAPES.get(name, ())) for name in Model.__annotations__])


def _record(**values: Any) -> Model:
    record = np.zeros(1, MODEL)[0]
    for name in MODEL.fields or ():
        record[name] = values.pop(name)
    return cast(Model, record)


def _gauss_legendre(count: int) -> Floats:
    """Rows: nodes, weights, and the weights that give the last two Legendre coefficients."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    degrees = np.arange(count - 2, count)
    last_two = np.polynomial.legendre.legvander(nodes, count - 1)[:, degrees].T
    return np.vstack([nodes, weights, (degrees[:, None] + 0.5) * last_two * weights])


def _converged_apex(whole: Floats, rule: Floats) -> float:
    """
    Least `apex` from which on up a fixed quadrature (rows: gain, weights) has converged.

    The slower the walk, the closer the integrand's singularity; so the first of these speeds (from
    a stall up, by 5 %) that a panel would accept, and every later one too.
    """
    gain, weights = whole
    apexes = np.geomspace(1e-3, 1e4, 331) * np.ptp(gain) - gain.min()
    integrand = weights / rule[1] / np.sqrt(apexes[:, None] + gain)
    tail = np.abs(integrand @ rule[2:].T).sum(axis=1)
    refused = np.flatnonzero(tail > TAIL_TOLERANCE * 0.5 * (integrand @ rule[1]))
    first = refused[-1] + 1 if refused.size else 0
    return float(apexes[first]) if first < apexes.size else float("inf")


def make_model(p: WalkerParameters) -> Model:
    """Work out the constants of a walker."""
    start, end = p.double_stance_start, p.max_plantarflexion
    per_energy = 2 / (p.mass * p.leg_length**2)
    per_drop = 2 * p.gravity / p.leg_length
    strike_drop = geometry.drop(np.sin(p.leg_angle), np.cos(p.leg_angle))

    def leg_sine(psi: float) -> float:
        return geometry.leg_sine(np.cos(psi), p.leg_length, p.foot_length, p.toe_separation)

    def gain(psi: float) -> float:
        """Squared rate at psi, unperturbed, less `apex` at heel strike."""
        sine = leg_sine(psi)
        work = geometry.torque_work(psi - start, p.peak_torque, p.ankle_stiffness)
        return per_energy * work + per_drop * geometry.drop(sine, np.sqrt(1 - sine * sine))

    def transmission(psi: float) -> float:
        cosine = np.sqrt(1 - leg_sine(psi) ** 2)
        return geometry.leg_per_ankle(np.sin(psi), cosine, p.foot_length, p.toe_separation)

    def hold(psi: float, pulse: float) -> float:
        """Leading-leg force with a pulse on since heel strike, if `apex` was zero there."""
        sine = leg_sine(psi)
        arm = geometry.unloading_arm(
            np.sin(psi), sine, p.leg_length, p.foot_length, p.toe_separation
        )
        torque = pulse + geometry.spring_torque(psi, p.ankle_stiffness, end)
        squared_rate = gain(psi) + per_energy * pulse * (psi - start)
        carried = geometry.pendulum_force(
            np.sqrt(1 - sine * sine), squared_rate, p.mass, p.gravity, p.leg_length
        )
        return carried - arm * torque

    rule = _gauss_legendre(PANEL_NODES)
    half = 0.5 * (end - start)
    psi = start + half + half * rule[0]
    double_stance = np.array(
        [[gain(x) for x in psi], [transmission(x) * half for x in psi] * rule[1]]
    )
    single_rule = _gauss_legendre(SINGLE_STANCE_NODES)
    half = 0.5 * (p.leg_angle + p.toe_off_angle)
    theta = p.toe_off_angle - half + half * single_rule[0]
    single_stance = np.array(
        [per_drop * geometry.drop(np.sin(theta), np.cos(theta)), half * single_rule[1]]
    )
    least_gain = -greatest(lambda x: -gain(x), start, end)
    pulse = BOUNDED_PULSE * p.peak_torque
    toe_off = leg_sine(end)
    # The display path of the swing leg (docs/model.md) starts with the posture and the rates at
    # toe-off, here per unit of progress through single stance.
    lengths = (p.leg_length, p.foot_length, p.toe_separation)
    reach = geometry.trailing_reach(np.cos(end), p.leg_length, p.foot_length)
    hip_per_ankle = geometry.trailing_leg_per_ankle(
        end, toe_off, transmission(end), reach, *lengths
    )
    ankle_slope = (p.toe_off_angle + p.leg_angle) / transmission(end)
    return _record(
        mass=p.mass,
        leg_length=p.leg_length,
        foot_length=p.foot_length,
        separation=p.toe_separation,
        gravity=p.gravity,
        stiffness=p.ankle_stiffness,
        max_plantarflexion=end,
        double_stance_start=start,
        strike_position=p.leg_angle,
        toe_off_position=-p.toe_off_angle,
        swing_hip=geometry.trailing_leg_angle(end, toe_off, *lengths),
        swing_hip_slope=hip_per_ankle * ankle_slope,
        swing_ankle_slope=ankle_slope,
        per_energy=per_energy,
        per_drop=per_drop,
        strike_drop=strike_drop,
        restitution=p.restitution**2,
        start_apex=(p.speed_after_collision / p.leg_length) ** 2 - per_drop * strike_drop,
        toe_off_half_sine=0.5 * geometry.drop(toe_off, np.sqrt(1 - toe_off**2)),
        strike_hold=geometry.pendulum_force(
            np.cos(p.leg_angle), per_drop * strike_drop, p.mass, p.gravity, p.leg_length
        ),
        rule=rule,
        whole_double_stance=double_stance,
        whole_double_stance_apex=_converged_apex(double_stance, rule),
        whole_single_stance=single_stance,
        whole_single_stance_apex=max(0.0, _converged_apex(single_stance, single_rule)),
        least_gain=least_gain,
        least_hold=-greatest(lambda x: -hold(x, 0.0), start, end) - FORCE_MARGIN,
        bounded_pulse=pulse,
        bounded_hold=-greatest(lambda x: -hold(x, pulse), start, end) - FORCE_MARGIN,
    )
