r"""Eigenvalues from samples of known states, with errors, blind to any theory.

*Model.* Runs r = 1 … R of one linear motion, all n states sampled every h: :math:`y^{(r)}_k = M^k x^{(r)}_0` and noise,
:math:`M = e^{Ah}`. Asked for are the eigenvalues of A, and what is smooth in A where two of them meet.

*Start.* Dynamic mode decomposition, :math:`M - 1 = \sum(y_{k+1} - y_k)y_k^{\mathsf T}\,(\sum y_ky_k^{\mathsf T})^{-1}`.

*Steps.* Gauss-Newton steps of variable projection in real parameters. Near a first M every other one that can be told
from it, with its starts, is

.. math:: y^{(r)}_k = C\,\bigl(M + X_0\Theta\bigr)^k x^{(r)}_0, \qquad
          X_0 = (x^{(1)}_0 \ldots x^{(R)}_0),\quad \Theta\in\mathbb R^{R\times n},\quad C\in\mathbb R^{n\times n}

which counts n² + R n parameters, as M and the starts do: for one run the parameters Θ are those of pole placement, and
the model is that of n exponentials with an amplitude of each in each channel. C is linear and projected out. Nothing
here is singular where eigenvalues meet, whether M stays diagonalisable there (two runs tell) or not.

*Errors.* From the last step, :math:`\mathrm{Cov}\,\Theta = s^2\tilde H^{-1}`, :math:`\tilde H` the projected normal
matrix: the Cramér-Rao bound for white noise. The coefficients of
:math:`p(\lambda) = \det(\lambda - A)` follow by Faddeev and Le Verrier,
:math:`\mathrm dc_{n-1-k} = -\operatorname{tr}(N_k\,\mathrm dA)` with polynomials :math:`N_k` in A, so that
:math:`\mathrm dA` may be :math:`M^{-1}\mathrm dM/h`. An eigenvalue's error is :math:`|\delta p/p'|` while that is far
below the distance of the next one, else the radius within which a root of the disturbed polynomial must lie,
:math:`\min_k \bigl(\tbinom nk\,|\delta p|\,/\,|p^{(k)}/k!|\bigr)^{1/k}`.

*Invariants.* For four eigenvalues :math:`S = \tfrac12\sum\lambda^2`, :math:`D = \prod\lambda` and S² - 4D with errors:
of two pairs ±μ1, ±μ2 they are μ1² + μ2², μ1² μ2² and (μ1² - μ2²)², and smooth through any collision.

*Lanes* are as in :mod:`kernels.blocks`; a loop over them asks an array for its width, for then it is not unrolled.

Source: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413 (variable projection); Tu et al., J. Comput. Dyn. 1 (2014)
391 (DMD); Marden, Geometry of Polynomials, section 33 (radii). The parameters, and that their number is right, were
derived here. Not validated: more than 12 states.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.blocks import W, rows_of, scratch
from kernels.dense import eigenvalues, logarithm, order, product_in_lanes
from kernels.jit import OPTIONS, PASSED, boolean, float64, int64, njit, types, void, whole_vectors

MOST_STATES = 12
STEPS = 4  # of Gauss-Newton, at most
CLOSE = 1e-10  # a step that changes M by less is the last
SAME = 1e-6  # of the spacing's inverse: imaginary parts nearer than this are one where eigenvalues are ordered
LEAST_MOVED = 1e-4  # smallest singular value of the samples over the largest: below it a mode was not moved
EPSILON = float(np.finfo(np.float64).eps)
ROUNDINGS = 8.0  # of the logarithm and what follows it, beside the largest eigenvalue
ARTANH = 20  # terms of artanh's series for a logarithm: of Z², where the rates bound |Z| by tan π/8
REACHED = 2e-6  # square of the size of Z to the eighth, below which what these terms leave is below rounding
# Roundings that a term of a covariance may hold, which a large sum of terms cancels down to: at least, and over the
# least pivot, which bounds them (a thirtieth of that bound, in an error, holds those of the benchmark).
LOST, PIVOTED = 1e4, 1e-3

ROWS, LANES = float64[::1], float64[:, ::1]
# Handed over as arguments: a function that calls another by its name compiles it once more.
STEPPED = boolean(*2 * (LANES,), int64, int64, *7 * (LANES,), ROWS, ROWS, ROWS)
TOLD = void(LANES, LANES, int64, int64, LANES, ROWS, ROWS, int64, LANES)
STEP, TELL = types.FunctionType(STEPPED), types.FunctionType(TOLD)
FITTED = void(STEP, TELL, LANES, LANES, int64, int64, int64, ROWS, ROWS, float64, int64, LANES)
FIT = types.FunctionType(FITTED)

# Columns of a raw result; after HEAD follow real parts, imaginary parts, their errors (n each).
EQUATIONS, SCATTER, MOVED, ODD, SUM, SUM_ERROR, PRODUCT, PRODUCT_ERROR, DISCRIMINANT, DISCRIMINANT_ERROR = range(10)
HEAD = 10


# -- the steps, lane by lane


@njit(**OPTIONS)
def _lanes(flat):
    """Rows of W lanes, as rows."""
    return flat.reshape(flat.size // W, W)


# Rows of W lanes, flat: rows W apart of one array need one check for overlap, and unsigned places none for wrapping.


@njit(void(ROWS, int64, ROWS, int64, int64, ROWS, int64, int64, int64, int64), **OPTIONS)
def _add_inner(out, row, A, a, a_step, B, b, b_step, n, count):
    """Add the sum over i < n of rows a + i of A times rows b + i of B to a row of out; count times, a step on each."""
    whole_vectors()
    left = n % 4
    for c in range(count):
        to, a_row, b_row = np.uint64((row + c) * W), (a + c * a_step) * W, (b + c * b_step) * W
        for i in range(0, n - left, 4):
            u, v = np.uint64(a_row + i * W), np.uint64(b_row + i * W)
            for lane in range(W):
                x, y = u + np.uint64(lane), v + np.uint64(lane)
                first = A[x] * B[y] + A[x + np.uint64(W)] * B[y + np.uint64(W)]
                second = A[x + np.uint64(2 * W)] * B[y + np.uint64(2 * W)]
                out[to + np.uint64(lane)] += first + (second + A[x + np.uint64(3 * W)] * B[y + np.uint64(3 * W)])
        for i in range(n - left, n):
            u, v = np.uint64(a_row + i * W), np.uint64(b_row + i * W)
            for lane in range(W):
                out[to + np.uint64(lane)] += A[u + np.uint64(lane)] * B[v + np.uint64(lane)]


@njit(void(ROWS, ROWS, int64, int64, ROWS, int64, int64), **OPTIONS)
def _add_outer(out, A, a, m, B, b, n):
    """Add row a + i of A times row b + j of B to row i n + j of out, for i < m and j < n."""
    whole_vectors()
    left = n % 4
    for i in range(m):
        u = np.uint64((a + i) * W)
        for j in range(0, n - left, 4):
            v, to = np.uint64((b + j) * W), np.uint64((i * n + j) * W)
            for lane in range(W):
                x, y, z = A[u + np.uint64(lane)], v + np.uint64(lane), to + np.uint64(lane)
                out[z] += x * B[y]
                out[z + np.uint64(W)] += x * B[y + np.uint64(W)]
                out[z + np.uint64(2 * W)] += x * B[y + np.uint64(2 * W)]
                out[z + np.uint64(3 * W)] += x * B[y + np.uint64(3 * W)]
        for j in range(n - left, n):
            v, to = np.uint64((b + j) * W), np.uint64((i * n + j) * W)
            for lane in range(W):
                out[to + np.uint64(lane)] += A[u + np.uint64(lane)] * B[v + np.uint64(lane)]


@njit(**OPTIONS)
def _moments(Y, weight, runs, count, n, XX, XD, y, d):
    """Sums of y yᵀ and of (y(t+h) - y(t)) yᵀ over neighbouring samples; y, d are scratch."""
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
            _add_outer(XX, y, 0, n, y, 0, n)
            _add_outer(XD, d, 0, n, y, 0, n)


@njit(**OPTIONS)
def _solve_lanes(A, B, n, m, exchange, least, f):
    """Overwrite the columns c of B, its rows c n + j, by A⁻¹ times them, lane by lane; A is lost, f is scratch.

    exchange: rows by the largest pivot; else A is definite, and no pivot is smaller than ``least``.
    """
    whole_vectors()
    lanes = f.size
    for k in range(n):
        if exchange:
            for i in range(k + 1, n):
                for lane in range(lanes):
                    f[lane] = 1.0 if abs(A[i * n + k, lane]) > abs(A[k * n + k, lane]) else 0.0
                for j in range(k, n):
                    _exchange(A, k * n + j, i * n + j, f)
                for c in range(m):
                    _exchange(B, c * n + k, c * n + i, f)
        for lane in range(lanes):
            pivot = A[k * n + k, lane]
            A[k * n + k, lane] = 1.0 / (least if pivot < least else pivot)
        for i in range(k + 1, n):
            for lane in range(lanes):
                f[lane] = A[i * n + k, lane] * A[k * n + k, lane]
            for j in range(k + 1, n):
                for lane in range(lanes):
                    A[i * n + j, lane] -= f[lane] * A[k * n + j, lane]
            for c in range(m):
                for lane in range(lanes):
                    B[c * n + i, lane] -= f[lane] * B[c * n + k, lane]
    for k in range(n - 1, -1, -1):
        for c in range(m):
            for i in range(k + 1, n):
                for lane in range(lanes):
                    B[c * n + k, lane] -= A[k * n + i, lane] * B[c * n + i, lane]
            for lane in range(lanes):
                B[c * n + k, lane] *= A[k * n + k, lane]


@njit(**OPTIONS)
def _exchange(A, i, k, f):
    """Exchange rows i and k in lanes where f is not 0."""
    whole_vectors()
    for lane in range(f.size):
        x, y = A[i, lane], A[k, lane]
        A[i, lane] = y if f[lane] > 0.0 else x
        A[k, lane] = x if f[lane] > 0.0 else y


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
def _start(XX, XD, n, M, moved):
    """M of the dynamic mode decomposition, and the samples' smallest singular value over their largest."""
    whole_vectors()
    A, f, g = rows_of(n * n), scratch(1), scratch(1)
    A[:] = XX
    _spread(A, n, f, g, moved)
    A[:], M[:] = XX, XD  # rows of M are columns of its transpose, as those of XD are
    _solve_lanes(A, M, n, n, False, -math.inf, f)
    for i in range(n):
        for lane in range(W):
            M[i * n + i, lane] += 1.0
    for at in range(n * n):
        for lane in range(W):
            if not math.isfinite(M[at, lane]):
                moved[lane] = 0.0


@njit(**OPTIONS)
def _sums(Y, weight, M, X0, runs, count, n, x, d, Z, XX, XR, XZ, HH, HR, RR):
    """Sums of the normal equations: of the model's samples x, its residuals d and its slopes Z by Θ.

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
            _add_inner(RR, 0, d, 0, 0, d, 0, 0, n, 1)
            _add_outer(XX, x, xs, n, x, xs, n)
            _add_outer(XR, d, 0, n, x, xs, n)
            _add_outer(XZ, Z, Zs, P * n, x, xs, n)
            _add_inner(HR, 0, Z, Zs, n, d, 0, 0, n, P)
            for p in range(P):
                _add_inner(HH, p * P, Z, Zs + p * n, 0, Z, Zs, n, n, p + 1)


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
        _add_inner(Z, new_Zs + p * n, M, 0, n, Z, Zs + p * n, 0, n, n)
    for at in range(new_xs * W, (new_xs + n) * W):
        x[at] = 0.0
    _add_inner(x, new_xs, M, 0, n, x, xs, 0, n, n)


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
    _solve_lanes(H, right, P, P + 1, False, EPSILON, f)
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
    B[: nn * P], B[nn * P :] = XZ, XR
    _solve_lanes(A, B, n, n * P + n, False, -math.inf, f)
    H[:], right[P * P : P * P + P], rest[:] = HH, HR, RR[0]
    for p in range(P):  # by what rounding may have taken off: where M is of a special shape, some step changes nothing
        for lane in range(f.size):
            H[p * P + p, lane] += 16.0 * EPSILON * HH[p * P + p, lane]
    flat, by_z, by_r = B.reshape(B.size), XZ.reshape(XZ.size), XR.reshape(XR.size)
    into = H.reshape(H.size)
    for p in range(P):
        _add_inner(into, p * P, by_z, p * nn, 0, flat, 0, nn, nn, p + 1)
    _add_inner(right.reshape(right.size), P * P, by_z, 0, nn, flat, nn * P, 0, nn, P)
    _add_inner(rest, 0, by_r, 0, 0, flat, nn * P, 0, nn, 1)


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
def _step(M, X0, runs, n, XX, XR, XZ, HH, HR, RR, covariance, rest, moved, change):
    """One step of every lane that has not come to rest; whether one has not.

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
    old[:] = right[P * P : P * P + P]
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
        _add_inner(ends, s * n, flat, 0, n, starts, s * n, 0, n, n)
    for i in range(n):
        for j in range(n):
            for lane in range(lanes):
                T[i * n + j, lane] = C[j * n + i, lane]
    _solve_lanes(T, A, n, n, True, -math.inf, f)
    return _taken(M, X0, A, U, right, left, on, P, covariance, rest, moved, change)


# -- from M to what is told


@njit(**OPTIONS)
def _logarithms(M, n, Y, T, U, Z, f):
    """Write the logarithm of M into Y, 2 artanh (M - 1)(M + 1)⁻¹ by its series, lane by lane; T, U, Z, f are scratch.

    Where so many terms do not reach, as Z to the eighth tells, :func:`logarithm` does.
    """
    whole_vectors()
    lanes = f.size
    for i in range(n):
        for j in range(n):  # transposed, for the factors commute, and rows of a product are its transpose's columns
            one = 1.0 if i == j else 0.0
            for lane in range(lanes):
                T[i * n + j, lane] = M[j * n + i, lane] + one
                Z[i * n + j, lane] = M[i * n + j, lane] - one
    _solve_lanes(T, Z, n, n, True, -math.inf, f)
    product_in_lanes(Z, Z, U, n)
    Y[:] = 0.0
    for k in range(ARTANH, -1, -1):  # Horner: Y = 1/(2k + 1) + Z² Y
        if k < ARTANH:
            product_in_lanes(U, Y, T, n)
            Y[:] = T
        for i in range(n):
            for lane in range(lanes):
                Y[i * n + i, lane] += 1.0 / (2 * k + 1)
    product_in_lanes(Z, Y, T, n)
    for at in range(n * n):
        for lane in range(lanes):
            Y[at, lane] = 2.0 * T[at, lane]
    product_in_lanes(U, U, T, n)
    product_in_lanes(T, T, U, n)
    f[:] = 0.0
    for at in range(n * n):
        for lane in range(lanes):
            f[lane] += U[at, lane] * U[at, lane]
    a, b = np.empty((n, n)), np.empty((n, n))
    for lane in range(lanes):
        if f[lane] < REACHED:
            continue
        for i in range(n):
            for j in range(n):
                a[i, j] = M[i * n + j, lane]
        sound = logarithm(a, n, b)
        for i in range(n):
            for j in range(n):
                Y[i * n + j, lane] = b[i, j] if sound else math.nan


@njit(**OPTIONS)
def _characteristics(A, n, N, c, T):
    """Coefficients c of det(λ - A), c[n] = 1, and the matrices N_k of adj(λ - A) = Σ λ^(n-1-k) N_k; T is scratch."""
    whole_vectors()
    lanes, nn = A.shape[1], n * n
    c[:], N[:] = 0.0, 0.0
    for lane in range(lanes):
        c[n, lane] = 1.0
        for i in range(n):
            N[i * n + i, lane] = 1.0
    for k in range(1, n + 1):
        product_in_lanes(A, N[(k - 1) * nn : k * nn], T, n)
        for i in range(n):
            for lane in range(lanes):
                c[n - k, lane] -= T[i * n + i, lane] / k
        if k < n:
            N[k * nn : (k + 1) * nn] = T
            for i in range(n):
                for lane in range(lanes):
                    N[k * nn + i * n + i, lane] += c[n - k, lane]


@njit(**OPTIONS)
def _coefficient_covariances(M, N, X0, runs, n, covariance, K, A, f):
    """Covariance of the coefficients for noise of one: dc_{n-1-k} = -N_k M⁻¹ x0_s by Θ_s; A, f are scratch."""
    P, nn = runs * n, n * n
    V, G, T = rows_of(P), rows_of(n * P), rows_of(n * P)
    A[:], V[:], K[:] = M, X0, 0.0
    _solve_lanes(A, V, n, runs, True, -math.inf, f)
    adjugates, starts, slopes, turned = N.reshape(N.size), V.reshape(V.size), G.reshape(G.size), T.reshape(T.size)
    inverse, into = covariance.reshape(covariance.size), K.reshape(K.size)  # of which the last row is not read
    for k in range(n):  # the sign of G cancels
        for s in range(runs):
            _add_inner(slopes, (n - 1 - k) * P + s * n, adjugates, k * nn, n, starts, s * n, 0, n, n)
    for k in range(n):
        _add_inner(turned, k * P, inverse, 0, P, slopes, k * P, 0, P, P)
    for k in range(n):
        _add_inner(into, k * n, slopes, 0, P, turned, k * P, 0, P, n)


@njit(**OPTIONS)
def _form(K, a, n, lost):
    """Standard deviation of Σ a_k c_k for noise of one, and what its own terms may have lost by cancelling.

    ``lost``: relative error of a term.
    """
    total, absolute = 0.0, 0.0
    for k in range(n):
        for m in range(n):
            term = a[k] * K[k, m] * a[m]
            total += term
            absolute += abs(term)
    return math.sqrt(max(total, 0.0) + lost * absolute)


@njit(**OPTIONS)
def _eigenvalue_error(c, K, n, x, y, gap, noise, lost, most, shifted, a, b, u, v):
    """Errors of the real and the imaginary part of the eigenvalue x + iy, the next one ``gap`` away.

    ``most``: the largest eigenvalue, for what rounding leaves; shifted, a, b, u and v are scratch.
    """
    point = complex(x, y)
    for k in range(n + 1):
        shifted[k] = c[k]
    for i in range(n):  # coefficients of p about the eigenvalue
        for k in range(n - 1, i - 1, -1):
            shifted[k] += point * shifted[k + 1]
    power = complex(1.0, 0.0)
    slope = shifted[1]
    steep = abs(slope)
    inverse = 1.0 / slope if steep > 0.0 else complex(0.0, 0.0)
    for k in range(n):
        turned = power * inverse
        a[k], b[k], u[k], v[k] = turned.real, turned.imag, power.real, power.imag
        power *= point
    rounding, power, size = 0.0, 1.0, math.hypot(x, y)
    for k in range(n + 1):
        rounding += ROUNDINGS * EPSILON * abs(c[k]) * power
        power *= size
    if steep > 0.0:
        rounded = rounding / steep + ROUNDINGS * EPSILON * most
        real, imaginary = noise * _form(K, a, n, lost) + rounded, noise * _form(K, b, n, lost) + rounded
        if max(real, imaginary) < 0.05 * gap:
            return real, imaginary
    off = noise * math.hypot(_form(K, u, n, lost), _form(K, v, n, lost)) + rounding
    radius, binomial = math.inf, 1.0
    for k in range(1, n + 1):
        binomial *= (n - k + 1.0) / k
        size = abs(shifted[k])
        if size > 0.0:
            radius = min(radius, (binomial * off / size) ** (1.0 / k))
    return radius, radius


@njit(**OPTIONS)
def _tell_invariants(re, im, c, K, a, noise, lost, spacing, row):
    """S, D and S² - 4D of four eigenvalues and their errors into a raw row; a: zeros, scratch."""
    S, D = 0.5 * c[3] * c[3] - c[2], c[0]
    a[3], a[2] = c[3], -1.0
    s = _form(K, a, 4, lost)
    a[3], a[2], a[0] = 2.0 * S * c[3], -2.0 * S, -4.0
    both = _form(K, a, 4, lost)
    s, d, both = noise * s, noise * math.sqrt(max(K[0, 0], 0.0)), noise * both + 4.0 * (noise * s) ** 2
    two, four, size = spacing * spacing, spacing**4, 0.0  # (the slope of S² - 4D may vanish)
    for i in range(4):
        size += re[i] * re[i] + im[i] * im[i]
    rounding = ROUNDINGS * EPSILON * size
    row[SUM], row[SUM_ERROR] = S / two, (s + rounding) / two
    row[PRODUCT], row[PRODUCT_ERROR] = D / four, (d + rounding * size) / four
    row[DISCRIMINANT], row[DISCRIMINANT_ERROR] = (S * S - 4.0 * D) / four, (both + rounding * size) / four


@njit(**OPTIONS)
def _tell_lane(re, im, n, c, K, noise, lost, spacing, parts, shifted, row):
    """Eigenvalues, invariants and their errors of one lane into its raw row; parts (4, n) and shifted are scratch."""
    order(re, im, n, SAME)
    a, b, u, v = parts[0], parts[1], parts[2], parts[3]
    a[:] = 0.0
    odd = 0.0
    for k in range(n - 1, -1, -2):
        a[k] = 1.0
        error = noise * _form(K, a, n, lost)
        a[k] = 0.0
        odd = max(odd, abs(c[k]) / error) if error > 0.0 else math.inf
    row[ODD] = odd
    if n == 4:
        _tell_invariants(re, im, c, K, a, noise, lost, spacing, row)
    most = 0.0
    for i in range(n):
        most = max(most, math.hypot(re[i], im[i]))
    for i in range(n):
        gap, twin = math.inf, -1
        for j in range(n):
            if j != i:
                gap = min(gap, (re[i] - re[j]) ** 2 + (im[i] - im[j]) ** 2)
            if j < i and re[j] == re[i] and im[j] == -im[i]:
                twin = j
        if twin < 0:
            errors = _eigenvalue_error(c, K, n, re[i], im[i], math.sqrt(gap), noise, lost, most, shifted, a, b, u, v)
            row[HEAD + 2 * n + i], row[HEAD + 3 * n + i] = errors[0] / spacing, errors[1] / spacing
        else:
            row[HEAD + 2 * n + i], row[HEAD + 3 * n + i] = row[HEAD + 2 * n + twin], row[HEAD + 3 * n + twin]
        row[HEAD + i], row[HEAD + n + i] = re[i] / spacing, im[i] / spacing


@njit(TOLD, **PASSED)
def _tell(M, X0, runs, n, covariance, noise, spacing, lanes, raw):
    """What is told of lanes, into their raw rows; of those whose noise is NaN, and where the algebra fails, nothing."""
    whole_vectors()
    nn = n * n
    Y, T, U, Z, K = rows_of(nn), rows_of(nn), rows_of(nn), rows_of(nn), rows_of(nn)
    N, c, f = rows_of(n * nn), rows_of(n + 1), scratch(1)
    _logarithms(M, n, Y, T, U, Z, f)
    _characteristics(Y, n, N, c, T)
    _coefficient_covariances(M, N, X0, runs, n, covariance, K, T, f)
    y, k, parts = np.empty((n, n)), np.empty((n, n)), np.empty((4, n))
    re, im, of_lane, shifted = np.empty(n), np.empty(n), np.empty(n + 1), np.empty(n + 1, dtype=np.complex128)
    for lane in range(lanes):
        if math.isnan(noise[lane]):
            continue
        for i in range(n):
            of_lane[i] = c[i, lane]
            for j in range(n):
                y[i, j], k[i, j] = Y[i * n + j, lane], K[i * n + j, lane]
        of_lane[n] = 1.0
        if eigenvalues(y, n, re, im):
            lost = min(1.0, EPSILON * max(LOST, PIVOTED * covariance[runs * n * runs * n, lane]))
            _tell_lane(re, im, n, of_lane, k, noise[lane], lost, spacing[lane], parts, shifted, raw[lane])


@njit(FITTED, **PASSED)
def fit_block(step, tell, Y, weight, runs, count, n, spacing, floor, trust, lanes, raw):
    """Measure the lanes of a block; step and tell are those of this module, `PARTS`.

    Y, shape (runs*count*n, W): sample k of run r, state i in row (r*count + k)*n + i. weight, shape (runs*count, W):
    1 for a sample that counts, else 0, and Y too; a run's first ones. floor, shape (W,): error of a sample that its
    scatter does not show. trust: 0 for standard errors, else the multiple of the scatter in a bound (see `bound`).
    """
    whole_vectors()
    P = runs * n
    Y, counts = Y.reshape(Y.size), weight.reshape(weight.size)
    XX, XR, M, X0 = scratch(n * n), scratch(n * n), scratch(n * n), scratch(P)
    x, d, Z = scratch(2 * n), scratch(n), scratch(2 * P * n)
    XZ, HH, HR, RR = scratch(P * n * n), scratch(P * P), scratch(P), scratch(1)
    moved, rest, change, covariance, noise = scratch(1), scratch(1), scratch(1), rows_of(P * P + 1), scratch(1)
    change[:], noise[:] = math.inf, math.nan
    _moments(Y, counts, runs, count, n, XX, XR, x, d)
    _start(_lanes(XX), _lanes(XR), n, _lanes(M), moved)
    for r in range(runs):
        for at in range(n * W):
            X0[r * n * W + at] = Y[r * count * n * W + at]
    for _ in range(STEPS):
        _sums(Y, counts, M, X0, runs, count, n, x, d, Z, XX, XR, XZ, HH, HR, RR)
        sums = (_lanes(XX), _lanes(XR), _lanes(XZ), _lanes(HH), _lanes(HR), _lanes(RR))
        if not step(_lanes(M), _lanes(X0), runs, n, *sums, covariance, rest, moved, change):
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
        noise[lane] = math.sqrt(equations) * (trust * scatter + floor[lane]) if trust > 0.0 else scatter
    tell(_lanes(M), _lanes(X0), runs, n, covariance, noise, spacing, lanes, raw)


PARTS = (fit_block, _step, _tell)


@njit(
    void(FIT, STEP, TELL, float64[:, :, :, ::1], float64[::1], int64[:, ::1], float64, float64[:, ::1]),
    nogil=True,
    **OPTIONS,
)
def _fit_points(fit, step, tell, samples, spacing, used, trust, raw):
    """Points W at a time, each with its runs' samples, shape (points, runs, count, n); the last block is padded."""
    whole_vectors()
    points, runs, count, n = samples.shape
    Y, weight = rows_of(runs * count * n), rows_of(runs * count)
    floor, h, part = np.zeros(W), np.empty(W), np.empty((W, raw.shape[1]))
    for first in range(0, points, W):
        lanes = min(W, points - first)
        for lane in range(W):
            i = first + min(lane, lanes - 1)
            h[lane] = spacing[i]
            for r in range(runs):
                for k in range(count):
                    inside = k < used[i, r]
                    weight[r * count + k, lane] = 1.0 if inside else 0.0
                    for j in range(n):
                        Y[(r * count + k) * n + j, lane] = samples[i, r, k, j] if inside else 0.0
        fit(step, tell, Y, weight, runs, count, n, h, floor, trust, lanes, part)
        for lane in range(lanes):
            for j in range(raw.shape[1]):
                raw[first + lane, j] = part[lane, j]


class Spectrum(NamedTuple):
    """What samples say; arrays over the points, with the eigenvalues along the last axis.

    Attributes:
        eigenvalues: s-1, complex, ordered by imaginary, then real part; NaN where a mode was not moved.
        errors: standard error of the real part + i that of the imaginary part, s-1.
        invariants: S (s-2), D (s-4) and S² - 4D (s-4), last axis; NaN unless there are four eigenvalues.
        invariant_errors: their standard errors.
        scatter: root mean square of what the model leaves of the samples, in their unit.
        moved: smallest singular value of the samples over the largest.
    """

    eigenvalues: np.ndarray
    errors: np.ndarray
    invariants: np.ndarray
    invariant_errors: np.ndarray
    scatter: np.ndarray
    moved: np.ndarray


def measure(samples, spacing, used=None):
    """Eigenvalues of sampled linear motions.

    Parameters
    ----------
    samples : array_like, shape (..., runs, count, n)
        All n states at equally spaced times, in units in which their noise is alike.
    spacing : float or array_like, shape (...)
        Time between samples, in s; no mode may turn by more than half a radian in it.
    used : array_like of int, shape (..., runs), optional
        How many samples of each run count; left out, all.

    Returns
    -------
    Spectrum

    Raises
    ------
    ValueError
        For a wrong shape, more than MOST_STATES states, or too few samples for the n² + runs n parameters.
    """
    samples = np.asarray(samples, dtype=np.float64)
    if samples.ndim < 3 or not 1 <= samples.shape[-1] <= MOST_STATES:
        raise ValueError(f"samples must have the shape (..., runs, count, n ≤ {MOST_STATES}), not {samples.shape}")
    runs, count, n = samples.shape[-3:]
    shape = samples.shape[:-3]
    if runs * count <= n + runs:
        raise ValueError(f"{runs} runs of {count} samples are too few for {n} states; allowed: more than n + runs")
    flat = np.ascontiguousarray(samples.reshape(-1, runs, count, n))
    h = np.broadcast_to(np.asarray(spacing, dtype=np.float64), shape).reshape(-1).copy()
    most = np.full((*shape, runs), count) if used is None else np.broadcast_to(used, (*shape, runs))
    raw = np.empty((len(flat), HEAD + 4 * n))
    _fit_points(*PARTS, flat, h, np.array(most.reshape(-1, runs), dtype=np.int64), 0.0, raw)
    raw = raw.reshape(*shape, -1)
    re, im, e_re, e_im = (raw[..., HEAD + i * n : HEAD + (i + 1) * n] for i in range(4))
    values = raw[..., [SUM, PRODUCT, DISCRIMINANT]]
    errors = raw[..., [SUM_ERROR, PRODUCT_ERROR, DISCRIMINANT_ERROR]]
    return Spectrum(re + 1j * im, e_re + 1j * e_im, values, errors, raw[..., SCATTER], raw[..., MOVED])
