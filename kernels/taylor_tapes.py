r"""Taylor steps of large systems, read from a tape: nothing of the system itself is compiled.

What `sweeps.mechanics.taylor` writes out line by line for a small system, this does row by row for one whose text a
compiler would work on for minutes. One row an operation, in an order in which each follows its parts; the order of the
series is the loop outside, lanes the one inside. With :math:`u = U + \varepsilon\hat u` and the n-th term
:math:`\hat u_n` of :math:`\hat u(t + h)`,

.. math:: \hat x_n = \tfrac hn \hat f_{n-1}, \quad
          \widehat{(uv)}_n = U\hat v_n + V\hat u_n + \varepsilon\sum_k \hat u_k \hat v_{n-k}, \quad
          \widehat{(u/v)}_n = \frac{\hat u_n - Q\hat v_n - \varepsilon\sum_{k>0}\hat v_k\hat q_{n-k}}
          {V + \varepsilon\hat v_0}

and a function :math:`w = f(u)` keeps its remainder, :math:`\hat w_n = f'(U)\hat u_n + \varepsilon\tilde w_n`,
:math:`\tilde w_n = \tfrac1n \sum_k k\,\hat u_k\,\widehat{f'(u)}_{n-k}`. Energies go one order of ε further.

The scratch array S has rows W long: the states, the functions' remainders; then ε, the step, what is watched, and
constants (the values at the equilibrium).

Source: as for the text (Griewank and Walther, Evaluating Derivatives, chapter 13).
"""

import numpy as np

from kernels.blocks import W
from kernels.jit import OPTIONS, float64, int64, njit, types, void, whole_vectors
from kernels.runs import ORDER

STATE, SUM, PRODUCT, QUOTIENT, FUNCTION, CONSTANT = range(6)
FIRST_ORDER, SECOND_ORDER, ABSOLUTE = range(3)  # of what is watched

# Columns of a row of the tape. FIRST and SECOND are rows above (-1: does not move), the state's number, or where a
# sum's parts begin and end; BASE1, BASE2 and OWN rows of S with values at the equilibrium (-1: it is 0): of the parts
# and of the row itself, or of f′(U); REMAINDER a function's row of S, SLOPE the row that is f′(u); LAST is 1 where the
# highest order is wanted too.
CODE, FIRST, SECOND, BASE1, BASE2, OWN, REMAINDER, SLOPE, LAST = range(9)
COLUMNS = 9

ROWS = types.Array(int64, 2, "C", readonly=True)  # arrays that are written into generated modules
WHOLE = types.Array(int64, 1, "C", readonly=True)
REAL = types.Array(float64, 1, "C", readonly=True)


@njit(**OPTIONS)
def _add_products(A, B, first, last, n, out):
    """Add A_k B_(n-k) for k = first … last; a loop of W lanes, were it known to be W, would be unrolled, not packed."""
    whole_vectors()
    for k in range(first, last + 1):
        P, Q = A[k], B[n - k]
        for lane in range(out.size):
            out[lane] += P[lane] * Q[lane]


@njit(**OPTIONS)
def _add_based(S, base, A, n, sign, out):
    """Add ± U A_n, where the row of U is one."""
    whole_vectors()
    if base >= 0:
        for lane in range(out.size):
            out[lane] += sign * S[base * W + lane] * A[n, lane]


@njit(**OPTIONS)
def _sum(C, parts, weights, first, last, n, out):
    whole_vectors()
    for k in range(first, last):
        A, weight = C[parts[k]], weights[k]
        for lane in range(out.size):
            out[lane] += weight * A[n, lane]


@njit(**OPTIONS)
def _product(C, S, row, n, epsilon, out):
    whole_vectors()
    a, b = row[FIRST], row[SECOND]
    if (a >= 0) & (b >= 0):
        _add_products(C[a], C[b], 0, n, n, out)
        for lane in range(out.size):
            out[lane] *= S[epsilon + lane]
    if b >= 0:
        _add_based(S, row[BASE1], C[b], n, 1.0, out)
    if a >= 0:
        _add_based(S, row[BASE2], C[a], n, 1.0, out)


@njit(**OPTIONS)
def _quotient(C, S, row, n, epsilon, factors, over, out):
    whole_vectors()
    a, b = row[FIRST], row[SECOND]
    if n == 0:
        for lane in range(out.size):
            base = S[row[BASE2] * W + lane] if row[BASE2] >= 0 else 0.0
            over[lane] = 1.0 / (base + S[epsilon + lane] * C[b, 0, lane])
    _add_products(C[b], factors, 1, n, n, out)
    for lane in range(out.size):
        out[lane] *= -S[epsilon + lane]
    _add_based(S, row[OWN], C[b], n, -1.0, out)
    if a >= 0:
        A = C[a]
        for lane in range(out.size):
            out[lane] += A[n, lane]
    for lane in range(out.size):
        out[lane] *= over[lane]


@njit(**OPTIONS)
def _function(C, S, row, n, epsilon, rest, out):
    """Write the n-th term of a function, and that of its remainder into rest."""
    whole_vectors()
    left = rest[n]
    if n == 0:
        for lane in range(out.size):
            left[lane] = S[row[REMAINDER] * W + lane]
    else:
        for lane in range(out.size):
            left[lane] = 0.0
        if row[SLOPE] >= 0:
            A, B = C[row[FIRST]], C[row[SLOPE]]
            for k in range(1, n + 1):
                P, Q = A[k], B[n - k]
                for lane in range(out.size):
                    left[lane] += k * P[lane] * Q[lane]
            for lane in range(out.size):
                left[lane] /= n
    _add_based(S, row[OWN], C[row[FIRST]], n, 1.0, out)
    for lane in range(out.size):
        out[lane] += S[epsilon + lane] * left[lane]


@njit(**OPTIONS)
def _terms(tape, parts, weights, S, X, C, R, over, epsilon, n, highest):
    """Write the n-th term of every row of the tape."""
    whole_vectors()
    for k in range(len(tape)):
        row = tape[k]
        if (n < highest) | (row[LAST] > 0):
            code, out = row[CODE], C[k, n]
            if code == STATE:
                A = X[row[FIRST]]
                for lane in range(W):
                    out[lane] = A[n, lane]
                continue
            for lane in range(W):
                out[lane] = S[row[OWN] * W + lane] if (code == CONSTANT) & (n == 0) & (row[OWN] >= 0) else 0.0
            if code == SUM:
                _sum(C, parts, weights, row[FIRST], row[SECOND], n, out)
            elif code == PRODUCT:
                _product(C, S, row, n, epsilon, out)
            elif code == QUOTIENT:
                _quotient(C, S, row, n, epsilon, C[k], over[k], out)
            elif code == FUNCTION:
                _function(C, S, row, n, epsilon, R[k], out)


@njit(**OPTIONS)
def _gather(A, S, row):
    """Write the sum of a series into a row of S, smallest terms first."""
    whole_vectors()
    for lane in range(W):
        total = A[ORDER, lane]
        for n in range(ORDER - 1, 0, -1):
            total += A[n, lane]
        S[row * W + lane] = total + A[0, lane]


@njit(**OPTIONS)
def _series(tape, parts, weights, rates, states, S, X, C, R):
    """Write all terms of a step: of the states into X, of each row into C, and of functions' remainders into R."""
    whole_vectors()
    highest, epsilon, step, over = X.shape[1] - 1, states * W, (states + 1) * W, np.empty((len(tape), W))
    for i in range(len(rates)):
        for lane in range(W):
            X[i, 0, lane] = S[i * W + lane]
    for n in range(highest + 1):
        for i in range(len(rates) if n > 0 else 0):
            a, base = rates[i]
            for lane in range(W):
                rate = C[a, n - 1, lane] if a >= 0 else 0.0
                rate += S[base * W + lane] if (n == 1) & (base >= 0) else 0.0
                X[i, n, lane] = S[step + lane] / n * rate
        _terms(tape, parts, weights, S, X, C, R, over, epsilon, n, highest)
    for k in range(len(tape)):
        if (tape[k, CODE] == FUNCTION) & (tape[k, LAST] == 0):  # it is carried: the highest order of it is wanted
            out = C[k, highest]
            for lane in range(W):
                out[lane] = 0.0
            _function(C, S, tape[k], highest, epsilon, R[k], out)


@njit(**OPTIONS)
def _put(A, S, first):
    """Write the terms of a series into rows of S."""
    for n in range(1, len(A)):
        for lane in range(W):
            S[(first + n - 1) * W + lane] = A[n, lane]


@njit(void(ROWS, WHOLE, REAL, ROWS, int64, float64[::1], int64), **OPTIONS)
def advance(tape, parts, weights, rates, states, S, steps):
    """Advance every lane by so many steps of order ORDER.

    Args:
        tape (int64 array, shape (rows, COLUMNS)): The operations.
        parts, weights (int64 and float64 arrays): Rows of the tape that the sums are made of, and what each counts.
        rates (int64 array, shape (states, 2)): Of each state's rate its row of the tape (-1 for one that does not
            move), and the row of S with its value where deviations are from (-1: it is 0).
        states (int): Rows of S that are state or remainder; ε and the step follow.
        S (float64 array): Read and written: see the top of this file.
        steps (int): How many.
    """
    whole_vectors()
    size, count = len(rates), len(tape)
    X, C = np.empty((size, ORDER + 1, W)), np.empty((count, ORDER + 1, W))
    R = np.zeros((count, ORDER + 1, W))
    for _ in range(steps):
        _series(tape, parts, weights, rates, states, S, X, C, R)
        for i in range(size):
            _gather(X[i], S, i)
        for k in range(count):
            if tape[k, CODE] == FUNCTION:
                _gather(R[k], S, tape[k, REMAINDER])


@njit(void(ROWS, WHOLE, REAL, ROWS, types.UniTuple(int64, 3), float64[::1]), **OPTIONS)
def expand(tape, parts, weights, rates, rows, S):
    """Write the terms of the states and functions, where deviations are from nothing and epsilon is 1.

    Args:
        tape, parts, weights, rates, S: As of :func:`advance`.
        rows (3 ints): Rows of S that are state or function, all of them, and the order: the terms of each follow, of
            orders 1 to that, and a row that is left alone.
    """
    whole_vectors()
    size, count, order = len(rates), len(tape), rows[2]
    X, C, R = np.empty((size, order + 1, W)), np.empty((count, order + 1, W)), np.zeros((count, order + 1, W))
    _series(tape, parts, weights, rates, rows[0], S, X, C, R)
    for i in range(size):
        _put(X[i], S, rows[1] + (order + 1) * i)
    for k in range(count):
        if tape[k, CODE] == FUNCTION:
            _put(C[k], S, rows[1] + (order + 1) * tape[k, REMAINDER])


@njit(**OPTIONS)
def _second(row, parts, weights, S, C, rest, own, second, out):
    """Write the part of a row that is of second order in ε."""
    whole_vectors()
    code, a, b = row[CODE], row[FIRST], row[SECOND]
    if code == SUM:
        for k in range(a, b):
            for lane in range(W):
                out[lane] += weights[k] * second[parts[k], lane]
    elif code == FUNCTION:
        for lane in range(W):
            out[lane] = S[row[OWN] * W + lane] * second[a, lane] + rest[lane]
    elif code == PRODUCT:
        for lane in range(W):
            one = S[row[BASE1] * W + lane] * second[b, lane] if (row[BASE1] >= 0) & (b >= 0) else 0.0
            other = S[row[BASE2] * W + lane] * second[a, lane] if (row[BASE2] >= 0) & (a >= 0) else 0.0
            out[lane] = one + other + (C[a, 0, lane] * C[b, 0, lane] if (a >= 0) & (b >= 0) else 0.0)
    elif code == QUOTIENT:
        for lane in range(W):
            value = second[a, lane] if a >= 0 else 0.0
            value -= S[row[OWN] * W + lane] * second[b, lane] if row[OWN] >= 0 else 0.0
            value -= own[lane] * C[b, 0, lane]
            out[lane] = value / (S[row[BASE2] * W + lane] if row[BASE2] >= 0 else 0.0)


@njit(void(ROWS, WHOLE, REAL, ROWS, int64, float64[::1]), **OPTIONS)
def check(tape, parts, weights, watched, states, S):
    """Write the deviations of what is watched, over ε or ε².

    Args:
        tape, parts, weights, S: As of :func:`advance`.
        states (int): Rows of S that are state or remainder.
        watched (int64 array, shape (terms, 3)): Of each term: to which row below the step it is added, its order or
            ABSOLUTE, and its row of the tape (-1: it does not move).
    """
    whole_vectors()
    count, epsilon = len(tape), states * W
    X, C, over = np.empty((states, 1, W)), np.empty((count, 1, W)), np.empty((count, W))
    R, second = np.empty((count, 1, W)), np.zeros((count, W))
    for i in range(states):
        for lane in range(W):
            X[i, 0, lane] = S[i * W + lane]
    _terms(tape, parts, weights, S, X, C, R, over, epsilon, 0, 1)
    for k in range(count):
        _second(tape[k], parts, weights, S, C, R[k, 0], C[k, 0], second, second[k])
    for k in range(len(watched)):
        row = (states + 2 + watched[k, 0]) * W
        for lane in range(W):
            S[row + lane] = 0.0
    for k in range(len(watched)):
        to, kind, at = watched[k]
        if at < 0:
            continue
        row = (states + 2 + to) * W
        for lane in range(W):
            term = C[at, 0, lane] if kind == FIRST_ORDER else second[at, lane]
            S[row + lane] += abs(term) if kind == ABSOLUTE else term
