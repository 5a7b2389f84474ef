"""A flow's forces or rates, their slopes and scales, and where to look for its equilibria."""

import numpy as np

from sweeps.mechanics.flow import Flow
from sweeps.mechanics.graph import lambdified
from sweeps.mechanics.problem import RootProblem, magnitude


class Forces(RootProblem):
    """A flow's forces, slopes and scales as functions of arrays: parameters (a list), then places, all of one shape."""

    takes_members = True

    def __init__(self, flow: Flow):
        super().__init__(flow.system, flow.places, flow.pulls, flow.parameters)
        self.flow, self.n = flow, flow.n
        arguments = (*flow.parameters, *self.symbols)
        slopes = list(flow.slopes)
        self._slopes = lambdified(arguments, slopes)
        self._slope_terms = lambdified(arguments, [magnitude(e) for e in slopes])
        self._a = lambdified(arguments, list(flow.a.subs(flow.still))) if flow.rest else None
        self._gradients = lambdified(arguments, list(flow.gradients)) if len(flow.gradients) else None
        curvatures = [magnitude(e) for matrix in flow.curvatures for e in matrix]
        self._curvatures = lambdified(arguments, curvatures) if curvatures else None
        self._sizes = lambdified(arguments, [_size(place) for place in flow.places])

    def _unnamed(self, place):
        return sum(place.bounds) / 2

    def starts(self, parameters):
        """The named places, shape (points, names, m); without names a place off the middle of the bounds."""
        if self.system.labels:
            return self.labels(parameters)
        bounds = self.bounds(parameters)
        return (bounds[..., 0] + 0.3819660112501051 * (bounds[..., 1] - bounds[..., 0]))[:, None]

    def slopes(self, parameters, x):
        """Derivatives of the forces or rates by all states, and their terms' absolute values: (points, m, n) each."""
        shape = (-1, self.m, self.n)
        found = (np.stack(f(*parameters, *x), -1).reshape(shape) for f in (self._slopes, self._slope_terms))
        return tuple(found)

    def a(self, parameters, x):
        """Kinetic matrix of coordinates, shape (points, m, m)."""
        return np.stack(self._a(*parameters, *x), -1).reshape(-1, self.m, self.m)

    def gradients(self, parameters, x):
        """Derivatives of the conserved quantities, shape (points, quantities, n)."""
        if self._gradients is None:
            return np.zeros((len(x[0]), 0, self.n))
        return np.stack(self._gradients(*parameters, *x), -1).reshape(len(x[0]), -1, self.n)

    def curvatures(self, parameters, x):
        """Absolute values of the conserved quantities' second derivatives, shape (points, quantities, n, n)."""
        return np.stack(self._curvatures(*parameters, *x), -1).reshape(len(x[0]), -1, self.n, self.n)

    def sizes(self, parameters, x):
        """Sizes of the places, shape (points, m)."""
        return np.stack(self._sizes(*parameters, *x), -1)


def _size(place):
    """What a nudge of relative size one is; a quarter of the range between the bounds where none is said."""
    return (place.bounds[1] - place.bounds[0]) / 4 if place.size is None else place.size
