# SPDX-FileCopyrightText: 2026 The gait_entrainment authors
# SPDX-License-Identifier: Apache-2.0

"""
The walker's parameters in the form that the compiled functions take.

Speeds enter squared, through one conserved quantity, `apex`: the squared angular velocity [1/s^2]
that the mass would have at the apex if no further torque acted, negative if it would not get
there. With h = 1 - cos(theta),

    theta_dot^2 = apex + (2 g / L) h(theta),    d apex = 2 T d psi / (m L^2).

`apex` is constant in single stance. In double stance the spring's work is a parabola in psi.
"""

from typing import Any, Final, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from gait_entrainment import geometry
from gait_entrainment.parameters import WalkerParameters

Floats = NDArray[np.float64]
Stamps = NDArray[np.int64]

# Gauss-Legendre nodes of one panel of double stance, and of a whole single stance. With Table 1
# the Legendre coefficients of the whole unperturbed double stance fall by a factor of 3 each, so
# 20 nodes leave 3^-40. In single stance, which is near a stall at the apex, they fall by 2.2 each.
PANEL_NODES = 20
SINGLE_STANCE_NODES = 28

# Rows of a quadrature rule.
NODES: Final = 0
WEIGHTS: Final = 1
TAILS: Final = 2

# A panel is accepted if its last two Legendre coefficients are this small relative to its mean.
# They fall as rho^-n and the quadrature error as rho^-2n, so the error is about their square.
TAIL_TOLERANCE = 1e-8

# For pulses up to this fraction of the peak torque, two precomputed numbers can rule out fly-off.
BOUNDED_PULSE = 0.25

# The bounds that clear a segment without a search are minima on a grid of this many points. The
# required margin is far larger than what a minimum between two points can hide.
BOUND_POINTS = 1025
BOUND_MARGIN = 1e-3  # of the weight, and of the squared rate g / L

# Constants are computed in extended precision if the machine has it: an error in the last bit of
# a constant would add up over the steps, whereas rounding errors of the arithmetic average out.
Extended: Any = np.longdouble
PI: Any = Extended("3.14159265358979323846264338327950288")


class Model(Protocol):
    """
    Constants of one walker. Positions in double stance are psi, in single stance -theta.

    In single stance, and for gravity, theta is measured from the vertical; in the linkage, from
    the ground's normal. The two differ only on a slope. `apex` is the squared rate that the walker
    would have at the apex; a hold is the force on the leading or stance leg without the
    centrifugal part due to `apex`.
    """

    mass: float
    leg_length: float
    foot_length: float
    toe_separation: float
    gravity: float
    ankle_stiffness: float
    max_plantarflexion: float
    double_stance_start: float
    strike_position: float
    toe_off_position: float
    swing_hip: float  # angle of the trailing leg at toe-off
    swing_hip_slope: float  # its rate there, per unit of progress through single stance
    swing_ankle_slope: float  # the same for the ankle
    per_energy: float  # squared rate per energy, 2 / (m L^2)
    per_drop: float  # squared rate per relative height, 2 g / L
    strike_gain: float  # squared rate right before heel strike minus that at the apex
    start_gain: float  # the same right after it; uphill the new leading leg leans further
    slope_sine: float  # of the angle by which the ground rises
    slope_cosine: float
    restitution: float  # squared rate after a collision divided by that before it
    start_apex: float  # `apex` right after a collision in the period-one gait
    toe_off_half_sine: float  # sin(theta / 2)^2 at toe-off
    strike_hold: float  # right before heel strike
    rule: Floats  # Gauss-Legendre, rows: nodes, weights, weights of the last two coefficients
    whole_double_stance: Floats  # unperturbed, rows: gain in squared rate, weights
    whole_double_stance_apex: float  # from this `apex` up, that quadrature has converged
    whole_single_stance: Floats  # the same for a whole single stance
    whole_single_stance_apex: float
    least_gain: float  # least gain in squared rate over the unperturbed double stance
    least_hold: float  # over the unperturbed double stance
    bounded_pulse: float
    bounded_hold: float  # the least hold with a pulse of `bounded_pulse` from heel strike on


# One record in memory; the compiled functions pass on only its address.
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
    """
    Rows: nodes, weights, and the weights that give the last two Legendre coefficients.

    numpy's nodes are accurate to rounding, but its weights near the ends only to 1e-13. Newton
    steps in extended precision improve both.
    """
    nodes = np.polynomial.legendre.leggauss(count)[0].astype(Extended)
    for _ in range(2):
        legendre = np.polynomial.legendre.legvander(nodes, count).T
        slope = count * (legendre[count - 1] - nodes * legendre[count]) / (1 - nodes**2)
        nodes = nodes - legendre[count] / slope
    weights = 2 / ((1 - nodes**2) * slope**2)
    degrees = np.arange(count - 2, count)
    last_two = (degrees[:, None] + 0.5) * legendre[degrees] * weights
    return np.vstack([nodes, weights, last_two])


def _converged_apex(whole: Floats, rule: Floats) -> float:
    """
    Least `apex` from which up a fixed quadrature (rows: gain, weights) has converged.

    The slower the walk, the closer the integrand's singularity. So this is the first value, going
    up from a stall in steps of 5 %, that a panel would accept along with all larger ones.
    """
    gain, weights = whole
    apexes = np.geomspace(1e-3, 1e4, 331) * np.ptp(gain) - gain.min()
    integrand = weights / rule[1] / np.sqrt(apexes[:, None] + gain)
    tail = np.abs(integrand @ rule[2:].T).sum(axis=1)
    refused = np.flatnonzero(tail > TAIL_TOLERANCE * 0.5 * (integrand @ rule[1]))
    first = refused[-1] + 1 if refused.size else 0
    return float(apexes[first]) if first < apexes.size else float("inf")


class _Extended:
    """A walker's parameters on a slope, and functions of the trailing ankle's angle psi."""

    def __init__(self, p: WalkerParameters, slope: float) -> None:
        self.rise = Extended(slope)
        self.mass, self.gravity, self.ankle_stiffness = p.mass, p.gravity, p.ankle_stiffness
        self.leg_length, self.foot_length = p.leg_length, p.foot_length
        self.alpha, self.max_plantarflexion = Extended(p.leg_angle), Extended(p.max_plantarflexion)
        self.start = PI / 2 - self.alpha
        self.toe_separation = 2 * p.leg_length * np.sin(self.alpha) - p.foot_length
        self.per_energy = 2 / Extended(p.mass * p.leg_length**2)
        self.per_drop = 2 * p.gravity / Extended(p.leg_length)

    def leg_sine(self, psi: Any) -> Any:
        return geometry.leg_sine(self, np.cos(psi))

    def transmission(self, psi: Any) -> Any:
        cosine = np.sqrt(1 - self.leg_sine(psi) ** 2)
        return geometry.leg_per_ankle(self, np.sin(psi), cosine)

    def lean(self, psi: Any) -> tuple[Any, Any]:
        """Sine and cosine of the leading leg's angle from the vertical."""
        sine, up, along = self.leg_sine(psi), np.cos(self.rise), np.sin(self.rise)
        cosine = np.sqrt(1 - sine**2)
        return sine * up + cosine * along, cosine * up - sine * along

    def work(self, psi: Any) -> Any:
        """Work of the spring from heel strike to psi [J]."""
        peak = geometry.spring_torque(self, self.start)
        return geometry.torque_work(psi - self.start, peak, self.ankle_stiffness)

    def gain(self, psi: Any) -> Any:
        """Unperturbed squared rate at psi, minus `apex` at heel strike."""
        fall = geometry.drop(*self.lean(psi))
        return self.per_energy * self.work(psi) + self.per_drop * fall

    def hold(self, psi: Any, pulse: float) -> Any:
        """Leading-leg force with a pulse since heel strike, if `apex` was zero there."""
        torque = pulse + geometry.spring_torque(self, psi)
        squared_rate = self.gain(psi) + self.per_energy * pulse * (psi - self.start)
        carried = geometry.pendulum_force(self, self.lean(psi)[1], squared_rate)
        return carried - geometry.unloading_arm(self, np.sin(psi), self.leg_sine(psi)) * torque


def make_model(p: WalkerParameters, slope: float = 0.0) -> Model:
    """
    Compute the constants of a walker on ground that rises by `slope` [rad].

    A slope only turns gravity relative to the ground and the linkage. It is an extension of the
    paper; samples of the walker assume level ground.
    """
    body = _Extended(p, slope)
    alpha, start, end, per_drop = body.alpha, body.start, body.max_plantarflexion, body.per_drop
    rise = body.rise
    strike_gain = per_drop * geometry.drop(np.sin(alpha - rise), np.cos(alpha - rise))
    start_gain = per_drop * geometry.drop(np.sin(alpha + rise), np.cos(alpha + rise))
    restitution = np.cos(2 * alpha) ** 2
    after_strike = body.per_energy * body.work(end) * restitution / (1 - restitution)
    pulse = BOUNDED_PULSE * p.peak_torque
    grid = np.linspace(float(start), float(end), BOUND_POINTS)
    spare_force = BOUND_MARGIN * (p.mass * p.gravity)

    # Whole stances, at the nodes of a fixed quadrature.
    rule, single_rule = _gauss_legendre(PANEL_NODES), _gauss_legendre(SINGLE_STANCE_NODES)
    half = 0.5 * (end - start)
    psi = start + half + half * rule[NODES]
    double_stance = np.array([body.gain(psi), half * rule[WEIGHTS] * body.transmission(psi)])
    toe_off_sine = body.leg_sine(end)
    toe_off = np.arcsin(toe_off_sine)
    half = 0.5 * (alpha + toe_off)
    theta = toe_off - half + half * single_rule[NODES] + rise
    fallen = per_drop * geometry.drop(np.sin(theta), np.cos(theta))
    single_stance = np.array([fallen, half * single_rule[WEIGHTS]])

    # The display path of the swing leg (docs/model.md) starts with the posture and the rates at
    # toe-off, here per unit of progress through single stance.
    turn, reach = body.transmission(end), geometry.trailing_reach(body, np.cos(end))
    hip_per_ankle = geometry.trailing_leg_per_ankle(body, end, toe_off_sine, turn, reach)
    return _record(
        mass=p.mass,
        leg_length=p.leg_length,
        foot_length=p.foot_length,
        toe_separation=body.toe_separation,
        gravity=p.gravity,
        ankle_stiffness=p.ankle_stiffness,
        max_plantarflexion=end,
        double_stance_start=start,
        strike_position=alpha - rise,
        toe_off_position=-toe_off - rise,
        swing_hip=geometry.trailing_leg_angle(body, end, toe_off_sine),
        swing_hip_slope=hip_per_ankle * (2 * half / turn),
        swing_ankle_slope=2 * half / turn,
        per_energy=body.per_energy,
        per_drop=per_drop,
        strike_gain=strike_gain,
        start_gain=start_gain,
        slope_sine=np.sin(rise),
        slope_cosine=np.cos(rise),
        restitution=restitution,
        start_apex=after_strike - strike_gain + (strike_gain - start_gain) / (1 - restitution),
        toe_off_half_sine=0.5 * geometry.drop(body.lean(end)[0], np.cos(toe_off + rise)),
        strike_hold=geometry.pendulum_force(body, np.cos(alpha - rise), strike_gain),
        rule=rule,
        whole_double_stance=double_stance,
        whole_double_stance_apex=_converged_apex(double_stance, rule),
        whole_single_stance=single_stance,
        whole_single_stance_apex=max(0.0, _converged_apex(single_stance, single_rule)),
        least_gain=body.gain(grid).min() - BOUND_MARGIN * p.gravity / p.leg_length,
        least_hold=body.hold(grid, 0.0).min() - spare_force,
        bounded_pulse=pulse,
        bounded_hold=body.hold(grid, pulse).min() - spare_force,
    )


def start_apex(model: Any, speed: float | None) -> float:
    """
    `apex` of a walker right after a heel strike with the mass at `speed` [m/s].

    None means the period-one gait's. Raises ValueError if `speed` is not positive and finite.
    """
    if speed is None:
        return float(model["start_apex"])
    if not 0.0 < speed < float("inf"):
        raise ValueError(f"initial_speed {speed} m/s is not a positive, finite number")
    return float((speed / model["leg_length"]) ** 2 - model["start_gain"])
