import math

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from naive import estimate, fractions, rate_squared, rate_squared_of, signed_rate

from kernels.estimator import measure

ULP = 2.0**-52
SAMPLE = st.floats(-1e3, 1e3).map(lambda x: x if abs(x) > 1e-3 else 0.25)
TRIPLES = st.tuples(*[SAMPLE] * 6)
SPACING = 0.4


def pairs(samples):
    """Three samples (b, c), the last one first."""
    return tuple(samples[:2]), tuple(samples[2:4]), tuple(samples[4:])


def second(x, x1, x2):
    return x - 2 * x1 + x2


@given(TRIPLES)
def test_first_guess_is_the_least_squares_D_of_three_samples(samples):
    b, c, b1, c1, b2, c2 = fractions(*samples)
    exact = -(second(b, b1, b2) * b1 + second(c, c1, c2) * c1) / (2 * (b1 * b1 + c1 * c1))
    size = max(abs(x) for x in samples) / math.hypot(samples[2], samples[3])
    # every difference carries at most an ulp of the largest sample
    assert measure.first_guess(*pairs(samples)) == pytest.approx(float(exact), rel=1e-14, abs=8 * ULP * size)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # without the compiler NumPy's scalars warn
def test_first_guess_of_nothing():
    assert math.isnan(measure.first_guess(*pairs(np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))))


@given(TRIPLES, st.floats(-0.2, 0.2))
def test_leftover_against_fractions(samples, guess):
    b, c, b1, c1, b2, c2 = fractions(*samples)
    (D,) = fractions(guess)
    rb, rc = second(b, b1, b2) + 2 * D * b1, second(c, c1, c2) + 2 * D * c1
    ours = measure.residual_sums(*pairs(samples), guess)
    size = 4 * max(abs(x) for x in samples)
    # each leftover is a sum of four terms of that size
    for value, exact in zip(ours, (rb * b1 + rc * c1, rb * rb + rc * rc, b1 * b1 + c1 * c1), strict=True):
        assert value == pytest.approx(float(exact), rel=4 * ULP, abs=16 * ULP * size**2)
    assert ours[2] == pytest.approx(float(b1 * b1 + c1 * c1), rel=2 * ULP, abs=0)


D_VALUES = np.r_[
    10.0 ** np.arange(-30, -15), 1.9e-18, 2.1e-18, np.geomspace(1e-15, 0.12, 30), np.linspace(0.13, 1.99, 40)
]
NEGATIVE = np.r_[-D_VALUES, -10.0, -1e3]


@pytest.mark.parametrize("spacing", [0.25, 3.0])
def test_rate_squared_and_its_slope_against_mpmath(spacing):
    for D in (*D_VALUES, *NEGATIVE):
        value, slope = measure.rate_squared(float(D), spacing)
        exact, exact_slope = rate_squared_of(D, spacing)
        # ten roundings or so; near D = 2 the arcsine and the slope magnify those of s by 1/(2 - D)
        allowed = 6 * ULP * (1 + 1 / (2 - D)) if D > 0 else 6 * ULP
        assert value == pytest.approx(exact, rel=allowed, abs=0)
        assert slope == pytest.approx(exact_slope, rel=allowed, abs=0)


def test_the_series_of_small_turns_against_mpmath():
    for D in (*D_VALUES[D_VALUES <= measure.MAX_SERIES_D], *-D_VALUES[D_VALUES <= measure.MAX_SERIES_D], 0.0):
        value, slope = measure.rate_squared_of_turn(float(D))
        exact, exact_slope = rate_squared_of(D, 1.0) if D else (0.0, 2.0)
        # the last multiplication and addition, and the truncation
        assert value == pytest.approx(exact, rel=2 * ULP, abs=0)
        assert slope == pytest.approx(exact_slope, rel=2 * ULP, abs=0)


def test_rate_squared_at_the_ends_of_its_range():
    assert measure.rate_squared(0.0, 0.5) == (0.0, 8.0)
    for D in (2.0, np.nextafter(2.0, 3.0), 2.5):  # rounding, or noise, may step over the end
        value, slope = measure.rate_squared(D, 0.5)
        assert value == pytest.approx((math.pi / 0.5) ** 2, rel=1e-14, abs=0)
        assert slope > 0 and math.isfinite(slope)  # noqa: PT018


def sums(x, guess):
    x = [tuple(sample) for sample in x.tolist()]
    triples = zip(x[2:], x[1:], x, strict=False)
    return np.sum([measure.residual_sums(*triple, guess) for triple in triples], axis=0).tolist()


@pytest.mark.parametrize("guess", [0.0, 0.05, -0.2])
def test_estimate_whatever_the_guess_is_the_least_squares_fit(guess):
    rng = np.random.default_rng(21)
    t = SPACING * np.arange(33)
    for motion in (np.stack([np.cos(0.9 * t), np.sin(0.9 * t)], axis=1), np.stack([np.cosh(0.1 * t), 0.3 * t], axis=1)):
        x = motion + 1e-3 * rng.standard_normal(motion.shape)
        value, stderr = estimate(guess, sums(x, guess), len(x) - 2, SPACING)
        expected, expected_stderr, num_samples = rate_squared(x, SPACING)
        assert num_samples == len(x)
        # the twin's arccos(1 - D) loses digits as 1e-16/D; the noise leaves no D below 1e-4
        assert value == pytest.approx(expected, rel=1e-11, abs=0)
        # after a guess far off the scatter is a difference of sums 1e5 times as large
        assert stderr == pytest.approx(expected_stderr, rel=1e-9, abs=0)


@given(st.floats(0.01, 1.2), st.floats(0, 6.3), st.floats(-30, 30), st.booleans())
def test_signed_rate_has_symmetries(rate, phase, exponent, grows):
    t = SPACING * np.arange(33)
    wave = np.stack([np.cosh(rate * t + phase), np.sinh(rate * t)] if grows else
                    [np.cos(rate * t + phase), np.sin(rate * t)], axis=1)  # fmt: skip
    value, stderr = signed_rate(wave, SPACING)
    assert value == pytest.approx((-1 if grows else 1) * rate**2, rel=1e-14 / (rate * SPACING) ** 2 + 1e-13, abs=0)
    assert signed_rate(-wave, SPACING) == (value, stderr)
    assert signed_rate(wave * 2.0 ** round(exponent), SPACING) == (value, stderr)
    slow = signed_rate(wave, 2 * SPACING)
    assert slow == (value / 4, stderr / 4)
    # backwards, and with exchanged components: the same sums in another order
    mirrored_rate = signed_rate(wave[::-1, ::-1], SPACING)
    assert mirrored_rate[0] == pytest.approx(value, rel=0, abs=1e-14 / SPACING**2)


def noisy_recurrence(rng, D, count):
    """Return samples of a motion with white noise of 1e-6 in its second differences."""
    x = [np.array([1.0, 0.0]), np.array([1 - D, 0.3])]
    for _ in range(count - 2):
        x.append(2 * (1 - D) * x[-1] - x[-2] + 1e-6 * rng.standard_normal(2))
    return np.array(x)


@pytest.mark.parametrize("D", [0.05, -0.005])
def test_standard_error_is_the_spread_of_many_estimates(D):
    rng = np.random.default_rng(11)
    draws = np.array([signed_rate(noisy_recurrence(rng, D, 33), SPACING) for _ in range(800)])
    pulls = (draws[:, 0] - rate_squared_of(D, SPACING)[0]) / draws[:, 1]
    # 800 draws determine a spread to 1/sqrt(1600) = 2.5 % and a share of 0.683 to 0.016: four times each
    assert pulls.std() == pytest.approx(1.0, abs=0.1)
    assert abs(pulls.mean()) < 4 / math.sqrt(800)
    assert np.mean(np.abs(pulls) < 1) == pytest.approx(0.683, abs=0.066)
    assert np.mean(np.abs(pulls) < 2) == pytest.approx(0.954, abs=0.03)


@given(st.lists(st.floats(1e-3, 1e6), min_size=2, max_size=60))
def test_slope_of_products_against_polyfit(sizes):
    P, up, Q, over = 1.0, 0.0, 1.0, 0.0
    for x in sizes:
        P, up, Q, over = measure.multiply_products(P, up, Q, over, x)
    assert 1.0 <= P < 2.0
    assert 1.0 <= Q < 2.0
    k = np.arange(len(sizes))
    exact = np.polyfit(k - k.mean(), np.log(sizes), 1)[0]
    # the sums that are subtracted are up to 3 n times the slope's own range of |ln x| <= 14
    assert measure.slope_of_products(float(len(sizes)), P, up, Q, over) == pytest.approx(exact, rel=1e-13, abs=1e-13)


def ulps_off(x):
    with mpmath.workdps(40):
        exact = mpmath.log(mpmath.mpf(x))
        return float(abs(mpmath.mpf(float(measure.logarithm(x))) - exact)) / math.ulp(float(exact))


@given(st.floats(2.3e-308, 1.7e308))
def test_logarithm_of_any_normal_double(x):
    assume(not 0.5 < x < 2)
    assert ulps_off(x) <= 1.0


def test_logarithm_around_one():
    rng = np.random.default_rng(12)
    near = 10 ** rng.uniform(-15.5, -0.3, 400)
    edges = math.sqrt(2) * (1 + ULP * np.arange(-2, 3)), 2.0 ** np.array([-1022.0, -1.0, 0.5, 1.0, 2.0, 1023.0])
    # the quotient s, its double, the series and their sum are rounded half an ulp each
    assert max(ulps_off(float(x)) for x in (*(1 + near), *(1 - near), *np.concatenate(edges))) <= 2.0
    assert measure.logarithm(1.0) == 0.0
