"""A potential's landscape: V's derivatives, a_ij and where to look for equilibria, as functions of many points."""

from functools import cached_property

import numpy as np
import sympy as sp

from sweeps.mechanics.derivation import Equations
from sweeps.mechanics.description import DescriptionError
from sweeps.mechanics.graph import lambdified
from sweeps.mechanics.tape import Tape

MOST_FACTORED = 60  # operations


class Landscape:
    """V's derivatives and a_ij of a system as functions of arrays.

    Each takes parameters (a tuple of arrays) and q (a sequence of n arrays), all of one shape.
    """

    def __init__(self, equations: Equations):
        self.equations = equations
        self.n = equations.n
        arguments = (*equations.parameters, *equations.q)
        self._hessian = lambdified(arguments, equations.hessian)
        self._a = lambdified(arguments, equations.a)
        self._third = lambdified(arguments, equations.third)
        self.last: tuple = (None, None)  # the points that were searched last, and what was found
        self._terms = lambdified(arguments, [magnitude(e) for e in equations.hessian])
        coordinates = equations.system.kept
        self._bounds = lambdified(equations.parameters, [b for c in coordinates for b in c.bounds])
        held = [c.hold if c.hold is not None else 0 for c in coordinates]
        self._holds = lambdified(equations.parameters, held)
        labels = equations.system.labels.values()
        nan = sp.nan
        self._labels = lambdified(equations.parameters, [label.get(q, nan) for label in labels for q in equations.q])
        self._sizes = lambdified(arguments, [sp.nan if c.size is None else c.size for c in coordinates])
        self.free = [i for i, c in enumerate(coordinates) if c.hold is None]
        if equations.system.follow and equations.system.labels:
            raise DescriptionError("follow: is for equilibria without names; allowed: such a system, or none of it")

    @cached_property
    def tape(self) -> Tape:
        """∂V/∂q by the free coordinates, of which the held ones are parameters."""
        q = self.equations.q
        held = [x for i, x in enumerate(q) if i not in self.free]
        forces = [sp.factor_terms(self.equations.gradient[i]) for i in self.free]
        return Tape(forces, [q[i] for i in self.free], (*self.equations.parameters, *held))

    @cached_property
    def followed(self) -> Tape:
        """∂V/∂q by the free coordinates, as functions of these and of the parameters, which the held ones go with."""
        coordinates, free = self.equations.system.kept, self.free
        held = {c.symbol: c.hold for c in coordinates if c.hold is not None}
        forces = [sp.factor_terms(self.equations.gradient[i].subs(held)) for i in free]
        return Tape(forces, [*(self.equations.q[i] for i in free), *self.equations.parameters], ())

    @cached_property
    def _force(self):
        q, (i,) = self.equations.q, self.free
        held = [x for k, x in enumerate(q) if k != i]
        e = sp.factor_terms(self.equations.gradient[i])
        return lambdified([*self.equations.parameters, *held, q[i]], [e, self.equations.hessian[i, i]])

    def force(self, fixed, x):
        """∂V/∂q and V″ by the only free coordinate, in plain numbers, of parameters and held coordinates in order."""
        return self._force(*fixed, x)

    @cached_property
    def whole(self) -> Tape:
        """∂V/∂q by all coordinates."""
        forces = [sp.factor_terms(e) for e in self.equations.gradient]
        return Tape(forces, self.equations.q, self.equations.parameters)

    def enclosed(self, parameters, low, high):
        """Enclosures of ∂V/∂q and V″ in boxes (points, n): shape (points, n, 1 + n, 2), and states (points,)."""
        constants = self.whole.constants(parameters)
        return self.whole.slopes(constants, np.arange(low.shape[0]), low, high)

    @cached_property
    def canonical(self) -> tuple[float | None, ...]:
        """For each parameter that no equilibrium depends on its default, for each other None.

        A factor of ∂V/∂q_i that is free of q and never 0 (the mass and the length of a pendulum) moves no root.
        """
        system, places = self.equations.system, set()
        for e in self.equations.gradient:
            factor, rest = _factored(e).as_independent(*self.equations.q, as_Add=False)
            places |= rest.free_symbols | (set() if factor.is_nonzero else factor.free_symbols)
        for c in system.kept:
            places |= set().union(*(e.free_symbols for e in (*c.bounds, c.hold) if e is not None))
        for place in system.labels.values():
            places |= set().union(*(e.free_symbols for e in place.values()))
        return tuple(None if p.symbol in places else p.default for p in system.parameters.values()) or (0.0,)

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

    def bounds(self, parameters):
        """(low, high) of each coordinate, shape (points, n, 2)."""
        return self._spread(self._bounds(*parameters), parameters).reshape(-1, self.n, 2)

    def holds(self, parameters):
        """Values of the coordinates that are held, shape (points, n)."""
        return self._spread(self._holds(*parameters), parameters)

    def labels(self, parameters):
        """Places that the description names, shape (points, labels, n); NaN where there is none."""
        count = len(self.equations.system.labels)
        if not count:
            return np.empty((parameters[0].size, 0, self.n))
        return self._spread(self._labels(*parameters), parameters).reshape(-1, count, self.n)

    @staticmethod
    def _spread(values, parameters):
        return np.stack([np.broadcast_to(value, parameters[0].size) for value in values], axis=-1)


def magnitude(e: sp.Expr) -> sp.Expr:
    """What the terms of an expression amount to: sums of absolute values, products of sums, nothing expanded.

    It stays put where terms cancel, and bounds the expression.
    """
    known: dict = {}

    def of(e):
        if e not in known:
            if e.is_Add:
                known[e] = sp.Add(*map(of, e.args))
            elif e.is_Mul:
                known[e] = sp.Mul(*map(of, e.args))
            elif e.is_Pow and e.exp.is_Integer and e.exp.is_positive:
                known[e] = of(e.base) ** e.exp
            else:
                known[e] = sp.Abs(e)
        return known[e]

    return of(e)


def _factored(e):
    return sp.factor(e) if e.count_ops() < MOST_FACTORED else sp.factor_terms(e)
