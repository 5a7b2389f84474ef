"""A potential's landscape: V's derivatives, a_ij and where to look for equilibria, as functions of many points."""

import numpy as np
import sympy as sp

from sweeps.mechanics.derivation import Equations
from sweeps.mechanics.graph import lambdified
from sweeps.mechanics.problem import RootProblem, magnitude


class Landscape(RootProblem):
    """V's derivatives and a_ij of a system as functions of arrays.

    Each takes parameters (a tuple of arrays) and q (a sequence of n arrays), all of one shape.
    """

    def __init__(self, equations: Equations):
        system = equations.system
        super().__init__(system, system.kept, equations.gradient, equations.parameters)
        self.equations = equations
        self.n = equations.n
        arguments = (*equations.parameters, *equations.q)
        self._hessian = lambdified(arguments, equations.hessian)
        self._a = lambdified(arguments, equations.a)
        self._third = lambdified(arguments, equations.third)
        self._terms = lambdified(arguments, [magnitude(e) for e in equations.hessian])
        self._sizes = lambdified(arguments, [sp.nan if c.size is None else c.size for c in system.kept])

    def hessian(self, parameters, q):
        """V″, shape (..., n, n)."""
        return self._matrix(self._hessian, parameters, q)

    def a(self, parameters, q):
        """a_ij, shape (..., n, n)."""
        return self._matrix(self._a, parameters, q)

    def hessian_terms(self, parameters, q):
        """What the terms of V″ amount to, shape (..., n, n); see `magnitude`."""
        return self._matrix(self._terms, parameters, q)

    def third(self, parameters, q):
        """The third derivatives of V and the first of a, a list of arrays."""
        return self._third(*parameters, *q)

    def sizes(self, parameters, q):
        """The size of a nudge of relative size one in each coordinate, shape (..., n); NaN where none is given."""
        return np.stack(self._sizes(*parameters, *q), axis=-1)

    def _matrix(self, function, parameters, q):
        values = np.stack(function(*parameters, *q), axis=-1)
        return values.reshape(*values.shape[:-1], self.n, self.n)
