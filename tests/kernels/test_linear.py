import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from naive import coefficients, fractions, growing_share, seen_from
from strategies import moment_triples

from kernels.free import linear, rigid_body

ULP = 2.0**-52
AXES = np.array([1, 2, 3])


@given(moment_triples(), st.floats(1e-9, 1e6), st.sampled_from([1, -1]))
def test_omega_squared_against_fractions(moments, spin, sign):
    ours = linear.omega_squared(*moments, sign * spin, AXES)
    (omega0,) = fractions(spin)
    for axis, value in zip(AXES, ours, strict=True):
        Ia, Ib, Ic = seen_from(axis, *fractions(*moments))
        exact = (Ia - Ib) * (Ia - Ic) / (Ib * Ic) * omega0 * omega0
        # seven operations of half an ulp; the differences are rounded once, so the sign is exact
        assert abs(fractions(value)[0] - exact) <= 3.6 * ULP * abs(exact)
        assert np.sign(value) == (exact > 0) - (exact < 0)


def naive_regime(a, b, c):
    """Return the regime by the rank of I_a among the three moments."""
    if a == b == c:
        return linear.SPHERE
    if a in (b, c):
        return linear.MARGINAL
    return {0: linear.STABLE_MINOR, 1: linear.UNSTABLE, 2: linear.STABLE_MAJOR}[sorted([a, b, c]).index(a)]


@given(moment_triples())
def test_regimes_of_the_three_axes(moments):
    regimes = linear.regime(*moments, AXES)
    assert regimes.dtype == np.int8
    assert regimes.tolist() == [naive_regime(*seen_from(axis, *moments)) for axis in (1, 2, 3)]
    if rigid_body.shape(*moments) == rigid_body.ASYMMETRIC:
        assert sorted(regimes) == sorted([linear.STABLE_MINOR, linear.STABLE_MAJOR, linear.UNSTABLE])
    omega_squared = linear.omega_squared(*moments, 1.0, AXES)
    assert ((omega_squared < 0) == (regimes == linear.UNSTABLE)).all()
    assert ((omega_squared == 0) == np.isin(regimes, [linear.MARGINAL, linear.SPHERE])).all()


def growing_fraction(I1, I2, I3, omega0, axis, phase):
    """The column of a batch."""
    points = {"I1": I1, "I2": I2, "I3": I3, "axis": axis, "omega0": omega0, "epsilon": 1e-6, "phase": phase}
    return linear.predict_columns(rigid_body.points_of(points))["growing_fraction"]


@given(st.floats(0, 6.3), st.sampled_from([1.0, -2.5, 1e-100]), moment_triples(0.1, 10.0))
def test_growing_fraction_against_eigenvectors(phase, omega0, moments):
    ours = growing_fraction(*moments, omega0, AXES, phase)
    unstable = linear.regime(*moments, AXES) == linear.UNSTABLE
    assert (ours[~unstable] == 0).all()
    assert ((ours >= 0) & (ours <= 1 + 4 * ULP)).all()
    for axis in AXES[unstable]:
        _, cb, cc = coefficients(*moments, axis)
        share = growing_share(cb, cc, np.sign(omega0), phase)
        # a sum of squares over its greatest value: a few roundings of one
        assert ours[axis - 1] == pytest.approx(share, rel=0, abs=8 * ULP)
