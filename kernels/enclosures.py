r"""Enclosures: what a formula can amount to anywhere in a box, with its slopes, in interval arithmetic.

A formula comes as a tape, one row an operation, each an interval :math:`[u]` with its first derivatives:

.. math:: [u][v], \quad [u] + [v], \quad [u]^k, \quad f([u]); \qquad w' = f'(u)\,u'

The exact value at any place of the box lies within the interval: each result of an elementary operation is widened by
:math:`2^{-52}` of itself, twice what rounding to nearest takes, those of the C library's functions by eight times that
(they are good to a unit or two in the last place), and powers by a part a factor. So a sign that an interval shows is
a theorem, as far as the C library keeps to its word. Overflow gives an infinite end, never a number.

No exception is raised; each box has a state: SOUND; POLE, where some part is unbounded, jumps or is defined on a part
of the box only; or OUTSIDE, where it is defined nowhere.

Source: Moore, Kearfott and Cloud, Introduction to Interval Analysis, chapters 2, 5 and 9.
"""

import math

import numpy as np

from kernels import codes
from kernels.codes import OUTSIDE, POLE, SOUND, UNIT, Formulas
from kernels.jit import INNER, OPTIONS, float64, int64, njit, types, void

LIBRARY = 8.0 * UNIT  # of a function of the C library
TINY = 2.3e-308  # what underflow may take
INF = math.inf

FORMULAS = types.NamedTuple((int64[:, ::1], int64[::1], float64[:, ::1]), Formulas)
OF_POINTS = types.NamedTuple((int64[:, ::1], int64[::1], float64[:, :, ::1]), Formulas)
PAIR = types.UniTuple(float64, 2)  # ends of an interval
WITH_SLOPE = types.Tuple((*4 * (float64,), int64))  # ends of f and of f′, and a state


@njit(**INNER)
def _down(x, part):
    y = x - (abs(x) * part + TINY)
    return y if y == y else -INF


@njit(**INNER)
def _up(x, part):
    y = x + (abs(x) * part + TINY)
    return y if y == y else INF


@njit(**OPTIONS)
def _add(a, b, c, d):
    """Return [a, b] + [c, d]; sums lose nothing to underflow, and exact zeros stay."""
    low, high = a + c, b + d
    low, high = low - abs(low) * UNIT, high + abs(high) * UNIT
    return (low if low == low else -INF), (high if high == high else INF)


@njit(**OPTIONS)
def _mul(a, b, c, d):
    """Return [a, b] [c, d]; a product of intervals without negative numbers has none."""
    p, q, r, s = a * c, a * d, b * c, b * d
    low, high = min(min(p, q), min(r, s)), max(max(p, q), max(r, s))
    low, high = low - (abs(low) * UNIT + TINY), high + (abs(high) * UNIT + TINY)
    low = 0.0 if (((a >= 0.0) & (c >= 0.0)) | ((b <= 0.0) & (d <= 0.0))) & (low < 0.0) else low
    high = 0.0 if (((a >= 0.0) & (d <= 0.0)) | ((b <= 0.0) & (c >= 0.0))) & (high > 0.0) else high
    zero = ((a == 0.0) & (b == 0.0)) | ((c == 0.0) & (d == 0.0))
    low, high = (0.0 if zero else low), (0.0 if zero else high)
    is_bounded = (p + q + r + s == p + q + r + s) & (low == low) & (high == high)
    return (low if is_bounded | zero else -INF), (high if is_bounded | zero else INF)


@njit(**INNER)
def _whole(x, k):
    """Return x^k for a whole k ≥ 0, by squaring: good to k - 1 roundings."""
    result = 1.0
    while k > 0:
        if k & 1:
            result *= x
        x *= x
        k >>= 1
    return result


@njit(PAIR(float64, float64, int64), **INNER)
def _power(a, b, k):
    """Return [a, b]^k for a whole k ≥ 0."""
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


@njit(PAIR(float64, float64), **INNER)
def _inverse(a, b):
    """Return 1/[a, b]; the whole line where 0 is inside, half of it where 0 is an end."""
    if a > 0.0 or b < 0.0:
        return _down(1.0 / b, UNIT), _up(1.0 / a, UNIT)
    if a == 0.0 and b > 0.0:
        return _down(1.0 / b, UNIT), INF
    if b == 0.0 and a < 0.0:
        return -INF, _up(1.0 / a, UNIT)
    return -INF, INF


@njit(types.Tuple((float64, float64, int64))(float64, float64, int64), **INNER)
def _signed_power(a, b, k):
    """Return [a, b]^k for any whole k, and a state that is POLE where k < 0 and 0 is inside."""
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


@njit(PAIR(*4 * (float64,)), **INNER)
def _real_power(a, b, p, q):
    """Return [a, b]^[p, q] for a ≥ 0: extreme at its corners."""
    low, high = INF, -INF
    for i in range(2 if a < b else 1):
        for j in range(2 if p < q else 1):
            x, y = (a, b)[i], (p, q)[j]
            z = (0.0 if y > 0.0 else INF if y < 0.0 else 1.0) if x == 0.0 else x**y
            low, high = min(low, z), max(high, z)
    return max(0.0, _down(low, LIBRARY)), _up(high, LIBRARY)


@njit(PAIR(*5 * (float64,)), **INNER)
def _wave(a, b, p, q, top):
    """Enclose cosine or sine on [a, b]: p and q at the ends, 1 at ``top`` turns and -1 half a turn from there."""
    low, high = _down(min(p, q), LIBRARY), _up(max(p, q), LIBRARY)
    turn, slack = 0.5 / math.pi, 4.0 * UNIT * (1.0 + abs(a) + abs(b))
    if math.floor(b * turn - top + slack) >= math.ceil(a * turn - top - slack):
        high = 1.0
    if math.floor(b * turn - (top + 0.5) + slack) >= math.ceil(a * turn - (top + 0.5) - slack):
        low = -1.0
    return max(low, -1.0), min(high, 1.0)


@njit(**INNER)
def _is_far(a, b):
    return not (b - a < 6.28) or abs(a) > 1e12 or abs(b) > 1e12


@njit(PAIR(float64, float64), **INNER)
def _cosine(a, b):
    """Return the cosine of [a, b]; 1 to the last bit at 0, where many equilibria lie."""
    if a == 0.0 == b:
        return 1.0, 1.0
    return (-1.0, 1.0) if _is_far(a, b) else _wave(a, b, math.cos(a), math.cos(b), 0.0)


@njit(PAIR(float64, float64), **INNER)
def _sine(a, b):
    return (-1.0, 1.0) if _is_far(a, b) else _wave(a, b, math.sin(a), math.sin(b), 0.25)


@njit(float64(int64, float64), **INNER)
def _library(code, x):
    """Return a function of the C library at x."""
    if code == codes.EXP:
        return math.exp(x)
    if code == codes.LOG:
        return math.log(x) if x > 0.0 else -INF
    if code == codes.TAN:
        return math.tan(x)
    if code == codes.ASIN:
        return math.asin(x)
    if code == codes.ACOS:
        return math.acos(x)
    if code == codes.ATAN:
        return math.atan(x)
    if code == codes.SINH:
        return math.sinh(x)
    if code == codes.COSH:
        return math.cosh(x)
    if code == codes.TANH:
        return math.tanh(x)
    if code == codes.ASINH:
        return math.asinh(x)
    if code == codes.ACOSH:
        return math.acosh(x)
    if code == codes.ATANH:
        return math.atanh(x)
    return math.erf(x)


@njit(PAIR(int64, float64, float64), **INNER)
def _rising(code, a, b):
    """Enclose a function of the C library that rises from a to b."""
    return _down(_library(code, a), LIBRARY), _up(_library(code, b), LIBRARY)


@njit(PAIR(float64, float64), **INNER)
def _cosh(a, b):
    p, q = math.cosh(a), math.cosh(b)
    least = max(1.0, _down(min(p, q), LIBRARY)) if a > 0.0 or b < 0.0 else 1.0
    return least, _up(max(p, q), LIBRARY)


@njit(WITH_SLOPE(*4 * (float64,)), **INNER)
def _any_power(a, b, p, q):
    state = SOUND
    if b < 0.0 or (b == 0.0 and p < 0.0):
        return -INF, INF, -INF, INF, OUTSIDE
    if a < 0.0 or (a == 0.0 and p < 0.0):
        state, a = POLE, max(a, 0.0)
    f, g = _real_power(a, b, p, q)
    m, n = _add(p, q, -1.0, -1.0)
    r, s = _real_power(a, b, m, n)
    d, e = _mul(p, q, r, s)
    return f, g, d, e, state


@njit(WITH_SLOPE(int64, float64, float64), **INNER)
def _inverse_function(code, a, b):
    """Enclose an inverse of a circular or hyperbolic function: f' = ± 1/(c ± x²), or 1 over its root."""
    state, low, high = SOUND, 1.0 if code == codes.ACOSH else -1.0, INF if code == codes.ACOSH else 1.0
    if code not in (codes.ATAN, codes.ASINH):
        if b < low or a > high:
            return -INF, INF, -INF, INF, OUTSIDE
        if a < low or b > high or (code == codes.ATANH and (a <= low or b >= high)):
            a, b, state = max(a, low), min(b, high), POLE
    r, s = _power(a, b, 2)
    if code in (codes.ASIN, codes.ACOS, codes.ATANH):
        r, s = -s, -r
    one = -1.0 if code == codes.ACOSH else 1.0
    r, s = _add(r, s, one, one)
    d, e = _inverse(max(r, 0.0), max(s, 0.0))
    d = max(d, 0.0)
    if code not in (codes.ATAN, codes.ATANH):
        d, e = _real_power(d, e, 0.5, 0.5)
    if code == codes.ACOS:
        f, g = _rising(codes.ACOS, b, a)
        return max(f, 0.0), g, -e, -d, state
    f, g = _rising(code, a, b)
    return (max(f, 0.0) if code == codes.ACOSH else f), g, d, e, state


@njit(WITH_SLOPE(int64, *4 * (float64,)), **INNER)
def _function(code, a, b, p, q):
    """Enclose f and f′ on [a, b]: four ends, and a state; [p, q] is the exponent of POWER, p the one of WHOLE_POWER."""
    if code == codes.WHOLE_POWER:
        f, g, state = _signed_power(a, b, int(p))
        r, s, _ = _signed_power(a, b, int(p) - 1)
        d, e = _mul(float(int(p)), float(int(p)), r, s)
        return f, g, d, e, state
    if code == codes.POWER:
        return _any_power(a, b, p, q)
    if code in (codes.SIN, codes.COS):
        f, g = _sine(a, b)
        d, e = _cosine(a, b)
        return (f, g, d, e, SOUND) if code == codes.SIN else (d, e, -g, -f, SOUND)
    if code in (codes.SINH, codes.COSH):
        f, g = _rising(codes.SINH, a, b)
        d, e = _cosh(a, b)
        return (f, g, d, e, SOUND) if code == codes.SINH else (d, e, f, g, SOUND)
    if code == codes.LOG:
        if b <= 0.0:
            return -INF, INF, -INF, INF, OUTSIDE
        f, g = _rising(codes.LOG, max(a, 0.0), b)
        d, e = _inverse(max(a, 0.0), b)
        return f, g, max(d, 0.0), e, SOUND if a > 0.0 else POLE
    if code not in (codes.EXP, codes.TAN, codes.TANH, codes.ERF):
        return _inverse_function(code, a, b)
    f, g = _rising(code, a, b)
    if code == codes.EXP:
        f = max(f, 0.0)
        return f, g, f, g, SOUND
    if code == codes.TAN:
        low, high = _cosine(a, b)
        if low <= 0.0 <= high:
            return -INF, INF, 1.0, INF, POLE
        r, s = _power(f, g, 2)
        d, e = _add(r, s, 1.0, 1.0)
        return f, g, d, e, SOUND
    if code == codes.TANH:
        r, s = _cosh(a, b)  # 1 - tanh² would lose all where tanh is near 1
        r, s = _power(r, s, 2)
        d, e = _inverse(r, s)
        return max(f, -1.0), min(g, 1.0), max(d, 0.0), min(e, 1.0), SOUND
    r, s = _power(a, b, 2)
    d, e = _rising(codes.EXP, -s, -r)
    d, e = _mul(2.0 / math.sqrt(math.pi), 2.0 / math.sqrt(math.pi), max(d, 0.0), e)
    return f, g, max(_down(d, LIBRARY), 0.0), _up(e, LIBRARY), SOUND


@njit(int64(FORMULAS, float64[::1], float64[::1], int64, float64[:, ::1], float64[:, :, ::1]), nogil=True, **OPTIONS)
def enclose(F, low, high, count, R, values):
    r"""Enclose functions of several variables in one box, with their first ``count`` partial derivatives.

    Args:
        F (kernels.codes.Formulas): The functions, with the constants of one point.
        low, high (numpy.ndarray, shape (variables,)): Ends of the box.
        R (numpy.ndarray, shape (operations, 2 + 2 count or more)): Scratch.
        values (numpy.ndarray, shape (functions, 1 + count or more, 2)): Written: ends of f and of each ∂f/∂x_i.

    Returns:
        int: SOUND, POLE or OUTSIDE.
    """
    rows, state, tape = 2 + 2 * count, SOUND, F.tape
    for k in range(len(tape)):  # no row of R has a name: to count whoever refers to it would take as long as a sum
        code, a, b = tape[k, 0], tape[k, 1], tape[k, 2]
        if code in (codes.VARIABLE, codes.CONSTANT):
            for j in range(2, rows):
                R[k, j] = 0.0
            if code == codes.VARIABLE:
                R[k, 0], R[k, 1] = low[a], high[a]
                if a < count:
                    R[k, 2 + 2 * a], R[k, 3 + 2 * a] = 1.0, 1.0
            else:
                R[k, 0], R[k, 1] = F.constants[a, 0], F.constants[a, 1]
        elif code == codes.ADD:
            for j in range(0, rows, 2):
                R[k, j], R[k, j + 1] = _add(R[a, j], R[a, j + 1], R[b, j], R[b, j + 1])
        elif code == codes.MUL:
            u, v, x, y = R[a, 0], R[a, 1], R[b, 0], R[b, 1]
            R[k, 0], R[k, 1] = _mul(u, v, x, y)
            for j in range(2, rows, 2):
                if R[a, j] == R[a, j + 1] == R[b, j] == R[b, j + 1] == 0.0:
                    R[k, j], R[k, j + 1] = 0.0, 0.0
                    continue
                p, q = _mul(u, v, R[b, j], R[b, j + 1])
                r, s = _mul(R[a, j], R[a, j + 1], x, y)
                R[k, j], R[k, j + 1] = _add(p, q, r, s)
        else:
            p, q = float(b), float(b)
            if code == codes.POWER:
                p, q = R[b, 0], R[b, 1]
            f, g, d, e, outcome = _function(code, R[a, 0], R[a, 1], p, q)
            state = max(state, outcome)
            R[k, 0], R[k, 1] = f, g
            for j in range(2, rows, 2):
                R[k, j], R[k, j + 1] = _mul(d, e, R[a, j], R[a, j + 1])
    for j in range(F.outputs.size):
        for i in range(1 + count):
            values[j, i, 0], values[j, i, 1] = R[F.outputs[j], 2 * i], R[F.outputs[j], 2 * i + 1]
    return state


@njit(
    void(OF_POINTS, int64[::1], float64[:, ::1], float64[:, ::1], float64[:, :, :, ::1], int64[::1]),
    nogil=True, **OPTIONS,
)  # fmt: skip
def slopes(F, owner, low, high, values, states):
    """Enclose functions, with their constants in many points, in many boxes, shape (boxes, variables).

    ``owner`` is the point of each box; ``values``, shape (boxes, functions, 1 + count, 2), and ``states`` are written,
    as of :func:`enclose`.
    """
    count = values.shape[2] - 1
    R = np.empty((len(F.tape), 2 + 2 * count))
    for k in range(owner.size):
        of_point = Formulas(F.tape, F.outputs, F.constants[owner[k]])
        states[k] = enclose(of_point, low[k], high[k], count, R, values[k])
