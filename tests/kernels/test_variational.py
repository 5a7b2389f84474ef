import numpy as np
import pytest
from sympy import Poly, legendre_poly, symbols
from sympy.integrals.quadrature import gauss_legendre

from kernels import variational


def test_weights_of_collocation_are_those_of_exact_integrals():
    """Against SymPy's rule, and integrals of Lagrange's polynomials in 30 digits; 1e-15: roundings of eight terms."""
    x = symbols("x")
    roots, weights = gauss_legendre(8, 30)
    points, inner, whole = variational.collocation()
    assert points == pytest.approx(np.array([(root + 1) / 2 for root in roots], dtype=float), rel=3e-16)
    assert whole == pytest.approx(np.array(weights, dtype=float) / 2, rel=3e-16)
    for j, own in enumerate(roots):
        lagrange = Poly(legendre_poly(8, x), x).div(Poly(x - own, x))[0]
        integral = lagrange.integrate() * (1 / lagrange.eval(own) / 2)
        up_to = [float(integral.eval(root) - integral.eval(-1)) for root in roots]
        assert inner[:, j] == pytest.approx(up_to, abs=1e-15)
    assert np.abs(variational.TWICE - inner @ inner).max() < 1e-15
    assert np.abs(variational.WHOLE_TWICE - whole * (1 - points)).max() < 1e-15  # Nystrom's condition
