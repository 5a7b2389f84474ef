r"""The variational flow over one period by collocation at Gauss's points, W points in parallel.

With the time in units of a step, a perturbation obeys :math:`u'' = k(t)\,u + c(t)\,u'` (coordinates; k and c are the
slopes of the accelerations, times the step's square and the step) or :math:`u' = c(t)\,u` (states). The unknowns of a
step are the highest derivatives at its points, and u and u' are their integrals: for coordinates half as many as there
are states. They are solved for by elimination without exchange of rows: in a step that is short enough to be accurate,
k and c are of order 1, and the matrix is near 1. The order is twice STAGES.

Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.7 and II.14 (Nystrom methods).
"""

import math
from functools import cache
from itertools import product

import numpy as np

from kernels.compile.blocks import LANES, W, rows_of, scratch
from kernels.compile.jit import OPTIONS, PASSED, float64, int64, njit
from kernels.compile.llvm_formulas import lines
from kernels.flow.dense import solve_in_lanes
from kernels.flow.monodromy import FUNCTION, STATES, STEP_TYPE, compose, load, store, work_of, zeros_of

MAX_UNROLLED = 2  # largest number of unknowns at each point with elimination in unrolled lines of code

GAUSS = (  # the roots of the Legendre polynomial P_8 that are > 0, and their weights: Abramowitz and Stegun, table 25.4
    (0.1834346424956498049394761, 0.3626837833783619829651505),
    (0.5255324099163289858177390, 0.3137066458778872873379622),
    (0.7966664774136267395915539, 0.2223810344533744705443560),
    (0.9602898564975362316835609, 0.1012285362903762591525314),
)


def collocation_weights():
    """Return Gauss's points in (0, 1), the weights of integrals up to each point, and of the whole.

    The polynomial through values f_j at the points x_j of (-1, 1) is the sum of w_j f_j (k + 1/2) P_k(x_j) P_k(x) over
    j and k, and (2k + 1) times the integral of P_k from -1 is P_{k+1} - P_{k-1}. Sums are written out, as a library's
    order of summation depends on the processor.
    """
    x, w = np.transpose([(-root, weight) for root, weight in reversed(GAUSS)] + list(GAUSS))
    P = [np.ones_like(x), x]
    for k in range(1, x.size):
        P.append(((2 * k + 1) * x * P[k] - k * P[k - 1]) / (k + 1))
    higher = [P[1] + 1.0, *(P[k + 1] - P[k - 1] for k in range(1, x.size))]
    inner = sum(np.outer(higher[k], P[k] * w) for k in range(x.size))
    return 0.5 * (x + 1.0), 0.25 * inner, 0.5 * w


def _double_weights(weights, inner):
    """Return the weights of integrals of integrals."""
    return sum(np.multiply.outer(weights[..., k], inner[k]) for k in range(STAGES))


POINTS, INNER, STEP_WEIGHTS = collocation_weights()
STAGES = POINTS.size
DOUBLE_WEIGHTS, DOUBLE_STEP_WEIGHTS = _double_weights(INNER, INNER), _double_weights(STEP_WEIGHTS, INNER)


def equation_terms(m, n, entries):
    """Yield row, column, weight and slope's number of each term of the equations of a step, except the unit matrix.

    Args:
        `m` (int): Number of unknowns at each point.
        `n` (int): Number of states.
        entries (sequence of (int, int)): Each (i, j) is the slope of the unknown i by the state j. Columns are the
            unknowns, the highest derivatives at POINTS, and after them the states at the start.
    """
    size = STAGES * m
    for (e, (i, j)), stage in product(enumerate(entries), range(STAGES)):
        row, slope, is_twice = stage * m + i, stage * len(entries) + e, n > m > j
        for k, weight in enumerate((DOUBLE_WEIGHTS if is_twice else INNER)[stage]):
            yield row, k * m + j % m, -weight, slope
        yield row, size + j, 1.0, slope
        if is_twice:
            yield row, size + j + m, POINTS[stage], slope


def elimination_lines(m, n, entries):
    """Yield lines that write the matrix of a step: the rows of S are the slopes of each stage, then the matrix.

    Rows are column → text: the equations of the unknowns, then the states at the end. Once the unknowns are eliminated,
    the last n rows are the matrix.

    Args:
        m, n, entries: As in :func:`equation_terms`.
    """
    size, count = STAGES * m, STAGES * len(entries)
    yield from (f"s_{k} = S[{k * W} + lane]" for k in range(count))
    rows = [{row: "1.0"} for row in range(size)]
    for row, column, weight, slope in equation_terms(m, n, entries):
        text = f"{float(weight)!r} * s_{slope}"
        rows[row][column] = f"{rows[row][column]} + {text}" if column in rows[row] else text
    for i in range(n):
        weights = DOUBLE_STEP_WEIGHTS if i < n - m else STEP_WEIGHTS
        equation = {k * m + i % m: repr(-float(weights[k])) for k in range(STAGES)} | {size + i: "1.0"}
        rows.append(equation | ({size + i + m: "1.0"} if i < n - m else {}))
    for r, row in enumerate(rows):
        if r < size:
            yield from (f"a_{r}_{q} = {text}" for q, text in row.items())
            rows[r] = row = {q: f"a_{r}_{q}" for q in row}
        for p in range(min(r, size)):
            if p in row:
                yield f"f = {row.pop(p)} * inverse_{p}"
                for q, x in rows[p].items():
                    yield f"a_{r}_{q} = {row[q]} - f * {x}" if q in row else f"a_{r}_{q} = -f * {x}"
                    row[q] = f"a_{r}_{q}"
        if r < size:
            yield f"inverse_{r} = 1.0 / {row.pop(r)}"
    for i, j in product(range(n), range(n)):
        yield f"S[{(count + i * n + j) * W} + lane] = {rows[size + i].get(size + j, '0.0')}"


@cache
def compile_step(m, n, entries):
    """Return the compiled function that writes the matrix of a step, ``step(S, nothing, 0)``.

    Args:
        `m` (int): Number of unknowns at each point (coordinates, or states).
        `n` (int): Number of states.
        entries (sequence of (int, int)): Each slope that does not vanish; see :func:`equation_terms`.
    """
    name = f"step_{m}_{n}_" + "".join(map(str, np.ravel(entries)))
    if m <= MAX_UNROLLED:
        step = lines("\n".join(elimination_lines(m, n, entries)))

        @njit(STEP_TYPE, name=name, **PASSED)
        def by_lines(S, nothing, number):
            step(S)

        return by_lines
    size, count = STAGES * m, STAGES * len(entries)
    # copied, for code with arrays that are not contiguous would not be kept in the cache
    rows, columns, weights, slopes = np.reshape([*equation_terms(m, n, entries)], (-1, 4)).T.copy()
    places = W * np.where(columns < size, rows * size + columns, columns * size + rows)
    pairs = np.stack([places, W * slopes], axis=1).astype(np.uint64)  # unsigned: no index is from the end

    @njit(STEP_TYPE, name=name, **PASSED)
    def by_loops(S, nothing, number):
        """Find the stages from their linear equations in every lane, and write the step's matrix after the slopes."""
        s, A, f = S.reshape(S.size // W, W), rows_of((size + n) * size), rows_of(1)[0]
        B, flat = A[size * size :], A.reshape(A.size)  # B: the columns of the states
        for r in range(size):
            for lane in range(W):
                A[r * size + r, lane] = 1.0
        for t in range(weights.size):
            to, slope, weight = pairs[t, 0], pairs[t, 1], weights[t]
            for lane in range(W):
                flat[to + np.uint64(lane)] += weight * S[slope + np.uint64(lane)]
        solve_in_lanes(A, B, size, n, False, -math.inf, f)
        for i in range(n):
            weights_of_row = DOUBLE_STEP_WEIGHTS if i < n - m else STEP_WEIGHTS
            for j in range(n):
                row, unit = s[count + i * n + j], 1.0 if i == j or (n > m and i + m == j) else 0.0
                for lane in range(W):
                    row[lane] = unit
                for k in range(STAGES):
                    rates = B[j * size + k * m + i % m]
                    for lane in range(W):
                        row[lane] += weights_of_row[k] * rates[lane]

    return by_loops


@njit(float64[:, ::1](FUNCTION, STATES, LANES, float64[:, :, ::1], LANES, int64), nogil=True, **OPTIONS)
def integrate_flow(step, coupled, factors, slopes, lengths, steps):
    """Return the matrix of the period of each point, and its error.

    Args:
        step (function): Returned by :func:`compile_step`.
        coupled (numpy.ndarray, shape (n, n)): Whether pairs of states are coupled.
        factors (numpy.ndarray, shape (times, terms)): Factors of the slopes' terms at POINTS of each step; or no terms.
        slopes (numpy.ndarray, shape (terms or times, entries, points)): Terms of the slopes, which are summed with
            factors; or the slopes at all times. In units of a step.
        lengths (numpy.ndarray, shape (n, points)): The states' sizes, of velocities times the length of a step. If half
            a period is integrated, the masses in the states' sizes follow, and their inverse.
        steps (int): Steps in a period.

    Returns:
        numpy.ndarray, shape (3 n n + 3, points): As of :func:`kernels.flow.monodromy.compose`, in the states' sizes.
    """
    n, (_, count, points), num_parts = len(coupled), slopes.shape, factors.shape[1]
    size, S, H = n * n, scratch(STAGES * count + n * n), scratch(num_parts * count)
    length, ratio, inverse, masses = rows_of(n), rows_of(size), scratch(1), rows_of(len(lengths) - n)
    num_own, s, out = steps // 2 if len(lengths) > n else steps, S.reshape(-1, W), np.empty((3 * size + 3, points))
    matrices, errors, work = zeros_of(num_own, n), rows_of(num_own), work_of(num_own, n)
    factor = ratio.reshape(size * W)
    for first in range(0, points, W):
        load(lengths[:n], first, length)
        load(lengths[n:], first, masses)
        for i in range(n):
            for lane in range(W):
                inverse[lane] = 1.0 / length[i, lane]
            for j in range(n):
                for lane in range(W):
                    ratio[i * n + j, lane] = length[j, lane] * inverse[lane]
        for r in range(num_parts):
            load(slopes[r], first, H.reshape(num_parts * count, W)[r * count :])
        for k in range(num_own):
            for stage in range(STAGES):
                at = k * STAGES + stage
                if num_parts == 0:
                    load(slopes[at], first, s[stage * count :])
                else:
                    rows = S[stage * count * W :]
                    for x in range(count * W):
                        rows[x] = factors[at, 0] * H[x]
                    for r in range(1, num_parts):
                        summand = H[r * count * W :]
                        for x in range(count * W):
                            rows[x] += factors[at, r] * summand[x]
            step(S, errors, 0)
            matrix, result = matrices[k].reshape(size * W), S[STAGES * count * W :]
            for x in range(size * W):
                matrix[x] = result[x] * factor[x]
        store(compose(matrices, errors, masses, steps, coupled, work), first, out)
    return out
