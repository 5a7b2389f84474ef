r"""Eigenvalues from samples of known states, with errors, blind to any theory.

*Model.* Runs r = 1 … R of one linear motion, all n states sampled every h: :math:`y^{(r)}_k = M^k x^{(r)}_0` and noise,
:math:`M = e^{Ah}`. Results are the eigenvalues of A, and invariants that are smooth in A at multiple eigenvalues.

*Start.* Dynamic mode decomposition, :math:`M - 1 = \sum(y_{k+1} - y_k)y_k^{\mathsf T}\,(\sum y_ky_k^{\mathsf T})^{-1}`.

*Fit.* :mod:`kernels.flow.projection` finds M by least squares, :mod:`kernels.flow.invariants` the results from M.

Source: Tu et al., J. Comput. Dyn. 1 (2014) 391. Not validated: more than 12 states.
"""

import math

import numpy as np

from kernels.compile.blocks import LANES, ROWS, W, rows_of, scratch
from kernels.compile.jit import INNER, OPTIONS, float64, int64, njit, types, void
from kernels.flow.codes import EQUATIONS, EXCITATION, MIN_EXCITATION, SCATTER, UNIT
from kernels.flow.dense import add_row_product, copy_rows, solve_in_lanes
from kernels.flow.invariants import write_results
from kernels.flow.projection import step_lanes

MAX_STEPS = 4  # steps of Gauss-Newton, which converges quadratically from its start
FOUR = 4  # number of samples with products that are added up together
WEAK_FACTOR, WEAK_PIVOT = 128.0, 16.0  # a bound is wider by this factor if the least pivot is at most 16 roundings


@njit(**OPTIONS)
def as_lanes(flat):
    """Return rows of W lanes, as rows."""
    return flat.reshape(flat.size // W, W)


@njit(void(ROWS, int64, int64, ROWS, ROWS), **OPTIONS)
def add_products(V, P, n, by_x, squares):
    """Add up the products of FOUR samples: of every column's states with those of x, and of all columns except x.

    Args:
        `V` (numpy.ndarray): Row (p n + i) FOUR + k: state i of column p at sample k. Columns: a residual, P slopes, x.
        `P`, `n` (int): Numbers of slopes and of states.
        by_x, squares (numpy.ndarray): Added to: products of states with those of x, and of pairs of columns.
    """
    m = FOUR * n
    for row in range((P + 2) * n):
        for j in range(n):
            add_row_product(by_x, row * n + j, V, row * FOUR, V, (P + 1) * m + j * FOUR, FOUR)
    for p in range(P + 1):
        for q in range(p + 1):
            add_row_product(squares, p * (P + 1) + q, V, p * m, V, q * m, m)


@njit(void(ROWS, ROWS, *3 * (int64,), ROWS, ROWS), **OPTIONS)
def sum_moments(Y, weight, runs, count, n, by_x, squares):
    """Add up the products of y(t+h) - y(t) and of y with y over neighbouring samples.

    Args:
        Y, weight (numpy.ndarray): Samples and their weights, as in :func:`fit_block`, flat.
        `runs`, `count`, `n` (int): Numbers of runs, of samples of a run, and of states.
        by_x, squares (numpy.ndarray): Written, as by :func:`add_products`.
    """
    V = scratch(2 * n * FOUR)
    by_x[:], squares[:] = 0.0, 0.0
    for r in range(runs):
        for k in range(-(-count // FOUR) * FOUR):
            sample_row, weight_row = r * count + min(k, count - 2), np.uint64((r * count + min(k + 1, count - 1)) * W)
            share = 1.0 if k < count - 1 else 0.0
            for i in range(n):
                at, d = np.uint64((sample_row * n + i) * W), np.uint64((i * FOUR + k % FOUR) * W)
                for lane in range(W):
                    x, y = Y[at + np.uint64(lane)], Y[at + np.uint64(n * W + lane)]
                    V[d + np.uint64(lane)] = y - x
                    V[d + np.uint64(n * FOUR * W + lane)] = share * weight[weight_row + np.uint64(lane)] * x
            if k % FOUR == FOUR - 1:
                add_products(V, 0, n, by_x, squares)


MAX_SWEEPS = 12  # sweeps of Jacobi's rotations, which converge quadratically


@njit(void(LANES, int64, ROWS, ROWS, ROWS), **INNER)
def _singular_ratio(A, n, c, s, excitation):
    """Write the root of the smallest eigenvalue over the largest, by Jacobi's rotations, lane by lane.

    A is overwritten; c, s are scratch. A converged lane does not change while its neighbours go on.
    """
    lanes = excitation.size
    for _ in range(MAX_SWEEPS):
        largest_angle = 0.0
        for p in range(n - 1):
            for q in range(p + 1, n):
                for lane in range(lanes):
                    a, b, x = A[p * n + p, lane], A[q * n + q, lane], A[p * n + q, lane]
                    rotates = abs(x) > UNIT * math.sqrt(abs(a)) * math.sqrt(abs(b))
                    half = 0.5 * (b - a) / (x if rotates else 1.0)
                    t = math.copysign(1.0, half) / (abs(half) + math.sqrt(1.0 + half * half))
                    c[lane] = 1.0 / math.sqrt(1.0 + t * t) if rotates else 1.0
                    s[lane] = t / math.sqrt(1.0 + t * t) if rotates else 0.0
                    A[p * n + p, lane] = a - t * x if rotates else a
                    A[q * n + q, lane] = b + t * x if rotates else b
                    A[p * n + q, lane] = 0.0 if rotates else x
                for lane in range(lanes):
                    largest_angle = max(largest_angle, abs(s[lane]))
                for r in range(n):
                    if r in (p, q):
                        continue
                    u, v = (r * n + p if r < p else p * n + r), (r * n + q if r < q else q * n + r)
                    for lane in range(lanes):
                        x, y = A[u, lane], A[v, lane]
                        A[u, lane] = c[lane] * x - s[lane] * y
                        A[v, lane] = s[lane] * x + c[lane] * y
        if largest_angle == 0.0:
            break
    for lane in range(lanes):
        smallest, largest = math.inf, 0.0
        for i in range(n):
            smallest, largest = min(smallest, A[i * n + i, lane]), max(largest, A[i * n + i, lane])
        excitation[lane] = math.sqrt(max(smallest, 0.0) / largest) if largest > 0.0 else 0.0


@njit(void(LANES, int64, LANES, ROWS), **OPTIONS)
def find_start(products, n, M, excitation):
    """Write M of the dynamic mode decomposition, and the samples' smallest singular value over their largest.

    Args:
        products (numpy.ndarray): The sums of :func:`sum_moments`.
        `n` (int): Number of states.
        M, excitation (numpy.ndarray): Written.
    """
    A, f, g = rows_of(n * n), scratch(1), scratch(1)
    XD, XX = products[: n * n], products[n * n : 2 * n * n]
    copy_rows(A, XX)
    _singular_ratio(A, n, f, g, excitation)
    copy_rows(A, XX)
    copy_rows(M, XD)  # rows of M are columns of its transpose, as those of XD are
    solve_in_lanes(A, M, n, n, False, -math.inf, f)
    for i in range(n):
        for lane in range(W):
            M[i * n + i, lane] += 1.0
    for at in range(n * n):
        for lane in range(W):
            if not math.isfinite(M[at, lane]):
                excitation[lane] = 0.0


@njit(void(*5 * (ROWS,), types.UniTuple(int64, 3)), **INNER)
def _advance_samples(M, X0, live, Z, V, place):
    """Write M x, and M Z + X0 eᵀ x for every parameter, into the unused half of Z and the sample's rows of V.

    Lanes that are not live end, at 0. Lengths of rows of M and of columns of Z are multiples of FOUR.
    """
    (P, n, sample), N = place, M.size // (place[1] * W)
    new, old = sample % 2 * (P + 1) * N, (1 - sample % 2) * (P + 1) * N
    for p in range(P + 1):  # the last is x, with a row 0 of X0
        v = np.uint64((old + P * N + p % n) * W)
        for i in range(n):
            u, to = np.uint64((p // n * n + i) * W), np.uint64((new + p * N + i) * W)
            into = np.uint64((((p + 1) * n + i) * FOUR + sample) * W)
            for k in range(0, N, FOUR):
                a, b = np.uint64((i * N + k) * W), np.uint64((old + p * N + k) * W)
                if k == 0:
                    for lane in range(W):
                        x, y = a + np.uint64(lane), b + np.uint64(lane)
                        first = M[x] * Z[y] + M[x + np.uint64(W)] * Z[y + np.uint64(W)]
                        second = M[x + np.uint64(2 * W)] * Z[y + np.uint64(2 * W)]
                        third = M[x + np.uint64(3 * W)] * Z[y + np.uint64(3 * W)]
                        z = X0[u + np.uint64(lane)] * Z[v + np.uint64(lane)] + (first + (second + third))
                        Z[to + np.uint64(lane)] = live[lane] * z
                else:
                    for lane in range(W):
                        x, y = a + np.uint64(lane), b + np.uint64(lane)
                        first = M[x] * Z[y] + M[x + np.uint64(W)] * Z[y + np.uint64(W)]
                        second = M[x + np.uint64(2 * W)] * Z[y + np.uint64(2 * W)]
                        third = M[x + np.uint64(3 * W)] * Z[y + np.uint64(3 * W)]
                        Z[to + np.uint64(lane)] += live[lane] * (first + (second + third))
            for lane in range(live.size):
                V[into + np.uint64(lane)] = Z[to + np.uint64(lane)]


@njit(void(*4 * (ROWS,), *3 * (int64,), ROWS, ROWS), **OPTIONS)
def sum_normal_equations(Y, weight, M, X0, runs, count, n, by_x, squares):
    """Add up the normal equations: :func:`add_products` of the residuals, the slopes by Θ and the model's samples x.

    Args:
        Y, weight (numpy.ndarray): Samples and their weights, as in :func:`fit_block`, flat.
        `M`, `X0` (numpy.ndarray): The model's matrix, and the starts of its runs.
        `runs`, `count`, `n` (int): Numbers of runs, of samples of a run, and of states.
        by_x, squares (numpy.ndarray): Written, as by :func:`add_products`.
    """
    P, N = runs * n, -(-n // FOUR) * FOUR
    V = scratch((P + 2) * n * FOUR)
    Z = scratch(2 * (P + 1) * N)
    A = scratch(n * N)
    X = scratch(P + n)
    live = scratch(1)
    by_x[:], squares[:] = 0.0, 0.0
    for i in range(n):
        for at in range(n * W):
            A[i * N * W + at] = M[i * n * W + at]
    for at in range(P * W):
        X[at] = X0[at]
    for r in range(runs):
        for k in range(-(-count // FOUR) * FOUR):
            weight_row, sample, num_live = (r * count + min(k, count - 1)) * W, k % FOUR, 0
            for lane in range(live.size):
                live[lane] = weight[weight_row + lane] if k < count else 0.0
                num_live |= 1 if live[lane] > 0.0 else 0
            if num_live == 0 and sample == 0:
                break
            if k == 0:
                Z[:], V[:] = 0.0, 0.0
                for i in range(n):
                    for lane in range(W):
                        x = live[lane] * X0[(r * n + i) * W + lane]
                        Z[(P * N + i) * W + lane] = x
                        V[((P + 1) * n + i) * FOUR * W + lane] = x
            else:
                _advance_samples(A, X, live, Z, V, (P, n, sample))
            for i in range(n):
                old, d = np.uint64(weight_row * n + i * W), np.uint64((i * FOUR + sample) * W)
                x = d + np.uint64((P + 1) * n * FOUR * W)
                for lane in range(live.size):
                    y = live[lane] * Y[old + np.uint64(lane)]
                    V[d + np.uint64(lane)] = y - V[x + np.uint64(lane)]
            if sample == FOUR - 1:
                add_products(V, P, n, by_x, squares)


@njit(void(LANES, LANES, *3 * (int64,), *3 * (ROWS,), float64, int64, LANES), **OPTIONS)
def fit_block(Y, weight, runs, count, n, spacing, floor, matrix_error, factor, lanes, raw):
    """Fit the matrix M of the flow over one sample, and each run's start X0, to all samples of the lanes of a block.

    x_k = M^k X0 is fitted by at most MAX_STEPS Gauss–Newton steps; `M` then gives eigenvalues and invariants. A lane
    whose samples hardly depend on some entry of M (excitation below MIN_EXCITATION) has NaN.

    Args:
        `Y` (numpy.ndarray, shape (runs count n, W)): Sample k of run r, state i in row (r count + k) n + i.
        weight (numpy.ndarray, shape (runs count, W)): 1 for the first samples of a run, which count; else 0, as is Y.
        `runs`, `count`, `n` (int): Numbers of runs, of samples of a run, and of states.
        spacing (numpy.ndarray, shape (W,)): Time between samples, s.
        floor (numpy.ndarray, shape (W,)): Error of a sample that does not show in the scatter.
        matrix_error (numpy.ndarray, shape (W,)): As in :func:`kernels.flow.invariants.write_results`.
        factor (float): 0 for standard errors, else the multiple of the scatter in a bound, see
            :mod:`kernels.flow.flows`.
        lanes (int): Number of lanes with points.
        raw (numpy.ndarray, shape (W, HEAD + 4 n)): Written: columns as in :mod:`kernels.flow.codes`.
    """
    P = runs * n
    Y, counts = Y.reshape(Y.size), weight.reshape(weight.size)
    M, X0, by_x, squares = scratch(n * n), scratch(P), scratch((P + 2) * n * n), scratch((P + 1) * (P + 1))
    excitation = scratch(1)
    residuals = scratch(1)
    change = scratch(1)
    covariance = rows_of(P * P + 1)
    noise = scratch(1)
    change[:], noise[:] = math.inf, math.nan
    sum_moments(Y, counts, runs, count, n, by_x, squares)
    find_start(as_lanes(by_x), n, as_lanes(M), excitation)
    for r in range(runs):
        for at in range(n * W):
            X0[r * n * W + at] = Y[r * count * n * W + at]
    for _ in range(MAX_STEPS):
        sum_normal_equations(Y, counts, M, X0, runs, count, n, by_x, squares)
        products = (as_lanes(by_x), as_lanes(squares))
        if not step_lanes(as_lanes(M), as_lanes(X0), runs, n, *products, covariance, residuals, excitation, change):
            break
    for lane in range(lanes):
        row, num_samples = raw[lane], 0.0
        for k in range(runs * count):
            num_samples += weight[k, lane]
        equations = n * num_samples
        freedom = equations - n * n - P
        for i in range(row.size):
            row[i] = math.nan
        row[EQUATIONS], row[EXCITATION] = equations, excitation[lane]
        if excitation[lane] < MIN_EXCITATION or freedom < 1.0:
            continue
        scatter = math.sqrt(residuals[lane] / freedom)
        row[SCATTER] = scatter
        weak = 1.0 + WEAK_FACTOR * min(1.0, WEAK_PIVOT * UNIT * covariance[P * P, lane])
        noise[lane] = weak * math.sqrt(equations) * (factor * scatter + floor[lane]) if factor > 0.0 else scatter
    write_results(as_lanes(M), as_lanes(X0), runs, n, covariance, noise, matrix_error, spacing, lanes, raw)
