"""Systems of users with a regime that a theorem or a closed form decides, and marginal points."""

import functools
import math

import numpy as np
import sympy as sp
from described import T, flow, particle, points_at
from scipy.integrate import solve_ivp

from kernels.estimator.statuses import STATUSES
from kernels.flow.codes import REGIMES as OF_MULTIPLIERS
from sweeps.mechanics import periodic
from sweeps.mechanics.model import Model
from sweeps.systems.relative_equilibrium.system import REGIMES

STABLE, GROWS, DECAYS = "stable", "unstable flutter period_doubling", "asymptotically_stable"


def of_coordinates(n, V=lambda q, *_: 0, R=None, forces=None, kinetic=None, **settings):
    """Return a model near 0 as `particle` does, of functions V(q, …), R(v, …), forces(q, v, …) and kinetic(q, v, …)."""

    def of_one(function):
        return function and (lambda *x: function(x[:n], *x[n:]))

    def of_both(function):
        return function and (lambda *x: function(x[:n], x[n : 2 * n], *x[2 * n :]))

    settings |= {"R": of_one(R), "forces": of_both(forces), "kinetic": of_both(kinetic)}
    names, places = [f"q{i}" for i in range(n)], {"rest": [0] * n}
    return Model(particle(of_one(V), names, (-1, 1), size=1, places=places, **settings))


def of_states(count, rates, **defaults):
    """Return a model of states near 0; `rates` returns their rates from states and parameters."""
    names, places = [f"x{i}" for i in range(count)], {"rest": [0] * count}
    return Model(flow(lambda *x: rates(x[:count], *x[count:]), names, (-1, 1), places=places, **defaults))


def of_matrix(rows, form, **defaults):
    """Return q'' = A q as coordinates with forces, or as states; `rows` returns A from parameters."""
    n = len(rows(*defaults.values()))

    def product(q, *parameters):
        return [sum((a * y for a, y in zip(row, q, strict=True)), sp.Integer(0)) for row in rows(*parameters)]

    if form == "states":
        return of_states(2 * n, lambda x, *parameters: [*x[n:], *product(x[:n], *parameters)], **defaults)
    return of_coordinates(n, forces=lambda q, v, *parameters: product(q, *parameters), **defaults)


def squares(x):
    return sum(y**2 for y in x)


def columns(model, **values):
    """Return regimes by theory and as measured, statuses, and columns at points: parameters, or `epsilon`."""
    points = points_at(model, [0], **{"epsilon": 1e-6} | values)
    if model.system.given_period is None:
        n, names = model.n, REGIMES
        columns_of_points = {name: rows[::n] for name, rows in model.survey(points).items()}
    else:
        first = points["eigenvalue"] == 1
        points, names = {name: values[first] for name, values in points.items()}, OF_MULTIPLIERS
        columns_of_points = periodic.survey(model, points, 1e-12)
    regimes = [[names[k + 1] for k in columns_of_points[name]] for name in ("regime_theory", "regime")]
    return *regimes, [STATUSES[k] for k in columns_of_points["status"]], columns_of_points


# -- equal eigenvalues that grow or decay


def hill(count=2):
    """A round hill or bowl with drag."""
    V, R = lambda q, k, c: -k * squares(q) / 2 - squares(q) ** 2 / 8, lambda v, k, c: c * squares(v) / 2
    return of_coordinates(count, V, R, k=1.0, c=0.1)


def growth_twice():
    """Two of x' = a x - x³."""
    return of_states(2, lambda x, a: [a * y - y**3 for y in x], a=1.0)


def dark_laser():
    """Maxwell and Bloch's equations of a complex field, without light: it grows from r = 1 on."""

    def rates(x, r):
        e1, e2, p1, p2, d = x
        fields = [1.4 * (p1 - e1), 1.4 * (p2 - e2), e1 * (d + r) - p1, e2 * (d + r) - p2]
        return [*fields, -0.5 * d - e1 * p1 - e2 * p2]

    return of_states(5, rates, r=2.0)


def ring():
    """Three cells in a ring: rates 2 g - 1, and -1 - g twice."""
    return of_states(3, lambda x, g: [-x[i] + g * (x[i - 1] + x[i - 2]) - x[i] ** 3 for i in range(3)], g=1.0)


def negative_drag():
    """Two equal oscillators that a drag below 0 drives."""
    return of_coordinates(2, lambda q, c: squares(q) / 2, forces=lambda q, v, c: [-c * y for y in v], c=0.1)


# -- independent blocks


def trap(count=2):
    """A quadrupole with radio frequency alone: Mathieu's equation in each direction."""
    V = lambda q, depth: -depth * sp.cos(2 * T) * (2 * sum(x**2 for x in q[::2]) - squares(q))  # noqa: E731
    return of_coordinates(count, V, period=sp.pi, depth=0.5)


def twin_swings():
    """Two equal damped pendulums that are pumped alike."""
    V = lambda q, depth: -(1 + depth * sp.cos(2 * T)) * sum(map(sp.cos, q))  # noqa: E731
    return of_coordinates(2, V, lambda v, depth: squares(v) / 40, period=sp.pi, depth=0.5)


def pairs(count):
    """Equal oscillators as states of first order, without declared conserved quantities."""
    return of_states(2 * count, lambda x, k: [*x[count:], *(-k * y - y**3 for y in x[:count])], k=1.0)


def growth_of_mathieu(depth, constant=0.0, drag=0.0):
    """Return the growth over π of x'' + drag x' + (constant + 2 depth cos 2t) x = 0, by SciPy."""

    def slopes(t, x):
        pull = constant + 2 * depth * math.cos(2 * t)
        return [x[1], -drag * x[1] - pull * x[0], x[3], -drag * x[3] - pull * x[2]]

    x = solve_ivp(slopes, (0, math.pi), [1.0, 0.0, 0.0, 1.0], method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    return math.log(np.abs(np.linalg.eigvals(x.reshape(2, 2))).max())


def of_trap(depth):
    return GROWS if growth_of_mathieu(depth) > 1e-6 else STABLE


def of_swings(depth):
    return GROWS if growth_of_mathieu(depth / 2, 1.0, 0.05) > 0 else DECAYS


# -- circulatory forces without damping


def ziegler():
    """Ziegler's column, masses 2 m and m: below P = 7/2 - √2, in c/l, it does not flutter."""
    return of_coordinates(
        2,
        lambda q, P: (q[0] ** 2 + (q[0] - q[1]) ** 2) / 2,
        forces=lambda q, v, P: [P * sp.sin(q[0] - q[1]), 0],
        kinetic=lambda q, v, P: v[0] ** 2 + sp.cos(q[0] - q[1]) * v[0] * v[1],  # added to v²/2 of both
        P=1.0,
    )


def beck(P):
    """Two modes of Beck's column: stiffness with the follower force, not symmetric."""
    return [[-12.36 + 0.86 * P, 11.74 * P], [-1.87 * P, -485.5 - 13.29 * P]]


def of_beck(P):
    """Two squares of frequencies, real and above 0: a sum below 0, a product and a discriminant above 0."""
    (a, b), (c, d) = beck(P)
    return STABLE if a + d < 0 < a * d - b * c and (a - d) ** 2 + 4 * b * c > 0 else GROWS


def panel(flow):
    """Two modes of a panel in a supersonic flow."""
    return [[-1, flow], [-flow, -16]]


def bearing(k, q):
    """A shaft in cross-coupled bearings without damping."""
    return [[-1, -q], [q, -k]]


def of_bearing(k, q):
    return STABLE if abs(k - 1) > 2 * abs(q) else GROWS


# -- energies that are definite


def rotor():
    """A round rotor in a frame that turns with it, with a drag that may be 0."""
    return of_coordinates(
        2,
        lambda q, k, W, c: k * squares(q) / 2 + squares(q) ** 2,
        lambda v, k, W, c: c * squares(v) / 2,
        kinetic=lambda q, v, k, W, c: W * (v[1] * q[0] - v[0] * q[1]) + W**2 * squares(q) / 2,
        **{"k": 1.0, "W": 0.0, "c": 0.0},
    )


def of_rotor(k, W, c):
    if c:
        return DECAYS if k > W**2 else GROWS
    return STABLE


def charge():
    """A charge in a round bowl and a magnetic field, a gyroscopic force that is no part of T; k twice and once 2 k."""
    V, F = lambda q, k, B: k * (squares(q) + q[2] ** 2) / 2, lambda q, v, k, B: [B * v[1], -B * v[0], 0]
    return of_coordinates(3, V, forces=F, k=1.0, B=0.0)


def partly_damped():
    """Three equal springs, a single one damped."""
    return of_coordinates(3, lambda q, k, c: k * squares(q) / 2, lambda v, k, c: c * v[2] ** 2 / 2, k=1.0, c=0.1)


def rough():
    """Two equal springs with cubic drags alone, of the speed and of each velocity."""
    F = lambda q, v, k, c, d: [-c * y * squares(v) - d * y**3 for y in v]  # noqa: E731
    return of_coordinates(2, lambda q, k, c, d: k * squares(q) / 2, forces=F, k=1.0, c=0.0, d=0.0)


def oscillators(count=4, coupling=1e-3):
    """Equal oscillators, two of them coupled by a gyroscopic force: with equal eigenvalues, and linear."""
    F = lambda q, v, k: [coupling * v[1], -coupling * v[0], *[0] * (count - 2)]  # noqa: E731
    return of_coordinates(count, lambda q, k: k * squares(q) / 2, forces=F, k=4.0)


def signs_of(*signs):
    """Grows above 0, decays below."""
    return lambda x, *_: GROWS if x > 0 else DECAYS


SIGNS = np.array([-3.0, -1.0, -0.3, -0.01, 0.01, 0.3, 1.0, 3.0])
DEPTHS = np.array([0.05, 0.2, 0.5, 0.8, 0.9, 0.92, 1.0, 1.5, 2.0, 4.0])
LOADS = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 2.08, 2.085, 2.087, 2.1, 3.0])


def of_ziegler(P):
    return STABLE if 3.5 - math.sqrt(2) > P else GROWS


#: name → model, values of each parameter (all combinations), regime by theorem or closed form
USER_SYSTEMS = {
    "round hill": (hill, {"k": SIGNS, "c": [0.1, 1.0]}, signs_of()),
    "hill in space": (lambda: hill(3), {"k": SIGNS, "c": [0.1]}, signs_of()),
    "growth twice": (growth_twice, {"a": SIGNS}, signs_of()),
    "dark laser": (dark_laser, {"r": [0.1, 0.5, 0.9, 1.1, 2.0, 9.0]}, lambda r: GROWS if r > 1 else DECAYS),
    "ring": (ring, {"g": [-3.0, -1.1, -0.9, 0.2, 0.45, 0.55, 2.0]}, lambda g: DECAYS if -1 < g < 0.5 else GROWS),
    "negative drag": (negative_drag, {"c": SIGNS}, lambda c: DECAYS if c > 0 else GROWS),
    "trap": (trap, {"depth": DEPTHS}, of_trap),
    "trap in space": (lambda: trap(3), {"depth": DEPTHS}, of_trap),
    "twin swings": (twin_swings, {"depth": [0.05, 0.1, 0.15, 0.3, 0.6]}, of_swings),
    "two pairs": (lambda: pairs(2), {"k": SIGNS}, lambda k: STABLE if k > 0 else GROWS),
    "three pairs": (lambda: pairs(3), {"k": SIGNS}, lambda k: STABLE if k > 0 else GROWS),
    "Ziegler": (ziegler, {"P": LOADS}, of_ziegler),
    "rotor": (rotor, {"k": [0.5, 1.0], "W": [0.0, 0.4, 0.9], "c": [0.0, 0.1]}, of_rotor),
    "charge": (charge, {"k": [1.0, 2.0], "B": [0.0, 0.5, 1.0, 2.0]}, lambda k, B: STABLE),
    "undamped": (partly_damped, {"k": [1.0, 2.0], "c": [0.0]}, lambda k, c: STABLE),
    "rough": (rough, {"k": [1.0, 2.0], "c": [0.0, 0.1], "d": [0.0, 0.1]}, lambda k, c, d: STABLE),
    "oscillators": (oscillators, {"k": [1.0, 2.0, 4.0]}, lambda k: STABLE),
}
MATRICES = {  # the same of systems that are given by a matrix, as coordinates and as states
    "Beck": (beck, {"P": np.linspace(0.5, 40, 9)}, of_beck),
    "panel": (panel, {"flow": [0.0, 1.0, 7.0, 7.49, 7.51, 9.0]}, lambda flow: STABLE if flow < 7.5 else GROWS),
    "bearing": (bearing, {"k": [1.5, 2.0, 4.0], "q": [0.1, 0.3, 0.9, 2.0]}, of_bearing),
}
USER_SYSTEMS |= {
    f"{name}, {form}": (functools.partial(of_matrix, rows, form, **dict.fromkeys(values, 1.0)), values, regime)
    for name, (rows, values, regime) in MATRICES.items()
    for form in ("coordinates", "states")
}


def user_system(name):
    """Return the model of a system, its points, and the right regimes at each: alternatives in one string."""
    make, values, regime = USER_SYSTEMS[name]
    grid = np.meshgrid(*values.values(), indexing="ij")
    points = dict(zip(values, map(np.ravel, grid), strict=True))
    return make(), points, [regime(*row).split() for row in zip(*points.values(), strict=True)]


# -- marginal systems


def hopf(form):
    """A damping that changes its sign at mu = 0, at which a cubic damping decides: as coordinates, it drives."""
    if form == "states":
        return of_states(2, lambda x, mu: [x[1], -x[0] + (mu - x[0] ** 2) * x[1]], mu=0.0)
    return of_coordinates(1, lambda q, mu: q[0] ** 2 / 2, forces=lambda q, v, mu: [(mu + q[0] ** 2) * v[0]], mu=0.0)


def pitchfork():
    """A damped bead at V″ = 0."""
    return of_coordinates(1, lambda q, k: k * q[0] ** 2 / 2 + q[0] ** 4 / 4, lambda v, k: v[0] ** 2 / 2, k=0.0)


#: name → model and a point at which the motion nearby neither grows nor stays by linear theory
MARGINAL = {
    "a mode without drag": (partly_damped, {"c": 0.1}),  # or a decay by less than the errors
    "a negative cubic drag": (rough, {"c": -0.1}),
    "a negative cubic drag of each velocity": (rough, {"d": -0.1}),
    "free particle": (lambda: of_states(2, lambda x: [x[1], 0]), {}),
    "free particle and a decay": (lambda: of_states(3, lambda x: [x[1], -(x[0] ** 3), -x[2]]), {}),
    "equal modes that drive each other": (lambda: of_matrix(lambda s: [[-1, 0], [s, -1]], "coordinates", s=1.0), {}),
    "the same modes as states": (lambda: of_matrix(lambda s: [[-1, 0], [s, -1]], "states", s=1.0), {}),
    "Ziegler's threshold": (ziegler, {"P": 3.5 - math.sqrt(2)}),
    "bearing at its threshold": (lambda: of_matrix(bearing, "states", k=2.0, q=0.5), {}),
    "rotor at its critical speed": (rotor, {"k": 1.0, "W": 1.0}),
    "Hopf": (lambda: hopf("coordinates"), {}),
    "Hopf, states": (lambda: hopf("states"), {}),
    "pitchfork": (pitchfork, {}),
    "trap without voltage": (trap, {"depth": 0.0}),
    "cubic decay": (lambda: of_states(2, lambda x: [-(x[0] ** 3), -x[1]]), {}),
}
