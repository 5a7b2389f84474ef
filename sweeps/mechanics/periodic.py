r"""Perturbations of a periodic motion over one period: matrices from perturbed runs, beside the variational flow.

*Base motion.* From the place that a name gives, at rest at the time 0: where the rates vanish there at all times it is
an equilibrium; else Newton's method on the period map finds the motion of the system's period from there on.

*Segments.* A period T is cut into K of equal length, at most TURN/(S + 2 pi/T); S, a bound on every rate along the base
motion, and the states' sizes come from the absolute values of the Jacobian's terms, as those of
`sweeps.mechanics.relative`. So no perturbation grows by more than some times before it is sampled, however large the
multipliers are.

*Measuring.* From the base motion at each segment's start the full equations are followed from both sides in each
direction (from one where the equations are odd or linear), perturbed by epsilon, by the steps of
`sweeps.mechanics.perturbed`, which are halved until they leave out less than the tolerance; `kernels.monodromy` makes
the matrix of the period of them. Unless the derivation proves that the equations are linear, it is measured again,
perturbed by an eighth as much: the difference of both holds what the amplitude changes.

*Certificate.* The variational flow by collocation at Gauss's points, of order 16 (`kernels.variational`), whose slopes
are derivatives of the equations by SymPy: nothing is shared with the generated Taylor steps. It is found again in fewer
steps from another phase, and compared with what the finer steps make of the period that begins there, entry by entry:
steps are halved until the difference is rounding. Where the slopes are proved to be even in the time, half a period
gives the finer one (the coarser one is followed through all of it).

Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.7 and II.9; derived again.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
import sympy as sp

from kernels import floquet, jacobians, monodromy, statuses, variational
from sweeps.mechanics import motions
from sweeps.mechanics.equations import Equations
from sweeps.mechanics.graph import lambdified
from sweeps.mechanics.perturbed import PerturbedCode
from sweeps.mechanics.problem import magnitude

TURN = 2.4  # of 1/(S + 2π/T): no longer segment, in which a perturbation turns by less than a half turn
SEGMENTS = [k * 2**j for j in range(9) for k in (4, 5, 6, 7)]  # that a period may have
STEPS = 3  # in a segment, of the first try
SMALLER = 0.125  # perturbation of the second measurement, relative to the first
APART = 1.1  # of the difference of both: the error of the first, if that of the second is less than a tenth
WIDE = 0.1  # of a matrix, that the amplitude may change
TOGETHER = 32_768  # segments times squares of states: points of one number of segments that are followed side by side
ELSEWHERE = 0.381966  # of a period: where the variational flow begins again
FALLING = 0.25  # of the difference before: else what is left is rounding, or the amplitude's
TWO_PHASES = 1e-6  # of the matrix: traces from two phases that differ by more are none
FINEST = 1 << 14  # steps in a period, at most
STILL = 64 * float(np.finfo(np.float64).eps)  # of the largest rates of motions of the states' sizes: equilibrium
COARSER = 0.1  # of the difference of both flows: the error of the finer, of order 16 and 5/4 times the steps
ROUNDING = 8 * float(np.finfo(np.float64).eps)  # of the certificate
DIFFERENCE, NEWTONS = 1e-6, 16  # of the sizes: what differentiates the period map; steps
FAR = 8.0  # sizes from the named start, where no periodic motion is looked for
EXAMINED, FOURIER, FALLEN = 8, 4096, 1e-9  # points; times in a period; of the largest term: what the last may be
CLOSED = 1e-9  # of the sizes: how far a periodic motion may be from closed


class Variation:
    """Slopes of the rates at any state and phase of the period, in NumPy, and the absolute values of their terms.

    All points share the phases, and the period is put in for the time in symbols: so what depends on the phase alone is
    worked out once for all points.

    Args:
        equations: of the system.
    """

    def __init__(self, equations: Equations):
        self.equations, self.m, self.second = equations, equations.m, bool(equations.v)
        self._phase = sp.Symbol("phase", real=True)
        timed = {equations.system.time: self._phase * equations.system.given_period}
        forces, masses = ([e.subs(timed) for e in some or ()] for some in (equations.forces, equations.a))
        slopes = [e.diff(x) for e in forces for x in equations.states]
        has_one = self.second and self.m == 1
        signed = [(e.subs(equations.still), sign) for e, sign in zip([*slopes, *masses], (1, -1, 1), strict=False)]
        turned = [e - sign * e.subs(self._phase, -self._phase) for e, sign in signed]
        #: where all of these vanish, the slope by the one coordinate is even in the time, and that by its velocity odd
        self.uneven = factors(turned, (*equations.states, self._phase)) if has_one else [sp.Integer(1)]
        self._still = self._written([e.subs(equations.still) for e in [*slopes, *masses]])
        self._moving = self._written([*slopes, *masses, *(e.diff(q) for e in masses for q in equations.q), *forces])
        self._terms = self._written([magnitude(e) for e in slopes])
        turned = {x: -x for x in equations.states}
        signed = [*((e, 1) for e in forces), *((e, -1) for e in masses)]
        self.odd = all(sp.expand(e + sign * e.subs(turned)) == 0 for e, sign in signed)  # the same from the other side

    def _written(self, expressions):
        return lambdified((*self.equations.parameters, *self.equations.states, self._phase), expressions, whole=False)

    def _parts(self, parameters, x, phases, still):
        """Return slopes of the forces, masses, what the masses' slopes add where not still, and accelerations."""
        m, n = range(self.m), range(self.equations.n)
        values = iter((self._still if still else self._moving)(*parameters, *x, phases[:, None]))
        J = [[next(values) for _ in n] for _ in m]
        if not self.second:
            return J, None, [], [*values]
        a = [[next(values) for _ in m] for _ in m]
        if still:
            return J, a, [], []
        bent = [[[next(values) for _ in m] for _ in m] for _ in m]
        rates = [rate for (rate,) in divided(a, [[force] for force in values])]
        return J, a, [[sum(row[j][k] * rates[j] for j in m) for k in m] for row in bent], rates

    def at(self, parameters, x, phases, still) -> tuple[np.ndarray, np.ndarray]:
        """Return the slopes of the accelerations by coordinates and by velocities, or none and those of the rates.

        Args:
            parameters: arrays (points,).
            x: states, arrays (phases, points), or of equilibria (1, points).
            phases: of the period, shape (phases,).
            still: whether all points are at rest.

        Returns:
            Each of shape (m, m, times, points): one time, where all are alike; none, where there are no such slopes.
        """
        m, points = self.m, parameters[0].size
        J, a, bent, _ = self._parts(parameters, x, phases, still)
        if not self.second:
            return np.empty((m, m, 0, points)), stacked(J, points)
        for row, extra in zip(J, bent, strict=not still):
            row[:m] = [y - z for y, z in zip(row, extra, strict=False)]
        J = divided(a, J)
        return stacked([row[:m] for row in J], points), stacked([row[m:] for row in J], points)

    def bounds(self, parameters, x, phases) -> tuple[np.ndarray, np.ndarray]:
        """Return the largest rates (points, n) and absolute values of the Jacobian's terms (points, n, n) at phases."""
        m, n, points = self.m, self.equations.n, parameters[0].size
        _, a, bent, rates = self._parts(parameters, x, phases, False)
        values = iter(self._terms(*parameters, *x, phases[:, None]))
        terms = [[next(values) for _ in range(n)] for _ in range(m)]
        if self.second:
            for row, extra in zip(terms, bent, strict=True):
                row[:m] = [y + np.abs(z) for y, z in zip(row, extra, strict=False)]
            inverse = divided(a, np.eye(m).tolist())
            lower = [[sum(np.abs(y) * terms[j][k] for j, y in enumerate(row)) for k in range(n)] for row in inverse]
            terms, rates = [*np.eye(m, n, m).tolist(), *lower], [*x[m:], *rates]
        largest = np.abs(stacked([[*row, rate] for row, rate in zip(terms, rates, strict=True)], points)).max(axis=2)
        return largest[:, n].T, np.moveaxis(largest[:, :n], 2, 0)


def divided(a, right):
    """Return X of a X = right, matrices of arrays, by elimination without exchange: a is positive definite."""
    a, right = [[*row] for row in a], [[*row] for row in right]
    for k in range(len(a)):
        for i in range(k + 1, len(a)):
            factor = a[i][k] / a[k][k]
            for rows in (a, right):
                rows[i] = [y - factor * x for x, y in zip(rows[k], rows[i], strict=True)]
    for i in reversed(range(len(a))):
        for j in range(i + 1, len(a)):
            right[i] = [y - a[i][j] * x for x, y in zip(right[j], right[i], strict=True)]
        right[i] = [y / a[i][i] for y in right[i]]
    return right


def stacked(rows, points: int) -> np.ndarray:
    """Return a matrix of arrays (times, points), or of one time or point, as one: (rows, columns, times, points)."""
    shape = np.broadcast_shapes((1, points), *(np.shape(x) for row in rows for x in row))
    found = np.empty((len(rows), len(rows[0]), *shape))
    for i, row in enumerate(rows):
        for j, x in enumerate(row):
            found[i, j] = x
    return found


def unpaired(equations: Equations) -> list[sp.Expr]:
    """Return expressions in the parameters: where all vanish, the multipliers are proved to come in pairs of product 1.

    Of coordinates, factors of what velocities and curls have in the forces beside those of T and V: with none, the
    forces Q(q, t) have a potential, and Hamilton's equations are left. Of two states, the divergence.
    """
    if equations.v:
        R = sum(equations.system.dissipation_terms)
        Q = [equations.system.forces.get(q, 0) - sp.diff(R, v) for q, v in zip(equations.q, equations.v, strict=True)]
        curl = [sp.diff(Q[i], equations.q[j]) - sp.diff(Q[j], equations.q[i]) for j in range(len(Q)) for i in range(j)]
        extra = [*(sp.diff(e, v) for e in Q for v in equations.v), *curl]
    elif equations.n == 2:
        extra = [sum(f.diff(x) for f, x in zip(equations.f, equations.q, strict=True))]
    else:
        return [sp.Integer(1)]
    return factors(extra, (*equations.states, equations.system.time))


def factors(expressions, moving) -> list[sp.Expr]:
    """Return what does not move of each term of expressions: where all of it vanishes, so do they."""
    terms = [term for e in expressions for term in sp.Add.make_args(sp.expand(e))]
    return [term.as_independent(*moving, as_Add=False)[0] for term in terms]


def where_zero(equations: Equations, found: list[sp.Expr], parameters: list[np.ndarray]) -> np.ndarray:
    """Return at which points all of some factors vanish."""
    zero = np.ones(parameters[0].size, dtype=bool)
    for factor in lambdified(equations.parameters, found)(*parameters):
        zero &= factor == 0.0
    return zero


class Base:
    """The periodic motions of points, at any time.

    Args:
        model: of the system.
        parameters: arrays (points,).
        slot: number of each point's name.
    """

    def __init__(self, model, parameters, slot):
        self.model, self.parameters, size = model, parameters, slot.size
        (self.period,) = lambdified(model.equations.parameters, [model.system.given_period])(*parameters)
        places = np.take_along_axis(model.landscape.starts(parameters), slot[:, None, None], axis=1)[:, 0]
        self.start = np.zeros((size, model.equations.n))
        self.start[:, : places.shape[1]] = places
        self.closed, self.error = np.zeros(size), np.zeros(size)
        self.still = np.ones(size, dtype=bool)
        self.reciprocal = where_zero(model.equations, unpaired(model.equations), parameters)
        with np.errstate(all="ignore"):
            self.still = self._measure_sizes(places)
            self.even = self.still & where_zero(model.equations, model.variation.uneven, parameters)
            self.mirrored = self.still & model.variation.odd & ~self.start.any(axis=1)
            if not self.still.all():
                model.perturbed(False)
                self._close(np.flatnonzero(~self.still))
                self._measure_sizes(places)

    def _measure_sizes(self, places):
        """Set the states' sizes and the bound S on every rate along the motion; return whether it stays at rest."""
        phases, m = (np.arange(32) + 0.5) / 32, self.model.equations.m
        rates, terms = self.model.variation.bounds(self.parameters, self(phases), phases)
        terms = terms + np.eye(terms.shape[-1]) / self.period[:, None, None]
        sizes = self.model.landscape.sizes(self.parameters, list(places.T))
        if self.model.equations.v:
            ratio = sizes[:, None, :] / sizes[:, :, None]
            rate = np.sqrt((terms[:, m:, :m] * ratio).max(axis=(1, 2)))
            rate = np.maximum(rate, (terms[:, m:, m:] * ratio).max(axis=(1, 2)))
            sizes = np.concatenate([sizes, sizes * rate[:, None]], axis=1)
        self.scale, self.sizes = np.empty(len(sizes)), np.empty(sizes.shape)
        jacobians.scales(np.ascontiguousarray(terms), np.ascontiguousarray(sizes), self.scale, self.sizes)
        return (rates <= STILL * np.einsum("pij,pj->pi", terms, self.sizes)).all(axis=1)

    def _close(self, which):
        """Find the start of the motion that comes back to where it began."""
        n, first = self.model.equations.n, self.start.copy()
        nudges = np.concatenate([np.zeros((1, n)), DIFFERENCE * np.eye(n)])
        for _ in range(NEWTONS):
            sizes, x = self.sizes[which], self.start[which]
            times, least = (np.repeat(y, n + 1, axis=0) for y in (self.period[which, None] * [0.0, 1.0], sizes))
            given, starts = [np.repeat(p[which], n + 1) for p in self.parameters], x[:, None] + nudges * sizes[:, None]
            ends, error, _ = motions.solved(self.model.moving, given, starts.reshape(-1, n), times, 1e-13, least)
            ends = ends[:, 1].reshape(-1, n + 1, n) / sizes[:, None]
            off = ends[:, 0] - x / sizes
            slopes = np.swapaxes(ends[:, 1:] - ends[:, :1], 1, 2) / DIFFERENCE - np.eye(n)
            bad = ~np.isfinite(slopes).all(axis=(1, 2)) | ~(np.abs(x - first[which]) < FAR * sizes).all(axis=1)
            slopes[bad] = np.eye(n)
            inverse, distance = np.linalg.pinv(slopes, rcond=1e-9), np.abs(off).max(axis=1)
            self.closed[which] = np.where(bad, np.inf, distance)
            rounding = (error[:: n + 1, 1] / sizes).max(axis=1)
            self.error[which] = (distance + rounding) * np.abs(inverse).sum(axis=2).max(axis=1)
            going = (distance > rounding) & ~bad
            which = which[going]
            if not which.size:
                break
            step = np.clip(np.einsum("pij,pj->pi", inverse, off), -1.0, 1.0)
            self.start[which] = (x - sizes * step)[going]

    def __call__(self, phases) -> np.ndarray:
        """Return the states at phases of the period, shape (n, phases, points); (n, 1, points) if all are at rest."""
        found = np.ascontiguousarray(self.start.T)[:, None]
        if self.still.all():
            return found
        found, which = np.repeat(found, phases.size, axis=1), np.flatnonzero(~self.still)
        ordered, number = np.unique(phases % 1.0, return_inverse=True)
        given, times = [p[which] for p in self.parameters], self.period[which, None] * np.insert(ordered, 0, 0.0)
        states = motions.solved(self.model.moving, given, self.start[which], times, 1e-13, self.sizes[which])[0]
        found[:, :, which] = np.moveaxis(states[:, 1 + number], 0, 2).swapaxes(0, 1)
        return found

    def chosen(self, which) -> "Base":
        """Return the motions of some points."""
        part = object.__new__(Base)
        part.model, part.parameters = self.model, [p[which] for p in self.parameters]
        for name in ("period", "start", "closed", "error", "still", "even", "mirrored", "scale", "sizes", "reciprocal"):
            setattr(part, name, getattr(self, name)[which])
        return part

    @property
    def code(self) -> PerturbedCode:
        """The generated steps of the perturbed motion: all points have to be at rest, or all not."""
        return self.model.perturbed(bool(self.still[0]))

    @property
    def has_minors(self) -> bool:
        """Return whether smooth invariants stand on minors of two rows where multipliers are large."""
        return self.sizes.shape[1] == (4 if self.reciprocal[0] else 2)

    @cached_property
    def number(self) -> np.ndarray:
        """Number of segments of a period; 0 where there are too many, and where no motion is closed."""
        needed = np.ceil((self.period * self.scale + 2.0 * np.pi) / TURN)
        at = np.searchsorted(SEGMENTS, np.where(np.isfinite(needed) & (self.closed <= CLOSED), needed, np.inf))
        return np.array([*SEGMENTS, 0])[at]


class Monodromy(NamedTuple):
    """Matrices of points in the states' sizes, and what they are known by; see `kernels.monodromy`.

    Attributes:
        matrix, other, noise: Of the period; of the period that begins later; errors. Shapes (points, n, n).
        turns: Whole half turns of the first direction.
        minors: Trace of the second compound and its error, shape (2, points); NaN where no entry is large.
        last: Integral of the trace of the equations, or what steps left out.
    """

    matrix: np.ndarray
    other: np.ndarray
    noise: np.ndarray
    turns: np.ndarray
    minors: np.ndarray
    last: np.ndarray

    @classmethod
    def of(cls, told, n) -> "Monodromy":
        """Return what rows (3 n n + 4, points) hold."""
        matrix, other, noise = np.moveaxis(told[:-4].reshape(3, n, n, -1), 3, 1)
        is_large = np.abs(matrix).max(axis=(1, 2)) > monodromy.LARGE
        return cls(matrix, other, noise, told[-4], np.where(is_large, told[-3:-1], np.nan), told[-1])


def first_steps(base: Base) -> int:
    """Return the steps of a period that the variational flow tries first, an even number: four for three segments."""
    return 2 * (5 * int(base.number[0]) // 8 + 1)


def varied(base: Base, steps: int, later: int = 1, begin: float = 0.0) -> Monodromy:
    """Return the variational flow over a period; see `kernels.variational`.

    Args:
        base: of points of one kind.
        steps: of the period: an even number.
        later: step at which the other period begins.
        begin: phase of the period where the first one begins.
    """
    n, half = base.sizes.shape[1], bool(base.even[0]) and begin == 0.0
    phases = begin + (np.arange(steps // 2 if half else steps)[:, None] + variational.POINTS).ravel() / steps
    numbers, told = np.array([steps, later, half, base.has_minors]), []
    for first in range(0, base.period.size, max(1, TOGETHER // steps)):
        part = base.chosen(slice(first, first + max(1, TOGETHER // steps)))
        k, c = part.model.variation.at(part.parameters, part(phases), phases, bool(part.still.all()))
        told.append(np.empty((3 * n * n + 4, part.period.size)))
        variational.flow(k, c, part.period / steps, np.ascontiguousarray(part.sizes.T), numbers, told[-1])
    return Monodromy.of(np.hstack(told), n)


def followed(base: Base, epsilon: np.ndarray, steps: int) -> Monodromy:
    """Return what perturbed motions make of the segments.

    Args:
        base: of points of one kind.
        epsilon: size of the perturbation, relative to the states' sizes, shape (points,).
        steps: in each segment.
    """
    n, K, code = base.sizes.shape[1], int(base.number[0]), base.code
    sides = np.array([1.0] if code.linear or base.mirrored[0] else [1.0, -1.0])
    phases = np.arange(K if code.is_mixed else 1) / K
    place, sizes = [*base(phases), base.period * phases[:, None]], np.ascontiguousarray(base.sizes.T)
    x = (sides[:, None, None, None] * np.eye(n)[:, :, None] * sizes).reshape(-1, n, base.period.size)
    rows, columns = code.starts(base.parameters, place, epsilon, base.period / (K * steps), x)
    numbers = np.array([K, steps, code.scratch, code.perturbed["x", 0], code.perturbed["e", 0], base.has_minors])
    told = np.empty((3 * n * n + 4, base.period.size))
    monodromy.measure(code.module().advance, rows, columns, sizes, n * base.error / epsilon, numbers, told)
    return Monodromy.of(told, n)


def measured(base: Base, epsilon: np.ndarray, tolerance: float) -> tuple[np.ndarray, ...]:
    """Return measured matrices in the states' sizes, errors, half turns, minors, if epsilon or the steps are too large.

    Args:
        base: of points of one kind.
        epsilon: size of the perturbation, relative to the states' sizes, shape (points,).
        tolerance: what steps may leave out, relative to the segments' matrices: they are halved until it is met.
    """
    points, n = base.sizes.shape
    matrix, error, wide = np.empty((points, n, n)), np.empty((points, n, n)), np.zeros(points, dtype=bool)
    turns, minors = np.empty(points), np.empty((2, points))
    left, steps = np.arange(points), STEPS
    while left.size:
        part, size = base.chosen(left), epsilon[left]
        found = followed(part, size, steps)
        matrix[left], error[left], turns[left] = found.matrix, monodromy.NOISE * found.noise, found.turns
        minors[:, left] = found.minors * [[1.0], [2.0 * monodromy.NOISE]]
        if not part.code.linear:
            smaller = followed(part, SMALLER * size, steps)
            apart = np.abs(found.matrix - smaller.matrix)
            error[left] += APART * apart
            minors[1, left] += APART * np.abs(found.minors[0] - smaller.minors[0])
            wide[left] = apart.max(axis=(1, 2)) > WIDE * np.abs(found.matrix).max(axis=(1, 2))
        going = ~((found.last <= tolerance) & np.isfinite(found.matrix).all(axis=(1, 2)))
        left, steps = left[going], 2 * steps
        if steps * int(base.number[0]) > FINEST:
            break
    unresolved = np.isin(np.arange(points), left)
    return matrix, error, turns, minors, wide, unresolved


def certified(base: Base) -> tuple[np.ndarray, ...]:
    """Return the variational flow's matrix, its error, the difference of traces, det, half turns and minors."""
    points, n = base.sizes.shape
    matrix, exact, elsewhere = np.full((points, n, n), np.nan), np.full((points, n, n), np.nan), np.full(points, np.nan)
    determinant, turns, minors = np.ones(points), np.zeros(points), np.empty((2, points))
    left, steps, last = np.arange(points), first_steps(base), np.full(points, np.inf)
    while left.size and steps <= FINEST:
        part, later = base.chosen(left), round(ELSEWHERE * steps)
        found = varied(part, steps, later)
        coarser = varied(part, 4 * steps // 5, 1, later / steps)
        matrix[left], turns[left], determinant[left] = found.matrix, found.turns, np.exp(found.last)
        elsewhere[left] = np.abs(np.trace(found.matrix - coarser.matrix, axis1=1, axis2=2))
        apart = COARSER * np.abs(found.other - coarser.matrix).max(axis=(1, 2))
        exact[left] = ROUNDING * found.noise + apart[:, None, None]
        minors[0, left] = found.minors[0]
        minors[1, left] = 2.0 * ROUNDING * found.minors[1] + np.abs(found.minors[0] - coarser.minors[0])
        rounded = (apart >= FALLING * last[left]) & (apart <= TWO_PHASES * np.abs(found.matrix).max(axis=(1, 2)))
        going = ~(apart <= ROUNDING * found.noise.max(axis=(1, 2))) & ~rounded
        last[left] = apart
        left, steps = left[going], 2 * steps
    return matrix, exact, elsewhere, determinant, turns, minors


def survey(model, points, tolerance: float) -> dict[str, np.ndarray]:
    """Return all columns of points (each parameter, `epsilon`, `equilibrium`: number of the name)."""
    slot = np.asarray(points["equilibrium"])
    base = Base(model, model.parameters(points, slot.size), slot)
    epsilon, columns = np.asarray(points["epsilon"], dtype=np.float64), {}
    kinds = 16 * base.number + 8 * base.even + 4 * base.reciprocal + 2 * base.still + base.mirrored
    for key in np.unique(kinds):
        which = np.flatnonzero(kinds == key)
        size = max(1, TOGETHER // (max(1, base.number[which[0]]) * base.sizes.shape[1] ** 2))
        for first in range(0, which.size, size):
            part = which[first : first + size]
            with np.errstate(all="ignore"):
                found = _columns(base.chosen(part), epsilon[part], tolerance)
            for name, values in found.items():
                fill = np.nan if values.dtype == float else 0
                columns.setdefault(name, np.full((slot.size, *values.shape[1:]), fill, values.dtype))[part] = values
    starts = {f"{x.name}_start": base.start[:, i] for i, x in enumerate(model.equations.states)}
    return columns | starts | {"base_residual": base.closed, "steps": base.number.astype(np.int32)}


def refusal(model, parameters) -> str:
    """Return why none of these points has a periodic motion to measure; nothing if one has."""
    found = []
    for slot in range(len(model.system.labels)):
        with np.errstate(all="ignore"):
            base = Base(model, parameters, np.full(parameters[0].size, slot))
        if not (base.period > 0.0).any():
            return f"period: {model.system.given_period} is {base.period[0]:.6g} s; allowed: a finite time > 0"
        found.append(((base.closed <= CLOSED).any(), (base.number > 0).any()))
    if not any(closed for closed, _ in found):
        names = ", ".join(model.system.labels)
        return (
            f"base motion: none of the system's period begins near {names} (Newton's method on the period map does not "
            "close it); allowed: an equilibrium at all times, or a start near a periodic motion"
        )
    if not any(bounded for _, bounded in found):
        return "coefficients: not finite, or too fast for the period; allowed: smooth, bounded functions of the time"
    if is_jagged(base):
        return "coefficients: they jump, have a kink or a pole; allowed: smooth, bounded functions of the time"
    return ""


def is_jagged(base: Base) -> bool:
    """Return True if at none of some points the Fourier series of the coefficients at the named start falls off."""
    some, phases = base.chosen(slice(EXAMINED)), np.arange(FOURIER) / FOURIER
    with np.errstate(all="ignore"):
        both = some.model.variation.at(some.parameters, some.start.T[:, None], phases, False)
        whole = [np.broadcast_to(x, (*x.shape[:2], FOURIER, x.shape[3])) for x in both if x.size]
        terms = np.abs(np.fft.rfft(np.concatenate(whole), axis=2))
    most = terms.max(axis=(0, 1, 2))
    return not (terms[:, :, FOURIER // 4 :].max(axis=(0, 1, 2)) <= FALLEN * most).any()


def _columns(base, epsilon, tolerance):
    """Columns of points with one number of segments."""
    (points, n), reciprocal = base.sizes.shape, bool(base.reciprocal[0])
    matrix, error, linear, exact = (np.full((points, n, n), np.nan) for _ in range(4))
    elsewhere, wide, determinant, more = np.full(points, np.nan), np.zeros(points, dtype=bool), 1.0, (None, None)
    unresolved = wide
    if base.number[0]:
        matrix, error, turns, minors, wide, unresolved = measured(base, epsilon, tolerance)
        linear, exact, elsewhere, determinant, other_turns, other_minors = certified(base)
        linear[elsewhere > TWO_PHASES * np.abs(linear).max(axis=(1, 2))] = np.nan
        more = [[turns, *minors], [other_turns, *other_minors]]
        more = [np.array(x[1:] if n == 4 else x if np.isfinite(x[1]).any() else x[:1]) for x in more]
        more = [None if n == 4 and np.isnan(x).all() else x for x in more]
    matrix[wide] = np.nan
    columns, agree = floquet.compared(
        floquet.Matrices(matrix, error, linear, exact, elsewhere, *more), base.period, reciprocal, determinant
    )
    sound = np.isfinite(matrix + error).all(axis=(1, 2))
    cases = [~(base.closed <= CLOSED), base.number == 0, wide, unresolved, ~sound, ~agree]
    kinds = [
        "NO_PERIODIC_MOTION",
        "NOT_CONVERGED",
        "PERTURBATION_TOO_LARGE",
        "NOT_CONVERGED",
        "NON_FINITE",
        "NOT_CONVERGED",
    ]
    status = np.select(cases, [getattr(statuses, name) for name in kinds], statuses.OK)
    return columns | {"status": status.astype(np.int8)}
