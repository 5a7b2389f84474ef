import numpy as np
import pytest

from kernels import rigid_body


def test_cyclic():
    assert [tuple(int(x) for x in rigid_body.cyclic(axis)) for axis in (1, 2, 3)] == [(0, 1, 2), (1, 2, 0), (2, 0, 1)]
    with pytest.raises(ValueError, match="1, 2 or 3"):
        rigid_body.cyclic(4)


def test_derivative_is_the_torque_free_cross_product():
    moments, omega = np.array([1.0, 2.0, 3.5]), np.array([0.3, -1.2, 0.7])
    expected = -np.cross(omega, moments * omega) / moments
    ours = rigid_body.derivative(*omega, *rigid_body.euler_coefficients(*moments))
    np.testing.assert_allclose(ours, expected, rtol=1e-14)


def test_invariants():
    moments, omega = np.array([1.0, 2.0, 3.5]), np.array([0.3, -1.2, 0.7])
    energy, momentum = omega @ (moments * omega), np.sum((moments * omega) ** 2)
    assert rigid_body.twice_energy(*omega, *moments) == pytest.approx(energy, rel=1e-15)
    assert rigid_body.squared_momentum(*omega, *moments) == pytest.approx(momentum, rel=1e-15)
    _, cb, cc = rigid_body.euler_coefficients(*moments)
    J, scale = rigid_body.perturbation_invariant(omega[1], omega[2], cb, cc)
    assert J * moments[1] * moments[2] == pytest.approx(momentum - energy * moments[0], rel=1e-13)
    assert scale >= abs(J)


def test_shapes_and_triangle():
    kinds = rigid_body.shape([1, 1, 1, 2], [2, 1, 2, 2], [3, 2, 2, 2])
    assert kinds.tolist() == [rigid_body.ASYMMETRIC, rigid_body.OBLATE, rigid_body.PROLATE, rigid_body.SPHERE]
    assert rigid_body.triangle_margin(1.0, 1.5, 2.5) == 0.0
    assert rigid_body.triangle_margin(1.0, 1.5, 3.0) == pytest.approx(-0.5 / 5.5, rel=1e-14)
    assert rigid_body.triangle_margin(1e160, 1e160, 1e160) == pytest.approx(1 / 3, rel=1e-15)
