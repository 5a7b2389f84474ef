"""Functions of the time that jump or have a kink: against SymPy's values, closed forms and DOP853 from jump to jump."""

import itertools
from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from test_periodic import check, check_by_scipy, of_model, oscillator

import sweeps
from kernels.estimator.statuses import OK
from kernels.flow.codes import REGIMES
from sweeps.mechanics import DescriptionError, System
from sweeps.mechanics.model import Model
from sweeps.systems.periodic.system import reference_of

pi, sin, cos, sign, Mod, Piecewise = sp.pi, sp.sin, sp.cos, sp.sign, sp.Mod, sp.Piecewise


def jumping(stiffness, **settings):
    """Return x'' + stiffness(t, d) x = force(t, d), d = 0.3 by default."""
    return oscillator(stiffness, **settings, d=0.3)


def shared(t):
    """The time within a period."""
    return Mod(t, 2 * pi)


WAVES = {  # with the fraction of the period at which each jumps or has a kink, at d = 0.3
    "sign": (lambda t, d: sign(sin(t)), [0.5]),
    "shifted sign": (lambda t, d: sign(cos(t - 1)), [0.25 + 0.5 / np.pi, 0.75 + 0.5 / np.pi]),
    "duty cycle": (lambda t, d: Piecewise((1, shared(t) < 2 * pi * d), (-1, True)), [0.3]),
    "duty cycle by a wave": (
        lambda t, d: sign(d - cos(t)),
        [np.arccos(0.3) / 2 / np.pi, 1 - np.arccos(0.3) / 2 / np.pi],
    ),
    "three levels": (
        lambda t, d: Piecewise((1, cos(t) > 0.5), (0, cos(t) > -0.5), (-1, True)),
        [1 / 6, 1 / 3, 2 / 3, 5 / 6],
    ),
    "two conditions": (lambda t, d: Piecewise((2, (sin(t) > 0) & (cos(t) > 0)), (1, True)), [0.25, 0.5, 0.75]),
    "either condition": (lambda t, d: Piecewise((2, (sin(t) > d) | (cos(t) > 0.1)), (1, True)), None),
    "no condition": (lambda t, d: Piecewise((2, sp.Not(sin(t) > d)), (1, True)), None),
    "smooth parts": (lambda t, d: Piecewise((sin(t), sin(t) > 0), (sin(t) ** 2, True)), [0.5]),
    "half a wave": (lambda t, d: sp.Max(sin(t), 0), [0.5]),
    "the least of three": (lambda t, d: sp.Min(sin(t), cos(t), d), None),
    "rectified": (lambda t, d: sp.Abs(cos(t)), [0.25, 0.75]),
    "root of a square": (lambda t, d: sp.sqrt(cos(t) ** 2), [0.25, 0.75]),
    "step": (lambda t, d: sp.Heaviside(sin(3 * t)), [k / 6 for k in range(1, 6)]),
    "sawtooth": (lambda t, d: sp.frac(t / (2 * pi)), []),
    "three teeth": (lambda t, d: Mod(3 * t, 2 * pi), [1 / 3, 2 / 3]),
    "staircase": (lambda t, d: sp.floor(4 * shared(t) / (2 * pi)), [0.25, 0.5, 0.75]),
    "stairs of a wave": (lambda t, d: sp.ceiling(1.5 * sin(t) + d), None),
    "inner": (lambda t, d: sp.exp(sign(sin(t)) * cos(t)), [0.5]),
    "product": (lambda t, d: sign(sin(t)) * sign(cos(t)), [0.25, 0.5, 0.75]),
    "jump within a jump": (lambda t, d: sign(sin(t) + 0.5 * sign(cos(t))), None),
    "narrow": (lambda t, d: sp.Heaviside(cos(t) - 1 + sp.Rational(1, 2000)), None),
}


@pytest.mark.parametrize("name", WAVES)
def test_jumps_are_found_and_what_is_between_them_is_the_function(name):
    (f, expected), t, d = WAVES[name], sp.Symbol("t", real=True), 0.3
    model = Model(jumping(f))
    edges, switches = model.jumps.of_point([d, *np.zeros(len(model.equations.switches))], 0.0, 2 * np.pi)
    if expected is not None:
        assert edges[1:-1] / (2 * np.pi) == pytest.approx(expected, abs=1e-15)  # a rounding of each time
    slopes = sp.lambdify([*model.equations.parameters, model.system.time], -model.equations.slopes[0, 0], "numpy")
    of_time, rng = sp.lambdify(t, f(t, sp.Float(d)), "mpmath"), np.random.default_rng(3)
    for (begin, end), values in zip(pairwise(edges), switches, strict=True):
        for time in rng.uniform(begin, end, 5).tolist():
            assert float(slopes(d, *values, time)) == pytest.approx(float(of_time(time)), abs=1e-14)


def meissner():
    """Return x'' + (a - 2 q w) x = 0, w = 1 in a part d of the period π, else -1."""
    wave = lambda t, d: Piecewise((1, Mod(t, pi) < d * pi), (-1, True))  # noqa: E731
    return oscillator(lambda t, a, q, d: a - 2 * q * wave(t, d), period=pi, a=0.0, q=0.5, d=0.5)


def test_meissners_equation_is_the_product_of_two_matrices():
    rng, size = np.random.default_rng(5), 200
    a, q, d = rng.uniform(-1, 4, size), rng.uniform(-3, 3, size), rng.uniform(0.02, 0.98, size)
    columns, M = of_model(Model(meissner()), a=a, q=q, d=d), np.tile(np.eye(2), (size, 1, 1))
    for stiffness, length in ((a - 2 * q, d * np.pi), (a + 2 * q, (1 - d) * np.pi)):
        w = np.sqrt(stiffness.astype(complex))
        c, s = np.cos(w * length), np.sin(w * length)
        M = np.moveaxis(np.array([[c, s / w], [-w * s, c]]).real, 2, 0) @ M
    trace = M[:, 0, 0] + M[:, 1, 1]
    assert (columns["status"] == OK).all()
    rounding = 1e-14 * np.abs(M).max(axis=(1, 2)) ** 2  # of the closed form
    for name in ("trace", "trace_theory"):
        assert (np.abs(columns[name] - trace) <= columns["trace_error"] + rounding).all()
    assert np.median(columns["trace_error"] / np.maximum(1.0, np.abs(trace))) < 1e-12
    regime = np.array(["undetermined", *REGIMES[1:]])[columns["regime"] + 1]
    sure = np.abs(np.abs(trace) - 2.0) > 1e-9
    expected = np.where(np.abs(trace) < 2, "stable", np.where(trace > 2, "unstable", "period_doubling"))
    assert (regime == expected)[sure].all()


def test_the_edge_of_meissners_equation_is_a_cantilevers_first_root():
    """At a = 0 the trace is 2 cos x cosh x, x = π/2 √(2q): -2 at the x = 1.8751040687 of a cantilever."""
    edge = (2 * 1.8751040687119611 / np.pi) ** 2 / 2
    assert edge == pytest.approx(0.712494, abs=1e-6)
    columns = of_model(Model(meissner()), q=edge * np.array([1 - 1e-9, 1.0, 1 + 1e-9]))
    assert [REGIMES[code + 1] for code in columns["regime"]] == ["stable", "marginal", "period_doubling"]


SLOW_WAVES = ("rectified", "duty cycle by a wave")


@pytest.mark.parametrize(
    "name", ["three levels", "sawtooth", "inner", *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW_WAVES)]
)
def test_multipliers_beside_jumps(name):
    """Against DOP853 from jump to jump; damped, of points of different numbers of pieces, alone and together."""
    wave = WAVES[name][0]
    model, d = Model(jumping(lambda t, d: 1.3 + 2 * d * wave(t, d))), [0.3, -0.5, 1.2]
    columns = check_by_scipy(model, 2e-12, d=d)
    for k, value in enumerate(d):
        assert (of_model(model, d=value)["trace"] == columns["trace"][k]).all()


@pytest.mark.slow
def test_the_reference_of_verify_steps_to_the_jumps():
    ds = sweeps.survey(system=meissner(), q=[0.3, 0.9], d=[0.5, 0.2]).squeeze()
    (of_scipy,) = reference_of(sweeps.systems.resolve(ds.attrs["system"])).ways.values()
    for q, d in itertools.product((0.3, 0.9), (0.5, 0.2)):
        point = {"a": 0.0, "q": q, "d": d, "equilibrium": "rest"}
        assert abs(of_scipy(point, None) - float(ds["trace"].sel(q=q, d=d))) < 1e-10


@pytest.mark.parametrize(
    ("describe", "message"),
    [
        (lambda: jumping(lambda t, d: sign(1 + cos(t))), "or system.jump"),
        (lambda: jumping(lambda t, d: sp.floor(cos(t))), "or system.jump"),
        (lambda: jumping(lambda t, d: Piecewise((1, sin(t) > 0))), "a last case"),
        (lambda: jumping(lambda t, d: sign(sin(t)), period=3), "period: force x_dot is"),
        (lambda: jumping(lambda t, d: sign(sin(2 * t)), jumps=(1,)), "or system.jump"),
    ],
)
def test_jumps_that_are_not_known_are_refused_in_words(describe, message):
    with pytest.raises(DescriptionError, match=message):
        check(describe())


def test_declared_jumps_are_taken():
    """Jumps at a double root, and of a function without a sign in its expression."""
    quarter = pi / 2
    model = Model(jumping(lambda t, d: 1.2 + d * sp.floor(cos(t)), jumps=(quarter, 3 * quarter)))
    columns = of_model(model)
    w = np.sqrt([1.2, 0.9])
    S = [
        np.array([[np.cos(w * L), np.sin(w * L) / w], [-w * np.sin(w * L), np.cos(w * L)]])
        for w, L in zip(w, (np.pi / 2, np.pi), strict=True)
    ]
    M = S[0] @ S[1] @ S[0]
    assert columns["status"] == OK
    assert abs(columns["trace"] - np.trace(M)) <= columns["trace_error"]


@pytest.mark.parametrize("state", ["x", "x_dot"])
def test_positions_and_states_have_no_jumps(state):
    system = System("Kicked")
    x, t = system.coordinate("x", bounds=(-1, 1)), system.time
    where = {"x": x, "x_dot": system.velocity(x)}[state]
    with pytest.raises(DescriptionError, match="has a kink"):
        system.particle(1, (x + sign(sin(t)), 0))  # an impulse
    with pytest.raises(DescriptionError, match="has a kink"):
        system.force(x, -sign(where) * cos(t))


def test_motions_step_to_the_jumps():
    """Against DOP853 from jump to jump: a driven, damped oscillator with a cubic spring."""
    system = jumping(lambda t, d: 1, force=lambda t, d: 0)
    (x,) = (c.symbol for c in system.coordinates.values())
    t, v = system.time, system.velocity(x)
    system.force(x, 0.3 * sign(cos(t)) + sp.Abs(sin(t)) - v / 10 - x**3)
    times = np.linspace(0.0, 20.0, 11)
    ds = sweeps.motion(system, {"x": 0.3}, times)
    half = np.pi / 2
    edges = np.array([0.0, *(half * np.arange(1, 13)), 20.0])
    y, expected = np.array([0.3, 0.0]), [0.3]
    for begin, end in pairwise(edges):
        a, b = np.sign(np.cos((begin + end) / 2)), np.sign(np.sin((begin + end) / 2))
        rates = lambda t, y, a=a, b=b: [y[1], -y[0] - y[0] ** 3 - y[1] / 10 + 0.3 * a + b * np.sin(t)]  # noqa: E731
        solution = solve_ivp(rates, (begin, end), y, "DOP853", rtol=1e-13, atol=1e-15, dense_output=True)
        expected += [solution.sol(time)[0] for time in times if begin < time <= end]
        y = solution.y[:, -1]
    assert int(ds["status"]) == 0
    assert (np.abs(ds["x"].values - expected) <= ds["x_error"].values + 1e-11).all()  # of SciPy's dense output
    assert ds["x_error"].values[-1] < 1e-10
