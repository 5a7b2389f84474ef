r"""Perturbations of a periodic motion over one period: matrices from perturbed runs, beside the variational flow.

*Base motion.* From the place that a name gives, at rest at the time 0: where the rates vanish there at all times it is
an equilibrium; else Newton's method on the period map finds the motion of the system's period from there on.

*Segments.* A period T is cut into K of equal length, at most TURN/S; S, a bound on every rate along the base motion,
and the states' sizes come from the absolute values of the Jacobian's terms, as those of `sweeps.mechanics.relative`. So
no perturbation grows by more than a few times before it is sampled, however large the multipliers are.

*Measuring.* From the base motion at each segment's start the full equations are followed from both sides in each
direction, perturbed by epsilon, a half and a quarter of it. With D(s) the difference of both sides over that of their
starts, even in s, the limit for s = 0 is (64 D(1/4) - 20 D(1/2) + D(1))/45; how far it lies from that of two sizes
alone is the error of the amplitude. The matrix of the period is the product.

*Certificate.* The variational flow :math:`M' = A(t)M` by collocation at Gauss's points, of order 16, which solves
for all stages of a step at once: A is the derivative of the equations by SymPy, and nothing is shared with the
generated Taylor steps. Steps are halved until the traces of periods that begin at two phases agree.

Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.7 and II.9; derived again.
"""

from functools import cached_property

import numpy as np
import sympy as sp
from numpy.polynomial import legendre

from kernels import floquet, jacobians, statuses
from sweeps.mechanics import motions
from sweeps.mechanics.equations import Equations
from sweeps.mechanics.graph import lambdified
from sweeps.mechanics.problem import magnitude

STAGES = 8
TURN = 2.0  # of 1/S: no longer segment, in which a perturbation turns by less than a half turn
SEGMENTS = [k * 2**j for j in range(10) for k in (2, 3)]  # that a period may have
SIZES, LIMIT = np.array([1.0, 0.5, 0.25]), np.array([1.0, -20.0, 64.0]) / 45.0
WIDE = 0.1  # of a matrix, that the amplitude may change
TOGETHER = 16_384  # segments times squares of states: points of one number of segments that are followed side by side
ELSEWHERE = 0.381966  # of a period: where the variational flow begins again
FALLING = 0.25  # of the difference before: else what is left is rounding
FINEST = 32  # times the segments, that the variational flow may need
AGREED = 4e-15  # of the matrix: traces from two phases so near are one
STILL = 64 * float(np.finfo(np.float64).eps)  # of the largest rates of motions of the states' sizes: equilibrium
ROUNDING = 4 * float(np.finfo(np.float64).eps)
SPARE = 1e-3
DIFFERENCE, NEWTONS = 1e-6, 16  # of the sizes: what differentiates the period map; steps
FAR = 8.0  # sizes from the named start, where no periodic motion is looked for
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
        terms = [magnitude(e) for e in slopes]
        self._all = lambdified((*equations.parameters, *equations.states, equations.system.time), [
            *forces, *slopes, *terms, *masses, *bent,
        ])  # fmt: skip

    def at(self, parameters, x, t) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return rates (…, n), the Jacobian and the absolute values of its terms (…, n, n).

        Args:
            parameters: arrays (points,).
            x: states, shape (points, times, n).
            t: shape (points, times).
        """
        m, n, shape = self.m, self.n, t.shape
        given = [np.repeat(p, shape[1]) for p in parameters]
        values = np.stack(self._all(*given, *x.reshape(-1, n).T, t.ravel()), axis=-1).reshape(*shape, -1)
        parts = np.split(values, np.cumsum([m, m * n, m * n, m * m * self.second]), axis=-1)
        force, J, terms, a, bent = parts
        J, terms = J.reshape(*shape, m, n), terms.reshape(*shape, m, n)
        if not self.second:
            return force, J, terms
        inverse = np.linalg.inv(a.reshape(*shape, m, m))
        bent = np.einsum("...ijk,...jl,...l->...ik", bent.reshape(*shape, m, m, m), inverse, force)
        upper = np.broadcast_to(np.eye(m, n, m), (*shape, m, n))
        J = np.concatenate([J[..., :m] - bent, J[..., m:]], axis=-1)
        terms = np.concatenate([terms[..., :m] + np.abs(bent), terms[..., m:]], axis=-1)
        rates = np.concatenate([x[..., m:], np.einsum("...ij,...j->...i", inverse, force)], axis=-1)
        return rates, *(np.concatenate([upper, y], axis=-2) for y in (inverse @ J, np.abs(inverse) @ terms))


def collocation(stages: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Gauss's points in (0, 1), the weights of integrals up to each point, and of the whole."""
    x, w = legendre.leggauss(stages)
    integrals = legendre.legint(np.eye(stages), lbnd=-1, axis=0)
    inner = np.linalg.solve(legendre.legvander(x, stages - 1).T, legendre.legval(x, integrals)).T
    return 0.5 * (x + 1.0), 0.5 * inner, 0.5 * w


POINTS, INNER, WHOLE = collocation(STAGES)


def flow(A: np.ndarray, h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrix of each step of M' = A(t) M, and the integral of the trace over all steps.

    Args:
        A: at POINTS of each step, shape (points, steps, STAGES, n, n).
        h: length of the steps, shape (points,).
    """
    n, h = A.shape[-1], h[:, None, None, None]
    coupled = np.einsum("ij,pkjab->pkiajb", INNER, A).reshape(*A.shape[:2], STAGES * n, STAGES * n)
    starts = np.broadcast_to(np.tile(np.eye(n), (STAGES, 1)), (*A.shape[:2], STAGES * n, n))
    stages = np.linalg.solve(np.eye(STAGES * n) - h * coupled, starts).reshape(*A.shape[:3], n, n)
    traces = (np.einsum("pkjaa->pkj", A) * WHOLE).sum(axis=(1, 2)) * h[:, 0, 0, 0]
    return np.eye(n) + h * np.einsum("j,pkjab->pkab", WHOLE, A @ stages), traces


def product(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return products of the steps' matrices, shape (points, steps, n, n): of all, of those before, of those after."""
    before, after = (np.broadcast_to(np.eye(matrices.shape[-1]), matrices.shape).copy() for _ in range(2))
    for k in range(1, matrices.shape[1]):
        before[:, k] = matrices[:, k - 1] @ before[:, k - 1]
        after[:, -1 - k] = after[:, -k] @ matrices[:, -k]
    return matrices[:, -1] @ before[:, -1], before, after


def half_turns(matrices: np.ndarray) -> np.ndarray | None:
    """Return whole half turns of a perturbation in the steps, of two states, of a rate's sign from rate to state."""
    if matrices.shape[-1] != 2:
        return None
    before = product(matrices)[1]
    a, b = before[..., 0], (matrices @ before)[..., 0]
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
            if not self.still.all():
                self._close(np.flatnonzero(~self.still))
                self._measure_sizes(places)

    def _measure_sizes(self, places):
        """Set the states' sizes and the bound S on every rate along the motion; return whether it stays at rest."""
        phases = self.period[:, None] * (np.arange(32) + 0.5) / 32
        rates, _, terms = self.model.variation.at(self.parameters, self(phases), phases)
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
        """Return the states at times (points, times), shape (points, times, n)."""
        found = np.repeat(self.start[:, None], times.shape[1], axis=1)
        if not self.still.all():
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
        for name in ("period", "start", "closed", "error", "still", "scale", "sizes", "reciprocal"):
            setattr(part, name, getattr(self, name)[which])
        return part

    @cached_property
    def number(self) -> np.ndarray:
        """Number of segments of a period; 0 where there are too many, and where no motion is closed."""
        needed = np.ceil(self.period * self.scale / TURN)
        at = np.searchsorted(SEGMENTS, np.where(np.isfinite(needed) & (self.closed <= CLOSED), needed, np.inf))
        return np.array([*SEGMENTS, 0])[at]


def variational(base: Base, steps: int, begin: float = 0.0):
    """Return the matrices of the steps of one period, in the states' sizes, and the integral of the trace."""
    T, shape = base.period, (base.period.size, steps, STAGES)
    times = T[:, None] * (begin + (np.arange(steps)[:, None] + POINTS).ravel() / steps)
    A = base.model.variation.at(base.parameters, base(times), times)[1]
    A = A * base.sizes[:, None, None, :] / base.sizes[:, None, :, None]
    return flow(A.reshape(*shape, *A.shape[-2:]), T / steps)


def measured(base: Base, epsilon: np.ndarray, tolerance: float) -> tuple[np.ndarray, ...]:
    """Return the segments' matrices in the states' sizes, their rounding, other errors, and if epsilon is too large.

    Args:
        base: of points with one number of segments.
        epsilon: size of the perturbation, relative to the states' sizes, shape (points,).
        tolerance: of each run, relative to its perturbation; its runs keep SPARE of it, for all add up in the error.
    """
    points, K, n = base.period.size, int(base.number[0]), base.sizes.shape[1]
    times, sizes = base.period[:, None] * np.arange(K + 1) / K, base.sizes[:, None, None, None]
    x, amount = base(times), (epsilon[:, None] * SIZES)[:, None, :, None, None]
    nudges = np.array([1.0, -1.0])[:, None, None, None] * (np.eye(n) * amount * sizes)[:, :, None]
    starts = x[:, :-1, None, None, None] + nudges  # point, segment, side, size, direction, state
    spans = np.stack([times[:, :-1], times[:, 1:]], axis=2)[:, :, None, None, None]
    spans, size = (np.broadcast_to(y, (*starts.shape[:-1], y.shape[-1])) for y in (spans, (amount * sizes)[:, :, None]))
    given = [np.repeat(p, starts.size // n // points) for p in base.parameters]
    runs = (y.reshape(-1, y.shape[-1]) for y in (starts, spans))
    ends, error, _ = motions.solved(base.model.moving, given, *runs, SPARE * tolerance, size.reshape(-1, n))
    ends, error = (y[:, 1].reshape(starts.shape) / sizes[:, :, None] for y in (ends, error))
    width = np.einsum("pksjj->pksj", starts[:, :, 0] - starts[:, :, 1])[..., None] / base.sizes[:, None, None, :, None]
    found = np.swapaxes((ends[:, :, 0] - ends[:, :, 1]) / width, 3, 4)
    matrix = np.einsum("s,pksij->pkij", LIMIT, found)
    change = np.abs(matrix - (4.0 * found[:, :, 2] - found[:, :, 1]) / 3.0)
    noise = np.einsum("s,pksij->pkij", np.abs(LIMIT), np.swapaxes(error.sum(axis=2) / np.abs(width), 3, 4))
    bent = (
        np.abs(ends[:, :, :, 0].sum(axis=2) - 2.0 * x[:, 1:, None] / sizes[:, :, 0]).max(axis=(2, 3))
        / epsilon[:, None] ** 2
    )
    change += (n * bent * base.error[:, None])[:, :, None, None]
    wide = np.abs(matrix - found[:, :, 0]).max(axis=(1, 2, 3)) > WIDE * np.abs(matrix).max(axis=(1, 2, 3))
    return matrix, noise, change, wide


def certified(base: Base) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray | None]:
    """Return the variational flow's matrix of the period, its error, the difference of traces, det, and half turns."""
    points, n = base.sizes.shape
    matrix, exact, elsewhere = np.full((points, n, n), np.nan), np.full((points, n, n), np.nan), np.full(points, np.nan)
    determinant, turns, left, finer = np.ones(points), np.zeros(points), np.arange(points), 1
    last = np.full(points, np.inf)
    while left.size and finer <= FINEST:
        part = base.chosen(left)
        segments, traces = variational(part, 2 * finer * int(base.number[0]))
        other = product(variational(part, 3 * finer * int(base.number[0]), ELSEWHERE)[0])[0]
        matrix[left], before, after = product(segments)
        grown = (np.abs(after).sum(axis=3) * np.abs(segments @ before).sum(axis=2)).sum(axis=(1, 2))
        elsewhere[left] = np.abs(np.trace(matrix[left] - other, axis1=1, axis2=2))
        exact[left] = (ROUNDING * grown + elsewhere[left])[:, None, None]
        determinant[left], finer = np.exp(traces), 2 * finer
        if n == 2:
            turns[left] = half_turns(segments)
        going = elsewhere[left] > AGREED * np.abs(matrix[left]).max(axis=(1, 2))
        going &= elsewhere[left] < FALLING * last[left]
        last[left] = elsewhere[left]
        left = left[going]
    return matrix, exact, elsewhere, determinant, turns if n == 2 else None


def survey(model, points, tolerance: float) -> dict[str, np.ndarray]:
    """Return all columns of points (each parameter, `epsilon`, `equilibrium`: number of the name)."""
    slot = np.asarray(points["equilibrium"])
    base = Base(model, model.parameters(points, slot.size), slot)
    epsilon, columns = np.asarray(points["epsilon"], dtype=np.float64), {}
    for key in np.unique(2 * base.number + base.reciprocal):
        which = np.flatnonzero(2 * base.number + base.reciprocal == key)
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
    return ""


def _columns(base, epsilon, tolerance):
    """Columns of points with one number of segments."""
    (points, n), reciprocal = base.sizes.shape, bool(base.reciprocal[0])
    matrix, error, linear, exact = (np.full((points, n, n), np.nan) for _ in range(4))
    elsewhere, wide, determinant, turns = np.full(points, np.nan), np.zeros(points, dtype=bool), 1.0, (None, None)
    if base.number[0]:
        segments, noise, change, wide = measured(base, epsilon, tolerance)
        matrix, before, after = product(segments)
        noise = after**2 @ noise**2 @ before**2 + after**2 @ (ROUNDING * (segments @ before)) ** 2
        error = np.sqrt(noise.sum(axis=1)) + (np.abs(after) @ change @ np.abs(before)).sum(axis=1)
        linear, exact, elsewhere, determinant, theirs = certified(base)
        turns = half_turns(segments), theirs
    matrix[wide] = np.nan
    columns, agree = floquet.compared(
        floquet.Matrices(matrix, error, linear, exact, elsewhere, *turns), base.period, reciprocal, determinant
    )
    sound = np.isfinite(matrix + error + linear).all(axis=(1, 2))
    cases = [~(base.closed <= CLOSED), base.number == 0, wide, ~sound, ~agree]
    kinds = ["NO_PERIODIC_MOTION", "NOT_CONVERGED", "PERTURBATION_TOO_LARGE", "NON_FINITE", "NOT_CONVERGED"]
    status = np.select(cases, [getattr(statuses, name) for name in kinds], statuses.OK)
    return columns | {"status": status.astype(np.int8)}
