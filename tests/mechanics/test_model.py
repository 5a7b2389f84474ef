import math

import mpmath
import numpy as np
import pytest
import repeated
import sympy as sp
from described import flow, model_of, particle, points, points_at
from oscillators import LIBRARY
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from test_periodic import duffing_oscillator

from kernels.estimator import statuses
from kernels.flow import oscillations as kernel
from sweeps.mechanics import System, equilibria, modes
from sweeps.mechanics.model import Model
from sweeps.points import catalogue
from sweeps.points.columns import measure_points
from sweeps.points.loading import read_sweep
from sweeps.schema.refusals import DescriptionError
from sweeps.systems import register_system
from sweeps.systems.reintegration import rates_of

EACH = repeated.but(("pendulum", "bead_on_hoop"), LIBRARY)  # the code of each further system takes long to compile
PROMISED, MIN_RELATIVE_RATE = 1e-6, 1e-3  # largest relative error of ω², and the least |ω²|/S² at which it applies


@pytest.mark.parametrize("name", EACH)
def test_errors_hold_the_distance_to_linear_theory(name):
    model = model_of(name)
    for epsilon in (1e-8, 1e-6, 1e-4, 1e-2, 1e-1):
        columns = model.survey(points(model, 40, LIBRARY[name], epsilon=epsilon))
        is_ok, theory = columns["status"] == statuses.OK, columns["omega_squared_theory"]
        # at 0.1 orders no longer fall fast, and the reduced error has room for that
        for value, bar in (("omega_squared", 10.0), ("omega_squared_reduced", 60.0 if epsilon > 1e-3 else 10.0)):
            deviation, error = np.abs(columns[value] - theory), columns[f"{value}_error"]
            assert (deviation <= error)[is_ok].all()
            is_visible = is_ok & (deviation > 1e-14 * columns["rate_scale"] ** 2)
            assert not is_visible.any() or np.median(error[is_visible] / deviation[is_visible]) <= bar
        differs = columns["regime"] != columns["regime_theory"]
        assert (columns["regime"][is_ok & differs] == kernel.MARGINAL).all()
        if epsilon == 1e-6:
            is_large = is_ok & (np.abs(theory) >= MIN_RELATIVE_RATE * columns["rate_scale"] ** 2)
            assert np.abs(columns["omega_squared"] / theory - 1)[is_large].max() <= PROMISED
            assert np.isin(columns["status"], (statuses.OK, statuses.NO_EQUILIBRIUM)).all()
            assert np.nanmax(columns["energy_drift"]) <= 1e-10
            assert not differs.any()


@pytest.mark.slow
def test_errors_hold_the_rounding_of_an_equilibrium_near_which_the_force_hardly_changes():
    """Of r^s with s near -2 the circle's radius is known to some roundings over s + 2."""
    model, s = model_of("central_potential"), np.linspace(-1.95, -1.75, 150)
    parameters = points(model, 150, {"angular_momentum": (0.05, 5.0)}, epsilon=1e-12)
    parameters["exponent"] = np.repeat(s, 2)
    columns = model.survey(parameters)
    with mpmath.workdps(30):
        exact = []
        for s, L, mode in zip(parameters["exponent"], parameters["angular_momentum"], parameters["mode"], strict=True):
            orbit = mpmath.mpf(L) ** ((2 * mpmath.mpf(s) - 4) / (mpmath.mpf(s) + 2))
            exact.append(float((mpmath.mpf(s) + 2 if mode == (1 if s < -1 else 2) else 1) * orbit))
    for name in ("omega_squared", "omega_squared_reduced"):
        ratio = np.abs(columns[name] - np.array(exact)) / columns[f"{name}_error"]
        assert ratio.max() <= 1.0


@pytest.mark.slow
# unmeasured modes move by more than the measured mode: rounding of the whole motion; phases of both modes
def test_errors_hold_where_a_direction_is_soft_or_flat():
    """Two masses on springs that hardly resist in one direction, and terms of higher order: against 40 digits.

    The position of the equilibrium is as soft: its error moves ω² by the terms of third and fourth order.
    """
    random, count, n = np.random.default_rng(5), 300, 2
    names = ("k00", "k01", "k11", "m0", "m1", "cubic", "quartic")
    system = particle(
        lambda x, y, k00, k01, k11, m0, m1, cubic, quartic: (
            k00 * x**2 / 2 + k01 * x * y + k11 * y**2 / 2 + cubic * (x**3 + y**3) + quartic * (x**4 + y**4)
        ),
        "xy",
        (-1, 1),
        size=1,
        kinetic=lambda x, y, u, v, k00, k01, k11, m0, m1, *_: ((m0 - 1) * u**2 + (m1 - 1) * v**2) / 2,
        **{"places": {"zero": [0, 0]}} | dict.fromkeys(names, 1.0),
    )
    angle, soft = (
        random.uniform(0.0, np.pi, count),
        np.where(random.random(count) < 0.1, 0.0, 10.0 ** -random.uniform(1, 14, count)),
    )
    c, s = np.cos(angle), np.sin(angle)
    stiffness = c * c + soft * s * s, c * s * (1.0 - soft), s * s + soft * c * c
    masses = 10.0 ** random.uniform(-3, 3, (n, count))
    values = [*stiffness, *masses, random.choice([0.0, 0.3], count), random.choice([0.0, 0.5, 5.0], count)]
    columns = {name: np.repeat(v, n) for name, v in zip(names, values, strict=True)}
    columns |= {"equilibrium": np.zeros(n * count, dtype=int), "mode": np.tile([1, 2], count)}
    result = Model(system).survey(columns | {"epsilon": np.full(n * count, 1e-6), "phase": np.full(n * count, 0.6)})
    with mpmath.workdps(40):
        exact = []
        for k00, k01, k11, m0, m1, *_ in zip(*values, strict=True):
            inner = mpmath.mpf(k01) / mpmath.sqrt(mpmath.mpf(m0) * mpmath.mpf(m1))
            matrix = mpmath.matrix([[mpmath.mpf(k00) / m0, inner], [inner, mpmath.mpf(k11) / m1]])
            exact += sorted(float(v) for v in mpmath.eigsy(matrix, eigvals_only=True))
    deviation, is_ok = np.abs(result["omega_squared"] - exact), result["status"] == statuses.OK
    assert is_ok.sum() > count
    assert (deviation <= result["omega_squared_error"])[is_ok].all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mass", "length", "epsilon", "phase", "place", "along", "run"),
    [
        (17.16344234189973, 19.65584977499387, 1.0879752652875257e-08, -2.1158244285821226, (2, 1),
         (-0.24113894658841284, -0.3466588157763155), (7.25, 4, 7.893156105532374e-13)),
        (1.0, 3.9494144483073987, 0.42515502662441207, -2.9888618081822664, (0, 2),
         (0.24894104195814948, 0.44987435052199887), (1.9, 10, 7.001503330207384e-10)),
        (32.45972882269972, 16.340697234110355, 0.37306038259714935, -0.3484808974719562, (1, 1),
         (0.20347284273258048, -0.22030280604475316), (0.7407407407407407, 27, 4.69679954929601e-13)),
    ],
)  # fmt: skip
def test_errors_hold_where_other_modes_move_too(mass, length, epsilon, phase, place, along, run):
    model = model_of("double_pendulum")
    slot, mode = place
    rows = points_at(model, [slot], mass2=mass, length2=length, epsilon=epsilon, phase=phase)
    columns = model.survey({name: values[mode - 1 : mode] for name, values in rows.items()}, *run, direction=along)
    deviation = np.abs(columns["omega_squared_reduced"] - columns["omega_squared_theory"])
    assert columns["status"][0] == statuses.OK
    assert deviation[0] <= columns["omega_squared_reduced_error"][0]


def cone(p, result):
    """The lecture's conical motion."""
    cosine = np.cos(result["theta_equilibrium"])
    return p["gravity"] / p["length"] * (1 + 3 * cosine**2) / cosine


def molecule(p, _):
    """Landau and Lifshitz's molecule, with its flat mode."""
    k, A, B = (p[name][::3] for name in ("stiffness", "outer_mass", "inner_mass"))
    return np.sort(np.stack([0 * k, k / A, k * (2 * A + B) / (A * B)]), axis=0).T.ravel()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "textbook"), [("spherical_pendulum", cone), ("linear_triatomic", molecule)])
def test_squares_are_those_of_textbooks(name, textbook):
    model = model_of(name)
    columns = points(model, 20, LIBRARY[name])
    result = model.survey(columns)
    squares = textbook(columns, result)
    assert (np.abs(result["omega_squared"] - squares) <= 1e-9 * result["rate_scale"] ** 2).all()
    assert (result["regime"] == np.where(squares == 0, kernel.MARGINAL, kernel.STABLE)).all()


def test_a_large_swing_is_slower_by_its_amplitude_squared():
    """−θ0²/16 in the frequency, over whole periods: S is the rate itself, so 4 cycles are 4 periods."""
    model = model_of("pendulum")
    sizes = np.geomspace(2e-3, 5e-2, 9)
    columns = points(model, 9, {}, phase=0.0)
    columns["epsilon"] = np.repeat(sizes, 2)
    result = model.survey(columns)
    is_lower = columns["equilibrium"] == 0
    deviation = 1 - result["frequency"][is_lower] / result["frequency_theory"][is_lower]
    assert np.polyfit(np.log(sizes), np.log(deviation), 1)[0] == pytest.approx(2.0, abs=0.1)
    assert deviation / sizes**2 == pytest.approx(1 / 16, rel=0.02)
    shift = result["amplitude_shift"] / result["omega_squared_theory"]
    assert shift[is_lower] / sizes**2 == pytest.approx(-1 / 8, rel=0.02)


@pytest.mark.slow
def test_two_nudges_take_away_the_error_of_first_order():
    """The Morse bonds have V‴ ≠ 0: ω² from half the difference is off by ε², from one run by ε."""
    model = model_of("linear_triatomic")
    both = [model.survey(points(model, 1, {}, epsilon=epsilon, phase=0.0)) for epsilon in (1e-3, 1e-4)]
    large, small = (np.abs(columns["omega_squared"] / columns["omega_squared_theory"] - 1)[1] for columns in both)
    assert np.log10(large / small) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("name", ["bead_on_hoop", pytest.param("double_pendulum", marks=pytest.mark.slow)])
def test_no_measured_column_depends_on_a_theoretical_rate(name, monkeypatch):
    model = model_of(name)
    columns = points(model, 10, LIBRARY[name])
    columns_before = model.survey(columns)
    honest = modes.normal_modes

    def nonsense(hessian, a):
        squares, vectors = honest(hessian, a)
        return np.flip(squares, axis=1) * -3.7 + 1.0, vectors

    monkeypatch.setattr(modes, "normal_modes", nonsense)
    disturbed = model.survey(columns)
    for column in columns_before:
        is_equal = np.array_equal(columns_before[column], disturbed[column], equal_nan=True)
        assert is_equal != column.endswith("_theory"), column


def test_a_flat_line_is_a_status():
    model = model_of("bead_on_wire")
    columns = points(model, 1, {}) | {"gravity": np.array([4.0]), "spin_rate": np.array([2.0])}
    result = model.survey(columns)
    assert result["status"].tolist() == [statuses.FLAT]
    assert np.isnan(result["omega_squared"]).all()


SWEEPS = ("bead_on_hoop", "mathieu", "driven", "double_pendulum", "lagrange_points", "gravity_gradient_damped")


@pytest.mark.parametrize("name", repeated.but(SWEEPS[:3], SWEEPS))
def test_no_bit_of_a_point_depends_on_the_others(name):
    """Nor on the number of Newton's steps at neighbouring points, of a driven spring."""
    driven = {"system": register_system(duffing_oscillator()), "grid": {"force": np.linspace(0.0, 2.0, 90).tolist()}}
    sweep = read_sweep(driven if name == "driven" else catalogue.shipped_files()[name])
    numbers = np.random.default_rng(5).choice(sweep.grid.size, 40, replace=False)
    points = [sweep.grid.points(int(number), int(number) + 1) for number in numbers]
    together = measure_points(
        {key: np.concatenate([point[key] for point in points]) for key in sweep.grid.arguments}, sweep
    )
    for i in (0, 17, 39):
        alone = measure_points({key: points[i][key] for key in sweep.grid.arguments}, sweep)
        assert [key for key in alone if alone[key][0].tobytes() != together[key][i].tobytes()] == []


def test_a_step_that_is_too_long_is_halved_until_it_holds():
    """A perturbation of 0.3 at the loosest plan: the halving test detects it, and the points are run again."""
    model = model_of("pendulum")
    columns = points(model, 3, LIBRARY["pendulum"], epsilon=0.9)
    loose = model.survey(columns, tolerance=1e-3)
    tight = model.survey(columns, tolerance=1e-12)
    assert (tight["status"] == statuses.OK).all()
    assert (tight["steps_per_sample"] > loose["steps_per_sample"]).all()
    assert loose["omega_squared"] == pytest.approx(tight["omega_squared"], rel=1e-2)


# ---------------------------------------------------------------------------------------------------------
# A direction of the nudge


def hanging_pendulum(model, **given):
    columns = points(model, 1, {}) | {name: np.full(8, value) for name, value in given.items()}
    return {name: values[:2] for name, values in columns.items()}


@pytest.mark.slow
@pytest.mark.parametrize("direction", [(1.0, 0.0), (-0.5, 2.0)])
def test_a_nudge_in_a_direction_is_scipys_motion_mode_by_mode(direction):
    model = model_of("double_pendulum")
    m1, m2, l1, l2, g = 1.0, 0.4, 1.0, 0.7, 9.80665
    columns = hanging_pendulum(model, mass2=m2, length2=l2, epsilon=0.05)
    result = model.survey(columns, direction=direction)
    size = model.theory(columns)["sizes"][0]
    start = 0.05 * np.array(direction) / np.abs(direction / size).max()
    S = result["rate_scale"][0]
    a = np.array([[(m1 + m2) * l1 * l1, m2 * l1 * l2], [m2 * l1 * l2, m2 * l2 * l2]])
    squares, vectors = eigh(np.diag([(m1 + m2) * g * l1, m2 * g * l2]), a)
    h = np.pi / 8 / S
    state = [*(start * np.cos(0.6)), *(-start * S * np.sin(0.6))]
    rates, times = rates_of(model.equations), np.arange(65) * h
    right = lambda t, x: rates((m1, m2, l1, l2, g), t, x)  # noqa: E731
    motion = solve_ivp(right, (0, 64 * h), state, "DOP853", times, rtol=3e-14, atol=1e-16).y[:2]
    for k in (0, 1):
        x = (vectors[:, k] @ a @ motion)[: result["samples_used"][k]]
        cosine = 0.5 * ((x[2:] + x[:-2]) @ x[1:-1]) / (x[1:-1] @ x[1:-1])
        expected = (np.arccos(cosine) / h) ** 2
        # rounding of a sample over the second difference; the nonlinear shift of this nudge is 1e-4 and more
        assert result["omega_squared"][k] == pytest.approx(expected, rel=1e-9)
        assert abs(expected / squares[k] - 1) > 1e-5
    # the columns' contributions of the modes add up to the perturbation; the measured rate is off by the shift
    mode_shapes = vectors / np.abs(vectors / size[:, None]).max(axis=0)
    mode_shapes *= np.sign(mode_shapes[np.abs(mode_shapes).argmax(axis=0), [0, 1]])
    assert mode_shapes @ (result["amplitude"] * np.cos(result["initial_phase"])) == pytest.approx(
        start * np.cos(0.6), rel=1e-9
    )


@pytest.mark.slow
def test_a_mode_without_a_share_of_the_direction_is_said():
    model = model_of("double_pendulum")
    columns = hanging_pendulum(model)
    first = model.theory(columns)["modes"][0, :, 0]
    result = model.survey(columns, direction=first)
    assert result["status"].tolist() == [statuses.OK, statuses.NOT_PERTURBED]
    assert np.isnan(result["omega_squared"]).tolist() == [False, True]
    assert result["regime"].tolist() == [kernel.STABLE, -1]
    assert result["omega_squared"][0] == pytest.approx(model.survey(columns)["omega_squared"][0], rel=1e-12)


def test_log_slope_is_the_rate_where_its_window_holds_it():
    model = model_of("pendulum")
    columns = points(model, 6, LIBRARY["pendulum"], phase=0.0)
    result = model.survey(columns)
    upright = columns["equilibrium"] == 1
    assert np.isnan(result["e_folds"][~upright]).all()
    # ln cosh from 2 to at most 1000 times the start, less the two samples that miss its ends
    assert (np.abs(result["e_folds"][upright] - np.log(500)) <= 2 * np.pi / 8).all()
    # at 2 the decaying part is still a thirteenth of the motion
    assert result["growth_rate_logslope"][upright] == pytest.approx(result["growth_rate_theory"][upright], rel=5e-3)
    large = model.survey(columns | {"epsilon": np.full(12, 1e-3)})  # 0.01 is ten times this nudge, 1.6 e-folds above 2
    assert (large["e_folds"][upright] > 1.0).all()
    assert np.isnan(large["growth_rate_logslope"]).all()


def test_the_energy_of_a_narrow_well_is_watched():
    """exp(-1250 (x - 1)²), expanded, is a product of exp(2500 x) and exp(-1250): infinity times 0, a drift of 0."""
    V = lambda x, w: -(w**2) * sp.exp(-((x - 1) ** 2) / (2 * w**2))  # noqa: E731
    system = particle(V, bounds=(-3, 3), places={"well": [1]}, width=0.02)
    model = Model(system)
    result = model.survey(points_at(model, epsilon=1e-3))
    assert 0.0 < result["energy_drift"][0] < 1e-13


OF_PARAMETERS = {  # of a parameter a, and of a number
    "modulus": (lambda a: 1 + sp.Abs(a), lambda a: 1 + abs(a)),
    "greater": (lambda a: sp.Max(a, 1, a**2), lambda a: max(a, 1, a * a)),
    "less": (lambda a: 2 + sp.Min(a, 1), lambda a: 2 + min(a, 1)),
    "cases": (lambda a: sp.Piecewise((1 + a**2, a > 0), (2, True)), lambda a: 1 + a * a if a > 0 else 2),
    "whole": (lambda a: 5 + sp.floor(a), lambda a: 5 + math.floor(a)),
    "part": (lambda a: 1 + sp.Mod(a, 1), lambda a: 1 + a % 1),
    "step": (lambda a: 1 + sp.Heaviside(a - 1, 0), lambda a: 1 + (a > 1)),
    "factorial": (lambda a: sp.gamma(2 + a), lambda a: mpmath.gamma(2 + a)),
    "Bessel": (lambda a: 2 + sp.besselj(0, a), lambda a: 2 + mpmath.besselj(0, a)),
    "root of a square": (lambda a: 1 + sp.sqrt((1 - a) ** 2), lambda a: 1 + abs(1 - a)),
    "angle": (lambda a: sp.atan2(2, a), lambda a: math.atan2(2, a)),
    "zeta": (lambda a: sp.zeta(a + 5), lambda a: mpmath.zeta(a + 5)),
    "inner": (lambda a: sp.exp(sp.sin(sp.Abs(a) ** 3)), lambda a: math.exp(math.sin(abs(a) ** 3))),
}


@pytest.mark.parametrize("place", ["V", "mass", "rate"])
@pytest.mark.parametrize("name", OF_PARAMETERS)
def test_functions_of_parameters_alone_are_numbers(name, place):
    """Against mpmath; all equilibria are proved."""
    (of_a, of_number), values = OF_PARAMETERS[name], [-0.7, 0.3, 1.6]
    if place == "rate":
        rates = lambda x, y, a: (y, -of_a(a) * sp.sin(x) - y / 10)  # noqa: E731
        system = flow(rates, "xy", (-1, 1), places={"rest": [0, 0]}, a=0.3)
    else:
        V = lambda x, a: (of_a(a) if place == "V" else 1) * (1 - sp.cos(x))  # noqa: E731
        kinetic = (lambda x, v, a: (of_a(a) - 1) * v**2 / 2) if place == "mass" else None
        system = particle(V, bounds=(-1, 1), size=1, kinetic=kinetic, places={"rest": [0]}, a=0.3)
    model, parameters = Model(system), [np.array(values)]
    zeros = model.equilibria(parameters)
    assert (zeros.certified == equilibria.PROVED).all()
    assert (zeros.counts == 1).all()
    square = -model.landscape.slopes(parameters, list(zeros.places[:, 0].T))[0][:, -1, 0]
    square /= model.landscape.a(parameters, [np.zeros(3)])[:, 0, 0] if place == "mass" else 1.0
    expected = np.array([float(of_number(value)) for value in values])
    # some roundings of SciPy's functions
    assert square == pytest.approx(1 / expected if place == "mass" else expected, rel=1e-14)


def test_a_function_without_values_is_refused_by_its_name():
    system = particle(lambda x, a: sp.Function("f")(a) * x**2, size=1, places={"rest": [0]}, a=0.3)
    with pytest.raises(DescriptionError, match="f has no values in NumPy or SciPy"):
        Model(system).equilibria([np.ones(1)])


@pytest.mark.parametrize(
    ("options", "bounds"),
    [
        ({"periodic": True}, (-sp.pi, sp.pi)),
        ({"periodic": True, "bounds": (0, 2 * sp.pi)}, (0, 2 * sp.pi)),
        ({"periodic": True, "momentum": 1}, (-sp.pi, sp.pi)),
        ({"momentum": 1}, (0, 0)),
        ({"bounds": (-1, 2)}, (-1, 2)),
        ({}, None),
    ],
)
def test_the_bounds_of_a_periodic_coordinate_are_a_whole_turn_by_default(options, bounds):
    system = System("Bounds")
    if bounds is None:
        with pytest.raises(DescriptionError, match="bounds are missing"):
            system.coordinate("x", "rad", **options)
    else:
        system.coordinate("x", "rad", **options)
        assert system.coordinates["x"].bounds == bounds


@pytest.mark.slow
def test_an_expression_that_would_take_hours_is_refused_at_once():
    states, body = System("States"), System("Body")
    x, _ = states.state("x", bounds=(-1, 1)), body.coordinate("x", bounds=(-1, 1))  # the same symbol
    long = sp.Add(*(k * x**k for k in range(2, 2001)), evaluate=False)
    ways = (lambda: states.rate(x, long), lambda: body.potential(long), lambda: body.force(x, long))
    for give in (*ways, lambda: body.kinetic_energy(long * body.velocity(x) ** 2)):
        with pytest.raises(DescriptionError, match=r"of [5-9],\d\d\d operations; allowed: at most 5,000"):
            give()
