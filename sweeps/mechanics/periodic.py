r"""Perturbations of a periodic motion over one period: matrices from perturbed runs, beside the variational flow.

*Base motion.* From the place that a name gives, at rest at the time 0: where the rates vanish there at all times it is
an equilibrium; else the motion of the system's period is followed from there while the drive is switched on
(`sweeps.mechanics.continuation`), and Newton's method on the maps of segments finds its states to rounding.

*Segments.* A period T is cut into K of equal length, at most TURN/(S + 2 pi/T); S, a bound on every rate along the base
motion, and the states' sizes come from the absolute values of the Jacobian's terms, as those of
`sweeps.mechanics.relative`. So no perturbation grows by more than some times before it is sampled, however large the
multipliers are. There are more of them where functions of the time are steep (`sweeps.mechanics.steepness`).

*Measuring.* From the base motion at each segment's start the full equations are followed from both sides in each
direction (from one where the equations are odd or linear), perturbed by epsilon, by the steps of
`sweeps.mechanics.perturbed`, which are halved until they leave out less than the tolerance; `kernels.monodromy` makes
the matrix of the period of them. Unless the derivation proves that the equations are linear, one more motion begins at
twice the sum of all directions: by what it is off the sum of the others, the amplitude changes a matrix.

*Certificate.* The variational flow by collocation at Gauss's points, of order 16 (`kernels.variational`), whose slopes
are derivatives of the equations by SymPy: nothing is shared with the generated Taylor steps. It is found again in fewer
steps from another phase, and compared with what the finer steps make of the period that begins there, entry by entry:
steps are shortened by a third until the difference is rounding. Where Hamilton's equations are proved to be even in the
time, half a period gives the finer one (the coarser one is followed through all of it), and the measured one.

*Jumps.* Where coefficients jump, or have a kink, at times of the period (`sweeps.mechanics.jumps`), the pieces between
them have equal shares of the phase: segments and steps of points whose pieces are as many end at the jumps together,
and the time goes faster in a longer piece. Velocities are states of the variational flow then, and both of its
solutions begin at the phase 0.

Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.7 and II.9; derived again.
"""

from collections.abc import Iterator
from functools import cached_property

import numpy as np
import sympy as sp

from kernels import floquet, jacobians, jit, monodromy, statuses, variational
from kernels.matrices import joined
from sweeps.mechanics import continuation, motions
from sweeps.mechanics.equations import Equations, factors
from sweeps.mechanics.graph import lambdified
from sweeps.mechanics.landscape import magnitude

TURN = 2.8  # of 1/(S + 2π/T): no longer segment, in which a perturbation turns by less than a half turn
STEEP = 0.25  # of the steepest function of the time: a segment's steps meet all of its pulses
SEGMENTS = [k * 2**j for j in range(9) for k in (4, 5, 6, 7)]  # that a period may have
STEPS = 2  # in a segment, of the first try
WIDE = 0.1  # of the segments' matrices, that the amplitude may change
TOGETHER = 262_144  # segments times squares of states: points of one number of segments that are followed side by side
CACHED = 2048  # points whose bounds are found at once: their arrays stay in the processor's cache
FALLING = 0.25  # of the difference before: else what is left is rounding, or the amplitude's
TWO_PHASES = 1e-6  # of the matrix: traces from two phases that differ by more are none
ROUNDED = 1e-11  # of the matrix: a difference that no longer falls, but is larger, is not rounding
FINEST = 1 << 14  # steps in a period, at most
STILL = 64 * float(np.finfo(np.float64).eps)  # of the largest rates of motions of the states' sizes: equilibrium
COARSER = 0.1  # of the difference of both flows: the error of the finer, of order 16 and 5/4 times the steps
ROUNDING = 8 * float(np.finfo(np.float64).eps)  # of the certificate
DIFFERENCE, NEWTONS = 1e-6, 16  # of the sizes: what differentiates the period map; steps
GROWTH, MOST_HALVINGS = 4.0, 5  # bound on a perturbation's growth exponent in a segment of Newton's method; halvings
MAX_POLISHING = 1e-2  # largest distance of a motion from the collocated one, in state sizes; beyond, it is another one
MAX_JUMP_POLISHING = 0.05  # the same beside jumps, where a polynomial's slopes are off by its phases' distance
JUMP_MARGIN = 1e-9  # phases closer to the end of a piece than this fraction of it are taken as the end
EXAMINED, FOURIER, FALLEN = 8, 4096, 1e-9  # points; times in a period; of the largest term: what the last may be
OF_POINTS = (  # of motions
    *("period", "start", "nodes", "count", "branch", "status", "closed", "error", "still", "even", "mirrored", "scale"),
    *("pieces", "edges", "switched", "known", "sizes", "acting", "reciprocal", "number", "steepness", "finite"),
)
CLOSED = 1e-9  # of the sizes: how far a periodic motion may be from closed


class Variation:
    """Slopes of the rates at any state and phase of the period, in NumPy, and the absolute values of their terms.

    All points share the phases, and the period is put in for the time in symbols: so what depends on the phase alone is
    worked out once for all points.
    """

    def __init__(self, equations: Equations):
        self.equations, self.m, self.second = equations, equations.m, bool(equations.v)
        self._phase = phase = sp.Symbol("phase", real=True)
        self._kernels: dict[bool, tuple] = {}  # found once, for parts may be small
        timed = {equations.system.time: phase * equations.system.given_period}
        forces, masses = ([e.subs(timed) for e in some or ()] for some in (equations.forces, equations.a))
        self.has_jumps = bool(equations.switches)
        slopes, turned = sp.Matrix(forces).jacobian(equations.states), {x: -x for x in equations.states}
        J, a = slopes.subs(equations.still), [e.subs(equations.still) for e in masses]
        uneven = [*(J - J.subs(phase, -phase)), *J[:, self.m :], *(e.diff(phase) for e in a)]
        uneven = factors(uneven, (*equations.states, phase)) if self.second else [sp.Integer(1)]
        paired = unpaired(equations)
        self._proofs = lambdified(equations.parameters, [equations.system.given_period, *paired, *uneven]), len(paired)
        self._still = self._written([*J, *a])
        self._separate = None if self.has_jumps else self._separated(J, a)
        both = np.reshape([e != 0 for e in J], J.shape)
        if any(e != 0 for i, e in enumerate(a) if i % (self.m + 1)):
            both[:] = both.any(axis=0)  # masses couple what the forces do not
        #: number of unknowns of the variational flow: of coordinates, unless steps differ, accelerations
        self.unknowns = equations.n if self.has_jumps else self.m
        both = np.vstack([np.eye(self.m, equations.n, self.m)[: self.unknowns - self.m] != 0, both])
        #: whether all is at rest → (i, j): what the acceleration or rate i has slopes by
        self.entries = {still: tuple(map(tuple, np.argwhere(both | (not still)).tolist())) for still in (True, False)}
        self._moving = self._written([*slopes, *masses, *(e.diff(q) for e in masses for q in equations.q), *forces])
        self._terms = self._written([magnitude(e) for e in slopes])
        moving, numbers = (phase, *equations.switches), np.ndindex(slopes.shape)
        pulses = [(e, entry) for e, entry in zip(slopes, numbers, strict=True) if e.has(*moving)]
        pulses = [(f, entry) for e, entry in pulses for f in factors([e], (*equations.states, *moving))]
        self._pulses = lambdified(equations.parameters, [f for f, _ in pulses]), [entry for _, entry in pulses]
        self._coupled = np.reshape([e != 0 for e in masses], (self.m, -1))
        signed = [*((e, 1) for e in forces), *((e, -1) for e in masses)]
        self.odd = all(sp.expand(e + sign * e.subs(turned)) == 0 for e, sign in signed)  # the same from the other side

    def kernels(self, still):
        """Return the function of `kernels.variational.flow`, compiled, and whether states act on each other."""
        if still not in self._kernels:
            m, n, entries = self.unknowns, self.equations.n, self.entries[still]
            groups = [(i, i + n - m, j, j % m) for i, j in [*entries, *np.ndindex(m, 1)]]
            self._kernels[still] = jit.passed(variational.step_of(m, n, entries)), joined(n, groups)
        return self._kernels[still]

    def proved(self, parameters) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return of points the period, whether multipliers come in pairs, and whether half a period gives the whole.

        The last holds of points at rest, where Hamilton's equations are even in the time without terms in velocities.
        """
        function, count = self._proofs
        period, *rest = function(*parameters)
        paired, even = ((np.array([period, *some])[1:] == 0.0).all(axis=0) for some in (rest[:count], rest))
        return period, paired, even

    def _written(self, expressions):
        return lambdified((*self.equations.parameters, *self.equations.states, self._phase), expressions, whole=False)

    def parts(self, parameters, x, phases, still):
        """Return slopes of the forces, masses, what the masses' slopes add where not still, and accelerations."""
        m, n = range(self.m), range(self.equations.n)
        phases = phases[:, None] if phases.ndim == 1 else phases
        values = iter((self._still if still else self._moving)(*parameters, *x, phases))
        J = [[next(values) for _ in n] for _ in m]
        if not self.second:
            return J, None, [], [*values]
        a = [[next(values) for _ in m] for _ in m]
        if still:
            return J, a, [], []
        bent = [[[next(values) for _ in m] for _ in m] for _ in m]
        rates = [rate for (rate,) in divided(a, [[force] for force in values])]
        return J, a, [[sum(row[j][k] * rates[j] for j in m) for k in m] for row in bent], rates

    def acting(self, parameters, terms) -> np.ndarray:
        """Return which states act on which, (points, n, n): by `terms` of `bounds`, and by pulses that these miss."""
        acting, m = terms > 0.0, self.m
        function, entries = self._pulses
        for factor, (i, j) in zip(function(*parameters), entries, strict=True):
            acting[:, i - m, j] |= factor != 0.0
        acting[:, -m:, -m:] |= self._coupled if self.second else False
        return acting

    def _separated(self, slopes, masses):
        """Return functions of the phase and, for each, slopes and masses in the parameters; None if they are no sums.

        Each slope is a sum of products of a function of the phase and one of the parameters.
        """
        parts = {}
        if any(e.has(self._phase) for e in masses):
            return None
        for k, e in enumerate(slopes):
            for term in sp.Add.make_args(sp.expand(e, power_exp=False)):
                factor, moving = term.as_independent(self._phase, as_Add=False)
                if moving.free_symbols - {self._phase}:
                    return None
                parts.setdefault(moving, [sp.Integer(0)] * len(slopes))[k] += factor
        return lambdified([self._phase], parts), self._written([*(e for part in parts.values() for e in part), *masses])

    def at(self, parameters, x, phases, still) -> tuple[np.ndarray, np.ndarray]:
        """Return factors (phases, parts) and slopes (parts, entries, points), which make a sum at each phase.

        Where slopes are no such sums there are no parts, and the slopes are those at all phases. Phases have the shape
        (phases,), each parameter (points,), and each state (phases, points), or (1, points) where all is `still`. Of
        phases and parameters between jumps see `Base.between_jumps`.
        """
        m, n, points, entries = self.m, self.equations.n, parameters[0].size, self.entries[still]
        if still and self._separate:
            moving, written = self._separate
            factors, values = np.stack(moving(phases), axis=1), iter(written(*parameters, *x[:, 0], np.zeros(1)))
            parts = [[[next(values) for _ in range(n)] for _ in range(m)] for _ in range(factors.shape[1])]
            a = [[next(values) for _ in range(m)] for _ in range(m)] if self.second else None
            parts = [divided(a, J) if self.second else J for J in parts]
        else:
            whole, factors = self.linearized(parameters, x, phases, still)[1], np.empty((len(phases), 0))
            parts = [[[y[t] for y in row] for row in whole] for t in range(len(phases))]
        slopes = np.empty((len(parts), len(entries), points))
        for part, J in zip(slopes, parts, strict=True):
            for row, (i, j) in zip(part, entries, strict=True):
                row[:] = J[i][j]
        return factors, slopes

    def linearized(self, parameters, x, phases, still=False) -> tuple[list, list]:
        """Return accelerations or rates and, for each, its slopes by all states, as arrays (phases, points).

        Where all is `still` there are no rates.
        """
        J, a, bent, rates = self.parts(parameters, x, phases, still)
        for row, extra in zip(J, bent, strict=not still and self.second):
            row[: self.m] = [y - z for y, z in zip(row, extra, strict=False)]
        J, shape = divided(a, J) if self.second else J, (len(phases), parameters[0].size)
        J = [*np.eye(self.m, self.equations.n, self.m)[: self.unknowns - self.m], *J]
        return [np.broadcast_to(y, shape) for y in rates], [[np.broadcast_to(y, shape) for y in row] for row in J]

    def bounds(self, parameters, x, phases) -> tuple[np.ndarray, np.ndarray]:
        """Return the largest rates (points, n) and absolute values of the Jacobian's terms (points, n, n) at phases."""
        m, n, points = self.m, self.equations.n, parameters[0].size
        if points > CACHED:
            which = np.split(np.arange(points), range(CACHED, points, CACHED))
            parts = [
                self.bounds(
                    [p[..., some] for p in parameters], x[:, :, some], phases[..., some] if self.has_jumps else phases
                )
                for some in which
            ]
            return tuple(map(np.concatenate, zip(*parts, strict=True)))
        _, a, bent, rates = self.parts(parameters, x, phases, False)
        values = iter(self._terms(*parameters, *x, phases if self.has_jumps else phases[:, None]))
        terms = [[next(values) for _ in range(n)] for _ in range(m)]
        if self.second:
            for row, extra in zip(terms, bent, strict=True):
                row[:m] = [y + np.abs(z) for y, z in zip(row, extra, strict=False)]
            inverse = divided(a, np.eye(m).tolist())
            lower = [[sum(np.abs(y) * terms[j][k] for j, y in enumerate(row)) for k in range(n)] for row in inverse]
            terms, rates = [*np.eye(m, n, m).tolist(), *lower], [*x[m:], *rates]
        rows, largest = [[*row, rate] for row, rate in zip(terms, rates, strict=True)], np.empty((points, n, n + 1))
        for i, j in np.ndindex(n, n + 1):
            largest[:, i, j] = np.abs(np.atleast_2d(rows[i][j])).max(axis=0)
        return largest[:, :, n], largest[:, :, :n]


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
    return factors(extra, (*equations.states, equations.system.time, *equations.switches))


class Base:
    """The periodic motions of points at any time: of a model, parameters (points,), and numbers of names, (points,)."""

    @np.errstate(all="ignore")
    def __init__(self, model, parameters, slot):
        parameters = model.with_switches(parameters)
        self.model, self.parameters, size = model, parameters, slot.size
        places = np.take_along_axis(model.landscape.starts(parameters), slot[:, None, None], axis=1)[:, 0]
        self.start = np.zeros((size, model.equations.n))
        self.start[:, : places.shape[1]] = places
        self.closed, self.error, self.status = np.zeros(size), np.zeros(size), np.full(size, statuses.OK)
        self.still, self.count, self.nodes = np.ones(size, dtype=bool), np.ones(size, dtype=int), self.start[:, None]
        self.branch = np.array([*model.system.branches.values(), *[1] * model.system.most])[slot]
        self.period, self.reciprocal, self.even = model.variation.proved(parameters)
        self._cut()
        self.still = self._measure_sizes(places)
        self.finite = np.isfinite(self.scale)  # at the start, before another is looked for
        self.even &= self.still & (self.pieces == 1)
        self.mirrored = self.still & model.variation.odd & ~self.start.any(axis=1)
        if not self.still.all():
            model.perturbed(False)
            self.closed[~self.known], self.status[~self.known] = np.inf, statuses.NOT_FOUND
            self._close(np.flatnonzero(~self.still & self.known))
            self._measure_sizes(places)
        sides = [[*parameters[: len(parameters) - side.shape[1]], *side.T] for side in np.swapaxes(self.switched, 0, 1)]
        self.steepness = np.max([model.steepness([*side, *self.start.T]) for side in sides], axis=0)

    def _cut(self):
        """Set number and ends of the pieces of the period between jumps, in periods, and the switches in each."""
        size = self.period.size
        self.pieces, self.edges, self.switched = (
            np.ones(size, int),
            np.tile([0.0, 1.0], (size, 1)),
            np.zeros((size, 1, 0)),
        )
        self.known = np.ones(size, bool)
        if self.model.variation.has_jumps:
            edges, self.switched, pieces = self.model.jumps.pieces(self.parameters, self.period)
            self.edges, self.pieces, self.known = edges / self.period[:, None], np.maximum(pieces, 1), pieces > 0

    def between_jumps(self, phases, which=None) -> tuple[np.ndarray, np.ndarray | float, list]:
        """Return times over the period, their rate by the phase, and parameters, at phases, of points (default: all).

        If there are jumps, times, rates and switches have the shape (phases, points), else times are the phases.
        Phases are shared evenly between the pieces, and those at a jump belong to the later one.
        """
        which = np.arange(self.pieces.size) if which is None else np.asarray(which)
        given = [p[which] for p in self.parameters]
        if not self.model.variation.has_jumps:
            return phases, 1.0, given
        share = phases[:, None] % 1.0 * self.pieces[which]
        piece = np.minimum((share + JUMP_MARGIN).astype(int), self.pieces[which] - 1)
        begin, end = self.edges[which, piece], self.edges[which, piece + 1]
        switches = np.moveaxis(self.switched[which, piece], 2, 0)
        times = begin + (end - begin) * (share - piece)
        return times, (end - begin) * self.pieces[which], [*given[: len(given) - len(switches)], *switches]

    def _measure_sizes(self, places):
        """Set the states' sizes and the bound S on every rate along the motion; return whether it stays at rest."""
        phases = (np.arange(32) + 0.5) / 32
        times, _, given = self.between_jumps(phases)
        rates, terms = self.model.variation.bounds(given, self(phases), times)
        self.acting = self.model.variation.acting(self.parameters, terms)
        terms = terms + np.eye(terms.shape[-1]) / self.period[:, None, None]
        sizes = self.model.landscape.sizes(self.parameters, list(places.T))
        if self.model.equations.v:
            sizes = jacobians.with_velocities(terms, sizes)
        self.scale, self.sizes = jacobians.scales(terms, sizes)
        return (rates <= STILL * np.einsum("pij,pj->pi", terms, self.sizes)).all(axis=1)

    def _close(self, which):
        """Find the motions that come back after a period: by `continuation`, then by Newton's method on segments.

        Linear equations have the same matrix beside all their motions, so that Newton's method alone suffices.
        """
        period, sizes = self.period[which], self.sizes[which]
        longest = np.diff(self.edges[which], axis=1).max(axis=1)
        growth = np.log2(np.maximum(longest * period * self.scale[which] / GROWTH, 1.0))
        halvings = np.minimum(np.ceil(np.nan_to_num(growth)), MOST_HALVINGS).astype(int)
        self.count[which] = self.pieces[which] * 2**halvings
        self.nodes = np.repeat(self.start[:, None], self.count.max(), axis=1)
        if not self.model.perturbed_code(False).linear:

            def rates(numbers, x, phases):
                return self.mean_rates(which[numbers], x, phases)

            named, has_jumps = self._named_curves(which, rates), self.model.variation.has_jumps
            curves, self.status[which] = continuation.follow(rates, has_jumps, period, sizes, named, self.branch[which])
            for point, curve in zip(which, curves, strict=True):
                if self.status[point] == statuses.OK:
                    K = self.count[point]
                    times, *_ = self.between_jumps(np.arange(K) / K, [point])
                    self.nodes[point, :K] = continuation.values_at(curve, np.ravel(times)).T
        missing = self.status != statuses.OK
        self.closed[missing], self.nodes[missing] = np.inf, np.nan
        for K in np.unique(self.count[which]):
            part = which[(self.count[which] == K) & (self.status[which] == statuses.OK)]
            self._polish(part, self.nodes[:, :K])
        self.start = self.nodes[:, 0].copy()

    def mean_rates(self, which, x, phases) -> tuple:
        """Return `Variation.linearized` of points at equal phases of time; beside jumps, the means over their cells."""
        parameters = [p[which] for p in self.parameters]
        if not self.model.variation.has_jumps:
            return self.model.variation.linearized(parameters, x, phases)
        first, half, means = len(parameters) - self.switched.shape[2], 0.5 / phases.size, []
        for turn, k in np.ndindex(2, self.switched.shape[1]):  # the cell of the phase 0 begins in the last period
            times, begin, end = phases[:, None] + turn, self.edges[which, k], self.edges[which, k + 1]
            share = (np.minimum(times + half, end) - np.maximum(times - half, begin)) / (2.0 * half)
            if (share > 0.0).any():
                given = [*parameters[:first], *self.switched[which, k].T]
                rates, slopes = self.model.variation.linearized(given, x, times)
                slopes = slopes[-len(rates) :]  # those of velocities, which are states beside jumps, are left out
                share = np.maximum(share, 0.0)
                means.append((share * np.array(rates), share * np.array(slopes)))
        return tuple(np.sum(terms, axis=0) for terms in zip(*means, strict=True))

    def _named_curves(self, which, rates):
        """Return a function of points of these and phases: the places that the names give, relative to the sizes.

        They are at rest, or, if no equilibrium without the drive is near, move from there as the system does for a
        period, less a ramp that closes the motion.
        """
        places, sizes = self.start[which, : self.model.equations.m], self.sizes[which, : self.model.equations.m]
        moves = ~continuation.is_equilibrium(rates, self.sizes[which], places)

        def curves(numbers, phases):
            y, moving = np.repeat(places[numbers, :, None], phases.size, axis=2), np.flatnonzero(moves[numbers])
            some = which[numbers[moving]]
            if some.size:
                times = self.period[some, None] * np.append(phases, 1.0)
                at = [p[some] for p in self.parameters[: len(self.parameters) - self.switched.shape[2]]]
                x = motions.solved_between_jumps(self.model, at, self.start[some], times, 1e-10, self.sizes[some])[0]
                x = np.swapaxes(x[:, :, : y.shape[1]], 1, 2)
                y[moving] = x[:, :, :-1] - phases * (x[:, :, -1:] - x[:, :, :1])
            return y / sizes[numbers, :, None]

        return curves

    def _polish(self, which, nodes):
        """Find states at the starts of K segments, from which one leads to the next; they are changed in place.

        The motion is the only one near (Newton and Kantorovich) where, as far as states and slopes of the segments'
        maps are uncertain, these change by less than half of the least.
        """
        n, K, linear = self.model.equations.n, nodes.shape[1], self.model.perturbed_code(False).linear
        nudges, first = DIFFERENCE * np.vstack([np.zeros(n), np.eye(n), -np.eye(n)]), nodes.copy()
        self.status[which] = statuses.NOT_FOUND  # unless it closes
        each, count = np.arange(K), len(nudges)
        for _ in range(NEWTONS):
            if not which.size:
                break
            sizes, x = self.sizes[which, None], nodes[which]
            starts = (x[:, :, None] + nudges * sizes[:, :, None]).reshape(-1, n)
            begin, pace, given = self.between_jumps(each / K, which)
            begin, pace, *given = (np.broadcast_to(y, (K, which.size)).T for y in (begin.reshape(K, -1), pace, *given))
            times = self.period[which, None, None] * (begin[..., None] + pace[..., None] * np.array([0.0, 1.0 / K]))
            times, given = np.repeat(times.reshape(-1, 2), count, axis=0), [np.repeat(p, count) for p in given]
            least = np.repeat(self.sizes[which], K * count, axis=0)
            ends, error, _ = motions.solved(self.model.moving, given, starts, times, 1e-13, least)
            ends, error = (y[:, 1].reshape(-1, K, len(nudges), n) / sizes[:, :, None] for y in (ends, error))
            off, rounding = ends[:, :, 0] - np.roll(x, -1, axis=1) / sizes, error[:, :, 0]
            slopes = np.swapaxes(ends[:, :, 1:] - ends[:, :, :1], 2, 3) / DIFFERENCE
            plus, minus = np.split(slopes, 2, axis=3)
            bent, J = np.abs(plus + minus).sum(axis=3).max(axis=(1, 2)), np.zeros((which.size, K, n, K, n))
            J[:, each, :, each] = 0.5 * np.swapaxes(plus - minus, 0, 1)
            J[:, each, :, np.roll(each, -1)] -= np.eye(n)
            J = J.reshape(-1, K * n, K * n)
            limit = np.inf if linear else MAX_JUMP_POLISHING if self.model.variation.has_jumps else MAX_POLISHING
            bad = ~np.isfinite(J).all(axis=(1, 2)) | ~(np.abs(x - first[which]) < limit * sizes).all(axis=(1, 2))
            J[bad] = np.eye(K * n)
            U, singular, V = np.linalg.svd(J)
            weights = np.divide(1.0, singular, where=singular > 1e-9 * singular[:, :1], out=np.zeros(singular.shape))
            inverse = np.swapaxes(V, 1, 2) * weights[:, None] @ np.swapaxes(U, 1, 2)
            uncertain = (np.abs(off) + rounding).reshape(-1, K * n, 1)
            self.error[which] = (np.abs(inverse) @ uncertain).max(axis=(1, 2))
            alone = linear | (2.0 * bent * (1.0 + self.error[which] / DIFFERENCE) < singular[:, -1])
            distance = np.abs(off).max(axis=(1, 2))
            self.closed[which] = np.where(bad | ~alone, np.inf, distance)
            none = linear | ((distance <= CLOSED) & ~alone)
            self.status[which[none & ~bad]] = statuses.NO_PERIODIC_MOTION
            going = (np.abs(off) > rounding).any(axis=(1, 2)) & ~bad
            which = which[going]
            step = np.clip((inverse @ off.reshape(-1, K * n, 1)).reshape(-1, K, n), -1.0, 1.0)
            nodes[which] = (x - sizes * step)[going]

    def __call__(self, phases) -> np.ndarray:
        """Return the states at phases of the period, shape (n, phases, points); (n, 1, points) if all are at rest."""
        states_at, which = np.ascontiguousarray(self.start.T)[:, None], np.flatnonzero(~self.still)
        if not which.size:
            return states_at
        states_at, which = np.repeat(states_at, phases.size, axis=1), which[self.closed[which] <= CLOSED]
        ordered, number = np.unique(phases % 1.0, return_inverse=True)
        for K in np.unique(self.count[which]):
            part, states = which[self.count[which] == K], []
            for k, some in enumerate(np.split(ordered, np.searchsorted(ordered, np.arange(1, K) / K))):
                times = self.period[part, None] * self.between_jumps(np.insert(some, 0, k / K), part)[0].T
                *_, given = self.between_jumps(np.array([k / K]), part)
                given = [np.ravel(p) for p in given]
                ends = motions.solved(self.model.moving, given, self.nodes[part, k], times, 1e-13, self.sizes[part])[0]
                states.append(ends[:, 1:])
            states_at[:, :, part] = np.moveaxis(np.concatenate(states, axis=1)[:, number], 0, 2).swapaxes(0, 1)
        return states_at

    def chosen(self, which) -> "Base":
        """Return the motions of some points."""
        part = object.__new__(Base)
        part.model, part.parameters = self.model, [p[which] for p in self.parameters]
        for name in OF_POINTS:
            setattr(part, name, getattr(self, name)[which])
        return part

    @cached_property
    def masses(self) -> np.ndarray:
        """Return the masses in the states' sizes and their inverse, (2 m², points), where half a period gives all."""
        points, m = self.period.size, self.model.equations.m
        if not self.even[0]:
            return np.empty((0, points))
        _, a, *_ = self.model.variation.parts(self.parameters, self(np.zeros(1)), np.zeros(1), True)
        a = [[np.ravel(a[i][j]) * self.sizes[:, m + i] * self.sizes[:, j] for j in range(m)] for i in range(m)]
        return np.reshape([*a, *divided(a, np.eye(m).tolist())], (-1, points))

    @cached_property
    def number(self) -> np.ndarray:
        """Number of segments of a period; 0 where there are too many, and where no motion is closed."""
        longest = np.diff(self.edges, axis=1).max(axis=1)
        angle = np.maximum(self.period * self.scale + 2.0 * np.pi, STEEP * self.steepness) * longest
        needed, numbers = np.ceil(angle / TURN), [1, 2, 3, *SEGMENTS] if self.model.variation.has_jumps else SEGMENTS
        known = np.isfinite(needed) & (self.closed <= CLOSED) & self.known
        at = np.searchsorted(numbers, np.where(known, needed, np.inf))
        segments = np.array([*numbers, 0])[at] * self.pieces
        return segments + self.even * segments % 2

    # -- of points of one kind

    def varied(self, steps: int, begin: float = 0.0) -> tuple[floquet.Matrices, np.ndarray, np.ndarray]:
        """Return the variational flow over a period that begins at a phase, in an even number of steps.

        Beside it come the matrix of the period that begins later, and the integral of the trace.
        """
        variation, still, n = self.model.variation, bool(self.still.all()), self.sizes.shape[1]
        half, first, h = self.even[0] and begin == 0.0, n - variation.unknowns, self.period / steps
        phases = begin + (np.arange(steps // 2 if half else steps)[:, None] + variational.POINTS).ravel() / steps
        times, pace, given = self.between_jumps(phases)
        h = h * pace
        factors, slopes = variation.at(given, self(phases), times, still)
        lengths = np.array([*self.sizes.T, *(self.masses if half else [])])
        lengths[first:n] *= h if first else 1.0
        for e, (_, j) in enumerate(variation.entries[still]):
            slopes[:, e] *= h * h if j < first else h
        weights, trace = np.tile(variational.WHOLE, phases.size // variational.STAGES), np.zeros(self.period.size)
        weights = [(weights * part).sum() for part in factors.T] if factors.size else weights
        for e in (e for e, (i, j) in enumerate(variation.entries[still]) if j == i + first):
            trace += sum(w * part[e] for w, part in zip(weights, slopes, strict=True))
        rows = variational.flow(*variation.kernels(still), factors, slopes, lengths, steps)
        matrices, later = with_errors(rows, n, ROUNDING)
        return matrices, np.moveaxis(later.reshape(n, n, -1), 2, 0), trace

    def followed(self, epsilon: np.ndarray, steps: int) -> tuple[floquet.Matrices, np.ndarray]:
        """Return matrices measured from perturbed motions, what the steps left out, and what the amplitude changes.

        The perturbation has the size epsilon, relative to the states' sizes, shape (points,); each segment has so many
        steps.
        """
        n, K, code = self.sizes.shape[1], int(self.number[0]), self.model.perturbed(bool(self.still[0]))
        some, sides = K // 2 if self.even[0] else K, [1.0] if code.linear or self.mirrored[0] else [1.0, -1.0]
        phases, (directions, owner) = np.arange(some if code.is_mixed else 1) / K, code.directions
        times, pace, given = self.between_jumps(phases)
        times = times if code.graph.equations.switches else times[:, None]
        place, sizes = [*self(phases), self.period * times], self.sizes.T
        x = (np.reshape(sides, (-1, 1, 1, 1)) * directions[:, :, None] * sizes).reshape(-1, n, self.period.size)
        rows, columns = code.starts(given, place, epsilon, self.period * pace / (K * steps), x)
        numbers = [K, steps, code.scratch, code.perturbed["x", 0], code.perturbed["e", 0], len(sides)]
        numbers.append(code.base["E", 0])
        inverses = np.array([*1.0 / sizes, n * self.error / epsilon, *self.masses])
        advance = jit.passed(code.module().advance)
        result = monodromy.measure(advance, rows, columns, inverses, owner, np.array(numbers))
        return with_errors(result, n, monodromy.NOISE * np.sqrt(steps / STEPS))

    def measured(self, epsilon: np.ndarray, tolerance: float, steps: int = STEPS) -> tuple:
        """Return measured matrices in the states' sizes, and whether epsilon, or the steps, are too large.

        The steps of each segment are halved until they leave out less than the tolerance, relative to its matrix.
        """
        matrices, (left_out, amplitude) = self.followed(epsilon, steps)
        wide, unresolved = amplitude > WIDE, ~(left_out <= tolerance)
        left = np.flatnonzero(unresolved)
        if left.size and 2 * steps * int(self.number[0]) <= FINEST:
            finer, *others = self.chosen(left).measured(epsilon[left], tolerance, 2 * steps)
            matrices.put(left, finer)
            wide[left], unresolved[left] = others
        return matrices, wide, unresolved

    def certified(self, steps: int = 0, last: float | np.ndarray = np.inf) -> tuple:
        """Return the variational flow's matrices, the difference of their traces from two phases, and determinants.

        In longer steps the matrices from both phases differed by `last`.
        """
        steps = steps or 2 * (5 * int(self.number[0]) // 8 + 1)  # an even number: four for three segments
        if has_jumps := self.model.variation.has_jumps:  # steps end there
            steps += -steps % (5 * int(self.pieces[0]))
        flow, other, trace = self.varied(steps)
        coarser, *_ = self.varied(4 * steps // 5, 0.0 if has_jumps else round(monodromy.ELSEWHERE * steps) / steps)
        other = flow.matrix if has_jumps else other
        apart, noise = COARSER * floquet.largest(other - coarser.matrix), floquet.largest(flow.error)
        elsewhere, determinant = np.abs(np.einsum("nii->n", flow.matrix - coarser.matrix)), np.exp(trace)
        flow.error[:] += apart[:, None, None]
        second = np.abs(flow.second[0] - coarser.second[0])
        flow.second[1] += np.nan_to_num(second)  # none where no entry is large there
        rounded = (apart >= FALLING * last) & (apart <= ROUNDED * floquet.largest(flow.matrix))
        left = np.flatnonzero(~(apart <= noise) & ~rounded)
        if left.size and 3 * steps // 4 * 2 <= FINEST:
            finer, *others = self.chosen(left).certified(3 * steps // 4 * 2, apart[left])
            flow.put(left, finer)
            elsewhere[left], determinant[left] = others
        return flow, elsewhere, determinant


def with_errors(rows: np.ndarray, n: int, noise: float) -> tuple[floquet.Matrices, np.ndarray]:
    """Return matrices with errors from rows (rows, points) of `kernels.monodromy.compose`, and what is behind.

    Of n states, in their sizes. An error whose size is 1 there is `noise`; the minors' counts twice.
    """
    entries, (turns, *minors), further = np.split(rows, [2 * n * n, 2 * n * n + 3])
    matrix, error = np.moveaxis(entries.reshape(2, n, n, turns.size), 3, 1)
    return floquet.Matrices(matrix, noise * error, turns, np.array(minors) * [[1.0], [2.0 * noise]]), further


def alike(base: Base) -> Iterator[np.ndarray]:
    """Yield the numbers of points that are followed side by side: of one kind, and not too many at once."""
    kinds = (
        2.0**20 * base.pieces + 16 * base.number + 8 * base.even + 4 * base.reciprocal + 2 * base.still + base.mirrored
    )
    for key in np.unique(kinds):
        which = np.flatnonzero(kinds == key)
        size = max(1, TOGETHER // (max(1, base.number[which[0]]) * base.sizes.shape[1] ** 2))
        yield from (which[first : first + size] for first in range(0, which.size, size))


def survey(model, points, tolerance: float) -> dict[str, np.ndarray]:
    """Return all columns of points (each parameter, `epsilon`, `equilibrium`: number of the name)."""
    slot = np.asarray(points["equilibrium"])
    base = Base(model, model.parameters(points, slot.size), slot)
    epsilon, columns = np.asarray(points["epsilon"], dtype=np.float64), {}
    for part in alike(base):
        for name, values in _columns(base.chosen(part), epsilon[part], tolerance).items():
            fill = np.nan if values.dtype == float else 0
            columns.setdefault(name, np.full((slot.size, *values.shape[1:]), fill, values.dtype))[part] = values
    starts = {f"{x.name}_start": base.start[:, i] for i, x in enumerate(model.equations.states)}
    starts["branch"] = np.where(base.closed <= CLOSED, base.branch, 0).astype(np.int8)
    return columns | starts | {"base_residual": base.closed, "steps": base.number.astype(np.int32)}


@np.errstate(all="ignore")
def refusal(model, parameters) -> str:
    """Return why none of these points has a periodic motion to measure; nothing if one has."""
    flags, labels = [], model.system.labels
    if not labels:
        return "equilibrium: no start of the periodic motion is named; allowed: system.equilibrium(name, {x: place, …})"
    for slot in range(len(labels)):
        base = Base(model, parameters, np.full(parameters[0].size, slot))
        if not (base.period > 0.0).any():
            return f"period: {model.system.given_period} is {base.period[0]:.6g} s; allowed: a finite time > 0"
        flags.append((base.finite.any(), (base.closed <= CLOSED).any(), (base.number > 0).any()))
    finite, closed, bounded = map(any, zip(*flags, strict=True))
    if not finite:
        return (
            f"coefficients: near {', '.join(labels)} they are no finite doubles at some times of the period; allowed: "
            "smooth, bounded functions of the time, which SymPy does not take apart (exp(10000*(cos(t) - 1)): of "
            "exp(1e4*(cos(t) - 1)) it makes 1e-4344*exp(1e4*cos(t)))"
        )
    if not closed:
        return (
            f"base motion: none of the system's period begins near {', '.join(labels)} (it ends at a fold while the "
            "drive is switched on, is not found, or others beside it close as well); allowed: an equilibrium at all "
            "times, one without the drive, or a start near a periodic motion"
        )
    if not bounded or is_jagged(base):
        return (
            "coefficients: they jump, have a kink or a pole, or are too fast for the period; allowed: smooth, bounded "
            "functions of the time, or sign, floor, Piecewise of what crosses its jumps with a slope, or system.jump(t)"
        )
    return ""


def is_jagged(base: Base) -> bool:
    """Return True if at none of some points the Fourier series of the coefficients at the named start falls off."""
    if base.model.variation.has_jumps:
        return False
    some, phases = base.chosen(slice(EXAMINED)), np.arange(FOURIER) / FOURIER
    _, slopes = some.model.variation.at(some.parameters, some.start.T[:, None], phases, False)
    terms = np.abs(np.fft.rfft(slopes, axis=0)).max(axis=1)
    return not (terms[FOURIER // 4 :].max(axis=0) <= FALLEN * terms.max(axis=0)).any()


@np.errstate(all="ignore")
def _columns(base, epsilon, tolerance):
    """Return columns of points with one number of segments."""
    (points, n), reciprocal = base.sizes.shape, bool(base.reciprocal[0])
    nothing, elsewhere, determinant = np.full((points, n, n), np.nan), np.full(points, np.nan), 1.0
    blind = linear = floquet.Matrices(nothing, nothing)
    wide, unresolved = False, base.number == 0
    if base.number[0]:
        blind, wide, unresolved = base.measured(epsilon, tolerance)
        linear, elsewhere, determinant = base.certified()
        linear.matrix[elsewhere > TWO_PHASES * floquet.largest(linear.matrix)] = np.nan
        blind.matrix[wide] = np.nan
    columns, agree = floquet.compared(blind, linear, elsewhere, base.period, reciprocal, determinant, base.acting)
    sound = np.isfinite(floquet.largest(blind.matrix + blind.error))
    missing = ~(base.closed <= CLOSED)
    cases = {
        statuses.NON_FINITE: ~base.finite,
        statuses.NO_PERIODIC_MOTION: missing & (base.status != statuses.NOT_FOUND),
        statuses.NOT_FOUND: missing,
        statuses.PERTURBATION_TOO_LARGE: wide,
        statuses.NOT_CONVERGED: unresolved | (sound & ~agree),
    }
    status = np.select([*cases.values(), ~sound], [*cases, statuses.NON_FINITE], statuses.OK)
    return columns | {"status": status.astype(np.int8)}
