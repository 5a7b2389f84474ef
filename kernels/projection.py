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

from kernels.blocks import put, rows_of, scratch
from kernels.dense import add_inner, product_in_lanes, solve_in_lanes
from kernels.fitting import EPSILON, LEAST_MOVED, STEPPED
from kernels.jit import OPTIONS, PASSED, njit, whole_vectors

CLOSE = 1e-10  # a step that changes M by less is the last


@njit(**OPTIONS)
def _scaled_inverse(H, right, P, d, f):
    """H⁻¹ in the first P columns of right, and times its last; H has a diagonal of one meanwhile, nothing is left out.

    Rows p P + q of H, of which q ≤ p are read; d, f are scratch.
    """
    whole_vectors()
    lanes = f.size
    for p in range(P):
        for lane in range(lanes):
            x = H[p * P + p, lane]
            d[p, lane] = 1.0 / math.sqrt(x) if x > 0.0 else 0.0
    for p in range(P):
        for q in range(p + 1):
            for lane in range(lanes):
                x = H[p * P + q, lane] * (d[p, lane] * d[q, lane])
                H[p * P + q, lane] = x
                H[q * P + p, lane] = x
                right[p * P + q, lane] = 0.0
                right[q * P + p, lane] = 0.0
        for lane in range(lanes):
            H[p * P + p, lane] = 1.0 + 4.0 * EPSILON
            right[p * P + p, lane] = d[p, lane]
            right[P * P + p, lane] *= d[p, lane]
    solve_in_lanes(H, right, P, P + 1, False, EPSILON, f)
    for c in range(P + 1):
        for p in range(P):
            for lane in range(lanes):
                right[c * P + p, lane] *= d[p, lane]


@njit(**OPTIONS)
def _normal(XX, XR, XZ, HH, HR, RR, runs, n, A, B, H, right, rest, f):
    """C projected out: minus its answers into B, the normal matrix into H, right sides into right, what is left."""
    whole_vectors()
    P, nn = runs * n, n * n
    for at in range(nn):
        for lane in range(f.size):
            A[at, lane] = -XX[at, lane]
    put(B, XZ)
    put(B[nn * P :], XR)
    solve_in_lanes(A, B, n, n * P + n, False, -math.inf, f)
    put(H, HH)
    put(right[P * P :], HR)
    put(rest.reshape(1, rest.size), RR)
    for p in range(P):  # by what rounding may have taken off: where M is of a special shape, some step changes nothing
        for lane in range(f.size):
            H[p * P + p, lane] += 16.0 * EPSILON * HH[p * P + p, lane]
    flat, by_z, by_r = B.reshape(B.size), XZ.reshape(XZ.size), XR.reshape(XR.size)
    into = H.reshape(H.size)
    for p in range(P):
        add_inner(into, p * P, by_z, p * nn, 0, flat, 0, nn, nn, p + 1)
    add_inner(right.reshape(right.size), P * P, by_z, 0, nn, flat, nn * P, 0, nn, P)
    add_inner(rest, 0, by_r, 0, 0, flat, nn * P, 0, nn, 1)


@njit(**OPTIONS)
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


@njit(STEPPED, **PASSED)
def step(M, X0, runs, n, XX, XR, XZ, HH, HR, RR, covariance, rest, moved, change):
    """Make one step of every lane that has not come to rest; return whether one has not.

    Besides: the inverse of the projected normal matrix, the sum of squares left, and the change of M.
    """
    whole_vectors()
    P, nn = runs * n, n * n
    A, C, T, B, U = rows_of(nn), rows_of(nn), rows_of(nn), rows_of(nn * P + nn), rows_of(P)
    H, right, old, d = rows_of(P * P), rows_of(P * P + P + 1), rows_of(P), rows_of(P)
    left, on, again, f = scratch(1), scratch(1), scratch(1), scratch(1)
    lanes = on.size
    for lane in range(lanes):  # a lane's steps are its own, whoever its neighbours are
        on[lane] = 1.0 if moved[lane] >= LEAST_MOVED and change[lane] >= CLOSE else 0.0
    _normal(XX, XR, XZ, HH, HR, RR, runs, n, A, B, H, right, left, f)
    put(old, right[P * P : P * P + P])
    _scaled_inverse(H, right, P, d, f)
    right[P * P + P] = 0.0
    for p in range(P):  # the least pivot's inverse: so many roundings an element of the inverse may hold
        for lane in range(lanes):
            right[P * P + P, lane] = max(right[P * P + P, lane], H[p * P + p, lane])
    # what the step takes off the sum of squares: Θ·(right side)
    for p in range(P):
        for lane in range(lanes):
            left[lane] -= right[P * P + p, lane] * old[p, lane]
    for lane in range(lanes):  # nothing left is rounding: then what was there before stands, until another step
        again[lane] = on[lane] if left[lane] < EPSILON * RR[0, lane] else 0.0
        left[lane] = RR[0, lane] if again[lane] > 0.0 else left[lane]
    for i in range(n):
        for j in range(n):
            for lane in range(lanes):
                C[i * n + j, lane] = (1.0 if i == j else 0.0) - B[(P * n + i) * n + j, lane]
                T[i * n + j, lane] = M[i * n + j, lane]
            for p in range(P):
                for lane in range(lanes):
                    C[i * n + j, lane] += B[(p * n + i) * n + j, lane] * right[P * P + p, lane]
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
