"""Multipliers of described periodic systems: against long doubles, closed forms and DOP853."""

from itertools import pairwise

import numpy as np
import pytest
import repeated
import sympy as sp
from described import T, flow, particle
from multipliers import TRACES, VALUES, check_errors, monodromy_matrix, solve_with_perturbations
from scipy.integrate import solve_ivp

from kernels.estimator.statuses import NO_PERIODIC_MOTION, NON_FINITE, NOT_CONVERGED, NOT_FOUND, OK
from kernels.flow import floquet
from kernels.flow.codes import REGIMES
from sweeps import systems
from sweeps.mechanics import DescriptionError, periodic
from sweeps.mechanics.derivation import derive
from sweeps.mechanics.model import Model
from sweeps.mechanics.steepness import Steepness
from sweeps.points.loading import read_sweep
from sweeps.systems.periodic.presentation import figure_tongues
from sweeps.systems.reintegration import rates_of


def survey(name, tolerance=1e-12, **values):
    """Columns of a shipped system at points: parameters, and the number of a name as `equilibrium`."""
    return of_model(systems.resolve(name).mechanism, tolerance, **values)


def of_model(model, tolerance=1e-12, **values):
    defaults = {p.name: p.default for p in model.system.parameters.values()} | {"epsilon": 1e-8, "equilibrium": 0}
    size = np.broadcast(*map(np.atleast_1d, values.values())).size if values else 1
    points = {name: np.broadcast_to(value, size) * np.ones(size) for name, value in (defaults | values).items()}
    points["equilibrium"] = points["equilibrium"].astype(int)
    return periodic.survey(model, points, tolerance)


def oscillator(stiffness, force=None, period=2 * sp.pi, jumps=(), **parameters):
    """Return x'' + stiffness(t, …) x = force(t, …), functions of the time and of parameters with these defaults."""

    def V(x, *symbols):
        return stiffness(T, *symbols) * x**2 / 2 - (force(T, *symbols) * x if force else 0)

    system = particle(V, bounds=(-1, 1), size=1, period=period, places={"rest": [0]}, **parameters)
    system.jump(*jumps)
    return system


def check(system, **grid):
    """Check a sweep of a system, as all commands do before they measure it."""
    read_sweep({"system": systems.register_system(system), "grid": grid})


def check_by_scipy(model, rounding=1e-11, max_step=np.inf, **values):
    """Compare motions and multipliers with DOP853 on the equations as SymPy writes them, from jump to jump of the time.

    SciPy may err by `rounding`. Return the columns of the points.
    """
    columns, rates, states = of_model(model, **values), rates_of(model.equations), model.equations.states
    assert (columns["status"] == OK).all()
    for i, trace in enumerate(columns["trace"]):
        point = {p.symbol: np.resize(values.get(p.name, p.default), i + 1)[i] for p in model.system.parameters.values()}
        numbers, period = [*point.values()] or [0.0], float(model.system.given_period.subs(point))
        edges, switches = (0.0, period), [()]
        if model.equations.switches:
            edges, switches = model.jumps.of_point([*numbers, *model.equations.switches], 0.0, period)
        end = start = np.array([columns[f"{x}_start"][i] for x in states])
        M = np.eye(len(states))
        for times, switch in zip(pairwise(edges), switches, strict=True):
            right = lambda t, x, p=(*numbers, *switch): rates(p, t, x)  # noqa: E731
            end, matrix = solve_with_perturbations(right, end, times, max_step=max_step)
            M = matrix @ M
        assert end == pytest.approx(start, abs=rounding)
        assert abs(np.trace(M) - columns["trace_theory"][i]) <= rounding
        assert abs(np.trace(M) - trace) <= columns["trace_error"][i] + rounding
        multipliers = columns["multiplier_real"][i] + 1j * columns["multiplier_imag"][i]
        distance = np.abs(multipliers[:, None] - np.linalg.eigvals(M)).min(axis=1)
        error = np.hypot(columns["multiplier_real_error"][i], columns["multiplier_imag_error"][i])
        assert (distance <= error + rounding).all()
    assert columns["trace_error"].max() < 1e-9
    check_errors(columns)
    return columns


def test_published_traces_of_mathieus_equation():
    a, q = np.array(list(TRACES), dtype=float).T
    columns = survey("mathieu", a=a, q=q)
    for name, error in (("trace", columns["trace_error"]), ("trace_theory", 0.0)):
        assert (np.abs(columns[name] - list(TRACES.values())) <= error + 6e-13).all()  # their printed digits
    assert (columns["trace_error"] < 2e-13).all()
    check_errors(columns)


@pytest.mark.parametrize("q", VALUES)
def test_published_characteristic_values(q):
    """The chart's curves have them, and the trace is 2 or -2 there, to its slope in a times half their last digit."""
    curves = figure_tongues.characteristic_values(np.array([q]), 5)[:, 0]
    np.testing.assert_allclose(curves, VALUES[q], rtol=0, atol=1.3e-11)  # four roundings of the largest entry, 4 · 60²
    a, h = np.array(VALUES[q]), 1e-4
    columns, shifted = survey("mathieu", a=a, q=q), survey("mathieu", a=a + h, q=q)
    slope = np.abs(shifted["trace_theory"] - columns["trace_theory"]) / h + 10.0  # and its change within h
    sides = np.array([2.0, -2.0, -2.0, 2.0, 2.0])
    assert (np.abs(columns["trace"] - sides) <= columns["trace_error"] + 6e-13 * slope).all()
    assert (np.abs(columns["trace_theory"] - sides) <= 6e-13 * slope + 1e-12).all()


def test_butikovs_curve_of_the_first_tongue():
    """The hanging pendulum θ'' + k (1 - m cos t) θ = 0 at k = 0.2: his formula's m = 0.488 is right to its digits."""
    k, m = 0.2, np.array([0.4875, 0.4885])
    assert (np.sqrt((9 - 4 * k) * (13 - 20 * k)) - (9 - 4 * k)) / (4 * k) == pytest.approx(0.488, abs=5e-4)
    assert survey("mathieu", a=4 * k, q=2 * k * m)["regime"].tolist() == [floquet.STABLE, floquet.PERIOD_DOUBLING]


def test_multipliers_of_mathieus_equation_are_those_of_long_doubles():
    """At random a and q, within tongues and between; exponents are continuous from small modulation."""
    rng = np.random.default_rng(34)
    a, q = rng.uniform(-1.0, 25.0, 100), rng.uniform(0.0, 8.0, 100) * rng.choice([1e-2, 1.0], 100)
    exact = np.array([np.trace(monodromy_matrix(*point)) for point in zip(a, q, strict=True)], dtype=float)
    columns, is_stable = survey("mathieu", a=a, q=q), np.abs(exact) < 2.0
    assert np.abs(columns["trace_theory"] - exact).max() < 1e-11  # multipliers up to a few hundred
    assert (np.abs(columns["trace"] - exact) <= columns["trace_error"] + 1e-13).all()
    regimes = np.where(is_stable, floquet.STABLE, np.where(exact > 2.0, floquet.UNSTABLE, floquet.PERIOD_DOUBLING))
    assert (columns["regime"] == regimes).all()
    assert {*regimes} == {floquet.STABLE, floquet.UNSTABLE, floquet.PERIOD_DOUBLING}
    check_errors(columns)
    turns = np.abs(columns["exponent_imag"][:, 0])
    np.testing.assert_allclose(2.0 * np.cos(np.pi * turns)[is_stable], exact[is_stable], atol=1e-11)
    assert (np.abs(turns - np.sqrt(np.abs(a)))[(q < 0.1) & is_stable & (a > 0.5)] < 0.1).all()


def test_damping_is_taken_off_the_growth():
    """y = exp(-c t) z, and z obeys Mathieu's equation with a - c²."""
    rng = np.random.default_rng(35)
    a, q, c = rng.uniform(-1.0, 6.0, 60), rng.uniform(0.0, 6.0, 60), rng.uniform(0.01, 0.5, 60)
    with_damping, without_damping = survey("mathieu", a=a, q=q, damping=c), survey("mathieu", a=a - c * c, q=q)
    bound = with_damping["growth_rate_error"] + without_damping["growth_rate_error"] + 1e-14
    assert (np.abs(with_damping["growth_rate"] - without_damping["growth_rate"] + c) <= bound).all()
    assert with_damping["determinant_residual"].max() < 1e-13
    assert {floquet.ASYMPTOTICALLY_STABLE, floquet.UNSTABLE} <= set(with_damping["regime"].tolist())
    check_errors(with_damping)
    a = np.array([-10.0, -33.0, -100.0])  # multipliers from 2e-14 to 3e13
    with_damping, without_damping = survey("mathieu", a=a, q=1.0, damping=0.1), survey("mathieu", a=a - 0.01, q=1.0)
    exact = without_damping["multiplier_real"] * np.exp(-0.1 * np.pi)
    np.testing.assert_allclose(with_damping["multiplier_real"], exact, rtol=1e-12)
    assert (with_damping["multiplier_real_error"] < 1e-12 * exact).all()
    check_errors(with_damping)


def test_kapitzas_pendulum_stands_from_the_exact_frequency_on():
    """Least frequencies over √(g/l), to 11 digits; averaging gives √2 l/A."""
    for ratio, threshold in ((0.05, 28.299716352), (0.1, 14.172890021), (0.2, 7.131528112)):
        frequency = threshold * np.sqrt(9.80665) * np.array([1.0 - 1e-9, 1.0 + 1e-9])
        columns = survey("kapitza_pendulum", amplitude=ratio, frequency=frequency)
        assert columns["regime"].tolist() == [floquet.UNSTABLE, floquet.STABLE]


def test_the_first_region_of_the_paul_trap_ends_at_its_q():
    """At a = 0 both planes have the same multipliers, and the trap is called marginal; Mathieu's equation decides."""
    q = 0.908046333735 + np.array([-1e-11, 1e-11])
    assert survey("mathieu", a=0.0, q=q)["regime"].tolist() == [floquet.STABLE, floquet.PERIOD_DOUBLING]
    columns = survey("paul_trap", a=1e-6, q=[0.9, 0.91])
    assert columns["regime"].tolist() == [floquet.STABLE, floquet.PERIOD_DOUBLING]
    rng = np.random.default_rng(39)
    a, q = rng.uniform(-0.3, 0.3, 60), rng.uniform(0.0, 1.2, 60)
    columns, x, y = (survey("paul_trap", a=a, q=q), survey("mathieu", a=a, q=q), survey("mathieu", a=-a, q=-q))
    error = columns["trace_error"] + x["trace_error"] + y["trace_error"]
    assert (np.abs(columns["trace"] - x["trace"] - y["trace"]) <= error).all()
    stable = (x["regime"] == floquet.STABLE) & (y["regime"] == floquet.STABLE)
    assert ((columns["regime"] == floquet.STABLE) == stable).all()
    check_errors(columns)


@pytest.mark.slow
def test_the_asymmetric_shaft_is_constant_in_axes_that_turn_along():
    """M = -exp(J π/W): the multipliers from the rotating frame's quartic."""
    rng = np.random.default_rng(36)
    d, W = rng.uniform(0.0, 0.9, 80), rng.uniform(0.2, 2.0, 80)
    columns = survey("asymmetric_shaft", asymmetry=d, spin_rate=W)
    linear, constant = 1.0 + W**2, (1.0 - W**2) ** 2 - d**2  # x⁴ + 2 linear x² + constant
    growth = np.sqrt(np.maximum(np.sqrt(linear**2 - constant) - linear, 0.0))
    rounding = 1e-7 * (growth < 1e-7) + 1e-13
    assert (np.abs(columns["growth_rate"] - growth) <= columns["growth_rate_error"] + rounding).all()
    between = (1.0 - d < W * W) & (1.0 + d > W * W)
    assert ((columns["regime"] == floquet.PERIOD_DOUBLING) == between).all()
    check_errors(columns)
    # a round shaft: both pairs are one, so rounding alone orders the four
    check_errors(survey("asymmetric_shaft", asymmetry=0.0, spin_rate=np.linspace(0.3, 1.7, 80)))


def test_a_swing_grows_where_it_is_pumped_at_twice_its_frequency():
    """Growth 3/4 d ω at first order in the depth d; damping above it takes it away."""
    d, rate = 1e-3, np.sqrt(9.80665 / 2.5)
    columns = survey("swing", depth=d, frequency=2.0 * rate, damping=[0.0, 1.45 * d * rate, 1.55 * d * rate])
    assert columns["growth_rate"][0] == pytest.approx(0.75 * d * rate, rel=1e-3)  # order d
    assert columns["regime"].tolist() == [
        floquet.PERIOD_DOUBLING,
        floquet.PERIOD_DOUBLING,
        floquet.ASYMPTOTICALLY_STABLE,
    ]
    check_errors(columns)


@pytest.mark.slow
def test_two_rods_resonate_at_the_sum_of_their_frequencies():
    """Flutter at ω1 + ω2 with a spring in the joint, and none without: modes are then driven alone."""
    mass = np.array([[2.0, 1.0], [1.0, 1.0]])
    for stiffness, regime in ((10.0, floquet.FLUTTER), (0.0, floquet.STABLE)):
        slopes = np.diag([2.0, 1.0]) * 9.80665 + stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
        frequency = np.sqrt(np.linalg.eigvals(np.linalg.inv(mass) @ slopes)).sum()
        columns = survey("parametric_double_pendulum", stiffness=stiffness, frequency=frequency)
        assert columns["regime"] == columns["regime_theory"] == regime
        check_errors(columns)
    rng = np.random.default_rng(37)
    check_errors(
        survey("parametric_double_pendulum", amplitude=rng.uniform(0, 0.3, 40), frequency=rng.uniform(3, 20, 40))
    )


def duffing_oscillator():
    """A driven, damped spring that stiffens: its periodic motion is no equilibrium, and is not known beforehand."""
    settings = {"bounds": (-2, 2), "period": sp.pi, "places": {"small": [0]}, "size": 1, "force": 0.3, "damping": 0.2}
    V = lambda x, force, damping: x**2 / 2 + x**4 / 4 - force * x * sp.cos(2 * T)  # noqa: E731
    return particle(V, R=lambda v, force, damping: damping * v**2 / 2, **settings)


def test_a_base_motion_that_grows_without_bound_is_none():
    """A resonant drive without damping or stiffening: Newton's method cannot close it."""
    columns = of_model(Model(oscillator(lambda t, k: k, lambda t, k: sp.cos(t), k=1.0)), k=[1.0, 0.6])
    assert columns["status"].tolist() == [NO_PERIODIC_MOTION, OK]
    assert np.isnan(columns["trace"][0])


@pytest.mark.slow
def test_a_base_motion_that_is_not_the_only_one_near_is_none():
    """An undamped pendulum, driven weakly near high resonances: in doubles each neighbouring motion closes as well.

    There DOP853 finds the trace 2 to its own errors, so that det(M - 1) = 0; two more are isolated.
    """
    settings = {"bounds": (-4, 4), "period": lambda w, first: 2 * sp.pi / w, "w": 0.9, "first": 1.25}
    V = lambda x, w, first: -sp.cos(x) - x * sp.cos(w * T) / 1000  # noqa: E731
    system = particle(V, places={"swinging": lambda w, first: [first]}, **settings)
    frequencies = np.array([0.475, 0.45, 0.375, 0.325, 0.9, 0.5])
    model, first = Model(system), np.array([0.75, 1.0, 2.0, 2.25, 1.25, 0.5])
    columns = of_model(model, w=frequencies, first=first)
    places = np.array([columns["x_start"], columns["x_dot_start"]]).T
    places[:4, 0] = 0.8964958175976823, 1.2706378595835142, 2.0124676046729761, 2.1537720437052634  # of families
    places[:4, 1] = -0.04298940336919721, 0.029801908141645579, -0.030866649518584446, 0.58261264030460025
    for i, frequency in enumerate(frequencies):
        end, M = solve_with_perturbations(
            lambda t, y, w=frequency: [y[1], np.cos(w * t) / 1000 - np.sin(y[0])], places[i], (0, 2 * np.pi / frequency)
        )
        trace = np.trace(M)
        assert np.abs(end - places[i]).max() < 1e-9, frequency
        if i < 4:
            assert abs(trace - 2.0) < 1e-7, frequency
        else:
            assert abs(trace - columns["trace"][i]) <= columns["trace_error"][i] + 1e-11
            assert abs(trace - columns["trace_theory"][i]) <= 1e-11
    assert columns["status"].tolist()[4:] == [OK] * 2
    assert set(columns["status"][:4].tolist()) <= {NO_PERIODIC_MOTION, NOT_FOUND}
    base = periodic.BaseMotions(model, [frequencies, first], np.zeros(6, dtype=int))
    base.sizes[:] = base.sizes[4]  # none are known of motions that are not found
    base._polish(np.arange(6), places[:, None])
    assert base.status[:4].tolist() == [NO_PERIODIC_MOTION] * 4
    assert (base.residual < 1e-9).tolist() == [False] * 4 + [True] * 2


@pytest.mark.slow
def test_a_point_whose_coefficients_overflow_does_not_blame_the_motion():
    system = oscillator(lambda t, sharpness: 2 + sp.exp(sharpness * sp.cos(t)), sharpness=1.0)
    assert of_model(Model(system), sharpness=[1.0, 800.0])["status"].tolist() == [OK, NON_FINITE]


@pytest.mark.slow
def test_a_force_that_has_a_potential_leaves_pairs():
    """Two springs with a drive: as forces in place of a potential; then with a curl, which has no potential."""
    forces = lambda x, y, u, v, drive, curl, drag: (  # noqa: E731
        drive * (1 + y) * sp.cos(2 * T),
        drive * x * sp.cos(2 * T) - curl * x,
    )
    drag = lambda u, v, drive, curl, drag: drag * (u**2 + v**2)  # noqa: E731
    settings = {"R": drag, "forces": forces, "period": sp.pi, "places": {"rest": [0, 0]}}
    system = particle(lambda x, y, *_: x**2 + 1.2 * y**2, "xy", (-1, 1), **settings, drive=0.1, curl=0.1, drag=0.1)
    columns = of_model(Model(system), drive=0.1, curl=[0.0, 0.1, 0.0], drag=[0.0, 0.0, 0.1])
    words = [REGIMES[code + 1] for code in columns["regime"]]  # the first is -1, undetermined
    assert words == ["stable", "marginal", "asymptotically_stable"]


def unequal_damping():
    """Two oscillators with unequal damping, coupled through a modulated spring: multipliers without pairs."""
    settings = {"names": "xy", "bounds": (-1, 1), "period": sp.pi, "places": {"rest": [0, 0]}, "depth": 0.5}
    V = lambda x, y, d: x**2 / 2 + 1.3 * y**2 + d * x * y * sp.cos(2 * T)  # noqa: E731
    return particle(V, R=lambda u, v, d: 0.1 * u**2 + 0.03 * v**2, **settings)


def platform():
    """A rotor's wobble on a rotating platform of inertias 2 and B."""
    u, v = sp.cos(3 * T), sp.sin(3 * T)

    def rates(x, y, b):
        J = sp.Matrix([[1 + 2 * u**2 + b * v**2, (2 - b) * u * v], [(2 - b) * u * v, 1 + 2 * v**2 + b * u**2]])
        omega = J.adjugate() * sp.Matrix([x, y]) / J.det()
        return omega[1], -omega[0]

    system = flow(rates, "xy", (-1, 1), places={"spin": [0, 0]}, B=3.0)
    system.period(2 * sp.pi / 3)
    return system


def driven_rods():
    """A torque on the first of two rods, which have coupled accelerations: the base motion has accelerations too."""
    return particle(
        lambda first, second, drive, drag: -2 * sp.cos(first) - sp.cos(second),
        ("first", "second"),
        R=lambda v, w, drive, drag: drag * (v**2 + w**2) / 2,
        forces=lambda first, second, v, w, drive, drag: (drive * sp.cos(2 * T), 0),
        kinetic=lambda first, second, v, w, drive, drag: v**2 / 2 + v * w * sp.cos(first - second),
        **{"period": sp.pi, "places": {"hanging": [0, 0]}, "drive": 1.0, "drag": 0.2},
    )


def rough_wave():
    """A wave that is rougher than the motion; at saturation 1 - tanh² has lost the digits of the way back."""
    return oscillator(lambda t, mean, depth: mean + depth * sp.tanh(10 * sp.cos(t)), mean=1.0, depth=1.0)


BY_SCIPY = {  # system → its points, error and longest step of SciPy
    duffing_oscillator: ({"force": [0.3, 1.0]}, 1e-11, np.inf),
    unequal_damping: ({"depth": [0.1, 0.5, 2.5]}, 1e-11, np.inf),
    platform: ({"B": [3.0, 2.0000001, 2.0]}, 1e-12, np.inf),
    rough_wave: ({"mean": [1.5375, 1.6319], "depth": [-1.4451, 0.6273]}, 1e-12, 0.02),
    driven_rods: ({"drive": [0.5, 2.0]}, 1e-11, np.inf),
}


@pytest.mark.parametrize("describe", repeated.but([*BY_SCIPY][:-1], BY_SCIPY))
def test_motions_and_multipliers_are_those_of_dop853(describe):
    values, rounding, max_step = BY_SCIPY[describe]
    check_by_scipy(Model(describe()), rounding, max_step, **values)


@pytest.fixture(scope="module")
def leaning():
    """Mathieu's equation along two directions that lean by 0.7 rad from the coordinates, over π, with a drag."""
    c, s = sp.cos(0.7), sp.sin(0.7)

    def V(x, y, a, b, q, drag):
        wave = 2 * q * sp.cos(2 * T)
        return ((a - wave) * (c * x + s * y) ** 2 + (b - wave) * (c * y - s * x) ** 2) / 2

    def R(u, v, a, b, q, drag):
        return drag * (u**2 + v**2) / 2

    parameters = dict.fromkeys(("a", "b", "q", "drag"), 0.0)
    return Model(particle(V, "xy", (-1, 1), R, sp.pi, places={"rest": [0, 0]}, **parameters))


def test_damped_modes_that_turn_by_half_turns_keep_their_digits(leaning):
    """Two modes of frequencies near 1 and 2: both pairs of multipliers meet."""
    drags = np.array([1e-9, 1e-6, 1e-3])
    columns = of_model(leaning, a=1.0, b=4.0, drag=drags)
    assert (columns["regime"] == floquet.ASYMPTOTICALLY_STABLE).all()
    assert (np.abs(columns["growth_rate"] + drags / 2) <= columns["growth_rate_error"]).all()
    assert (columns["growth_rate_error"] < 1e-11).all()  # a hundred times the rounding of the matrix


def test_large_multipliers_and_slow_growth():
    """a = -33: exp(π √33) = 7e7; and a tongue of growth 1e-4 per period at a frequency of order 1."""
    columns = survey("mathieu", a=-33.0, q=0.0)
    exact = np.exp(np.pi * np.sqrt(33.0))
    assert columns["multiplier_real"][0] == pytest.approx([exact, 1.0 / exact], rel=1e-12)
    assert (columns["multiplier_real_error"] / columns["multiplier_real"] < 1e-11).all()
    slow = survey("mathieu", a=1.0, q=1e-4 / (np.pi / 2) * np.array([1.0, 0.1]))
    assert (np.abs(slow["growth_per_period"] / slow["growth_per_period_theory"] - 1.0) < [1e-5, 1e-3]).all()
    assert (slow["growth_per_period_error"] < 0.01 * slow["growth_per_period"]).all()
    assert slow["regime"].tolist() == [floquet.PERIOD_DOUBLING] * 2


def test_no_pair_of_multipliers_loses_digits_beside_a_large_one(leaning):
    """Pairs are those of each direction alone."""
    rng = np.random.default_rng(41)
    a, b, q = rng.uniform(-120.0, -5.0, 60), rng.uniform(-30.0, 12.0, 60), rng.uniform(0.0, 4.0, 60)
    columns = of_model(leaning, a=a, b=b, q=q)
    pairs = [survey("mathieu", a=mathieu, q=q) for mathieu in (a, b)]
    exact = np.hstack([mathieu["multiplier_real"] + 1j * mathieu["multiplier_imag"] for mathieu in pairs])
    ours = columns["multiplier_real"] + 1j * columns["multiplier_imag"]
    deviation = np.abs(ours[:, :, None] / exact[:, None] - 1.0).min(axis=2)
    # near 1 and -1, at which the lesser pair meets, a rounding of its trace moves it by more
    allowed = 1e-12 / np.minimum(1.0, np.abs(np.abs(pairs[1]["trace"]) - 2.0))
    assert (deviation < np.maximum(1e-12, allowed)[:, None]).all()
    check_errors(columns)
    large = np.abs(exact).max(axis=1) > 1e8
    assert large.sum() > 20
    assert (columns["regime"][large] == floquet.UNSTABLE).all()


def test_the_measurement_is_blind(monkeypatch):
    a, q = np.array([1.0, 2.0]), np.array([0.5, 1.0])
    columns = survey("mathieu", a=a, q=q)
    right = periodic.BaseMotions.integrate_variation

    def integrate_wrongly(*given):
        flow, *residuals = right(*given)
        return floquet.Matrices(*(1.0 + values for values in flow)), *(1.0 + values for values in residuals)

    monkeypatch.setattr(periodic.BaseMotions, "integrate_variation", integrate_wrongly)
    disturbed = survey("mathieu", a=a, q=q)
    assert not np.allclose(columns["trace_theory"], disturbed["trace_theory"])
    for name in columns:
        if f"{name}_theory" in columns or (name.endswith("_error") and name != "propagation_error"):
            assert (columns[name] == disturbed[name]).all(), name


def test_a_period_that_is_none_is_refused():
    system = duffing_oscillator()
    system.period(3)
    with pytest.raises(DescriptionError, match=r"period: force x_dot is .* a period later"):
        Model(system)
    with pytest.raises(DescriptionError, match="period: -1; allowed"):
        system.period(-1)


@pytest.mark.parametrize("depth", [1e-9, 1.0])
def test_a_period_is_checked_of_terms_that_are_small_or_0_at_the_defaults(depth):
    """A wrong period of a term that a grid switches on; and a period with a wrong twelfth digit."""

    def describe(period):
        return oscillator(lambda t, d: 2 + d * sp.cos(1.3 * t), period=period, depth=0.0)

    right = 2 * np.pi / 1.3
    exact = 2.0 * np.cos(right * np.sqrt(2.0))
    assert of_model(Model(describe(right)), depth=0.0)["trace"][0] == pytest.approx(exact, abs=1e-13)
    for false_period in (3, right * (1.0 + 1e-12)):
        with pytest.raises(DescriptionError, match=r"period: force x_dot is .* a period later"):
            check(describe(false_period), depth=depth)
    with pytest.raises(DescriptionError, match=r"period: force x_dot"):
        Model(oscillator(lambda t: 1e9 + depth * sp.cos(t), period=3))


def test_a_slowly_convergent_certificate_is_not_taken_for_rounded():
    """log(1.001 + cos t) has its pole at a distance of 0.045 from the real times: only short steps show the order."""
    columns = of_model(Model(oscillator(lambda t: 2 + sp.log(1.001 + sp.cos(t)))))
    assert columns["status"] == OK
    assert abs(columns["trace"] - columns["trace_theory"]) <= columns["trace_error"]
    assert columns["phase_residual"] < 1e-12


@pytest.mark.slow
def test_no_pulse_of_the_time_is_overlooked():
    """x'' + (2 + p(t)) x = 0, p a pulse of area near 1 and of width 1/√K, down to 1e-7 of the period.

    Against DOP853 where it is measured; nowhere else is it well.
    """

    def stiffness(t, K, at):
        return 2 + sp.sqrt(K / (2 * sp.pi)) * sp.exp(K * (sp.cos(t - at) - 1))

    system = oscillator(stiffness, sharpness=100.0, at=1.0)
    sharpness, times = (y.ravel() for y in np.meshgrid(10.0 ** np.arange(1.0, 14.5, 1.0), [0.0, 0.9, 1.3]))
    columns = of_model(Model(system), sharpness=sharpness, at=times)
    assert (columns["status"][sharpness < 2e3] == OK).all()
    assert (columns["status"][sharpness > 2e5] == NOT_CONVERGED).all()
    for i in np.flatnonzero(columns["status"] == OK):
        width, y = 1.0 / np.sqrt(sharpness[i]), np.array([1.0, 0.0, 0.0, 1.0])

        def rates(t, y, K=sharpness[i], at=times[i]):
            stiffness = 2.0 + np.sqrt(K / (2.0 * np.pi)) * np.exp(K * (np.cos(t - at) - 1.0))
            return [y[1], -stiffness * y[0], y[3], -stiffness * y[2]]

        cuts = [0.0, *(times[i] + width * np.array([-9, -3, 0, 3, 9])), 2.0 * np.pi - 9.0 * width, 2.0 * np.pi]
        cuts = np.unique(np.clip(cuts, 0.0, 2.0 * np.pi))
        for ends in pairwise(cuts):
            step = (ends[1] - ends[0]) / 16
            y = solve_ivp(rates, ends, y, "DOP853", rtol=1e-13, atol=1e-15, max_step=step).y[:, -1]
        assert abs(columns["trace"][i] - y[0] - y[3]) <= columns["trace_error"][i] + 1e-12  # the error of SciPy


@pytest.mark.parametrize(
    ("describe", "message"),
    [
        (lambda: oscillator(lambda t: 2 + sp.tan(t)), "coefficients: they jump, have a kink or a pole"),
        (lambda: oscillator(lambda t: 2 + sp.asin(sp.cos(t))), "coefficients: they jump, have a kink or a pole"),
        (
            lambda: oscillator(lambda t: 2 + 9**9 * sp.exp(10**10 * (sp.cos(t - 1) - 1))),
            "or are too fast for the period",
        ),
        (lambda: oscillator(lambda t: 2 + sp.exp(1e4 * (sp.cos(t) - 1))), "coefficients: near rest they are no finite"),
        (lambda: oscillator(lambda t: 2 + sp.cos(t), period=None), "period: is missing"),
        (lambda: oscillator(lambda t: 2 + t, period=3), r"period: force x_dot is .* a period later"),
        (lambda: oscillator(lambda t: 1, sp.cos), "base motion: none of the system's period"),
    ],
)
def test_what_has_no_multipliers_is_refused_in_words(describe, message):
    """A coefficient that is not smooth, no period, a wrong one, and a base motion that grows without bound."""
    with pytest.raises(DescriptionError, match=message):
        check(describe())


@pytest.mark.slow
def test_a_coefficient_much_faster_than_the_state_is_resolved_or_named():
    """x'' + (2 + 50 cos N t) x = 0 against DOP853; at 30,000 waves the status reports too long steps."""
    some, too_many = (Model(oscillator(lambda t, n=n: 2 + 50 * sp.cos(n * t))) for n in (100, 30_000))
    check_by_scipy(some, rounding=1e-10)  # DOP853 makes some hundred steps of 1e-13
    assert of_model(too_many)["status"] == NOT_CONVERGED


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "ranges"),
    [
        ("mathieu", {"a": (-2, 10), "q": (0, 8), "damping": (0, 0.3)}),
        ("paul_trap", {"a": (-0.3, 0.3), "q": (0, 1.5)}),
        ("swing", {"depth": (0, 0.3), "frequency": (1, 6), "damping": (0, 0.1)}),
        ("kapitza_pendulum", {"amplitude": (0.01, 0.8), "frequency": (1.5, 40), "equilibrium": (0, 1.99)}),
        ("asymmetric_shaft", {"asymmetry": (0, 0.8), "spin_rate": (0.3, 1.7)}),
        ("parametric_double_pendulum", {"amplitude": (0, 0.2), "frequency": (3, 20)}),
    ],
)
def test_every_error_holds_and_no_regime_is_wrong(name, ranges):
    """2,000 points of a shipped system, perturbed by 1e-12 to 1e-2: 99.9 % inside, against the variational flow."""
    rng = np.random.default_rng(40)
    values = {n: rng.uniform(*ends, 2_000) for n, ends in ranges.items()}
    columns = survey(name, **values, epsilon=10 ** rng.uniform(-12, -2, 2_000))
    is_ok = columns["status"] == OK
    assert is_ok.mean() > 0.99
    check_errors(columns, 0.999)


c, s = sp.cos, sp.sin
THROUGH_IDENTITIES = {  # functions of the time t and a number b that vary less than their terms
    "cos² + sin²": lambda t, b: 1 / (c(t) ** 2 + b * s(t) ** 2 + (1 - b) * s(t) ** 2),
    "root of a constant": lambda t, b: sp.sqrt(b * c(t) ** 2 + b * s(t) ** 2),
    "fourth powers, a number": lambda t, b: sp.exp(c(t) ** 4 + s(t) ** 4 + 4 * b * s(t) ** 2 * c(t) ** 2),
    "three times the angle": lambda t, b: 1 / (5 + c(3 * t) - 4 * c(t) ** 3 + 3 * c(t)),
    "sum of angles": lambda t, b: sp.log(2 + s(t + b) - s(t) * c(b) - c(t) * s(b)),
    "nearly constant": lambda t, b: 1 / (1 + 2 * c(t) ** 2 + (2 + 1e-3 * b) * s(t) ** 2),
    "to some roundings": lambda t, b: 1 / (1 + 2 * c(t) ** 2 + (2 + 1e-15 * b) * s(t) ** 2),
    "turned inertia": lambda t, b: (
        1 / ((2 * c(t) ** 2 + 3 * s(t) ** 2) * (2 * s(t) ** 2 + 3 * c(t) ** 2) - (s(2 * t) / 2) ** 2)
    ),
    "hyperbolic root": lambda t, b: sp.sqrt(1 + sp.cosh(c(t)) ** 2 - sp.sinh(c(t)) ** 2),
    "inverse exponentials": lambda t, b: 1 / (1 + sp.exp(c(t)) * sp.exp(-c(t))),
    "tangent": lambda t, b: 1 / (2 + b * c(t) * sp.tan(sp.pi / 8) + s(t) ** 2 + c(t) ** 2),
    "a quotient": lambda t, b: s(2 * t) / (2 + 2 * s(t) * c(t)),
}


STEEP = {
    "tanh": lambda t, b: sp.tanh(40 * c(t) ** 2 + 40 * s(t) ** 2 * c(2 * t)),
    "pulse": lambda t, b: sp.exp(200 * (c(t) - c(t) ** 2 - s(t) ** 2)),
    "near a pole": lambda t, b: 1 / (1.001 * (c(t) ** 2 + s(t) ** 2) + c(t)),
    "near a kink": lambda t, b: sp.sqrt(1e-4 + 1 - s(t) ** 2),
    "narrow beside a constant": lambda t, b: sp.exp(1 + 1e-3 * sp.exp(300 * (c(t) - 1))),
}


@pytest.mark.parametrize("name", [*THROUGH_IDENTITIES, *STEEP])
def test_a_function_is_as_steep_as_it_varies_whatever_its_terms(name):
    """Against the largest slope over the range, of 2^16 values; a constant has none."""
    f, (t, b) = (THROUGH_IDENTITIES | STEEP)[name], sp.symbols("t b", real=True)
    steepness = Steepness(derive(oscillator(f, b=0.5)))([np.array([0.5]), np.zeros(1), np.zeros(1)])
    values = sp.lambdify([t, b], f(t, b) + 0 * t)(np.linspace(0.0, 2 * np.pi, 2**16) + 0.1, 0.5)
    slope = np.abs(np.diff(np.broadcast_to(values, 2**16))).max() * 2**16 / max(np.ptp(values), 1e-300)
    assert (0.9 * slope if np.ptp(values) > 1e-13 else 0.0) <= steepness  # which is a mean over 1/64 of the period
    assert steepness <= (20.0 if name in THROUGH_IDENTITIES else 4.0 * slope)
