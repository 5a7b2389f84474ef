"""The equations F(x) = 0 of a system's equilibria with their slopes, sizes and bounds, for many points."""

from functools import cached_property

import numpy as np
import sympy as sp

from kernels.search.codes import REGULAR
from sweeps.mechanics.equations import Equations
from sweeps.mechanics.graph import compile_expression, compile_table
from sweeps.mechanics.tape import Tape
from sweeps.schema.refusals import DescriptionError

MAX_FACTOR_OPERATIONS = 60  # operations of an expression up to which it is factored: longer expressions take too long
SINGULAR = 1e-9  # singular values below this, relative to the largest, are zeros of a family
CHANGE_SCALE = 1024.0  # errors of a place over which a matrix is differentiated: less would be rounding
MAX_BOX_CUTS = 64  # bisections of a box over the coordinates that a name leaves open
MAX_REMAINING_PARTS = 64  # boxes, per point, beyond which that search is given up as undecided
MEAN_VALUE_ROUNDING = 1e-12  # relative error of a mean value form: a bound on the rounding of its sums and products
MAX_FLAT_CHANGE = 1e-9  # a conserved quantity's change of first order counts as 0 below this, relative to the second


class Landscape:
    """F(x) = 0 of a system: ∂V/∂q, forces at rest or rates, as functions of the coordinates or states x.

    Functions take parameters (a list of arrays), then places (a sequence of m arrays), all of shape (points,), and
    return tables of all points.
    """

    def __init__(self, equations: Equations):
        system, places = equations.system, equations.places
        self.equations, self.system, self.places, self.F = equations, system, places, equations.pulls
        #: True if, of a family of equilibria, the member nearest to a name is used
        self.takes_members = not equations.natural
        self.parameters, self.symbols = equations.parameters, tuple(place.symbol for place in places)
        self.m, self.n = len(places), equations.n
        self.last: tuple = (None, None)  # the last search's points and result
        #: indices of the unknowns: the coordinates without `hold`
        self.free = [i for i, place in enumerate(places) if place.hold is None]
        self.held_values = [0 if place.hold is None else place.hold for place in places]
        #: True for periodic coordinates
        self.periodic = np.array([place.periodic for place in places])
        bounds = [bound for place in places for bound in place.bounds]
        #: range (low, high) of each coordinate or state, (m, 2)
        self.bounds = compile_table(self.parameters, bounds, (self.m, 2))
        #: True if bounds and fixed coordinates do not depend on parameters
        self.is_steady = not any(sp.sympify(e).free_symbols for e in (*bounds, *self.held_values))
        #: values of fixed coordinates, (m,)
        self.holds = compile_table(self.parameters, self.held_values, (self.m,))
        # coordinates without a value in a name begin in the middle of the bounds, or anywhere
        default_place = {place.symbol: sum(place.bounds) / 2 if self.takes_members else sp.nan for place in places}
        names = [(default_place | label)[x] for label in system.labels.values() for x in self.symbols]
        #: places that the description names, NaN where they are not real, (names, m)
        self._named_places = compile_table(self.parameters, names, (len(system.labels), self.m))
        #: True for coordinates to which a name gives a value, shape (names, m)
        is_given = [x in label for label in system.labels.values() for x in self.symbols]
        self.is_given = np.array(is_given, dtype=bool).reshape(-1, self.m)
        if system.follow and system.labels:
            raise DescriptionError("follow: is for equilibria without names; allowed: such a system, or none of it")
        n, self._arguments = self.n, (*self.parameters, *self.symbols)
        #: derivatives of forces or rates by all states and their terms' absolute values, (m, n) each
        self.slopes = self._compile_with_terms(list(equations.slopes), (self.m, n))
        #: kinetic matrix of coordinates, (m, m)
        self.a = equations.v and compile_table(self._arguments, equations.a.subs(equations.still), (self.m, self.m))
        #: third derivatives of V and first derivatives of a, a list of arrays
        self.third = compile_expression(self._arguments, equations.third) if equations.natural else None
        quantities = system.conserved_quantities.values()
        hessians = [e for quantity in quantities for e in sp.hessian(quantity, equations.states)]
        #: derivatives of the conserved quantities and their terms' absolute values: first, (quantities, n) each, and
        #: second, (quantities, n, n) each
        self.gradients = self._compile_with_terms(list(equations.gradients), (len(quantities), n))
        self.curvatures = self._compile_with_terms(hessians, (len(quantities), n, n))
        #: described sizes of coordinates or states, NaN if not described, (m,)
        self.sizes = compile_table(self._arguments, [self._size(place) for place in places], (self.m,))

    def _compile_with_terms(self, expressions, shape):
        """Return the function of the tables of expressions, and of the absolute values of their terms."""
        tables = [compile_table(self._arguments, es, shape) for es in (expressions, [*map(magnitude, expressions)])]
        return lambda parameters, x: tuple(table(parameters, x) for table in tables)

    @cached_property
    def full_tape(self) -> Tape:
        """F by all coordinates or states."""
        return Tape([sp.factor_terms(e) for e in self.F], self.symbols, self.parameters)

    @cached_property
    def tape(self) -> Tape:
        """F of the free coordinates; the fixed coordinates are parameters."""
        return self.full_tape if len(self.free) == self.m else self._tape([self.F[i] for i in self.free])

    @cached_property
    def fractions(self) -> tuple[Tape, Tape]:
        """Numerators and denominators of `tape`; at a zero of a denominator F is undefined or has a pole."""
        forces = [self.F[i].replace(sp.tan, lambda a: sp.sin(a) / sp.cos(a)) for i in self.free]
        pairs = [sp.fraction(sp.together(e)) for e in forces]
        return tuple(self._tape(expressions) for expressions in zip(*pairs, strict=True))

    def _tape(self, expressions):
        held_symbols = [x for i, x in enumerate(self.symbols) if i not in self.free]
        unknowns = [self.symbols[i] for i in self.free]
        return Tape([sp.factor_terms(e) for e in expressions], unknowns, (*self.parameters, *held_symbols))

    @cached_property
    def path_tape(self) -> Tape:
        """F of the free coordinates as a function of these and of the parameters; fixed coordinates are substituted."""
        values = {
            x: hold
            for i, (x, hold) in enumerate(zip(self.symbols, self.held_values, strict=True))
            if i not in self.free
        }
        forces = [sp.factor_terms(self.F[i].subs(values)) for i in self.free]
        return Tape(forces, [*(self.symbols[i] for i in self.free), *self.parameters], ())

    def constants(self, parameters, high=None, tape=None):
        """Return the constants of a tape, shape (points, constants); see `Tape.constants`.

        Args:
            parameters: one array (points,) for each.
            high: upper ends of the parameters' ranges, if `parameters` are the lower ends.
            tape: by default `self.tape`.
        """
        fixed = [h for i, h in enumerate(self.holds(parameters).T) if i not in self.free]
        constants = (tape or self.tape).constants([*parameters, *fixed], None if high is None else [*high, *fixed])
        return np.array(np.broadcast_to(constants, (parameters[0].size, *constants.shape[1:])))

    def enclose(self, parameters, low, high):
        """Return enclosures of F and its slopes in boxes, shape (points, m, 1 + m, 2), and state codes, (points,).

        Args:
            parameters: one array (points,) for each.
            low: lower ends of the boxes, shape (points, m).
            high: upper ends of the boxes.
        """
        constants = self.full_tape.constants(parameters)
        return self.full_tape.slopes(constants, np.arange(low.shape[0]), low, high)

    def place_error(self, parameters, place, uncertainty):
        """Return the error of each coordinate of equilibria, shape (points, m), to first order.

        It is J⁻¹ times an enclosure of F at the place; 0 along a family, and if F is exactly 0.

        Args:
            parameters: one array (points,) for each.
            place: equilibria, shape (points, m).
            uncertainty: the errors are at least these, shape (points, m); see `equilibria.Equilibria`.
        """
        values, width = self.enclose(parameters, place, place)[0], np.ptp(self.bounds(parameters), axis=-1)
        F, J = np.abs(values[:, :, 0]).max(axis=-1), values[:, :, 1:].mean(axis=-1) * width[:, None, :]
        size = np.abs(J).max(axis=2)
        size[size == 0.0] = 1.0
        is_regular = F.any(axis=1) & np.isfinite(J).all(axis=(1, 2)) & np.isfinite(F).all(axis=1)
        inverse = np.abs(np.linalg.pinv(J[is_regular] / size[is_regular][:, :, None], rcond=SINGULAR))
        error = np.zeros(place.shape)
        error[is_regular] = width[is_regular] * np.einsum("pij,pj->pi", inverse, F[is_regular] / size[is_regular])
        return np.maximum(error, uncertainty)

    @cached_property
    def canonical(self) -> tuple[float | None, ...]:
        """The default of each parameter on which no equilibrium depends, None for the other parameters.

        A factor of F_i that is free of x and never 0 (the mass and the length of a pendulum) moves no root. Parameters
        in the bounds of the coordinates, in values at which a coordinate is held, and in the labelled positions count,
        too. A system without parameters has the value (0.0,), so that tables of parameters have a column.
        """
        symbols = set()
        for e in self.F:
            e = sp.factor(e) if e.count_ops() < MAX_FACTOR_OPERATIONS else sp.factor_terms(e)
            factor, dependent = e.as_independent(*self.symbols, as_Add=False)
            symbols |= dependent.free_symbols | (set() if factor.is_nonzero else factor.free_symbols)
        for place, hold in zip(self.places, self.held_values, strict=True):
            symbols |= set().union(*(sp.sympify(e).free_symbols for e in (*place.bounds, hold)))
        for place in self.system.labels.values():
            symbols |= set().union(*(e.free_symbols for e in place.values()))
        return tuple(None if p.symbol in symbols else p.default for p in self.system.parameters.values()) or (0.0,)

    def labels(self, parameters):
        """Return the places that the description names, shape (points, labels, m).

        A place with a coordinate that is not real (the root of a negative number) is NaN.
        """
        places = self._named_places(parameters)
        return np.where((np.isnan(places) & self.is_given).any(axis=-1, keepdims=True), np.nan, places)

    def is_never_zero(self, parameters, name):
        """Return True for points at which F is proved to have no zero with the coordinates of the name of this index.

        Coordinates without a real value in the name may have any value within the bounds: boxes over these are bisected
        until all are excluded by an enclosure of F or by its mean value form.
        """
        place = self._named_places(parameters)[:, name]
        is_given = (self.is_given[name] & np.isfinite(place))[..., None]
        boxes = np.where(is_given, place[..., None], self.bounds(parameters))
        owner, full_width, is_possible = np.arange(len(place)), np.ptp(boxes, axis=-1), np.zeros(len(place), dtype=bool)
        for _ in range(MAX_BOX_CUTS):
            values_of_boxes, middle = [p[owner] for p in parameters], boxes.mean(axis=-1)
            values, states = self.enclose(values_of_boxes, boxes[..., 0], boxes[..., 1])
            F = self.enclose(values_of_boxes, middle, middle)[0][:, :, 0]
            change = (
                np.abs(values[:, :, 1:]).max(axis=-1) @ np.ptp(boxes, axis=-1)[..., None] * (0.5 + MEAN_VALUE_ROUNDING)
            )
            F = F + change * np.array([-1.0, 1.0])
            low, high = np.fmax(F[..., 0], values[:, :, 0, 0]), np.fmin(F[..., 1], values[:, :, 0, 1])
            is_open = ~((low > 0.0) | (high < 0.0)).any(axis=1) | (states != REGULAR)
            is_possible |= np.bincount(owner[is_open], minlength=is_possible.size) > MAX_REMAINING_PARTS
            is_open &= ~is_possible[owner]
            owner, boxes = owner[is_open].repeat(2), boxes[is_open].repeat(2, axis=0)
            if not owner.size:
                break
            axis = (np.ptp(boxes, axis=-1) / np.where(full_width > 0.0, full_width, 1.0)[owner]).argmax(axis=1)
            box_index, is_upper = np.arange(owner.size), np.arange(owner.size) % 2
            boxes[box_index, axis, 1 - is_upper] = boxes[box_index, axis].mean(axis=-1)
        is_possible[owner] = True
        return ~is_possible

    def _size(self, place):
        """Return the perturbation of relative size one; by default a quarter of the bounds, or NaN (see `modes`)."""
        if place.size is not None:
            return place.size
        is_found = self.equations.natural and self.system.given_period is None
        return sp.nan if is_found else (place.bounds[1] - place.bounds[0]) / 4

    def starts(self, parameters):
        """Return the named places, shape (points, names, m); without names one off the middle of the bounds."""
        if self.system.labels:
            return self.labels(parameters)
        bounds = self.bounds(parameters)
        return (bounds[..., 0] + 0.3819660112501051 * (bounds[..., 1] - bounds[..., 0]))[:, None]

    def conserved_slopes(self, parameters, x, sizes):
        """Return the change of conserved quantities over each state's size, and of second order over all sizes.

        Shapes (points, quantities, n) and (points, quantities). A change of first order that is rounding of the second
        order is 0.

        Args:
            parameters: one array (points,) for each.
            x: one array (points,) for each state.
            sizes: of the states, shape (points, n).
        """
        slopes = self.gradients(parameters, x)[0] * sizes[:, None, :]
        second_order = np.einsum("pi,pqij,pj->pq", sizes, self.curvatures(parameters, x)[1], sizes)
        slopes[np.abs(slopes).sum(axis=2) <= MAX_FLAT_CHANGE * second_order] = 0.0
        return slopes, second_order


def matrix_change(f, matrices, place, error):
    """Return the change of matrices within errors of places, shape (points, …, n, n), to first order.

    Args:
        f: places (points, m) → matrices.
        matrices: f(place).
        place: shape (points, m).
        error: errors of the coordinates, shape (points, m).
    """
    change = np.zeros(matrices.shape)
    for k in np.flatnonzero((error > 0.0).any(axis=0)):
        moved_place = place.copy()
        moved_place[:, k] += CHANGE_SCALE * error[:, k]
        change += np.nan_to_num(np.abs(f(moved_place) - matrices) / CHANGE_SCALE)
    return change


def magnitude(e: sp.Expr) -> sp.Expr:
    """Return the sum of the absolute values of an expression's terms, with products of sums not expanded.

    It bounds the expression, and does not become small if terms cancel.
    """
    memo: dict = {}

    def sum_of_magnitudes(e):
        """Return the sum of absolute terms of a part of the expression, computed once."""
        if e not in memo:
            if e.is_Add:
                memo[e] = sp.Add(*map(sum_of_magnitudes, e.args))
            elif e.is_Mul:
                memo[e] = sp.Mul(*map(sum_of_magnitudes, e.args))
            elif e.is_Pow and e.exp.is_Integer and e.exp.is_positive:
                memo[e] = sum_of_magnitudes(e.base) ** e.exp
            else:
                memo[e] = sp.Abs(e)
        return memo[e]

    return sum_of_magnitudes(e)
