r"""Monodromy matrices from perturbed motions: segment after segment, and the product of all, W points side by side.

From each direction, and from its other side, a perturbed motion is followed through every segment of the period beside
the base motion, whose series all directions share. Half the difference of both sides is a column of the segment's
matrix S, and :math:`M = S_K\cdots S_1`.

*Errors.* What a segment may be off, :math:`G_k`, grows to :math:`|S_K\cdots S_{k+1}|\,G_k\,|S_{k-1}\cdots S_1|`, and so
does the rounding of each product. Roundings are independent, so their squares are added; what is left out by the steps
is not, and counts :math:`\sqrt{Kn}` times, for :math:`(\sum_{k=1}^K a_k)^2 \le K\sum a_k^2`.

*Second compounds.* The minors of two rows and two columns of a product are the products of the factors' minors. Their
trace is the determinant (two states), or the second invariant (four): from the segments' minors these keep the digits
that beside a large multiplier the entries of M have lost.
"""

import math

import numpy as np

from kernels.blocks import W, rows_of, scratch
from kernels.dense import product_in_lanes
from kernels.jit import OPTIONS, float64, int64, njit, types, void, whole_vectors

EPSILON = float(np.finfo(np.float64).eps)
NOISE = 6.0 * EPSILON  # rounding of a segment, relative to its terms
LARGE = 1e3  # trace from which on the lesser pair is found from the product of both
ADVANCE = types.FunctionType(void(float64[::1], float64[:, ::1], int64))


@njit(**OPTIONS)
def chain(S, G, steps, d, later, told):
    """Write the products of the matrices of steps, d x d, lane by lane.

    Args:
        S, G (numpy.ndarray, shape (steps d d, W)): Matrices, row by row, and the sizes of their errors.
        steps, d, later (int): Numbers of matrices and of rows; the step at which the other product begins.
        told (numpy.ndarray, shape (3 d d + 1, W)): Written: the product; that of the cycle that begins at ``later``;
            the root of the sum of the squares of what G, and one rounding of each product, become; and the number of
            times that the first column turned through whole half turns, of d = 2.
    """
    whole_vectors()
    size = d * d
    P, X, Y, T = rows_of((steps + 1) * size), rows_of(size), rows_of(size), rows_of(size)
    told[:] = 0.0
    for i in range(d):
        for lane in range(W):
            P[i * d + i, lane], X[i * d + i, lane] = 1.0, 1.0
    for s in range(steps):
        before, after = P[s * size :], P[(s + 1) * size :]
        product_in_lanes(S[s * size :], before, after, d)
        if d == 2:
            for lane in range(W):
                forward = before[2, lane] * after[0, lane] > before[0, lane] * after[2, lane]
                if (before[2, lane] > 0.0) != (after[2, lane] > 0.0):
                    told[3 * size, lane] += 1.0 if forward else -1.0
    for s in range(steps, 0, -1):
        before, after, rounding = P[(s - 1) * size :], P[s * size :], G[(s - 1) * size :]
        if s == later:
            product_in_lanes(after, X, told[size:], d)
        for i in range(d):
            for j in range(d):
                row = T[i * d + j]
                for lane in range(W):
                    row[lane] = after[i * d + j, lane] ** 2
                for b in range(d):
                    for lane in range(W):
                        row[lane] += (rounding[i * d + b, lane] * before[b * d + j, lane]) ** 2
        for i in range(d):
            for b in range(d):
                for j in range(d):
                    for lane in range(W):
                        told[2 * size + i * d + j, lane] += X[i * d + b, lane] ** 2 * T[b * d + j, lane]
        product_in_lanes(X, S[(s - 1) * size :], Y, d)
        X, Y = Y, X
    for i in range(size):
        for lane in range(W):
            told[i, lane] = P[steps * size + i, lane]
            told[2 * size + i, lane] = math.sqrt(told[2 * size + i, lane])


@njit(**OPTIONS)
def rate_rounding(S, off, n, G, most):
    """Write the sizes of the errors of segments: of terms' roundings, |S||S| or the largest entry, and of ``off``."""
    whole_vectors()
    alike = 0.5 * EPSILON / NOISE * math.sqrt(len(off) * n)  # the length of a step is rounded in all alike
    for s in range(len(off)):
        here = S[s * n * n :]
        for lane in range(W):
            most[s, lane] = 0.0
        for i in range(n * n):
            for lane in range(W):
                most[s, lane] = max(most[s, lane], abs(here[i, lane]))
        for i in range(n):
            for j in range(n):
                row = G[(s * n + i) * n + j]
                for lane in range(W):
                    row[lane] = 0.0
                for b in range(n):
                    for lane in range(W):
                        row[lane] += abs(here[i * n + b, lane] * here[b * n + j, lane])
                for lane in range(W):  # states apart stay apart
                    row[lane] = min(row[lane], most[s, lane]) + alike * most[s, lane] + off[s, lane]


@njit(**OPTIONS)
def minors(S, off, most, n, C, G):
    """Write the second compounds of segments, and the sizes of their errors."""
    whole_vectors()
    d, row = n * (n - 1) // 2, 0
    for s in range(len(off)):
        here = S[s * n * n :]
        for i in range(n):
            for j in range(i + 1, n):
                for k in range(n):
                    for m in range(k + 1, n):
                        for lane in range(W):
                            one = here[i * n + k, lane] * here[j * n + m, lane]
                            other = here[i * n + m, lane] * here[j * n + k, lane]
                            C[row, lane] = one - other
                            G[row, lane] = abs(one) + abs(other) + 2.0 * off[s, lane] * most[s, lane]
                        row += 1
    return d


@njit(**OPTIONS)
def compose(S, off, n, later, has_minors, told):
    """Write the product of segments and its errors, and the trace of its second compound and the error of that.

    Args:
        S, off (numpy.ndarray, shapes (steps n n, W) and (steps, W)): Matrices, row by row; by what a step is off beside
            rounding, in roundings.
        n, later (int): Number of rows, and the step at which the other product begins.
        has_minors (bool): Whether the compound is wanted, where an entry of M is large.
        told (numpy.ndarray, shape (3 n n + 3, W)): Written: as by :func:`chain`; then the trace and its error.
    """
    whole_vectors()
    steps = len(off)
    G, most = rows_of(steps * n * n), rows_of(steps)
    rate_rounding(S, off, n, G, most)
    chain(S, G, steps, n, later, told)
    is_large = False
    for i in range(n * n):
        for lane in range(W):
            is_large |= abs(told[i, lane]) > LARGE
    for lane in range(W):
        told[3 * n * n + 1, lane] = told[3 * n * n + 2, lane] = 0.0 if has_minors and is_large else np.nan
    if has_minors and is_large:
        d = n * (n - 1) // 2
        C, R, whole = rows_of(steps * d * d), rows_of(steps * d * d), rows_of(3 * d * d + 1)
        minors(S, off, most, n, C, R)
        chain(C, R, steps, d, 0, whole)
        for i in range(d):
            for lane in range(W):
                told[3 * n * n + 1, lane] += whole[i * d + i, lane]
                told[3 * n * n + 2, lane] += whole[2 * d * d + i * d + i, lane]


@njit(**OPTIONS)
def load(source, first, target):
    """Write what W points from the first on have, shape (rows, points), the last one in place of those not there."""
    for row in range(len(source)):
        for lane in range(W):
            target[row, lane] = source[row, min(first + lane, source.shape[1] - 1)]


@njit(
    void(
        ADVANCE, float64[:, :, ::1], float64[:, :, :, ::1], float64[:, ::1], float64[::1], int64[::1], float64[:, ::1]
    ),
    nogil=True,
    **OPTIONS,
)
def measure(advance, base, columns, sizes, bend, numbers, out):
    """Follow perturbed motions through the segments of a period, and multiply the segments' matrices.

    Args:
        advance (function): ``advance(S, columns, steps)`` advances the base motion, the first rows of S, and perturbed
            motions of it.
        base (numpy.ndarray, shape (rows, segments, points)): The base motion where segments begin; or where the first
            one begins, and motions go on from it.
        columns (numpy.ndarray, shape (motions, rows, segments or 1, points)): Perturbed motions where segments begin:
            n of one side, then n of the other.
        sizes (numpy.ndarray, shape (n, points)): Of the states.
        bend (numpy.ndarray, shape (points,)): What the base motion's error adds to an error, of the difference of
            sides.
        numbers (numpy.ndarray): Segments; steps in each; rows of S; first row of the states in a column, and the row of
            what the steps leave out; whether second compounds are wanted.
        out (numpy.ndarray, shape (3 n n + 4, points)): Written: as told by :func:`compose`, then what the steps leave
            out, relative to each segment's largest entry.
    """
    whole_vectors()
    segments, steps, rows, states, left_out, has_minors = numbers
    n, points = sizes.shape
    height, motions = columns.shape[1], len(columns)
    sides = motions // n
    S, C, size = scratch(rows), scratch(motions * height).reshape(motions, height * W), rows_of(n)
    matrices, off, told = rows_of(segments * n * n), rows_of(segments), rows_of(3 * n * n + 3)
    lost, uneven, bent, coherent = rows_of(1)[0], rows_of(1)[0], rows_of(1)[0], math.sqrt(segments * n) / NOISE
    for first in range(0, points, W):
        count = min(W, points - first)
        load(sizes, first, size)
        for lane in range(W):
            lost[lane], bent[lane] = 0.0, bend[first + min(lane, count - 1)]
        for s in range(segments):
            if s < base.shape[1]:
                load(base[:, s], first, S.reshape(rows, W))
            for c in range(motions):
                load(columns[c, :, min(s, columns.shape[2] - 1)], first, C[c].reshape(height, W))
            advance(S, C, steps)
            worst = off[s]
            for lane in range(W):
                worst[lane], uneven[lane] = 0.0, 0.0
            for i in range(n):
                for j in range(n):
                    row, plus = matrices[(s * n + i) * n + j], C[j, (states + i) * W :]
                    minus, sign = C[motions - n + j, (states + i) * W :], 1.0 if sides == 1 else -1.0
                    for lane in range(W):
                        row[lane] = 0.5 * (plus[lane] + sign * minus[lane]) / size[i, lane]
                        uneven[lane] = max(uneven[lane], abs(plus[lane] - sign * minus[lane]) / size[i, lane])
                    for c in range(j, motions, n):
                        lacks = C[c, (left_out + i) * W :]
                        for lane in range(W):
                            worst[lane] = max(worst[lane], lacks[lane] / size[i, lane])
            for lane in range(W):
                lost[lane] += worst[lane]
                worst[lane] = (worst[lane] + bent[lane] * uneven[lane]) * coherent
        compose(matrices, off, n, 0, has_minors > 0, told)
        for lane in range(count):
            for i in range(3 * n * n + 3):
                out[i, first + lane] = told[i, lane]
            out[3 * n * n + 3, first + lane] = lost[lane]
