r"""All zeros of n functions of n variables in a box, each proved, and the boxes that could not be decided.

A box is dropped if a function, or its mean value form :math:`F_i(m) + J_i(X)(X - m)`, cannot be zero. In units of
the box's half-widths, with Y near the inverse of the middle of J(X), Krawczyk's operator

.. math:: K(X) = m - Y F(m) + (I - Y J(X))(X - m)

contains every zero of X: if it is inside X there is exactly one, if it is disjoint from X there is none, and else X is
reduced to it or split in two. Each row of the mean value form, solved for each variable in which it is monotonic,
reduces X too (Hansen and Sengupta). Rows and columns are scaled by the box itself, so results do not depend on units.

X is a little larger than the box to be decided, so that a zero on a cut is interior to a box. If K is
inside X, :math:`x - Y F(x)` is a contraction: it (or Newton's method, if that is better) converges to the zero, and
Krawczyk's operator then bounds its distance. A box that cannot be decided is returned with the reason (see
kernels.search.codes).

If constants are ranges, a box is excluded for all points with constants in these ranges: a first search that only
excludes does this once for many points, and the search of each point begins with the remaining boxes.

Source: Moore, Kearfott and Cloud, Introduction to Interval Analysis, chapter 8; Neumaier, Interval Methods for Systems
of Equations, chapter 5.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.compile.jit import INNER, OPTIONS, boolean, float64, int64, njit, types, void
from kernels.search import codes
from kernels.search.codes import UNIT, Formulas
from kernels.search.enclosures import FORMULAS, FORMULAS_OF_POINTS, enclose

INFLATION = 0.05  # X extends beyond its box by this fraction of the box's width on each side
SPLIT_FRACTION = 0.4871  # a box is split at this fraction of its width, which zeros at round numbers seldom hit
MAX_SHRUNK_VOLUME = 0.6  # a box that shrank to at most this fraction of its volume is examined again, not split
MIN_CHANGE = 8.0  # F must change across X by more than this number of its roundings, else it decides nothing
MAX_NONLINEARITY = 0.9  # F is nearly linear if its slopes' spread moves K by less than this many half-widths
WIDENING = 1.0 + 1e-14  # widens radii by more than the rounding of the sums that they are computed from
MAX_UNDECIDED = 400  # undecided boxes of a point, after which its remaining boxes are not examined
MAX_HALVINGS = 64  # halvings of one variable, which bound the size of the stack
MAX_REFINEMENTS, MAX_WIDENINGS = 100, 16  # iterations towards a zero; enlargements of the box about it by 4
CONTRACTION_LIMIT = 1e-6  # a step that does not contract ends the iteration if its relative size is below this limit

A, B, X, Y, MIDDLE, HALF, SIZE = range(7)  # rows of a box's ends

# Results of _classify_box in addition to the kinds of boxes: the box contains no zero; it must be split.
NO_ZERO, SPLIT = -1, -2
INFINITE_STATE = -1  # Result of _enclose_box in addition to the states: F is infinite at the middle, or J in X.
# Results of _range_kind: a row of F excludes zero; all rows are normal; a row may underflow; a row is infinite.
EXCLUDES_ZERO, NORMAL, MAY_UNDERFLOW, INFINITE = -1, 0, 1, 2
# Results of _cut_by_operator: K and X are disjoint; nothing is decided; K is inside X, with exactly one zero; F is
# nearly linear in X, and its error moves the zero out of X.
DISJOINT, UNDECIDED, INSIDE, SHIFT_EXCEEDS_BOX = -1, 0, 1, 2


class Box(NamedTuple):
    """A box, and the enclosures of F and its Jacobian J in it."""

    #: shape (7, n). A and B, ends of the box to be decided; X and Y, ends of the box X that the operator is applied to,
    #: its MIDDLE and HALF widths; SIZE, the largest element of each row of J(X) in units of the half-widths.
    ends: np.ndarray
    values: np.ndarray  #: enclosures of F and J in X, shape (n, 1 + n, 2)
    at_point: np.ndarray  #: enclosures of F and J at one point, shape (n, 1 + n, 2)
    linear: np.ndarray  #: F at the middle and J(X) in these units, each row over its size, shape (n, 1 + n, 2)
    u: np.ndarray  #: remaining part u of X, in half-widths from the middle, shape (n, 2)
    #: the inverse of the middle of J(X), scratch, and that inverse in plain units, shape (3, n, n).
    inverse: np.ndarray
    rows: np.ndarray  #: scratch of the tape
    scratch: np.ndarray  #: vectors of :func:`_refine`, shape (6, n)


class SearchRegions(NamedTuple):
    """Boxes in which the zeros of points are searched."""

    bounds: np.ndarray  #: shape (points, 2, n)
    start_boxes: np.ndarray  #: cover of all zeros, shape (boxes, 2, n): the bounds, or remainders of a first search
    ranges: np.ndarray  #: index of each point's first start box, and of its last plus one, shape (points, 2)


class Limits(NamedTuple):
    """Limits at which a search ends."""

    min_width: float  #: width of the narrowest boxes, over that of the bounds
    max_boxes: int  #: maximum number of boxes examined for a point
    max_narrow: int  #: maximum number of its boxes that are ROUNDING_LIMITED or AT_MIN_WIDTH
    max_pole_width: float  #: width of the widest boxes with CONTAINS_POLE, over that of the bounds
    #: zeros are not separated, and a box ends if the constants' ranges move a zero by more than its width
    only_excludes: bool


class Boxes(NamedTuple):
    """Results that a search writes."""

    records: np.ndarray  #: the point of each record, and its kind of box (see kernels.search.codes), shape (records, 2)
    #: shape (records, 2, 2, n): a box with exactly one zero, and the narrowest box about the zero that could be proved;
    #: for all kinds but UNIQUE_ZERO, the same box twice
    boxes: np.ndarray
    #: in: the first point; out: the first unfinished point, and the number of boxes of the finished points; shape (2,)
    progress: np.ndarray


BOX = types.NamedTuple(
    (float64[:, ::1], *[float64[:, :, ::1]] * 3, float64[:, ::1], float64[:, :, ::1], float64[:, ::1], float64[:, ::1]),
    Box,
)
SEARCH_REGIONS = types.NamedTuple((float64[:, :, ::1], float64[:, :, ::1], int64[:, ::1]), SearchRegions)
LIMITS = types.NamedTuple((float64, int64, int64, float64, boolean), Limits)
BOXES = types.NamedTuple((int64[:, ::1], float64[:, :, :, ::1], int64[::1]), Boxes)


@njit(boolean(float64[:, ::1], float64[:, ::1]), **INNER)
def _invert_matrix(M, Y):
    """Write the inverse of M, which is overwritten, into Y; return False if M is singular."""
    n = len(M)
    for i in range(n):
        for j in range(n):
            Y[i, j] = 1.0 if i == j else 0.0
    for k in range(n):
        pivot_row = k
        for i in range(k + 1, n):
            if abs(M[i, k]) > abs(M[pivot_row, k]):
                pivot_row = i
        pivot = M[pivot_row, k]
        if not 1e-300 < abs(pivot) < math.inf:
            return False
        for j in range(n):
            M[k, j], M[pivot_row, j] = M[pivot_row, j] / pivot, M[k, j]
            Y[k, j], Y[pivot_row, j] = Y[pivot_row, j] / pivot, Y[k, j]
            if pivot_row == k:
                M[k, j], Y[k, j] = M[k, j] / pivot, Y[k, j] / pivot
        for i in range(n):
            factor = M[i, k]
            if i != k and factor != 0.0:
                for j in range(n):
                    M[i, j] -= factor * M[k, j]
                    Y[i, j] -= factor * Y[k, j]
    return True


@njit(void(float64[::1], float64[::1]), **INNER)
def _copy_vector(target, source):
    """Copy a vector; assigning to a slice would take seconds to compile, for the check of its shape."""
    for i in range(len(target)):
        target[i] = source[i]


@njit(**INNER)
def _interval_product(a, b, c, d):
    """Return the ends of [a, b] [c, d], up to rounding."""
    p, q, r, s = a * c, a * d, b * c, b * d
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))


@njit(int64(float64[:, :, ::1]), **INNER)
def _range_kind(values):
    """Return EXCLUDES_ZERO if a row of F has no zero, else the largest of NORMAL, MAY_UNDERFLOW, INFINITE over rows."""
    kind = NORMAL
    for i in range(len(values)):
        low, high = values[i, 0, 0], values[i, 0, 1]
        if low > 0.0 or high < 0.0:
            return EXCLUDES_ZERO
        is_tiny = low < high and max(-low, high) < codes.MIN_RANGE
        kind = max(kind, INFINITE if not high - low < math.inf else MAY_UNDERFLOW if is_tiny else NORMAL)
    return kind


@njit(int64(FORMULAS, BOX), **INNER)
def _enclose_box(F, box):
    """Enclose F and J in X, F at its middle; return the state: OUTSIDE if F has no zero, or INFINITE_STATE."""
    n = len(box.u)
    state = enclose(F, box.ends[X], box.ends[Y], n, box.rows, box.values)
    if _range_kind(box.values) == EXCLUDES_ZERO:
        return codes.OUTSIDE
    for j in range(n):
        box.ends[MIDDLE, j] = 0.5 * (box.ends[X, j] + box.ends[Y, j])
        box.ends[HALF, j] = WIDENING * max(box.ends[Y, j] - box.ends[MIDDLE, j], box.ends[MIDDLE, j] - box.ends[X, j])
        box.u[j, 0], box.u[j, 1] = -1.0, 1.0
    for i in range(n):
        size = 0.0
        for j in range(n):
            size = max(size, max(abs(box.values[i, 1 + j, 0]), abs(box.values[i, 1 + j, 1])) * box.ends[HALF, j])
        box.ends[SIZE, i] = size if size > 0.0 else 1.0
    if state >= codes.POLE:
        return state
    enclose(F, box.ends[MIDDLE], box.ends[MIDDLE], 0, box.rows, box.at_point)
    for i in range(n):
        size, slopes = box.ends[SIZE, i], box.values[i, 1:]
        box.linear[i, 0, 0], box.linear[i, 0, 1] = box.at_point[i, 0, 0] / size, box.at_point[i, 0, 1] / size
        if not (size < math.inf and box.linear[i, 0, 1] - box.linear[i, 0, 0] < math.inf):
            return INFINITE_STATE
        for j in range(n):
            c, d = slopes[j, 0] * box.ends[HALF, j] / size, slopes[j, 1] * box.ends[HALF, j] / size
            box.linear[i, 1 + j, 0], box.linear[i, 1 + j, 1] = c - abs(c) * 2.0 * UNIT, d + abs(d) * 2.0 * UNIT
    return state


@njit(boolean(BOX), **INNER)
def _cut_by_rows(box):
    """Reduce u by each row of f + A u = 0, solved for each variable; return False if u becomes empty."""
    L, u, n = box.linear, box.u, len(box.u)
    for i in range(n):
        low, high = box.linear[i, 0, 0], box.linear[i, 0, 1]
        rounding = 4.0 * (n + 1) * UNIT * (max(abs(low), abs(high)) + n)  # rows are of size 1
        for k in range(n):
            p, q = _interval_product(L[i, 1 + k, 0], L[i, 1 + k, 1], u[k, 0], u[k, 1])
            low, high = low + p, high + q
        if low > rounding or high < -rounding:
            return False
        for j in range(n):
            c, d = L[i, 1 + j, 0], L[i, 1 + j, 1]
            if c > 0.0 or d < 0.0:
                p, q = _interval_product(c, d, u[j, 0], u[j, 1])
                a, b = low - p - rounding, high - q + rounding
                p, q = min(min(-a / c, -a / d), min(-b / c, -b / d)), max(max(-a / c, -a / d), max(-b / c, -b / d))
                u[j, 0], u[j, 1] = (max(u[j, 0], p - abs(p) * 2.0 * UNIT), min(u[j, 1], q + abs(q) * 2.0 * UNIT))
                if u[j, 0] > u[j, 1]:
                    return False
    return True


@njit(int64(BOX), **INNER)
def _cut_by_operator(box):
    """Reduce u to K; return INSIDE, DISJOINT (u is empty), SHIFT_EXCEEDS_BOX or UNDECIDED."""
    L, Y, n = box.linear, box.inverse[0], len(box.u)
    for i in range(n):
        for j in range(n):
            box.inverse[1, i, j] = 0.5 * (L[i, 1 + j, 0] + L[i, 1 + j, 1])
    if not _invert_matrix(box.inverse[1], Y):
        return UNDECIDED
    inside, shift_exceeds, is_linear, rounding = True, False, True, (n + 8) * UNIT
    for i in range(n):
        center, radius = 0.0, 0.0
        for k in range(n):
            middle = 0.5 * (L[k, 0, 0] + L[k, 0, 1])
            center -= Y[i, k] * middle
            radius += abs(Y[i, k]) * (0.5 * (L[k, 0, 1] - L[k, 0, 0]) + rounding * abs(middle))
        point_radius = radius
        for j in range(n):
            middle, spread, magnitude = 1.0 if i == j else 0.0, 0.0, 1.0
            for k in range(n):
                product = Y[i, k] * 0.5 * (L[k, 1 + j, 0] + L[k, 1 + j, 1])
                middle -= product
                spread += abs(Y[i, k]) * 0.5 * (L[k, 1 + j, 1] - L[k, 1 + j, 0])
                magnitude += abs(product)
            radius += abs(middle) + spread + rounding * magnitude
        low, high = center - WIDENING * radius, center + WIDENING * radius
        if not high - low < math.inf:
            return UNDECIDED
        inside &= low > -1.0 and high < 1.0
        shift_exceeds |= point_radius > 1.0
        is_linear &= radius - point_radius < MAX_NONLINEARITY
        box.u[i, 0], box.u[i, 1] = max(box.u[i, 0], low), min(box.u[i, 1], high)
        if box.u[i, 0] > box.u[i, 1]:
            return DISJOINT
    return INSIDE if inside else SHIFT_EXCEEDS_BOX if shift_exceeds and is_linear else UNDECIDED


@njit(boolean(BOX), **INNER)
def _is_rounding_limited(box):
    """Return whether each row of F changes in X by less than MIN_CHANGE roundings of F at the middle."""
    for i in range(len(box.u)):
        change = 0.0
        for j in range(len(box.u)):
            change += max(abs(box.linear[i, 1 + j, 0]), abs(box.linear[i, 1 + j, 1]))
        if not change <= MIN_CHANGE * 0.5 * (box.linear[i, 0, 1] - box.linear[i, 0, 0]):
            return False
    return True


@njit(float64(FORMULAS, BOX, float64[::1], float64[::1]), **INNER)
def _newton_residual(F, box, point, step):
    """Write P F(point)/h into step, and J into ``at_point``; return the largest element of step over its rounding.

    A box may be wide in one variable and narrow in another, so h is no measure of the distance from the zero.
    """
    n, largest = len(box.u), 0.0
    enclose(F, point, point, n, box.rows, box.at_point)
    for i in range(n):
        step[i], rounding = 0.0, UNIT * (abs(point[i]) / box.ends[HALF, i] + UNIT)
        for k in range(n):
            scaled = box.inverse[2, i, k] / box.ends[HALF, i]
            step[i] += scaled * 0.5 * (box.at_point[k, 0, 0] + box.at_point[k, 0, 1])
            rounding += abs(scaled) * (box.at_point[k, 0, 1] - box.at_point[k, 0, 0])
        largest = max(largest, abs(step[i]) / rounding)
    return largest


@njit(boolean(FORMULAS, BOX), **INNER)
def _refine_zero(F, box):
    """Narrow X, which contains one zero, to the smallest box about it that can be proved; return False on failure."""
    n = len(box.u)
    point, step, newton_point = box.scratch[0], box.scratch[1], box.scratch[2]
    low, high, h = box.scratch[3], box.scratch[4], box.scratch[5]
    for target, source in ((point, MIDDLE), (low, X), (high, Y), (h, HALF)):
        _copy_vector(target, box.ends[source])
    for i in range(n):
        for k in range(n):
            box.inverse[2, i, k] = box.ends[HALF, i] * box.inverse[0, i, k] / box.ends[SIZE, k]
    size, last_size = _newton_residual(F, box, point, step), math.inf
    for _ in range(MAX_REFINEMENTS):
        if size <= UNIT or last_size <= size < CONTRACTION_LIMIT / UNIT:
            break
        last_size = size
        for i in range(n):
            for j in range(n):
                box.inverse[1, i, j] = 0.0
                for k in range(n):
                    slope = 0.5 * (box.at_point[k, 1 + j, 0] + box.at_point[k, 1 + j, 1])
                    box.inverse[1, i, j] += box.inverse[2, i, k] * slope * h[j] / h[i]
        is_inside = _invert_matrix(box.inverse[1], box.inverse[0])
        for i in range(n):
            newton_point[i] = point[i]
            for k in range(n):
                newton_point[i] -= h[i] * box.inverse[0, i, k] * step[k]
            is_inside &= low[i] <= newton_point[i] <= high[i]
            point[i] -= h[i] * step[i]
        size = _newton_residual(F, box, point, step)
        if is_inside:
            newton_size = _newton_residual(F, box, newton_point, step)
            if newton_size < size:
                _copy_vector(point, newton_point)
                size = newton_size
            else:
                size = _newton_residual(F, box, point, step)
    _newton_residual(F, box, point, step)
    for i in range(n):
        step[i] = max(UNIT * abs(point[i]), UNIT * UNIT * (high[i] - low[i]))
        for k in range(n):
            step[i] += abs(box.inverse[2, i, k]) * (box.at_point[k, 0, 1] - box.at_point[k, 0, 0])  # rounding of F
    for _ in range(MAX_WIDENINGS):
        for j in range(n):
            step[j] *= 4.0
            box.ends[X, j], box.ends[Y, j] = point[j] - step[j], point[j] + step[j]
        if _enclose_box(F, box) == codes.REGULAR and _cut_by_operator(box) == INSIDE:
            return True
    _copy_vector(box.ends[X], low)
    _copy_vector(box.ends[Y], high)
    return False


@njit(int64(FORMULAS, BOX, boolean, boolean), **INNER)
def _classify_box(F, box, at_min_width, only_excludes):
    """Return the kind of a box: NO_ZERO, UNIQUE_ZERO, SPLIT, or a code of why it is not decided.

    The box is cut to the part that may contain a zero. With `only_excludes`, uniqueness is not needed; a box
    `at_min_width` is not split.
    """
    state = _enclose_box(F, box)
    if state == codes.OUTSIDE:
        return NO_ZERO
    if _range_kind(box.values) == MAY_UNDERFLOW:
        return codes.OVERFLOW  # one code for every value beyond the range of doubles
    if state == codes.POLE:
        return codes.CONTAINS_POLE
    if state == INFINITE_STATE:
        if _range_kind(box.at_point) == INFINITE:
            is_infinite = True
            for end in (box.ends[A], box.ends[B]):  # its lowest and its highest corner
                enclose(F, end, end, 0, box.rows, box.at_point)
                is_infinite &= _range_kind(box.at_point) == INFINITE
            if is_infinite:
                return codes.OVERFLOW
        return codes.AT_MIN_WIDTH if at_min_width else SPLIT
    if not _cut_by_rows(box):
        return NO_ZERO
    outcome = _cut_by_operator(box)
    if outcome in (INSIDE, DISJOINT):
        return codes.UNIQUE_ZERO if outcome == INSIDE else NO_ZERO
    # a search that only excludes zeros ends as soon as the error of F moves a zero by more than the box
    at_rounding = outcome == SHIFT_EXCEEDS_BOX if only_excludes else _is_rounding_limited(box)
    return codes.ROUNDING_LIMITED if at_rounding else codes.AT_MIN_WIDTH if at_min_width else SPLIT


@njit(float64(BOX, float64[::1]), **INNER)
def _shrink_box(box, min_widths):
    """Reduce the box to the remainder of X; return the remaining fraction of its volume, -1 if it is empty."""
    volume = 1.0
    for j in range(len(box.u)):
        a, b, error = (box.ends[A, j], box.ends[B, j], 2.0 * UNIT * (abs(box.ends[MIDDLE, j]) + box.ends[HALF, j]))
        low = max(a, box.ends[MIDDLE, j] + box.ends[HALF, j] * box.u[j, 0] - error) if box.u[j, 0] > -1.0 else a
        high = min(b, box.ends[MIDDLE, j] + box.ends[HALF, j] * box.u[j, 1] + error) if box.u[j, 1] < 1.0 else b
        if low > high:  # the remainder of X is outside the box
            return -1.0
        deficit = max(0.0, 0.5 * (min_widths[j] - (high - low)))
        box.ends[A, j], box.ends[B, j] = max(a, low - deficit), min(b, high + deficit)
        volume *= (box.ends[B, j] - box.ends[A, j]) / (b - a) if b > a else 1.0
    return volume


@njit(int64(BOX, float64[:, ::1], float64[::1]), **INNER)
def _split_axis(box, bounds, min_widths):
    """Return the variable across which F changes most in the box."""
    axis, largest, n = 0, -1.0, len(box.u)
    for j in range(n):
        width, share = box.ends[B, j] - box.ends[A, j], 0.0
        for i in range(n):
            slope = max(abs(box.values[i, 1 + j, 0]), abs(box.values[i, 1 + j, 1]))
            slope *= box.ends[HALF, j] / box.ends[SIZE, i]
            share = max(share, slope if slope < math.inf else 1.0)
        share = (share + 1e-3) * (width / (box.ends[Y, j] - box.ends[X, j]) if box.ends[Y, j] > box.ends[X, j] else 0.0)
        share += 1e-3 * width / (bounds[1, j] - bounds[0, j])
        if width > 2.0 * min_widths[j] and share > largest:
            largest, axis = share, j
    return axis


@njit(boolean(BOX, float64[:, ::1], float64[:, ::1], float64, float64[::1]), **INNER)
def _start_box(box, start, bounds, min_width, min_widths):
    """Write a start box, and X about it; return whether it has the minimum width in each variable."""
    at_min_width = True
    for j in range(len(min_widths)):
        a, b = start[0, j], start[1, j]
        box.ends[A, j], box.ends[B, j] = a, b
        min_widths[j] = max(min_width * (bounds[1, j] - bounds[0, j]), 4.0 * UNIT * max(abs(a), abs(b)))
        box.ends[X, j] = max(a - INFLATION * (b - a), bounds[0, j])
        box.ends[Y, j] = min(b + INFLATION * (b - a), bounds[1, j])
        at_min_width &= b - a <= 2.0 * min_widths[j]
    return at_min_width


@njit(float64(BOX, float64[:, ::1]), **INNER)
def _relative_width(box, bounds):
    """Return the largest width of the box over that of the bounds."""
    widest = 0.0
    for j in range(len(box.u)):
        widest = max(widest, (box.ends[B, j] - box.ends[A, j]) / (bounds[1, j] - bounds[0, j]))
    return widest


@njit(boolean(float64[::1], float64[::1], BOXES, int64, int64, int64), **INNER)
def _is_within(low, high, boxes_found, column, begin, end):
    """Return whether low … high is inside a box about a zero, of the records from begin to end.

    With low and high exchanged: whether it intersects such a box. column: 0 for the box with exactly one zero, 1 for
    the narrowest box about it.
    """
    for r in range(begin, end):
        is_inside = boxes_found.records[r, 1] == codes.UNIQUE_ZERO
        for j in range(len(low)):
            is_inside &= low[j] >= boxes_found.boxes[r, column, 0, j] and high[j] <= boxes_found.boxes[r, column, 1, j]
        if is_inside:
            return True
    return False


@njit(int64(BOX, float64[:, ::1], float64[::1], float64[:, :, ::1], int64), **INNER)
def _split_box(box, bounds, min_widths, stack, top):
    """Put the remainder of a box on the stack, split in two if it hardly shrank; return the new top."""
    volume = _shrink_box(box, min_widths)
    if volume < 0.0:
        return top
    _copy_vector(stack[top, 0], box.ends[A])
    _copy_vector(stack[top, 1], box.ends[B])
    if volume <= MAX_SHRUNK_VOLUME:
        return top + 1
    axis = _split_axis(box, bounds, min_widths)
    cut_point = box.ends[A, axis] + SPLIT_FRACTION * (box.ends[B, axis] - box.ends[A, axis])
    _copy_vector(stack[top + 1, 0], box.ends[A])
    _copy_vector(stack[top + 1, 1], box.ends[B])
    stack[top, 0, axis], stack[top + 1, 1, axis] = cut_point, cut_point
    return top + 2


@njit(BOX(int64, int64), **INNER)
def _empty_box(n, num_nodes):
    """Return a box of n variables without values, for a tape of so many nodes."""
    values, at_point, linear = np.empty((n, 1 + n, 2)), np.empty((n, 1 + n, 2)), np.empty((n, 1 + n, 2))
    rows, inverse, scratch = np.empty((num_nodes, 2 + 2 * n)), np.empty((3, n, n)), np.empty((6, n))
    return Box(np.empty((7, n)), values, at_point, linear, np.empty((n, 2)), inverse, rows, scratch)


@njit(int64(FORMULAS_OF_POINTS, SEARCH_REGIONS, LIMITS, BOXES), nogil=True, **OPTIONS)
def search(functions, regions, limits, boxes_found):
    """Find all zeros of each point in turn, until the records are full; return the number of records.

    Args:
        functions (kernels.search.codes.Formulas): As many functions as variables, with the constants of all points.
        regions (SearchRegions): Bounds and start boxes of the points.
        limits (Limits): Limits at which a point's search ends.
        boxes_found (Boxes): Written.
    """
    records, boxes, progress = boxes_found
    n, count, stack_size = functions.outputs.size, 0, 0
    for point in range(len(regions.ranges)):
        stack_size = max(stack_size, MAX_HALVINGS * n + 1 + regions.ranges[point, 1] - regions.ranges[point, 0])
    box = _empty_box(n, len(functions.tape))
    stack, min_widths, zero_box = np.empty((stack_size, 2, n)), np.empty(n), np.empty((2, n))
    for point in range(progress[0], len(regions.bounds)):
        F, bounds = Formulas(functions.tape, functions.outputs, functions.constants[point]), regions.bounds[point]
        begin, num_boxes, num_undecided, num_narrow, top = count, 0, 0, 0, 0
        for start in range(regions.ranges[point, 0], regions.ranges[point, 1]):
            for k in range(2):
                _copy_vector(stack[top, k], regions.start_boxes[start, k])
            top += 1
        while top > 0:
            top, num_boxes = top - 1, num_boxes + 1
            at_min_width = _start_box(box, stack[top], bounds, limits.min_width, min_widths)
            if _is_within(box.ends[A], box.ends[B], boxes_found, 0, begin, count):
                continue
            kind = codes.NOT_EXAMINED
            is_ended = num_boxes > limits.max_boxes or num_undecided > MAX_UNDECIDED or num_narrow > limits.max_narrow
            if not (is_ended or top + 2 > stack_size):
                kind = _classify_box(F, box, at_min_width, limits.only_excludes)
            if kind == codes.CONTAINS_POLE and not at_min_width:
                kind = SPLIT if _relative_width(box, bounds) > limits.max_pole_width else kind
            if limits.only_excludes and kind in (codes.UNIQUE_ZERO, codes.ROUNDING_LIMITED):
                kind = codes.AT_MIN_WIDTH if _shrink_box(box, min_widths) >= 0.0 else NO_ZERO
            if kind == codes.UNIQUE_ZERO:
                _copy_vector(zero_box[0], box.ends[X])
                _copy_vector(zero_box[1], box.ends[Y])
                if not _refine_zero(F, box):  # the zero is far from the middle: split the box
                    kind = codes.AT_MIN_WIDTH if at_min_width else SPLIT
                    _enclose_box(F, box)
            if kind == SPLIT:
                top = _split_box(box, bounds, min_widths, stack, top)
            if kind in (NO_ZERO, SPLIT) or (
                kind == codes.UNIQUE_ZERO and _is_within(box.ends[Y], box.ends[X], boxes_found, 1, begin, count)
            ):
                continue
            if count == len(records):
                progress[0] = point
                return begin
            num_undecided += kind != codes.UNIQUE_ZERO and kind != codes.NOT_EXAMINED
            num_narrow += kind in (codes.ROUNDING_LIMITED, codes.AT_MIN_WIDTH)
            for k in range(2):
                _copy_vector(boxes[count, 0, k], zero_box[k] if kind == codes.UNIQUE_ZERO else box.ends[A + k])
                _copy_vector(boxes[count, 1, k], box.ends[X + k] if kind == codes.UNIQUE_ZERO else box.ends[A + k])
            records[count, 0], records[count, 1] = point, kind
            count += 1
        progress[1] += num_boxes
    progress[0] = len(regions.bounds)
    return count
