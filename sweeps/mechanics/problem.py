"""The equations F(x) = 0 of a system's equilibria, with parameters, and the bounds of their search."""

from functools import cached_property

import numpy as np
import sympy as sp

from sweeps.mechanics.equations import Equations
from sweeps.mechanics.graph import lambdified
from sweeps.mechanics.tape import Tape
from sweeps.schema.refusals import DescriptionError

MOST_FACTORED = 60  # operations
SINGULAR = 1e-9  # singular values below it, relative, are a family's
APART = 1024.0  # errors of a place, over which a matrix is taken to change evenly


class RootProblem:
    """F(x) = 0 of a system: ∂V/∂q, forces at rest or rates, as functions of the coordinates or states x."""

    def __init__(self, equations: Equations):
        system, places = equations.system, equations.places
        self.system, self.places, self.F, self.parameters = system, places, equations.pulls, equations.parameters
        #: whether the member nearest to a name is taken where equilibria form a family
        self.takes_members = not equations.natural
        self.symbols = tuple(place.symbol for place in places)
        self.m = len(places)
        self.last: tuple = (None, None)  # the points that were searched last, and what was found
        held = [place.hold for place in places]
        self.held = [0 if hold is None else hold for hold in held]
        #: numbers of the unknowns: of the coordinates that are not held
        self.free = [i for i, hold in enumerate(held) if hold is None]
        #: which of the coordinates close on themselves
        self.periodic = np.array([place.periodic for place in places])
        self._bounds = lambdified(self.parameters, [bound for place in places for bound in place.bounds])
        self._holds = lambdified(self.parameters, self.held)
        labels, unknowns = system.labels.values(), list(zip(self.symbols, places, strict=True))
        names = [label.get(x, self._unnamed(place)) for label in labels for x, place in unknowns]
        self._labels = lambdified(self.parameters, [sp.sympify(name) for name in names])
        if system.follow and system.labels:
            raise DescriptionError("follow: is for equilibria without names; allowed: such a system, or none of it")

    def _unnamed(self, place):
        """Return the start of a coordinate or state that a name leaves out: amid the bounds, or anywhere, NaN."""
        return sum(place.bounds) / 2 if self.takes_members else sp.nan

    @cached_property
    def whole(self) -> Tape:
        """F by all coordinates or states."""
        return Tape([sp.factor_terms(e) for e in self.F], self.symbols, self.parameters)

    @cached_property
    def tape(self) -> Tape:
        """F of the free coordinates, of which the held ones are parameters."""
        if len(self.free) == self.m:
            return self.whole
        held = [x for i, x in enumerate(self.symbols) if i not in self.free]
        forces = [sp.factor_terms(self.F[i]) for i in self.free]
        return Tape(forces, [self.symbols[i] for i in self.free], (*self.parameters, *held))

    @cached_property
    def followed(self) -> Tape:
        """F of the free coordinates, as functions of these and of the parameters, which the held ones go with."""
        held = {x: hold for i, (x, hold) in enumerate(zip(self.symbols, self.held, strict=True)) if i not in self.free}
        forces = [sp.factor_terms(self.F[i].subs(held)) for i in self.free]
        return Tape(forces, [*(self.symbols[i] for i in self.free), *self.parameters], ())

    @cached_property
    def is_steady(self) -> bool:
        """True where neither bounds nor held coordinates depend on parameters."""
        steady = (*(bound for place in self.places for bound in place.bounds), *self.held)
        return not any(sp.sympify(e).free_symbols for e in steady)

    def constants(self, parameters, high=None):
        """Return the constants of `tape`, for one array (points,) for each parameter; see `Tape.constants`."""
        held = [h for i, h in enumerate(self.holds(parameters).T) if i not in self.free]
        constants = self.tape.constants([*parameters, *held], None if high is None else [*high, *held])
        return np.array(np.broadcast_to(constants, (parameters[0].size, *constants.shape[1:])))

    def enclosed(self, parameters, low, high):
        """Enclose F and its slopes in boxes (points, m): return shapes (points, m, 1 + m, 2), and states (points,)."""
        constants = self.whole.constants(parameters)
        return self.whole.slopes(constants, np.arange(low.shape[0]), low, high)

    def place_error(self, parameters, place, hidden):
        """Return how far each coordinate of an equilibrium may be from its place, shape (points, m), to first order.

        From an enclosure of F at the place and the slopes there, or as far as rounding has `hidden` it; along a family
        nothing is uncertain.
        """
        values, width = self.enclosed(parameters, place, place)[0], np.ptp(self.bounds(parameters), axis=-1)
        F, J = np.abs(values[:, :, 0]).max(axis=-1), values[:, :, 1:].mean(axis=-1) * width[:, None, :]
        size = np.abs(J).max(axis=2)
        size[size == 0.0] = 1.0
        sound = np.isfinite(J).all(axis=(1, 2)) & np.isfinite(F).all(axis=1)
        inverse = np.abs(np.linalg.pinv(J[sound] / size[sound][:, :, None], rcond=SINGULAR))
        error = np.zeros(place.shape)
        error[sound] = width[sound] * np.einsum("pij,pj->pi", inverse, F[sound] / size[sound])
        return np.maximum(error, hidden)

    @cached_property
    def canonical(self) -> tuple[float | None, ...]:
        """For each parameter that no equilibrium depends on its default, for each other None.

        A factor of F_i that is free of x and never 0 (the mass and the length of a pendulum) moves no root.
        """
        symbols = set()
        for e in self.F:
            factor, rest = _factored(e).as_independent(*self.symbols, as_Add=False)
            symbols |= rest.free_symbols | (set() if factor.is_nonzero else factor.free_symbols)
        for place, hold in zip(self.places, self.held, strict=True):
            symbols |= set().union(*(sp.sympify(e).free_symbols for e in (*place.bounds, hold)))
        for place in self.system.labels.values():
            symbols |= set().union(*(e.free_symbols for e in place.values()))
        return tuple(None if p.symbol in symbols else p.default for p in self.system.parameters.values()) or (0.0,)

    def bounds(self, parameters):
        """Return (low, high) of each coordinate or state, shape (points, m, 2)."""
        return self._spread(self._bounds, parameters).reshape(-1, self.m, 2)

    def holds(self, parameters):
        """Return the values of the coordinates that are held fixed, shape (points, m)."""
        return self._spread(self._holds, parameters)

    def labels(self, parameters):
        """Return the places that the description names, shape (points, labels, m); NaN where there is none."""
        count = len(self.system.labels)
        if not count:
            return np.empty((parameters[0].size, 0, self.m))
        return self._spread(self._labels, parameters).reshape(-1, count, self.m)

    def _spread(self, function, parameters):
        values = function(*parameters[: len(self.parameters)])
        return np.stack([np.broadcast_to(value, parameters[0].size) for value in values], axis=-1)


def changed(f, place, error):
    """Return how much matrices f(place) change where each coordinate of the place is off by its error, to first order.

    Args:
        f: matrices, shape (points, …, n, n), of places.
        place: shape (points, m).
        error: of each coordinate, shape (points, m).
    """
    here = f(place)
    change = np.zeros(here.shape)
    for k in np.flatnonzero((error > 0.0).any(axis=0)):
        aside = place.copy()
        aside[:, k] += APART * error[:, k]
        change += np.nan_to_num(np.abs(f(aside) - here) / APART)
    return change


def magnitude(e: sp.Expr) -> sp.Expr:
    """Return the sum of the absolute values of an expression's terms, with products of sums left as they are.

    It does not become small where terms cancel, and bounds the expression.
    """
    memo: dict = {}

    def of(e):
        if e not in memo:
            if e.is_Add:
                memo[e] = sp.Add(*map(of, e.args))
            elif e.is_Mul:
                memo[e] = sp.Mul(*map(of, e.args))
            elif e.is_Pow and e.exp.is_Integer and e.exp.is_positive:
                memo[e] = of(e.base) ** e.exp
            else:
                memo[e] = sp.Abs(e)
        return memo[e]

    return of(e)


def _factored(e):
    return sp.factor(e) if e.count_ops() < MOST_FACTORED else sp.factor_terms(e)
