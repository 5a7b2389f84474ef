r"""Least squares of the matrix M of a linear motion, lane by lane: Gauss-Newton steps.

Variable projection in real parameters. Near a first M all distinguishable M, with their starts, are

.. math:: y^{(r)}_k = C\,\bigl(M + X_0\Theta\bigr)^k x^{(r)}_0, \qquad
          X_0 = (x^{(1)}_0 \ldots x^{(R)}_0),\quad \Theta\in\mathbb R^{R\times n},\quad C\in\mathbb R^{n\times n}

which has n² + R n parameters, as many as M and the starts: for one run the parameters Θ are those of pole placement,
and the model is that of n exponentials with an amplitude of each in each channel. C is linear and projected out. The
equations are regular at multiple eigenvalues, for diagonalisable M (which needs two runs) and for defective M.

Symbols: :mod:`kernels.flow.spectrum`. *Lanes* are as in :mod:`kernels.compile.blocks`; a loop over lanes reads its
length from an array, so that it is not unrolled.

Source: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413. The parameters and their number were derived here.
"""

import math

from kernels.compile.blocks import LANES, ROWS, rows_of, scratch
from kernels.compile.jit import INNER, OPTIONS, boolean, int64, njit, void
from kernels.flow.codes import MIN_EXCITATION, UNIT
from kernels.flow.dense import add_inner, copy_rows, product_in_lanes, solve_in_lanes

MIN_CHANGE = 1e-10  # largest change of an element of M by the last step


@njit(void(LANES, LANES, LANES, int64, LANES, ROWS), **INNER)
def _scaled_inverse(Q, H, right, P, d, f):
    """Write H⁻¹ into the first P columns of right, and H⁻¹ times the last column into the last.

    Q: the lower half of H below a first row and column, which contains the last column of right. H is scaled to a unit
    diagonal; d, f are scratch.
    """
    lanes = f.size
    for p in range(P):
        for lane in range(lanes):
            x = Q[(p + 1) * (P + 2), lane]
            d[p, lane] = 1.0 / math.sqrt(x) if x > 0.0 else 0.0
    for p in range(P):
        for q in range(p + 1):
            for lane in range(lanes):
                x = Q[(p + 1) * (P + 1) + q + 1, lane] * (d[p, lane] * d[q, lane])
                H[p * P + q, lane] = x
                H[q * P + p, lane] = x
        for lane in range(lanes):
            H[p * P + p, lane] = 1.0 + 4.0 * UNIT
            right[p * P + p, lane] = d[p, lane]
            right[P * P + p, lane] = Q[(p + 1) * (P + 1), lane] * d[p, lane]
    solve_in_lanes(H, right, P, P + 1, False, UNIT, f)
    for c in range(P + 1):
        for p in range(P):
            for lane in range(lanes):
                right[c * P + p, lane] *= d[p, lane]


@njit(void(LANES, LANES, int64, LANES, LANES, ROWS), **INNER)
def _normal_matrix(by_x, squares, n, B, Q, f):
    """Project C out; write minus its solutions to B, and the normal matrix to Q, residuals first."""
    nn, A = n * n, rows_of(n * n)
    P1 = len(by_x) // nn - 1
    for at in range(nn):
        for lane in range(f.size):
            A[at, lane] = -by_x[nn * P1 + at, lane]
    copy_rows(B, by_x[: nn * P1])
    solve_in_lanes(A, B, n, n * P1, False, -math.inf, f)
    copy_rows(Q, squares)
    for p in range(1, P1):  # add a bound on the rounding: for special M, a step changes nothing and its pivot vanishes
        for lane in range(f.size):
            Q[p * P1 + p, lane] += 16.0 * UNIT * squares[p * P1 + p, lane]
    flat, products, target = B.reshape(B.size), by_x.reshape(by_x.size), Q.reshape(Q.size)
    for p in range(P1):
        add_inner(target, p * P1, products, p * nn, 0, flat, 0, nn, nn, p + 1)


@njit(boolean(*5 * (LANES,), ROWS, ROWS, int64, LANES, *3 * (ROWS,)), **INNER)
def _accept_step(M, X0, A, U, right, new_squares, is_active, P, covariance, sum_squares, excitation, change):
    """Copy a step's results in active lanes: A to M, U to X0, right to covariance; return whether a lane goes on.

    A lane that is not finite becomes inactive. `change` is the largest change of M's entries; a lane goes on at
    MIN_CHANGE and above. The row P² of the covariance is its sum of squares.
    """
    lanes = is_active.size
    for rows in (A, U):
        for at in range(rows.shape[0]):
            for lane in range(lanes):
                if is_active[lane] > 0.0 and not math.isfinite(rows[at, lane]):
                    is_active[lane], excitation[lane] = 0.0, 0.0
    for lane in range(lanes):
        sum_squares[lane] = new_squares[lane] if is_active[lane] > 0.0 else sum_squares[lane]
        change[lane] = 0.0 if is_active[lane] > 0.0 else change[lane]
    for at in range(A.shape[0]):
        for lane in range(lanes):
            before, after = M[at, lane], A[at, lane]
            change[lane] = max(change[lane], abs(after - before)) if is_active[lane] > 0.0 else change[lane]
            M[at, lane] = after if is_active[lane] > 0.0 else before
    for at in range(P):
        for lane in range(lanes):
            X0[at, lane] = U[at, lane] if is_active[lane] > 0.0 else X0[at, lane]
    for at in range(P * P):
        for lane in range(lanes):
            covariance[at, lane] = right[at, lane] if is_active[lane] > 0.0 else covariance[at, lane]
    for lane in range(lanes):
        covariance[P * P, lane] = right[P * P + P, lane] if is_active[lane] > 0.0 else covariance[P * P, lane]
    goes_on = False
    for lane in range(lanes):
        goes_on = goes_on or (is_active[lane] > 0.0 and change[lane] >= MIN_CHANGE)
    return goes_on


@njit(boolean(LANES, LANES, int64, int64, *3 * (LANES,), *3 * (ROWS,)), **OPTIONS)
def step_lanes(M, X0, runs, n, by_x, squares, covariance, sum_squares, excitation, change):
    """Make one step of every lane that has not converged; return whether any lane goes on.

    Args:
        `M`, `X0` (numpy.ndarray): The matrix and the starts of the runs, overwritten.
        `runs`, `n` (int): Numbers of runs and of states.
        by_x, squares (numpy.ndarray): As written by :func:`kernels.flow.spectrum.sum_normal_equations`.
        covariance (numpy.ndarray): Written: inverse of the projected normal matrix; in its last row the least pivot's.
        sum_squares, excitation, change (numpy.ndarray): Sum of squared residuals, written; excitation, set to 0 if the
            algebra fails; change of M, written.
    """
    P, nn = runs * n, n * n
    A, C, T, B, U = rows_of(nn), rows_of(nn), rows_of(nn), rows_of(nn * P + nn), rows_of(P)
    Q, H, right, d = rows_of((P + 1) * (P + 1)), rows_of(P * P), rows_of(P * P + P + 1), rows_of(P)
    new_squares, is_active, repeats, f = scratch(1), scratch(1), scratch(1), scratch(1)
    lanes = is_active.size
    for lane in range(lanes):  # a lane's steps do not depend on its neighbours
        is_active[lane] = 1.0 if excitation[lane] >= MIN_EXCITATION and change[lane] >= MIN_CHANGE else 0.0
    _normal_matrix(by_x, squares, n, B, Q, f)
    _scaled_inverse(Q, H, right, P, d, f)
    for p in range(P):  # inverse of the least pivot: a bound on the roundings of an element of the inverse
        for lane in range(lanes):
            right[P * P + P, lane] = max(right[P * P + P, lane], H[p * P + p, lane])
    # decrease of the sum of squares by the step: Θ·(right side)
    for lane in range(lanes):
        new_squares[lane] = Q[0, lane]
    for p in range(P):
        for lane in range(lanes):
            new_squares[lane] -= right[P * P + p, lane] * Q[(p + 1) * (P + 1), lane]
    for lane in range(
        lanes
    ):  # a sum of squares at rounding level is not reduced: the previous one is used until another step
        repeats[lane] = is_active[lane] if new_squares[lane] < UNIT * squares[0, lane] else 0.0
        new_squares[lane] = squares[0, lane] if repeats[lane] > 0.0 else new_squares[lane]
    for i in range(n):
        for j in range(n):
            for lane in range(lanes):
                C[i * n + j, lane] = (1.0 if i == j else 0.0) - B[i * n + j, lane]
                T[i * n + j, lane] = M[i * n + j, lane]
            for p in range(P):
                for lane in range(lanes):
                    C[i * n + j, lane] += B[((p + 1) * n + i) * n + j, lane] * right[P * P + p, lane]
            for s in range(runs):
                for lane in range(lanes):
                    T[i * n + j, lane] += X0[s * n + i, lane] * right[P * P + s * n + j, lane]
    # M ← C (M + X0 Θ) C⁻¹, X0 ← C X0: rows of a product are columns of its transpose, for C from the right
    product_in_lanes(C, T, A, n)
    flat, starts, ends = C.reshape(C.size), X0.reshape(X0.size), U.reshape(U.size)
    for s in range(runs):
        add_inner(ends, s * n, flat, 0, n, starts, s * n, 0, n, n)
    for i in range(n):
        for j in range(n):
            for lane in range(lanes):
                T[i * n + j, lane] = C[j * n + i, lane]
    solve_in_lanes(T, A, n, n, True, -math.inf, f)
    goes_on = _accept_step(M, X0, A, U, right, new_squares, is_active, P, covariance, sum_squares, excitation, change)
    for lane in range(lanes):
        if repeats[lane] > 0.0:
            change[lane], goes_on = math.inf, True
    return goes_on
