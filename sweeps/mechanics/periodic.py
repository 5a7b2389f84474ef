r"""Perturbations of a periodic motion over one period: matrices from perturbed runs, beside the variational flow.

*Base motion.* From the place that a name gives, at rest at the time 0: where the rates vanish there at all times it is
an equilibrium; else Newton's method on the period map finds the motion of the system's period from there on.

*Segments.* A period T is cut into K of equal length, at most TURN/S; S, a bound on every rate along the base motion,
and the states' sizes come from the absolute values of the Jacobian's terms, as those of `sweeps.mechanics.relative`. So
no perturbation grows by more than a few times before it is sampled, however large the multipliers are.

*Measuring.* From the base motion at each segment's start the full equations are followed from both sides in each
direction (from one where the equations are odd or linear), perturbed by epsilon, by the steps of
`sweeps.mechanics.perturbed`; half the difference of both sides is a column of the segment's matrix, and the matrix of
the period is the product. It is measured again, perturbed by an
eighth as much and in steps shorter by a third: the difference of both holds what the amplitude and the steps change,
and rounding is bounded by what grows of it.

*Certificate.* The variational flow :math:`M' = A(t)M` by collocation at Gauss's points, of order 16, which solves
for all stages of a step at once: A is the derivative of the equations by SymPy, and nothing is shared with the
generated Taylor steps. Steps are halved until the traces of periods that begin at two phases agree to a rounding.

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
ROUNDING = 4 * float(np.finfo(np.float64).eps)  # of the certificate
NOISE = 6 * float(np.finfo(np.float64).eps)  # of a measured segment
DIFFERENCE, NEWTONS = 1e-6, 16  # of the sizes: what differentiates the period map; steps
FAR = 8.0  # sizes from the named start, where no periodic motion is looked for
EXAMINED, FOURIER, FALLEN = 8, 4096, 1e-9  # points; times in a period; of the largest term: what the last may be
CLOSED = 1e-9  # of the sizes: how far a periodic motion may be from closed


class Variation:
    """Rates and Jacobian of any state at any time, in NumPy, and the absolute values of the Jacobian's terms.

    Args:
        equations: of the system.
    """

    def __init__(self, equations: Equations):
        self.m, self.n, self.second = equations.m, equations.n, bool(equations.v)
        forces = sp.Matrix(equations.forces)
        slopes = [e.diff(x) for e in forces for x in equations.states]
        masses = list(equations.a) if self.second else []
        bent = [e.diff(q) for e in masses for q in equations.q]
        arguments = (*equations.parameters, *equations.states, equations.system.time)
        self._slopes = lambdified(arguments, [*forces, *slopes, *masses, *bent])
        self._terms = lambdified(arguments, [magnitude(e) for e in slopes])
        turned = {x: -x for x in equations.states}
        signed = [*((e, 1) for e in forces), *((e, -1) for e in masses)]
        self.odd = all(sp.expand(e + sign * e.subs(turned)) == 0 for e, sign in signed)  # the same from the other side

    def _parts(self, parameters, x, t):
        """Return forces, their slopes by all states, the inverse masses, and the masses' slopes times accelerations."""
        m, n, shape, given = self.m, self.n, t.shape, [p[:, None] for p in parameters]
        values = np.stack(self._slopes(*given, *np.moveaxis(x, 2, 0), t), axis=-1)
        force, J, a, bent = np.split(values, np.cumsum([m, m * n, m * m * self.second]), axis=-1)
        J = J.reshape(*shape, m, n)
        if not self.second:
            return force, J, None, None
        a = np.ascontiguousarray(a).reshape(-1, m, m)
        inverse = np.empty_like(a)
        variational.invert(a, inverse)
        inverse = inverse.reshape(*shape, m, m)
        rates = multiplied(inverse, force[..., None])[..., 0]
        bent = bent.reshape(*shape, m, m, m)
        return rates, J, inverse, sum(bent[..., j, :] * rates[..., j, None, None] for j in range(m))

    def at(self, parameters, x, t) -> np.ndarray:
        """Return the Jacobian, shape (points, times, n, n).

        Args:
            parameters: arrays (points,).
            x: states, shape (points, times, n), or of equilibria (points, 1, n).
            t: shape (points, times).
        """
        _, J, inverse, bent = self._parts(parameters, x, t)
        if not self.second:
            return J
        found = np.zeros((*t.shape, self.n, self.n))
        found[..., : self.m, self.m :] = np.eye(self.m)
        J[..., : self.m] -= bent
        found[..., self.m :, :] = multiplied(inverse, J)
        return found

    def bounds(self, parameters, x, t) -> tuple[np.ndarray, np.ndarray]:
        """Return rates (points, times, n) and the absolute values of the Jacobian's terms, of what `at` takes."""
        rates, J, inverse, bent = self._parts(parameters, x, t)
        given = [p[:, None] for p in parameters]
        terms = np.stack(self._terms(*given, *np.moveaxis(x, 2, 0), t), axis=-1).reshape(J.shape)
        if not self.second:
            return rates, terms
        terms[..., : self.m] += np.abs(bent)
        upper = np.broadcast_to(np.eye(self.m, self.n, self.m), terms.shape)
        terms = np.concatenate([upper, multiplied(np.abs(inverse), terms)], axis=-2)
        return np.concatenate([np.broadcast_to(x[..., self.m :], rates.shape), rates], axis=-1), terms


def flow(A: np.ndarray, h: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrix of each step of M' = A(t) M in the states' sizes, and the integral of A's trace over all steps.

    Args:
        A: at the collocation's points of each step, shape (points, steps, stages, n, n).
        h: length of the steps, shape (points,).
        sizes: of the states, shape (points, n).
    """
    found = np.empty((*A.shape[:2], *A.shape[3:]))
    variational.flow(
        np.ascontiguousarray(A).reshape(-1, *A.shape[2:]),
        np.ascontiguousarray(h),
        np.ascontiguousarray(sizes),
        variational.INNER,
        variational.WHOLE,
        found.reshape(-1, *A.shape[3:]),
    )
    return found, sum(A[..., a, a] for a in range(A.shape[-1])).sum(axis=1) @ variational.WHOLE * h


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
        phases = self.period[:, None] * (np.arange(32) + 0.5) / 32
        rates, terms = self.model.variation.bounds(self.parameters, self(phases), phases)
        terms, m = terms.max(axis=1) + np.eye(terms.shape[-1]) / self.period[:, None, None], self.model.equations.m
        sizes = self.model.landscape.sizes(self.parameters, list(places.T))
        if self.model.equations.v:
            ratio = sizes[:, None, :] / sizes[:, :, None]
            rate = np.sqrt((terms[:, m:, :m] * ratio).max(axis=(1, 2)))
            rate = np.maximum(rate, (terms[:, m:, m:] * ratio).max(axis=(1, 2)))
            sizes = np.concatenate([sizes, sizes * rate[:, None]], axis=1)
        self.scale, self.sizes = np.empty(len(sizes)), np.empty(sizes.shape)
        jacobians.scales(np.ascontiguousarray(terms), np.ascontiguousarray(sizes), self.scale, self.sizes)
        allowed = STILL * np.einsum("pij,pj->pi", terms, self.sizes)
        return (np.abs(rates) <= allowed[:, None]).all(axis=(1, 2))

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

    def __call__(self, times) -> np.ndarray:
        """Return the states at times (points, times), shape (points, times, n); (points, 1, n) if all are at rest."""
        if self.still.all():
            return self.start[:, None]
        found = np.repeat(self.start[:, None], times.shape[1], axis=1)
        which = np.flatnonzero(~self.still)
        phases = times[which] % self.period[which, None]
        order = np.argsort(phases, axis=1)
        ordered = np.insert(np.take_along_axis(phases, order, axis=1), 0, 0.0, axis=1)
        given = [p[which] for p in self.parameters]
        sizes = self.sizes[which]
        states = motions.solved(self.model.moving, given, self.start[which], ordered, 1e-13, sizes)[0][:, 1:]
        found[which] = np.take_along_axis(states, np.argsort(order, axis=1)[..., None], axis=1)
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


def varied(base: Base, steps: int, begin: float = 0.0):
    """Return the matrices of the steps of one period, in the states' sizes, and the integral of the trace."""
    T = base.period
    times = T[:, None] * (begin + (np.arange(steps)[:, None] + variational.POINTS).ravel() / steps)
    A = base.model.variation.at(base.parameters, base(times), times)
    return flow(A.reshape(T.size, steps, variational.STAGES, *A.shape[-2:]), T / steps, base.sizes)


def followed(base: Base, epsilon: np.ndarray, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the segments' matrices in the states' sizes, shape (points, segments, n, n), and how far sides differ.

    Args:
        base: of points of one kind.
        epsilon: size of the perturbation, relative to the states' sizes, shape (points,).
        steps: in each segment.
    """
    points, K, n, code = base.period.size, int(base.number[0]), base.sizes.shape[1], base.code
    sides = np.array([1.0] if code.linear or base.mirrored[0] else [1.0, -1.0])
    times = base.period[:, None] * np.arange(K) / K
    shape = points, K, sides.size, n  # of runs: point, segment, side, direction
    place = [y[..., None, None] for y in (*np.moveaxis(base(times), 2, 0), times)]
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
        part = base.chosen(left)
        segments, traces = varied(part, 2 * finer * int(base.number[0]))
        other = product(varied(part, finer * int(base.number[0]) * 3 // 2, ELSEWHERE)[0])[0]
        matrix[left], before, after = product(segments)
        grown = (np.abs(after).sum(axis=3) * np.abs(multiplied(segments, before)).sum(axis=2)).sum(axis=(1, 2))
        elsewhere[left] = np.abs(np.trace(matrix[left] - other, axis1=1, axis2=2))
        exact[left] = (ROUNDING * grown + elsewhere[left])[:, None, None]
        determinant[left], finer = np.exp(traces), 2 * finer
        if n == 2:
            turns[left] = half_turns(segments)
        going = (elsewhere[left] > ROUNDING * grown) & (elsewhere[left] < FALLING * last[left])
        last[left] = elsewhere[left]
        left = left[going]
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
    some = base.chosen(slice(EXAMINED))
    times = some.period[:, None] * np.arange(FOURIER) / FOURIER
    with np.errstate(all="ignore"):
        terms = np.abs(np.fft.rfft(some.model.variation.at(some.parameters, some.start[:, None], times), axis=1))
    most = terms.max(axis=(1, 2, 3))
    return not (terms[:, FOURIER // 4 :].max(axis=(1, 2, 3)) <= FALLEN * most).any()


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
            given[1][:, large] = minors_trace(varied(part, 8 * K)[0], varied(part, 6 * K)[0], ROUNDING)
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
