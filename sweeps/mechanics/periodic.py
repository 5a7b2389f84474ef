r"""Perturbations of a periodic motion over one period: matrices from perturbed runs, and from the variational flow.

*Base motion.* It begins at the named place, at rest at the time 0: if the rates vanish there at all times it is an
equilibrium; else the motion with the system's period is followed from there while the drive is switched on
(`sweeps.mechanics.continuation`), and Newton's method on the maps of segments finds its states to rounding.

*Segments.* A period T is cut into K segments of equal length, at most MAX_SEGMENT_ANGLE/(S + 2 pi/T). S, a bound on
every rate along the base motion, and the sizes of the states come from the absolute values of the Jacobian's terms, as
in `sweeps.mechanics.relative`. So no perturbation grows much before it is sampled, however large the multipliers are.
If functions of the time are steep (`sweeps.mechanics.steepness`), there are more segments.

*Measuring.* From the base motion at each segment's start the full equations are integrated with perturbations +epsilon
and -epsilon in each direction (only +epsilon if the equations are odd or linear), by the steps of
`sweeps.mechanics.perturbed`, which are halved until their truncation is below the tolerance; `kernels.flow.monodromy`
composes the matrix of the period. Unless the derivation proves that the equations are linear, one more motion begins at
twice the sum of all directions: its distance from the sum of the other motions is the effect of the amplitude.

*Block.* Of a model with a block of states (`sweeps.mechanics.model.Model`) the perturbations are infinitesimal, and the
same Taylor steps integrate the base motion and its tangent flow together, from each node on. A second run from a base
motion that is shifted by its uncertainty, in steps that are longer by their rounding, shows the effect of both. If the
motion and the equations are proved to be their own mirror image in time, half a period is integrated.

*Certificate.* The variational flow by collocation at Gauss's points, of order 16 (`kernels.flow.variational`), with
derivatives of the equations by SymPy: it shares nothing with the generated Taylor steps. It is integrated again in
fewer steps from another phase, and compared, entry by entry, with the matrix that the finer steps give for the period
that begins there: steps are shortened by a third until the difference is rounding. If Hamilton's equations are proved
to be even in the time, half a period gives the measured matrix and the finer flow; the coarser one covers all of it.

*Jumps.* If coefficients jump, or have a kink, at times of the period (`sweeps.mechanics.jumps`), the pieces between
them have equal shares of the phase: segments and steps of points with equally many pieces end at the jumps together,
and the time goes faster in a longer piece. Then velocities are states of the variational flow, and both of its
solutions begin at the phase 0.

Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.7 and II.9; derived again.
"""

from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np
import sympy as sp

from kernels.compile import jit
from kernels.estimator import statuses
from kernels.flow import floquet, jacobians, monodromy, variational
from kernels.flow.matrices import find_coupled
from sweeps.mechanics import continuation, motions
from sweeps.mechanics.equations import Equations, term_coefficients
from sweeps.mechanics.graph import compile_expression
from sweeps.mechanics.landscape import magnitude

MAX_SEGMENT_ANGLE = 2.8  # rad, rotation of a perturbation within a segment; below pi, so that it cannot alias
PULSE_FRACTION = 0.25  # segments are at most this over the steepest function of time: steps then meet all of its pulses
SEGMENT_NUMBERS = [k * 2**j for j in range(9) for k in (4, 5, 6, 7)]  # allowed numbers: few, so that points share them
FIRST_STEPS = 2  # Taylor steps of a segment in the first try
FIRST_TANGENT_STEPS = 3  # the same of a tangent flow: 99 of 100 bodies at eccentricities up to 0.3 then reach 1e-12
MAX_AMPLITUDE_EFFECT = 0.1  # relative change of a segment's matrix by the amplitude; beyond: perturbation_too_large
MAX_GROUP_ENTRIES = 262_144  # segments times entries of the matrices of points that are integrated together
BOUNDS_CHUNK = 2048  # points with bounds that are computed together: their arrays fit into the processor's cache
MIN_REDUCTION = 0.25  # a difference that a refinement reduces by less than this factor is rounding or amplitude
MAX_TRACE_DIFFERENCE = 1e-6  # relative to the matrix; a certificate fails if its traces from two phases differ by more
MAX_ROUNDING = 1e-11  # relative to the matrix; larger differences are not rounding, even if they no longer fall
MAX_STEPS = 1 << 14  # steps in a period, for the last refinements
MAX_RATE_AT_REST = 64 * float(np.finfo(np.float64).eps)  # relative to the largest rates; below, the base is at rest
COARSE_ERROR_SHARE = 0.1  # error of the finer flow over the difference of both: order 16, 5/4 times the steps
FLOW_ROUNDING = 8 * float(np.finfo(np.float64).eps)  # rounding error of the variational flow's matrices
SLOPE_STEP, MAX_NEWTON_STEPS = 1e-6, 16  # relative step that differentiates the segments' maps; Newton steps
MAX_GROWTH_EXPONENT = 4.0  # a perturbation grows at most by exp(4) within a segment of Newton's method
MAX_SHOOTING_HALVINGS = 5  # Newton's method has at most 2**5 segments for each piece
MAX_POLISHING = 1e-2  # largest distance of a motion from the collocated one, in state sizes; beyond, it is another one
MAX_JUMP_POLISHING = 0.05  # the same if the drive jumps: a polynomial's slopes are off by its phases' distance
JUMP_MARGIN = 1e-9  # phases closer to the end of a piece than this fraction of it are taken as the end
CHECK_POINTS, CHECK_PHASES = 8, 4096  # points and phases at which the Fourier series of the coefficients is checked
MAX_FOURIER_TAIL = 1e-9  # largest high harmonic of smooth coefficients, relative to the largest harmonic
MAX_RESIDUAL = 1e-9  # largest distance of a periodic motion from closed, in state sizes
POINT_ATTRIBUTES = (  # attributes of BaseMotions that have one row for each point
    *("period", "start", "nodes", "num_nodes", "branch", "status", "residual", "error", "is_still", "is_even"),
    *("is_odd", "scale", "num_pieces", "edges", "switches", "jumps_known", "sizes", "coupling", "has_pairs"),
    *("num_segments", "steepness", "is_finite"),
)


class Variation:
    """Slopes of the rates at any state and phase of the period, in NumPy, and the absolute values of their terms.

    All points share the phases, and the time is replaced by phase times period in symbols: so functions of the phase
    alone are evaluated once for all points.
    """

    def __init__(self, equations: Equations, block: tuple[int, ...] | None = None):
        self.equations, self.m, self.is_second_order = equations, equations.m, bool(equations.v)
        self.block = tuple(range(equations.n)) if block is None else block  #: states of the flow
        self._phase = phase = sp.Symbol("phase", real=True)
        self._kernels: dict[bool, tuple] = {}
        of_phase = {equations.system.time: phase * equations.system.given_period}
        forces, masses = ([e.subs(of_phase) for e in rows or ()] for rows in (equations.forces, equations.a))
        self.has_jumps = bool(equations.switches)
        slopes, mirror = sp.Matrix(forces).jacobian(equations.states), {x: -x for x in equations.states}
        if is_part := len(self.block) < equations.n:  # the block vanishes in the base motion
            slopes = slopes.subs({equations.states[i]: 0 for i in self.block})
        J, a = slopes.subs(equations.still), [e.subs(equations.still) for e in masses]
        odd_terms = [sp.Integer(1)]
        if self.is_second_order:
            odd_terms = [*(J - J.subs(phase, -phase)), *J[:, self.m :], *(e.diff(phase) for e in a)]
            odd_terms = term_coefficients(odd_terms, (*equations.states, phase))
        pair_terms = pairing_conditions(equations)
        self._proofs = (
            compile_expression(equations.parameters, [equations.system.given_period, *pair_terms, *odd_terms]),
            len(pair_terms),
        )
        self._still_blocks = self._lambdify([*J, *a])
        self._separate = None if self.has_jumps else self._separate_phase(J, a)
        has_slope = np.reshape([e != 0 for e in J], J.shape)
        if any(e != 0 for i, e in enumerate(a) if i % (self.m + 1)):
            has_slope[:] = has_slope.any(axis=0)  # masses couple accelerations that forces do not
        #: number of unknowns of the variational flow: of coordinates, unless steps differ, accelerations
        self.unknowns = len(self.block) if self.has_jumps or is_part else self.m
        #: rates of coordinates, which are equations of the flow if there are jumps
        self.velocities = np.eye(self.m, equations.n, self.m)[: equations.n - self.m if self.has_jumps else 0]
        has_slope = np.vstack([self.velocities != 0, has_slope])
        if is_part:
            has_slope = has_slope[np.ix_(self.block, self.block)]
        #: at rest or not → (i, j): the acceleration or rate i of the block depends on its state j
        self.entries = {
            rest: tuple(map(tuple, np.argwhere(has_slope | (not rest and not is_part)).tolist()))
            for rest in (True, False)
        }
        self._moving_blocks = self._lambdify(
            [*slopes, *masses, *(e.diff(q) for e in masses for q in equations.q), *forces]
        )
        self._terms = self._lambdify([magnitude(e) for e in slopes])
        time_symbols, numbers = (phase, *equations.switches), np.ndindex(slopes.shape)
        pulses = [(e, entry) for e, entry in zip(slopes, numbers, strict=True) if e.has(*time_symbols)]
        pulses = [(f, entry) for e, entry in pulses for f in term_coefficients([e], (*equations.states, *time_symbols))]
        self._pulses = compile_expression(equations.parameters, [f for f, _ in pulses]), [entry for _, entry in pulses]
        self._coupled = np.reshape([e != 0 for e in masses], (self.m, -1))
        with_sign = [*((e, 1) for e in forces), *((e, -1) for e in masses)]
        self.is_odd = all(sp.expand(e + sign * e.subs(mirror)) == 0 for e, sign in with_sign)

    def kernels(self, still):
        """Return the compiled function of `kernels.flow.variational.integrate_flow`, and which states are coupled."""
        if still not in self._kernels:
            m, n, entries = self.unknowns, len(self.block), self.entries[still]
            couplings = [(i, i + n - m, j, j % m) for i, j in [*entries, *np.ndindex(m, 1)]]
            self._kernels[still] = jit.passed(variational.compile_step(m, n, entries)), find_coupled(n, couplings)
        return self._kernels[still]

    def prove_symmetries(self, parameters) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return (period, has_pairs, is_even), shape (points,): multipliers come in pairs, half a period suffices.

        The latter is true at rest, if Hamilton's equations are even in the time and have no terms in velocities.
        """
        conditions_at, count = self._proofs
        period, *conditions = conditions_at(*parameters)
        has_pairs, is_even = (
            (np.array([period, *terms])[1:] == 0.0).all(axis=0) for terms in (conditions[:count], conditions)
        )
        return period, has_pairs, is_even

    def _lambdify(self, expressions):
        """Return a NumPy function of parameters, states and the phase that returns each expression, not broadcast."""
        return compile_expression(
            (*self.equations.parameters, *self.equations.states, self._phase), expressions, broadcast=False
        )

    def jacobian_blocks(self, parameters, x, phases, at_rest):
        """Return (slopes of forces, masses, the masses' slopes times accelerations, accelerations).

        The last two are empty at rest.

        Args:
            parameters: one array for each.
            x: one array (phases, points) for each state.
            phases: phases of the period.
            at_rest: all points are at equilibria.
        """
        m, n = range(self.m), range(self.equations.n)
        phases = phases[:, None] if phases.ndim == 1 else phases
        values = iter((self._still_blocks if at_rest else self._moving_blocks)(*parameters, *x, phases))
        J = [[next(values) for _ in n] for _ in m]
        if not self.is_second_order:
            return J, None, [], [*values]
        a = [[next(values) for _ in m] for _ in m]
        if at_rest:
            return J, a, [], []
        mass_slopes = [[[next(values) for _ in m] for _ in m] for _ in m]
        rates = [rate for (rate,) in solve_elementwise(a, [[force] for force in values])]
        return J, a, [[sum(row[j][k] * rates[j] for j in m) for k in m] for row in mass_slopes], rates

    def coupling(self, parameters, terms) -> np.ndarray:
        """Return which states act on which, (points, n, n): by `terms` of `term_bounds`, and by short pulses."""
        coupling, m = terms > 0.0, self.m
        function, entries = self._pulses
        for value, (i, j) in zip(function(*parameters), entries, strict=True):
            coupling[:, i - m, j] |= value != 0.0
        coupling[:, -m:, -m:] |= self._coupled if self.is_second_order else False
        return coupling

    def _separate_phase(self, slopes, masses):
        """Return (functions of the phase, their coefficients and the masses in the parameters), or None.

        Each slope is then a sum of products of a function of the phase and a coefficient.
        """
        coefficients = {}
        if any(e.has(self._phase) for e in masses):
            return None
        for k, e in enumerate(slopes):
            for term in sp.Add.make_args(sp.expand(e, power_exp=False)):
                coefficient, phase_function = term.as_independent(self._phase, as_Add=False)
                if phase_function.free_symbols - {self._phase}:
                    return None
                coefficients.setdefault(phase_function, [sp.Integer(0)] * len(slopes))[k] += coefficient
        return compile_expression([self._phase], coefficients), self._lambdify(
            [*(e for row in coefficients.values() for e in row), *masses]
        )

    def slope_sum(self, parameters, x, phases, at_rest) -> tuple[np.ndarray, np.ndarray]:
        """Return factors (phases, terms) and slopes (terms, entries, points), for a sum of products at each phase.

        If slopes are no such sums, there are no factors, and `slopes` are those at all phases.

        Args:
            parameters: one array (points,) for each; with jumps see `BaseMotions.between_jumps`.
            x: one array (phases, points) for each state, or (1, points) at rest.
            phases: shape (phases,).
            at_rest: all points are at equilibria.
        """
        m, n, points, entries = self.m, self.equations.n, parameters[0].size, self.entries[at_rest]
        if at_rest and self._separate:
            functions, evaluate = self._separate
            factors, values = (np.stack(functions(phases), axis=1), iter(evaluate(*parameters, *x[:, 0], np.zeros(1))))
            terms = [[[next(values) for _ in range(n)] for _ in range(m)] for _ in range(factors.shape[1])]
            a = [[next(values) for _ in range(m)] for _ in range(m)] if self.is_second_order else None
            terms = [solve_elementwise(a, J) if self.is_second_order else J for J in terms]
            slopes = np.empty((len(terms), len(entries), points))
        else:
            factors, slopes = np.empty((len(phases), 0)), np.empty((len(phases), len(entries), points))
            terms = [[*self.velocities.tolist(), *self.rates_and_slopes(parameters, x, phases, at_rest)[1]]]
        for k, J in enumerate(terms):
            for e, (i, j) in enumerate(entries):
                slopes[k if factors.size else slice(None), e] = J[self.block[i]][self.block[j]]
        return factors, slopes

    def rates_and_slopes(self, parameters, x, phases, at_rest=False) -> tuple[list, list]:
        """Return accelerations or rates (none if `at_rest`) and their slopes by all states.

        Args:
            parameters: one array (points,) for each.
            x: one array (phases, points) for each state.
            phases: fractions of the period, (phases,).
            at_rest: True for an equilibrium.
        """
        J, a, mass_slopes, rates = self.jacobian_blocks(parameters, x, phases, at_rest)
        for row, addition in zip(J, mass_slopes, strict=not at_rest and self.is_second_order):
            row[: self.m] = [y - z for y, z in zip(row, addition, strict=False)]
        J, shape = solve_elementwise(a, J) if self.is_second_order else J, (len(phases), parameters[0].size)
        return [np.broadcast_to(y, shape) for y in rates], [[np.broadcast_to(y, shape) for y in row] for row in J]

    def term_bounds(self, parameters, x, phases) -> tuple[np.ndarray, np.ndarray]:
        """Return the largest rates (points, n) and Jacobian terms (points, n, n) for `parameters`, `x` and `phases`."""
        m, n, points = self.m, self.equations.n, parameters[0].size
        if points > BOUNDS_CHUNK:
            chunks = np.split(np.arange(points), range(BOUNDS_CHUNK, points, BOUNDS_CHUNK))
            results = [
                self.term_bounds(
                    [p[..., chunk] for p in parameters],
                    x[:, :, chunk],
                    phases[..., chunk] if self.has_jumps else phases,
                )
                for chunk in chunks
            ]
            return tuple(map(np.concatenate, zip(*results, strict=True)))
        _, a, mass_slopes, rates = self.jacobian_blocks(parameters, x, phases, False)
        values = iter(self._terms(*parameters, *x, phases if self.has_jumps else phases[:, None]))
        terms = [[next(values) for _ in range(n)] for _ in range(m)]
        if self.is_second_order:
            for row, addition in zip(terms, mass_slopes, strict=True):
                row[:m] = [y + np.abs(z) for y, z in zip(row, addition, strict=False)]
            inverse = solve_elementwise(a, np.eye(m).tolist())
            rows = [[sum(np.abs(y) * terms[j][k] for j, y in enumerate(row)) for k in range(n)] for row in inverse]
            terms, rates = [*np.eye(m, n, m).tolist(), *rows], [*x[m:], *rates]
        rows, largest = [[*row, rate] for row, rate in zip(terms, rates, strict=True)], np.empty((points, n, n + 1))
        for i, j in np.ndindex(n, n + 1):
            largest[:, i, j] = np.abs(np.atleast_2d(rows[i][j])).max(axis=0)
        return largest[:, :, n], largest[:, :, :n]


def solve_elementwise(a, right):
    """Return X of a X = right, matrices of arrays, by elimination without pivoting; a is positive definite."""
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


def pairing_conditions(equations: Equations) -> list[sp.Expr]:
    """Return expressions in the parameters: if all vanish, the multipliers are proved to come in pairs of product 1.

    For coordinates they are factors of the velocities' terms and of the curl of the forces in addition to T and V: if
    all vanish, the forces Q(q, t) have a potential, and the equations are Hamilton's. For two states, the divergence;
    none for states that are canonical ones in disguise.
    """
    if equations.v:
        R = sum(equations.system.dissipation_terms)
        Q = [equations.system.forces.get(q, 0) - sp.diff(R, v) for q, v in zip(equations.q, equations.v, strict=True)]
        curl = [sp.diff(Q[i], equations.q[j]) - sp.diff(Q[j], equations.q[i]) for j in range(len(Q)) for i in range(j)]
        conditions = [*(sp.diff(e, v) for e in Q for v in equations.v), *curl]
    elif equations.system.is_hamiltonian:
        return []
    elif equations.n == 2:
        conditions = [sum(f.diff(x) for f, x in zip(equations.f, equations.q, strict=True))]
    else:
        return [sp.Integer(1)]
    return term_coefficients(conditions, (*equations.states, equations.system.time, *equations.switches))


class KnownMotions(NamedTuple):
    """Periodic motions of points in some of their states: attributes of `BaseMotions`."""

    nodes: np.ndarray
    num_nodes: np.ndarray
    sizes: np.ndarray
    residual: np.ndarray
    status: np.ndarray
    error: np.ndarray


class BaseMotions:
    """The periodic motions of points: of a model, parameters (points,), and indices of names, (points,).

    If the model has a block of states that vanish, motions `within` the others, of a model with these alone, are taken
    as they are. Motions with known `starts`, (points, states), are not searched for.
    """

    @np.errstate(all="ignore")
    def __init__(self, model, parameters, slot, within: KnownMotions | None = None, starts=None):
        parameters = model.with_switches(parameters)
        self.model, self.parameters, size = model, parameters, slot.size
        self.subspace = np.setdiff1d(np.arange(model.equations.n), model.variation.block)
        places = np.take_along_axis(model.landscape.starts(parameters), slot[:, None, None], axis=1)[:, 0]
        self.start = np.zeros((size, model.equations.n))
        self.start[:, : places.shape[1]] = places
        self.residual, self.error, self.status = np.zeros(size), np.zeros(size), np.full(size, statuses.OK)
        self.num_nodes, self.nodes = np.ones(size, dtype=int), self.start[:, None]
        self.is_still = np.ones(size, dtype=bool)  # until the rates are known
        self.branch = np.array([*model.system.branches.values(), *[1] * model.system.most])[slot]
        self.period, self.has_pairs, self.is_even = model.variation.prove_symmetries(parameters)
        self._cut()
        self.is_still = self._measure_sizes(places)
        if within is not None:  # a motion may begin where it could rest
            self.is_still &= ~within.nodes.any(axis=(1, 2))
        self.is_finite = np.isfinite(self.scale)
        self.is_even &= self.is_still
        self.is_odd = self.is_still & model.variation.is_odd & ~self.start.any(axis=1)
        if not self.is_still.all():
            model.perturbed(False)
            self.residual[~self.jumps_known], self.status[~self.jumps_known] = np.inf, statuses.NOT_FOUND
            if within is None:
                self._close(np.flatnonzero(~self.is_still & self.jumps_known), starts)
                self._measure_sizes(places)
            else:
                self._embed(within, places)
        if model.system.is_reversible:  # a motion from x = 0 is its own mirror image in time
            is_odd_start = np.abs(self.start[:, 0]) <= motions.ERROR_FACTOR * self.error * self.sizes[:, 0]
            self.start[is_odd_start, 0] = self.nodes[is_odd_start, 0, 0] = 0.0
            self.is_even = self.start[:, 0] == 0.0
        self.is_even &= self.num_pieces == 1
        sides = [[*parameters[: len(parameters) - side.shape[1]], *side.T] for side in np.swapaxes(self.switches, 0, 1)]
        self.steepness = np.max([model.steepness([*side, *self.start.T]) for side in sides], axis=0)

    def _cut(self):
        """Set number and ends of the pieces between jumps, in periods, and the switches in each."""
        size = self.period.size
        self.edges, self.switches = np.tile([0.0, 1.0], (size, 1)), np.zeros((size, 1, 0))
        pieces = np.ones(size, int)
        if self.model.variation.has_jumps:
            edges, self.switches, pieces = self.model.jumps.pieces(self.parameters, self.period)
            self.edges = edges / self.period[:, None]
        self.num_pieces, self.jumps_known = np.maximum(pieces, 1), pieces > 0

    def between_jumps(self, phases, which=None) -> tuple[np.ndarray, np.ndarray | float, list]:
        """Return times over the period, their rate by the phase, and parameters, at phases, of points (default: all).

        If there are jumps, times, rates and switches have the shape (phases, points), else times are the phases.
        Phases are shared evenly between the pieces, and those at a jump belong to the later one.
        """
        which = np.arange(self.num_pieces.size) if which is None else np.asarray(which)
        values = [p[which] for p in self.parameters]
        if not self.model.variation.has_jumps:
            return phases, 1.0, values
        position = phases[:, None] % 1.0 * self.num_pieces[which]
        piece_index = np.minimum((position + JUMP_MARGIN).astype(int), self.num_pieces[which] - 1)
        begin, end = self.edges[which, piece_index], self.edges[which, piece_index + 1]
        switches = np.moveaxis(self.switches[which, piece_index], 2, 0)
        times = begin + (end - begin) * (position - piece_index)
        return times, (end - begin) * self.num_pieces[which], [*values[: len(values) - len(switches)], *switches]

    def _measure_sizes(self, places):
        """Set the states' sizes and the bound S on every rate along the motion; return True for motions at rest."""
        phases = (np.arange(32) + 0.5) / 32
        times, _, values = self.between_jumps(phases)
        rates, terms = self.model.variation.term_bounds(values, self(phases), times)
        self.coupling = self.model.variation.coupling(self.parameters, terms)
        terms = terms + np.eye(terms.shape[-1]) / self.period[:, None, None]
        sizes = self.model.landscape.sizes(self.parameters, list(places.T))
        if self.model.equations.v:
            sizes = jacobians.add_velocity_sizes(terms, sizes)
        self.scale, self.sizes = jacobians.rate_bounds(terms, sizes)
        if self.subspace.size:  # no term determines the sizes of independent states relative to all others
            largest = np.delete(self.sizes, self.subspace, axis=1).max(axis=1)
            self.sizes[:, self.subspace] *= (largest / self.sizes[:, self.subspace].max(axis=1))[:, None]
        return (rates <= MAX_RATE_AT_REST * np.einsum("pij,pj->pi", terms, self.sizes)).all(axis=1)

    def _close(self, which, starts):
        """Find the motions that close after a period: by `continuation`, then by Newton's method on segments.

        Linear equations have the same variational flow along every motion, so that Newton's method alone suffices, as
        it does for motions with known `starts`.
        """
        period, sizes = self.period[which], self.sizes[which]
        longest = np.diff(self.edges[which], axis=1).max(axis=1)
        growth_exponent = np.log2(np.maximum(longest * period * self.scale[which] / MAX_GROWTH_EXPONENT, 1.0))
        halvings = np.minimum(np.ceil(np.nan_to_num(growth_exponent)), MAX_SHOOTING_HALVINGS).astype(int)
        self.num_nodes[which] = self.num_pieces[which] * 2**halvings
        self.nodes = np.repeat(self.start[:, None], self.num_nodes.max(), axis=1)
        if starts is not None:
            self.status[which[~np.isfinite(starts[which]).all(axis=1)]] = statuses.NOT_FOUND
        elif not self.model.is_linear:

            def rates(numbers, x, phases):
                return self.mean_rates(which[numbers], x, phases)

            variation, named_curves = self.model.variation, self._named_curves(which, rates)
            curves, self.status[which] = continuation.follow_motions(
                variation, rates, period, sizes, named_curves, self.branch[which]
            )
            for point, curve in zip(which, curves, strict=True):
                if self.status[point] == statuses.OK:
                    K = self.num_nodes[point]
                    times, *_ = self.between_jumps(np.arange(K) / K, [point])
                    self.nodes[point, :K] = continuation.values_at(curve, np.ravel(times)).T
        missing = self.status != statuses.OK
        self.residual[missing], self.nodes[missing] = np.inf, np.nan
        for K in np.unique(self.num_nodes[which]):
            members = which[(self.num_nodes[which] == K) & (self.status[which] == statuses.OK)]
            if starts is not None:
                times, values = self.period[members, None] * np.arange(K + 1) / K, [p[members] for p in self.parameters]
                states = motions.solve(self.model.moving, values, starts[members], times, 1e-12, self.sizes[members])[0]
                self.nodes[members, :K] = states[:, :-1]
            self._polish(members, self.nodes[:, :K])
        self.start = self.nodes[:, 0].copy()

    def _embed(self, within, places):
        """Take the motions of a model of the subspace; all other states vanish."""
        self.num_nodes, self.residual, self.status = within.num_nodes, within.residual, within.status
        self.nodes = np.zeros((*within.nodes.shape[:2], self.model.equations.n))
        self.nodes[:, :, self.subspace], self.start = within.nodes, self.nodes[:, 0]
        self._measure_sizes(places)
        self.error = within.error * (within.sizes / self.sizes[:, self.subspace]).max(axis=1)

    def mean_rates(self, which, x, phases) -> tuple:
        """Return `Variation.rates_and_slopes` at equal phases of time; means over cells if the drive jumps.

        Args:
            which: indices of points.
            x: states, shape (n, phases, points).
            phases: shape (phases,).
        """
        parameters = [p[which] for p in self.parameters]
        if not self.model.variation.has_jumps:
            return self.model.variation.rates_and_slopes(parameters, x, phases)
        first, half, means = len(parameters) - self.switches.shape[2], 0.5 / phases.size, []
        # the cell of the phase 0 begins in the last period
        for period_number, k in np.ndindex(2, self.switches.shape[1]):
            times, begin, end = phases[:, None] + period_number, self.edges[which, k], self.edges[which, k + 1]
            share = (np.minimum(times + half, end) - np.maximum(times - half, begin)) / (2.0 * half)
            if (share > 0.0).any():
                values = [*parameters[:first], *self.switches[which, k].T]
                rates, slopes = self.model.variation.rates_and_slopes(values, x, times)
                share = np.maximum(share, 0.0)
                means.append((share * np.array(rates), share * np.array(slopes)))
        return tuple(np.sum(terms, axis=0) for terms in zip(*means, strict=True))

    def _named_curves(self, which, rates):
        """Return the function (indices in `which`, phases) → curves y_0 of `continuation`, relative to the sizes.

        The curves stay at the named place; if no equilibrium without the drive is near, they follow the motion from
        there for a period, less a ramp that closes it.

        Args:
            which: indices of points.
            rates: of these points, as of `continuation.follow_motions`.
        """
        places, sizes = self.start[which, : self.model.equations.m], self.sizes[which, : self.model.equations.m]
        is_moving = ~continuation.is_equilibrium(rates, self.sizes[which], places)

        def curves(numbers, phases):
            """Return y_0 of points at phases, shape (points, coordinates or states, phases), relative to the sizes."""
            y, rows = (np.repeat(places[numbers, :, None], phases.size, axis=2), np.flatnonzero(is_moving[numbers]))
            ids = which[numbers[rows]]
            if ids.size:
                times = self.period[ids, None] * np.append(phases, 1.0)
                values = [p[ids] for p in self.parameters[: len(self.parameters) - self.switches.shape[2]]]
                states = motions.solve_between_jumps(
                    self.model, values, self.start[ids], times, 1e-10, self.sizes[ids]
                )[0]
                states = np.swapaxes(states[:, :, : y.shape[1]], 1, 2)
                y[rows] = states[:, :, :-1] - phases * (states[:, :, -1:] - states[:, :, :1])
            return y / sizes[numbers, :, None]

        return curves

    def _polish(self, which, nodes):
        """Find states at the starts of K segments that end at the next start; `nodes` are changed in place.

        The motion is locally unique (Newton and Kantorovich) if, within the uncertainty of states and slopes of the
        segments' maps, the slopes change by less than half of their least singular value.
        """
        n, K, linear = self.model.equations.n, nodes.shape[1], self.model.is_linear
        perturbations, first = SLOPE_STEP * np.vstack([np.zeros(n), np.eye(n), -np.eye(n)]), nodes.copy()
        self.status[which] = statuses.NOT_FOUND  # unless it closes
        segments, count = np.arange(K), len(perturbations)
        for _ in range(MAX_NEWTON_STEPS):
            if not which.size:
                break
            sizes, x = self.sizes[which, None], nodes[which]
            starts = (x[:, :, None] + perturbations * sizes[:, :, None]).reshape(-1, n)
            begin, pace, values = self.between_jumps(segments / K, which)
            begin, pace, *values = (
                np.broadcast_to(y, (K, which.size)).T for y in (begin.reshape(K, -1), pace, *values)
            )
            times = self.period[which, None, None] * (begin[..., None] + pace[..., None] * np.array([0.0, 1.0 / K]))
            times, values = np.repeat(times.reshape(-1, 2), count, axis=0), [np.repeat(p, count) for p in values]
            min_sizes = np.repeat(self.sizes[which], K * count, axis=0)
            ends, error, _ = motions.solve(self.model.moving, values, starts, times, 1e-13, min_sizes)
            ends, error = (y[:, 1].reshape(-1, K, len(perturbations), n) / sizes[:, :, None] for y in (ends, error))
            mismatch, rounding = ends[:, :, 0] - np.roll(x, -1, axis=1) / sizes, error[:, :, 0]
            slopes = np.swapaxes(ends[:, :, 1:] - ends[:, :, :1], 2, 3) / SLOPE_STEP
            forward, backward = np.split(slopes, 2, axis=3)
            curvature, J = np.abs(forward + backward).sum(axis=3).max(axis=(1, 2)), np.zeros((which.size, K, n, K, n))
            J[:, segments, :, segments] = 0.5 * np.swapaxes(forward - backward, 0, 1)
            J[:, segments, :, np.roll(segments, -1)] -= np.eye(n)
            J = J.reshape(-1, K * n, K * n)
            limit = np.inf if linear else MAX_JUMP_POLISHING if self.model.variation.has_jumps else MAX_POLISHING
            bad = ~np.isfinite(J).all(axis=(1, 2)) | ~(np.abs(x - first[which]) < limit * sizes).all(axis=(1, 2))
            J[bad] = np.eye(K * n)
            U, singular, V = np.linalg.svd(J)
            weights = np.divide(1.0, singular, where=singular > 1e-9 * singular[:, :1], out=np.zeros(singular.shape))
            inverse = np.swapaxes(V, 1, 2) * weights[:, None] @ np.swapaxes(U, 1, 2)
            uncertainty = (np.abs(mismatch) + rounding).reshape(-1, K * n, 1)
            self.error[which] = (np.abs(inverse) @ uncertainty).max(axis=(1, 2))
            is_unique = linear | (2.0 * curvature * (1.0 + self.error[which] / SLOPE_STEP) < singular[:, -1])
            distance = np.abs(mismatch).max(axis=(1, 2))
            self.residual[which] = np.where(bad | ~is_unique, np.inf, distance)
            is_singular = linear | ((distance <= MAX_RESIDUAL) & ~is_unique)
            self.status[which[is_singular & ~bad]] = statuses.NO_PERIODIC_MOTION
            is_open = (np.abs(mismatch) > rounding).any(axis=(1, 2)) & ~bad
            which = which[is_open]
            step = np.clip((inverse @ mismatch.reshape(-1, K * n, 1)).reshape(-1, K, n), -1.0, 1.0)
            nodes[which] = (x - sizes * step)[is_open]

    def __call__(self, phases) -> np.ndarray:
        """Return the states at phases of the period, shape (n, phases, points); (n, 1, points) if all are at rest."""
        states_at = np.ascontiguousarray(self.start.T)[:, None]
        if self.is_still.all():
            return states_at
        states_at = np.repeat(states_at, phases.size, axis=1)
        moving_points = np.flatnonzero(~self.is_still & (self.residual <= MAX_RESIDUAL))
        sorted_phases, index = np.unique(phases % 1.0, return_inverse=True)
        for K in np.unique(self.num_nodes[moving_points]):
            group, states = moving_points[self.num_nodes[moving_points] == K], []
            for k, inside in enumerate(np.split(sorted_phases, np.searchsorted(sorted_phases, np.arange(1, K) / K))):
                times = self.period[group, None] * self.between_jumps(np.insert(inside, 0, k / K), group)[0].T
                *_, constants = self.between_jumps(np.array([k / K]), group)
                constants = list(map(np.ravel, constants))
                setting = self.nodes[group, k], times, 1e-13, self.sizes[group]
                states.append(motions.solve(self.model.moving, constants, *setting)[0][:, 1:])
            states_at[:, :, group] = np.moveaxis(np.concatenate(states, axis=1)[:, index], 0, 2).swapaxes(0, 1)
        return states_at

    def select(self, which) -> "BaseMotions":
        """Return the motions of the selected points."""
        selection = object.__new__(BaseMotions)
        selection.model, selection.parameters = self.model, [p[which] for p in self.parameters]
        for name in POINT_ATTRIBUTES:
            setattr(selection, name, getattr(self, name)[which])
        return selection

    @property
    def sizes_of_block(self) -> np.ndarray:
        """Sizes of the states whose perturbations are measured, shape (points, states)."""
        return self.sizes[:, self.model.variation.block]

    @cached_property
    def masses(self) -> np.ndarray:
        """Masses in the states' sizes after half a period, and their inverse at its start, (2 m², points).

        Of canonical states they are 1. No rows if the whole period is integrated.
        """
        points, sizes = self.period.size, self.sizes_of_block.T
        m, rows = len(sizes) // 2, []
        for phase in (0.5, 0.0) if self.is_even[0] else ():
            at = self.start.T[:, None], np.array([phase])
            a = self.model.variation.jacobian_blocks(self.parameters, *at, True)[1] or np.eye(m).tolist()
            rows.append([[np.ravel(a[i][j]) * sizes[m + i] * sizes[j] for j in range(m)] for i in range(m)])
        rows[1:] = [solve_elementwise(a, np.eye(m).tolist()) for a in rows[1:]]
        return np.reshape([np.broadcast_to(x, points) for a in rows for row in a for x in row], (-1, points))

    @property
    def segment_length(self) -> int:
        """Length of a segment over that of MAX_SEGMENT_ANGLE: 2 in a tangent flow whose turns are not counted."""
        return 1 if self.model.block is None or len(self.model.block) == 2 else 2

    @cached_property
    def num_segments(self) -> np.ndarray:
        """Number of segments of a period; 0 if there are too many, or if no motion is closed."""
        longest = np.diff(self.edges, axis=1).max(axis=1)
        angle = np.maximum(self.period * self.scale + 2.0 * np.pi, PULSE_FRACTION * self.steepness) * longest
        count = np.ceil(angle / (MAX_SEGMENT_ANGLE * self.segment_length))
        allowed = [1, 2, 3, *SEGMENT_NUMBERS] if self.model.variation.has_jumps else SEGMENT_NUMBERS
        is_usable = np.isfinite(count) & (self.residual <= MAX_RESIDUAL) & self.jumps_known
        place = np.searchsorted(allowed, np.where(is_usable, count, np.inf))
        segments = np.array([*allowed, 0])[place] * self.num_pieces
        if self.model.block is not None:  # the motion begins anew at its nodes
            segments += -segments % self.num_nodes
        return segments + self.is_even * segments % 2

    # -- measurement of points of one kind

    def integrate_variation(self, steps: int, begin: float = 0.0) -> tuple[floquet.Matrices, np.ndarray, np.ndarray]:
        """Return the variational flow over a period from the phase `begin`, in an even number of steps.

        Also return the matrix of the period that begins at `kernels.flow.monodromy.SECOND_PHASE`, and the trace's
        integral.
        """
        variation, still, sizes = self.model.variation, bool(self.is_still.all()), self.sizes_of_block
        n = sizes.shape[1]
        is_half, first_velocity, step = self.is_even[0] and begin == 0.0, n - variation.unknowns, self.period / steps
        phases = begin + (np.arange(steps // 2 if is_half else steps)[:, None] + variational.POINTS).ravel() / steps
        times, pace, parameters_at = self.between_jumps(phases)
        step = step * pace
        factors, slopes = variation.slope_sum(parameters_at, self(phases), times, still)
        lengths = np.array([*sizes.T, *(self.masses if is_half else [])])
        lengths[first_velocity:n] *= step if first_velocity else 1.0
        for e, (_, j) in enumerate(variation.entries[still]):
            slopes[:, e] *= step * step if j < first_velocity else step
        weights = np.tile(variational.STEP_WEIGHTS, phases.size // variational.STAGES)
        trace = np.zeros(self.period.size)
        weights = [(weights * factor).sum() for factor in factors.T] if factors.size else weights
        for e in (e for e, (i, j) in enumerate(variation.entries[still]) if j == i + first_velocity):
            trace += sum(w * factor[e] for w, factor in zip(weights, slopes, strict=True))
        trace = np.zeros(trace.shape) if is_half else trace  # the second half's is the opposite
        rows = variational.integrate_flow(*variation.kernels(still), factors, slopes, lengths, steps)
        matrices, later = unpack_matrices(rows, n, FLOW_ROUNDING)
        return matrices, np.moveaxis(later.reshape(n, n, -1), 2, 0), trace

    def measure_in_steps(
        self, epsilon: np.ndarray, steps: int, shift: float = 0.0
    ) -> tuple[floquet.Matrices, np.ndarray]:
        """Return matrices measured from perturbed motions, and (truncation of the steps, effect of the amplitude).

        Args:
            epsilon: size of the perturbation relative to the states' sizes, shape (points,).
            steps: Taylor steps of each segment.
            shift: the base motion is shifted by this multiple of its uncertainty.
        """
        sizes, K, code = self.sizes_of_block.T, int(self.num_segments[0]), self.model.perturbed(bool(self.is_still[0]))
        n, num_segments = len(sizes), K // 2 if self.is_even[0] else K
        signs = [1.0] if code.linear or self.is_odd[0] else [1.0, -1.0]
        if self.model.block is None:
            phases = np.arange(num_segments if code.is_mixed else 1) / K
            states = self(phases)
        else:
            phases = np.arange(max(1, num_segments * int(self.num_nodes[0]) // K)) / self.num_nodes[0]
            nodes = np.moveaxis(self.nodes[:, : phases.size], 2, 0).swapaxes(1, 2)
            uncertainty = (self.error + motions.STATE_ROUNDING)[:, None] * self.sizes
            states = nodes + shift * uncertainty.T[:, None] * np.resize([1.0, -1.0], len(nodes))[:, None, None]
        directions, owner = code.directions
        times, pace, parameters_at = self.between_jumps(phases)
        times = times if code.graph.equations.switches else times[:, None]
        place = [*states, self.period * times]
        x = (np.reshape(signs, (-1, 1, 1, 1)) * directions[:, :, None] * sizes).reshape(-1, n, self.period.size)
        step = self.period * pace / (K * steps) * (1.0 + shift * motions.STATE_ROUNDING)
        rows, columns = code.starts(parameters_at, place, epsilon, step, x)
        numbers = [K, steps, code.scratch, 0, n, len(signs), code.base["E", 0]]
        inverses = np.array([*1.0 / sizes, n * self.error / epsilon, *self.masses])
        advance = jit.passed(code.module().advance)
        result = monodromy.measure_matrices(advance, rows, columns, inverses, owner, np.array(numbers))
        return unpack_matrices(result, n, monodromy.NOISE * np.sqrt(steps / FIRST_STEPS))

    def measure(self, epsilon: np.ndarray, tolerance: float, steps: int = 0) -> tuple:
        """Return (matrices in units of the states' sizes, amplitude_too_large, not_converged).

        Args:
            epsilon: size of the perturbation, shape (points,).
            tolerance: largest truncation, relative to a segment's matrix; steps are halved until it is met.
            steps: steps of a segment at first; by default FIRST_STEPS, of a tangent flow FIRST_TANGENT_STEPS.
        """
        steps = steps or (FIRST_STEPS if self.model.block is None else FIRST_TANGENT_STEPS)
        matrices, (truncation, amplitude_effect) = self.measure_in_steps(epsilon, steps)
        is_too_large, is_unresolved = amplitude_effect > MAX_AMPLITUDE_EFFECT, ~(truncation <= tolerance)
        if self.model.block is not None:
            shifted, _ = self.measure_in_steps(epsilon, steps, 1.0)
            matrices.error[:] += np.abs(shifted.matrix - matrices.matrix)
            matrices.widen_second(shifted)
        open_points = np.flatnonzero(is_unresolved)
        if open_points.size and 2 * steps * int(self.num_segments[0]) <= MAX_STEPS:
            finer, *finer_flags = self.select(open_points).measure(epsilon[open_points], tolerance, 2 * steps)
            matrices.set_points(open_points, finer)
            is_too_large[open_points], is_unresolved[open_points] = finer_flags
        return matrices, is_too_large, is_unresolved

    def certify(self, steps: int = 0, last: float | np.ndarray = np.inf) -> tuple:
        """Return the variational flow's matrices, the difference of their traces from two phases, and determinants.

        In longer steps the matrices from both phases differed by `last`.
        """
        steps = steps or 2 * (5 * self.segment_length * int(self.num_segments[0]) // 8 + 1)  # an even number
        if has_jumps := self.model.variation.has_jumps:  # steps end there
            steps += -steps % (5 * int(self.num_pieces[0]))
        flow, later, trace = self.integrate_variation(steps)
        coarser, *_ = self.integrate_variation(
            4 * steps // 5, 0.0 if has_jumps else round(monodromy.SECOND_PHASE * steps) / steps
        )
        later = flow.matrix if has_jumps else later
        gap = COARSE_ERROR_SHARE * floquet.largest_entry(later - coarser.matrix)
        noise = floquet.largest_entry(flow.error)
        trace_gap, determinant = np.abs(np.einsum("nii->n", flow.matrix - coarser.matrix)), np.exp(trace)
        flow.error[:] += gap[:, None, None]
        flow.widen_second(coarser)
        is_rounding = (gap >= MIN_REDUCTION * last) & (gap <= MAX_ROUNDING * floquet.largest_entry(flow.matrix))
        open_points = np.flatnonzero(~(gap <= noise) & ~is_rounding)
        if open_points.size and 3 * steps // 4 * 2 <= MAX_STEPS:
            finer, *finer_values = self.select(open_points).certify(3 * steps // 4 * 2, gap[open_points])
            flow.set_points(open_points, finer)
            trace_gap[open_points], determinant[open_points] = finer_values
        return flow, trace_gap, determinant


def unpack_matrices(rows: np.ndarray, n: int, noise: float) -> tuple[floquet.Matrices, np.ndarray]:
    """Return matrices with errors, in units of the states' sizes, and the remaining rows.

    Args:
        rows: the result of `kernels.flow.monodromy.compose`, shape (rows, points).
        n: number of states.
        noise: the error that `rows` give as 1; that of the minors is twice as large.
    """
    entries, (turns, *minors), remainder = np.split(rows, [2 * n * n, 2 * n * n + 3])
    matrix, error = np.moveaxis(entries.reshape(2, n, n, turns.size), 3, 1)
    return floquet.Matrices(matrix, noise * error, turns, np.array(minors) * [[1.0], [2.0 * noise]]), remainder


def groups(base: BaseMotions) -> Iterator[np.ndarray]:
    """Yield the indices of points that are integrated together: of one kind, and at most MAX_GROUP_ENTRIES."""
    kinds = (
        2.0**20 * base.num_pieces
        + 2.0**40 * base.num_nodes * (base.model.block is not None)
        + 16 * base.num_segments
        + 8 * base.is_even
        + 4 * base.has_pairs
        + 2 * base.is_still
        + base.is_odd
    )
    for kind in np.unique(kinds):
        members = np.flatnonzero(kinds == kind)
        size = max(1, MAX_GROUP_ENTRIES // (max(1, base.num_segments[members[0]]) * base.sizes.shape[1] ** 2))
        yield from (members[first : first + size] for first in range(0, members.size, size))


def survey(model, points, tolerance: float, base: BaseMotions | None = None) -> dict[str, np.ndarray]:
    """Return all columns of points.

    Args:
        model: a system with a period.
        points: each parameter, `epsilon`, and `equilibrium` (index of the name), shape (points,).
        tolerance: largest truncation of a segment's steps, relative to its matrix.
        base: the points' motions, if they are known.
    """
    slot = np.asarray(points["equilibrium"])
    base = BaseMotions(model, model.parameters(points, slot.size), slot) if base is None else base
    epsilon = np.asarray(points["epsilon"], dtype=np.float64)
    columns: dict[str, np.ndarray] = {}
    for members in groups(base):
        for name, values in _columns(base.select(members), epsilon[members], tolerance).items():
            fill = np.nan if values.dtype == float else 0
            columns.setdefault(name, np.full((slot.size, *values.shape[1:]), fill, values.dtype))[members] = values
    starts = {f"{x.name}_start": base.start[:, i] for i, x in enumerate(model.equations.states)}
    starts["branch"] = np.where(base.residual <= MAX_RESIDUAL, base.branch, 0).astype(np.int8)
    return columns | starts | {"base_residual": base.residual, "steps": base.num_segments.astype(np.int32)}


@np.errstate(all="ignore")
def refusal(model, parameters) -> str:
    """Return why none of these points has a periodic motion to measure, or the empty string."""
    flags, labels = [], model.system.labels
    if not labels:
        return "equilibrium: no start of the periodic motion is named; allowed: system.equilibrium(name, {x: place, …})"
    for slot in range(len(labels)):
        base = BaseMotions(model, parameters, np.full(parameters[0].size, slot))
        if not (base.period > 0.0).any():
            return f"period: {model.system.given_period} is {base.period[0]:.6g} s; allowed: a finite time > 0"
        flags.append((base.is_finite.any(), (base.residual <= MAX_RESIDUAL).any(), (base.num_segments > 0).any()))
    is_finite, has_motion, has_segments = map(any, zip(*flags, strict=True))
    if not is_finite:
        return (
            f"coefficients: near {', '.join(labels)} they are no finite doubles at some times of the period; allowed: "
            "smooth, bounded functions of the time, which SymPy does not take apart (exp(10000*(cos(t) - 1)): of "
            "exp(1e4*(cos(t) - 1)) it makes 1e-4344*exp(1e4*cos(t)))"
        )
    if not has_motion:
        return (
            f"base motion: none of the system's period begins near {', '.join(labels)} (it ends at a fold while the "
            "drive is switched on, is not found, or others beside it close as well); allowed: an equilibrium at all "
            "times, one without the drive, or a start near a periodic motion"
        )
    if not has_segments or is_jagged(base):
        return (
            "coefficients: they jump, have a kink or a pole, or are too fast for the period; allowed: smooth, bounded "
            "functions of the time, or sign, floor, Piecewise of what crosses its jumps with a slope, or system.jump(t)"
        )
    return ""


def is_jagged(base: BaseMotions) -> bool:
    """Return True if the Fourier series of the coefficients at the named start converges at none of CHECK_POINTS."""
    if base.model.variation.has_jumps:
        return False
    sample, phases = base.select(slice(CHECK_POINTS)), np.arange(CHECK_PHASES) / CHECK_PHASES
    _, slopes = sample.model.variation.slope_sum(sample.parameters, sample.start.T[:, None], phases, False)
    terms = np.abs(np.fft.rfft(slopes, axis=0)).max(axis=1)
    return not (terms[CHECK_PHASES // 4 :].max(axis=0) <= MAX_FOURIER_TAIL * terms.max(axis=0)).any()


@np.errstate(all="ignore")
def find_flow(base) -> tuple[floquet.Matrices, np.ndarray, np.ndarray | float]:
    """Return matrices, trace differences and determinants as of `BaseMotions.certify`; NaN where the check fails."""
    if not base.num_segments[0]:
        sizes = base.sizes_of_block
        missing = np.full((*sizes.shape, sizes.shape[1]), np.nan)
        return floquet.Matrices(missing, missing), missing[:, 0, 0], 1.0
    certified, trace_gap, determinant = base.certify()
    certified.matrix[trace_gap > MAX_TRACE_DIFFERENCE * floquet.largest_entry(certified.matrix)] = np.nan
    return certified, trace_gap, determinant


@np.errstate(all="ignore")
def _columns(base, epsilon, tolerance):
    """Return columns of points with one number of segments; see `survey`."""
    reciprocal, is_too_large, is_unresolved = bool(base.has_pairs[0]), False, base.num_segments == 0
    certified, trace_gap, determinant = find_flow(base)
    measured = certified
    if base.num_segments[0]:
        measured, is_too_large, is_unresolved = base.measure(epsilon, tolerance)
        measured.matrix[is_too_large] = np.nan
    coupling = base.coupling[:, base.model.variation.block][:, :, base.model.variation.block]
    columns, agrees = floquet.compare_flows(measured, certified, base.period, reciprocal, determinant, coupling)
    columns["phase_residual"] = trace_gap / floquet.largest_entry(certified.matrix)
    is_sound = np.isfinite(floquet.largest_entry(measured.matrix + measured.error))
    is_missing = ~(base.residual <= MAX_RESIDUAL)
    cases = {
        statuses.NON_FINITE: ~base.is_finite,
        statuses.NO_PERIODIC_MOTION: is_missing & (base.status != statuses.NOT_FOUND),
        statuses.NOT_FOUND: is_missing,
        statuses.PERTURBATION_TOO_LARGE: is_too_large,
        statuses.NOT_CONVERGED: is_unresolved | (is_sound & ~agrees),
    }
    status = np.select([*cases.values(), ~is_sound], [*cases, statuses.NON_FINITE], statuses.OK)
    return columns | {"status": status.astype(np.int8)}
