r"""Enclosures: what a formula can amount to anywhere in a box, with its slopes, in interval arithmetic.

A formula comes as a tape, one row an operation, each an interval :math:`[u]` with its derivatives:

.. math:: [u][v], \quad [u] + [v], \quad [u]^k, \quad f([u]); \qquad
          w' = f'(u)\,u', \quad \tfrac12 w'' = f'(u)\,\tfrac12 u'' + \tfrac12 f''(u)\,u'^2

The exact value at any place of the box lies within the interval: each result of an elementary operation is widened by
:math:`2^{-52}` of itself, twice what rounding to nearest takes, those of the C library's functions by eight times that
(they are good to a unit or two in the last place), and powers by a part a factor. So a sign that an interval shows is
a theorem, as far as the C library keeps to its word. Overflow gives an infinite end, never a number.

Lanes: W boxes at a time, the loop over them innermost. No exception is raised; each box has a state: SOUND; POLE,
where some part is unbounded, jumps or is defined on a part of the box only; or OUTSIDE, where it is defined nowhere.

Source: Moore, Kearfott and Cloud, Introduction to Interval Analysis, chapters 2, 5 and 9.
"""

import math

import numpy as np

from kernels.jit import float64, int64, njit, void, whole_vectors

OPTIONS = {"cache": True, "error_model": "numpy", "nogil": True}
INLINE = {"cache": True, "error_model": "numpy"}

SOUND, POLE, OUTSIDE = range(3)
W = 32  # lanes

# Operations: row (code, a, b) of a tape, a and b rows above it, or the number of a variable or constant, or a power.
VARIABLE, CONSTANT, ADD, MUL, WHOLE_POWER, POWER = range(6)
EXP, LOG, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, ASINH, ACOSH, ATANH, ERF = range(10, 25)

UNIT = 2.0**-52
LIBRARY = 8.0 * UNIT  # of a function of the C library
TINY = 2.3e-308  # what underflow may take
HALF_PI = 0.5 * math.pi
INF = math.inf


@njit(**INLINE)
def _down(x, part):
    y = x - (abs(x) * part + TINY)
    return y if y == y else -INF


@njit(**INLINE)
def _up(x, part):
    y = x + (abs(x) * part + TINY)
    return y if y == y else INF


@njit(**INLINE)
def _add(a, b, c, d):
    """[a, b] + [c, d]; sums lose nothing to underflow, and exact zeros stay."""
    low, high = a + c, b + d
    low, high = low - abs(low) * UNIT, high + abs(high) * UNIT
    return (low if low == low else -INF), (high if high == high else INF)


@njit(**INLINE)
def _mul(a, b, c, d):
    """[a, b] [c, d]; a product of what is not negative is not."""
    p, q, r, s = a * c, a * d, b * c, b * d
    low, high = min(min(p, q), min(r, s)), max(max(p, q), max(r, s))
    low, high = low - (abs(low) * UNIT + TINY), high + (abs(high) * UNIT + TINY)
    low = 0.0 if (((a >= 0.0) & (c >= 0.0)) | ((b <= 0.0) & (d <= 0.0))) & (low < 0.0) else low
    high = 0.0 if (((a >= 0.0) & (d <= 0.0)) | ((b <= 0.0) & (c >= 0.0))) & (high > 0.0) else high
    zero = ((a == 0.0) & (b == 0.0)) | ((c == 0.0) & (d == 0.0))
    low, high = (0.0 if zero else low), (0.0 if zero else high)
    told = (p + q + r + s == p + q + r + s) & (low == low) & (high == high)
    return (low if told | zero else -INF), (high if told | zero else INF)


@njit(**INLINE)
def _whole(x, k):
    """x^k for a whole k ≥ 0, by squaring: good to k - 1 roundings."""
    result = 1.0
    while k > 0:
        if k & 1:
            result *= x
        x *= x
        k >>= 1
    return result


@njit(**INLINE)
def _power(a, b, k):
    """[a, b]^k for a whole k ≥ 0."""
    if k == 0:
        return 1.0, 1.0
    part = (k + 1) * UNIT
    p, q = _whole(a, k), _whole(b, k)
    if k % 2 == 1:
        low, high = _down(p, part), _up(q, part)
        return (0.0 if a >= 0.0 and low < 0.0 else low), (0.0 if b <= 0.0 and high > 0.0 else high)
    high = _up(max(p, q), part)
    if a <= 0.0 <= b:
        return 0.0, high
    return max(0.0, _down(min(p, q), part)), high


@njit(**INLINE)
def _inverse(a, b):
    """1/[a, b]; the whole line where 0 is inside, half of it where 0 is an end."""
    if a > 0.0 or b < 0.0:
        return _down(1.0 / b, UNIT), _up(1.0 / a, UNIT)
    if a == 0.0 and b > 0.0:
        return _down(1.0 / b, UNIT), INF
    if b == 0.0 and a < 0.0:
        return -INF, _up(1.0 / a, UNIT)
    return -INF, INF


@njit(**INLINE)
def _signed_power(a, b, k):
    """[a, b]^k for any whole k; a state that is POLE where k < 0 and 0 is inside."""
    if k >= 0:
        low, high = _power(a, b, k)
        return low, high, SOUND
    c, d = _power(a, b, -k)
    if a <= 0.0 <= b:
        if c >= 0.0:
            c, d = max(0.0, _down(1.0 / d, UNIT)) if d > 0.0 else 0.0, INF
        else:
            c, d = -INF, INF
        return c, d, POLE
    c, d = _inverse(c, d)
    if a > 0.0 or k % 2 == 0:
        c = max(c, 0.0)
    else:
        d = min(d, 0.0)
    return c, d, SOUND


@njit(**INLINE)
def _real_power(a, b, p, q):
    """[a, b]^[p, q] for a ≥ 0: extreme at its corners."""
    low, high = INF, -INF
    for x in (a, b):
        for y in (p, q):
            z = (0.0 if y > 0.0 else INF if y < 0.0 else 1.0) if x == 0.0 else x**y
            low, high = min(low, z), max(high, z)
    return max(0.0, _down(low, LIBRARY)), _up(high, LIBRARY)


@njit(**INLINE)
def _cosine(a, b):
    """Cosine of [a, b]."""
    if not (b - a < 6.28) or abs(a) > 1e12 or abs(b) > 1e12:
        return -1.0, 1.0
    p, q = math.cos(a), math.cos(b)
    low, high = _down(min(p, q), LIBRARY), _up(max(p, q), LIBRARY)
    turn, slack = 0.5 / math.pi, 4.0 * UNIT * (1.0 + abs(a) + abs(b))
    if math.floor(b * turn + slack) >= math.ceil(a * turn - slack):
        high = 1.0
    if math.floor(b * turn - 0.5 + slack) >= math.ceil(a * turn - 0.5 - slack):
        low = -1.0
    return max(low, -1.0), min(high, 1.0)


@njit(**INLINE)
def _sine(a, b):
    """Sine of [a, b]."""
    if not (b - a < 6.28) or abs(a) > 1e12 or abs(b) > 1e12:
        return -1.0, 1.0
    p, q = math.sin(a), math.sin(b)
    low, high = _down(min(p, q), LIBRARY), _up(max(p, q), LIBRARY)
    turn, slack = 0.5 / math.pi, 4.0 * UNIT * (1.0 + abs(a) + abs(b))
    if math.floor(b * turn - 0.25 + slack) >= math.ceil(a * turn - 0.25 - slack):
        high = 1.0
    if math.floor(b * turn - 0.75 + slack) >= math.ceil(a * turn - 0.75 - slack):
        low = -1.0
    return max(low, -1.0), min(high, 1.0)


@njit(**INLINE)
def _rising(p, q):
    """Ends of a function of the C library that rises."""
    return _down(p, LIBRARY), _up(q, LIBRARY)


@njit(**INLINE)
def _scaled(c, a, b):
    return _mul(c, c, a, b)


@njit(**INLINE)
def _tangent(a, b):
    low, high = _cosine(a, b)
    if low <= 0.0 <= high:
        return -INF, INF, POLE
    low, high = _rising(math.tan(a), math.tan(b))
    return low, high, SOUND


@njit(**INLINE)
def _function(code, a, b, p, q):
    """f, f′ and f″/2 on [a, b], six ends, and a state; [p, q] is the exponent of POWER, p the one of WHOLE_POWER."""
    state = SOUND
    if code == WHOLE_POWER:
        k = int(p)
        f, g, state = _signed_power(a, b, k)
        r, s, _ = _signed_power(a, b, k - 1)
        d, e = _scaled(float(k), r, s)
        r, s, _ = _signed_power(a, b, k - 2)
        r, s = _scaled(0.5 * k * (k - 1), r, s)
        if k in (0, 1):
            r, s = 0.0, 0.0
        return f, g, d, e, r, s, state
    if code == POWER:
        if b < 0.0 or (b == 0.0 and p < 0.0):
            return -INF, INF, -INF, INF, -INF, INF, OUTSIDE
        if a < 0.0 or (a == 0.0 and p < 0.0):
            state, a = POLE, max(a, 0.0)
        f, g = _real_power(a, b, p, q)
        m, n = _add(p, q, -1.0, -1.0)
        r, s = _real_power(a, b, m, n)
        d, e = _mul(p, q, r, s)
        t, u = _mul(p, q, m, n)
        m, n = _add(m, n, -1.0, -1.0)
        r, s = _real_power(a, b, m, n)
        r, s = _mul(t, u, r, s)
        return f, g, d, e, 0.5 * r, 0.5 * s, state
    if code == EXP:
        f, g = _rising(math.exp(a), math.exp(b))
        f = max(f, 0.0)
        return f, g, f, g, 0.5 * f, 0.5 * g, state
    if code == SIN:
        f, g = _sine(a, b)
        d, e = _cosine(a, b)
        return f, g, d, e, -0.5 * g, -0.5 * f, state
    if code == COS:
        f, g = _cosine(a, b)
        d, e = _sine(a, b)
        return f, g, -e, -d, -0.5 * g, -0.5 * f, state
    if code == TAN:
        f, g, state = _tangent(a, b)
        if state == POLE:
            return -INF, INF, 1.0, INF, -INF, INF, state
        r, s = _power(f, g, 2)
        d, e = _add(r, s, 1.0, 1.0)
        r, s = _mul(f, g, d, e)
        return f, g, d, e, r, s, state
    if code == LOG:
        if b <= 0.0:
            return -INF, INF, -INF, INF, -INF, INF, OUTSIDE
        if a <= 0.0:
            a, state = 0.0, POLE
        f, g = _rising(math.log(a) if a > 0.0 else -INF, math.log(b))
        d, e = _inverse(a, b)
        r, s = _power(max(d, 0.0), e, 2)
        return f, g, max(d, 0.0), e, -0.5 * s, -0.5 * r, state
    if code in (SINH, COSH):
        f, g = _rising(math.sinh(a), math.sinh(b))
        r, s = math.cosh(a), math.cosh(b)
        d, e = max(1.0, _down(min(r, s), LIBRARY)) if a > 0.0 or b < 0.0 else 1.0, _up(max(r, s), LIBRARY)
        if code == SINH:
            return f, g, d, e, 0.5 * f, 0.5 * g, state
        return d, e, f, g, 0.5 * d, 0.5 * e, state
    if code == TANH:
        f, g = _rising(math.tanh(a), math.tanh(b))
        f, g = max(f, -1.0), min(g, 1.0)
        r, s = math.cosh(a), math.cosh(b)  # 1 - tanh² would lose all where tanh is near 1
        d, e = max(1.0, _down(min(r, s), LIBRARY)) if a > 0.0 or b < 0.0 else 1.0, _up(max(r, s), LIBRARY)
        r, s = _power(d, e, 2)
        d, e = _inverse(r, s)
        d, e = max(d, 0.0), min(e, 1.0)
        r, s = _mul(f, g, -e, -d)
        return f, g, d, e, r, s, state
    if code in (ATAN, ASINH):
        r, s = _power(a, b, 2)
        r, s = _add(r, s, 1.0, 1.0)
        d, e = _inverse(r, s)
        if code == ATAN:
            f, g = _rising(math.atan(a), math.atan(b))
            r, s = _power(d, e, 2)
            r, s = _mul(-b, -a, r, s)
            return f, g, d, e, r, s, state
        f, g = _rising(math.asinh(a), math.asinh(b))
        t, u = _real_power(max(d, 0.0), e, 0.5, 0.5)
        r, s = _mul(max(d, 0.0), e, t, u)
        r, s = _mul(-0.5 * b, -0.5 * a, r, s)
        return f, g, t, u, r, s, state
    if code in (ASIN, ACOS, ATANH):
        if b < -1.0 or a > 1.0:
            return -INF, INF, -INF, INF, -INF, INF, OUTSIDE
        if a < -1.0 or b > 1.0 or (code == ATANH and (a <= -1.0 or b >= 1.0)):
            a, b, state = max(a, -1.0), min(b, 1.0), POLE
        r, s = _power(a, b, 2)
        r, s = _add(-s, -r, 1.0, 1.0)
        d, e = _inverse(max(r, 0.0), max(s, 0.0))
        d = max(d, 0.0)
        if code == ATANH:
            f, g = _rising(math.atanh(a), math.atanh(b))
            r, s = _power(d, e, 2)
            r, s = _mul(a, b, r, s)
            return f, g, d, e, r, s, state
        t, u = _real_power(d, e, 0.5, 0.5)
        r, s = _mul(d, e, t, u)
        r, s = _mul(0.5 * a, 0.5 * b, r, s)
        if code == ASIN:
            f, g = _rising(math.asin(a), math.asin(b))
            return f, g, t, u, r, s, state
        f, g = _rising(math.acos(b), math.acos(a))
        return max(f, 0.0), g, -u, -t, -s, -r, state
    if code == ACOSH:
        if b < 1.0:
            return -INF, INF, -INF, INF, -INF, INF, OUTSIDE
        if a < 1.0:
            a, state = 1.0, POLE
        f, g = _rising(math.acosh(a), math.acosh(b))
        r, s = _power(a, b, 2)
        r, s = _add(r, s, -1.0, -1.0)
        d, e = _inverse(max(r, 0.0), max(s, 0.0))
        t, u = _real_power(max(d, 0.0), e, 0.5, 0.5)
        r, s = _mul(max(d, 0.0), e, t, u)
        r, s = _mul(-0.5 * b, -0.5 * a, r, s)
        return max(f, 0.0), g, t, u, r, s, state
    if code == ERF:
        f, g = _rising(math.erf(a), math.erf(b))
        r, s = _power(a, b, 2)
        d, e = _rising(math.exp(-s), math.exp(-r))
        d, e = _scaled(2.0 / math.sqrt(math.pi), max(d, 0.0), e)
        d, e = _down(d, LIBRARY), _up(e, LIBRARY)
        r, s = _mul(-b, -a, max(d, 0.0), e)
        return f, g, max(d, 0.0), e, r, s, state
    return -INF, INF, -INF, INF, -INF, INF, POLE


BOXES = (int64[:, ::1], int64[::1], float64[:, :, ::1], int64[::1])
ENDS = (float64[:, :, :, ::1], int64[::1])


@njit(void(*BOXES, float64[::1], float64[::1], *ENDS), **OPTIONS)
def curves(tape, outputs, constants, owner, low, high, values, states):
    r"""Enclose functions of one variable with their first two derivatives.

    Parameters
    ----------
    tape : int64 array, shape (operations, 3)
        Rows (code, a, b).
    outputs : int64 array, shape (functions,)
        Rows of the tape that are wanted.
    constants : numpy.ndarray, shape (points, constants, 2)
        Enclosures of what is constant at each point.
    owner : int64 array, shape (boxes,)
        Point of each box.
    low, high : numpy.ndarray, shape (boxes,)
        Ends of the boxes.
    values : numpy.ndarray, shape (boxes, functions, 3, 2)
        Written: ends of f, f′ and f″/2.
    states : int64 array, shape (boxes,)
        Written: SOUND, POLE or OUTSIDE.
    """
    whole_vectors()
    R = np.empty((len(tape), 6, W))
    for first in range(0, owner.size, W):
        lanes = min(W, owner.size - first)
        for lane in range(lanes):
            states[first + lane] = SOUND
        for k in range(len(tape)):
            code, a, b = tape[k, 0], tape[k, 1], tape[k, 2]
            out = R[k]
            if code == VARIABLE:
                for lane in range(lanes):
                    out[0, lane], out[1, lane], out[2, lane], out[3, lane] = (
                        low[first + lane],
                        high[first + lane],
                        1.0,
                        1.0,
                    )
                    out[4, lane], out[5, lane] = 0.0, 0.0
            elif code == CONSTANT:
                for lane in range(lanes):
                    i = owner[first + lane]
                    out[0, lane], out[1, lane], out[2, lane], out[3, lane] = (
                        constants[i, a, 0],
                        constants[i, a, 1],
                        0.0,
                        0.0,
                    )
                    out[4, lane], out[5, lane] = 0.0, 0.0
            elif code == ADD:
                A, B = R[a], R[b]
                for j in range(0, 6, 2):
                    for lane in range(lanes):
                        out[j, lane], out[j + 1, lane] = _add(A[j, lane], A[j + 1, lane], B[j, lane], B[j + 1, lane])
            elif code == MUL and tape[a, 0] == CONSTANT:
                A, B = R[a], R[b]
                for j in range(0, 6, 2):
                    for lane in range(lanes):
                        out[j, lane], out[j + 1, lane] = _mul(A[0, lane], A[1, lane], B[j, lane], B[j + 1, lane])
            elif code == MUL:
                A, B = R[a], R[b]
                for lane in range(lanes):
                    out[0, lane], out[1, lane] = _mul(A[0, lane], A[1, lane], B[0, lane], B[1, lane])
                    p, q = _mul(A[0, lane], A[1, lane], B[2, lane], B[3, lane])
                    r, s = _mul(A[2, lane], A[3, lane], B[0, lane], B[1, lane])
                    out[2, lane], out[3, lane] = _add(p, q, r, s)
                    p, q = _mul(A[0, lane], A[1, lane], B[4, lane], B[5, lane])
                    r, s = _mul(A[4, lane], A[5, lane], B[0, lane], B[1, lane])
                    p, q = _add(p, q, r, s)
                    r, s = _mul(A[2, lane], A[3, lane], B[2, lane], B[3, lane])
                    out[4, lane], out[5, lane] = _add(p, q, r, s)
            else:
                A = R[a]
                for lane in range(lanes):
                    p, q = float(b), float(b)
                    if code == POWER:
                        p, q = R[b, 0, lane], R[b, 1, lane]
                    f, g, d, e, t, u, state = _function(code, A[0, lane], A[1, lane], p, q)
                    states[first + lane] = max(states[first + lane], state)
                    out[0, lane], out[1, lane] = f, g
                    out[2, lane], out[3, lane] = _mul(d, e, A[2, lane], A[3, lane])
                    f, g = _mul(d, e, A[4, lane], A[5, lane])
                    r, s = _power(A[2, lane], A[3, lane], 2)
                    r, s = _mul(t, u, r, s)
                    out[4, lane], out[5, lane] = _add(f, g, r, s)
        for j in range(outputs.size):
            out = R[outputs[j]]
            for lane in range(lanes):
                for i in range(3):
                    values[first + lane, j, i, 0], values[first + lane, j, i, 1] = (
                        out[2 * i, lane],
                        out[2 * i + 1, lane],
                    )


@njit(void(*BOXES, float64[:, ::1], float64[:, ::1], int64, *ENDS), **OPTIONS)
def slopes(tape, outputs, constants, owner, low, high, count, values, states):
    r"""Enclose functions of several variables with their first derivatives by the first ``count`` of them.

    Parameters
    ----------
    tape, outputs, constants, owner
        As of :func:`curves`.
    low, high : numpy.ndarray, shape (boxes, variables)
        Ends of the boxes.
    count : int
        Number of the variables that derivatives are taken by.
    values : numpy.ndarray, shape (boxes, functions, 1 + count, 2)
        Written: ends of f and of each ∂f/∂x_i.
    states : int64 array, shape (boxes,)
        Written: SOUND, POLE or OUTSIDE.
    """
    whole_vectors()
    rows = 2 + 2 * count
    R = np.empty((len(tape), rows, W))
    for first in range(0, owner.size, W):
        lanes = min(W, owner.size - first)
        for lane in range(lanes):
            states[first + lane] = SOUND
        for k in range(len(tape)):
            code, a, b = tape[k, 0], tape[k, 1], tape[k, 2]
            out = R[k]
            if code in (VARIABLE, CONSTANT):
                out[2:] = 0.0
                for lane in range(lanes):
                    if code == VARIABLE:
                        out[0, lane], out[1, lane] = low[first + lane, a], high[first + lane, a]
                        if a < count:
                            out[2 + 2 * a, lane], out[3 + 2 * a, lane] = 1.0, 1.0
                    else:
                        i = owner[first + lane]
                        out[0, lane], out[1, lane] = constants[i, a, 0], constants[i, a, 1]
            elif code == ADD:
                A, B = R[a], R[b]
                for j in range(0, rows, 2):
                    for lane in range(lanes):
                        out[j, lane], out[j + 1, lane] = _add(A[j, lane], A[j + 1, lane], B[j, lane], B[j + 1, lane])
            elif code == MUL and tape[a, 0] == CONSTANT:
                A, B = R[a], R[b]
                for j in range(0, rows, 2):
                    for lane in range(lanes):
                        out[j, lane], out[j + 1, lane] = _mul(A[0, lane], A[1, lane], B[j, lane], B[j + 1, lane])
            elif code == MUL:
                A, B = R[a], R[b]
                for lane in range(lanes):
                    out[0, lane], out[1, lane] = _mul(A[0, lane], A[1, lane], B[0, lane], B[1, lane])
                for j in range(2, rows, 2):
                    for lane in range(lanes):
                        p, q = _mul(A[0, lane], A[1, lane], B[j, lane], B[j + 1, lane])
                        r, s = _mul(A[j, lane], A[j + 1, lane], B[0, lane], B[1, lane])
                        out[j, lane], out[j + 1, lane] = _add(p, q, r, s)
            else:
                A = R[a]
                for lane in range(lanes):
                    p, q = float(b), float(b)
                    if code == POWER:
                        p, q = R[b, 0, lane], R[b, 1, lane]
                    f, g, d, e, _, _, state = _function(code, A[0, lane], A[1, lane], p, q)
                    states[first + lane] = max(states[first + lane], state)
                    out[0, lane], out[1, lane] = f, g
                    for j in range(2, rows, 2):
                        out[j, lane], out[j + 1, lane] = _mul(d, e, A[j, lane], A[j + 1, lane])
        for j in range(outputs.size):
            out = R[outputs[j]]
            for lane in range(lanes):
                for i in range(1 + count):
                    values[first + lane, j, i, 0], values[first + lane, j, i, 1] = (
                        out[2 * i, lane],
                        out[2 * i + 1, lane],
                    )
