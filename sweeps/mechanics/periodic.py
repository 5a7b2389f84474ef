r"""Perturbations of a periodic motion over one period: matrices from perturbed runs, beside the variational flow.

*Base motion.* From the place that a name gives, at rest at the time 0: where the rates vanish there at all times it is
an equilibrium; else Newton's method on the period map finds the motion of the system's period from there on.

*Segments.* A period T is cut into K of equal length, at most TURN/S; S, a bound on every rate along the base motion,
and the states' sizes come from the absolute values of the Jacobian's terms, as those of `sweeps.mechanics.relative`. So
no perturbation grows by more than a few times before it is sampled, however large the multipliers are.

*Measuring.* From the base motion at each segment's start the full equations are followed from both sides in each
direction (from one where the equations are odd or linear), perturbed by epsilon, by the steps of
`sweeps.mechanics.perturbed`; half the difference of both sides is a column of the segment's matrix, and the matrix of
the period is the product. It is measured again, perturbed by an eighth as much and in steps shorter by a third: the
difference of both holds what the amplitude and the steps change, and rounding is bounded by what grows of it.

*Certificate.* The variational flow by collocation at Gauss's points, of order 16 (`kernels.variational`), whose slopes
are derivatives of the equations by SymPy: nothing is shared with the generated Taylor steps. It is found again in fewer
steps from another phase, and compared with what the finer steps make of the period that begins there, entry by entry:
steps are halved until the difference is rounding.

Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.7 and II.9; derived again.
"""

from functools import cached_property

import numpy as np
import sympy as sp

from kernels import floquet, jacobians, statuses, variational
from kernels.runs import advance_table
from sweeps.mechanics import motions
from sweeps.mechanics.equations import Equations
from sweeps.mechanics.graph import lambdified
from sweeps.mechanics.perturbed import PerturbedCode
from sweeps.mechanics.problem import magnitude

TURN = 2.0  # of 1/S: no longer segment, in which a perturbation turns by less than a half turn
SEGMENTS = [k * 2**j for j in range(1, 10) for k in (2, 3)]  # that a period may have
STEPS, MOST_STEPS = 3, 192  # in a segment: of the first try, and at most
SMALLER, FINER = 0.125, 4 / 3  # perturbation and steps of the second measurement, relative to the first
APART = 1.1  # of the difference of both: the error of the first, if that of the second is less than a tenth
WIDE = 0.1  # of a matrix, that the amplitude may change
TOGETHER = 32_768  # segments times squares of states: points of one number of segments that are followed side by side
ELSEWHERE = 0.381966  # of a period: where the variational flow begins again
FALLING = 0.25  # of the difference before: else what is left is rounding, or the amplitude's
TWO_PHASES = 1e-6  # of the matrix: traces from two phases that differ by more are none
FINEST = 32  # times the segments, that the variational flow may need
STILL = 64 * float(np.finfo(np.float64).eps)  # of the largest rates of motions of the states' sizes: equilibrium
COARSER = 0.2  # of the difference of both flows: the error of the finer, of order 16 and 4/3 to 3/2 times the steps
ROUNDING = 8 * float(np.finfo(np.float64).eps)  # of the certificate
NOISE = 6 * float(np.finfo(np.float64).eps)  # of a measured segment
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


def product(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return products of the steps' matrices, shape (points, steps, n, n): of all, of those before, of those after."""
    before, after = np.empty(matrices.shape), np.empty(matrices.shape)
    variational.chain(np.ascontiguousarray(matrices), before, after)
    return matrices[:, -1] @ before[:, -1], before, after


def multiplied(*factors: np.ndarray) -> np.ndarray:
    """Return the product of small matrices, of four dimensions."""
    found = np.ascontiguousarray(factors[0])
    for factor in factors[1:]:
        left, found = found, np.empty((*found.shape[:3], factor.shape[3]))
        variational.multiply(left, np.ascontiguousarray(factor), found)
    return found


def compound(A: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the second compounds of matrices (points, steps, n, n), their minors of two rows, and those' terms' sizes.

    The compound of a product is the product of the compounds. Its trace is the determinant (n = 2), or the second
    invariant (n = 4): so these keep all their digits where products of the whole matrix's entries would cancel.
    """
    i, j = np.triu_indices(A.shape[-1], 1)
    one, other = A[..., i[:, None], i] * A[..., j[:, None], j], A[..., i[:, None], j] * A[..., j[:, None], i]
    return one - other, np.abs(one) + np.abs(other)


def minors_trace(segments: np.ndarray, others: np.ndarray, rounding: float) -> np.ndarray:
    """Return the trace of the second compound of the product of segments, and its error, shape (2, points).

    Args:
        segments: shape (points, steps, n, n).
        others: found in another way.
        rounding: of a segment, relative.
    """
    (found, sizes), (theirs, _) = compound(segments), compound(others)
    whole, before, after = product(found)
    b = np.trace(whole, axis1=1, axis2=2)
    apart = np.abs(b - np.trace(product(theirs)[0], axis1=1, axis2=2))
    grown = np.einsum("pkii->p", multiplied(np.abs(after), sizes, np.abs(before)))
    return np.array([b, APART * apart + 2.0 * rounding * grown])


def half_turns(matrices: np.ndarray) -> np.ndarray | None:
    """Return whole half turns of a perturbation in the steps, of two states, of a rate's sign from rate to state."""
    if matrices.shape[-1] != 2:
        return None
    before = product(matrices)[1]
    a, b = before[..., 0], multiplied(matrices, before)[..., 0]
    turned = np.arctan2(a[..., 1] * b[..., 0] - a[..., 0] * b[..., 1], (a * b).sum(axis=-1)).sum(axis=1)
    return np.floor(turned / np.pi)


def unpaired(equations: Equations) -> list[sp.Expr]:
    """Return expressions in the parameters: where all vanish, the multipliers are proved to come in pairs of product 1.

    Of coordinates, factors of all that is not of T and V: Hamilton's equations are left. Of two states, the divergence.
    """
    if equations.v:
        extra, moving = [*equations.system.dissipation_terms, *equations.system.forces.values()], equations.states
    elif equations.n == 2:
        extra, moving = [sum(f.diff(x) for f, x in zip(equations.f, equations.q, strict=True))], equations.states
    else:
        return [sp.Integer(1)]
    terms = [term for e in extra for term in sp.Add.make_args(sp.expand(e))]
    return [term.as_independent(*moving, equations.system.time, as_Add=False)[0] for term in terms]


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
        self.still, self.reciprocal = np.ones(size, dtype=bool), np.ones(size, dtype=bool)
        for factor in lambdified(model.equations.parameters, unpaired(model.equations))(*parameters):
            self.reciprocal &= factor == 0.0
        with np.errstate(all="ignore"):
            self.still = self._measure_sizes(places)
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
        for name in ("period", "start", "closed", "error", "still", "mirrored", "scale", "sizes", "reciprocal"):
            setattr(part, name, getattr(self, name)[which])
        return part

    @property
    def code(self) -> PerturbedCode:
        """The generated steps of the perturbed motion: all points have to be at rest, or all not."""
        return self.model.perturbed(bool(self.still[0]))

    @cached_property
    def number(self) -> np.ndarray:
        """Number of segments of a period; 0 where there are too many, and where no motion is closed."""
        needed = np.ceil(self.period * self.scale / TURN)
        at = np.searchsorted(SEGMENTS, np.where(np.isfinite(needed) & (self.closed <= CLOSED), needed, np.inf))
        return np.array([*SEGMENTS, 0])[at]


def varied(base: Base, steps: int, later: int = 1, begin: float = 0.0, share: float = 1.0) -> tuple[np.ndarray, ...]:
    """Return the variational flow over a period, or a part of it, in the states' sizes; see `kernels.variational`.

    Args:
        base: of points of one kind.
        steps: of the period or part.
        later: step at which the other period begins.
        begin: phase of the period where the first one, or the part, begins.
        share: of the period that the part is.

    Returns:
        Matrices of both periods (points, n, n); what one rounding in each step makes in the first; determinants, by
        Liouville; half turns.
    """
    points, n = base.sizes.shape
    phases = begin + share * (np.arange(steps)[:, None] + variational.POINTS).ravel() / steps
    k, c = base.model.variation.at(base.parameters, base(phases), phases, bool(base.still.all()))
    found = np.empty((3 * n * n + 2, points))
    variational.flow(k, c, base.period * (share / steps), np.ascontiguousarray(base.sizes.T), steps, later, found)
    matrix, other, squares = np.moveaxis(found[:-2].reshape(3, n, n, points), 3, 1)
    return matrix, other, np.sqrt(squares), np.exp(found[-2]), found[-1]


def followed(base: Base, epsilon: np.ndarray, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the segments' matrices in the states' sizes, shape (points, segments, n, n), and how far sides differ.

    Args:
        base: of points of one kind.
        epsilon: size of the perturbation, relative to the states' sizes, shape (points,).
        steps: in each segment.
    """
    points, K, n, code = base.period.size, int(base.number[0]), base.sizes.shape[1], base.code
    sides = np.array([1.0] if code.linear or base.mirrored[0] else [1.0, -1.0])
    phases = np.arange(K) / K
    shape = points, K, sides.size, n  # of runs: point, segment, side, direction
    place = [y[..., None, None] for y in (*base(phases).swapaxes(1, 2), base.period[:, None] * phases)]
    starts = sides[:, None, None] * np.eye(n) * base.sizes[:, None, None, None]
    given, x = [p[:, None, None, None] for p in base.parameters], [*np.moveaxis(starts, 4, 0), np.zeros((1, 1, 1, 1))]
    epsilon, step = (y[:, None, None, None] for y in (epsilon, base.period / (K * steps)))
    table = code.starts(shape, given, place, epsilon, x, step)
    advance_table(code.module().advance, table, steps)
    ends = table[[code.row_of("x", i) for i in range(n)]].reshape(n, *shape) / base.sizes.T[:, :, None, None, None]
    matrix = np.einsum("ipksj,s->pkij", ends, sides / sides.size)
    return matrix, np.abs(ends.sum(axis=3)).max(axis=(0, 3)) if sides.size == 2 else np.zeros((points, K))


def measured(base: Base, epsilon: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the segments' matrices in the states' sizes, the error of their product, and if epsilon is too large.

    Args:
        base: of points of one kind.
        epsilon: size of the perturbation, relative to the states' sizes, shape (points,).
        tolerance: of the matrix of the period, relative to its largest entry: steps are halved until it is met.
    """
    points, K, n = base.period.size, int(base.number[0]), base.sizes.shape[1]
    segments, error, wide = np.empty((points, K, n, n)), np.empty((points, n, n)), np.zeros(points, dtype=bool)
    left, last, steps = np.arange(points), np.full(points, np.inf), STEPS
    while left.size and steps <= MOST_STEPS:
        part, size = base.chosen(left), epsilon[left]
        found, uneven = followed(part, size, steps)
        whole, before, after = product(found)
        other = product(followed(part, SMALLER * size, int(np.ceil(FINER * steps)))[0])[0]
        apart, most = np.abs(whole - other), np.abs(whole).max(axis=(1, 2))
        rows = np.abs(found)
        rounding = np.minimum(multiplied(rows, rows), rows.max(axis=(2, 3), keepdims=True))  # states apart stay apart
        noise = multiplied(after**2, multiplied(rounding**2, before**2) + multiplied(found, before) ** 2)
        segments[left] = found
        error[left] = APART * apart + NOISE * np.sqrt(noise.sum(axis=1))
        if part.error.any():
            bent = n * part.error[:, None] * uneven / size[:, None]  # what the base motion's own error changes
            bent = np.broadcast_to(bent[..., None, None], found.shape)
            error[left] += multiplied(np.abs(after), bent, np.abs(before)).sum(axis=1)
        change = apart.max(axis=(1, 2)) / most
        wide[left] = change > WIDE
        going = (change > tolerance) & (change < FALLING * last[left])
        last[left], steps = change, 2 * steps
        left = left[going]
    return segments, error, wide


def certified(base: Base) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray | None]:
    """Return the variational flow's matrix of the period, its error, the difference of traces, det, and half turns."""
    points, n = base.sizes.shape
    matrix, exact, elsewhere = np.full((points, n, n), np.nan), np.full((points, n, n), np.nan), np.full(points, np.nan)
    determinant, turns, left, finer = np.ones(points), np.zeros(points), np.arange(points), 1
    last = np.full(points, np.inf)
    while left.size and finer <= FINEST:
        part, steps = base.chosen(left), finer * (3 * int(base.number[0]) // 2 + 2)
        later = round(ELSEWHERE * steps)
        matrix[left], other, noise, determinant[left], turns[left] = varied(part, steps, later)
        coarser = varied(part, -(-2 * steps // 3), 1, later / steps)[0]
        elsewhere[left] = np.abs(np.trace(matrix[left] - coarser, axis1=1, axis2=2))
        apart = COARSER * np.abs(other - coarser).max(axis=(1, 2))
        exact[left] = ROUNDING * noise + apart[:, None, None]
        going = (apart > ROUNDING * noise.max(axis=(1, 2))) & (apart < FALLING * last[left])
        last[left] = apart
        left, finer = left[going], 2 * finer
    return matrix, exact, elsewhere, determinant, turns if n == 2 else None


def survey(model, points, tolerance: float) -> dict[str, np.ndarray]:
    """Return all columns of points (each parameter, `epsilon`, `equilibrium`: number of the name)."""
    slot = np.asarray(points["equilibrium"])
    base = Base(model, model.parameters(points, slot.size), slot)
    epsilon, columns = np.asarray(points["epsilon"], dtype=np.float64), {}
    kinds = 8 * base.number + 4 * base.reciprocal + 2 * base.still + base.mirrored
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
    if base.number[0]:
        segments, error, wide = measured(base, epsilon, tolerance)
        matrix = product(segments)[0]
        linear, exact, elsewhere, determinant, theirs = certified(base)
        linear[elsewhere > TWO_PHASES * np.abs(linear).max(axis=(1, 2))] = np.nan
        more = [x[None] if n == 2 else None for x in (half_turns(segments), theirs)]
        large = np.abs(matrix).max(axis=(1, 2)) > floquet.LARGE
        if n == (4 if reciprocal else 2) and base.still[0] and large.any():
            part, K, given = base.chosen(large), int(base.number[0]), np.full((2, 2, points), np.nan)
            again = followed(part, SMALLER * epsilon[large], 4 * STEPS)[0]
            given[0][:, large] = minors_trace(segments[large], again, NOISE)
            theirs = (np.stack([varied(part, k, 1, j / K, 1 / K)[0] for j in range(K)], axis=1) for k in (4, 3))
            given[1][:, large] = minors_trace(*theirs, ROUNDING)
            more = [one if n == 4 else np.vstack([x, one]) for x, one in zip(more, given, strict=True)]
    matrix[wide] = np.nan
    columns, agree = floquet.compared(
        floquet.Matrices(matrix, error, linear, exact, elsewhere, *more), base.period, reciprocal, determinant
    )
    sound = np.isfinite(matrix + error + linear).all(axis=(1, 2))
    cases = [~(base.closed <= CLOSED), base.number == 0, wide, ~sound, ~agree]
    kinds = ["NO_PERIODIC_MOTION", "NOT_CONVERGED", "PERTURBATION_TOO_LARGE", "NON_FINITE", "NOT_CONVERGED"]
    status = np.select(cases, [getattr(statuses, name) for name in kinds], statuses.OK)
    return columns | {"status": status.astype(np.int8)}
