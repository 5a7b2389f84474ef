"""Small dense matrices: products and linear equations of a block's matrices, and eigenvalues of single matrices.

Source: Golub and Van Loan, Matrix Computations, sections 3.4 (elimination), 7.4 (Hessenberg's form) and 7.5 (Francis'
step).
"""

import math

import numpy as np

from kernels.compile.blocks import LANES, ROWS, W
from kernels.compile.jit import INLINE, INNER, OPTIONS, boolean, float64, int64, njit, void

MATRIX = float64[:, ::1]
EPSILON = float(np.finfo(np.float64).eps)


@njit(void(LANES, LANES), **OPTIONS)
def copy_rows(target, source):
    """Copy rows of lanes; assigning to a slice would take seconds to compile, for the check of its shape."""
    for row in range(len(source)):
        for lane in range(source.shape[1]):
            target[row, lane] = source[row, lane]


@njit(void(LANES, LANES, LANES, int64), **OPTIONS)
def product_in_lanes(A, B, C, n):
    """Write A B into C, lane by lane.

    Args:
        `A`, `B`, `C` (numpy.ndarray, shape (n n, lanes)): Matrices; element (i, j) is row i n + j.
        `n` (int): Order of the matrices.
    """
    lanes = A.shape[1]
    for i in range(n):
        for j in range(n):
            for lane in range(lanes):
                C[i * n + j, lane] = A[i * n, lane] * B[j, lane]
            for k in range(1, n):
                for lane in range(lanes):
                    C[i * n + j, lane] += A[i * n + k, lane] * B[k * n + j, lane]


# Rows of W lanes, flat: rows W apart in one array need one check for overlap, and unsigned indices none for wrapping.


@njit(**INLINE)
def add_row_product(out, row, A, a, B, b, n):
    """Add the sum over i < n of rows a + i of A times rows b + i of B to a row of out, four at a time; all flat."""
    target, a, b, remainder = np.uint64(row * W), a * W, b * W, n % 4
    for i in range(0, n - remainder, 4):
        u, v = np.uint64(a + i * W), np.uint64(b + i * W)
        for lane in range(W):
            x, y = u + np.uint64(lane), v + np.uint64(lane)
            first = A[x] * B[y] + A[x + np.uint64(W)] * B[y + np.uint64(W)]
            second = A[x + np.uint64(2 * W)] * B[y + np.uint64(2 * W)]
            out[target + np.uint64(lane)] += first + (second + A[x + np.uint64(3 * W)] * B[y + np.uint64(3 * W)])
    for i in range(n - remainder, n):
        u, v = np.uint64(a + i * W), np.uint64(b + i * W)
        for lane in range(W):
            out[target + np.uint64(lane)] += A[u + np.uint64(lane)] * B[v + np.uint64(lane)]


@njit(void(ROWS, int64, ROWS, int64, int64, ROWS, int64, int64, int64, int64), **OPTIONS)
def add_inner(out, row, A, a, a_step, B, b, b_step, n, count):
    """Add the sum over i < n of rows a + i of A times rows b + i of B to a row of out; repeat for following rows.

    Args:
        out, row: Flat array of lanes, and the first row that is added to.
        A, a, a_step: Flat array, first row, and the increment of a for each following row of out.
        B, b, b_step: Likewise.
        `n` (int): Number of rows in a sum.
        count (int): Number of rows of out.
    """
    for c in range(count):
        add_row_product(out, row + c, A, a + c * a_step, B, b + c * b_step, n)


@njit(**INLINE)
def _subtract_product(out, target, A, a, B, b, lanes):
    """Subtract row a of A times row b of B from a row of out, all flat."""
    target, a, b = np.uint64(target * lanes), np.uint64(a * lanes), np.uint64(b * lanes)
    for lane in range(lanes):
        out[target + np.uint64(lane)] -= A[a + np.uint64(lane)] * B[b + np.uint64(lane)]


@njit(void(LANES, int64, int64, ROWS), **INNER)
def _exchange_rows(A, i, k, selects):
    """Exchange rows i and k in lanes with selects > 0."""
    for lane in range(selects.size):
        x, y = A[i, lane], A[k, lane]
        A[i, lane] = y if selects[lane] > 0.0 else x
        A[k, lane] = x if selects[lane] > 0.0 else y


@njit(void(LANES, LANES, int64, int64, boolean, float64, ROWS), **OPTIONS)
def solve_in_lanes(A, B, n, m, exchanges, min_pivot, f):
    """Overwrite the columns of B by A⁻¹ times them, lane by lane.

    Args:
        `A` (numpy.ndarray, shape (n n, lanes)): Overwritten.
        `B` (numpy.ndarray, shape (m n, lanes)): Column c is rows c n + j.
        `n`, `m` (int): Order of A, and number of columns.
        exchanges (bool): Whether rows are exchanged for the largest pivot; else A is definite.
        min_pivot (float): Lower bound of the pivots of a definite A.
        `f` (numpy.ndarray, shape (lanes,)): Scratch.
    """
    lanes, flat_A, flat_B = f.size, A.reshape(A.size), B.reshape(B.size)
    for k in range(n):
        if exchanges:
            for i in range(k + 1, n):
                for lane in range(lanes):
                    f[lane] = 1.0 if abs(A[i * n + k, lane]) > abs(A[k * n + k, lane]) else 0.0
                for j in range(k, n):
                    _exchange_rows(A, k * n + j, i * n + j, f)
                for c in range(m):
                    _exchange_rows(B, c * n + k, c * n + i, f)
        for lane in range(lanes):
            pivot = A[k * n + k, lane]
            A[k * n + k, lane] = 1.0 / (min_pivot if pivot < min_pivot else pivot)
        for i in range(k + 1, n):
            for lane in range(lanes):
                f[lane] = A[i * n + k, lane] * A[k * n + k, lane]
            for j in range(k + 1, n):
                _subtract_product(flat_A, i * n + j, f, 0, flat_A, k * n + j, lanes)
            for c in range(m):
                _subtract_product(flat_B, c * n + i, f, 0, flat_B, c * n + k, lanes)
    for k in range(n - 1, -1, -1):
        for c in range(m):
            for i in range(k + 1, n):
                _subtract_product(flat_B, c * n + k, flat_A, k * n + i, flat_B, c * n + i, lanes)
            for lane in range(lanes):
                B[c * n + k, lane] *= A[k * n + k, lane]


@njit(void(MATRIX, float64[::1], int64, int64, float64, *4 * (int64,)), **INNER)
def _reflect_columns(H, v, first, after, factor, begin, end, top, bottom):
    """Apply 1 - factor v vᵀ, v over first … after - 1, to columns begin … end - 1, rows top … bottom - 1."""
    for j in range(begin, end):
        total = 0.0
        for i in range(first, after):
            total += v[i] * H[i, j]
        for i in range(first, after):
            H[i, j] -= factor * total * v[i]
    for i in range(top, bottom):
        total = 0.0
        for j in range(first, after):
            total += H[i, j] * v[j]
        for j in range(first, after):
            H[i, j] -= factor * total * v[j]


@njit(void(MATRIX, int64, float64[::1]), **INNER)
def _reduce_to_hessenberg(H, n, v):
    """Reduce H to Hessenberg form by Householder's reflections; v is scratch."""
    for k in range(n - 2):
        size = 0.0
        for i in range(k + 1, n):
            size += H[i, k] * H[i, k]
        size = math.sqrt(size)
        if size == 0.0:
            continue
        for i in range(k + 1, n):
            v[i] = H[i, k]
        v[k + 1] += math.copysign(size, H[k + 1, k])
        norm = 0.0
        for i in range(k + 1, n):
            norm += v[i] * v[i]
        _reflect_columns(H, v, k + 1, n, 2.0 / norm, k, n, 0, n)


@njit(void(MATRIX, int64, *3 * (float64,), *4 * (int64,)), **INNER)
def _reflect_three(H, k, a, b, c, begin, end, top, bottom):
    """Reflect three rows and columns from k on by the direction (a, b, c), as :func:`_reflect` does."""
    factor = 2.0 / (a * a + b * b + c * c)
    p, q, r = factor * a, factor * b, factor * c
    for j in range(begin, end):
        total = a * H[k, j] + b * H[k + 1, j] + c * H[k + 2, j]
        H[k, j] -= total * p
        H[k + 1, j] -= total * q
        H[k + 2, j] -= total * r
    for i in range(top, bottom):
        total = a * H[i, k] + b * H[i, k + 1] + c * H[i, k + 2]
        H[i, k] -= total * p
        H[i, k + 1] -= total * q
        H[i, k + 2] -= total * r


@njit(void(MATRIX, int64, float64, float64, *4 * (int64,)), **INNER)
def _reflect_two(H, k, a, b, begin, end, top, bottom):
    """Reflect two rows and columns from k on by the direction (a, b), as :func:`_reflect` does."""
    factor = 2.0 / (a * a + b * b)
    p, q = factor * a, factor * b
    for j in range(begin, end):
        total = a * H[k, j] + b * H[k + 1, j]
        H[k, j] -= total * p
        H[k + 1, j] -= total * q
    for i in range(top, bottom):
        total = a * H[i, k] + b * H[i, k + 1]
        H[i, k] -= total * p
        H[i, k + 1] -= total * q


@njit(void(MATRIX, int64, float64[::1], float64[::1]), **INNER)
def _write_pair(H, i, re, im):
    """Write both eigenvalues of the block at i, i + 1."""
    a, b, c, d = H[i, i], H[i, i + 1], H[i + 1, i], H[i + 1, i + 1]
    p = 0.5 * (a - d)
    q = p * p + b * c
    if q >= 0.0:
        z = p + math.copysign(math.sqrt(q), p)
        re[i], im[i], im[i + 1] = d + z, 0.0, 0.0
        re[i + 1] = d - b * c / z if z != 0.0 else d
    else:
        re[i], re[i + 1] = 0.5 * (a + d), 0.5 * (a + d)
        im[i], im[i + 1] = -math.sqrt(-q), math.sqrt(-q)


@njit(void(MATRIX, *3 * (int64,)), **INNER)
def _francis_step(H, lo, hi, iteration):
    """Make one double step on the block lo … hi, with exceptional shifts every tenth iteration.

    From the tenth iteration on two real shifts are replaced by the shift nearer to the corner: shifts ±σ may cycle.
    """
    total = H[hi - 1, hi - 1] + H[hi, hi]
    product = H[hi - 1, hi - 1] * H[hi, hi] - H[hi - 1, hi] * H[hi, hi - 1]
    split = 0.25 * total * total - product
    if iteration % 10 == 9:
        size = abs(H[hi, hi - 1]) + abs(H[hi - 1, hi - 2])
        total, product = 1.5 * size, size * size
    elif iteration > 9 and split >= 0.0:
        shift = 0.5 * total + math.copysign(math.sqrt(split), H[hi, hi] - 0.5 * total)
        total, product = 2.0 * shift, shift * shift
    x = H[lo, lo] * H[lo, lo] + H[lo, lo + 1] * H[lo + 1, lo] - total * H[lo, lo] + product
    y = H[lo + 1, lo] * (H[lo, lo] + H[lo + 1, lo + 1] - total)
    z = H[lo + 1, lo] * H[lo + 2, lo + 1]
    for k in range(lo, hi):
        has_three = k < hi - 1
        norm = x * x + y * y + (z * z if has_three else 0.0)
        if norm > 0.0:
            a = x + math.copysign(math.sqrt(norm), x)
            if has_three:
                _reflect_three(H, k, a, y, z, max(lo, k - 1), hi + 1, lo, min(k + 4, hi + 1))
            else:
                _reflect_two(H, k, a, y, max(lo, k - 1), hi + 1, lo, hi + 1)
        if has_three:
            x, y = H[k + 1, k], H[k + 2, k]
            z = H[k + 3, k] if k < hi - 2 else 0.0


@njit(boolean(MATRIX, int64, float64[::1], float64[::1]), **OPTIONS)
def eigenvalues(A, n, re, im):
    """Write the eigenvalues of A; return True if the iteration converged.

    Args:
        `A` (numpy.ndarray, shape (n or more, n or more)): The matrix, which is not changed.
        `n` (int): Its order.
        `re`, `im` (numpy.ndarray, shape (n,)): Written: conjugate pairs are exactly conjugate.
    """
    H = A[:n, :n].copy()
    _reduce_to_hessenberg(H, n, re)
    norm = 0.0
    for i in range(n):
        for j in range(n):
            norm += abs(H[i, j])
    if not math.isfinite(norm):
        return False
    hi, iteration = n - 1, 0
    while hi >= 0:
        lo = hi
        while lo > 0:
            size = abs(H[lo - 1, lo - 1]) + abs(H[lo, lo])
            if abs(H[lo, lo - 1]) <= EPSILON * (size if size > 0.0 else norm):
                H[lo, lo - 1] = 0.0
                break
            lo -= 1
        if lo == hi:
            re[hi], im[hi] = H[hi, hi], 0.0
            hi, iteration = hi - 1, 0
        elif lo == hi - 1:
            _write_pair(H, lo, re, im)
            hi, iteration = hi - 2, 0
        else:
            iteration += 1
            if iteration > 60:
                return False
            _francis_step(H, lo, hi, iteration)
    return True


@njit(void(float64[::1], float64[::1], int64, float64), **OPTIONS)
def sort_eigenvalues(re, im, n, min_gap):
    """Sort eigenvalues by imaginary, then real part.

    Args:
        `re`, `im` (numpy.ndarray): Real and imaginary parts, sorted in place.
        `n` (int): Their number.
        min_gap (float): Neighbouring imaginary parts that differ by at most this count as equal.
    """
    for i in range(1, n):
        for j in range(i, 0, -1):
            if im[j] < im[j - 1]:
                im[j], im[j - 1] = im[j - 1], im[j]
                re[j], re[j - 1] = re[j - 1], re[j]
    first = 0
    for k in range(1, n + 1):
        if k == n or im[k] - im[k - 1] > min_gap:
            for i in range(first + 1, k):
                for j in range(i, first, -1):
                    if re[j] < re[j - 1]:
                        im[j], im[j - 1] = im[j - 1], im[j]
                        re[j], re[j - 1] = re[j - 1], re[j]
            first = k
