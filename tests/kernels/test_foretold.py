"""Linear theory's columns in one pass are, bit for bit, what the formulas of kernels.linear make of arrays."""

import numpy as np
import pytest

from kernels import foretold, linear, rigid_body, triangle


def some_bodies(alike):
    """Bodies of every kind, those that are none among them; one axis and direction for all, or each its own."""
    random, n = np.random.default_rng(1), 3000
    moments = random.uniform(0.05, 2.0, (3, n))
    moments[0, :300] = moments[1, :300]
    moments[1, 200:500] = moments[2, 200:500]
    moments[random.integers(0, 3, 30), np.arange(500, 530)] = np.repeat([np.nan, np.inf, 0.0], 10)
    axis = np.full(n, 2) if alike else random.integers(1, 4, n)
    phase = np.full(n, 0.6) if alike else random.uniform(-7.0, 7.0, n)
    return *moments, axis, random.choice([-1.0, 1.0], n) * random.uniform(0.1, 20.0, n), phase


@pytest.mark.parametrize("alike", [True, False])
def test_columns_are_those_of_the_formulas(alike):
    I1, I2, I3, axis, omega0, phase = some_bodies(alike)
    found = foretold.columns_of(I1, I2, I3, axis, omega0, phase)
    with np.errstate(all="ignore"):
        regime = linear.regime(I1, I2, I3, axis)
        growth_rate, frequency = linear.rates(linear.omega_squared(I1, I2, I3, 1.0, axis), regime)
        expected = {
            "omega_squared_theory": linear.omega_squared(I1, I2, I3, omega0, axis),
            "growth_rate_theory": growth_rate * np.abs(omega0),
            "frequency_theory": frequency * np.abs(omega0),
            "growing_fraction": linear.growing_fraction(I1, I2, I3, omega0, axis, phase),
            "triangle_margin": triangle.triangle_margin(I1, I2, I3),
            "regime_theory": regime,
            "shape": rigid_body.shape(I1, I2, I3),
        }
    assert set(found) == set(expected)
    for name, values in expected.items():
        assert found[name].dtype == values.dtype, name
        np.testing.assert_array_equal(found[name], values, err_msg=name)
        assert (np.signbit(found[name]) == np.signbit(values)).all(), name
