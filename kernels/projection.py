r"""Least squares of the matrix M of a linear motion, lane by lane: a start from the samples, and Gauss-Newton steps.

*Start.* Dynamic mode decomposition, :math:`M - 1 = \sum(y_{k+1} - y_k)y_k^{\mathsf T}\,(\sum y_ky_k^{\mathsf T})^{-1}`.

*Steps.* Gauss-Newton steps of variable projection in real parameters. Near a first M every other one that can be told
from it, with its starts, is

.. math:: y^{(r)}_k = C\,\bigl(M + X_0\Theta\bigr)^k x^{(r)}_0, \qquad
          X_0 = (x^{(1)}_0 \ldots x^{(R)}_0),\quad \Theta\in\mathbb R^{R\times n},\quad C\in\mathbb R^{n\times n}

which counts n² + R n parameters, as M and the starts do: for one run the parameters Θ are those of pole placement, and
the model is that of n exponentials with an amplitude of each in each channel. C is linear and projected out. Nothing
here is singular where eigenvalues meet, whether M stays diagonalisable there (two runs tell) or not.

Symbols: :mod:`kernels.spectrum`. *Lanes* are as in :mod:`kernels.blocks`; a loop over them asks an array for its width,
for then it is not unrolled.

Source: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413 (variable projection); Tu et al., J. Comput. Dyn. 1 (2014)
391 (DMD). The parameters, and that their number is right, were derived here.
"""

import math

import numpy as np

from kernels.blocks import W, put, rows_of, scratch
from kernels.dense import add_inner, add_outer, product_in_lanes, solve_in_lanes
from kernels.jit import OPTIONS, PASSED, boolean, float64, int64, njit, types, whole_vectors

CLOSE = 1e-10  # a step that changes M by less is the last
LEAST_MOVED = 1e-4  # smallest singular value of the samples over the largest: below it a mode was not moved
EPSILON = float(np.finfo(np.float64).eps)

ROWS, LANES = float64[::1], float64[:, ::1]
STEPPED = boolean(*2 * (LANES,), int64, int64, *7 * (LANES,), ROWS, ROWS, ROWS)
STEP = types.FunctionType(STEPPED)


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
    left, on, f = scratch(1), scratch(1), scratch(1)
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
    for lane in range(lanes):
        left[lane] = max(left[lane], EPSILON * RR[0, lane])
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
    return _taken(M, X0, A, U, right, left, on, P, covariance, rest, moved, change)
