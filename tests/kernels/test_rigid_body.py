import itertools

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from naive import fractions, seen_from
from strategies import moment_triples

from kernels.free import rigid_body, triangle

ULP = 2.0**-52
RATES = st.tuples(*[st.floats(-1e3, 1e3).map(lambda x: x if abs(x) > 1e-3 else 1e-3)] * 3)


def coefficients(moments):
    """Euler coefficients as fractions."""
    Ia, Ib, Ic = fractions(*moments)
    return (Ib - Ic) / Ia, (Ic - Ia) / Ib, (Ia - Ib) / Ic


def test_cyclic():
    assert [tuple(int(x) for x in rigid_body.cyclic(axis)) for axis in (1, 2, 3)] == [(0, 1, 2), (1, 2, 0), (2, 0, 1)]
    a, b, c = rigid_body.cyclic(np.array([[1, 2], [3, 1]]))
    assert a.tolist() == [[0, 1], [2, 0]]
    assert b.tolist() == [[1, 2], [0, 1]]
    assert c.tolist() == [[2, 0], [1, 2]]


@pytest.mark.parametrize("axis", [0, 4, -1, 1.5, [1, 2, 4]])
def test_cyclic_refuses_what_is_no_axis(axis):
    with pytest.raises(ValueError, match="must be 1, 2 or 3"):
        rigid_body.cyclic(axis)


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_relabel_sees_the_axes_in_cyclic_order(axis):
    moments = np.array([1.0, 2.0, 3.5])
    assert rigid_body.relabel(*moments, axis) == seen_from(axis, *moments)
    assert rigid_body.relabel(*moments, axis) == tuple(moments[int(i)] for i in rigid_body.cyclic(axis))


@given(moment_triples())
def test_euler_coefficients_are_right_to_two_roundings(moments):
    for ours, exact in zip(rigid_body.euler_coefficients(*moments), coefficients(moments), strict=True):
        # two roundings, of the difference and of the ratio, half an ulp each; so the sign is exact
        assert abs(fractions(ours)[0] - exact) <= ULP * 1.01 * abs(exact)
        assert np.sign(ours) == (exact > 0) - (exact < 0)


@given(moment_triples(), RATES)
def test_derivative_is_the_torque_free_cross_product(moments, omega):
    moments, omega = np.array(moments), np.array(omega)
    coefficients = np.array(rigid_body.euler_coefficients(*moments))
    ours = np.array(rigid_body.derivative(*omega, *coefficients))
    # the cross product subtracts products of moments and rates: rounding of either
    momentum = moments * omega
    allowed = 4 * ULP * np.abs([omega[(i + 1) % 3] * momentum[(i + 2) % 3] for i in range(3)])
    allowed += 4 * ULP * np.abs([omega[(i + 2) % 3] * momentum[(i + 1) % 3] for i in range(3)])
    assert (np.abs(ours * moments + np.cross(omega, momentum)) <= allowed).all()
    w = fractions(*omega)
    exact = [c * w[(i + 1) % 3] * w[(i + 2) % 3] for i, c in enumerate(fractions(*coefficients))]
    np.testing.assert_allclose(ours, [float(x) for x in exact], rtol=2 * ULP)


@given(moment_triples(), RATES)
def test_energy_and_momentum_against_fractions(moments, omega):
    w, moment = fractions(*omega), fractions(*moments)
    energy = sum(i * x * x for i, x in zip(moment, w, strict=True))
    momentum = sum((i * x) ** 2 for i, x in zip(moment, w, strict=True))
    # sums of positive terms, at most six roundings each of half an ulp
    assert rigid_body.twice_energy(*omega, *moments) == pytest.approx(float(energy), rel=3 * ULP, abs=0)
    assert rigid_body.squared_momentum(*omega, *moments) == pytest.approx(float(momentum), rel=3 * ULP, abs=0)


@given(moment_triples(), RATES)
def test_perturbation_invariant_is_momentum_less_energy(moments, omega):
    Ia, Ib, Ic = fractions(*moments)
    a, b, c = fractions(*omega)
    energy = Ia * a * a + Ib * b * b + Ic * c * c
    momentum = (Ia * a) ** 2 + (Ib * b) ** 2 + (Ic * c) ** 2
    exact = (momentum - energy * Ia) / (Ib * Ic)
    absolute = abs((Ic - Ia) / Ib) * c * c + abs((Ia - Ib) / Ic) * b * b
    _, cb, cc = rigid_body.euler_coefficients(*moments)
    ours, scale = rigid_body.perturbation_invariant(omega[1], omega[2], cb, cc)
    assert scale == pytest.approx(float(absolute), rel=4 * ULP, abs=0)
    assert ours == pytest.approx(float(exact), rel=0, abs=4 * ULP * float(absolute))


def kind(moments):
    """The shape, by counting which moments are the same."""
    different = sorted(set(moments))
    if len(different) == 3:
        return rigid_body.ASYMMETRIC
    if len(different) == 1:
        return rigid_body.SPHERE
    return rigid_body.OBLATE if list(moments).count(different[0]) == 2 else rigid_body.PROLATE


@given(moment_triples())
def test_shape_in_any_order(moments):
    I1, I2, I3 = moments
    shapes = rigid_body.shape([I1, I2, I3, I1], [I2, I3, I1, I3], [I3, I1, I2, I2])
    assert shapes.dtype == np.int8
    assert shapes.tolist() == [kind(moments)] * 4


@given(moment_triples())
def test_triangle_margin_against_fractions(moments):
    I1, I2, I3 = exact = fractions(*moments)
    margin = min(I2 + I3 - I1, I3 + I1 - I2, I1 + I2 - I3) / sum(exact)
    ours = triangle.triangle_margin(*moments)
    margin = 0 if -triangle.FLATNESS_TOLERANCE <= margin < 0 else margin
    # ratios to the greatest moment, each rounded once, over a sum between 1 and 3
    assert float(ours) == pytest.approx(float(margin), rel=4 * ULP, abs=2 * ULP)
    assert ours == triangle.triangle_margin(moments[2], moments[0], moments[1])
    assert ours == triangle.triangle_margin(*(2.0**300 * m for m in moments))


@given(st.integers(1, 2**50), st.integers(1, 2**50))
def test_a_plate_has_no_margin_and_a_rod_neither(p, q):
    assume(p != q)
    assert triangle.triangle_margin(float(p), float(q), float(p + q)) == 0.0
    assert triangle.triangle_margin(float(p), float(p + q), float(q)) == 0.0
    assert triangle.triangle_margin(float(p + q), float(q), float(p) + 1.0) > 0.0
    assert triangle.triangle_margin(1.00001 * (p + q), float(q), float(p)) < 0.0


@pytest.mark.parametrize(
    "plate", [(0.1, 0.2, 0.3), (0.1, 0.7, 0.8), (1 / 3, 2 / 3, 1.0), (0.333333333, 0.666666667, 1.0)]
)
@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e300])
def test_rounded_moments_of_a_plate_make_no_impossible_body(plate, scale):
    """In doubles 0.1 + 0.7 < 0.8: the margin of a body that is flat but for its digits is 0, not negative."""
    for order in itertools.permutations(range(3)):
        assert triangle.triangle_margin(*(scale * plate[k] for k in order)) >= 0.0


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e160, 1e307])
def test_the_sphere_has_the_greatest_margin_at_any_scale(scale):
    assert triangle.triangle_margin(scale, scale, scale) == pytest.approx(1 / 3, rel=1e-15, abs=0)
