"""Numbers behind the pictures, against hand computations, SciPy's regression and mpmath."""

import math

import mpmath
import numpy as np
import pytest
import scipy
import xarray as xr

import sweeps
from sweeps.systems.rigid_body import fits

EPSILON = np.geomspace(1e-8, 0.3, 60)


breakdown_map = pytest.fixture(lambda: sweeps.survey("breakdown"), scope="module")


def synthetic(deviation, *, theory=-4.0, error=1e-13, status=0):
    """Return a map of one body with this relative deviation of Ω² over EPSILON."""
    unit = np.ones((1, 1, EPSILON.size))
    dims = ("body", "axis", "epsilon")
    columns = {
        "omega_squared": theory * (1.0 + deviation) * unit,
        "omega_squared_theory": theory * unit,
        "omega_squared_reduced_error": abs(theory) * error * unit,
        "status": (np.zeros(EPSILON.size) + status).astype("i1") * unit.astype("i1"),
    }
    return xr.Dataset(
        {name: (dims, values) for name, values in columns.items()},
        coords={"body": ["one"], "axis": [2], "epsilon": EPSILON},
    )


# ---------------------------------------------------------------------------------------------------------
# Rates and deviations


def test_signed_rate_by_hand():
    # 9 s-2 at 2 rad s-1 oscillates at 1.5 of the spin, whatever its sense; -0.25 s-2 grows at 0.25 of it.
    rates = fits.signed_rate(np.array([9.0, 9.0, -0.25, 0.0]), np.array([2.0, -2.0, -2.0, 1.0]))
    assert rates.tolist() == [1.5, 1.5, -0.25, 0.0]


# ---------------------------------------------------------------------------------------------------------
# The power law


@pytest.mark.parametrize("theory", [-4.0, 0.3])
def test_the_exponent_is_scipys_regression_of_the_points_between_the_bounds(theory):
    deviation = 0.3 * EPSILON**2 * np.exp(np.random.default_rng(11).normal(0, 0.2, EPSILON.size))
    is_inside = (deviation >= fits.MIN_FIT_DEVIATION) & (deviation <= fits.MAX_FIT_DEVIATION)
    assert 20 < is_inside.sum() < EPSILON.size
    reference = scipy.stats.linregress(np.log(EPSILON[is_inside]), np.log(deviation[is_inside]))
    # forming 1 + deviation costs 1e-16 of a deviation of 1e-11
    assert fits.fit_breakdown(synthetic(deviation, theory=theory)).slope.item() == pytest.approx(
        reference.slope, rel=1e-4
    )
    few = np.where(is_inside & (np.arange(EPSILON.size) % 10 > 0), np.nan, deviation)
    assert math.isnan(fits.fit_breakdown(synthetic(few)).slope.item())


def test_floor_is_ten_times_what_the_least_nudges_show_or_their_error():
    epsilon = np.array([1e-8, 2e-8, 2.9e-8, 3.1e-8, 1e-3])
    deviation = np.array([np.nan, 1e-12, 3e-12, 2e-12, 1e-3])
    error = np.array([1.0, 4e-12, 6e-12, 8e-12, 1.0])
    # from 2e-8, the least with a value, to 6e-8: medians 2e-12 and 6e-12
    assert fits.deviation_floor(epsilon, deviation, error) == pytest.approx(2e-11)
    assert fits.deviation_floor(epsilon, deviation, 10.0 * error) == pytest.approx(6e-11)
    assert fits.deviation_floor(epsilon, deviation * np.nan, error) == math.inf


def test_breakdown_keeps_clear_of_the_floor():
    fit = fits.fit_breakdown(synthetic(0.4 * EPSILON**2 + 2e-9, error=1e-10))
    assert float(fit.floor[0, 0]) == pytest.approx(2e-8, rel=1e-6)
    # at the floor a tenth of the deviation is plateau, which flattens the law by some percent there only
    assert float(fit.slope[0, 0]) == pytest.approx(2.0, abs=0.03)


def test_breakdown_leaves_out_what_is_not_ok():
    wild = np.arange(EPSILON.size) % 3 == 1
    deviation = np.where(wild, 1e-5, 0.4 * EPSILON**2)
    assert abs(float(fits.fit_breakdown(synthetic(deviation)).slope[0, 0]) - 2.0) > 0.3
    assert float(fits.fit_breakdown(synthetic(deviation, status=2 * wild)).slope[0, 0]) == pytest.approx(2.0, abs=1e-4)


# ---------------------------------------------------------------------------------------------------------
# Periods


def test_period_of_the_earth(breakdown_map):
    earth = fits.compare_periods(breakdown_map)[0]
    with mpmath.workdps(30):
        I1, I2, I3 = mpmath.mpf("8.0101e37"), mpmath.mpf("8.0103e37"), mpmath.mpf("8.0365e37")
        sidereal = mpmath.sqrt(I1 * I2 / ((I3 - I1) * (I3 - I2)))
        days = sidereal * 2 * mpmath.pi / mpmath.mpf("7.292115e-5") / 86400
    assert (earth.body, earth.axis, earth.observed_days, earth.what) == ("Earth", 3, 433.0, "Chandler wobble")
    assert float(sidereal) == pytest.approx(304.57, abs=0.005)  # days of the textbooks; in days of the sun:
    assert float(days) == pytest.approx(303.74, abs=0.005)
    assert earth.measured_days == pytest.approx(float(days), rel=1e-11)  # measured to its standard error
    assert "not rigid" in earth.note


def test_periods_only_of_bodies_that_were_observed(breakdown_map, tiny):
    assert [period.body for period in fits.compare_periods(breakdown_map)] == ["Earth", "Moon", "Mars"]
    assert [period.body for period in fits.compare_periods(breakdown_map.isel(body=slice(1, 5)))] == ["Moon", "Mars"]
    assert fits.compare_periods(breakdown_map.sel(axis=[1, 2])) == []
    assert fits.compare_periods(tiny) == []
    without = breakdown_map.copy()
    without.attrs = {}
    assert fits.compare_periods(without) == []
