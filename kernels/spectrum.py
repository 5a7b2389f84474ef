r"""Eigenvalues from samples of known states, with errors, blind to any theory.

*Model.* Runs r = 1 … R of one linear motion, all n states sampled every h: :math:`y^{(r)}_k = M^k x^{(r)}_0` and noise,
:math:`M = e^{Ah}`. Asked for are the eigenvalues of A, and what is smooth in A where two of them meet.

*Start.* Dynamic mode decomposition, :math:`M - 1 = \sum(y_{k+1} - y_k)y_k^{\mathsf T}\,(\sum y_ky_k^{\mathsf T})^{-1}`.

*Fit.* :mod:`kernels.projection` finds M by least squares, :mod:`kernels.invariants` what follows from it. Each is
compiled by itself and handed over as an argument: a function that calls another by its name compiles it once more.

Source: Tu et al., J. Comput. Dyn. 1 (2014) 391. Not validated: more than 12 states.
"""

import math

import numpy as np

from kernels.blocks import W, put, rows_of, scratch
from kernels.dense import add_inner, add_outer, solve_in_lanes
from kernels.fitting import EPSILON, EQUATIONS, FITTED, LEAST_MOVED, MOVED, SCATTER
from kernels.jit import OPTIONS, PASSED, njit, whole_vectors

STEPS = 4  # of Gauss-Newton, at most
FEW, PIVOTED = 128.0, 16.0  # a bound is so many times as wide where the least pivot is of 16 roundings or less


@njit(**OPTIONS)
def as_lanes(flat):
    """Return rows of W lanes, as rows."""
    return flat.reshape(flat.size // W, W)


@njit(**OPTIONS)
def moments(Y, weight, runs, count, n, XX, XD, y, d):
    """Add up y yᵀ and (y(t+h) - y(t)) yᵀ over neighbouring samples; y, d are scratch."""
    whole_vectors()
    XX[:], XD[:] = 0.0, 0.0
    for r in range(runs):
        for k in range(count - 1):
            used = np.uint64((r * count + k + 1) * W)
            for i in range(n):
                here, row = np.uint64(((r * count + k) * n + i) * W), np.uint64(i * W)
                there = here + np.uint64(n * W)
                for lane in range(W):
                    x = Y[here + np.uint64(lane)]
                    y[row + np.uint64(lane)] = weight[used + np.uint64(lane)] * x
                    d[row + np.uint64(lane)] = Y[there + np.uint64(lane)] - x
            add_outer(XX, y, 0, n, y, 0, n)
            add_outer(XD, d, 0, n, y, 0, n)


SWEEPS = 12  # of Jacobi's rotations, at most


@njit(**OPTIONS)
def _spread(A, n, c, s, moved):
    """Square root of the smallest eigenvalue over the largest, by Jacobi's rotations, lane by lane; A is lost.

    A lane that has come to rest stays as it is, whatever its neighbours still need; c, s are scratch.
    """
    whole_vectors()
    lanes = moved.size
    for _ in range(SWEEPS):
        going = 0.0
        for p in range(n - 1):
            for q in range(p + 1, n):
                for lane in range(lanes):
                    a, b, x = A[p * n + p, lane], A[q * n + q, lane], A[p * n + q, lane]
                    turns = abs(x) > EPSILON * math.sqrt(abs(a)) * math.sqrt(abs(b))
                    half = 0.5 * (b - a) / (x if turns else 1.0)
                    t = math.copysign(1.0, half) / (abs(half) + math.sqrt(1.0 + half * half))
                    c[lane] = 1.0 / math.sqrt(1.0 + t * t) if turns else 1.0
                    s[lane] = t / math.sqrt(1.0 + t * t) if turns else 0.0
                    A[p * n + p, lane] = a - t * x if turns else a
                    A[q * n + q, lane] = b + t * x if turns else b
                    A[p * n + q, lane] = 0.0 if turns else x
                for lane in range(lanes):
                    going = max(going, abs(s[lane]))
                for r in range(n):
                    if r in (p, q):
                        continue
                    u, v = (r * n + p if r < p else p * n + r), (r * n + q if r < q else q * n + r)
                    for lane in range(lanes):
                        x, y = A[u, lane], A[v, lane]
                        A[u, lane] = c[lane] * x - s[lane] * y
                        A[v, lane] = s[lane] * x + c[lane] * y
        if going == 0.0:
            break
    for lane in range(lanes):
        least, most = math.inf, 0.0
        for i in range(n):
            least, most = min(least, A[i * n + i, lane]), max(most, A[i * n + i, lane])
        moved[lane] = math.sqrt(max(least, 0.0) / most) if most > 0.0 else 0.0


@njit(**OPTIONS)
def start(XX, XD, n, M, moved):
    """Write M of the dynamic mode decomposition, and the samples' smallest singular value over their largest."""
    whole_vectors()
    A, f, g = rows_of(n * n), scratch(1), scratch(1)
    put(A, XX)
    _spread(A, n, f, g, moved)
    put(A, XX)
    put(M, XD)  # rows of M are columns of its transpose, as those of XD are
    solve_in_lanes(A, M, n, n, False, -math.inf, f)
    for i in range(n):
        for lane in range(W):
            M[i * n + i, lane] += 1.0
    for at in range(n * n):
        for lane in range(W):
            if not math.isfinite(M[at, lane]):
                moved[lane] = 0.0


@njit(**OPTIONS)
def sums(Y, weight, M, X0, runs, count, n, x, d, Z, XX, XR, XZ, HH, HR, RR):
    """Add up the normal equations: of the model's samples x, its residuals d and its slopes Z by Θ.

    x and Z hold two samples, which take turns.
    """
    whole_vectors()
    P = runs * n
    for rows in (XX, XR, XZ, HH, HR, RR):
        rows[:] = 0.0
    for r in range(runs):
        for at in range(n * W):
            x[at] = X0[r * n * W + at]
        for at in range(P * n * W):
            Z[at] = 0.0
        opened = W
        for k in range(count):
            xs, Zs = k % 2 * n, k % 2 * P * n
            if k > 0:
                _advance(M, X0, x, n - xs, xs, Z, P * n - Zs, Zs, P, n)
            opened = _close(weight, (r * count + k) * W, opened, x, Z)
            if opened == 0:
                break
            for i in range(n):
                here = np.uint64(((r * count + k) * n + i) * W)
                row, to = np.uint64((xs + i) * W), np.uint64(i * W)
                for lane in range(W):
                    d[to + np.uint64(lane)] = Y[here + np.uint64(lane)] - x[row + np.uint64(lane)]
            add_inner(RR, 0, d, 0, 0, d, 0, 0, n, 1)
            add_outer(XX, x, xs, n, x, xs, n)
            add_outer(XR, d, 0, n, x, xs, n)
            add_outer(XZ, Z, Zs, P * n, x, xs, n)
            add_inner(HR, 0, Z, Zs, n, d, 0, 0, n, P)
            for p in range(P):
                add_inner(HH, p * P, Z, Zs + p * n, 0, Z, Zs, n, n, p + 1)


@njit(**OPTIONS)
def _close(weight, used, before, x, Z):
    """Put an end to the model in lanes whose samples count no more: 0 stays 0; how many are open."""
    whole_vectors()
    opened = 0
    for lane in range(W):
        opened += 1 if weight[used + lane] > 0.0 else 0
    if opened < before:
        for rows in (x, Z):
            for i in range(rows.size // W):
                for lane in range(W):
                    rows[i * W + lane] *= weight[used + lane]
    return opened


@njit(**OPTIONS)
def _advance(M, X0, x, xs, new_xs, Z, Zs, new_Zs, P, n):
    """One sample on: M x, and M Z + X0 eᵀ x for every parameter, into the new rows."""
    whole_vectors()
    for p in range(P):
        v = np.uint64((xs + p % n) * W)
        for i in range(n):
            to, u = np.uint64((new_Zs + p * n + i) * W), np.uint64((p // n * n + i) * W)
            for lane in range(W):
                Z[to + np.uint64(lane)] = X0[u + np.uint64(lane)] * x[v + np.uint64(lane)]
        add_inner(Z, new_Zs + p * n, M, 0, n, Z, Zs + p * n, 0, n, n)
    for at in range(new_xs * W, (new_xs + n) * W):
        x[at] = 0.0
    add_inner(x, new_xs, M, 0, n, x, xs, 0, n, n)


@njit(FITTED, **PASSED)
def fit_block(step, tell, Y, weight, runs, count, n, spacing, floor, bend, trust, lanes, raw):
    """Measure the lanes of a block; step and tell are those of :mod:`kernels.projection` and :mod:`kernels.invariants`.

    Y, shape (runs*count*n, W): sample k of run r, state i in row (r*count + k)*n + i. weight, shape (runs*count, W):
    1 for a sample that counts, else 0, and Y too; a run's first ones. floor, shape (W,): error of a sample that its
    scatter does not show. bend, shape (W,): as of `tell`. trust: 0 for standard errors, else the multiple of the
    scatter in a bound, as of :mod:`kernels.flows`.
    """
    whole_vectors()
    P = runs * n
    Y, counts = Y.reshape(Y.size), weight.reshape(weight.size)
    XX, XR, M, X0 = scratch(n * n), scratch(n * n), scratch(n * n), scratch(P)
    x, d, Z = scratch(2 * n), scratch(n), scratch(2 * P * n)
    XZ, HH, HR, RR = scratch(P * n * n), scratch(P * P), scratch(P), scratch(1)
    moved, rest, change, covariance, noise = scratch(1), scratch(1), scratch(1), rows_of(P * P + 1), scratch(1)
    change[:], noise[:] = math.inf, math.nan
    moments(Y, counts, runs, count, n, XX, XR, x, d)
    start(as_lanes(XX), as_lanes(XR), n, as_lanes(M), moved)
    for r in range(runs):
        for at in range(n * W):
            X0[r * n * W + at] = Y[r * count * n * W + at]
    for _ in range(STEPS):
        sums(Y, counts, M, X0, runs, count, n, x, d, Z, XX, XR, XZ, HH, HR, RR)
        given = (as_lanes(XX), as_lanes(XR), as_lanes(XZ), as_lanes(HH), as_lanes(HR), as_lanes(RR))
        if not step(as_lanes(M), as_lanes(X0), runs, n, *given, covariance, rest, moved, change):
            break
    for lane in range(lanes):
        row, used = raw[lane], 0.0
        for k in range(runs * count):
            used += weight[k, lane]
        equations = n * used
        free = equations - n * n - P
        for i in range(row.size):
            row[i] = math.nan
        row[EQUATIONS], row[MOVED] = equations, moved[lane]
        if moved[lane] < LEAST_MOVED or free < 1.0:
            continue
        scatter = math.sqrt(rest[lane] / free)
        row[SCATTER] = scatter
        weak = 1.0 + FEW * min(1.0, PIVOTED * EPSILON * covariance[P * P, lane])
        noise[lane] = weak * math.sqrt(equations) * (trust * scatter + floor[lane]) if trust > 0.0 else scatter
    tell(as_lanes(M), as_lanes(X0), runs, n, covariance, noise, bend, spacing, lanes, raw)
