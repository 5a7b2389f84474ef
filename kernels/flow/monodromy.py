r"""Monodromy matrices from perturbed motions: matrices of segments, and their product, W points in parallel.

Perturbed motions in each direction, with both signs, are integrated through every segment of the period together with
the base motion, and share its series. Half the difference of both signs is a column of the segment's matrix S, and
:math:`M = S_K\cdots S_1`. If the equations are linear, one motion per direction of each independent block of states
suffices. If they are not, one more motion begins at twice the sum of all directions: its distance from twice the sum of
their ends bounds the distance of each column from a linear motion.

*Half a period.* If Hamilton's equations are even in the time and have no terms in the velocities, :math:`u(-t)` is a
solution if u(t) is: the second half's matrix is :math:`R\,P^{-1}R`, P the first half's, R with velocities reversed. For
:math:`P = (A\ B;\ C\ D)` and the masses a it follows without division: :math:`a^{-1}(D^T B^T;\ C^T A^T)\,a`. An error
of P appears in both halves, and both errors are added.

*Errors.* The error of a segment, :math:`G_k`, grows to :math:`|S_K\cdots S_{k+1}|\,G_k\,|S_{k-1}\cdots S_1|`, and so
does the rounding of each product. Roundings are independent, so their squares are added; truncation errors are not, and
count :math:`\sqrt{Kn}` times, for :math:`(\sum_{k=1}^K a_k)^2 \le K\sum a_k^2`.

*Second compounds.* The minors of two rows and two columns of a product are the products of the factors' minors. Their
trace is the determinant (two states), or the second invariant (four): computed from the segments' minors, these keep
the digits that the entries of M lose if a multiplier is large.

A matrix is n n rows of W lanes; that of the entry (i, j) is i n + j.
"""

import math
from itertools import combinations

import numpy as np

from kernels.compile.blocks import LANES, ROWS, W, rows_of, scratch
from kernels.compile.jit import INNER, OPTIONS, boolean, float64, int64, njit, types, void
from kernels.flow.dense import copy_rows

EPSILON = float(np.finfo(np.float64).eps)
NOISE = 6.0 * EPSILON  # rounding of a segment, relative to its terms
SUM_ROUNDING = 16.0 * EPSILON  # bound on the rounding of a sum of motions, relative to its terms
LARGE_ENTRY = 1e3  # largest entry above which the lesser pair of multipliers is found from the product of both
SECOND_PHASE = 0.381966  # phase at which a second product over the period begins, for comparison: the golden section
PAIRS = np.array([*combinations(range(4), 2)])  # pairs of states; the first is that of two states
STEP_TYPE = void(ROWS, LANES, int64)  # signature of functions that advance motions, or write a step's matrix
FUNCTION = types.FunctionType(STEP_TYPE)
MATRICES, STATES = float64[:, :, ::1], boolean[:, ::1]


@njit(MATRICES(int64, int64), **OPTIONS)
def zeros_of(count, n):
    """Return so many matrices of zeros, shape (count, n n, W)."""
    return scratch(count * n * n).reshape(count, n * n, W)


@njit(void(LANES, LANES, LANES, STATES), **OPTIONS)
def multiply_matrices(A, B, C, coupled):
    """Write A B into C.

    Args:
        `A`, `B`, `C` (numpy.ndarray, shape (n n, lanes)): Matrices.
        coupled (numpy.ndarray, shape (n, n)): Whether pairs of states are coupled; entries of uncoupled pairs vanish.
    """
    n, lanes, flat = len(coupled), C.shape[1], C.reshape(C.size)
    for x in range(flat.size):
        flat[x] = 0.0
    for i in range(n):
        for k in range(n):
            if coupled[i, k]:
                for j in range(n):
                    for lane in range(lanes):
                        C[i * n + j, lane] += A[i * n + k, lane] * B[k * n + j, lane]


@njit(void(LANES, int64), **OPTIONS)
def write_identity(A, n):
    """Write the unit matrix of n states."""
    for row in range(n * n):
        for lane in range(A.shape[1]):
            A[row, lane] = 1.0 if row % (n + 1) == 0 else 0.0


@njit(void(MATRICES, MATRICES, STATES, MATRICES, MATRICES, MATRICES), **OPTIONS)
def multiply_after(S, G, coupled, before, after, work):
    """Write the product of each matrix and all after it, and the variance of the product of all.

    Args:
        `S`, `G` (numpy.ndarray): Matrices of the segments, and their errors.
        coupled (numpy.ndarray, shape (n, n)): Whether pairs of states are coupled.
        before (numpy.ndarray): Product of the matrices before each segment.
        after (numpy.ndarray): The last one is an input; written: product of each matrix and all after it.
        work (numpy.ndarray): Scratch; into its first matrix is written the sum of the squares of the effects, on the
            product of all, of the errors G and of one rounding of each product.
    """
    K, size, lanes = S.shape
    entry, error = S.reshape(K, size * lanes), G.reshape(K, size * lanes)
    all_after, all_before = after.reshape(K + 1, size * lanes), before.reshape(K + 1, size * lanes)
    flat = work.reshape(len(work), size * lanes)
    total, left_squares, sum_squares, right_squares = flat[0], flat[1], flat[2], flat[3]
    for x in range(total.size):
        total[x] = 0.0
    for s in range(K - 1, -1, -1):
        multiply_matrices(after[s + 1], S[s], after[s], coupled)
        for x in range(total.size):
            left_squares[x] = all_after[s + 1, x] * all_after[s + 1, x]
            sum_squares[x] = error[s, x] * error[s, x] + entry[s, x] * entry[s, x]
            right_squares[x] = all_before[s, x] * all_before[s, x]
        multiply_matrices(work[2], work[3], work[4], coupled)
        multiply_matrices(work[1], work[4], work[2], coupled)
        for x in range(total.size):
            total[x] += sum_squares[x]


@njit(void(LANES, LANES, ROWS), **OPTIONS)
def find_sizes(A, sizes, largest):
    """Write the absolute values of the entries of `A` to sizes, and the largest of them to largest."""
    entries, flat = A.reshape(A.size), sizes.reshape(A.size)
    for x in range(A.size):
        flat[x] = abs(entries[x])
    for lane in range(largest.size):
        largest[lane] = sizes[0, lane]
    for row in range(1, len(A)):
        for lane in range(largest.size):
            largest[lane] = max(largest[lane], sizes[row, lane])


@njit(void(MATRICES, LANES, STATES, float64, MATRICES, MATRICES), **OPTIONS)
def write_errors(S, errors, coupled, common, G, work):
    """Write error bounds of matrices: roundings of terms, at most the largest entry, plus the given errors.

    Args:
        `S` (numpy.ndarray): Matrices of the segments; the terms are estimated by those of S S.
        errors (numpy.ndarray, shape (segments, lanes)): Errors of the entries in addition to rounding.
        coupled (numpy.ndarray, shape (n, n)): Whether pairs of states are coupled.
        common (float): Error by the rounding of the length of a step, common to all entries, over the largest entry.
        G, work (numpy.ndarray): Written; scratch.
    """
    n, lanes, sizes, largest = len(coupled), S.shape[2], work[0], work[1, 0]
    for s in range(len(G)):
        find_sizes(S[s], sizes, largest)
        multiply_matrices(sizes, sizes, G[s], coupled)
        for i in range(n):
            for j in range(n):
                if coupled[i, j]:
                    row = G[s, i * n + j]
                    for lane in range(lanes):
                        row[lane] = min(row[lane], largest[lane]) + (errors[s, lane] + common * largest[lane])


@njit(void(LANES, LANES, STATES, LANES), **OPTIONS)
def mirror_half(S, masses, coupled, Q):
    """Write R S⁻¹ R into Q; or its effect on squares of errors S, with the squares of masses.

    Args:
        `S`, `Q` (numpy.ndarray, shape (n n, lanes)): The matrix of the first half; written: that of the second.
        masses (numpy.ndarray, shape (2 m m, lanes)): Masses and their inverse, as in :func:`compose`.
        coupled (numpy.ndarray, shape (n, n)): Whether pairs of states are coupled.
    """
    n, m, lanes = len(coupled), len(coupled) // 2, Q.shape[1]
    for i in range(n):
        for j in range(n):
            for lane in range(lanes):
                Q[i * n + j, lane] = 0.0
            for a in range(m):
                for b in range(m):
                    mass, row = (a, j) if j < m else (j - m, a), (a + m * (j < m), b + m * (i < m))
                    inverse = (i, b) if i < m else (b, i - m)
                    if coupled[mass] and coupled[inverse] and coupled[row]:
                        x, y, z = mass[0] * m + mass[1], m * m + inverse[0] * m + inverse[1], row[0] * n + row[1]
                        for lane in range(lanes):
                            Q[i * n + j, lane] += S[z, lane] * (masses[x, lane] * masses[y, lane])


@njit(void(LANES, ROWS, LANES, LANES, int64), **OPTIONS)
def write_minors(S, errors, C, G, n):
    """Write the second compound of a matrix, and its error bound.

    Args:
        S, errors (numpy.ndarray): The matrix, and the errors of its entries over the largest one.
        `C`, `G` (numpy.ndarray): Written: the compound, and its error bound.
        `n` (int): Number of states.
    """
    lanes, d, work = errors.size, n * (n - 1) // 2, rows_of(n * n + 1)
    sizes, largest = work[: n * n], work[n * n]
    find_sizes(S, sizes, largest)
    for r in range(d):
        for c in range(d):
            i, j, k, m = PAIRS[r, 0] * n, PAIRS[r, 1] * n, PAIRS[c, 0], PAIRS[c, 1]
            for lane in range(lanes):
                first, second = S[i + k, lane] * S[j + m, lane], S[i + m, lane] * S[j + k, lane]
                C[r * d + c, lane] = first - second
                G[r * d + c, lane] = abs(first) + abs(second) + 2.0 * errors[lane] * largest[lane]


@njit(void(MATRICES, LANES, LANES, STATES, LANES), **OPTIONS)
def multiply_minors(S, errors, masses, coupled, result):
    """Write the trace of the second compound of the product, and its error.

    Args:
        S, errors, masses, coupled: As in :func:`compose`.
        result (numpy.ndarray, shape (2, lanes)): Added to: the trace, and its error.
    """
    K, n, halves = len(S), len(coupled), 2 if len(masses) else 1
    d = n * (n - 1) // 2
    C, G, before, after, work = zeros_of(K, d), zeros_of(K, d), zeros_of(K + 1, d), zeros_of(K + 1, d), zeros_of(5, d)
    all_coupled, mirror = np.ones((d, d), dtype=np.bool_), zeros_of(1, n)[0]
    write_identity(before[0], d)
    write_identity(after[K], d)
    for s in range(K):
        write_minors(S[s], errors[s], C[s], G[s], n)
        multiply_matrices(C[s], before[s], before[s + 1], all_coupled)
        if halves == 2:
            mirror_half(S[s], masses, coupled, mirror)
            write_minors(mirror, errors[s], work[0], work[1], n)
            multiply_matrices(after[K], work[0], work[2], all_coupled)
            copy_rows(after[K], work[2])
    multiply_after(C, G, all_coupled, before, after, work)
    for i in range(d):  # an error of a segment changes the trace as much as that of its mirror image
        for lane in range(errors.shape[1]):
            result[0, lane] += after[0, i * (d + 1), lane]
            result[1, lane] += halves * math.sqrt(work[0, i * (d + 1), lane])


@njit(void(ROWS, ROWS, ROWS, ROWS, ROWS), **OPTIONS)
def count_turns(x, y, u, v, turns):
    """Add to turns the half turns of vectors from (`x`, `y`) to (`u`, `v`)."""
    for lane in range(turns.size):
        sign = 1.0 if y[lane] * u[lane] > x[lane] * v[lane] else -1.0
        change = (1.0 if v[lane] > 0.0 else 0.0) - (1.0 if y[lane] > 0.0 else 0.0)
        turns[lane] += sign * abs(change)


@njit(void(MATRICES, MATRICES, boolean, ROWS), **OPTIONS)
def count_all_turns(S, before, is_half, turns):
    """Add to turns the whole half turns of the first column of two by two products.

    Args:
        S, before (numpy.ndarray): Matrices of the segments, and the products before each.
        is_half (bool): Whether the second half is the mirror image of the first.
        turns (numpy.ndarray, shape (lanes,)): Added to.
    """
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
def work_of(count, n):
    """Return the scratch of :func:`compose` for a number of segments."""
    return zeros_of(3 * count + 7, n)


@njit(LANES(MATRICES, LANES, LANES, int64, STATES, MATRICES), **OPTIONS)
def compose(S, errors, masses, steps, coupled, work):
    """Return the product of the matrices of a period's segments, and its error.

    Args:
        `S` (numpy.ndarray, shape (segments, n n, W)): The matrices; if there are masses, those of the first half.
        errors (numpy.ndarray, shape (segments, W)): Error of each in addition to rounding, in units of NOISE.
        masses (numpy.ndarray, shape (2 m m, W)): If half a period is integrated, the masses in the states' sizes and
            their inverse; else of no rows.
        steps (int): Segments of the period.
        coupled (numpy.ndarray, shape (n, n)): Whether pairs of states are coupled:
            :func:`kernels.flow.matrices.find_coupled`.
        work (numpy.ndarray): Scratch from :func:`work_of`.

    Returns:
        numpy.ndarray, shape (3 n n + 3, W): The product; the root of the sum of the squares of the effects of the
            segments' errors and of one rounding of each product; the whole half turns of the first column, for n = 2;
            if an entry is large, the trace of the second compound, and its error; the matrix of the period that begins
            at SECOND_PHASE.
    """
    (K, size, lanes), n, is_half, second_start = S.shape, len(coupled), len(masses) > 0, round(SECOND_PHASE * steps)
    before, after, G, work = work[: K + 1], work[K + 1 : 2 * K + 2], work[2 * K + 2 : 3 * K + 2], work[3 * K + 2 :]
    result, squares, largest, is_large = rows_of(3 * size + 3), rows_of(len(masses)), work[4, 0], False
    minors, second_product = result[2 * size + 1 : 2 * size + 3], result[2 * size + 3 :]
    flat, entry_errors = work.reshape(len(work), size * lanes), result[size : 2 * size].reshape(size * lanes)
    write_errors(S, errors, coupled, 0.5 * EPSILON / NOISE * math.sqrt(steps * n), G, work)
    write_identity(before[0], n)
    for s in range(K):
        multiply_matrices(S[s], before[s], before[s + 1], coupled)
    if is_half:
        mirror_half(before[K], masses, coupled, after[K])
    else:
        write_identity(after[K], n)
    multiply_after(S, G, coupled, before, after, work)
    multiply_matrices(before[second_start], after[second_start], second_product, coupled)
    copy_rows(result[:size], after[0])
    if is_half:
        for row in range(len(masses)):
            for lane in range(lanes):
                squares[row, lane] = masses[row, lane] * masses[row, lane]
        mirror_half(work[0], squares, coupled, work[1])
        for x in range(size * lanes):  # a segment's mirror image has the same error
            flat[0, x] = 2.0 * (flat[0, x] + flat[1, x])
    for x in range(size * lanes):
        entry_errors[x] = math.sqrt(flat[0, x])
    if n == 2:
        count_all_turns(S, before, is_half, result[2 * size])
    find_sizes(after[0], work[0], largest)
    for lane in range(lanes):
        is_large |= largest[lane] > LARGE_ENTRY
    if is_large and n in (2, 4):
        multiply_minors(S, errors, masses, coupled, minors)
    for row in range(2):
        for lane in range(lanes):
            minors[row, lane] = minors[row, lane] if largest[lane] > LARGE_ENTRY and n in (2, 4) else np.nan
    return result


@njit(**OPTIONS)
def load(source, first, target):
    """Copy W points of source, shape (rows, points), from the first on to target; repeat the last to fill it."""
    count = min(W, source.shape[1] - first)
    for row in range(len(source)):
        for lane in range(count):
            target[row, lane] = source[row, first + lane]
        for lane in range(count, W):
            target[row, lane] = target[row, count - 1]


@njit(**OPTIONS)
def store(source, first, target):
    """Copy rows of W lanes of source to the points of target from the first on, as many as there are."""
    count = min(W, target.shape[1] - first)
    for row in range(len(source)):
        for lane in range(count):
            target[row, first + lane] = source[row, lane]


@njit(**INNER)
def _write_differences(C, inverse, matrix, worst, work, numbers, owner):
    """Write half the differences of both sides, and the error of the sum of all columns.

    numbers: n; first row of the states in a column; sides. owner: index of the motion of each entry of the matrix; -1
    if it vanishes. The last row of work: the largest sum of both sides.
    """
    (n, states, sides), (half, linear, terms, asymmetry) = numbers, (work[0], work[1], work[2], work[3])
    of_sides, sign = len(C) // sides, 1.0 - 2.0 * (sides - 1)
    for lane in range(W):
        worst[lane], asymmetry[lane] = 0.0, 0.0
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
                    asymmetry[lane] = max(asymmetry[lane], abs(plus[lane] - sign * minus[lane]) * inverse[i, lane])
            else:
                for lane in range(W):
                    excess = abs(half[lane] - 2.0 * linear[lane]) - SUM_ROUNDING * terms[lane]
                    worst[lane] = max(worst[lane], excess)


@njit(
    float64[:, ::1](FUNCTION, float64[:, :, ::1], float64[:, :, :, ::1], LANES, int64[:, ::1], int64[::1]),
    nogil=True,
    **OPTIONS,
)
def measure_matrices(advance, base, columns, inverses, owner, numbers):
    """Integrate perturbed motions through the segments of a period, and multiply the segments' matrices.

    Args:
        advance (function): ``advance(S, columns, steps)`` advances the base motion, the first rows of S, and perturbed
            motions of it.
        base (numpy.ndarray, shape (starts, rows, points)): The base motion at evenly spaced starts of segments, from
            which it continues through the segments up to the next.
        columns (numpy.ndarray, shape (motions, segments or 1, rows, points)): Perturbed motions at these starts: those
            of positive sign, a motion from twice their sum if equations are not linear, then those of negative sign.
        inverses (numpy.ndarray, shape (n + 1, points)): Inverse of the states' sizes; the base motion's contribution to
            an error, relative to the difference of sides. If half a period is integrated, the masses follow, and their
            inverse.
        owner (numpy.ndarray, shape (n, n)): Index of the motion of each entry of a matrix, or -1 if it vanishes.
        numbers (numpy.ndarray): Segments; steps in each; rows of S; first row of the states in a column, and that of
            the steps' truncation; sides; row of the truncation of the base motion.

    Returns:
        numpy.ndarray, shape (2 n n + 5, points): As of :func:`compose` without the last matrix; then the truncation
            error of the steps and the effect of the amplitude, relative to each segment's largest entry.
    """
    segments, steps, rows, states, truncation_row, sides, base_row = numbers
    n, motions, coupled = len(owner), columns.shape[2], owner >= 0
    count, out = segments // 2 if len(inverses) > n + 1 else segments, np.empty((2 * n * n + 5, inverses.shape[1]))
    S, C = scratch(rows), scratch(len(columns) * motions).reshape(len(columns), motions * W)
    inverse, matrices, errors = rows_of(len(inverses)), zeros_of(count, n), rows_of(count)
    summary, work, products, coherent = rows_of(2), rows_of(4), work_of(count, n), math.sqrt(segments * n) / NOISE
    truncation, effect, half, asymmetry = summary[0], summary[1], work[0], work[3]
    for first in range(0, inverses.shape[1], W):
        load(inverses, first, inverse)
        for lane in range(W):
            truncation[lane], effect[lane] = 0.0, 0.0
        for s in range(count):
            if s * len(base) % count == 0:
                load(base[s * len(base) // count], first, S.reshape(rows, W))
            for c in range(len(columns)):
                load(columns[c, min(s, columns.shape[1] - 1)], first, C[c].reshape(motions, W))
            advance(S, C, steps)
            worst = errors[s]
            _write_differences(C, inverse, matrices[s], worst, work, (n, states, sides), owner)
            for lane in range(W):
                effect[lane] += worst[lane]
                half[lane] = S[base_row * W + lane]
            for c in range(len(columns)):
                for i in range(n):
                    truncations = C[c, (truncation_row + i) * W :]
                    for lane in range(W):
                        half[lane] = max(half[lane], truncations[lane] * inverse[i, lane])
            for lane in range(W):
                truncation[lane] += half[lane]
                worst[lane] = (worst[lane] + half[lane] + inverse[n, lane] * asymmetry[lane]) * coherent
        result = compose(matrices, errors, inverse[n + 1 :], segments, coupled, products)
        for i in range(n * n):
            for lane in range(W):
                truncation[lane] += 0.0 * result[i, lane]  # NaN if an entry is
        store(result[: 2 * n * n + 3], first, out)
        store(summary, first, out[2 * n * n + 3 :])
    return out
