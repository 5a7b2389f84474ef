import math

import numpy as np
import pytest

from kernels import measure


@pytest.mark.parametrize("rate", [1e-3, 0.1, 0.9])
def test_signed_rate_of_known_motions(rate):
    t = 0.4 * np.arange(65)
    wave = np.stack([np.cos(rate * t), 0.3 * np.sin(rate * t)], axis=1)
    growth = np.stack([np.cosh(rate * t), 0.3 * np.sinh(rate * t)], axis=1)
    # rounding of the samples, 1e-16, over the second difference (rate h)²
    allowed = 1e-14 / (rate * 0.4) ** 2 + 1e-13
    assert measure.signed_rate(wave, 0.4)[0] == pytest.approx(rate**2, rel=allowed)
    assert measure.signed_rate(growth, 0.4)[0] == pytest.approx(-(rate**2), rel=allowed)


def noisy_recurrence(rng, rate, spacing, count):
    """Samples of an oscillation whose second differences carry white noise of 1e-6."""
    x = [np.array([1.0, 0.0]), np.array([math.cos(rate * spacing), math.sin(rate * spacing)])]
    for _ in range(count - 2):
        x.append(2 * math.cos(rate * spacing) * x[-1] - x[-2] + 1e-6 * rng.standard_normal(2))
    return np.array(x)


def test_standard_error_is_the_spread_of_many_estimates():
    rng = np.random.default_rng(11)
    draws = np.array([measure.signed_rate(noisy_recurrence(rng, 0.8, 0.4, 65), 0.4) for _ in range(600)])
    # 600 draws know a spread to 1 / sqrt(1200), 3 %
    assert draws[:, 1].mean() / draws[:, 0].std() == pytest.approx(1.0, abs=0.12)


def test_rate_squared_is_smooth_through_zero():
    for D in (1e-18, 1e-12, -1e-12, 0.3, -0.3):
        value, slope = measure.rate_squared(D, 0.5)
        exact = math.acos(1 - D) ** 2 if D > 1e-3 else -(math.acosh(1 - D) ** 2) if D < -1e-3 else 2 * D
        assert value == pytest.approx(exact / 0.25, rel=1e-11)
        step = abs(D) * 1e-6
        ends = measure.rate_squared(D + step, 0.5)[0] - measure.rate_squared(D - step, 0.5)[0]
        assert slope == pytest.approx(ends / (2 * step), rel=1e-6)


def test_logarithm():
    for x in np.random.default_rng(12).uniform(-690, 690, 200):
        value = math.exp(x)
        # two roundings of the result
        assert measure.logarithm(value) == pytest.approx(math.log(value), rel=4.5e-16, abs=1e-16)


def test_signed_rate_wants_enough_samples():
    with pytest.raises(ValueError, match=r"\(n, 2\)"):
        measure.signed_rate(np.zeros((3, 2)), 1.0)
