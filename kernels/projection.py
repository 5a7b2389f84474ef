r"""Least squares of the matrix M of a linear motion, lane by lane: Gauss-Newton steps.

Variable projection in real parameters. Near a first M every other one that can be told from it, with its starts, is

.. math:: y^{(r)}_k = C\,\bigl(M + X_0\Theta\bigr)^k x^{(r)}_0, \qquad
          X_0 = (x^{(1)}_0 \ldots x^{(R)}_0),\quad \Theta\in\mathbb R^{R\times n},\quad C\in\mathbb R^{n\times n}

which counts n² + R n parameters, as M and the starts do: for one run the parameters Θ are those of pole placement, and
the model is that of n exponentials with an amplitude of each in each channel. C is linear and projected out. Nothing
here is singular where eigenvalues meet, whether M stays diagonalisable there (two runs tell) or not.

Symbols: :mod:`kernels.spectrum`. *Lanes* are as in :mod:`kernels.blocks`; a loop over them asks an array for its width,
for then it is not unrolled.

Source: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413. The parameters, and that their number is right, were
derived here.
"""

import math

from kernels.blocks import LANES, ROWS, rows_of, scratch
from kernels.codes import MIN_EXCITATION, UNIT
from kernels.dense import add_inner, product_in_lanes, put, solve_in_lanes
from kernels.jit import INNER, OPTIONS, boolean, int64, njit, void, whole_vectors

CLOSE = 1e-10  # a step that changes M by less is the last


@njit(void(LANES, LANES, LANES, int64, LANES, ROWS), **INNER)
def _scaled_inverse(Q, H, right, P, d, f):
    """Write H⁻¹ into the first P columns of right, times its last; H has a diagonal of one meanwhile.

    Q: the lower half of H below a first row and column, which holds the last of right; d, f are scratch.
    """
    whole_vectors()
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
def _normal(by_x, squares, n, B, Q, f):
    """Project C out; write minus its answers to B, the normal matrix into Q, of which the residuals' are the first."""
    whole_vectors()
    nn, A = n * n, rows_of(n * n)
    P1 = len(by_x) // nn - 1
    for at in range(nn):
        for lane in range(f.size):
            A[at, lane] = -by_x[nn * P1 + at, lane]
    put(B, by_x[: nn * P1])
    solve_in_lanes(A, B, n, n * P1, False, -math.inf, f)
    put(Q, squares)
    for p in range(1, P1):  # by what rounding may have taken off: where M is special, some step changes nothing
        for lane in range(f.size):
            Q[p * P1 + p, lane] += 16.0 * UNIT * squares[p * P1 + p, lane]
    flat, given, into = B.reshape(B.size), by_x.reshape(by_x.size), Q.reshape(Q.size)
    for p in range(P1):
        add_inner(into, p * P1, given, p * nn, 0, flat, 0, nn, nn, p + 1)


@njit(boolean(*5 * (LANES,), ROWS, ROWS, int64, LANES, *3 * (ROWS,)), **INNER)
def _taken(M, X0, A, U, right, left, on, P, covariance, rest, moved, change):
    """Take a step's results over in the lanes that are on, but where the algebra broke down; whether one goes on."""
    whole_vectors()
    lanes = on.size
    for rows in (A, U):
        for at in range(rows.shape[0]):
            for lane in range(lanes):
                if on[lane] > 0.0 and not math.isfinite(rows[at, lane]):
                    on[lane], moved[lane] = 0.0, 0.0
    for lane in range(lanes):
        rest[lane] = left[lane] if on[lane] > 0.0 else rest[lane]
        change[lane] = 0.0 if on[lane] > 0.0 else change[lane]
    for at in range(A.shape[0]):
        for lane in range(lanes):
            before, after = M[at, lane], A[at, lane]
            change[lane] = max(change[lane], abs(after - before)) if on[lane] > 0.0 else change[lane]
            M[at, lane] = after if on[lane] > 0.0 else before
    for at in range(P):
        for lane in range(lanes):
            X0[at, lane] = U[at, lane] if on[lane] > 0.0 else X0[at, lane]
    for at in range(P * P):
        for lane in range(lanes):
            covariance[at, lane] = right[at, lane] if on[lane] > 0.0 else covariance[at, lane]
    for lane in range(lanes):
        covariance[P * P, lane] = right[P * P + P, lane] if on[lane] > 0.0 else covariance[P * P, lane]
    going = False
    for lane in range(lanes):
        going = going or (on[lane] > 0.0 and change[lane] >= CLOSE)
    return going


@njit(boolean(LANES, LANES, int64, int64, *3 * (LANES,), *3 * (ROWS,)), **OPTIONS)
def step(M, X0, runs, n, by_x, squares, covariance, rest, moved, change):
    """Make one step of every lane that has not come to rest; return whether one has not.

    by_x, squares: as of :func:`kernels.spectrum.sums`. Besides: the inverse of the projected normal matrix, the sum of
    squares left, and the change of M.
    """
    whole_vectors()
    P, nn = runs * n, n * n
    A, C, T, B, U = rows_of(nn), rows_of(nn), rows_of(nn), rows_of(nn * P + nn), rows_of(P)
    Q, H, right, d = rows_of((P + 1) * (P + 1)), rows_of(P * P), rows_of(P * P + P + 1), rows_of(P)
    left, on, again, f = scratch(1), scratch(1), scratch(1), scratch(1)
    lanes = on.size
    for lane in range(lanes):  # a lane's steps are its own, whoever its neighbours are
        on[lane] = 1.0 if moved[lane] >= MIN_EXCITATION and change[lane] >= CLOSE else 0.0
    _normal(by_x, squares, n, B, Q, f)
    _scaled_inverse(Q, H, right, P, d, f)
    for p in range(P):  # the least pivot's inverse: so many roundings an element of the inverse may hold
        for lane in range(lanes):
            right[P * P + P, lane] = max(right[P * P + P, lane], H[p * P + p, lane])
    # what the step takes off the sum of squares: Θ·(right side)
    for lane in range(lanes):
        left[lane] = Q[0, lane]
    for p in range(P):
        for lane in range(lanes):
            left[lane] -= right[P * P + p, lane] * Q[(p + 1) * (P + 1), lane]
    for lane in range(lanes):  # nothing left is rounding: then what was there before stands, until another step
        again[lane] = on[lane] if left[lane] < UNIT * squares[0, lane] else 0.0
        left[lane] = squares[0, lane] if again[lane] > 0.0 else left[lane]
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
    going = _taken(M, X0, A, U, right, left, on, P, covariance, rest, moved, change)
    for lane in range(lanes):
        if again[lane] > 0.0:
            change[lane], going = math.inf, True
    return going
