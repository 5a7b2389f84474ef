"""Driven motions from their names, against harmonic balance along curves of its own, and DOP853.

POLHODE_ALL_CASES=1 has more points.
"""

import os

import numpy as np
import pytest
import sympy as sp
from described import T, flow, particle
from multipliers import check_errors
from test_periodic import check_by_scipy

from kernels.estimator.statuses import NO_PERIODIC_MOTION, NOT_FOUND, OK
from sweeps.mechanics import DescriptionError, periodic
from sweeps.mechanics.model import Model

HARMONICS, ORDERS = 41, np.arange(1, 42)
MANY = 300 if os.environ.get("POLHODE_ALL_CASES") else 40  # number of points of a slow test
CURVE_STEP = 0.02  # arc length of a step of harmonic balance, in the space of coefficients and force


def driven_oscillator(potential, damping, names, shape=sp.cos, size=1):
    """Return x'' + c x' + V'(x) = F cos(w t), with names → (place, branch)."""
    system = particle(
        lambda x, *_: potential(x),
        bounds=(-2, 2),
        size=size,
        R=lambda v, force, w, damping: damping * v**2 / 2,
        forces=lambda x, v, force, w, damping: [force * shape(w * T)],
        period=lambda force, w, damping: 2 * sp.pi / w,
        **{"force": 0.05, "w": 1.0, "damping": damping},
    )
    for name, (place, branch) in names.items():
        system.equilibrium(name, {sp.Symbol("x", real=True): place}, branch=branch)
    return system


def helmholtz(shape=sp.cos):
    return Model(driven_oscillator(lambda x: x**3 / 3 - x**2 / 2, 0.1, {"saddle": (0, 1), "well": (1, 1)}, shape))


def duffing_oscillator(size=1):
    names = {"rest": (0, 1), "middle": (0, 2), "upper": (0, 3)}
    return Model(driven_oscillator(lambda x: x**2 / 2 + x**4 / 4, 0.1, names, size=size))


def survey(model, force, w, damping, name):
    size = len(force)
    points = {"force": force, "w": w, "damping": damping * np.ones(size), "epsilon": np.full(size, 1e-8)}
    return periodic.survey(model, points | {"equilibrium": np.broadcast_to(name, size)}, 1e-12)


class Balance:
    """Harmonic balance of x'' + c x' + k x + q x² + d x³ = F shape(w t), in real coefficients; cos(w t) by default."""

    def __init__(self, stiffness, damping, w, shape=None):
        count = 4 * HARMONICS + 4
        angles = 2.0 * np.pi * np.multiply.outer(np.arange(count) / count, ORDERS)
        self.waves = np.hstack([np.ones((count, 1)), np.cos(angles), np.sin(angles)])
        self.coefficients, self.w, self.stiffness = np.linalg.pinv(self.waves), w, stiffness
        inertia, drag = np.diag((ORDERS * w) ** 2), np.diag(damping * w * ORDERS)
        self.linear = np.zeros((2 * HARMONICS + 1,) * 2)
        self.linear[1:, 1:] = np.block([[-inertia, drag], [-drag, -inertia]])
        self.drive = np.eye(1, 2 * HARMONICS + 1, 1)[0] if shape is None else shape

    def __call__(self, u):
        """Return the residual of the coefficients and the force, and its derivatives by both."""
        x, (k, q, d) = self.waves @ u[:-1], self.stiffness
        residual = self.linear @ u[:-1] + self.coefficients @ (k * x + q * x**2 + d * x**3) - u[-1] * self.drive
        slopes = self.linear + self.coefficients @ ((k + 2 * q * x + 3 * d * x**2)[:, None] * self.waves)
        return residual, np.hstack([slopes, -self.drive[:, None]])

    def correct(self, u, row):
        """Return u after Newton's method across a row, the tangent there, and whether it converged."""
        for _ in range(12):
            residual, slopes = self(u)
            change = np.linalg.solve(np.vstack([slopes, row]), np.append(residual, 0.0))
            u = u - change
            if np.linalg.norm(change) < 1e-11:
                break
        tangent = np.linalg.solve(np.vstack([slopes, row]), np.eye(1, u.size, u.size - 1)[0])
        return u, tangent / np.linalg.norm(tangent), np.linalg.norm(change) < 1e-11

    def motion(self, place, force, branch=1, max_force=4.0):
        """Return the coefficients of the motion behind branch - 1 folds; None if there is none."""
        u, folds, step = np.append(place * np.eye(1, self.drive.size)[0], 0.0), 0, CURVE_STEP
        u, tangent, _ = self.correct(u, np.eye(1, u.size, u.size - 1)[0])
        while u[-1] < max_force * max(force, 0.5) and step > 1e-8:
            v, new, is_converged = self.correct(u + step * tangent, tangent)
            if not is_converged or new @ tangent < 0.995:
                step /= 2.0
                continue
            is_fold = new[-1] * tangent[-1] < 0.0
            if folds == branch - 1 and (u[-1] - force) * (v[-1] - force) <= 0.0 and not is_fold:
                end = u + (v - u) * (force - u[-1]) / (v[-1] - u[-1])
                a = self.correct(np.append(end[:-1], force), np.eye(1, u.size, u.size - 1)[0])[0]
                return a[:-1]
            folds += is_fold
            if folds == branch:
                return None
            u, tangent, step = v, new, min(1.5 * step, CURVE_STEP)
        return None


def compare(columns, balances, force, places, branches):
    """Compare points with harmonic balance: none is another motion, and no status is wrong; return shares found.

    Multipliers are compared with the variational flow's.
    """
    exists = np.zeros(len(force), dtype=bool)
    for i, balance in enumerate(balances):
        a = balance.motion(places[i], force[i], branches[i])
        exists[i] = a is not None
        if columns["status"][i] == OK:
            assert exists[i], i
            start = a[: HARMONICS + 1].sum(), balance.w * (ORDERS * a[HARMONICS + 1 :]).sum()
            state = columns["x_start"][i], columns["x_dot_start"][i]
            assert state == pytest.approx(start, abs=1e-10), i  # harmonics left out, and Newton's last step
        elif branches[i] == 1:
            assert not exists[i] or columns["status"][i] == NOT_FOUND, i
    check_errors(columns)
    return (columns["status"] == OK)[exists].mean()


def helmholtz_points(count):
    rng = np.random.default_rng(4)
    return rng.uniform(0.01, 0.2, count), rng.uniform(0.3, 1.6, count), np.arange(count) % 2


@pytest.mark.parametrize("count", [8, pytest.param(MANY, marks=pytest.mark.slow)])
def test_saddle_and_well_of_a_driven_helmholtz_oscillator_keep_their_names(count):
    force, w, name = helmholtz_points(count)
    columns = survey(helmholtz(), force, w, 0.1, name)
    balances = [Balance((-1.0, 1.0, 0.0), 0.1, frequency) for frequency in w]
    assert compare(columns, balances, force, name.astype(float), np.ones(count, dtype=int)) >= 0.99
    assert (columns["base_residual"][columns["status"] == OK] < 1e-12).all()


@pytest.mark.parametrize(
    ("count", "size"),
    [(4, 1), *(pytest.param(*case, marks=pytest.mark.slow) for case in [(MANY, 1), (MANY // 4, 0.1), (MANY // 4, 10)])],
)
def test_a_driven_duffing_oscillator_is_followed_from_rest(count, size):
    rng = np.random.default_rng(4)
    force, w, c = rng.uniform(0.01, 1.0, count), rng.uniform(0.3, 1.6, count), rng.uniform(0.05, 0.3, count)
    columns = survey(duffing_oscillator(size), force, w, c, 0)
    balances = [Balance((1.0, 0.0, 1.0), *pair) for pair in zip(c, w, strict=True)]
    assert compare(columns, balances, force, np.zeros(count), np.ones(count, dtype=int)) >= 0.99


def test_a_resonance_without_damping_is_no_start_of_a_curve():
    """At w = 1 each small oscillation about rest has the period of the drive, and no fold is claimed."""
    columns = survey(duffing_oscillator(), [0.1, 0.3], np.array([1.0, 1.0]), 0.0, 0)
    assert columns["status"].tolist() == [NOT_FOUND] * 2


def test_published_multipliers_of_the_saddle_and_the_well():
    """x'' + 0.1 x' - x + x² = F sin(w t), as published by authors of independent codes."""
    columns = survey(helmholtz(sp.sin), [0.01, 0.06, 0.06], np.array([1.0, 0.72, 1.01]), 0.1, [0, 0, 1])
    assert columns["status"].tolist() == [OK] * 3
    assert [columns["x_start"][0], columns["x_dot_start"][0]] == pytest.approx([-0.00023938, -0.00498690], abs=5e-9)
    assert columns["multiplier_real"][0] == pytest.approx([394.163, 0.00135347], rel=2e-6)
    assert [columns["x_start"][1], columns["x_dot_start"][1]] == pytest.approx([-0.00134, -0.02837], abs=5e-6)
    assert columns["multiplier_real"][1, 0] == pytest.approx(3989.0, abs=0.5)
    assert [columns["x_start"][2], columns["x_dot_start"][2]] == pytest.approx([0.71584, -0.24777], abs=5e-6)
    assert columns["multiplier_real"][2] == pytest.approx([0.5359] * 2, abs=5e-5)
    assert np.abs(columns["multiplier_imag"][2]) == pytest.approx([0.4996] * 2, abs=5e-5)


def test_the_branches_of_a_resonance_that_bends_over():
    """Below it, within its three motions, and above the fold at which the first one ends."""
    force, branch = np.repeat([0.02, 0.3, 1.0], 3), np.tile([1, 2, 3], 3)
    columns = survey(duffing_oscillator(), force, np.full(9, 1.5), 0.1, branch - 1)
    compare(columns, [Balance((1.0, 0.0, 1.0), 0.1, 1.5)] * 9, force, np.zeros(9), branch)
    assert columns["branch"].tolist() == np.where(columns["status"] == OK, branch, 0).tolist()
    assert (columns["status"].reshape(3, 3) == OK).tolist() == [[1, 0, 0], [1, 1, 1], [0, 0, 1]]
    assert columns["status"][6] == NO_PERIODIC_MOTION
    assert columns["regime"][4] != columns["regime"][3]  # between two folds the motion is a saddle
    with pytest.raises(DescriptionError, match="branch 0 of low: allowed: a whole number from 1"):
        driven_oscillator(lambda x: x**2, 0.1, {"low": (0, 0)})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "stiffness", "place"),
    [
        (lambda t: sp.cos(20 * t), lambda t: 1, 0),  # harmonics that a coarse collocation aliases
        (lambda t: sp.cos(100 * t), lambda t: 1, 0),
        (lambda t: sp.cos(t) ** 2, lambda t: 1, 0),  # its mean is of the drive
        (lambda t: sp.tanh(20 * sp.cos(t)), lambda t: 1, 0),
        (lambda t: sp.exp(2000 * (sp.cos(t - 1) - 1)), lambda t: 1, 0),
        (sp.cos, lambda t: 2 + sp.cos(t), 0),
        (lambda t: sp.cos(2 * t), lambda t: 1, 0.3),  # a name that is no equilibrium
    ],
)
def test_drives_of_other_shapes(shape, stiffness, place):
    """x'' + 0.1 x' + k(t) x + x³ = F shape(t): the motion closes by DOP853, and is the small one."""
    settings = {"bounds": (-2, 2), "size": 1, "period": 2 * sp.pi, "places": {"rest": [place]}, "force": 0.1}
    V = lambda x, force: stiffness(T) * x**2 / 2 + x**4 / 4 - force * x * shape(T)  # noqa: E731
    system = particle(V, R=lambda v, force: 0.1 * v**2 / 2, **settings)
    columns = check_by_scipy(Model(system), max_step=0.03, force=1.0)
    assert np.abs(columns["x_start"]).max() < 1.6


JUMPING = {  # functions of an angle that jump
    "square wave": lambda a: sp.sign(sp.cos(a)),
    "sawtooth": lambda a: sp.frac(a / (2 * sp.pi)) - sp.Rational(1, 2),
    "rectified": lambda a: sp.Abs(sp.cos(a)),
    "pulse": lambda a: 3 * sp.Heaviside(sp.cos(a - 1) - sp.Rational(9, 10)),
    "duty cycle": lambda a: sp.Piecewise((1, sp.Mod(a, 2 * sp.pi) < 2), (-1, True)),
    "three levels": lambda a: (sp.sign(sp.cos(a) - 0.5) + sp.sign(sp.cos(a) + 0.5)) / 2,
}


def oscillator_with_jumps():
    """Return x'' + c x' + x + x³ = F (sum of all functions that jump, each with an amplitude), from rest."""
    amplitudes = sp.symbols(" ".join(name.replace(" ", "_") for name in JUMPING), real=True)
    system = driven_oscillator(lambda x: x**2 / 2 + x**4 / 4, 0.1, {"rest": (0, 1)}, lambda a: 0)
    (x,), parameters = (c.symbol for c in system.coordinates.values()), system.parameters
    force, angle = parameters["force"].symbol, parameters["w"].symbol * system.time
    shares = [system.parameter(a.name, default=0.0) for a in amplitudes]
    system.force(x, force * sum(a * f(angle) for a, f in zip(shares, JUMPING.values(), strict=True)))
    return system


@pytest.mark.slow
def test_drives_that_jump():
    """No wrong motion and no wrong status by harmonic balance; motions and multipliers by DOP853 from jump to jump."""
    count = MANY
    rng, model, kinds = np.random.default_rng(4), Model(oscillator_with_jumps()), np.arange(count) % len(JUMPING)
    force, w, c = rng.uniform(0.02, 0.6, count), rng.uniform(0.4, 1.6, count), rng.uniform(0.05, 0.3, count)
    shares = dict(zip(model.names[-len(JUMPING) :], np.eye(len(JUMPING))[:, kinds], strict=True))
    points = {"force": force, "w": w, "damping": c, **shares, "epsilon": np.full(count, 1e-8)}
    columns = periodic.survey(model, points | {"equilibrium": np.zeros(count, dtype=int)}, 1e-12)
    phases = (np.arange(2**14) + 0.5) / 2**14
    waves = np.exp(-2j * np.pi * np.multiply.outer(np.arange(HARMONICS + 1), phases))
    exists, angle = np.zeros(count, dtype=bool), sp.Symbol("angle", real=True)
    for i, f in enumerate([list(JUMPING.values())[k] for k in kinds]):
        f = sp.lambdify(angle, f(angle), "numpy")
        terms = waves @ np.broadcast_to(f(2 * np.pi * phases), phases.shape) / phases.size * 2.0
        shape = np.concatenate([terms[:1].real / 2.0, terms[1:].real, -terms[1:].imag])
        balance = Balance((1.0, 0.0, 1.0), c[i], w[i], shape)
        a = balance.motion(0.0, force[i])
        exists[i] = a is not None
        if columns["status"][i] != OK:
            assert not exists[i] or columns["status"][i] == NOT_FOUND, i
            continue
        assert exists[i], i
        assert columns["x_start"][i] == pytest.approx(a[: HARMONICS + 1].sum(), abs=1e-3), i  # harmonics left out
    assert (columns["status"] == OK)[exists].mean() >= 0.99
    some = np.flatnonzero(columns["status"] == OK)[: len(JUMPING)]
    check_by_scipy(model, 1e-12, **{name: values[some] for name, values in points.items() if name != "epsilon"})


@pytest.mark.slow
@pytest.mark.parametrize("place", [0.0, 0.4])
def test_states_and_moving_names_beside_jumps(place):
    """x' = y, y' = -c y - x - x³ + F sign(cos(t)), z' = x² - z: closed by DOP853; from rest, and from a start."""
    rates = lambda x, y, z, force: (y, -y / 10 - x - x**3 + force * sp.sign(sp.cos(T)), x**2 - z)  # noqa: E731
    system = flow(rates, "xyz", (-2, 2), places={"rest": [place, 0, 0]}, force=0.1)
    system.period(2 * sp.pi)
    check_by_scipy(Model(system), 1e-12, force=0.3)
