r"""Periodic motions of driven systems, each followed from the place that names it while the drive is switched on.

*Homotopy.* With the places relative to their sizes, y(t), the equations of a motion of period T are G(y) = 0, and

.. math:: G(y) = (1 - s)\,G(y_0)

has the solution y_0 at s = 0, and the motions of the system at s = 1. If the named place is an equilibrium without the
drive, y_0 stays there at all times: G(y_0) is then the force that drives the system off its place, and s is the
amplitude of that force. Modulations that leave the place at rest are not scaled. A place that is none is the start of a
motion (at rest at the time 0), which is followed for a period; y_0 is that motion less a ramp that closes it.

*Collocation.* y is a trigonometric polynomial through an odd number of phases. No motion is integrated, so large
multipliers do no harm; the number of phases is doubled until the last third of the harmonics is small all along.

If the rates jump in time, each phase has the mean of the rates over its cell, so that no jump is missed or shifted.

*Curve.* Pseudo-arclength steps, each point by itself. A step is accepted if the correction is small and the tangent
rotates little, and if the cubic through both ends has no fold that the ends do not show. A motion with the number k
(`branch`) lies on the curve behind k - 1 folds: if the curve has had k folds and was not at s = 1 in between, the
motion does not exist. The curve goes straight through a pitchfork.

Source: Allgower and Georg, Numerical Continuation Methods, chapters 2 and 6; Trefethen, Spectral Methods in MATLAB,
chapter 3 (the differentiation matrix).
"""

import numpy as np

from kernels.estimator import statuses
from kernels.flow.matrices import apply_by_matrix

PHASE_COUNTS = 31, 63, 127, 255  # numbers of collocation phases; odd, so that every harmonic has a derivative
MAX_TAIL = 1e-5  # largest coefficient of the last third of the harmonics, relative to the state sizes
MAX_LAST_TAIL = 1e-2  # the same with the most phases: Newton's method on the integrated motion still decides
MAX_JUMP_TAIL = 1e-4  # the same as MAX_TAIL for rates that jump: harmonics fall off slowly, and Newton's method decides
MAX_ALIASING = 1e-3  # largest relative error of the rates between the phases: a coarser grid may overlook a pulse
MAX_DERIVATIVE_ENTRIES = 1 << 20  # entries of all points' derivatives that are computed together: 8 MiB
MAX_STEPS = 600  # steps along one curve; beyond, the status is not_found
FIRST_STEP, MAX_STEP, MIN_STEP = 0.05, 0.25, 1e-6  # arclength steps in (y, s)
MAX_FOLD_STEP = 1e-3  # longest step across a fold: s at the fold is then known to 1e-6
MIN_INITIAL_RISE = 1e-6  # smallest ds/d(arclength) at s = 0; below, the system resonates without the drive
MAX_CORRECTIONS, MAX_LAST_CORRECTION = 6, 1e-9  # Newton steps back to the curve, and the length of the last one
MAX_CORRECTION = 0.3  # longest first correction of an accepted step, relative to the step
MIN_TANGENT_COSINE = 0.94  # smallest cosine of the angle between the tangents of an accepted step
EASY_CORRECTION = 0.03  # first correction relative to the step, below which the next step is twice as long
MAX_AMPLITUDE = 8.0  # largest |s| at which a further branch is searched for
MAX_DISTANCE = 64.0  # largest distance from the named place, in state sizes, up to which the curve is followed
MAX_SHIFT = 0.1  # a place is an equilibrium without the drive if one is estimated within this many state sizes
MAX_MEAN_FORCE = 2.0  # the same if the mean force is at most this many times the largest varying force


def differentiation_matrix(count: int) -> np.ndarray:
    """Return the matrix of derivatives by the phase of trigonometric polynomials through an odd number of phases."""
    distance = np.subtract.outer(np.arange(count), np.arange(count))
    np.fill_diagonal(distance, 1)
    D = np.pi * (-1.0) ** distance / np.sin(np.pi * distance / count)
    np.fill_diagonal(D, 0.0)
    return D


def values_at(places: np.ndarray, phases: np.ndarray) -> np.ndarray:
    """Return trigonometric polynomials at any phases, shape (…, phases), from values at equal phases from 0.

    Exact for an odd number of values only: of an even number the last harmonic would be doubled.

    Args:
        places: values at the phases 0, 1/count, …, shape (…, count).
        phases: fractions of the period, shape (phases,).
    """
    count = places.shape[-1]
    orders = np.arange(count // 2 + 1)
    waves = np.exp(2j * np.pi * np.multiply.outer(orders, phases)) * np.where(orders, 2.0, 1.0)[:, None]
    return (np.fft.rfft(places) / count @ waves).real


class Collocation:
    """The equations G(y) = 0 of points; y has the shape (points, places, phases)."""

    def __init__(self, rates, period, sizes, order: int, count: int):
        self.rates, self.period, self.sizes, self.order = rates, period, sizes, order
        self.phases, self.D = np.arange(count) / count, differentiation_matrix(count)
        self.main = np.linalg.matrix_power(self.D, self.order)

    def states(self, y, which) -> np.ndarray:
        """Return the states at all phases, shape (n, phases, points)."""
        x = y * self.sizes[which, : y.shape[1], None]
        rates = x @ self.D.T / self.period[which, None, None]
        return np.moveaxis(np.concatenate([x, rates][: self.order], axis=1), 0, 2)

    def __call__(self, y, which) -> tuple[np.ndarray, np.ndarray]:
        """Return G(y) and its derivative, flattened to (points, unknowns) and (points, unknowns, unknowns)."""
        points, m, count = y.shape
        rates, slopes = self.rates(which, self.states(y, which), self.phases)
        T, s, G, each = self.period[which], self.sizes[which].T, y @ self.main.T, np.arange(count)
        A = np.zeros((points, m, count, m, count))
        for a in range(m):
            scale = T**self.order / s[a]
            G[:, a] -= (scale * rates[a]).T
            A[:, a, :, a] = self.main
            for b in range(m):
                A[:, a, each, b, each] -= (scale * s[b] * slopes[a][b]).T
                if self.order == 2:
                    A[:, a, :, b] -= (scale * s[b] / T * slopes[a][m + b]).T[:, :, None] * self.D
        return G.reshape(points, -1), A.reshape(points, m * count, m * count)

    def is_aliased(self, y) -> np.ndarray:
        """Return True if the rates of y between the phases are not those of the polynomial through the phases."""
        rows, between = np.arange(len(y)), self.phases + 0.5 / self.phases.size
        x = self.states(y, rows)
        rates, _ = self.rates(rows, x, self.phases)
        x = np.moveaxis(values_at(np.moveaxis(x, 1, 2), between), 2, 1)
        rates_between, _ = self.rates(rows, x, between)
        rates, rates_between = np.moveaxis(rates, 1, 2), np.moveaxis(rates_between, 1, 2)
        error = np.abs(values_at(rates, between) - rates_between).max(axis=2)
        return (error > MAX_ALIASING * np.abs(rates_between).max(axis=2)).any(axis=0)


def is_equilibrium(rates_at, sizes, place) -> np.ndarray:
    """Return True for places at or near equilibria of the system without its drive, shape (points,).

    Args:
        rates_at: as `rates` of :func:`follow_motions`.
        sizes: of the states, shape (points, n).
        place: shape (points, m).
    """
    points, m = place.shape
    x = np.zeros((sizes.shape[1], 1, points))
    x[:m, 0] = place.T
    rates, slopes = rates_at(np.arange(points), x, np.arange(64) / 64)
    force, s = np.array(rates) / sizes.T[:m, None], sizes.T
    mean = force.mean(axis=1)
    J = np.array([[slopes[a][b].mean(axis=0) * s[b] / s[a] for b in range(m)] for a in range(m)])
    shift = np.abs(apply_by_matrix(np.linalg.solve, np.moveaxis(J, 2, 0), mean.T[..., None])[..., 0]).max(axis=1)
    largest_varying = np.abs(force - mean[:, None]).max(axis=(0, 1))
    return (shift <= MAX_SHIFT) | (np.abs(mean).max(axis=0) <= MAX_MEAN_FORCE * largest_varying)


def follow_motions(variation, rates, period, sizes, curves, branch) -> tuple[list, np.ndarray]:
    """Follow the motions of points until the drive has its full amplitude.

    Args:
        variation: of the equations (`sweeps.mechanics.periodic.Variation`): number of places, and whether rates jump in
            time, so that the harmonics fall off as a power of their order.
        rates: (points' numbers, states, phases) → rates and slopes (`periodic.BaseMotions.mean_rates`).
        period: s, shape (points,).
        sizes: of the states, shape (points, n).
        curves: (points' numbers, phases) → y_0, shape (points, places, phases).
        branch: number of the motion on the curve, shape (points,): 1 before all folds.

    Returns:
        Of each point the states at equal phases from 0, shape (n, phases), and a status: OK, NO_PERIODIC_MOTION if
        the name has ended at a fold, NOT_FOUND if the search has ended. States of these are NaN.
    """
    status, open_points = np.full(period.size, statuses.NOT_FOUND), np.arange(period.size)
    n, m, has_jumps = sizes.shape[1], variation.m, variation.has_jumps
    states = [np.full((n, 1), np.nan)] * period.size
    for count in PHASE_COUNTS:
        chunk_size, unresolved_chunks = max(1, MAX_DERIVATIVE_ENTRIES // (m * count) ** 2), []
        for chunk in np.split(open_points, range(chunk_size, open_points.size, chunk_size)):

            def rates_of_part(which, x, phases, chunk=chunk):
                """Return `rates` for indices of points in the chunk."""
                return rates(chunk[which], x, phases)

            collocation = Collocation(rates_of_part, period[chunk], sizes[chunk], n // m, count)
            start, is_last = curves(chunk, collocation.phases), count == PHASE_COUNTS[-1]
            y, chunk_status, tail = _follow_curves(collocation, start, branch[chunk])
            is_resolved = tail <= (MAX_LAST_TAIL if is_last else MAX_JUMP_TAIL if has_jumps else MAX_TAIL)
            is_resolved &= (chunk_status != statuses.NOT_FOUND) & (is_last | has_jumps | ~collocation.is_aliased(start))
            status[chunk[is_resolved]] = chunk_status[is_resolved]
            x = collocation.states(y, np.arange(chunk.size))
            for k in np.flatnonzero(is_resolved & (chunk_status == statuses.OK)):
                states[chunk[k]] = x[:, :, k]
            unresolved_chunks.append(chunk[~is_resolved])
        open_points = np.concatenate(unresolved_chunks)
        if not open_points.size:
            break
    return states, status


def _follow_curves(collocation, start, branch):
    """Return y at s = 1, statuses as of `follow_motions`, and the largest tail of the harmonics along each curve."""
    points, m, count = start.shape
    each, size = np.arange(points), m * count
    u = np.concatenate([start.reshape(points, size), np.zeros((points, 1))], axis=1)  # (y, s)
    G0, A = collocation(start, each)
    weight = np.append(np.full(size, 1.0 / size), 1.0)  # of the curve's length
    tangent = np.zeros(u.shape)
    tangent[:, -1] = 1.0
    tangent = _tangent(A, G0, tangent, weight)
    step, folds, first = np.full(points, FIRST_STEP), np.zeros(points, dtype=int), u[:, :-1].copy()
    status, tail, y = np.full(points, statuses.NOT_FOUND), np.zeros(points), np.full((points, size), np.nan)
    active = np.flatnonzero(np.isfinite(tangent).all(axis=1) & (tangent[:, -1] > MIN_INITIAL_RISE))
    for _ in range(MAX_STEPS):
        if not active.size:
            break
        h, t = step[active, None], tangent[active]
        v, A, first_change, has_solution = _correct(collocation, u[active] + h * t, t * weight, G0[active], active)
        new = _tangent(A, G0[active], t, weight)
        share = first_change / step[active]
        is_accepted = has_solution & (share <= MAX_CORRECTION) & ((new * t * weight).sum(axis=1) >= MIN_TANGENT_COSINE)
        is_fold = t[:, -1] * new[:, -1] <= 0.0
        has_hidden_fold = _has_hidden_fold(u[active, -1], v[:, -1], h[:, 0] * t[:, -1], h[:, 0] * new[:, -1]) & ~is_fold
        is_accepted &= ~(is_fold | has_hidden_fold) | (step[active] <= MAX_FOLD_STEP)
        s_before, s_after, is_on_branch = u[active, -1] - 1.0, v[:, -1] - 1.0, folds[active] == branch[active] - 1
        crossings = np.flatnonzero(is_accepted & ~is_fold & is_on_branch & (s_before * s_after <= 0.0))
        if crossings.size:  # a straight line between both ends, then Newton's method at s = 1
            position = np.where(s_before == s_after, 0.0, s_before / (s_before - s_after))[crossings, None]
            w = u[active[crossings]] + (v - u[active])[crossings] * position
            rows, which = np.repeat(np.eye(1, size + 1, size), crossings.size, axis=0), active[crossings]
            ends, _, change, is_converged = _correct(collocation, w, rows, G0[which], which)
            is_converged &= change <= MAX_CORRECTION * step[which]
            y[which[is_converged]], status[which[is_converged]] = ends[is_converged, :-1], statuses.OK
            is_accepted[crossings[~is_converged]] = False
        step_rows = active[is_accepted]
        u[step_rows], tangent[step_rows] = v[is_accepted], new[is_accepted]
        folds[step_rows] += is_fold[is_accepted]
        tail[step_rows] = np.maximum(tail[step_rows], _tail(v[is_accepted, :-1].reshape(-1, m, count)))
        longer = np.where(share < EASY_CORRECTION, 2.0, np.where(share < MAX_CORRECTION / 2.0, 1.0, 0.7))
        step[active] = np.minimum(np.where(is_accepted, longer, 0.5) * step[active], MAX_STEP)
        status[active[(folds[active] >= branch[active])]] = statuses.NO_PERIODIC_MOTION
        is_far = np.abs(u[active, :-1] - first[active]).max(axis=1) > MAX_DISTANCE
        is_open = (status[active] == statuses.NOT_FOUND) & (step[active] >= MIN_STEP) & ~is_far
        active = active[is_open & (np.abs(u[active, -1]) <= MAX_AMPLITUDE)]
    return y.reshape(start.shape), status, tail


def _correct(collocation, u, row, G0, which):
    """Return (points on the curve, derivative of G there, length of the first Newton step, converged) of each curve.

    Solve G(y) = (1 - s) G(y_0) for u = (y, s) in the plane row · (u - start) = 0 by Newton's method.

    Args:
        collocation: the equations G.
        u: starts (y, s), shape (curves, unknowns + 1).
        row: normal vector of the plane, shape (curves, unknowns + 1).
        G0: G(y_0), shape (curves, unknowns).
        which: index of each curve's point.
    """
    count, unknowns = collocation.phases.size, u.shape[1] - 1
    u, A, active = u.copy(), np.zeros((len(u), unknowns, unknowns)), np.arange(len(u))
    first, last = np.full(len(u), np.nan), np.full(len(u), np.inf)
    for iteration in range(MAX_CORRECTIONS):
        G, A[active] = collocation(u[active, :-1].reshape(active.size, -1, count), which[active])
        G = G - (1.0 - u[active, -1:]) * G0[active]
        change = _solve_bordered(A[active], G0[active], row[active], G)
        u[active] -= change
        last[active] = np.sqrt((change[:, :-1] ** 2).mean(axis=1) + change[:, -1] ** 2)
        first = last.copy() if iteration == 0 else first
        active = active[(last[active] > MAX_LAST_CORRECTION) & (last[active] < 4.0)]
        if not active.size:
            break
    return u, A, first, last <= MAX_LAST_CORRECTION


def _solve_bordered(A, column, row, right, last=0.0):
    """Return (y, s) of A y + column s = right and row (y, s) = last."""
    n = A.shape[1]
    M = np.empty((len(A), n + 1, n + 1))
    M[:, :n, :n], M[:, :n, n], M[:, n] = A, column, row
    M[~np.isfinite(M).all(axis=(1, 2))] = np.nan
    b = np.concatenate([right, np.full((len(A), 1), last)], axis=1)
    return apply_by_matrix(np.linalg.solve, M, b[..., None])[..., 0]


def _tangent(A, G0, last, weight):
    """Return the unit tangents of curves, in the direction of the previous tangents."""
    t = _solve_bordered(A, G0, last * weight, np.zeros(G0.shape), 1.0)
    return t / np.sqrt((t * t * weight).sum(axis=1, keepdims=True))


def _has_hidden_fold(a, b, da, db):
    """Return True if the cubic of s from a to b, with slopes da and db of one sign, goes back in between."""
    p, q, r = 3.0 * (da + db - 2.0 * (b - a)), 2.0 * (3.0 * (b - a) - 2.0 * da - db), da  # slope p z² + q z + r
    with np.errstate(all="ignore"):
        z = -q / (2.0 * p)
        return (z > 0.0) & (z < 1.0) & (((p * z + q) * z + r) * da < 0.0)


def _tail(y):
    """Return the largest coefficient of the last third of the harmonics of each point."""
    terms = np.abs(np.fft.rfft(y)) * 2.0 / y.shape[-1]
    return terms[:, :, 2 * terms.shape[-1] // 3 :].max(axis=(1, 2))
