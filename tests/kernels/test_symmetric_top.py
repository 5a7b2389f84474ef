import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import config

from kernels.events import symmetric_top
from kernels.events.symmetric_top import AGAINST_SPIN, NONE, NOT_CONVERGED, OK, WITH_SPIN, row

SETTINGS = (4.0, 16, 1e-12)
COUNT = 40 if config.DISABLE_JIT else 4000
EPSILON = np.finfo(float).eps


def top(ratio, omega3=1.0, half_angle=30.0):
    return {name: np.atleast_1d(x) for name, x in (("ratio", ratio), ("omega3", omega3), ("half_angle", half_angle))}


def some_tops(rng, count=COUNT):
    """Tops from needle to beyond the disc, any spin rate of either sense, any angle."""
    ratio = 1.0 + 10.0 ** rng.uniform(-15, 1, count) * rng.choice([-1, 1], count)
    ratio = np.where(ratio < 1e-3, 10.0 ** rng.uniform(-6, -1, count), ratio)
    omega3 = 10.0 ** rng.uniform(-9, 6, count) * rng.choice([-1, 1], count)
    return top(ratio, omega3, rng.uniform(0.1, 89.9, count))


def exact_rate(ratio, omega3):
    """(I3 - I1) omega3/I1 in 50 digits, for I1 = 1."""
    with mpmath.workdps(50):
        return [(mpmath.mpf(float(r)) - 1) * mpmath.mpf(float(w)) for r, w in zip(ratio, omega3, strict=True)]


def test_both_rates_are_the_formula_at_any_amplitude():
    points = some_tops(np.random.default_rng(3))
    columns = symmetric_top.survey(points, *SETTINGS)
    distance = np.abs(points["ratio"] - 1.0)
    # the bar: 1e-10, and 1e-12/|I3/I1 - 1| nearer to the sphere
    allowed = np.where(distance >= 1e-2, 1e-10, 1e-12 / distance)
    exact = exact_rate(points["ratio"], points["omega3"])
    for name in ("precession_rate", "momentum_precession_rate"):
        error = [float(abs(mpmath.mpf(float(x)) / y - 1)) for x, y in zip(columns[name], exact, strict=True)]
        assert np.all(error <= allowed), name
        reported, rate = columns[f"{name}_error"], np.abs(np.array(exact, float))
        assert np.all(error * rate <= reported), name
        # roundings of the rate, and of the steps, which do not depend on its slowness
        bound = 1e-13 * rate + 1e-15 * np.abs(points["omega3"])
        assert np.all((reported <= bound) | (columns[name] == 0.0)), name
    assert np.all(columns["status"] == OK)
    np.testing.assert_allclose(columns["precession_rate_theory"], np.array(exact, float), rtol=2 * EPSILON)
    is_unequal = np.abs(points["ratio"] - 1.0) > 1e-14
    np.testing.assert_array_equal((columns["sense"] == WITH_SPIN)[is_unequal], (points["ratio"] > 1.0)[is_unequal])
    np.testing.assert_array_equal((columns["sense"] == AGAINST_SPIN)[is_unequal], (points["ratio"] < 1.0)[is_unequal])


def test_cones_are_the_angles_between_the_vectors():
    """Angles by arccos of 40-digit scalar products of omega, L and the figure axis."""
    rng = np.random.default_rng(5)
    ratio, angle = 10.0 ** rng.uniform(-2, 1, 30), rng.uniform(0.5, 89.0, 30)
    columns = symmetric_top.survey(top(ratio, 3.0, angle), *SETTINGS)
    with mpmath.workdps(40):
        for i in range(30):
            w = mpmath.matrix([mpmath.tan(mpmath.radians(mpmath.mpf(float(angle[i])))), 0, 1])
            L = mpmath.matrix([w[0], 0, mpmath.mpf(float(ratio[i])) * w[2]])
            dot = (w.T * L)[0]
            momentum = mpmath.degrees(mpmath.acos(L[2] / mpmath.norm(L)))
            space = mpmath.degrees(mpmath.acos(dot / mpmath.norm(w) / mpmath.norm(L)))
            for name, exact in (("body_cone", angle[i]), ("momentum_cone", momentum), ("space_cone", space)):
                # degrees; the run's own tolerance of 1e-12, in degrees
                assert abs(columns[name][i] - float(exact)) <= 2e-10, name
            assert columns["momentum_cone_theory"][i] == pytest.approx(float(momentum), rel=1e-14)
            assert columns["space_cone_theory"][i] == pytest.approx(float(space), rel=1e-13, abs=1e-15)


def test_everything_that_is_conserved_is():
    points = some_tops(np.random.default_rng(8))
    columns = symmetric_top.survey(points, *SETTINGS)
    # tolerance 1e-12 and its rounding; L and omega come from two integrations
    for name in ("coplanarity", "energy_drift", "momentum_drift", "propagation_error"):
        assert columns[name].max() <= 3e-12, name
    assert columns["half_angle_drift"].max() <= np.degrees(3e-12)
    assert columns["coplanarity"].max() > 0.0  # two motions: rounding alone sets them apart


@pytest.mark.parametrize("half_angle", [1e-100, 1e-6, 40.0, 89.999999])
def test_the_sphere_and_its_neighbours_turn_nowhere(half_angle):
    ratio = np.array([1.0, np.nextafter(1.0, 2.0), np.nextafter(1.0, 0.0)])
    columns = symmetric_top.survey(top(ratio, -3.0, half_angle), *SETTINGS)
    assert np.all(columns["status"] == OK)
    assert np.all(columns["sense"] == NONE)
    for name in ("precession_rate", "momentum_precession_rate"):
        np.testing.assert_array_equal(columns[name], 0.0)
    np.testing.assert_array_equal(np.isnan(columns["period_theory"]), [True, False, False])
    assert np.all(np.isnan(columns["period"]))
    for name in set(columns) - {"period", "period_theory"}:
        assert np.all(np.isfinite(columns[name])), name


@pytest.mark.compiled
@given(st.floats(1e-150, 1e150), st.floats(1e-100, 89.9999), st.floats(1e-150, 1e100), st.booleans())
def test_any_allowed_point_has_its_rate(ratio, half_angle, spin, backwards):
    omega3 = -spin if backwards else spin
    columns = symmetric_top.survey(top(ratio, omega3, half_angle), *SETTINGS)
    assert columns["status"] == OK
    if abs(ratio - 1.0) > 1e-2:
        assert columns["precession_rate"] == pytest.approx((ratio - 1.0) * omega3, rel=1e-10)
    assert (columns["triangle_margin"] >= 0.0) == (ratio <= 2.0)


def test_the_spin_rate_scales_everything_exactly():
    """A power of two more spin changes no digit: time runs in radians of spin."""
    points = some_tops(np.random.default_rng(4), 64)
    slow = symmetric_top.survey(points, *SETTINGS)
    fast = symmetric_top.survey(points | {"omega3": points["omega3"] * 2.0**40}, *SETTINGS)
    scale = {name: 2.0**40 for name in slow if "rate" in name} | {"period": 2.0**-40, "period_theory": 2.0**-40}
    for name, values in slow.items():
        np.testing.assert_array_equal(fast[name], values * scale.get(name, 1), err_msg=name)


def test_the_earth_of_the_lecture_takes_305_days():
    columns = symmetric_top.survey(top(1.0 + 1.0 / 305.0, 2 * np.pi, 1e-4), *SETTINGS)
    # 1 + 1/305 is itself rounded: 305 · eps/2 relative; the measurement is within 1e-12 · 305
    assert columns["period_theory"] == pytest.approx(305.0, rel=305 * EPSILON)
    assert columns["period"] == pytest.approx(305.0, rel=305e-12)
    assert columns["sense"] == WITH_SPIN


@pytest.mark.compiled
def test_errors_hold_where_steps_of_a_slow_precession_round_alike():
    rng = np.random.default_rng(5)
    points = top(1.0 + 1e-6 * rng.uniform(0.3, 1.0, 500), 1.0, rng.uniform(0.1, 80.0, 500))
    columns = symmetric_top.survey(points, 200.0, 10, 1e-10)
    deviation = np.abs(columns["precession_rate"] - columns["precession_rate_theory"])
    assert (
        deviation <= columns["precession_rate_error"]
    ).all()  # 95.6 % under the assumption of nearly random roundings


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8, 1e-12])
def test_the_certificate_holds_at_its_tolerance(tolerance):
    points = some_tops(np.random.default_rng(10))
    columns = symmetric_top.survey(points, 4.0, 4, tolerance)
    assert np.all(columns["status"] == OK)
    assert columns["propagation_error"].max() <= tolerance + 1e-13
    # one step a sample, the fewest there are, leaves 2e-10; among a few tops none may need two
    if tolerance < 1e-11 and COUNT > 1000:
        assert columns["propagation_error"].max() > tolerance / 50  # the step is not chosen far too small


def test_the_certificate_sees_an_integration_that_is_off():
    """A step that is off by 1e-9, or made for a looser tolerance: both statuses report it."""
    raw = symmetric_top.run(top([0.3, 1.8]), *SETTINGS)
    assert np.all(symmetric_top._status(raw, 1e-12, 64) == OK)
    raw[:, symmetric_top.RAW.distance] += 1e-9
    assert np.all(symmetric_top._status(raw, 1e-12, 64) == NOT_CONVERGED)
    coarse = symmetric_top.run(top([0.3, 1.8]), 4.0, 16, 1e-6)
    assert np.all(symmetric_top._status(coarse, 1e-14, 64) == NOT_CONVERGED)


def test_rate_and_stderr_are_those_of_a_straight_line_through_the_angles():
    """NumPy's polyfit with its covariance, on angles that scatter, each lane its own."""
    rng = np.random.default_rng(12)
    intervals, W = 32, symmetric_top.W
    k = np.arange(intervals + 1.0)
    angles = rng.uniform(-0.4, 0.4, (2, W, 1)) * k + rng.normal(0, 1e-2, (2, W, k.size))
    for which in (0, 1):
        M = np.zeros(symmetric_top.MOMENTUM_ROWS)
        for number in range(intervals + 1):
            rows = (row.b, row.c) if number else (row.previous_b, row.previous_c)
            for first, component in zip(rows, (np.cos, np.sin), strict=True):
                M[first : first + W] = 3.0 * component(angles[which, :, number])
            if number:
                symmetric_top._sample_angle(M, number, intervals)
        for lane in range(W):
            fit = symmetric_top._rate(M, lane, intervals)[:2]
            (slope, _), covariance = np.polyfit(k, angles[which, lane], 1, cov=True)
            np.testing.assert_allclose(fit, (slope, np.sqrt(covariance[0, 0])), rtol=1e-9)
