r"""Equations of a rigid body on a Kepler ellipse, as described systems of a reference motion and tilts from it.

Axis 1 of the orbital frame points along the radius, 3 along the orbit's normal. The frame is rotated by the tilts alpha
about its axis 1 and beta about its new axis 2, and the body about axis 3 of the tilted frame, by
:math:`\delta = \delta_0 + x`, the first of the reference motion. The inertia tensor over I3 in the tilted frame,

.. math:: I_{11},\ I_{22} = \tfrac12 (A + B) \mp \tfrac12 D\cos 2\delta,\quad I_{12} = -\tfrac12 D\sin 2\delta,\quad
          I_{33} = 1, \qquad A = I_1/I_3,\ B = I_2/I_3,\ D = B - A

depends on :math:`2\delta` alone. So the equations have the orbit's period for half-integer resonances, too, and are the
same for a body that is turned by half a turn. The independent variable is the true anomaly f (of librations a phase, at
the rate :math:`1/\rho`). The angular momentum in the tilted frame, :math:`\mathbf M`, in units of I3 times the mean
motion times :math:`(1 - e^2)^{-3/2}`, and the angular velocity :math:`\mathbf w = I^{-1}\mathbf M/m` obey

.. math:: \mathbf M' = \mathbf M\times\mathbf F + 3 v\,\mathbf u\times I\mathbf u,\qquad
          \mathbf F = (w_1, w_2, w_1\tan\beta + \rho\cos\alpha/\cos\beta), \qquad \mathbf u = (\cos\beta, 0, \sin\beta)

          \alpha' = (w_1 + \rho\sin\beta\cos\alpha)/\cos\beta,\quad \beta' = w_2 - \rho\sin\alpha,\quad
          x' = M_3/m - F_3 - \delta_0', \qquad m = (1 + e\cos f)^2/\rho,\quad v = (1 + e\cos f)\rho

:math:`M_3 = P + y` with :math:`P = m (\rho + \delta_0')` of the reference motion. The momenta of alpha, beta and x are
:math:`M_1\cos\beta + M_3\sin\beta, M_2` and :math:`M_3`: the equations are Hamilton's. All tilts vanish in planar
motions; then x obeys Beletsky's equation. Tilts are even in planar terms, and odd in others: both parts separate.

Source: derived from Euler's equations; Beletsky, Motion of an Artificial Satellite about its Center of Mass (1966).
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ellipkm1

from sweeps.mechanics import System, periodic
from sweeps.mechanics.model import Model
from sweeps.systems.orbit.odd_motions import find_odd_motions
from sweeps.systems.orbit.shapes import inertia_ratios, margin_of

#: motion of a definition → kind of reference motion
KINDS = {"synchronous": "resonance", "spin_orbit": "resonance"} | {name: name for name in ("libration", "spin_normal")}
IN_PLANE, OUT_OF_PLANE = np.array([0, 3]), np.array([1, 2, 4, 5])  # x, y and the tilts in the system of six states


class PlanarMotion(NamedTuple):
    """A planar reference motion, in SymPy's expressions (module docstring)."""

    anomaly_rate: Any  #: rho, true anomaly by the independent variable
    momentum: Any  #: P
    momentum_rate: Any  #: derivative of P
    angle_rate: Any  #: derivative of the angle from the radius
    cosine: Any  #: cosine of twice the angle
    sine: Any


def planar_motion(system: System, motion: str) -> PlanarMotion:
    """Add the parameters of a motion to a system, and return its reference motion."""
    from sympy import Integer, Rational, cos, sin, sqrt

    time, unity = system.time, Integer(1)
    if motion == "libration":  # sin δ = κ sin t: an exact planar motion on a circle
        modulus = system.parameter("modulus", default=0.1, meaning="sine of the amplitude")
        frequency = system.parameter("frequency", default=0.8, positive=True, meaning="of small librations, over n")
        asymmetry = system.parameter("asymmetry", default=0.2, meaning="(I2 - I1)/I3")
        cosine = system.parameter("complement", default=0.995, meaning="cosine of the amplitude")  # 1 - κ² cancels
        delta, wave = sqrt(cos(time) ** 2 + cosine**2 * sin(time) ** 2), modulus * sin(time)
        return PlanarMotion(
            1 / (frequency * delta),
            1 + frequency * modulus * cos(time),
            -3 * asymmetry * wave / frequency,  # 3 D = frequency²
            modulus * cos(time) / delta,
            1 - 2 * wave**2,
            2 * wave * delta,
        )
    eccentricity = system.parameter("eccentricity", default=0.1, least=0.0, most=0.99)
    radius = 1 + eccentricity * cos(time)
    if motion == "spin_normal":
        spin = system.parameter("spin", default=1.0, meaning="spin over the mean motion")
        momentum = spin * (1 - eccentricity**2) ** Rational(3, 2)
        return PlanarMotion(unity, momentum, Integer(0), momentum / radius**2 - 1, unity, Integer(0))
    system.parameter("asymmetry", default=0.2, meaning="(I2 - I1)/I3")
    spin = system.parameter("p", default=1.0, step=0.5, meaning="rotations per orbit")
    double_angle, forcing = 2 * (spin - 1) * time, -2 * eccentricity * spin * sin(time) * radius
    return PlanarMotion(unity, spin * radius**2, forcing, spin - 1, cos(double_angle), sin(double_angle))


@cache
def planar_model() -> Model:
    """Return the described system of x alone, for resonances: Beletsky's equation, from T = m x'²/2 and V."""
    from sympy import Rational, cos, pi, sin

    system = System("Planar rotation on an orbit")
    base, inertia, tide, asymmetry = _coefficients(system, "resonance")
    angle = system.coordinate("x", "rad", periodic=True, size=1)
    system.kinetic_energy(inertia * system.velocity(angle) ** 2 / 2)
    double = base.cosine * cos(2 * angle) - base.sine * sin(2 * angle)
    system.potential(base.momentum_rate * angle - Rational(3, 4) * tide * asymmetry * double)
    system.period(2 * pi)
    system.equilibrium("reference", {angle: 0})
    return Model(system)


@cache
def orbit_model(motion: str) -> Model:
    """Return the described system of all states; of a symmetric body (spin_normal) that of the tilts."""
    from sympy import cos, pi, sin

    system = System("Body on an orbit")
    base, inertia, tide, asymmetry = _coefficients(system, motion)
    moment = system.parameter("I1_over_I3", default=0.6, positive=True)
    names = ("alpha", "beta", "M1", "M2") if motion == "spin_normal" else ("x", "alpha", "beta", "y", "M1", "M2")
    state = {name: system.state(name, bounds=(-1, 1), size=1) for name in names}
    angle, alpha, beta, excess, *momenta = (state.get(name, 0) for name in ("x", "alpha", "beta", "y", "M1", "M2"))
    momenta.append(base.momentum + excess)
    cosine = base.cosine * cos(2 * angle) - base.sine * sin(2 * angle)
    sine = base.sine * cos(2 * angle) + base.cosine * sin(2 * angle)
    other_moment, torque = moment + asymmetry, -3 * tide * asymmetry / 2 * sine  # 3 v I12
    mean = (1 / moment + 1 / other_moment) / 2  # the inverse tensor depends on 2 δ, too
    half = asymmetry / (2 * moment * other_moment)
    rate_1 = ((mean + half * cosine) * momenta[0] + half * sine * momenta[1]) / inertia
    rate_2 = ((mean - half * cosine) * momenta[1] + half * sine * momenta[0]) / inertia
    secant, tangent, product = 1 / cos(beta), sin(beta) / cos(beta), sin(beta) * cos(beta)
    frame_rate = rate_1 * tangent + base.anomaly_rate * cos(alpha) * secant  # F3
    pull = (moment + other_moment) / 2 - 1 - asymmetry / 2 * cosine  # I11 - I33
    rates = {
        "alpha": rate_1 * secant + base.anomaly_rate * cos(alpha) * tangent,
        "beta": rate_2 - base.anomaly_rate * sin(alpha),
        "M1": momenta[1] * frame_rate - momenta[2] * rate_2 - torque * product,
        "M2": momenta[2] * rate_1 - momenta[0] * frame_rate + 3 * tide * product * pull,
        "x": excess / inertia + base.anomaly_rate - frame_rate,
        "y": momenta[0] * rate_2 - momenta[1] * rate_1 + torque * cos(beta) ** 2 - base.momentum_rate,
    }
    for name, symbol in state.items():
        system.rate(symbol, rates[name])
    system.is_hamiltonian = True
    system.period(2 * pi)
    system.equilibrium("reference", dict.fromkeys(state.values(), 0))
    return Model(system)


def _coefficients(system, motion):
    """Return the reference motion, m, v and D of a motion."""
    from sympy import cos

    base, parameters = planar_motion(system, motion), system.parameters
    eccentricity, asymmetry = (parameters[n].symbol if n in parameters else 0 for n in ("eccentricity", "asymmetry"))
    radius = 1 + eccentricity * cos(system.time)
    return base, radius**2 / base.anomaly_rate, radius * base.anomaly_rate, asymmetry


def arguments_of(points, motion: str) -> dict[str, np.ndarray]:
    """Return the parameters of the model of a motion at points of the system, and the perturbation's size."""
    ratio, asymmetry = inertia_ratios(points)
    unit = np.ones(ratio.size)
    arguments = {"I1_over_I3": ratio, "asymmetry": asymmetry, "eccentricity": points.get("eccentricity", 0.0 * unit)}
    if motion == "libration":
        with np.errstate(invalid="ignore"):
            arguments |= {"modulus": np.sin(points["amplitude"]), "complement": np.cos(points["amplitude"])}
            arguments["frequency"] = np.sqrt(3.0 * asymmetry)
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
    period, angle, branch = np.full(size, 2.0 * np.pi), np.zeros(size), np.ones(size, dtype=kind)
    if motion == "libration":
        period = 4.0 * ellipkm1(arguments["complement"] ** 2) / arguments["frequency"]
        rate = arguments["modulus"] * arguments["frequency"]
    elif motion == "spin_normal":
        rate = arguments["spin"] * (1.0 - eccentricity**2) ** 1.5 / (1.0 + eccentricity) ** 2 - 1.0
    else:
        base = planar_motions(arguments) if base is None else base
        angle, rate = base.start.T + np.array([angle, arguments["p"] - 1.0])
        branch = np.where(base.residual <= periodic.MAX_RESIDUAL, base.branch, 0).astype(kind)
    return {"period": period, "angle_start": angle, "rate_start": rate, "branch": branch}


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
    arguments, kind, planar = arguments_of(points, motion), KINDS[motion], None
    slot = np.zeros(arguments["p"].size, dtype=int)
    arguments["equilibrium"] = slot
    if kind == "resonance":
        key = tuple(values.tobytes() for values in arguments.values())
        planar = motions[key] = motions.get(key) or planar_motions(arguments)
        starts = _start_columns(arguments, motion, planar)
        if plane == "in_plane":
            return periodic.survey(planar.model, arguments, tolerance, planar) | starts
        anomaly = 2.0 * np.pi * np.arange(planar.nodes.shape[1]) / planar.num_nodes[:, None]
        planar = planar.select(slice(None))
        planar.nodes = planar.nodes.copy()
        planar.nodes[:, :, 1] *= (1.0 + arguments["eccentricity"][:, None] * np.cos(anomaly)) ** 2  # y = m x'
    else:
        starts = _start_columns(arguments, motion)
    model, block = orbit_model(kind), None if kind == "spin_normal" else OUT_OF_PLANE
    subspace = None if block is None else IN_PLANE
    base = periodic.BaseMotions(model, model.parameters(arguments, slot.size), slot, planar, subspace)
    return periodic.survey(model, arguments, tolerance, base, block) | starts
