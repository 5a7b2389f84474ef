import numpy as np
import pytest
from scipy.linalg import expm
from sympy import Poly, legendre_poly, symbols
from sympy.integrals.quadrature import gauss_legendre

from kernels.compile.blocks import W, scratch
from kernels.flow import variational


def test_weights_of_collocation_are_those_of_exact_integrals():
    """Against SymPy's rule, and integrals of Lagrange's polynomials in 30 digits; 1e-15: roundings of eight terms."""
    x = symbols("x")
    roots, weights = gauss_legendre(8, 30)
    points, inner, weights_of_step = variational.collocation_weights()
    assert points == pytest.approx(np.array([(root + 1) / 2 for root in roots], dtype=float), rel=3e-16)
    assert weights_of_step == pytest.approx(np.array(weights, dtype=float) / 2, rel=3e-16)
    for j, node in enumerate(roots):
        lagrange = Poly(legendre_poly(8, x), x).div(Poly(x - node, x))[0]
        integral = lagrange.integrate() * (1 / lagrange.eval(node) / 2)
        up_to = [float(integral.eval(root) - integral.eval(-1)) for root in roots]
        assert inner[:, j] == pytest.approx(up_to, abs=1e-15)
    assert np.abs(variational.DOUBLE_WEIGHTS - inner @ inner).max() < 1e-15
    assert np.abs(variational.DOUBLE_STEP_WEIGHTS - weights_of_step * (1 - points)).max() < 1e-15  # Nystrom's condition


@pytest.mark.parametrize(("m", "n"), [(1, 2), (2, 4), (2, 2), (3, 3), (3, 6)])
def test_a_step_of_constant_slopes_is_the_exponential(m, n):
    """Written out and by loops, of coordinates and of states, with some zero slopes; 2e-15: some roundings."""
    rng = np.random.default_rng(m + n)
    entries = tuple((i, j) for i in range(m) for j in range(n) if (i + 2 * j) % 3)
    values = rng.uniform(-0.5, 0.5, (len(entries), W))
    S = scratch(variational.STAGES * len(entries) + n * n)
    rows = S.reshape(-1, W)
    rows[: -n * n] = np.tile(values, (variational.STAGES, 1))
    variational.compile_step(m, n, entries)(S, rows, 0)
    for lane in range(0, W, 8):
        A = np.eye(n, k=m) if n > m else np.zeros((n, n))
        for value, (i, j) in zip(values[:, lane], entries, strict=True):
            A[n - m + i, j] = value
        np.testing.assert_allclose(rows[-n * n :, lane].reshape(n, n), expm(A), rtol=0, atol=2e-15)
