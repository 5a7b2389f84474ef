r"""Monodromy matrices from perturbed motions: segment after segment, and the product of all, W points side by side.

From each direction, and from its other side, a perturbed motion is followed through every segment of the period beside
the base motion, whose series all directions share. Half the difference of both sides is a column of the segment's
matrix S, and :math:`M = S_K\cdots S_1`. Where the equations are linear, one motion follows a direction of each block of
states that no others influence. Where they are not, one more motion begins at twice the sum of all directions: from
twice the sum of their ends it differs by more than each column does from a linear motion.

*Half a period.* Where Hamilton's equations are even in the time and have no terms in the velocities, :math:`u(-t)`
solves them where u(t) does: the second half's matrix is :math:`R\,P^{-1}R`, P the first half's, R with velocities
reversed. Of :math:`P = (A\ B;\ C\ D)` and the masses a it is known without division:
:math:`a^{-1}(D^T B^T;\ C^T A^T)\,a`; so what P is off, it is off likewise, and both errors are added.

*Errors.* What a segment may be off, :math:`G_k`, grows to :math:`|S_K\cdots S_{k+1}|\,G_k\,|S_{k-1}\cdots S_1|`, and so
does the rounding of each product. Roundings are independent, so their squares are added; what is left out by the steps
is not, and counts :math:`\sqrt{Kn}` times, for :math:`(\sum_{k=1}^K a_k)^2 \le K\sum a_k^2`.

*Second compounds.* The minors of two rows and two columns of a product are the products of the factors' minors. Their
trace is the determinant (two states), or the second invariant (four): from the segments' minors these keep the digits
that beside a large multiplier the entries of M have lost.

A matrix is n n rows of W lanes; that of the entry (i, j) is i n + j.
"""

import math
from itertools import combinations

import numpy as np

from kernels.blocks import LANES, ROWS, W, rows_of, scratch
from kernels.dense import copy_rows
from kernels.jit import INNER, OPTIONS, boolean, float64, int64, njit, types, void, whole_vectors

EPSILON = float(np.finfo(np.float64).eps)
NOISE = 6.0 * EPSILON  # rounding of a segment, relative to its terms
ROUNDED = 16.0 * EPSILON  # of terms: by what a sum of motions may be off by rounding alone
LARGE = 1e3  # entry from which on the lesser pair is found from the product of both
ELSEWHERE = 0.381966  # of a period: where the product begins again
PAIRS = np.array([*combinations(range(4), 2)])  # of states; the first one is that of two states
CALLED = void(ROWS, LANES, int64)  # what advances motions, and what writes a step's matrix
FUNCTION = types.FunctionType(CALLED)
MATRICES, STATES = float64[:, :, ::1], boolean[:, ::1]


@njit(MATRICES(int64, int64), **OPTIONS)
def zeros_of(count, n):
    """Return so many matrices of zeros, shape (count, n n, W)."""
    return scratch(count * n * n).reshape(count, n * n, W)


@njit(void(LANES, LANES, LANES, STATES), **OPTIONS)
def multiply(A, B, C, joined):
    """Write A B into C; entries of states that are not joined vanish."""
    whole_vectors()
    n, lanes, flat = len(joined), C.shape[1], C.reshape(C.size)
    for x in range(flat.size):
        flat[x] = 0.0
    for i in range(n):
        for k in range(n):
            if joined[i, k]:
                for j in range(n):
                    for lane in range(lanes):
                        C[i * n + j, lane] += A[i * n + k, lane] * B[k * n + j, lane]


@njit(void(LANES, int64), **OPTIONS)
def write_unit(A, n):
    """Write the unit matrix of n states."""
    for row in range(n * n):
        for lane in range(A.shape[1]):
            A[row, lane] = 1.0 if row % (n + 1) == 0 else 0.0


@njit(void(MATRICES, MATRICES, STATES, MATRICES, MATRICES, MATRICES), **OPTIONS)
def multiply_after(S, G, joined, before, after, work):
    """Write the products of each matrix and all after it, and the squares of their errors in the product of all.

    The last product is given. Into the first matrix of work is written the sum of the squares of what errors G of the
    matrices, and one rounding of each product, become in the product of all.
    """
    whole_vectors()
    K, size, lanes = S.shape
    entry, error = S.reshape(K, size * lanes), G.reshape(K, size * lanes)
    left, right = after.reshape(K + 1, size * lanes), before.reshape(K + 1, size * lanes)
    flat = work.reshape(len(work), size * lanes)
    total, one, other, last = flat[0], flat[1], flat[2], flat[3]
    for x in range(total.size):
        total[x] = 0.0
    for s in range(K - 1, -1, -1):
        multiply(after[s + 1], S[s], after[s], joined)
        for x in range(total.size):
            one[x] = left[s + 1, x] * left[s + 1, x]
            other[x] = error[s, x] * error[s, x] + entry[s, x] * entry[s, x]
            last[x] = right[s, x] * right[s, x]
        multiply(work[2], work[3], work[4], joined)
        multiply(work[1], work[4], work[2], joined)
        for x in range(total.size):
            total[x] += other[x]


@njit(void(LANES, LANES, ROWS), **OPTIONS)
def find_sizes(A, sizes, most):
    """Write the sizes of the entries, and the largest of them."""
    whole_vectors()
    entries, flat = A.reshape(A.size), sizes.reshape(A.size)
    for x in range(A.size):
        flat[x] = abs(entries[x])
    for lane in range(most.size):
        most[lane] = sizes[0, lane]
    for row in range(1, len(A)):
        for lane in range(most.size):
            most[lane] = max(most[lane], sizes[row, lane])


@njit(void(MATRICES, LANES, STATES, float64, MATRICES, MATRICES), **OPTIONS)
def write_errors(S, off, joined, alike, G, work):
    """Write by what matrices may be off: by roundings of terms, as of S S, no more than the largest entry, and off.

    alike: of the largest entry, what is off in all alike: the length of a step is rounded.
    """
    whole_vectors()
    n, lanes, sizes, most = len(joined), S.shape[2], work[0], work[1, 0]
    for s in range(len(G)):
        find_sizes(S[s], sizes, most)
        multiply(sizes, sizes, G[s], joined)
        for i in range(n):
            for j in range(n):
                if joined[i, j]:
                    row = G[s, i * n + j]
                    for lane in range(lanes):
                        row[lane] = min(row[lane], most[lane]) + (off[s, lane] + alike * most[lane])


@njit(void(LANES, LANES, STATES, LANES), **OPTIONS)
def mirror(S, masses, joined, Q):
    """Write R S⁻¹ R into Q; or, with the squares of masses, what it makes of the squares of errors."""
    whole_vectors()
    n, m, lanes = len(joined), len(joined) // 2, Q.shape[1]
    for i in range(n):
        for j in range(n):
            for lane in range(lanes):
                Q[i * n + j, lane] = 0.0
            for a in range(m):
                for b in range(m):
                    mass, row = (a, j) if j < m else (j - m, a), (a + m * (j < m), b + m * (i < m))
                    inverse = (i, b) if i < m else (b, i - m)
                    if joined[mass] and joined[inverse] and joined[row]:
                        x, y, z = mass[0] * m + mass[1], m * m + inverse[0] * m + inverse[1], row[0] * n + row[1]
                        for lane in range(lanes):
                            Q[i * n + j, lane] += S[z, lane] * (masses[x, lane] * masses[y, lane])


@njit(void(LANES, ROWS, LANES, LANES, int64), **OPTIONS)
def write_minors(S, off, C, G, n):
    """Write the second compound of a matrix, and by what it may be off."""
    whole_vectors()
    lanes, d, work = off.size, n * (n - 1) // 2, rows_of(n * n + 1)
    sizes, most = work[: n * n], work[n * n]
    find_sizes(S, sizes, most)
    for r in range(d):
        for c in range(d):
            i, j, k, m = PAIRS[r, 0] * n, PAIRS[r, 1] * n, PAIRS[c, 0], PAIRS[c, 1]
            for lane in range(lanes):
                one, other = S[i + k, lane] * S[j + m, lane], S[i + m, lane] * S[j + k, lane]
                C[r * d + c, lane] = one - other
                G[r * d + c, lane] = abs(one) + abs(other) + 2.0 * off[lane] * most[lane]


@njit(void(MATRICES, LANES, LANES, STATES, LANES), **OPTIONS)
def multiply_minors(S, off, masses, joined, result):
    """Write the trace of the second compound of the product, and its error."""
    whole_vectors()
    K, n, halves = len(S), len(joined), 2 if len(masses) else 1
    d = n * (n - 1) // 2
    C, G, before, after, work = zeros_of(K, d), zeros_of(K, d), zeros_of(K + 1, d), zeros_of(K + 1, d), zeros_of(5, d)
    all_joined, mirrored = np.ones((d, d), dtype=np.bool_), zeros_of(1, n)[0]
    write_unit(before[0], d)
    write_unit(after[K], d)
    for s in range(K):
        write_minors(S[s], off[s], C[s], G[s], n)
        multiply(C[s], before[s], before[s + 1], all_joined)
        if halves == 2:
            mirror(S[s], masses, joined, mirrored)
            write_minors(mirrored, off[s], work[0], work[1], n)
            multiply(after[K], work[0], work[2], all_joined)
            copy_rows(after[K], work[2])
    multiply_after(C, G, all_joined, before, after, work)
    for i in range(d):  # what a segment is off changes the trace as its mirror image does
        for lane in range(off.shape[1]):
            result[0, lane] += after[0, i * (d + 1), lane]
            result[1, lane] += halves * math.sqrt(work[0, i * (d + 1), lane])


@njit(void(ROWS, ROWS, ROWS, ROWS, ROWS), **OPTIONS)
def count_turns(x, y, u, v, turns):
    """Count the half turns of vectors on their way from (x, y) to (u, v)."""
    whole_vectors()
    for lane in range(turns.size):
        turn = 1.0 if y[lane] * u[lane] > x[lane] * v[lane] else -1.0
        change = (1.0 if v[lane] > 0.0 else 0.0) - (1.0 if y[lane] > 0.0 else 0.0)
        turns[lane] += turn * abs(change)


@njit(void(MATRICES, MATRICES, boolean, ROWS), **OPTIONS)
def count_all_turns(S, before, is_half, turns):
    """Count how often the first column of two by two products turned through whole half turns."""
    whole_vectors()
    K, work = len(S), rows_of(4)
    for s in range(K):
        count_turns(before[s, 0], before[s, 2], before[s + 1, 0], before[s + 1, 2], turns)
    if is_half:
        x, y, u, v = work[0], work[1], work[2], work[3]
        for lane in range(turns.size):
            u[lane], v[lane] = before[K, 0, lane], before[K, 2, lane]
        for s in range(K - 1, -1, -1):
            for lane in range(turns.size):
                x[lane], y[lane] = u[lane], v[lane]
                u[lane] = S[s, 3, lane] * x[lane] + S[s, 1, lane] * y[lane]
                v[lane] = S[s, 2, lane] * x[lane] + S[s, 0, lane] * y[lane]
            count_turns(x, y, u, v, turns)


@njit(MATRICES(int64, int64), **OPTIONS)
def work_of(followed, n):
    """Return what :func:`compose` works on, of so many segments."""
    return zeros_of(3 * followed + 7, n)


@njit(LANES(MATRICES, LANES, LANES, int64, STATES, MATRICES), **OPTIONS)
def compose(S, off, masses, steps, joined, work):
    """Return what is known of the product of the matrices of a period's segments.

    Args:
        S (numpy.ndarray, shape (followed, n n, W)): The matrices; where there are masses, those of the first half.
        off (numpy.ndarray, shape (followed, W)): By what each is off beside rounding, in roundings.
        masses (numpy.ndarray, shape (2 m m, W)): Where half a period is followed, the masses in the states' sizes and
            their inverse; else of no rows.
        steps (int): Segments of the period.
        joined (numpy.ndarray, shape (n, n)): Whether states act on each other: :func:`kernels.matrices.joined`.
        work (numpy.ndarray): Of :func:`work_of`.

    Returns:
        numpy.ndarray, shape (3 n n + 3, W): The product; the root of the sum of the squares of what the segments'
            errors, and one rounding of each product, become; the number of times that the first column turned through
            whole half turns, of n = 2; where an entry is large, the trace of the second compound, and the error of
            that; the matrix of the period that begins ELSEWHERE.
    """
    whole_vectors()
    (K, size, lanes), n, is_half, elsewhere = S.shape, len(joined), len(masses) > 0, round(ELSEWHERE * steps)
    before, after, G, work = work[: K + 1], work[K + 1 : 2 * K + 2], work[2 * K + 2 : 3 * K + 2], work[3 * K + 2 :]
    result, squares, most, is_large = rows_of(3 * size + 3), rows_of(len(masses)), work[4, 0], False
    minors, later = result[2 * size + 1 : 2 * size + 3], result[2 * size + 3 :]
    flat, errors = work.reshape(len(work), size * lanes), result[size : 2 * size].reshape(size * lanes)
    write_errors(S, off, joined, 0.5 * EPSILON / NOISE * math.sqrt(steps * n), G, work)
    write_unit(before[0], n)
    for s in range(K):
        multiply(S[s], before[s], before[s + 1], joined)
    if is_half:
        mirror(before[K], masses, joined, after[K])
    else:
        write_unit(after[K], n)
    multiply_after(S, G, joined, before, after, work)
    multiply(before[elsewhere], after[elsewhere], later, joined)
    copy_rows(result[:size], after[0])
    if is_half:
        for row in range(len(masses)):
            for lane in range(lanes):
                squares[row, lane] = masses[row, lane] * masses[row, lane]
        mirror(work[0], squares, joined, work[1])
        for x in range(size * lanes):  # what a segment is off, its mirror image is off, too
            flat[0, x] = 2.0 * (flat[0, x] + flat[1, x])
    for x in range(size * lanes):
        errors[x] = math.sqrt(flat[0, x])
    if n == 2:
        count_all_turns(S, before, is_half, result[2 * size])
    find_sizes(after[0], work[0], most)
    for lane in range(lanes):
        is_large |= most[lane] > LARGE
    if is_large and n in (2, 4):
        multiply_minors(S, off, masses, joined, minors)
    for row in range(2):
        for lane in range(lanes):
            minors[row, lane] = minors[row, lane] if most[lane] > LARGE and n in (2, 4) else np.nan
    return result


@njit(**OPTIONS)
def load(source, first, target):
    """Write what W points from the first on have, shape (rows, points), the last one in place of those not there."""
    whole_vectors()
    count = min(W, source.shape[1] - first)
    for row in range(len(source)):
        for lane in range(count):
            target[row, lane] = source[row, first + lane]
        for lane in range(count, W):
            target[row, lane] = target[row, count - 1]


@njit(**OPTIONS)
def store(source, first, target):
    """Write rows of W lanes where points from the first on are, as many as there are."""
    whole_vectors()
    count = min(W, target.shape[1] - first)
    for row in range(len(source)):
        for lane in range(count):
            target[row, first + lane] = source[row, lane]


@njit(**INNER)
def _differences(C, inverse, matrix, worst, work, numbers, owner):
    """Write half the differences of both sides, and by what the sum of all columns is off.

    numbers: n; first row of the states in a column; sides. owner: of each entry of the matrix the motion that has it;
    -1 where it vanishes. The last row of work: the largest sum of both sides.
    """
    whole_vectors()
    (n, states, sides), (half, linear, terms, uneven) = numbers, (work[0], work[1], work[2], work[3])
    of_sides, sign = len(C) // sides, 1.0 - 2.0 * (sides - 1)
    for lane in range(W):
        worst[lane], uneven[lane] = 0.0, 0.0
    for i in range(n):
        for lane in range(W):
            linear[lane], terms[lane] = 0.0, 0.0
        for j in range(max(n, of_sides)):
            c = owner[i, j] if j < n else j
            share, c = (0.5, c) if c >= 0 else (0.0, 0)
            plus, minus = C[c, (states + i) * W :], C[len(C) - of_sides + c, (states + i) * W :]
            for lane in range(W):
                half[lane] = share * (plus[lane] + sign * minus[lane]) * inverse[i, lane]
            if j < n:
                row = matrix[i * n + j]
                for lane in range(W):
                    row[lane] = half[lane]
                    linear[lane] += half[lane]
                    terms[lane] += abs(half[lane])
                    uneven[lane] = max(uneven[lane], abs(plus[lane] - sign * minus[lane]) * inverse[i, lane])
            else:
                for lane in range(W):
                    apart = abs(half[lane] - 2.0 * linear[lane]) - ROUNDED * terms[lane]
                    worst[lane] = max(worst[lane], apart)


@njit(
    float64[:, ::1](FUNCTION, float64[:, :, ::1], float64[:, :, :, ::1], LANES, int64[:, ::1], int64[::1]),
    nogil=True,
    **OPTIONS,
)
def measure(advance, base, columns, inverses, owner, numbers):
    """Follow perturbed motions through the segments of a period, and multiply the segments' matrices.

    Args:
        advance (function): ``advance(S, columns, steps)`` advances the base motion, the first rows of S, and perturbed
            motions of it.
        base (numpy.ndarray, shape (segments, rows, points)): The base motion where segments begin; or where the first
            one begins, and motions go on from it.
        columns (numpy.ndarray, shape (motions, segments or 1, rows, points)): Perturbed motions where segments begin:
            those of one side, and one of twice their sum where equations are not linear, then those of the other.
        inverses (numpy.ndarray, shape (n + 1, points)): Inverse of the states' sizes; what the base motion's error adds
            to an error, of the difference of sides. Where half a period is followed, the masses come after these, and
            their inverse.
        owner (numpy.ndarray, shape (n, n)): Of each entry of a matrix the motion that has it, or -1 where it vanishes.
        numbers (numpy.ndarray): Segments; steps in each; rows of S; first row of the states in a column, and the row
            of what the steps leave out; sides; row of what the steps leave out of the base motion.

    Returns:
        numpy.ndarray, shape (2 n n + 5, points): As of :func:`compose` without the last; then the truncation error of
            the steps and the effect of the amplitude, relative to each segment's largest entry.
    """
    whole_vectors()
    segments, steps, rows, states, left_out, sides, base_left_out = numbers
    n, motions, joined = len(owner), columns.shape[2], owner >= 0
    followed, out = segments // 2 if len(inverses) > n + 1 else segments, np.empty((2 * n * n + 5, inverses.shape[1]))
    S, C = scratch(rows), scratch(len(columns) * motions).reshape(len(columns), motions * W)
    inverse, matrices, off = rows_of(len(inverses)), zeros_of(followed, n), rows_of(followed)
    both, work, products, coherent = rows_of(2), rows_of(4), work_of(followed, n), math.sqrt(segments * n) / NOISE
    lost, wide, half, uneven = both[0], both[1], work[0], work[3]
    for first in range(0, inverses.shape[1], W):
        load(inverses, first, inverse)
        for lane in range(W):
            lost[lane], wide[lane] = 0.0, 0.0
        for s in range(followed):
            if s < len(base):
                load(base[s], first, S.reshape(rows, W))
            for c in range(len(columns)):
                load(columns[c, min(s, columns.shape[1] - 1)], first, C[c].reshape(motions, W))
            advance(S, C, steps)
            worst = off[s]
            _differences(C, inverse, matrices[s], worst, work, (n, states, sides), owner)
            for lane in range(W):
                wide[lane] += worst[lane]
                half[lane] = S[base_left_out * W + lane]
            for c in range(len(columns)):
                for i in range(n):
                    lacks = C[c, (left_out + i) * W :]
                    for lane in range(W):
                        half[lane] = max(half[lane], lacks[lane] * inverse[i, lane])
            for lane in range(W):
                lost[lane] += half[lane]
                worst[lane] = (worst[lane] + half[lane] + inverse[n, lane] * uneven[lane]) * coherent
        result = compose(matrices, off, inverse[n + 1 :], segments, joined, products)
        for i in range(n * n):
            for lane in range(W):
                lost[lane] += 0.0 * result[i, lane]  # not a number where these are none
        store(result[: 2 * n * n + 3], first, out)
        store(both, first, out[2 * n * n + 3 :])
    return out
