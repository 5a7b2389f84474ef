r"""The variational flow over one period by collocation at Gauss's points, W points side by side.

With the time in units of a step, a perturbation obeys :math:`u'' = k(t)\,u + c(t)\,u'` (coordinates; k and c are the
slopes of the accelerations, times the step's square and the step) or :math:`u' = c(t)\,u` (states). The unknowns of a
step are the highest derivatives at its points, of which u and u' are integrals: of coordinates half as many as there
are states. They are found at once, by elimination without exchange of rows: in a step that is short enough to be exact,
k and c are at most a few in size, and the matrix is near 1. The order is twice STAGES.

Where k is even in the time and c odd, :math:`u(-t)` solves the equations where u(t) does: the second half of the period
undoes the first one with velocities reversed, :math:`M = R\,P^{-1}R\,P`, step by step, P of half a period. Of one
coordinate the inverse of a step loses no digits, as its determinant is known: :math:`\exp\int c`.

Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.7 and II.14 (Nystrom methods).
"""

import math

import numpy as np

from kernels.blocks import W, rows_of
from kernels.dense import solve_in_lanes
from kernels.jit import OPTIONS, njit, whole_vectors
from kernels.monodromy import compose

GAUSS = (  # the roots of the Legendre polynomial P_8 that are > 0, and their weights: Abramowitz and Stegun, table 25.4
    (0.1834346424956498049394761, 0.3626837833783619829651505),
    (0.5255324099163289858177390, 0.3137066458778872873379622),
    (0.7966664774136267395915539, 0.2223810344533744705443560),
    (0.9602898564975362316835609, 0.1012285362903762591525314),
)


def collocation():
    """Return Gauss's points in (0, 1), the weights of integrals up to each point, and of the whole.

    The polynomial through values f_j at the points x_j of (-1, 1) is the sum of w_j f_j (k + 1/2) P_k(x_j) P_k(x) over
    j and k, and (2k + 1) times the integral of P_k from -1 is P_{k+1} - P_{k-1}. No sum is left to a library whose
    order is another one on another processor.
    """
    x, w = np.transpose([(-root, weight) for root, weight in reversed(GAUSS)] + list(GAUSS))
    P = [np.ones_like(x), x]
    for k in range(1, x.size):
        P.append(((2 * k + 1) * x * P[k] - k * P[k - 1]) / (k + 1))
    higher = [P[1] + 1.0, *(P[k + 1] - P[k - 1] for k in range(1, x.size))]
    inner = sum(np.outer(higher[k], P[k] * w) for k in range(x.size))
    return 0.5 * (x + 1.0), 0.25 * inner, 0.5 * w


def _twice(weights, inner):
    """Return the weights of integrals of integrals."""
    return sum(np.multiply.outer(weights[..., k], inner[k]) for k in range(STAGES))


POINTS, INNER, WHOLE = collocation()
STAGES = POINTS.size
TWICE, WHOLE_TWICE = _twice(INNER, INNER), _twice(WHOLE, INNER)


@njit(**OPTIONS)
def _load(source, step, first, factor, rows):
    """Write the slopes at the points of a step, times a factor, in rows (stage, i, j); W points from the first on."""
    whole_vectors()
    m, _, times, _ = source.shape
    lanes = factor.size
    for stage in range(STAGES):
        at = min(step * STAGES + stage, times - 1)  # one time stands for all where slopes are constant
        for i in range(m):
            for j in range(m):
                row, slopes = rows[(stage * m + i) * m + j], source[i, j, at, first:]
                for lane in range(min(lanes, slopes.size)):
                    row[lane] = slopes[lane] * factor[lane]


@njit(**OPTIONS)
def _step(k, c, m, second, A, B, f, S):
    """Write the matrix of a step in the states (u, u'), or u, into S, rows i n + j; A, B, f are scratch."""
    whole_vectors()
    lanes, size, n = f.size, STAGES * m, 2 * m if second else m
    for i in range(size):
        for stage in range(STAGES):
            once, twice, at = INNER[i // m, stage], TWICE[i // m, stage] if second else 0.0, (i // m * m + i % m) * m
            for b in range(m):
                row, slope, bend, unit = A[i * size + stage * m + b], c[at + b], k[at + b], i == stage * m + b
                for lane in range(lanes):
                    row[lane] = unit - once * slope[lane] - twice * bend[lane]
        for b in range(m):
            row, rate, slope, bend, place = (
                B[b * size + i],
                B[(n - m + b) * size + i],
                c[i * m + b],
                k[i * m + b],
                POINTS[i // m],
            )
            for lane in range(lanes):
                row[lane] = bend[lane]
                rate[lane] = slope[lane] + place * bend[lane] if second else slope[lane]
    solve_in_lanes(A, B, size, n, False, -math.inf, f)
    for i in range(n):
        weights = WHOLE_TWICE if second and i < m else WHOLE
        for j in range(n):
            row, unit = S[i * n + j], 1.0 if i == j or (second and i + m == j) else 0.0
            for lane in range(lanes):
                row[lane] = unit
            for stage in range(STAGES):
                source, weight = B[j * size + stage * m + i % m], weights[stage]
                for lane in range(lanes):
                    row[lane] += weight * source[lane]


@njit(
    "void(float64[:, :, :, ::1], float64[:, :, :, ::1], float64[::1], float64[:, ::1], int64[::1], float64[:, ::1])",
    nogil=True,
    **OPTIONS,
)
def flow(k, c, h, sizes, numbers, out):
    """Write the matrix of the period of each point, and what it is known by.

    Args:
        k, c (numpy.ndarray, shape (m, m, times, points)): Slopes of the accelerations by coordinates and by velocities,
            at POINTS of each step; or no times in k, and in c the slopes of the rates by states. One time stands for
            all.
        h (numpy.ndarray, shape (points,)): Length of the steps.
        sizes (numpy.ndarray, shape (n, points)): Of the states.
        numbers (numpy.ndarray): Steps in a period; those before the phase of another period; whether slopes are those
            of half a period, k even and c odd about its ends, of one coordinate; whether second compounds are wanted.
        out (numpy.ndarray, shape (3 n n + 4, points)): Written: as told by :func:`kernels.monodromy.compose`, in the
            states' sizes; then the integral of the trace of c.
    """
    whole_vectors()
    steps, later, mirrored, has_minors = numbers
    m, second, half = c.shape[0], k.shape[2] > 0, steps // 2 if mirrored else steps
    n, size = 2 * m if second else m, STAGES * m
    slopes, A, B = rows_of(2 * size * m), rows_of(size * size), rows_of(size * n)
    S, off, told, size_of = rows_of(steps * n * n), rows_of(steps), rows_of(3 * n * n + 3), rows_of(n)
    f, step, square, trace, lost = rows_of(1)[0], rows_of(1)[0], rows_of(1)[0], rows_of(1)[0], rows_of(1)[0]
    for first in range(0, h.size, W):
        for lane in range(W):
            at = min(first + lane, h.size - 1)
            step[lane], square[lane], trace[lane] = h[at], h[at] ** 2, 0.0
            for i in range(n):
                size_of[i, lane] = sizes[i, at] * (h[at] if second and i >= m else 1.0)
        for s in range(half):
            _load(k if second else c, s, first, square, slopes)
            _load(c, s, first, step, slopes[size * m :])
            here = S[s * n * n :]
            _step(slopes, slopes[size * m :], m, second, A, B, f, here)
            for lane in range(W):
                lost[lane] = 0.0
            for stage in range(STAGES):
                for i in range(m):
                    for lane in range(W):
                        lost[lane] += WHOLE[stage] * slopes[size * m + (stage * m + i) * m + i, lane]
            for lane in range(W):
                trace[lane] += lost[lane]
            for i in range(n):
                for j in range(n):
                    for lane in range(W):
                        here[i * n + j, lane] *= size_of[j, lane] / size_of[i, lane]
            if mirrored:
                there = S[(steps - 1 - s) * n * n :]
                for i in range(4):
                    for lane in range(W):
                        there[i, lane] = here[(3, 1, 2, 0)[i], lane] * math.exp(-lost[lane])
        compose(S, off, n, later, has_minors > 0, told)
        for lane in range(min(W, h.size - first)):
            for i in range(3 * n * n + 3):
                out[i, first + lane] = told[i, lane]
            out[3 * n * n + 3, first + lane] = 0.0 if mirrored else trace[lane]
