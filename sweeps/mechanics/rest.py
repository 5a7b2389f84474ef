"""Where a flow is at rest: f(x) = 0 within bounds, near the places that the description names.

A named place that satisfies the equations to rounding is taken as it stands. Others are found from there by Newton's
steps with the pseudo-inverse: where the equilibria form a family (a spin that may have any rate), the step is the
shortest one, and the family's member nearest to the name is found. Without names the starts are a lattice.
"""

import numpy as np
import sympy as sp

from sweeps.mechanics.description import DescriptionError
from sweeps.mechanics.first_order import magnitude
from sweeps.mechanics.flow import Flow
from sweeps.mechanics.graph import lambdified

ROUNDINGS = 16 * np.finfo(np.float64).eps
STILL = 1e-10  # of the sum of the terms' absolute values
ITERATIONS = 60
FAR = 0.25  # of the range: no name reaches farther
SAME = 1e-6  # of the range
STARTS = 64
SMALL = 1e-9  # singular values below it, relative, are a family's


class Forces:
    """A flow's forces, slopes and scales as functions of arrays: parameters (a list), then places, all of one shape."""

    def __init__(self, flow: Flow):
        self.flow = flow
        symbols = tuple(place.symbol for place in flow.places)
        self.m, self.n = len(symbols), flow.n
        arguments = (*flow.parameters, *symbols)
        slopes = list(flow.slopes)
        self._pulls = lambdified(arguments, flow.pulls)
        self._pull_terms = lambdified(arguments, [magnitude(e) for e in flow.pulls])
        self._slopes = lambdified(arguments, slopes)
        self._slope_terms = lambdified(arguments, [magnitude(e) for e in slopes])
        self._a = lambdified(arguments, list(flow.a.subs(flow.still))) if flow.rest else None
        self._gradients = lambdified(arguments, list(flow.gradients)) if len(flow.gradients) else None
        curvatures = [magnitude(e) for matrix in flow.curvatures for e in matrix]
        self._curvatures = lambdified(arguments, curvatures) if curvatures else None
        self._sizes = lambdified(arguments, [_size(place) for place in flow.places])
        self._bounds = lambdified(flow.parameters, [b for place in flow.places for b in place.bounds])
        middle = {place.symbol: (place.bounds[0] + place.bounds[1]) / 2 for place in flow.places}
        labels = flow.system.labels.values()
        named = [sp.sympify(label.get(x, middle[x])) for label in labels for x in symbols]
        self._labels = lambdified(flow.parameters, named) if named else None

    def pulls(self, parameters, x):
        """Forces at rest, or rates, and the sums of their terms' absolute values, shape (points, m) each."""
        return np.stack(self._pulls(*parameters, *x), -1), np.stack(self._pull_terms(*parameters, *x), -1)

    def slopes(self, parameters, x):
        """Derivatives of :meth:`pulls` by all states, and their terms' absolute values, shape (points, m, n) each."""
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

    def bounds(self, parameters):
        """Lower and upper bounds, shape (points, m, 2)."""
        return np.stack(self._bounds(*parameters), -1).reshape(-1, self.m, 2)

    def starts(self, parameters):
        """Where to look, shape (points, starts, m): the named places, or a lattice."""
        points = len(parameters[0])
        if self._labels is not None:
            return np.stack(self._labels(*parameters), -1).reshape(points, -1, self.m)
        per_axis = max(2, int(STARTS ** (1.0 / self.m)))
        fractions = (np.arange(per_axis) + 0.3819660112501051) / per_axis
        lattice = np.stack(np.meshgrid(*[fractions] * self.m, indexing="ij"), -1).reshape(-1, self.m)
        bounds = self.bounds(parameters)
        return bounds[:, None, :, 0] + lattice * (bounds[:, None, :, 1] - bounds[:, None, :, 0])


def _size(place):
    """What a nudge of relative size one is; a quarter of the range between the bounds where none is said."""
    return (place.bounds[1] - place.bounds[0]) / 4 if place.size is None else place.size


def find(landscape: Forces, parameters) -> np.ndarray:
    """Equilibria of points, shape (points, most, m), NaN where there is none; `most` is the description's.

    Raises:
        DescriptionError: where a point has more equilibria than `most` and none has a name.
    """
    system = landscape.flow.system
    with np.errstate(all="ignore"):
        starts = landscape.starts(parameters)
        bounds = landscape.bounds(parameters)
        points, count, m = starts.shape
        index = np.repeat(np.arange(points), count)
        found = _solved(landscape, [p[index] for p in parameters], starts.reshape(-1, m), bounds[index])
        found = found.reshape(points, count, m)
        width = bounds[:, :, 1] - bounds[:, :, 0]
        if system.labels:
            far = (np.abs(found - starts) / width[:, None]).max(-1) > FAR
            found[far] = np.nan
        found = _distinct(found, width)
    return _slotted(system, parameters, found)


def _solved(landscape, parameters, x, bounds):
    width = bounds[:, :, 1] - bounds[:, :, 0]
    pulls, terms = landscape.pulls(parameters, list(x.T))
    left = np.flatnonzero((np.abs(pulls) > ROUNDINGS * terms).any(1) & np.isfinite(x).all(1))
    x = x.copy()
    for _ in range(ITERATIONS):
        if left.size == 0:
            break
        chosen, here = [p[left] for p in parameters], list(x[left].T)
        pulls, terms = landscape.pulls(chosen, here)
        slopes = landscape.slopes(chosen, here)[0][:, :, : landscape.m]
        weight = np.where(terms > 0.0, 1.0 / terms, 1.0)
        scaled = slopes * weight[:, :, None] * width[left][:, None, :]
        sound = np.isfinite(scaled).all((1, 2)) & np.isfinite(pulls).all(1)
        step = np.full(pulls.shape, np.nan)
        inverse = np.linalg.pinv(scaled[sound], rcond=SMALL)
        step[sound] = -np.einsum("pij,pj->pi", inverse, (pulls * weight)[sound])
        length = np.abs(step).max(1, initial=0.0)
        step *= np.minimum(1.0, 0.2 / np.maximum(length, 1e-300))[:, None]
        x[left] += step * width[left]
        left = left[length > 1e-15]
    pulls, terms = landscape.pulls(parameters, list(x.T))
    still = (np.abs(pulls) <= STILL * terms).all(1)
    slack = 1e-9 * width
    inside = ((x >= bounds[:, :, 0] - slack) & (x <= bounds[:, :, 1] + slack)).all(1)
    x[~(still & inside)] = np.nan
    return x


def _distinct(found, width):
    """Equilibria without those that an earlier one stands for."""
    found = found.copy()
    for k in range(1, found.shape[1]):
        apart = (np.abs(found[:, :k] - found[:, k : k + 1]) / width[:, None]).max(-1)
        found[(apart < SAME).any(1), k] = np.nan
    return found


def _slotted(system, parameters, found):
    if system.labels:
        slots = np.full((len(found), system.most, found.shape[2]), np.nan)
        slots[:, : found.shape[1]] = found
        return slots
    here = ~np.isnan(found[:, :, 0])
    crowded = np.flatnonzero(here.sum(1) > system.most)
    if crowded.size:
        values = ", ".join(f"{k}={p[crowded[0]]:g}" for k, p in zip(system.parameters, parameters, strict=True))
        raise DescriptionError(
            f"equilibria: there are {here[crowded[0]].sum()}, at {values}; allowed: at most {system.most} (`most`, or "
            "their names)"
        )
    order = np.lexsort((np.where(here, found[:, :, 0], 0.0), ~here), axis=1)
    return np.take_along_axis(found, order[:, : system.most, None], axis=1)
