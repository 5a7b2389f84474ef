r"""The variational flow M' = A(t) M by collocation at Gauss's points, many steps side by side.

In a step of length h the stages :math:`Y_i = 1 + h\sum_j a_{ij}A_jY_j` are found at once, by elimination without
exchange of rows: h A is at most a few in size, so the matrix is near a triangular one. The order is twice STAGES.

Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.7.
"""

import numpy as np
from numpy.polynomial import legendre

from kernels.jit import INLINE, OPTIONS, njit, whole_vectors

TOGETHER = 16  # systems side by side
STAGES = 8


def collocation(stages):
    """Return Gauss's points in (0, 1), the weights of integrals up to each point, and of the whole."""
    x, w = legendre.leggauss(stages)
    integrals = legendre.legint(np.eye(stages), lbnd=-1, axis=0)
    inner = np.linalg.solve(legendre.legvander(x, stages - 1).T, legendre.legval(x, integrals)).T
    return 0.5 * (x + 1.0), np.ascontiguousarray(0.5 * inner), 0.5 * w


POINTS, INNER, WHOLE = collocation(STAGES)


@njit(**INLINE)
def _subtract(target, factor, row):
    for lane in range(target.size):
        target[lane] -= factor[lane] * row[lane]


@njit(**INLINE)
def _eliminate(S):
    """Solve systems of equations S[:, :n] X = S[:, n:], shape (n, n + columns, lanes), in place."""
    n, last, _ = S.shape
    for k in range(n):
        pivot = S[k, k]
        for lane in range(pivot.size):
            pivot[lane] = 1.0 / pivot[lane]
        for i in range(k + 1, n):
            factor = S[i, k]
            for lane in range(factor.size):
                factor[lane] *= pivot[lane]
            for j in range(k + 1, last):
                _subtract(S[i, j], factor, S[k, j])
    for i in range(n - 1, -1, -1):
        for j in range(n, last):
            target, pivot = S[i, j], S[i, i]
            for k in range(i + 1, n):
                _subtract(target, S[i, k], S[k, j])
            for lane in range(target.size):
                target[lane] *= pivot[lane]


@njit("void(float64[:, :, :, ::1], float64[:, :, :, ::1], float64[:, :, :, ::1])", nogil=True, **OPTIONS)
def multiply(A, B, out):
    """Write the products of small matrices A B, of the last two dimensions."""
    points, steps, rows, inner = A.shape
    for p in range(points):
        for k in range(steps):
            for i in range(rows):
                for j in range(B.shape[3]):
                    total = 0.0
                    for m in range(inner):
                        total += A[p, k, i, m] * B[p, k, m, j]
                    out[p, k, i, j] = total


@njit("void(float64[:, :, :, ::1], float64[:, :, :, ::1], float64[:, :, :, ::1])", nogil=True, **OPTIONS)
def chain(matrices, before, after):
    """Write the products of the matrices before each step and after it, shape (points, steps, n, n)."""
    points, steps, n, _ = matrices.shape
    for p in range(points):
        for i in range(n):
            for j in range(n):
                before[p, 0, i, j] = after[p, steps - 1, i, j] = 1.0 if i == j else 0.0
        for k in range(1, steps):
            for i in range(n):
                for j in range(n):
                    total, other = 0.0, 0.0
                    for m in range(n):
                        total += matrices[p, k - 1, i, m] * before[p, k - 1, m, j]
                        other += after[p, steps - k, i, m] * matrices[p, steps - k, m, j]
                    before[p, k, i, j], after[p, steps - 1 - k, i, j] = total, other


@njit("void(float64[:, :, ::1], float64[:, :, ::1])", nogil=True, **OPTIONS)
def invert(A, inverse):
    """Write the inverses of positive definite matrices, shape (systems, n, n)."""
    whole_vectors()
    count, n, _ = A.shape
    S = np.empty((n, 2 * n, TOGETHER))
    for first in range(0, count, TOGETHER):
        for lane in range(TOGETHER):
            at = min(first + lane, count - 1)
            for i in range(n):
                for j in range(n):
                    S[i, j, lane], S[i, n + j, lane] = A[at, i, j], 1.0 if i == j else 0.0
        _eliminate(S)
        for lane in range(min(TOGETHER, count - first)):
            for i in range(n):
                for j in range(n):
                    inverse[first + lane, i, j] = S[i, n + j, lane]


@njit(
    "void(float64[:, :, :, ::1], float64[::1], float64[:, ::1], float64[:, ::1], float64[::1], float64[:, :, ::1])",
    nogil=True,
    **OPTIONS,
)
def flow(A, h, sizes, inner, whole, out):
    """Write the matrix of each step, in the states' sizes.

    Parameters
    ----------
    A : numpy.ndarray, shape (steps, stages, n, n)
        Coefficients at POINTS of each step; so many steps follow each other for each point.
    h : numpy.ndarray, shape (points,)
        Length of the steps.
    sizes : numpy.ndarray, shape (points, n)
        Of the states.
    inner, whole : numpy.ndarray
        INNER and WHOLE.
    out : numpy.ndarray, shape (steps, n, n)
        The matrices.
    """
    whole_vectors()
    count, stages, n, _ = A.shape
    each, size = count // h.size, stages * n
    S, B = np.empty((size, size + n, TOGETHER)), np.empty((stages, n, n, TOGETHER))
    for first in range(0, count, TOGETHER):
        for lane in range(TOGETHER):
            at = min(first + lane, count - 1)
            point = at // each
            for j in range(stages):
                for a in range(n):
                    for b in range(n):
                        B[j, a, b, lane] = A[at, j, a, b] * (h[point] * sizes[point, b] / sizes[point, a])
        for i in range(stages):
            for a in range(n):
                for j in range(stages):
                    for b in range(n):
                        target, source, weight = S[i * n + a, j * n + b], B[j, a, b], inner[i, j]
                        for lane in range(target.size):
                            target[lane] = -weight * source[lane]
                for lane in range(TOGETHER):
                    S[i * n + a, i * n + a, lane] += 1.0
                    for b in range(n):
                        S[i * n + a, size + b, lane] = 1.0 if a == b else 0.0
        _eliminate(S)
        for a in range(n):
            for b in range(n):
                total = S[0, a * n + b]  # no longer needed
                for lane in range(total.size):
                    total[lane] = 0.0
                for j in range(stages):
                    for c in range(n):
                        source, stage = B[j, a, c], S[j * n + c, size + b]
                        for lane in range(total.size):
                            total[lane] += whole[j] * source[lane] * stage[lane]
                for lane in range(min(TOGETHER, count - first)):
                    out[first + lane, a, b] = total[lane] + (1.0 if a == b else 0.0)
