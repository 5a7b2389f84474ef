r"""Enclosures of the values and derivatives of a formula over a box, in interval arithmetic.

A formula is a tape with one row per operation. Each row is an interval :math:`[u]` with its first derivatives:

.. math:: [u][v], \quad [u] + [v], \quad [u]^k, \quad f([u]); \qquad w' = f'(u)\,u'

The exact value at any point of the box is within the interval: each result of an elementary operation is widened by
:math:`2^{-52}` of itself, twice the error of rounding to nearest, those of the C library's functions by eight times
that (they are correct to a unit or two in the last place), and powers by a rounding per factor. So the sign of an
interval is proved, provided that the C library is as accurate as it claims. Overflow gives an infinite end.

No exception is raised; each box has a state: REGULAR; POLE, if an operation is unbounded, jumps or is undefined in a
subset of the box; or OUTSIDE, if it is defined nowhere.

Source: Moore, Kearfott and Cloud, Introduction to Interval Analysis, chapters 2, 5 and 9.
"""

import math

import numpy as np

from kernels.compile.jit import INNER, OPTIONS, float64, int64, njit, types, void
from kernels.search import codes
from kernels.search.codes import OUTSIDE, POLE, REGULAR, UNIT, Formulas

LIBRARY_ERROR = 8.0 * UNIT  # bound on the relative error of the C library's functions, four times their usual error
MIN_NORMAL = 2.3e-308  # bound on the absolute error by underflow: above the smallest normal double
INF = math.inf

FORMULAS = types.NamedTuple((int64[:, ::1], int64[::1], float64[:, ::1]), Formulas)
FORMULAS_OF_POINTS = types.NamedTuple((int64[:, ::1], int64[::1], float64[:, :, ::1]), Formulas)
PAIR = types.UniTuple(float64, 2)  # ends of an interval
WITH_SLOPE = types.Tuple((*4 * (float64,), int64))  # ends of f and of f′, and a state


@njit(**INNER)
def _round_down(x, relative):
    y = x - (abs(x) * relative + MIN_NORMAL)
    return y if y == y else -INF


@njit(**INNER)
def _round_up(x, relative):
    y = x + (abs(x) * relative + MIN_NORMAL)
    return y if y == y else INF


@njit(**OPTIONS)
def _interval_sum(a, b, c, d):
    """Return [a, b] + [c, d]; sums do not underflow, and exact zeros stay."""
    low, high = a + c, b + d
    low, high = low - abs(low) * UNIT, high + abs(high) * UNIT
    return (low if low == low else -INF), (high if high == high else INF)


@njit(**OPTIONS)
def _interval_product(a, b, c, d):
    """Return [a, b] [c, d]; the product of two nonnegative intervals is nonnegative."""
    p, q, r, s = a * c, a * d, b * c, b * d
    low, high = min(min(p, q), min(r, s)), max(max(p, q), max(r, s))
    low, high = low - (abs(low) * UNIT + MIN_NORMAL), high + (abs(high) * UNIT + MIN_NORMAL)
    low = 0.0 if (((a >= 0.0) & (c >= 0.0)) | ((b <= 0.0) & (d <= 0.0))) & (low < 0.0) else low
    high = 0.0 if (((a >= 0.0) & (d <= 0.0)) | ((b <= 0.0) & (c >= 0.0))) & (high > 0.0) else high
    zero = ((a == 0.0) & (b == 0.0)) | ((c == 0.0) & (d == 0.0))
    low, high = (0.0 if zero else low), (0.0 if zero else high)
    is_bounded = (p + q + r + s == p + q + r + s) & (low == low) & (high == high)
    return (low if is_bounded | zero else -INF), (high if is_bounded | zero else INF)


@njit(**INNER)
def _whole_power(x, k):
    """Return x^k for an integer k ≥ 0, by squaring: to k - 1 roundings."""
    result = 1.0
    while k > 0:
        if k & 1:
            result *= x
        x *= x
        k >>= 1
    return result


@njit(PAIR(float64, float64, int64), **INNER)
def _interval_power(a, b, k):
    """Return [a, b]^k for an integer k ≥ 0."""
    if k == 0:
        return 1.0, 1.0
    relative = (k + 1) * UNIT
    p, q = _whole_power(a, k), _whole_power(b, k)
    if k % 2 == 1:
        low, high = _round_down(p, relative), _round_up(q, relative)
        return (0.0 if a >= 0.0 and low < 0.0 else low), (0.0 if b <= 0.0 and high > 0.0 else high)
    high = _round_up(max(p, q), relative)
    if a <= 0.0 <= b:
        return 0.0, high
    return max(0.0, _round_down(min(p, q), relative)), high


@njit(PAIR(float64, float64), **INNER)
def _interval_inverse(a, b):
    """Return 1/[a, b]: the whole line if 0 is inside, half of it if 0 is an end."""
    if a > 0.0 or b < 0.0:
        return _round_down(1.0 / b, UNIT), _round_up(1.0 / a, UNIT)
    if a == 0.0 and b > 0.0:
        return _round_down(1.0 / b, UNIT), INF
    if b == 0.0 and a < 0.0:
        return -INF, _round_up(1.0 / a, UNIT)
    return -INF, INF


@njit(types.Tuple((float64, float64, int64))(float64, float64, int64), **INNER)
def _signed_power(a, b, k):
    """Return [a, b]^k for any integer k, and a state, POLE if k < 0 and 0 is inside."""
    if k >= 0:
        low, high = _interval_power(a, b, k)
        return low, high, REGULAR
    c, d = _interval_power(a, b, -k)
    if a <= 0.0 <= b:
        if c >= 0.0:
            c, d = max(0.0, _round_down(1.0 / d, UNIT)) if d > 0.0 else 0.0, INF
        else:
            c, d = -INF, INF
        return c, d, POLE
    c, d = _interval_inverse(c, d)
    if a > 0.0 or k % 2 == 0:
        c = max(c, 0.0)
    else:
        d = min(d, 0.0)
    return c, d, REGULAR


@njit(PAIR(*4 * (float64,)), **INNER)
def _real_power(a, b, p, q):
    """Return [a, b]^[p, q] for a ≥ 0, which has its extremes at the corners."""
    low, high = INF, -INF
    for i in range(2 if a < b else 1):
        for j in range(2 if p < q else 1):
            x, y = (a, b)[i], (p, q)[j]
            z = (0.0 if y > 0.0 else INF if y < 0.0 else 1.0) if x == 0.0 else x**y
            low, high = min(low, z), max(high, z)
    return max(0.0, _round_down(low, LIBRARY_ERROR)), _round_up(high, LIBRARY_ERROR)


@njit(PAIR(*5 * (float64,)), **INNER)
def _circular_range(a, b, p, q, maximum):
    """Enclose cosine or sine on [a, b]: p and q at the ends, 1 at ``maximum`` turns and -1 half a turn from there."""
    low, high = _round_down(min(p, q), LIBRARY_ERROR), _round_up(max(p, q), LIBRARY_ERROR)
    per_turn, slack = 0.5 / math.pi, 4.0 * UNIT * (1.0 + abs(a) + abs(b))
    if math.floor(b * per_turn - maximum + slack) >= math.ceil(a * per_turn - maximum - slack):
        high = 1.0
    if math.floor(b * per_turn - (maximum + 0.5) + slack) >= math.ceil(a * per_turn - (maximum + 0.5) - slack):
        low = -1.0
    return max(low, -1.0), min(high, 1.0)


@njit(**INNER)
def _is_far(a, b):
    return not (b - a < 6.28) or abs(a) > 1e12 or abs(b) > 1e12


@njit(PAIR(float64, float64), **INNER)
def _cosine_range(a, b):
    """Return the cosine of [a, b]; exactly 1 at 0, the place of many equilibria."""
    if a == 0.0 == b:
        return 1.0, 1.0
    return (-1.0, 1.0) if _is_far(a, b) else _circular_range(a, b, math.cos(a), math.cos(b), 0.0)


@njit(PAIR(float64, float64), **INNER)
def _sine_range(a, b):
    return (-1.0, 1.0) if _is_far(a, b) else _circular_range(a, b, math.sin(a), math.sin(b), 0.25)


@njit(float64(int64, float64), **INNER)
def _library_value(code, x):
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
def _rising_range(code, a, b):
    """Enclose an increasing function of the C library on [a, b]."""
    return _round_down(_library_value(code, a), LIBRARY_ERROR), _round_up(_library_value(code, b), LIBRARY_ERROR)


@njit(PAIR(float64, float64), **INNER)
def _cosh_range(a, b):
    p, q = math.cosh(a), math.cosh(b)
    low = max(1.0, _round_down(min(p, q), LIBRARY_ERROR)) if a > 0.0 or b < 0.0 else 1.0
    return low, _round_up(max(p, q), LIBRARY_ERROR)


@njit(WITH_SLOPE(*4 * (float64,)), **INNER)
def _power_range(a, b, p, q):
    """Enclose x^y and its slope y x^(y-1) for x in [a, b] and y in [p, q]."""
    state = REGULAR
    if b < 0.0 or (b == 0.0 and p < 0.0):
        return -INF, INF, -INF, INF, OUTSIDE
    if a < 0.0 or (a == 0.0 and p < 0.0):
        state, a = POLE, max(a, 0.0)
    f, g = _real_power(a, b, p, q)
    m, n = _interval_sum(p, q, -1.0, -1.0)
    r, s = _real_power(a, b, m, n)
    d, e = _interval_product(p, q, r, s)
    return f, g, d, e, state


@njit(WITH_SLOPE(int64, float64, float64), **INNER)
def _inverse_range(code, a, b):
    """Enclose an inverse of a circular or hyperbolic function: f' = ± 1/(c ± x²), or 1 over its root."""
    state, low, high = REGULAR, 1.0 if code == codes.ACOSH else -1.0, INF if code == codes.ACOSH else 1.0
    if code not in (codes.ATAN, codes.ASINH):
        if b < low or a > high:
            return -INF, INF, -INF, INF, OUTSIDE
        if a < low or b > high or (code == codes.ATANH and (a <= low or b >= high)):
            a, b, state = max(a, low), min(b, high), POLE
    r, s = _interval_power(a, b, 2)
    if code in (codes.ASIN, codes.ACOS, codes.ATANH):
        r, s = -s, -r
    sign = -1.0 if code == codes.ACOSH else 1.0
    r, s = _interval_sum(r, s, sign, sign)
    d, e = _interval_inverse(max(r, 0.0), max(s, 0.0))
    d = max(d, 0.0)
    if code not in (codes.ATAN, codes.ATANH):
        d, e = _real_power(d, e, 0.5, 0.5)
    if code == codes.ACOS:
        f, g = _rising_range(codes.ACOS, b, a)
        return max(f, 0.0), g, -e, -d, state
    f, g = _rising_range(code, a, b)
    return (max(f, 0.0) if code == codes.ACOSH else f), g, d, e, state


@njit(WITH_SLOPE(int64, *4 * (float64,)), **INNER)
def _function_range(code, a, b, p, q):
    """Return four ends of f and f′ on [a, b], and a state; [p, q] is the exponent of POWER, p that of WHOLE_POWER."""
    if code == codes.WHOLE_POWER:
        f, g, state = _signed_power(a, b, int(p))
        r, s, _ = _signed_power(a, b, int(p) - 1)
        d, e = _interval_product(float(int(p)), float(int(p)), r, s)
        return f, g, d, e, state
    if code == codes.POWER:
        return _power_range(a, b, p, q)
    if code in (codes.SIN, codes.COS):
        f, g = _sine_range(a, b)
        d, e = _cosine_range(a, b)
        return (f, g, d, e, REGULAR) if code == codes.SIN else (d, e, -g, -f, REGULAR)
    if code in (codes.SINH, codes.COSH):
        f, g = _rising_range(codes.SINH, a, b)
        d, e = _cosh_range(a, b)
        return (f, g, d, e, REGULAR) if code == codes.SINH else (d, e, f, g, REGULAR)
    if code == codes.LOG:
        if b <= 0.0:
            return -INF, INF, -INF, INF, OUTSIDE
        f, g = _rising_range(codes.LOG, max(a, 0.0), b)
        d, e = _interval_inverse(max(a, 0.0), b)
        return f, g, max(d, 0.0), e, REGULAR if a > 0.0 else POLE
    if code not in (codes.EXP, codes.TAN, codes.TANH, codes.ERF):
        return _inverse_range(code, a, b)
    f, g = _rising_range(code, a, b)
    if code == codes.EXP:
        f = max(f, 0.0)
        return f, g, f, g, REGULAR
    if code == codes.TAN:
        low, high = _cosine_range(a, b)
        if low <= 0.0 <= high:
            return -INF, INF, 1.0, INF, POLE
        r, s = _interval_power(f, g, 2)
        d, e = _interval_sum(r, s, 1.0, 1.0)
        return f, g, d, e, REGULAR
    if code == codes.TANH:
        r, s = _cosh_range(a, b)  # 1 - tanh² would cancel if tanh is near 1
        r, s = _interval_power(r, s, 2)
        d, e = _interval_inverse(r, s)
        return max(f, -1.0), min(g, 1.0), max(d, 0.0), min(e, 1.0), REGULAR
    r, s = _interval_power(a, b, 2)
    d, e = _rising_range(codes.EXP, -s, -r)
    d, e = _interval_product(2.0 / math.sqrt(math.pi), 2.0 / math.sqrt(math.pi), max(d, 0.0), e)
    return f, g, max(_round_down(d, LIBRARY_ERROR), 0.0), _round_up(e, LIBRARY_ERROR), REGULAR


@njit(int64(FORMULAS, float64[::1], float64[::1], int64, float64[:, ::1], float64[:, :, ::1]), nogil=True, **OPTIONS)
def enclose(F, low, high, count, R, values):
    r"""Enclose functions of several variables in one box, with their first ``count`` partial derivatives.

    Args:
        `F` (kernels.search.codes.Formulas): The functions, with the constants of one point.
        low, high (numpy.ndarray, shape (variables,)): Ends of the box.
        `R` (numpy.ndarray, shape (operations, 2 + 2 count or more)): Scratch.
        values (numpy.ndarray, shape (functions, 1 + count or more, 2)): Written: ends of f and of each ∂f/∂x_i.

    Returns:
        int: REGULAR, POLE or OUTSIDE.
    """
    size, state, tape = 2 + 2 * count, REGULAR, F.tape
    for k in range(len(tape)):  # no row of R has a name: counting its references would take as long as a sum
        code, a, b = tape[k, 0], tape[k, 1], tape[k, 2]
        if code in (codes.VARIABLE, codes.CONSTANT):
            for j in range(2, size):
                R[k, j] = 0.0
            if code == codes.VARIABLE:
                R[k, 0], R[k, 1] = low[a], high[a]
                if a < count:
                    R[k, 2 + 2 * a], R[k, 3 + 2 * a] = 1.0, 1.0
            else:
                R[k, 0], R[k, 1] = F.constants[a, 0], F.constants[a, 1]
        elif code == codes.ADD:
            for j in range(0, size, 2):
                R[k, j], R[k, j + 1] = _interval_sum(R[a, j], R[a, j + 1], R[b, j], R[b, j + 1])
        elif code == codes.MUL:
            u, v, x, y = R[a, 0], R[a, 1], R[b, 0], R[b, 1]
            R[k, 0], R[k, 1] = _interval_product(u, v, x, y)
            for j in range(2, size, 2):
                if R[a, j] == R[a, j + 1] == R[b, j] == R[b, j + 1] == 0.0:
                    R[k, j], R[k, j + 1] = 0.0, 0.0
                    continue
                p, q = _interval_product(u, v, R[b, j], R[b, j + 1])
                r, s = _interval_product(R[a, j], R[a, j + 1], x, y)
                R[k, j], R[k, j + 1] = _interval_sum(p, q, r, s)
        else:
            p, q = float(b), float(b)
            if code == codes.POWER:
                p, q = R[b, 0], R[b, 1]
            f, g, d, e, outcome = _function_range(code, R[a, 0], R[a, 1], p, q)
            state = max(state, outcome)
            R[k, 0], R[k, 1] = f, g
            for j in range(2, size, 2):
                R[k, j], R[k, j + 1] = _interval_product(d, e, R[a, j], R[a, j + 1])
    for j in range(F.outputs.size):
        for i in range(1 + count):
            values[j, i, 0], values[j, i, 1] = R[F.outputs[j], 2 * i], R[F.outputs[j], 2 * i + 1]
    return state


@njit(
    void(FORMULAS_OF_POINTS, int64[::1], float64[:, ::1], float64[:, ::1], float64[:, :, :, ::1], int64[::1]),
    nogil=True, **OPTIONS,
)  # fmt: skip
def enclose_boxes(F, point_index, low, high, values, states):
    """Enclose functions in many boxes, each with the constants of its point.

    Args:
        `F` (kernels.search.codes.Formulas): The functions, with the constants of all points.
        point_index (numpy.ndarray, shape (boxes,)): Point of each box.
        low, high (numpy.ndarray, shape (boxes, variables)): Ends of the boxes.
        values (numpy.ndarray, shape (boxes, functions, 1 + count, 2)): Written, as by :func:`enclose`.
        states (numpy.ndarray, shape (boxes,)): Written: REGULAR, POLE or OUTSIDE.
    """
    count = values.shape[2] - 1
    R = np.empty((len(F.tape), 2 + 2 * count))
    for k in range(point_index.size):
        formulas = Formulas(F.tape, F.outputs, F.constants[point_index[k]])
        states[k] = enclose(formulas, low[k], high[k], count, R, values[k])
