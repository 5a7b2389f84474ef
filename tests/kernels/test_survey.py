import itertools
import math

import numpy as np
import pytest
import repeated
from calls import python
from hypothesis import given
from hypothesis import strategies as st
from naive import bodies, signed_rate
from numba import config
from strategies import LANES, point_batches

from kernels.estimator import statuses
from kernels.events import flips
from kernels.free import exact, linear, rigid_body
from kernels.near_axis import survey

SETTINGS = (4.0, 16, 1e-10)
ULP = 2.0**-52
THEORY = {"omega_squared_theory": 2, "growth_rate_theory": 1, "frequency_theory": 1}
UNITLESS = ("regime_theory", "shape", "encircles", "growing_fraction", "triangle_margin")
POWERS = survey.POWERS | THEORY | dict.fromkeys(UNITLESS, 0)


def survey_point(I1, I2, I3, axis, omega0=1.0, epsilon=1e-6, phase=0.6, settings=SETTINGS):
    values = {"I1": I1, "I2": I2, "I3": I3, "axis": axis, "omega0": omega0, "epsilon": epsilon, "phase": phase}
    return {name: column[0] for name, column in survey.survey(values, *settings).items()}


def relative_deviation(columns):
    """Of the rate, the square root of |Omega²|."""
    return np.abs(np.sqrt(np.abs(columns["omega_squared"] / columns["omega_squared_theory"])) - 1)


def test_rates_agree_with_linear_theory_at_every_body_that_can_exist():
    points = bodies(20_000)
    columns = survey.survey(points, *SETTINGS)
    size_squared = np.abs(columns["omega_squared_theory"]) / points["omega0"] ** 2
    deviation = relative_deviation(columns)
    clear, small = size_squared >= 1e-3, (size_squared >= 1e-6) & (size_squared < 1e-3)
    # a nudge of 1e-6 grown tenfold biases by its square, 1e-10, times ratios of the moments
    assert deviation[clear].max() < 1e-8
    stderr = columns["omega_squared_stderr"] / (2 * np.abs(columns["omega_squared"]))
    assert (deviation[small] < 1e-3).all()
    assert (deviation[small] <= 5 * stderr[small] + 1e-6).all()
    assert (columns["regime"] == columns["regime_theory"])[clear | small].all()
    assert (columns["status"] == survey.OK).all()


@pytest.mark.compiled
@pytest.mark.parametrize("axis", [1, 2, 3])
def test_equal_moments_are_marginal_and_never_grow(axis):
    equal, last, phase = [1.0, np.nextafter(1.0, 2.0), np.nextafter(1.0, 0.0)], [0.7, 1.3, 1.9], [0.0, 0.6, 2.1, 4.0]
    grid = np.meshgrid([1.0], equal, last, [1e-8, 1e-6, 1e-4, 1e-2, 0.1, 0.3], phase, indexing="ij")
    *moments, epsilon, phase = (x.ravel() for x in grid)
    points = dict(zip(("I1", "I2", "I3"), np.roll(moments, axis - 1, axis=0), strict=True))
    columns = survey.survey(points | {"axis": axis, "omega0": 1.0, "epsilon": epsilon, "phase": phase}, *SETTINGS)
    assert (columns["regime"] == linear.MARGINAL).all()
    assert (columns["growth_rate"] == 0.0).all()
    assert (columns["growth_rate_reduced"] == 0.0).all()


def test_sphere():
    columns = survey_point(2.0, 2.0, 2.0, 2)
    assert columns["regime"] == columns["regime_theory"] == linear.SPHERE
    assert columns["growth_rate"] == columns["frequency"] == 0.0


@pytest.mark.parametrize(("axis", "sign"), [(1, 1), (2, -1), (3, 1)])
def test_deviation_falls_with_the_square_of_the_nudge(axis, sign):
    epsilon = np.geomspace(1e-5, 1e-2, 16)
    points = {"I1": 1.0, "I2": 2.0, "I3": 2.5, "axis": axis, "omega0": 1.0, "phase": 0.6, "epsilon": epsilon}
    points = {name: np.broadcast_to(value, 16) for name, value in points.items()}
    columns = survey.survey(points, 4.0, 16, 1e-12)
    assert (np.sign(columns["omega_squared"]) == sign).all()
    deviation = np.abs(columns["omega_squared"] / columns["omega_squared_theory"] - 1)
    fitted = (deviation > 1e-11) & (deviation < 1e-2)
    slope = np.polyfit(np.log(epsilon[fitted]), np.log(deviation[fitted]), 1)[0]
    assert fitted.sum() >= 6
    assert abs(slope - 2.0) < 0.1


def dimensionless(columns, omega0):
    """Columns with the spin rate divided out."""
    spin = np.abs(omega0)
    # one factor at a time: the square of a spin of 1e-150 rad/s times a small number is no normal double
    units = {-1: lambda x: x * spin, 0: lambda x: x, 1: lambda x: x / spin, 2: lambda x: x / spin / spin}
    return {name: units[POWERS[name]](column) for name, column in columns.items()}


def assert_same(columns, expected, **kind):
    """Assert that columns are the same bit for bit, missing values included."""
    assert columns.keys() == expected.keys()
    for name in columns:
        np.testing.assert_array_equal(columns[name], expected[name], err_msg=name, **kind)


@pytest.mark.parametrize("factor", [2.0**66, 2.0**-66])
def test_moments_scaled_by_a_power_of_two_give_the_same_bits(factor):
    points = bodies(500)
    scaled = points | {name: points[name] * factor for name in ("I1", "I2", "I3")}
    assert_same(survey.survey(scaled, *SETTINGS), survey.survey(points, *SETTINGS))


@pytest.mark.parametrize("omega0", [1e-9, -1e-9, 1e6, -1e6, 1e-142, 1e150])
def test_any_spin_rate_gives_the_same_dimensionless_results(omega0):
    points = bodies(1000, seed=41)
    unit = points | {"omega0": np.full_like(points["omega0"], np.sign(omega0))}
    plain = survey.survey(unit, *SETTINGS)
    fast = survey.survey(points | {"omega0": np.full_like(points["omega0"], omega0)}, *SETTINGS)
    for name, column in dimensionless(fast, omega0).items():
        # the run itself is the same, bit for bit: the units cost a few roundings, and the least double its own size
        underflow = 5e-324 / omega0 / omega0 if POWERS[name] == 2 else 0.0
        np.testing.assert_allclose(column, plain[name], rtol=8 * ULP, atol=underflow, err_msg=name)


@pytest.mark.compiled
@given(point_batches())
def test_relabelling_the_axes_in_a_cycle_gives_the_same_bits(points):
    relabelled = points | {"I2": points["I1"], "I3": points["I2"], "I1": points["I3"], "axis": points["axis"] % 3 + 1}
    assert_same(survey.survey(points, *SETTINGS), survey.survey(relabelled, *SETTINGS))


@pytest.mark.compiled
@given(point_batches())
def test_a_half_turn_about_a_transverse_axis_gives_the_same_bits(points):
    # (a, b, c) → (-a, b, -c) maps motions to motions; omega_b = epsilon |omega0| cos(phase), or all of it half round
    mirrored = points | {"omega0": -points["omega0"], "phase": -points["phase"]}
    assert_same(survey.survey(points, *SETTINGS), survey.survey(mirrored, *SETTINGS))


@pytest.mark.compiled
@given(point_batches())
def test_the_opposite_nudge_and_a_whole_turn_give_the_same_results(points):
    plain = survey.measure_points(points, *SETTINGS)
    for angle in (np.pi, 2 * np.pi):
        rotated_columns = survey.measure_points(points | {"phase": points["phase"] + angle}, *SETTINGS)
        # the phase is rounded by 1e-15; the bias of a finite amplitude, up to 10 epsilon², depends on it
        change = np.abs(rotated_columns["omega_squared"] - plain["omega_squared"]) / points["omega0"] ** 2
        greatest = np.max([np.abs(np.subtract(*p)) for p in itertools.combinations(three(points), 2)], axis=0)
        # a window may close one sample earlier
        has_same_window = rotated_columns["samples_used"] == plain["samples_used"]
        assert (change[has_same_window] <= 1e-13 * (1 + greatest / np.min(three(points), axis=0)) ** 2).all()
        assert (np.abs(rotated_columns["samples_used"] - plain["samples_used"]) <= 1).all()


def three(points):
    return [points[name] for name in ("I1", "I2", "I3")]


@pytest.mark.compiled
@given(point_batches(3 * LANES), st.randoms(use_true_random=False), st.lists(st.integers(0, 3 * LANES), max_size=4))
def test_any_order_and_any_cuts_give_the_same_bits(points, random, cuts):
    order = list(range(3 * LANES))
    random.shuffle(order)
    all_columns = survey.survey(points, *SETTINGS)
    for chunk in np.split(np.array(order), sorted(cuts)):
        columns = survey.survey({name: value[chunk] for name, value in points.items()}, *SETTINGS)
        assert_same(columns, {name: value[chunk] for name, value in all_columns.items()})


@pytest.mark.parametrize("scale", [1e-300, 1e-150, 1.0, 1e160])
@pytest.mark.parametrize(
    "ratios", [(1.0, 2.0, 3.0), (1.0, 1e3, 1e6), (1.0, 1e6, 1e6 + 1), (1.0, 1.001, 1e6), (1, 1e-6, 2)]
)
def test_extreme_common_scales_keep_the_sign(scale, ratios):
    for order in itertools.permutations(range(3)):
        moments = [scale * ratios[i] for i in order]
        rank = np.argsort(np.argsort(moments))
        points = {"axis": np.array([1, 2, 3]), "omega0": 1.0, "epsilon": 1e-6, "phase": 0.6}
        points |= dict(zip(("I1", "I2", "I3"), moments, strict=True))
        columns = survey.survey({name: np.broadcast_to(value, 3) for name, value in points.items()}, *SETTINGS)
        assert (np.sign(columns["omega_squared_theory"]) == np.array([1, -1, 1])[rank]).all()
        # samples taken max|c_i| times as often determine a rate² only down to their rounding over h²
        greatest = [max(1.0, *np.abs(rigid_body.euler_coefficients(*moments)))] * 3
        clear = np.abs(columns["omega_squared_theory"]) > 64 * ULP * np.square(greatest)
        assert clear.any()
        assert (np.sign(columns["omega_squared"]) == np.sign(columns["omega_squared_theory"]))[clear].all()
        assert ((columns["regime"] == columns["regime_theory"]) | (columns["regime"] == linear.MARGINAL)).all()
        assert (columns["status"] == survey.OK).all()
        for name, column in columns.items():
            if not name.startswith(("growth_rate", "frequency", "e_folds", "euler_period")):
                assert np.isfinite(column).all(), name


# without the compiler NumPy's scalars warn of the NaN that is meant here
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_point_that_is_no_number_leaves_its_neighbours_alone():
    points = bodies(100, seed=10)
    invalid_points = {name: value.copy() for name, value in points.items()}
    invalid_points["I1"][5] = np.nan
    invalid_points["I2"][6] = np.inf
    plain, partly_invalid = (survey.measure_points(x, *SETTINGS, nonlinear=True) for x in (points, invalid_points))
    assert (partly_invalid["status"][[5, 6]] == survey.NON_FINITE).all()
    assert np.isnan([partly_invalid[name][[5, 6]] for name in flips.MEASURED]).all()
    valid = np.setdiff1d(np.arange(points["I1"].size), [5, 6])
    for name in partly_invalid:
        np.testing.assert_array_equal(plain[name][valid], partly_invalid[name][valid], err_msg=name)


def estimates_of_exact(points, settings):
    """Return the estimates from the closed form's samples: rate², log slope and e-folds, in units of the spin."""
    rows = []
    for i in range(points["I1"].size):
        a, spin = points["axis"][i] - 1, points["omega0"][i]
        nudge, phase = points["epsilon"][i] * abs(spin), points["phase"][i]
        start = np.roll([spin, nudge * np.cos(phase), nudge * np.sin(phase)], a)
        h = 2 * np.pi / settings[1] / abs(spin)
        times = h * np.arange(round(settings[0] * settings[1]) + 1)
        moments = np.array(three(points))[:, i]
        motion = exact.rotation(moments, start, times)
        transverse = motion[:, [(a + 1) % 3, (a + 2) % 3]]
        size = np.hypot(*transverse.T) / nudge
        is_off_axis = np.abs(motion[:, a] / spin - 1) > 1 / 32
        is_off_axis[:7] = False
        out = (size > 10) | is_off_axis
        num_samples = int(np.argmax(out)) if out.any() else size.size
        value, stderr = signed_rate(transverse[:num_samples], h) if num_samples >= 4 else (np.nan, np.nan)
        rows.append(
            (
                value / spin**2,
                stderr / spin**2,
                num_samples,
                *log_window(size, num_samples, points["epsilon"][i], h * abs(spin)),
            )
        )
    return np.array(rows).T


def log_window(size, num_samples, epsilon, spacing):
    """Slope per radian of spin and length of the log slope's window, by NumPy's polyfit over the samples inside it."""
    grown_samples = np.flatnonzero(size >= 2)
    if not grown_samples.size or grown_samples[0] >= num_samples:
        return np.nan, np.nan
    inside = np.zeros(size.size, dtype=bool)
    for k in range(grown_samples[0], size.size):
        if not 2 <= size[k] <= min(1000, 1e-2 / epsilon):
            break
        inside[k] = True
    if inside.sum() < 2:
        return np.nan, np.nan
    y = np.log(size[inside])
    return np.polyfit(np.flatnonzero(inside), y, 1)[0] / spacing, y[-1] - y[0]


@pytest.mark.parametrize("tolerance", repeated.but((1e-6, 1e-10), (1e-6, 1e-8, 1e-10, 1e-12)))
@pytest.mark.parametrize("sampling", repeated.but(((4.0, 16),), ((4.0, 16), (3.0, 13))))
def test_measured_rates_are_those_of_the_closed_form(tolerance, sampling):
    rng = np.random.default_rng(43)
    points = bodies(200, seed=44)
    n = points["I1"].size
    points["epsilon"] = 10 ** rng.uniform(-6, np.log10(0.3), n)
    columns = survey.survey(points, *sampling, tolerance)
    value, stderr, num_samples, slope, efolds = estimates_of_exact(points, sampling)
    spin = np.abs(points["omega0"])
    has_same_window = columns["samples_used"] == num_samples
    assert has_same_window.mean() > 0.99  # a window may close one sample earlier if a size is ten to the last digit
    # an error of the samples of size tolerance turns into at most 4/h² times that error
    allowed = 4 * tolerance / (2 * np.pi / sampling[1]) ** 2 + 64 * ULP
    is_comparable = has_same_window & np.isfinite(value)
    assert (np.abs(columns["omega_squared"] / spin**2 - value)[is_comparable] <= allowed).all()
    assert (np.abs(columns["omega_squared_stderr"] / spin**2 - stderr)[is_comparable] <= allowed).all()
    assert (columns["status"][is_comparable] == survey.OK).all()
    assert columns["perturbation_drift"].max() <= tolerance
    has_log_slope = is_comparable & np.isfinite(columns["growth_rate_logslope"])
    assert has_log_slope.any()
    assert (np.abs(columns["growth_rate_logslope"] / spin - slope)[has_log_slope] <= 4 * tolerance + 1e-12).all()
    assert (np.abs(columns["e_folds"] - efolds)[has_log_slope] <= 4 * tolerance + 1e-12).all()
    grows = is_comparable & (columns["regime"] == linear.UNSTABLE)
    assert (np.isfinite(columns["growth_rate_logslope"]) == (efolds >= 2))[grows & (np.abs(efolds - 2) > 1e-9)].all()


def test_a_tolerance_is_used_up_where_steps_are_long():
    # 0.3 of the spin at four samples a rotation: tolerances apart by 1e6 must show in the drift, and bound it
    points = bodies(400, seed=45, epsilon=0.3)
    drifts = [
        survey.measure_points(points, 8.0, 6, tolerance)["perturbation_drift"].max() for tolerance in (1e-4, 1e-10)
    ]
    assert 1e-10 < drifts[0] <= 1e-4
    assert drifts[1] <= 1e-10
    steps = [survey.measure_points(points, 8.0, 6, tolerance)["steps_per_sample"] for tolerance in (1e-4, 1e-10)]
    assert (steps[0] <= steps[1]).all()
    assert (steps[0] < steps[1]).any()


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="a million steps in plain Python are slow")
@pytest.mark.parametrize("epsilon", [1e-6, 1e-3])
def test_a_thousand_rotations(epsilon):
    points = bodies(200, seed=46, epsilon=epsilon)
    columns = survey.survey(points, 1000.0, 16, 1e-10)
    assert (columns["status"] == survey.OK).all()
    assert columns["perturbation_drift"].max() <= 1e-10
    # the rounding of 16,000 steps of order one: 1e-16 times their number's root, or number
    assert columns["energy_drift"].max() <= 1e-12
    assert columns["momentum_drift"].max() <= 1e-12
    stable = np.isin(columns["regime_theory"], [linear.STABLE_MINOR, linear.STABLE_MAJOR])
    assert (columns["samples_used"][stable & (columns["omega_squared_theory"] > 0.05)] == 16001).all()
    clear = np.abs(columns["omega_squared_theory"]) > 1e-2 * points["omega0"] ** 2
    assert (columns["regime"] == columns["regime_theory"])[clear].all()
    assert relative_deviation(columns)[clear].max() < 200 * epsilon**2 + 1e-9


def test_a_window_of_fewer_than_five_samples_is_short():
    points = bodies(64, seed=47)
    for intervals in (1, 2, 3, 4, 5):
        columns = survey.measure_points(points, intervals / 16, 16, 1e-10)
        assert (columns["samples_used"] == intervals + 1).all()
        assert (columns["status"] == (survey.SHORT_WINDOW if intervals < 4 else survey.OK)).all()
        assert (np.isnan(columns["omega_squared"]) == (intervals < 2)).all()
        assert (np.isnan(columns["omega_squared_stderr"]) == (intervals < 3)).all()


def test_a_tolerance_that_cannot_be_kept_is_not_converged():
    points = bodies(64, seed=48)
    # a negative tolerance allows no error, and NaN defines none
    for tolerance in (-1.0, np.nan):
        assert (survey.measure_points(points, 4.0, 16, tolerance)["status"] == statuses.NOT_CONVERGED).all()


def test_too_few_steps_are_not_converged():
    # one step a sample, whatever the tolerance: in a process of its own, for the compiler freezes and keeps constants
    program = """
import numpy as np
from kernels.compile import jit
jit.leave_out_compiler()
from kernels.free import direct
direct.MAX_STEPS = 1
from kernels.near_axis import survey
points = {"I1": 1.0, "I2": 2.0, "I3": 2.7, "axis": 2, "omega0": 1.0, "phase": 0.6}
points = {name: np.full(2, value) for name, value in points.items()} | {"epsilon": np.array([0.5, 1e-6])}
print(*(status for tolerance in (1e-9, 1e-3) for status in survey.measure_points(points, 1.5, 8, tolerance)["status"]))
"""
    output = python(program, PYTHONWARNINGS="ignore")
    # the small perturbation needs a single step, and so do both at a loose tolerance
    expected = [statuses.NOT_CONVERGED, survey.OK, survey.OK, survey.OK]
    assert output.split() == [str(status) for status in expected]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[(moment, value) for moment in ("I1", "I2", "I3") for value in (np.nan, np.inf, 0.0)],
        *[("omega0", value) for value in (np.nan, np.inf, -np.inf, 0.0)],
        ("epsilon", np.nan),
        ("phase", np.nan),
    ],
)
def test_what_is_no_number_is_told_and_never_measured(name, value):
    columns = survey_point(**({"I1": 1.0, "I2": 2.0, "I3": 2.7, "axis": 2} | {name: value}))
    assert columns["status"] == survey.NON_FINITE
    assert columns["regime"] == -1
    for column in ("growth_rate", "frequency", "growth_rate_stderr", "frequency_stderr", "growth_rate_logslope"):
        assert np.isnan(columns[column]), column


def test_columns_belong_together():
    points = bodies(2000, seed=49)
    points["epsilon"] = 10 ** np.random.default_rng(50).uniform(-8, -1, points["I1"].size)
    columns = survey.survey(points, *SETTINGS)
    spin = np.abs(points["omega0"])
    grows, turns = columns["growth_rate"] > 0, columns["frequency"] > 0
    assert not (grows & turns).any()
    assert (grows == (columns["regime"] == linear.UNSTABLE)).all()
    assert (turns == np.isin(columns["regime"], [linear.STABLE_MINOR, linear.STABLE_MAJOR])).all()
    for name, selection, sign in (("growth_rate", grows, -1), ("frequency", turns, 1)):
        rate, stderr = columns[name][selection], columns[name + "_stderr"]
        np.testing.assert_allclose(sign * rate**2, columns["omega_squared"][selection], rtol=8 * ULP)
        np.testing.assert_allclose(
            stderr[selection], columns["omega_squared_stderr"][selection] / (2 * rate), rtol=8 * ULP
        )
        assert np.isnan(stderr[~selection]).all()
    ratios = np.max(np.abs([rigid_body.euler_coefficients(*m) for m in zip(*three(points), strict=True)]), axis=1)
    assert (ratios <= 1).all()
    spacing = 2 * np.pi / 16 / spin
    np.testing.assert_allclose(columns["window_end"], (columns["samples_used"] - 1) * spacing, rtol=4 * ULP)
    assert ((columns["samples_used"] >= 4) & (columns["samples_used"] <= 65)).all()
    assert (columns["steps_per_sample"] >= 1).all()
    assert {columns[name].dtype for name in ("regime", "status", "regime_theory", "shape")} == {np.dtype(np.int8)}
    assert {columns[name].dtype for name in ("samples_used", "steps_per_sample")} == {np.dtype(np.int32)}


def test_the_spacing_shrinks_for_bodies_that_cannot_exist():
    columns = survey_point(0.01, 1.0, 3.0, 1, omega0=2.0)
    # (3 - 1)/0.01 = 200 times the spin is a bound on every rate
    assert columns["window_end"] == pytest.approx(64 * 0.5 / 200 / 2.0, rel=1e-14, abs=0)
    assert survey_point(1.0, 1.1, 1.2, 1)["window_end"] == pytest.approx(8 * np.pi, rel=1e-14, abs=0)


@pytest.mark.parametrize("collapse", [False, True])
def test_what_doubles_cannot_hold_is_missing_and_said(collapse):
    points = bodies(200, seed=8) | {"epsilon": np.full(200, 1e-3)}
    points["omega0"] = 10.0 ** np.linspace(-150, 150, 200)
    columns = survey.survey(points, *SETTINGS, collapse=collapse)
    is_too_slow = points["omega0"] < survey.MIN_SPIN
    assert 3 < is_too_slow.sum() < 10
    for name in (name for name, power in survey.POWERS.items() if power == 2):
        np.testing.assert_array_equal(np.isnan(columns[name]), is_too_slow, err_msg=name)
    np.testing.assert_array_equal(columns["status"] == statuses.NON_FINITE, is_too_slow)
    assert (columns["omega_squared_error"][~is_too_slow] >= np.finfo(float).tiny).all()
    assert np.isfinite(columns["growth_rate"]).all()
    assert (columns["regime"] == columns["regime_theory"]).all()


@pytest.mark.parametrize("propagator", ["direct", "exact"])
def test_a_window_closes_where_the_perturbation_has_decayed_into_rounding(propagator):
    """On the decaying direction the motion falls to 1e-9 of its start, and rises again out of rounding."""
    a, b, c = 2.0, 2.5, 1.5  # cyclic from axis 3
    cb, cc = (c - a) / b, (a - b) / c
    points = {"I1": b, "I2": c, "I3": a, "axis": 3, "omega0": 1.0, "epsilon": 1e-6}
    phase = math.atan2(-math.sqrt(cb * cc), cb)
    columns = survey.survey(points | {"phase": phase}, 60.0, 16, 1e-10, propagator=propagator)
    rate = columns["growth_rate_theory"][0]
    assert columns["growing_fraction"][0] < 1e-15
    assert rate * columns["window_end"][0] == pytest.approx(math.log(1e6), rel=0.02)
    allowed = {"direct": 1e-9, "exact": 1e-12}[propagator]  # some times the tolerance, and rounding
    assert abs(columns["growth_rate_reduced"][0] - rate) <= columns["growth_rate_reduced_error"][0] < allowed
