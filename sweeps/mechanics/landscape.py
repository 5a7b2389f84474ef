"""Forces or rates of a system, their slopes, masses and sizes, and where to look for equilibria, for many points."""

import numpy as np
import sympy as sp

from sweeps.mechanics.equations import Equations
from sweeps.mechanics.graph import lambdified
from sweeps.mechanics.problem import RootProblem, magnitude

FLAT = 1e-9  # of what a conserved quantity changes in second order: less is no slope


class Landscape(RootProblem):
    """Hold the functions of arrays that vanish at equilibria, with their derivatives and bounds.

    Each takes parameters (a list of arrays), then places (a sequence of m arrays), all of one shape (points,).
    """

    def __init__(self, equations: Equations):
        super().__init__(equations)
        self.equations, self.n = equations, equations.n
        slopes, self._arguments = list(equations.slopes), (*equations.parameters, *self.symbols)
        self._slopes, self._terms = self._written(slopes), self._written([magnitude(e) for e in slopes])
        self._a = self._written(equations.a.subs(equations.still)) if equations.v else None
        self._third = self._written(equations.third) if equations.natural else None
        gradients, bends = list(equations.gradients), [e for matrix in equations.curvatures for e in matrix]
        self._gradients = [self._written(es) for es in (gradients, map(magnitude, gradients))]
        self._curvatures, self._bends = (self._written(es) for es in (bends, map(magnitude, bends)))
        self._sizes = self._written([self._size(place) for place in equations.places])

    def _written(self, expressions):
        return lambdified(self._arguments, expressions)

    def _size(self, place):
        """Return a perturbation of relative size one; by default a quarter of the bounds, or NaN (see `scales`)."""
        if place.size is not None:
            return place.size
        is_found = self.equations.natural and self.system.given_period is None
        return sp.nan if is_found else (place.bounds[1] - place.bounds[0]) / 4

    def starts(self, parameters):
        """Return the named places, shape (points, names, m); without names a place off the middle of the bounds."""
        if self.system.labels:
            return self.labels(parameters)
        bounds = self.bounds(parameters)
        return (bounds[..., 0] + 0.3819660112501051 * (bounds[..., 1] - bounds[..., 0]))[:, None]

    def slopes(self, parameters, x):
        """Return the derivatives of forces or rates by all states and their terms' absolute values: (points, m, n)."""
        return tuple(self._shaped(f, (self.m, self.n), parameters, x) for f in (self._slopes, self._terms))

    def a(self, parameters, x):
        """Return the kinetic matrix of coordinates, shape (points, m, m)."""
        return self._shaped(self._a, (self.m, self.m), parameters, x)

    def third(self, parameters, x):
        """Return the third derivatives of V and the first of a, a list of arrays."""
        return self._third(*parameters, *x)

    def gradients(self, parameters, x):
        """Return the derivatives of the conserved quantities and their terms' absolute values: (points, q, n)."""
        return [self._shaped(f, (-1, self.n), parameters, x) for f in self._gradients]

    def conserved_slopes(self, parameters, x, sizes):
        """Return the changes of conserved quantities along each state's size, shape (points, quantities, n), or 0.

        Where all that is left is a rounding of what they change in second order, they have no slope.
        """
        slopes = self.gradients(parameters, x)[0] * sizes[:, None, :]
        bent = np.einsum("pi,pqij,pj->pq", sizes, self.bends(parameters, x), sizes)
        slopes[np.abs(slopes).sum(axis=2) <= FLAT * bent] = 0.0
        return slopes

    def curvatures(self, parameters, x):
        """Return the second derivatives of the conserved quantities, and their terms' absolute values: (…, n, n)."""
        return self._shaped(self._curvatures, (-1, self.n, self.n), parameters, x), self.bends(parameters, x)

    def bends(self, parameters, x):
        """Return the absolute values of the terms of `curvatures`."""
        return self._shaped(self._bends, (-1, self.n, self.n), parameters, x)

    def sizes(self, parameters, x):
        """Return the sizes of the places, shape (points, m); NaN where none is given."""
        return self._shaped(self._sizes, (self.m,), parameters, x)

    @staticmethod
    def _shaped(function, shape, parameters, x):
        values = function(*parameters, *x)
        whole = np.stack(values, axis=-1) if values else np.empty((len(x[0]), 0))
        count = whole.shape[-1] // int(np.prod([abs(k) for k in shape]))
        return whole.reshape(len(x[0]), *(count if k < 0 else k for k in shape))
