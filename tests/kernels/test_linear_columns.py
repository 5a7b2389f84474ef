"""Linear theory's columns in one pass are, bit for bit, the results of the formulas of kernels.free.linear on arrays.

The encircled axis is that of a difference in 60 digits; its component of the exact motion keeps its sign.
"""

import mpmath
import numpy as np
import pytest

from kernels.free import exact, linear, rigid_body, triangle
from kernels.free.rigid_body import Spins


def some_bodies(uniform):
    """Bodies of every kind, those that are none among them; one axis and direction for all, or each its own."""
    random, n = np.random.default_rng(1), 3000
    moments = random.uniform(0.05, 2.0, (3, n))
    moments[0, :300] = moments[1, :300]
    moments[1, 200:500] = moments[2, 200:500]
    moments[random.integers(0, 3, 30), np.arange(500, 530)] = np.repeat([np.nan, np.inf, 0.0], 10)
    axis = np.full(n, 2) if uniform else random.integers(1, 4, n)
    phase = np.full(n, 0.6) if uniform else random.uniform(-7.0, 7.0, n)
    return *moments, axis, random.choice([-1.0, 1.0], n) * random.uniform(0.1, 20.0, n), phase


@pytest.mark.parametrize("uniform", [True, False])
def test_columns_are_those_of_the_formulas(uniform):
    I1, I2, I3, axis, omega0, phase = some_bodies(uniform)
    columns = linear.predict_columns(Spins(I1, I2, I3, axis, omega0, np.full(phase.size, 1e-3), phase))
    assert columns.pop("encircles").dtype == np.int8
    with np.errstate(all="ignore"):
        regime = linear.regime(I1, I2, I3, axis)
        rate, unstable = np.sqrt(np.abs(linear.omega_squared(I1, I2, I3, 1.0, axis))), regime == linear.UNSTABLE
        expected = {
            "omega_squared_theory": linear.omega_squared(I1, I2, I3, omega0, axis),
            "growth_rate_theory": np.where(unstable, rate, 0.0) * np.abs(omega0),
            "frequency_theory": np.where(regime < linear.UNSTABLE, rate, 0.0) * np.abs(omega0),
            "triangle_margin": triangle.triangle_margin(I1, I2, I3),
            "regime_theory": regime,
            "shape": rigid_body.shape(I1, I2, I3),
        }
    assert set(columns) == {*expected, "growing_fraction"}
    for name, values in expected.items():
        assert columns[name].dtype == values.dtype, name
        np.testing.assert_array_equal(columns[name], values, err_msg=name)
        assert (np.signbit(columns[name]) == np.signbit(values)).all(), name


def starts(random, n):
    """Points of any size and direction of the nudge, a third of them within 1e-16 to 1e-2 of the separatrix."""
    masses = random.uniform(0.05, 1.0, (3, n))
    masses[1] = np.where(random.random(n) < 0.3, masses[0] * (1 + 10.0 ** random.uniform(-16, -1, n)), masses[1])
    moments = (masses.sum(axis=0) - masses) * 10.0 ** random.uniform(-200, 200, n)
    axis, omega0 = random.integers(1, 4, n), random.choice([-1.0, 1.0], n) * random.uniform(0.1, 10.0, n)
    a, b, c = linear.moments_from_axis(*moments, axis)
    size = np.where(random.random(n) < 0.5, random.uniform(0.0, 0.99, n), 10.0 ** random.uniform(-300, 0, n))
    with np.errstate(divide="ignore"):
        slope = np.sqrt(np.abs((a - b) / c / ((c - a) / b)))
    near = (random.random(n) < 0.3) & ((a < b) != (a < c))
    by = 1 + 10.0 ** random.uniform(-17, -2, n)
    phase = np.where(near, np.arctan2(random.choice([-1, 1], n) * slope * by, 1.0), random.uniform(-9, 9, n))
    return *moments, axis, omega0, size, phase


def test_the_axis_encircled_is_that_of_the_difference_in_60_digits():
    start = starts(np.random.default_rng(4), 2000)
    flags = linear.predict_columns(Spins(*start))["encircles"]
    undecided = 0
    for I1, I2, I3, axis, _, epsilon, phase, flag in zip(*start, flags, strict=True):
        with mpmath.workdps(60):
            moments = [mpmath.mpf(float(x)) for x in (I1, I2, I3)]
            w = [mpmath.mpf(0)] * 3
            w[axis - 1], angle = mpmath.mpf(1), mpmath.mpf(float(phase))
            w[axis % 3] = float(epsilon) * mpmath.cos(angle)
            w[(axis + 1) % 3] = float(epsilon) * mpmath.sin(angle)
            terms = [i * (i - sorted(moments)[1]) * x * x for i, x in zip(moments, w, strict=True)]
            N, size = sum(terms), sum(map(abs, terms))
        if flag == linear.SEPARATRIX:
            undecided += 1
            assert abs(N) < 40 * 2.0**-52 * size
        else:
            axis = linear.MAJOR_AXIS if N > 0 else linear.MINOR_AXIS
            assert flag == (axis if size > 0 else linear.NO_AXIS)  # a steady spin in the plane of two equal moments
    assert 10 < undecided < 300  # few are as near the separatrix as doubles resolve


@pytest.mark.parametrize("moments", [(1.0, 1.7, 2.3), (2.3, 1.0, 1.7), (1.7, 2.3, 1.0)])
def test_the_axis_encircled_is_the_one_whose_component_keeps_its_sign(moments):
    random, n = np.random.default_rng(5), 6
    axis, epsilon, phase = random.integers(1, 4, n), random.uniform(0.1, 0.95, n), random.uniform(0, 7, n)
    moment_columns = [np.full(n, x) for x in moments]
    flags = linear.predict_columns(Spins(*moment_columns, axis, np.ones(n), epsilon, phase))["encircles"]
    assert set(flags) == {linear.MINOR_AXIS, linear.MAJOR_AXIS}
    for i in range(n):
        start = np.roll([1.0, epsilon[i] * np.cos(phase[i]), epsilon[i] * np.sin(phase[i])], axis[i] - 1)
        motion = exact.rotation(moments, start, np.linspace(0.0, 60.0, 600))
        keeps = {k for k in range(3) if np.ptp(np.sign(motion[:, k])) == 0}
        assert keeps == {int(np.argmin(moments) if flags[i] == linear.MINOR_AXIS else np.argmax(moments))}


def test_symmetric_bodies_encircle_their_own_axis_and_spheres_none():
    def encircles(I2, I3, **values):
        points = {"I1": 1.0, "I2": I2, "I3": I3, "omega0": 1.0} | values
        return linear.predict_columns(rigid_body.points_of(points))["encircles"].tolist()

    for axis in (1, 2, 3):
        for phase in (0.6, 2.1):
            flags = encircles([1.0, 1.5, 1.0], [1.5, 1.5, 1.0], axis=axis, epsilon=1e-300, phase=phase)
            assert flags == [linear.MAJOR_AXIS, linear.MINOR_AXIS, linear.NO_AXIS]
    # about axis 1 with the nudge along axis 2: in the plane of two equal moments, a steady spin
    assert encircles(1.0, 1.5, axis=1, epsilon=0.3, phase=0.0) == [linear.NO_AXIS]
