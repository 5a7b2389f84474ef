"""The equations F(x) = 0 of a system's equilibria with their slopes, sizes and bounds, for many points."""

from functools import cached_property

import numpy as np
import sympy as sp

from kernels.codes import SOUND
from sweeps.mechanics.equations import Equations
from sweeps.mechanics.graph import lambdified
from sweeps.mechanics.tape import Tape
from sweeps.schema.refusals import DescriptionError

MOST_FACTORED = 60  # operations
SINGULAR = 1e-9  # singular values below it, relative, are a family's
APART = 1024.0  # errors of a place, over which a matrix is taken to change evenly
MAX_BOX_CUTS = 64  # bisections of a box over the coordinates that a name leaves open
MAX_REMAINING_PARTS = 64  # parts of that box, per point, beyond which the search is given up as undecided
MEAN_VALUE_ROUNDING = 1e-12  # relative error of a mean value form: a bound on the rounding of its sums and products
FLAT = 1e-9  # of what a conserved quantity changes in second order: less is no slope


class Landscape:
    """F(x) = 0 of a system: ∂V/∂q, forces at rest or rates, as functions of the coordinates or states x.

    Functions of arrays take parameters (a list of arrays), then places (a sequence of m arrays), all of one shape
    (points,).
    """

    def __init__(self, equations: Equations):
        system, places = equations.system, equations.places
        self.equations, self.system, self.places, self.F = equations, system, places, equations.pulls
        #: whether the member nearest to a name is taken where equilibria form a family
        self.takes_members = not equations.natural
        self.parameters, self.symbols = equations.parameters, tuple(place.symbol for place in places)
        self.m, self.n = len(places), equations.n
        self.last: tuple = (None, None)  # the points that were searched last, and what was found
        #: numbers of the unknowns: of the coordinates that are not held
        self.free = [i for i, place in enumerate(places) if place.hold is None]
        self.held = [0 if place.hold is None else place.hold for place in places]
        #: which of the coordinates close on themselves
        self.periodic = np.array([place.periodic for place in places])
        bounds = [bound for place in places for bound in place.bounds]
        self._bounds = lambdified(self.parameters, bounds)
        #: whether neither bounds nor held coordinates depend on parameters
        self.is_steady = not any(sp.sympify(e).free_symbols for e in (*bounds, *self.held))
        self._holds = lambdified(self.parameters, self.held)
        # what a name leaves out begins amid the bounds, or anywhere
        unnamed = {place.symbol: sum(place.bounds) / 2 if self.takes_members else sp.nan for place in places}
        names = [(unnamed | label)[x] for label in system.labels.values() for x in self.symbols]
        self._labels = lambdified(self.parameters, [sp.sympify(name) for name in names])
        #: which coordinates each name gives, shape (names, m)
        gives = [x in label for label in system.labels.values() for x in self.symbols]
        self.gives = np.array(gives, dtype=bool).reshape(-1, self.m)
        if system.follow and system.labels:
            raise DescriptionError("follow: is for equilibria without names; allowed: such a system, or none of it")
        slopes, self._arguments = list(equations.slopes), (*self.parameters, *self.symbols)
        self._slopes, self._terms = self._written(slopes), self._written([magnitude(e) for e in slopes])
        self._a = self._written(equations.a.subs(equations.still)) if equations.v else None
        #: third derivatives of V and first ones of a, a list of arrays
        self.third = lambdified(self._arguments, equations.third) if equations.natural else None
        quantities, gradients = system.conserved_quantities.values(), list(equations.gradients)
        bends = [e for quantity in quantities for e in sp.hessian(quantity, equations.states)]
        self._gradients = [self._written(es) for es in (gradients, map(magnitude, gradients))]
        self._curvatures, self._bends = (self._written(es) for es in (bends, map(magnitude, bends)))
        self._sizes = self._written([self._size(place) for place in equations.places])

    @cached_property
    def whole(self) -> Tape:
        """F by all coordinates or states."""
        return Tape([sp.factor_terms(e) for e in self.F], self.symbols, self.parameters)

    @cached_property
    def tape(self) -> Tape:
        """F of the free coordinates, of which the held ones are parameters."""
        return self.whole if len(self.free) == self.m else self._tape([self.F[i] for i in self.free])

    @cached_property
    def fractions(self) -> tuple[Tape, Tape]:
        """Numerators and denominators of `tape`: where a denominator vanishes, F is not defined or has a pole."""
        forces = [self.F[i].replace(sp.tan, lambda a: sp.sin(a) / sp.cos(a)) for i in self.free]
        pairs = [sp.fraction(sp.together(e)) for e in forces]
        return tuple(self._tape(parts) for parts in zip(*pairs, strict=True))

    def _tape(self, expressions):
        held = [x for i, x in enumerate(self.symbols) if i not in self.free]
        unknowns = [self.symbols[i] for i in self.free]
        return Tape([sp.factor_terms(e) for e in expressions], unknowns, (*self.parameters, *held))

    @cached_property
    def followed(self) -> Tape:
        """F of the free coordinates, as functions of these and of the parameters, which the held ones go with."""
        held = {x: hold for i, (x, hold) in enumerate(zip(self.symbols, self.held, strict=True)) if i not in self.free}
        forces = [sp.factor_terms(self.F[i].subs(held)) for i in self.free]
        return Tape(forces, [*(self.symbols[i] for i in self.free), *self.parameters], ())

    def constants(self, parameters, high=None, tape=None):
        """Return the constants of a tape, by default `tape`, for one array (points,) each; see `Tape.constants`."""
        held = [h for i, h in enumerate(self.holds(parameters).T) if i not in self.free]
        constants = (tape or self.tape).constants([*parameters, *held], None if high is None else [*high, *held])
        return np.array(np.broadcast_to(constants, (parameters[0].size, *constants.shape[1:])))

    def enclosed(self, parameters, low, high):
        """Enclose F and its slopes in boxes (points, m): return shapes (points, m, 1 + m, 2), and states (points,)."""
        constants = self.whole.constants(parameters)
        return self.whole.slopes(constants, np.arange(low.shape[0]), low, high)

    def place_error(self, parameters, place, hidden):
        """Return how far each coordinate of an equilibrium may be from its place, shape (points, m), to first order.

        From an enclosure of F at the place and the slopes there, or as far as rounding has `hidden` it; along a family
        nothing is uncertain, nor where F is exactly 0.
        """
        values, width = self.enclosed(parameters, place, place)[0], np.ptp(self.bounds(parameters), axis=-1)
        F, J = np.abs(values[:, :, 0]).max(axis=-1), values[:, :, 1:].mean(axis=-1) * width[:, None, :]
        size = np.abs(J).max(axis=2)
        size[size == 0.0] = 1.0
        sound = F.any(axis=1) & np.isfinite(J).all(axis=(1, 2)) & np.isfinite(F).all(axis=1)
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
            e = sp.factor(e) if e.count_ops() < MOST_FACTORED else sp.factor_terms(e)
            factor, rest = e.as_independent(*self.symbols, as_Add=False)
            symbols |= rest.free_symbols | (set() if factor.is_nonzero else factor.free_symbols)
        for place, hold in zip(self.places, self.held, strict=True):
            symbols |= set().union(*(sp.sympify(e).free_symbols for e in (*place.bounds, hold)))
        for place in self.system.labels.values():
            symbols |= set().union(*(e.free_symbols for e in place.values()))
        return tuple(None if p.symbol in symbols else p.default for p in self.system.parameters.values()) or (0.0,)

    def bounds(self, parameters):
        """Return (low, high) of each coordinate or state, shape (points, m, 2)."""
        return self._shaped(self._bounds, (self.m, 2), parameters)

    def holds(self, parameters):
        """Return the values of the coordinates that are held fixed, shape (points, m)."""
        return self._shaped(self._holds, (self.m,), parameters)

    def labels(self, parameters):
        """Return the places that the description names, shape (points, labels, m); NaN where there is none.

        A place with a coordinate that is not real (the root of a negative number) is none.
        """
        places = self._shaped(self._labels, (-1, self.m), parameters)
        return np.where((np.isnan(places) & self.gives).any(axis=-1, keepdims=True), np.nan, places)

    def is_never_zero(self, parameters, name):
        """Return True for points at which F is proved to have no zero with the coordinates that a name gives.

        Coordinates that the name leaves out, or that are not real, are anywhere within the bounds: boxes over them are
        cut in two until all are excluded, by an enclosure of F or by its mean value form.
        """
        place = self._shaped(self._labels, (-1, self.m), parameters)[:, name]
        given = (self.gives[name] & np.isfinite(place))[..., None]
        boxes = np.where(given, place[..., None], self.bounds(parameters))
        owner, full, possible = np.arange(len(place)), np.ptp(boxes, axis=-1), np.zeros(len(place), dtype=bool)
        for _ in range(MAX_BOX_CUTS):
            chosen, middle = [p[owner] for p in parameters], boxes.mean(axis=-1)
            values, states = self.enclosed(chosen, boxes[..., 0], boxes[..., 1])
            F = self.enclosed(chosen, middle, middle)[0][:, :, 0]
            reach = (
                np.abs(values[:, :, 1:]).max(axis=-1) @ np.ptp(boxes, axis=-1)[..., None] * (0.5 + MEAN_VALUE_ROUNDING)
            )
            F = F + reach * np.array([-1.0, 1.0])
            low, high = np.fmax(F[..., 0], values[:, :, 0, 0]), np.fmin(F[..., 1], values[:, :, 0, 1])
            kept = ~((low > 0.0) | (high < 0.0)).any(axis=1) | (states != SOUND)
            possible |= np.bincount(owner[kept], minlength=possible.size) > MAX_REMAINING_PARTS
            kept &= ~possible[owner]
            owner, boxes = owner[kept].repeat(2), boxes[kept].repeat(2, axis=0)
            if not owner.size:
                break
            axis = (np.ptp(boxes, axis=-1) / np.where(full > 0.0, full, 1.0)[owner]).argmax(axis=1)
            each, upper = np.arange(owner.size), np.arange(owner.size) % 2
            boxes[each, axis, 1 - upper] = boxes[each, axis].mean(axis=-1)
        possible[owner] = True
        return ~possible

    def _written(self, expressions):
        return lambdified(self._arguments, expressions, whole=False)

    def _size(self, place):
        """Return a perturbation of relative size one; by default a quarter of the bounds, or NaN (see `modes`)."""
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

    def gradients(self, parameters, x):
        """Return the derivatives of the conserved quantities and their terms' absolute values: (points, q, n)."""
        return [self._shaped(f, (-1, self.n), parameters, x) for f in self._gradients]

    def conserved_slopes(self, parameters, x, sizes):
        """Return the changes of conserved quantities along each state's size, and in second order along all sizes.

        Shapes (points, quantities, n) and (points, quantities). Where all that is left of a slope is a rounding of the
        change in second order, it is 0.
        """
        slopes = self.gradients(parameters, x)[0] * sizes[:, None, :]
        bent = np.einsum("pi,pqij,pj->pq", sizes, self.bends(parameters, x), sizes)
        slopes[np.abs(slopes).sum(axis=2) <= FLAT * bent] = 0.0
        return slopes, bent

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
    def _shaped(function, shape, parameters, x=()):
        values, points = function(*parameters, *x), parameters[0].size
        whole, count = np.empty((points, len(values))), len(values) // int(np.prod([abs(k) for k in shape]))
        for k, value in enumerate(values):
            whole[:, k] = value
        return whole.reshape(points, *(count if k < 0 else k for k in shape))


def matrix_change(f, here, place, error):
    """Return how much matrices f(place) = here, shape (points, …, n, n), change where a place is off, to first order.

    Each coordinate of a place has its own error: both have the shape (points, m).
    """
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
