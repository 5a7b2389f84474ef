import numpy as np
import pytest
from naive import coefficients

from kernels import linear


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_omega_squared_is_minus_the_squared_eigenvalue(axis):
    _, cb, cc = coefficients(1.0, 2.0, 2.7, axis)
    eigenvalue = np.linalg.eigvals(3.0 * np.array([[0, cb], [cc, 0]]).astype(complex))[0]
    assert linear.omega_squared(1.0, 2.0, 2.7, 3.0, axis) == pytest.approx(-(eigenvalue**2).real, rel=1e-14)


@pytest.mark.parametrize(("axis", "omega0"), [(1, 2.0), (2, 2.0), (2, -2.0), (3, -2.0)])
def test_perturbation_solves_its_differential_equation(axis, omega0):
    _, cb, cc = coefficients(1.0, 2.0, 2.7, axis)
    t, h = 1.3, 1e-4
    b, c = linear.perturbation(1.0, 2.0, 2.7, omega0, axis, 1e-6, 0.6, np.array([t - h, t, t + h]))
    # central differences: h² of the third derivative, a few 1e-8
    assert (b[2] - b[0]) / (2 * h) == pytest.approx(cb * omega0 * c[1], rel=1e-6)
    assert (c[2] - c[0]) / (2 * h) == pytest.approx(cc * omega0 * b[1], rel=1e-6)


def test_perturbation_at_equal_moments_is_secular():
    b, c = linear.perturbation(1.0, 1.0, 2.0, 3.0, 1, 1e-6, 0.6, np.array([0.0, 1.0, 2.0]))
    assert b[2] - b[1] == pytest.approx(b[1] - b[0], rel=1e-9)
    assert (c == c[0]).all()


def test_growing_fraction_against_eigenvectors():
    _, cb, cc = coefficients(1.0, 2.0, 2.7, 2)
    scale = np.sqrt(np.abs([cb, cc]))
    for omega0 in (1.0, -1.0):
        values, vectors = np.linalg.eigh(omega0 * np.sign(cb) * np.sqrt(cb * cc) * np.array([[0, 1], [1, 0]]))
        grows = vectors[:, np.argmax(values)]
        for phase in np.linspace(0, 6, 7):
            start = np.array([np.cos(phase), np.sin(phase)]) / scale
            share = (start @ grows) ** 2 / (start @ start)
            assert linear.growing_fraction(1.0, 2.0, 2.7, omega0, 2, phase) == pytest.approx(share, abs=1e-14)
    assert linear.growing_fraction(1.0, 2.0, 2.7, 1.0, 1, 0.6) == 0


def test_regimes():
    told = linear.regime([1, 1, 1, 1, 1, 2], [2, 2, 2, 1, 1, 1], [3, 3, 3, 2, 1, 1], [1, 2, 3, 1, 2, 1])
    expected = [linear.STABLE_MINOR, linear.UNSTABLE, linear.STABLE_MAJOR, linear.MARGINAL, linear.SPHERE]
    assert told.tolist() == [*expected, linear.STABLE_MAJOR]
