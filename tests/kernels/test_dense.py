"""Small dense matrices against LAPACK and SciPy."""

import numpy as np
import pytest
from scipy import linalg

pytestmark = pytest.mark.slow  # compiling the eigenvalues takes as long as many quick tests


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """The kernels, imported for the tests that are chosen alone: importing compiles them."""
    global dense, invariants
    from kernels.flow import dense, invariants


@pytest.mark.parametrize("n", range(1, 13))
def test_eigenvalues_are_lapacks(n):
    rng = np.random.default_rng(n)
    re, im = np.empty(n), np.empty(n)
    for _ in range(40):
        A = rng.normal(size=(n, n))
        assert dense.eigenvalues(A, n, re, im)
        eigenvalues = np.sort_complex(re + 1j * im)
        np.testing.assert_allclose(
            eigenvalues, np.sort_complex(linalg.eigvals(A)), atol=1e-12 * n
        )  # a few condition numbers
        assert set(re[im != 0] + 1j * im[im != 0]) == set(re[im != 0] - 1j * im[im != 0])  # pairs, exactly


def test_eigenvalues_of_awkward_matrices():
    re, im = np.empty(4), np.empty(4)
    jordan = np.eye(4, k=1)
    cyclic = np.roll(np.eye(4), 1, axis=0)  # at which an unshifted step makes no progress
    for A, tolerance in ((np.zeros((4, 4)), 0.0), (np.eye(4), 0.0), (jordan, 1e-3), (cyclic, 1e-14)):
        assert dense.eigenvalues(A, 4, re, im)
        np.testing.assert_allclose(np.sort(re**2 + im**2), np.sort(np.abs(linalg.eigvals(A)) ** 2), atol=tolerance)
    assert not dense.eigenvalues(np.full((4, 4), np.nan), 4, re, im)


@pytest.mark.parametrize("coupling_of_pairs", [0.0, *10.0 ** -np.arange(1.0, 17.0)])
def test_eigenvalues_of_hamiltons_equations(coupling_of_pairs):
    """Two equal pairs ±σ, exact and slightly coupled: with shifts ±σ the iteration does not end."""
    rng, re, im = np.random.default_rng(1), np.empty(6), np.empty(6)
    A = np.kron([[0.0, 1.125], [1.0, 0.0]], np.diag([0.259, 0.259, 0.0]))
    A[2, 5], A[5, 2], A[3, 4], A[4, 3] = 0.389, -0.389, coupling_of_pairs, -coupling_of_pairs
    for _ in range(20):
        assert dense.eigenvalues(A, 6, re, im)
        deviation = np.poly(re + 1j * im) - np.poly(A)  # coefficients keep their digits at multiple eigenvalues
        np.testing.assert_allclose(deviation, 0.0, atol=1e-14)  # some 50 roundings of numbers below 1
        A *= 1.0 + 1e-16 * rng.normal(size=A.shape)


@pytest.mark.parametrize("n", [1, 2, 4, 9])
def test_logarithms_are_scipys_whatever_the_series_needs(n):
    """Rates of at most π/4 a sample, for which few terms suffice, and larger rates."""
    A = np.random.default_rng(3).normal(size=(32, n, n))
    A *= (np.linspace(0.3, 1.4, 32) / np.abs(np.linalg.eigvals(A)).max(1))[:, None, None]
    M = np.array([linalg.expm(a) for a in A]).reshape(32, -1).T.copy()
    Y, *work = (np.empty((n * n, 32)) for _ in range(4))
    invariants._matrix_logarithms(M, n, Y, (*work, np.empty(32)))
    np.testing.assert_allclose(Y.T.reshape(A.shape), A, atol=2e-14 * max(1.0, np.linalg.norm(A, axis=(1, 2)).max()))
