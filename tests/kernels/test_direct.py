import math
from functools import partial

import mpmath
import numpy as np
import precise
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from naive import taylor_terms, truncation
from numba import config

from kernels.free import direct, exact, rigid_body, taylor
from kernels.near_axis import propagators

ULP = 2.0**-52
STEPS, NEAR, NEAREST = (dict(zip(direct.ORDERS, taylor.STEPS[k::3], strict=True)) for k in range(3))
KINDS = [(NEAR, 7, 4, direct.is_near), (NEAREST, 5, 2, direct.is_nearest)]  # the spin's terms: summed, and taking part
FEWER = 10 if config.DISABLE_JIT else 1  # steps in plain Python are slow
# nought, or large enough that no term of a series underflows
STATE, COEFFICIENTS = (
    st.tuples(*[st.floats(-largest, largest).map(lambda x: x if abs(x) > 1e-3 else 0.0)] * 3) for largest in (1.2, 1.0)
)


def test_a_step_has_the_number_of_its_name():
    for number, step in enumerate(taylor.STEPS):
        spin, order = step.__name__.split("step_")
        assert getattr(propagators, f"{spin or 'taylor_'}{order}".upper()) == number
        assert propagators.ORDER[number] == float(order)
        assert (propagators.IS_NEAR[number], propagators.IS_NEAREST[number]) == (spin == "near_", spin == "nearest_")


def test_last_terms_of_a_step_occur_in_its_sums_alone():
    assert "b4 = " not in taylor.step_lines(taylor.EULER, 4)


def random_body(rng):
    """Moments of a body that can exist: any second moments of mass."""
    masses = rng.uniform(0, 1, 3)
    return masses.sum() - masses


def near_terms(state, k, order, num_terms=7, factors=4):
    """The series of the near step by its definition: a to its 7th term; its terms 0 to 4 contribute to b and c."""
    a, b, c = ([x] for x in state)
    for n in range(order):
        spin = k[0] / (n + 1) * math.fsum(b[i] * c[n - i] for i in range(n + 1))
        terms = [
            k[m] / (n + 1) * math.fsum(a[i] * factor[n - i] for i in range(min(n, factors) + 1))
            for m, factor in ((1, c), (2, b))
        ]
        a.append(spin if n < num_terms else 0.0)
        b.append(terms[0])
        c.append(terms[1])
    return a, b, c


@pytest.mark.parametrize(
    ("steps", "series"),
    [(STEPS, taylor_terms), (NEAR, near_terms), (NEAREST, partial(near_terms, num_terms=5, factors=2))],
    ids=["whole", "near", "nearest"],
)
@pytest.mark.parametrize("order", direct.ORDERS)
@given(state=STATE, k=COEFFICIENTS)
def test_step_is_the_sum_of_the_series_to_its_order(steps, series, order, state, k):
    terms = series(state, k, order)
    # rounding: an ulp or two of the sum of absolute terms, in which the cancelling products dominate
    absolute = series([abs(x) for x in state], [abs(x) for x in k], order)
    for ours, mine, size in zip(steps[order](*state, *k), terms, absolute, strict=True):
        assert abs(ours - math.fsum(mine)) <= 4 * ULP * sum(size)


@pytest.mark.parametrize("step", [STEPS[10], NEAR[10], NEAREST[10]])
@given(spin=st.floats(0.1, 1.0), k=COEFFICIENTS, exponent=st.floats(-700, -20))
def test_a_small_perturbation_keeps_its_relative_digits(step, spin, k, exponent):
    small = math.exp(exponent)
    a, b, c = step(spin, 0.8 * small, 0.6 * small, *k)
    with mpmath.workdps(40):
        flow = mpmath.expm(mpmath.mpf(spin) * mpmath.matrix([[0, k[1]], [k[2], 0]]))
        expected = flow * mpmath.matrix([mpmath.mpf(0.8), mpmath.mpf(0.6)])
    assert a == spin
    # the term left out, 1/11! of a step of one radian at most, and the square of the perturbation
    np.testing.assert_allclose([b / small, c / small], [float(x) for x in expected], rtol=0, atol=3e-8)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("samples", [1, 64, 1000])
def test_a_near_run_keeps_its_share_of_the_tolerance(samples, kind):
    steps, _, _, allowed = kind
    # of the size at which the near step is only just allowed, about every axis
    for axis, c in enumerate((np.array(rigid_body.euler_coefficients(1.0, 0.6, 1.58)), np.array([0.9, -0.9, 0.9])), 1):
        h, tolerance = 0.5 / np.abs(c).max(), 1e-10
        size = max(10**-e for e in np.arange(2, 9, 0.1) if allowed(0.5, 10**-e, samples, tolerance))
        state = near = (1.0, 0.8 * size, 0.6 * size)
        for _ in range(samples):
            state, near = taylor.step_12(*state, *(c * h)), steps[12](*near, *(c * h))
            if np.hypot(*state[1:]) > size:  # it has grown out of the size that it was allowed for
                break
            deviation = np.hypot(near[1] - state[1], near[2] - state[2]) / size
            assert deviation <= direct.MAX_NEAR_SHARE * tolerance, axis


def test_what_is_near():
    assert direct.is_near(0.5, 1.7e-5, 64, 1e-10)
    assert not direct.is_near(0.5, 1e-4, 64, 1e-10)
    assert not direct.is_near(0.5, 1.7e-5, 64, 1e-12)
    assert not direct.is_near(0.5, 1.7e-5, 10_000, 1e-10)
    assert not direct.is_near(1.0, 1e-9, 64, 1e-10)
    assert not direct.is_near(math.nan, 1e-9, 64, 1e-10)
    assert direct.is_nearest(0.2, 1.7e-5, 64, 1e-10)
    assert not direct.is_nearest(0.5, 1.7e-5, 64, 1e-10)
    assert not direct.is_nearest(0.51, 1e-9, 64, 1e-10)
    assert not direct.is_nearest(math.nan, 1e-9, 64, 1e-10)


@pytest.mark.parametrize("size", [1e-300, 1e-9, 1e-5, 1e-4, 1e-3, 0.05, 0.1, 0.2, 0.3, 0.5, 0.9, 0.999999, 1.0, 1.5])
def test_truncation_against_mpmath(size):
    # 1/A is rounded before its arcosh, which near A = 1 goes as the root of the difference
    for order in direct.ORDERS:
        ours = direct.truncation(size, order)
        assert ours == pytest.approx(truncation(size, order), rel=1e-13 if size != 0.999999 else 1e-9, abs=0)


@pytest.mark.parametrize("order", direct.ORDERS)
def test_truncation_bounds_the_first_term_left_out(order):
    rng = np.random.default_rng(31)
    for _ in range(200):
        c = np.array(rigid_body.euler_coefficients(*random_body(rng)))
        size, angle = 10 ** rng.uniform(-6, 0), rng.uniform(0, 2 * np.pi)
        start = (math.sqrt(1 - size**2), size * math.cos(angle), size * math.sin(angle))
        first_left_out = np.array([t[order + 1] for t in taylor_terms(start, c, order + 1)])
        bound = direct.truncation(size, order) * np.abs(c).max() ** (order + 1)
        assert np.hypot(*first_left_out[1:]) <= 1.05 * size * bound
    # and it is no more than 1/n! for a small one
    assert direct.truncation(1e-9, order) == pytest.approx(1 / math.factorial(order + 1), rel=1e-12, abs=0)


def truncation_error(order, steps, x, size, samples):
    """Share of the perturbation left out over a run; 6 % for the terms after the first omitted term."""
    return 1.06 * samples * steps * (x / steps) ** (order + 1) * direct.truncation(size, order)


@given(st.floats(1e-3, 0.5), st.floats(1e-8, 1.0), st.integers(1, 10**6), st.floats(-13, -3))
@example(0.5, 1e-5, 64, -10)  # near, but not nearest
def test_the_choice_keeps_the_tolerance_with_the_least_work(x, size, samples, exponent):
    tolerance = 10**exponent
    coefficients = tuple(direct.truncation(size, order) for order in direct.ORDERS)
    code, steps = direct.choose_steps(x, size, coefficients, samples, tolerance)
    near = direct.is_near(x, size, samples, tolerance)
    assert code % 3 == (2 if near and direct.is_nearest(x, size, samples, tolerance) else near)
    allowed = tolerance * (1 - direct.MAX_NEAR_SHARE) if near else tolerance
    code = direct.ORDERS[code // 3]
    assert truncation_error(code, steps, x, size, samples) <= allowed * (1 + 1e-12)
    work = steps * (code * (code + 1) + 40)
    for order in direct.ORDERS:
        cheaper = math.ceil(work / (order * (order + 1) + 40)) - 1
        assert cheaper < 1 or truncation_error(order, cheaper, x, size, samples) > allowed * (1 - 1e-12)


def test_the_choice_at_the_ends_of_its_range():
    small = tuple(direct.truncation(1e-3, order) for order in direct.ORDERS)
    large = tuple(direct.truncation(1.0, order) for order in direct.ORDERS)
    border = truncation_error(12, 1, 0.5, 1e-3, 64)
    assert direct.choose_steps(0.5, 1e-3, small, 64, border * (1 + 1e-12)) == (6, 1)
    assert direct.choose_steps(0.5, 1e-3, small, 64, border * (1 - 1e-6)) == (3, 2)
    assert direct.choose_steps(0.5, 1.0, large, 64, 4e-11) == (
        3,
        5,
    )  # 5 of 110 + 40, against 4 of 156 + 40 and 10 of 72 + 40
    assert direct.choose_steps(0.0, 1e-6, small, 64, 1e-10) == (2, 1)
    assert direct.choose_steps(math.nan, 1e-3, small, 64, 1e-10) == (0, 1)
    assert direct.choose_steps(0.5, 1.0, large, 64, 1e-60)[1] == 10_000
    assert direct.choose_steps(1e20, 1.0, large, 64, 1e-10)[1] == 10_000


def transverse_error(moments, start, axis, times, tolerance):
    """Largest distance from the closed form, relative to the largest transverse size so far, up to tenfold growth."""
    b, c = axis % 3, (axis + 1) % 3
    ours, true = direct.rotation(moments, start, times, tolerance), exact.rotation(moments, start, times)
    size = np.maximum.accumulate(np.hypot(true[:, b], true[:, c]))
    error = np.hypot(ours[:, b] - true[:, b], ours[:, c] - true[:, c]) / size
    # a motion that has flipped magnifies the rounding of its large components by its small components
    return error[size <= 10 * size[0]].max()


def perturbed_spin(axis, epsilon, phase, spin=1.0):
    return np.roll([spin, epsilon * spin * math.cos(phase), epsilon * spin * math.sin(phase)], axis - 1)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8, 1e-10, 1e-12])
def test_the_error_stays_within_the_tolerance(tolerance):
    rng = np.random.default_rng(32)
    times = np.linspace(0, 8 * np.pi, 17)
    for _ in range(100 // FEWER):
        moments, axis = random_body(rng), int(rng.integers(1, 4))
        start = perturbed_spin(axis, 10 ** rng.uniform(-6, math.log10(0.3)), rng.uniform(0, 6.3), rng.uniform(0.5, 2))
        assert transverse_error(moments, start, axis, times / np.abs(start).max(), tolerance) <= tolerance


def test_short_and_loose_intervals_take_one_step_and_no_less():
    # G(1) is 0.01: a tolerance above it would let a step be longer than a radian
    assert direct._steps_per_interval(np.array([0.0, 1e-3, 10.0]), 0.9).tolist() == [1, 1, 10]
    # intervals shorter than a radian in all count as one
    border = direct.truncation(1.0, 12) * 0.5**12 * (1 + 1e-9)
    assert direct._steps_per_interval(np.array([0.5]), border).tolist() == [1]
    assert direct._steps_per_interval(np.array([0.5]), border * (1 - 1e-8)).tolist() == [2]


@pytest.mark.parametrize("epsilon", [1e-6, 1e-3, 0.3])
@pytest.mark.parametrize("axis", [1, 3])
def test_a_thousand_rotations(axis, epsilon):
    rotations = 1000 // FEWER**2
    times = np.linspace(0, 2 * np.pi * rotations, 5)
    # the rounding of the steps, some 1e-16 each, turned into phase; a stable axis, for the intermediate axis flips
    assert transverse_error([1.0, 2.0, 2.7], perturbed_spin(axis, epsilon, 0.6), axis, times, 1e-10) <= 3e-10


@pytest.mark.compiled
def test_rotation_in_any_order_and_backwards():
    moments, start = [1.0, 2.0, 3.0], [1e-3, 2.0, 1e-3]
    times = np.array([1.0, -1.5, 0.0, 0.5, 1.0])
    ours = direct.rotation(moments, start, times, 1e-12)
    expected = np.array(precise.taylor(moments, start, times, order=26), dtype=float)
    np.testing.assert_allclose(ours, expected, rtol=0, atol=2e-12)
    assert (ours[0] == ours[4]).all()


@given(COEFFICIENTS, st.integers(-900, 900))
def test_rotation_in_other_units_has_the_same_bits(wiggle, exponent):
    moments, start = np.array([1.0, 2.0, 2.7]) + 0.1 * np.array(wiggle), perturbed_spin(2, 0.1, 0.6)
    times = np.array([0.0, 1.0, -2.0, 7.0])
    plain = direct.rotation(moments, start, times)
    unit = 2.0**exponent
    assert (direct.rotation(moments, start * unit, times / unit) == plain * unit).all()
    assert (direct.rotation(moments * 2.0 ** (exponent // 2), start, times) == plain).all()
    # every component's sign and the time's
    assert (direct.rotation(moments, -start, -times) == -plain).all()


def test_rotation_of_nothing():
    assert (direct.rotation([1, 2, 3], [0, 0, 0], [0.0, 1.0]) == 0).all()
    assert direct.rotation([1, 2, 3], [0, 0, 0], [0.0, 1.0]).shape == (2, 3)
    assert direct.rotation([1, 2, 3], [1, 0, 0], []).shape == (0, 3)
    assert (direct.rotation([1, 2, 3], [0, -4, 0], [5.0]) == [[0, -4, 0]]).all()
    assert (direct.rotation([2, 2, 2], [1, 2, 3], [5.0]) == [[1, 2, 3]]).all()
    assert direct.rotation([1, 2, 3], [0, 0, 0], [0.0]).flags.writeable


def test_a_tolerance_out_of_range_is_refused():
    for tolerance in (1e-13, 0.999):
        assert np.isfinite(direct.rotation([1, 2, 3], [1, 0.1, 0.1], [3.0], tolerance)).all()
    for tolerance in (0.99e-13, 1.0, np.nan):
        with pytest.raises(ValueError, match="tolerance must lie in"):
            direct.rotation([1, 2, 3], [1, 0, 0], [0], tolerance)
