r"""All zeros of n functions of n variables in a box, each proved, and what could not be decided.

A box is dropped where a function, or its mean value form :math:`F_i(m) + J_i(X)(X - m)`, cannot be zero. In units of
the box's half-widths, with Y near the inverse of the middle of J(X), Krawczyk's operator

.. math:: K(X) = m - Y F(m) + (I - Y J(X))(X - m)

holds every zero of X: where it lies inside X there is exactly one, where it misses X there is none, and else X is cut
to it or in two. Each row of the mean value form, solved for each variable that it rises or falls with, cuts X too
(Hansen and Sengupta). Rows and columns are scaled by the box itself, so that no unit counts.

X is a little larger than the box that it stands for, so that a zero on a cut is inside one of both. Where K lies inside
X, :math:`x - Y F(x)` is a contraction: it (or Newton's method, where that is better) leads to the zero, and Krawczyk's
operator shows once more how near it is. What cannot be decided is handed back with the reason (kinds of boxes below).

Where constants are ranges, what is excluded is excluded for all points whose constants lie in them: a rough search does
this once for many points, and each point's own begins with what is left.

Source: Moore, Kearfott and Cloud, Introduction to Interval Analysis, chapter 8; Neumaier, Interval Methods for Systems
of Equations, chapter 5.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.codes import BROKEN, FAINT, LEFT, LOST, NARROW, OUTSIDE, OVERFLOW, POLE, SOUND, UNIT, ZERO, Formulas
from kernels.enclosures import FORMULAS, OF_POINTS, enclose
from kernels.jit import INNER, OPTIONS, boolean, float64, int64, njit, types, void

INFLATED = 0.05  # of a box, on each side
CUT = 0.4871  # of a box: zeros at round places are seldom cut through
SHRUNK = 0.6  # of a box's volume: less is looked at again before it is cut in two
ROUNDINGS = 8.0
HIDDEN = 2  # of a box in which F is straight: what is not known of F moves the zero by more than the box
STRAIGHT = 0.9
SLACK = 1.0 + 1e-14
MOST_LEFT = 400  # boxes of a point that cannot be decided
DEPTH = 64  # halvings of a variable
STEPS, WIDENED = 100, 16  # towards a zero; and of the box about it
UNSURE = 1e-6  # of a place's distance from 0: while steps are larger, their roundings shrink as they do


A, B, X, Y, MIDDLE, HALF, SIZE = range(7)  # rows of a box's ends


class Box(NamedTuple):
    """A box with what is known of F in it."""

    #: shape (7, n). A and B, ends of the box that is decided; X and Y, of the box X that the operator is applied to,
    #: its MIDDLE and HALF widths; SIZE, the largest element of each row of J(X) in units of the half-widths.
    ends: np.ndarray
    values: np.ndarray  #: enclosures of F and J in X, shape (n, 1 + n, 2)
    at: np.ndarray  #: those at one place
    linear: np.ndarray  #: F at the middle and J(X) in these units, each row over its size, shape (n, 1 + n, 2)
    u: np.ndarray  #: what is left of X, in half-widths from the middle, shape (n, 2)
    #: the inverse of the middle of J(X), scratch, and that inverse in plain units, shape (3, n, n).
    inverse: np.ndarray
    rows: np.ndarray  #: scratch of the tape
    scratch: np.ndarray  #: vectors of :func:`_refine`, shape (6, n)


class Where(NamedTuple):
    """Where the zeros of points are looked for."""

    bounds: np.ndarray  #: shape (points, 2, n)
    starts: np.ndarray  #: boxes that hold all zeros, shape (starts, 2, n): the bounds, or what a rough search left
    shares: np.ndarray  #: the first of each point's starts, and the one after the last, shape (points, 2)


class Limits(NamedTuple):
    """When a search ends."""

    narrowest: float  #: width of the narrowest boxes, over that of the bounds
    most: int  #: number of boxes that a point may take
    few: int  #: number of its boxes that may be LOST or NARROW
    poles: float  #: width of the widest boxes that are BROKEN, over that of the bounds
    #: only exclude: zeros are not told apart, and a box ends where the constants' ranges move a zero farther than it
    rough: bool


class Boxes(NamedTuple):
    """Results of a search, written by it."""

    records: np.ndarray  #: the point of each record, and ZERO, LOST, NARROW, BROKEN, OVERFLOW or LEFT
    #: shape (records, 2, 2, n): the box in which a zero is alone, and a box about the zero as small as numbers allow;
    #: else a box twice
    boxes: np.ndarray
    #: in: the first point; out: the first that is not finished, and the number of boxes of all that are; shape (2,)
    progress: np.ndarray


BOX = types.NamedTuple(
    (float64[:, ::1], *[float64[:, :, ::1]] * 3, float64[:, ::1], float64[:, :, ::1], float64[:, ::1], float64[:, ::1]),
    Box,
)
WHERE = types.NamedTuple((float64[:, :, ::1], float64[:, :, ::1], int64[:, ::1]), Where)
LIMITS = types.NamedTuple((float64, int64, int64, float64, boolean), Limits)
FOUND = types.NamedTuple((int64[:, ::1], float64[:, :, :, ::1], int64[::1]), Boxes)


@njit(boolean(float64[:, ::1], float64[:, ::1]), **INNER)
def _invert(M, Y):
    """Write the inverse of M, which is overwritten, into Y; return False where there is none."""
    n = len(M)
    for i in range(n):
        for j in range(n):
            Y[i, j] = 1.0 if i == j else 0.0
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(M[i, k]) > abs(M[best, k]):
                best = i
        pivot = M[best, k]
        if not 1e-300 < abs(pivot) < math.inf:
            return False
        for j in range(n):
            M[k, j], M[best, j] = M[best, j] / pivot, M[k, j]
            Y[k, j], Y[best, j] = Y[best, j] / pivot, Y[k, j]
            if best == k:
                M[k, j], Y[k, j] = M[k, j] / pivot, Y[k, j] / pivot
        for i in range(n):
            factor = M[i, k]
            if i != k and factor != 0.0:
                for j in range(n):
                    M[i, j] -= factor * M[k, j]
                    Y[i, j] -= factor * Y[k, j]
    return True


@njit(void(float64[::1], float64[::1]), **INNER)
def _set(target, source):
    """Copy a vector; a slice that is set would cost seconds of compiling, for the check of its shape."""
    for i in range(len(target)):
        target[i] = source[i]


@njit(**INNER)
def _product(a, b, c, d):
    """Return the ends of [a, b] [c, d], but for a rounding."""
    p, q, r, s = a * c, a * d, b * c, b * d
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))


@njit(int64(float64[:, :, ::1]), **INNER)
def _range(values):
    """Return -1 where a row of F has no zero, 1 where one underflows, 2 where one is infinite, 0 else."""
    kind = 0
    for i in range(len(values)):
        low, high = values[i, 0, 0], values[i, 0, 1]
        if low > 0.0 or high < 0.0:
            return -1
        kind = max(kind, 2 if not high - low < math.inf else 1 if low < high and max(-low, high) < FAINT else 0)
    return kind


@njit(int64(FORMULAS, BOX), **INNER)
def _enclosed(F, box):
    """Enclose F and J in X, F at its middle; return the state, OUTSIDE where F has no zero, -1 where it is infinite."""
    n = len(box.u)
    state = enclose(F, box.ends[X], box.ends[Y], n, box.rows, box.values)
    if _range(box.values) < 0:
        return OUTSIDE
    for j in range(n):
        box.ends[MIDDLE, j] = 0.5 * (box.ends[X, j] + box.ends[Y, j])
        box.ends[HALF, j] = SLACK * max(box.ends[Y, j] - box.ends[MIDDLE, j], box.ends[MIDDLE, j] - box.ends[X, j])
        box.u[j, 0], box.u[j, 1] = -1.0, 1.0
    for i in range(n):
        size = 0.0
        for j in range(n):
            size = max(size, max(abs(box.values[i, 1 + j, 0]), abs(box.values[i, 1 + j, 1])) * box.ends[HALF, j])
        box.ends[SIZE, i] = size if size > 0.0 else 1.0
    if state >= POLE:
        return state
    enclose(F, box.ends[MIDDLE], box.ends[MIDDLE], 0, box.rows, box.at)
    for i in range(n):
        size, slopes = box.ends[SIZE, i], box.values[i, 1:]
        box.linear[i, 0, 0], box.linear[i, 0, 1] = box.at[i, 0, 0] / size, box.at[i, 0, 1] / size
        if not (size < math.inf and box.linear[i, 0, 1] - box.linear[i, 0, 0] < math.inf):
            return -1
        for j in range(n):
            c, d = slopes[j, 0] * box.ends[HALF, j] / size, slopes[j, 1] * box.ends[HALF, j] / size
            box.linear[i, 1 + j, 0], box.linear[i, 1 + j, 1] = c - abs(c) * 2.0 * UNIT, d + abs(d) * 2.0 * UNIT
    return state


@njit(boolean(BOX), **INNER)
def _cut_by_rows(box):
    """Cut u by each row of f + A u = 0, solved for each variable; return False where nothing is left."""
    L, u, n = box.linear, box.u, len(box.u)
    for i in range(n):
        low, high = box.linear[i, 0, 0], box.linear[i, 0, 1]
        slack = 4.0 * (n + 1) * UNIT * (max(abs(low), abs(high)) + n)  # rows are of size 1
        for k in range(n):
            p, q = _product(L[i, 1 + k, 0], L[i, 1 + k, 1], u[k, 0], u[k, 1])
            low, high = low + p, high + q
        if low > slack or high < -slack:
            return False
        for j in range(n):
            c, d = L[i, 1 + j, 0], L[i, 1 + j, 1]
            if c > 0.0 or d < 0.0:
                p, q = _product(c, d, u[j, 0], u[j, 1])
                a, b = low - p - slack, high - q + slack
                p, q = min(min(-a / c, -a / d), min(-b / c, -b / d)), max(max(-a / c, -a / d), max(-b / c, -b / d))
                u[j, 0], u[j, 1] = max(u[j, 0], p - abs(p) * 2.0 * UNIT), min(u[j, 1], q + abs(q) * 2.0 * UNIT)
                if u[j, 0] > u[j, 1]:
                    return False
    return True


@njit(int64(BOX), **INNER)
def _cut_by_operator(box):
    """Cut u to K; return 1 where K lies inside X, -1 where nothing is left, HIDDEN or 0 else."""
    L, Y, n = box.linear, box.inverse[0], len(box.u)
    for i in range(n):
        for j in range(n):
            box.inverse[1, i, j] = 0.5 * (L[i, 1 + j, 0] + L[i, 1 + j, 1])
    if not _invert(box.inverse[1], Y):
        return 0
    inside, hidden, straight, few = True, False, True, (n + 8) * UNIT
    for i in range(n):
        center, radius = 0.0, 0.0
        for k in range(n):
            middle = 0.5 * (L[k, 0, 0] + L[k, 0, 1])
            center -= Y[i, k] * middle
            radius += abs(Y[i, k]) * (0.5 * (L[k, 0, 1] - L[k, 0, 0]) + few * abs(middle))
        unknown = radius
        for j in range(n):
            middle, spread, total = 1.0 if i == j else 0.0, 0.0, 1.0
            for k in range(n):
                x = Y[i, k] * 0.5 * (L[k, 1 + j, 0] + L[k, 1 + j, 1])
                middle -= x
                spread += abs(Y[i, k]) * 0.5 * (L[k, 1 + j, 1] - L[k, 1 + j, 0])
                total += abs(x)
            radius += abs(middle) + spread + few * total
        low, high = center - SLACK * radius, center + SLACK * radius
        if not high - low < math.inf:
            return 0
        inside &= low > -1.0 and high < 1.0
        hidden |= unknown > 1.0
        straight &= radius - unknown < STRAIGHT
        box.u[i, 0], box.u[i, 1] = max(box.u[i, 0], low), min(box.u[i, 1], high)
        if box.u[i, 0] > box.u[i, 1]:
            return -1
    return 1 if inside else HIDDEN if hidden and straight else 0


@njit(boolean(BOX), **INNER)
def _is_lost(box):
    """Return whether each row of F changes in X by less than ROUNDINGS roundings of F at the middle."""
    for i in range(len(box.u)):
        total = 0.0
        for j in range(len(box.u)):
            total += max(abs(box.linear[i, 1 + j, 0]), abs(box.linear[i, 1 + j, 1]))
        if not total <= ROUNDINGS * 0.5 * (box.linear[i, 0, 1] - box.linear[i, 0, 0]):
            return False
    return True


@njit(float64(FORMULAS, BOX, float64[::1], float64[::1]), **INNER)
def _residual(F, box, place, step):
    """Write P F(place) over h into step, with J there into ``at``; return its largest element over its own rounding.

    A box may be wide in one variable and narrow in another, so h is no measure of how near the zero is.
    """
    n, most = len(box.u), 0.0
    enclose(F, place, place, n, box.rows, box.at)
    for i in range(n):
        step[i], rounding = 0.0, UNIT * (abs(place[i]) / box.ends[HALF, i] + UNIT)
        for k in range(n):
            scaled = box.inverse[2, i, k] / box.ends[HALF, i]
            step[i] += scaled * 0.5 * (box.at[k, 0, 0] + box.at[k, 0, 1])
            rounding += abs(scaled) * (box.at[k, 0, 1] - box.at[k, 0, 0])
        most = max(most, abs(step[i]) / rounding)
    return most


@njit(boolean(FORMULAS, BOX), **INNER)
def _refine(F, box):
    """Narrow X, which holds one zero, to a box about it as small as numbers allow; False where that fails."""
    n = len(box.u)
    place, step, other = box.scratch[0], box.scratch[1], box.scratch[2]
    low, high, h = box.scratch[3], box.scratch[4], box.scratch[5]
    for one, row in ((place, MIDDLE), (low, X), (high, Y), (h, HALF)):
        _set(one, box.ends[row])
    for i in range(n):
        for k in range(n):
            box.inverse[2, i, k] = box.ends[HALF, i] * box.inverse[0, i, k] / box.ends[SIZE, k]
    size, best = _residual(F, box, place, step), math.inf
    for _ in range(STEPS):
        if size <= UNIT or best <= size < UNSURE / UNIT:
            break
        best = size
        for i in range(n):
            for j in range(n):
                box.inverse[1, i, j] = 0.0
                for k in range(n):
                    slope = 0.5 * (box.at[k, 1 + j, 0] + box.at[k, 1 + j, 1])
                    box.inverse[1, i, j] += box.inverse[2, i, k] * slope * h[j] / h[i]
        inside = _invert(box.inverse[1], box.inverse[0])
        for i in range(n):
            other[i] = place[i]
            for k in range(n):
                other[i] -= h[i] * box.inverse[0, i, k] * step[k]
            inside &= low[i] <= other[i] <= high[i]
            place[i] -= h[i] * step[i]
        size = _residual(F, box, place, step)
        if inside:
            newton = _residual(F, box, other, step)
            if newton < size:
                _set(place, other)
                size = newton
            else:
                size = _residual(F, box, place, step)
    _residual(F, box, place, step)
    for i in range(n):
        step[i] = max(UNIT * abs(place[i]), UNIT * UNIT * (high[i] - low[i]))
        for k in range(n):
            step[i] += abs(box.inverse[2, i, k]) * (box.at[k, 0, 1] - box.at[k, 0, 0])  # what rounding hides
    for _ in range(WIDENED):
        for j in range(n):
            step[j] *= 4.0
            box.ends[X, j], box.ends[Y, j] = place[j] - step[j], place[j] + step[j]
        if _enclosed(F, box) == SOUND and _cut_by_operator(box) == 1:
            return True
    _set(box.ends[X], low)
    _set(box.ends[Y], high)
    return False


@njit(int64(FORMULAS, BOX, boolean, boolean), **INNER)
def _verdict(F, box, narrow, rough):
    """Return the kind of a box, -1 where it holds no zero, -2 where it is to be cut; u holds what is left of X then."""
    state = _enclosed(F, box)
    if state == OUTSIDE:
        return -1
    if _range(box.values) == 1:
        return OVERFLOW
    if state == POLE:
        return BROKEN
    if state == -1:
        if _range(box.at) == 2:
            infinite = True
            for end in (box.ends[A], box.ends[B]):
                enclose(F, end, end, 0, box.rows, box.at)
                infinite &= _range(box.at) == 2
            if infinite:
                return OVERFLOW
        return NARROW if narrow else -2
    if not _cut_by_rows(box):
        return -1
    inside = _cut_by_operator(box)
    if abs(inside) == 1:
        return -1 if inside < 0 else ZERO
    lost = inside == HIDDEN if rough else _is_lost(box)
    return LOST if lost else NARROW if narrow else -2


@njit(float64(BOX, float64[::1]), **INNER)
def _shrink(box, floor):
    """Cut the box to what is left of X; return what is left of its volume, -1 for nothing."""
    volume = 1.0
    for j in range(len(box.u)):
        a, b, blur = box.ends[A, j], box.ends[B, j], 2.0 * UNIT * (abs(box.ends[MIDDLE, j]) + box.ends[HALF, j])
        low = max(a, box.ends[MIDDLE, j] + box.ends[HALF, j] * box.u[j, 0] - blur) if box.u[j, 0] > -1.0 else a
        high = min(b, box.ends[MIDDLE, j] + box.ends[HALF, j] * box.u[j, 1] + blur) if box.u[j, 1] < 1.0 else b
        if low > high:  # what is left lies beside the box that this one stands for
            return -1.0
        more = max(0.0, 0.5 * (floor[j] - (high - low)))
        box.ends[A, j], box.ends[B, j] = max(a, low - more), min(b, high + more)
        volume *= (box.ends[B, j] - box.ends[A, j]) / (b - a) if b > a else 1.0
    return volume


@njit(int64(BOX, float64[:, ::1], float64[::1]), **INNER)
def _axis(box, bounds, floor):
    """Return the variable that F changes most with in the box."""
    axis, best, n = 0, -1.0, len(box.u)
    for j in range(n):
        width, share = box.ends[B, j] - box.ends[A, j], 0.0
        for i in range(n):
            slope = max(abs(box.values[i, 1 + j, 0]), abs(box.values[i, 1 + j, 1]))
            slope *= box.ends[HALF, j] / box.ends[SIZE, i]
            share = max(share, slope if slope < math.inf else 1.0)
        share = (share + 1e-3) * (width / (box.ends[Y, j] - box.ends[X, j]) if box.ends[Y, j] > box.ends[X, j] else 0.0)
        share += 1e-3 * width / (bounds[1, j] - bounds[0, j])
        if width > 2.0 * floor[j] and share > best:
            best, axis = share, j
    return axis


@njit(boolean(BOX, float64[:, ::1], float64[:, ::1], float64, float64[::1]), **INNER)
def _begin(box, start, within, narrowest, floor):
    """Make a box of a start, with X about it; return whether it is as narrow as a box may be."""
    narrow = True
    for j in range(len(floor)):
        a, b = start[0, j], start[1, j]
        box.ends[A, j], box.ends[B, j] = a, b
        floor[j] = max(narrowest * (within[1, j] - within[0, j]), 4.0 * UNIT * max(abs(a), abs(b)))
        box.ends[X, j] = max(a - INFLATED * (b - a), within[0, j])
        box.ends[Y, j] = min(b + INFLATED * (b - a), within[1, j])
        narrow &= b - a <= 2.0 * floor[j]
    return narrow


@njit(float64(BOX, float64[:, ::1]), **INNER)
def _widest(box, within):
    """Return the largest width of the box over that of the bounds."""
    widest = 0.0
    for j in range(len(box.u)):
        widest = max(widest, (box.ends[B, j] - box.ends[A, j]) / (within[1, j] - within[0, j]))
    return widest


@njit(boolean(float64[::1], float64[::1], FOUND, int64, int64, int64), **INNER)
def _is_within(low, high, found, which, begin, end):
    """Return whether low … high lies in a box about one zero, of the records from begin to end; high … low: meets one.

    which: 0 for the box in which the zero is alone, 1 for the one as small as numbers allow.
    """
    for r in range(begin, end):
        inside = found.records[r, 1] == ZERO
        for j in range(len(low)):
            inside &= low[j] >= found.boxes[r, which, 0, j] and high[j] <= found.boxes[r, which, 1, j]
        if inside:
            return True
    return False


@njit(int64(BOX, float64[:, ::1], float64[::1], float64[:, :, ::1], int64), **INNER)
def _cut(box, within, floor, stack, top):
    """Put what is left of a box on the stack, in two parts if that is most of it; return the new top."""
    volume = _shrink(box, floor)
    if volume < 0.0:
        return top
    _set(stack[top, 0], box.ends[A])
    _set(stack[top, 1], box.ends[B])
    if volume <= SHRUNK:
        return top + 1
    axis = _axis(box, within, floor)
    place = box.ends[A, axis] + CUT * (box.ends[B, axis] - box.ends[A, axis])
    _set(stack[top + 1, 0], box.ends[A])
    _set(stack[top + 1, 1], box.ends[B])
    stack[top, 0, axis], stack[top + 1, 1, axis] = place, place
    return top + 2


@njit(int64(OF_POINTS, WHERE, LIMITS, FOUND), nogil=True, **OPTIONS)
def search(functions, where, limits, boxes_found):
    """Find all zeros of points, one after the other, until the records are full; return the number of records.

    Functions hold the constants of all points, and are as many as the variables; ``boxes_found`` is written.
    """
    records, boxes, progress = boxes_found
    n, count, room = functions.outputs.size, 0, 0
    for point in range(len(where.shares)):
        room = max(room, DEPTH * n + 1 + where.shares[point, 1] - where.shares[point, 0])
    stack, floor, near = np.empty((room, 2, n)), np.empty(n), np.empty((2, n))
    values, at, linear = np.empty((n, 1 + n, 2)), np.empty((n, 1 + n, 2)), np.empty((n, 1 + n, 2))
    rows, inverse, scratch = np.empty((len(functions.tape), 2 + 2 * n)), np.empty((3, n, n)), np.empty((6, n))
    box = Box(np.empty((7, n)), values, at, linear, np.empty((n, 2)), inverse, rows, scratch)
    for point in range(progress[0], len(where.bounds)):
        F, within = Formulas(functions.tape, functions.outputs, functions.constants[point]), where.bounds[point]
        begin, used, undecided, few, top = count, 0, 0, 0, 0
        for start in range(where.shares[point, 0], where.shares[point, 1]):
            for k in range(2):
                _set(stack[top, k], where.starts[start, k])
            top += 1
        while top > 0:
            top, used = top - 1, used + 1
            narrow = _begin(box, stack[top], within, limits.narrowest, floor)
            if _is_within(box.ends[A], box.ends[B], boxes_found, 0, begin, count):
                continue
            if used > limits.most or undecided > MOST_LEFT or few > limits.few or top + 2 > room:
                kind = LEFT
            else:
                kind = _verdict(F, box, narrow, limits.rough)
            if kind == BROKEN and not narrow and _widest(box, within) > limits.poles:
                kind = -2
            if limits.rough and kind in (ZERO, LOST):
                kind = NARROW if _shrink(box, floor) >= 0.0 else -1
            if kind == ZERO:
                _set(near[0], box.ends[X])
                _set(near[1], box.ends[Y])
                if not _refine(F, box):  # the zero is far from the middle: a smaller box will do
                    kind = NARROW if narrow else -2
                    _enclosed(F, box)
            if kind == -2:
                top = _cut(box, within, floor, stack, top)
            if kind < 0 or (kind == ZERO and _is_within(box.ends[Y], box.ends[X], boxes_found, 1, begin, count)):
                continue
            if count == len(records):
                progress[0] = point
                return begin
            undecided += kind != ZERO and kind != LEFT
            few += kind in (LOST, NARROW)
            for k in range(2):
                _set(boxes[count, 0, k], near[k] if kind == ZERO else box.ends[A + k])
                _set(boxes[count, 1, k], box.ends[X + k] if kind == ZERO else box.ends[A + k])
            records[count, 0], records[count, 1] = point, kind
            count += 1
        progress[1] += used
    progress[0] = len(where.bounds)
    return count
