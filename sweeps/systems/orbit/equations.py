r"""Equations of a rigid body on a Kepler ellipse, as described systems of planar motions and of tilts from them.

Axis 1 of the orbital frame points along the radius, 3 along the orbit's normal. The frame is rotated by the tilts alpha
about its axis 1 and beta about its new axis 2, and the body about axis 3 of the tilted frame, by
:math:`\delta = \delta_0 + x`, the first of the reference motion. The inertia tensor over I3 in the tilted frame,

.. math:: I_{11},\ I_{22} = \tfrac12 (A + B) \mp \tfrac12 D\cos 2\delta,\quad I_{12} = -\tfrac12 D\sin 2\delta,\quad
          I_{33} = 1, \qquad A = I_1/I_3,\ B = I_2/I_3,\ D = B - A

depends on :math:`2\delta` alone. So the equations have the orbit's period for half-integer resonances, too, and are the
same for a body that is turned by half a turn. The independent variable is the true anomaly f (of librations, whose
period is another one, a phase of which f is :math:`\rho` times as much). The angular momentum in the tilted frame,
:math:`\mathbf M`, in units of I3 times the mean motion times :math:`(1 - e^2)^{-3/2}`, and the angular velocity
:math:`\mathbf w = I^{-1}\mathbf M/m` obey

.. math:: \mathbf M' = \mathbf M\times\mathbf F + 3 v\,\mathbf u\times I\mathbf u,\qquad
          \mathbf F = (w_1, w_2, w_1\tan\beta + \rho\cos\alpha/\cos\beta), \qquad \mathbf u = (\cos\beta, 0, \sin\beta)

          \alpha' = (w_1 + \rho\sin\beta\cos\alpha)/\cos\beta,\quad \beta' = w_2 - \rho\sin\alpha,\quad
          x' = M_3/m - F_3 - \delta_0', \qquad m = (1 + e\cos f)^2/\rho,\quad v = (1 + e\cos f)\rho

:math:`M_3 = P + y` with :math:`P = m (\rho + \delta_0')` of the reference motion. The momenta of alpha, beta and x are
:math:`M_1\cos\beta + M_3\sin\beta, M_2` and :math:`M_3`: the equations are Hamilton's. All tilts vanish in planar
motions; then x obeys Beletsky's equation. Tilts are even in planar terms, and odd in others: both parts separate.

*Infinitesimal tilts* are integrated in the canonical states :math:`(\alpha, M_2;\ p_\alpha = M_1 + M_3\beta, -\beta)`:

.. math:: M_1 = p_\alpha - M_3\beta,\quad \alpha' = w_1 + \rho\beta,\quad p_\alpha' = \rho(M_2 - M_3\alpha),\quad
          \beta' = w_2 - \rho\alpha,\quad M_2' = M_3 w_1 - \rho M_1 + 3v(I_{11} - 1)\beta

A motion from x = 0 is odd in time: there x(-f) = -x(f), and with :math:`\alpha, M_2` even, :math:`p_\alpha, \beta` odd,
the equations are the same at -f. So half a period gives the matrix of the whole.

Source: derived from Euler's equations; Beletsky, Motion of an Artificial Satellite about its Center of Mass (1966).
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ellipkm1

from kernels.estimator import statuses
from sweeps.mechanics import System, periodic
from sweeps.mechanics.model import Model
from sweeps.systems.orbit.odd_motions import find_odd_motions
from sweeps.systems.orbit.shapes import inertia_ratios, margin_of

RESONANCES = ("synchronous", "spin_orbit")  # motions whose planar motion is found by Newton's method
ROUNDING = 4.0 * float(np.finfo(np.float64).eps)  # relative error of a rate in closed form
BLOCK = (2, 3, 4, 5)  # tilts in the system of the planar motion and canonical tilts: (x, y; alpha, M2; p_alpha, -beta)


class PlanarMotion(NamedTuple):
    """A planar reference motion, in SymPy's expressions (module docstring)."""

    anomaly_rate: Any  #: rho, true anomaly by the independent variable
    momentum: Any  #: P
    momentum_rate: Any  #: derivative of P
    angle: Any  #: angle of axis 1 from the radius


def planar_motion(system: System, is_symmetric: bool = False) -> PlanarMotion:
    """Add the parameters of a motion to a system, of a symmetric body if so, and return its reference motion."""
    from sympy import Integer, Rational, cos, sin

    time = system.time
    eccentricity = system.parameter("eccentricity", default=0.1, least=0.0, most=0.99)
    if is_symmetric:
        spin = system.parameter("spin", default=1.0, meaning="spin over the mean motion")
        return PlanarMotion(Integer(1), spin * (1 - eccentricity**2) ** Rational(3, 2), Integer(0), Integer(0))
    pace = system.parameter("pace", default=1.0, positive=True, meaning="true anomaly by the phase; 1 unless e = 0")
    spin = system.parameter("p", default=1.0, step=0.5, meaning="rotations per orbit")
    system.parameter("asymmetry", default=0.2, meaning="(I2 - I1)/I3")
    radius = 1 + eccentricity * cos(time)
    return PlanarMotion(pace, spin * radius**2, -2 * eccentricity * spin * sin(time) * radius, (spin - 1) * time)


@cache
def planar_model() -> Model:
    """Return the described system of x alone: Beletsky's equation, from T = m x'²/2 and V."""
    from sympy import Rational, cos, pi

    system = System("Planar rotation on an orbit")
    base, inertia, tide, asymmetry = _coefficients(system)
    angle = system.coordinate("x", "rad", periodic=True, size=1)
    system.kinetic_energy(inertia * system.velocity(angle) ** 2 / 2)
    double = cos(2 * (base.angle + angle))
    system.potential(base.momentum_rate * angle - Rational(3, 4) * tide * asymmetry * double)
    system.is_reversible = True
    system.period(2 * pi)
    system.equilibrium("reference", {angle: 0})
    return Model(system, (0, 1))


@cache
def orbit_model() -> Model:
    """Return the described system of all states, by the full equations."""
    from sympy import cos, sin

    system, names = System("Body on an orbit"), ("x", "alpha", "beta", "y", "M1", "M2")
    base, inertia, tide, asymmetry = _coefficients(system)
    angle, alpha, beta, excess, *momenta = (system.state(name, bounds=(-1, 1), size=1) for name in names)
    momenta.append(base.momentum + excess)
    first, second, cross, pull, torque = _inverse_tensor(system, base, angle, inertia, tide, asymmetry)
    rate_1, rate_2 = first * momenta[0] + cross * momenta[1], second * momenta[1] + cross * momenta[0]
    secant, tangent, product = 1 / cos(beta), sin(beta) / cos(beta), sin(beta) * cos(beta)
    frame_rate = rate_1 * tangent + base.anomaly_rate * cos(alpha) * secant  # F3
    rates = (
        excess / inertia + base.anomaly_rate - frame_rate,
        rate_1 * secant + base.anomaly_rate * cos(alpha) * tangent,
        rate_2 - base.anomaly_rate * sin(alpha),
        momenta[0] * rate_2 - momenta[1] * rate_1 + torque * cos(beta) ** 2 - base.momentum_rate,
        momenta[1] * frame_rate - momenta[2] * rate_2 - torque * product,
        momenta[2] * rate_1 - momenta[0] * frame_rate + product * pull,
    )
    return _close_system(system, dict(zip((s.symbol for s in system.states.values()), rates, strict=True)))


@cache
def tilt_model(motion: str) -> Model:
    """Return the described system of infinitesimal tilts in canonical states, about planar motions (x, y).

    Of a symmetric body (spin_normal), which rotates uniformly, that of the tilts alone.
    """
    is_symmetric = motion == "spin_normal"
    system = System("Tilts of a body on an orbit")
    base, inertia, tide, asymmetry = _coefficients(system, is_symmetric)
    planar_states = () if is_symmetric else ("x", "y")
    states = [
        system.state(name, bounds=(-1, 1), size=1) for name in (*planar_states, "alpha", "M2", "p_alpha", "minus_beta")
    ]
    angle, excess, *tilts = states if planar_states else (0, 0, *states)
    alpha, momentum_2, p_alpha, minus_beta = tilts
    first, second, cross, pull, torque = _inverse_tensor(system, base, angle, inertia, tide, asymmetry)
    spin, rho = base.momentum + excess, base.anomaly_rate
    momentum_1 = p_alpha + spin * minus_beta
    rate_1, rate_2 = first * momentum_1 + cross * momentum_2, second * momentum_2 + cross * momentum_1
    rates = {
        alpha: rate_1 - rho * minus_beta,
        momentum_2: spin * rate_1 - rho * momentum_1 - pull * minus_beta,
        p_alpha: rho * (momentum_2 - spin * alpha),
        minus_beta: rho * alpha - rate_2,
    }
    if planar_states:
        rates |= {angle: excess / inertia, excess: torque - base.momentum_rate}
    return _close_system(system, rates, None if is_symmetric else BLOCK)


def _close_system(system, rates, block=None):
    """Return the model of a system with the rates of its states, Hamilton's equations of the orbit's period."""
    from sympy import pi

    for state, rate in rates.items():
        system.rate(state, rate)
    system.is_hamiltonian = system.is_reversible = True
    system.period(2 * pi)
    system.equilibrium("reference", dict.fromkeys(rates, 0))
    return Model(system, block)


def _inverse_tensor(system, base, angle, inertia, tide, asymmetry):
    """Return 1/(m I) of axes 1 and 2 and of both, 3 v (I11 - I33) and 3 v I12, at an angle x."""
    from sympy import cos, sin

    moment = system.parameter("I1_over_I3", default=0.6, positive=True)
    other_moment, double = moment + asymmetry, 2 * (base.angle + angle)
    mean = (1 / moment + 1 / other_moment) / 2  # the inverse tensor depends on 2 δ, too
    half = asymmetry / (2 * moment * other_moment)
    pull = (moment + other_moment) / 2 - 1 - asymmetry / 2 * cos(double)
    torque = -3 * tide * asymmetry / 2 * sin(double)
    return (
        (mean + half * cos(double)) / inertia,
        (mean - half * cos(double)) / inertia,
        half * sin(double) / inertia,
        3 * tide * pull,
        torque,
    )


def _coefficients(system, is_symmetric=False):
    """Return the reference motion, m, v and D of a motion."""
    from sympy import cos

    base, parameters = planar_motion(system, is_symmetric), system.parameters
    asymmetry = parameters["asymmetry"].symbol if "asymmetry" in parameters else 0
    radius = 1 + parameters["eccentricity"].symbol * cos(system.time)
    return base, radius**2 / base.anomaly_rate, radius * base.anomaly_rate, asymmetry


def arguments_of(points, motion: str) -> dict[str, np.ndarray]:
    """Return the parameters of the model of a motion at points of the system, and the perturbation's size."""
    ratio, asymmetry = inertia_ratios(points)
    unit = np.ones(ratio.size)
    arguments = {"I1_over_I3": ratio, "asymmetry": asymmetry, "eccentricity": points.get("eccentricity", 0.0 * unit)}
    arguments["pace"] = unit
    if motion == "libration":
        with np.errstate(invalid="ignore"):
            arguments["frequency"] = np.sqrt(3.0 * asymmetry)
            arguments["rate"] = arguments["frequency"] * np.sin(points["amplitude"])
            quarter = ellipkm1(np.cos(points["amplitude"]) ** 2) / arguments["frequency"]
        arguments["pace"] = quarter / (0.5 * np.pi)
    if motion == "spin_normal":
        arguments["spin"] = points["spin"]
    return arguments | {"p": points.get("p", unit), "epsilon": points.get("epsilon", unit)}


def planar_motions(arguments: dict[str, np.ndarray]) -> periodic.BaseMotions:
    """Return the planar motions of resonances."""
    model, slot = planar_model(), np.zeros(arguments["p"].size, dtype=int)
    rate, branch = find_odd_motions(model, arguments)
    starts = np.column_stack([0.0 * rate, rate])
    base = periodic.BaseMotions(model, model.parameters(arguments, slot.size), slot, starts=starts)
    base.branch = branch
    return base


def tilt_motions(arguments, motion: str, planar: periodic.BaseMotions | None = None) -> periodic.BaseMotions:
    """Return the motions of the system of tilts; `planar` has the planar motions of resonances."""
    model, size, known = tilt_model(motion), arguments["p"].size, None
    slot = np.zeros(size, dtype=int)
    if motion == "libration":  # it starts at the radius, with the rate that its energy gives
        nodes, rounding = np.stack([0.0 * slot, arguments["rate"]], axis=1)[:, None], np.full(size, ROUNDING)
        known = periodic.KnownMotions(nodes, slot + 1, np.ones((size, 2)), 0.0 * slot, slot + statuses.OK, rounding)
    elif planar:
        anomaly = 2.0 * np.pi * np.arange(planar.nodes.shape[1]) / planar.num_nodes[:, None]
        inertia = (1.0 + arguments["eccentricity"][:, None] * np.cos(anomaly)) ** 2
        nodes = planar.nodes * np.stack([np.ones_like(inertia), inertia], axis=2)  # y = m x'
        settings = planar.num_nodes, planar.sizes, planar.residual, planar.status, planar.error
        known = periodic.KnownMotions(nodes, *settings)
    return periodic.BaseMotions(model, model.parameters(arguments, size), slot, known)


def start_of_motion(point: dict[str, np.ndarray]) -> tuple[float, float, float]:
    """Return the period in radians of the true anomaly, and δ and δ' at the start, of a single point.

    The kind of motion follows from the names of its parameters.
    """
    motion = "libration" if "amplitude" in point else "spin_normal" if "spin" in point else "synchronous"
    columns = _start_columns(arguments_of(point, motion), motion)
    return float(columns["period"][0]), float(columns["angle_start"][0]), float(columns["rate_start"][0])


def _start_columns(arguments, motion, base=None):
    """Return period (radians of the true anomaly) and start of motions; `base` has planar motions, if known."""
    eccentricity, kind = arguments["eccentricity"], np.int8
    size = eccentricity.size
    angle, branch = np.zeros(size), np.ones(size, dtype=kind)
    if motion == "libration":
        rate = arguments["rate"]
    elif motion == "spin_normal":
        rate = arguments["spin"] * (1.0 - eccentricity**2) ** 1.5 / (1.0 + eccentricity) ** 2 - 1.0
    else:
        base = planar_motions(arguments) if base is None else base
        angle, rate = base.start.T + np.array([angle, arguments["p"] - 1.0])
        branch = np.where(base.residual <= periodic.MAX_RESIDUAL, base.branch, 0).astype(kind)
    return {"period": 2.0 * np.pi * arguments["pace"], "angle_start": angle, "rate_start": rate, "branch": branch}


def survey(points, motion: str, tolerance: float, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Return the columns `names` of points of the system; see `sweeps.mechanics.periodic`.

    Args:
        points: the system's arguments, each an array (n,).
        motion: the reference motion.
        tolerance: truncation error over a period, relative to the monodromy matrix.
        names: names of the columns.
    """
    plane = np.asarray(points["plane"])
    mean_motion = np.sqrt(points["mu"] / points["semi_major_axis"]) / points["semi_major_axis"]
    count = 4 if (plane == "out_of_plane").any() else 2
    columns: dict[str, np.ndarray] = {}
    motions: dict[tuple, periodic.BaseMotions] = {}
    for kind in np.unique(plane):
        members = plane == kind
        plane_points = {name: np.asarray(values)[members] for name, values in points.items()}
        measured = _survey_plane(plane_points, motion, str(kind), tolerance, motions)
        orbits = measured["period"] / (2.0 * np.pi)  # periods are in radians of the true anomaly
        for name in [key for key in measured if key.startswith("growth_per_period")]:
            measured[name.replace("period", "orbit")] = measured[name] / orbits
        for name, values in measured.items():
            if name.startswith(("exponent", "growth_rate")):
                values = (values.T * mean_motion[members] / orbits).T
            shape = (plane.size, count) if values.ndim == 2 else (plane.size,)
            target = columns.setdefault(name, np.full(shape, np.nan if values.dtype == float else 0, values.dtype))
            if values.ndim == 2:
                target[members, : values.shape[1]] = values
            else:
                target[members] = values
    columns["period"] = columns["period"] / mean_motion
    columns["triangle_margin"] = margin_of(points)
    return {name: columns.get(name, np.full(plane.size, np.nan)) for name in names}


def _survey_plane(points, motion, plane, tolerance, motions):
    """Return the columns of points of one plane, with periods in radians of the true anomaly.

    Planar motions are stored in `motions`, by the arguments, as the second plane has the same.
    """
    arguments, base = arguments_of(points, motion), None
    arguments["equilibrium"] = np.zeros(arguments["p"].size, dtype=int)
    if motion in RESONANCES:
        key = tuple(values.tobytes() for values in arguments.values())
        base = motions[key] = motions.get(key) or planar_motions(arguments)
    motions_of_plane = base if base and plane == "in_plane" else tilt_motions(arguments, motion, base)
    columns = periodic.survey(motions_of_plane.model, arguments, tolerance, motions_of_plane)
    return columns | _start_columns(arguments, motion, base)
