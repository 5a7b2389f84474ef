"""All zeros of a function of one variable between two bounds, each proved or named.

The bounds are cut into boxes until each is one of: a box where f has a sign; one where f rises or falls (f′ has a
sign), which holds one zero at most; one where f is lost in its own rounding; a box around a pole as narrow as numbers
allow. Where f is monotone from a place of proved sign to one of the other there is exactly one zero; to one of the same
sign there is none. So "there are k" is a theorem. What rounding hides (a double root, a triple one, roots closer than
numbers can tell) is a *cluster*: a zero that is named, not proved.

Boxes are enclosed by their natural extension, and by Taylor's with the derivatives' enclosures. Zeros that are proved
are closed down by Newton's method between places of proved sign.

Source: Moore, Kearfott and Cloud, Introduction to Interval Analysis, chapter 8; Hansen and Walster, Global Optimization
Using Interval Analysis, chapter 9.
"""

from dataclasses import dataclass

import numpy as np

from kernels.enclosures import OUTSIDE, POLE

SIGN, SLOPE, LOST, NARROW, OUT = range(5)  # kinds of boxes
FIRST = 8  # boxes that the bounds are cut into at once
MOST_BOXES = 20_000  # of a point
MOST_STEPS, PATIENCE = 200, 30
MOST_SOUGHT, FOUND = 8, 1e-9  # steps in plain numbers, and where the next one is a rounding
CUT = 0.4871  # of a box: zeros at round places are seldom cut through
ROUNDINGS = 8.0  # f is lost where it changes by less than so many widths of its own enclosure at a place
FAINT = 1e-280  # below it f is lost in underflow: no zero is seen there, and no line of them
FLAT = 0.02  # of the bounds: a wider cluster is a line of zeros
SLACK = 1.0 + 1e-14
SIMPLE, CLUSTER = range(2)
UNIT = 2.0**-52


@dataclass
class LineZeros:
    """Zeros of many points' functions, in ascending order of point and place.

    Attributes:
        owner: point of each zero.
        place: where it is.
        kind: SIMPLE, proved and alone, or CLUSTER, one or more that rounding hides.
        proved: (points,) whether everything between the bounds is decided.
        flat: (points,) whether f vanishes all along a part of the bounds.
        doubt: point, low and high of every box that could not be decided.
        exhausted: (points,) whether boxes were left when their number was used up.
    """

    owner: np.ndarray
    place: np.ndarray
    kind: np.ndarray
    proved: np.ndarray
    flat: np.ndarray
    doubt: tuple[np.ndarray, np.ndarray, np.ndarray]
    exhausted: np.ndarray


def zeros(curve, low, high, plain=None, slope=None) -> LineZeros:
    """All zeros of a function of each point.

    Args:
        curve: (owner, low, high) → enclosures (boxes, 3, 2) of f, f′, f″/2 and states (boxes,).
        low: lower bounds, shape (points,).
        high: upper bounds.
        plain: (owner, places) → f and f′ as they come, shape (places,) each: where zeros are sought first. Nothing is
            concluded from them.
        slope: as `curve`, of f and f′ alone, shape (boxes, 2, 2): what most boxes need.
    """
    slope = slope or curve
    with np.errstate(all="ignore"):
        narrow = UNIT / 16 * (high - low)
        boxes, exhausted = _boxes(curve, slope, low, high, narrow)
        groups = _groups(curve, boxes)
        found = [_proved(slope, plain, groups), _clusters(curve, groups, exhausted, narrow)]
        width = (high - low)[groups.owner]
        wide = (groups.worst == LOST) & ~exhausted[groups.owner]
        wide &= groups.lost > FLAT * width
        flat = np.zeros(low.size, dtype=bool)
        flat[groups.owner[wide]] = True
        doubt = (groups.worst == LOST) & ~groups.certain
        doubt |= (groups.worst == NARROW) & ~_poles(curve, groups, low, high)
        proved = np.ones(low.size, dtype=bool)
        proved[groups.owner[doubt]] = False
        proved[exhausted] = False
    owner, place, kind = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.lexsort((place, owner))
    named = groups.owner[doubt], groups.low[doubt], groups.high[doubt]
    return LineZeros(owner[order], place[order], kind[order], proved, flat, named, exhausted)


# -- boxes


def _boxes(curve, slope, low, high, narrow):
    """Boxes (owner, low, high, kind, sense) that none needs a further cut, and which points took too many."""
    points = low.size
    owner = np.repeat(np.arange(points), FIRST)
    edges = low[:, None] + (high - low)[:, None] * (
        (np.arange(FIRST + 1) - CUT * (np.arange(FIRST + 1) % FIRST > 0)) / FIRST
    )
    edges[:, -1] = high
    a, b = edges[:, :-1].ravel(), edges[:, 1:].ravel()
    used, exhausted, done = np.zeros(points, dtype=np.int64), np.zeros(points, dtype=bool), []
    while owner.size:
        used += np.bincount(owner, minlength=points)
        kind, sense, broken = _judged(curve, slope, owner, a, b)
        small = (b - a <= np.maximum(narrow[owner], 4.0 * UNIT * np.maximum(np.abs(a), np.abs(b)))) & (kind < 0)
        kind[small] = np.where(broken, NARROW, LOST)[small]
        over = (used > MOST_BOXES)[owner] & (kind < 0)
        exhausted[owner[over]] = True
        kind[over] = LOST
        ready = kind >= 0
        done.append((owner[ready], a[ready], b[ready], kind[ready], sense[ready]))
        owner, a, b = owner[~ready], a[~ready], b[~ready]
        middle = a + CUT * (b - a)
        owner, a, b = np.concatenate([owner, owner]), np.concatenate([a, middle]), np.concatenate([middle, b])
    boxes = [np.concatenate(parts) for parts in zip(*done, strict=True)]
    order = np.lexsort((boxes[1], boxes[0]))
    return [x[order] for x in boxes], exhausted


def _judged(curve, slope, owner, a, b):
    """Kind of each box, -1 where it is to be cut, the sense (1 or -1) of SIGN and SLOPE, and whether f breaks in it."""
    values, states = slope(owner, a, b)
    kind, sense = np.full(owner.size, -1), np.zeros(owner.size, dtype=np.int64)
    kind[states == OUTSIDE] = OUT
    kind[(_size(values[:, 0]) < FAINT) & (values[:, 0, 0] < values[:, 0, 1])] = NARROW
    _seen(kind, sense, values[:, 0], values[:, 1], states < POLE)
    left = np.flatnonzero((kind < 0) & (states < POLE))
    if left.size:
        middle = 0.5 * (a[left] + b[left])
        here, _ = slope(owner[left], middle, middle)
        bend = curve(owner[left], a[left], b[left])[0][:, 2]
        r = SLACK * np.maximum(b[left] - middle, middle - a[left])
        rise = _met(values[left, 1], _around(here[:, 1], 2.0 * _size(bend) * r))
        value = _met(values[left, 0], _around(here[:, 0], _size(rise) * r))
        again, way = kind[left], sense[left]
        _seen(again, way, value, rise, np.ones(left.size, dtype=bool))
        blur = here[:, 0, 1] - here[:, 0, 0]
        lost = (again < 0) & np.isfinite(blur) & (_size(rise) * (b - a)[left] <= ROUNDINGS * blur)
        again[lost] = LOST
        beyond = np.flatnonzero((again < 0) & ~np.isfinite(blur))
        if beyond.size:
            at = left[beyond]
            again[beyond[_overflows(curve, owner[at], a[at], b[at])]] = NARROW
        kind[left], sense[left] = again, way
    return kind, sense, states == POLE


def _overflows(curve, owner, a, b):
    """Whether f is beyond all numbers at both ends."""
    return ~np.isfinite([curve(owner, x, x)[0][:, 0] for x in (a, b)]).all(axis=2).any(axis=0)


def _seen(kind, sense, value, slope, sound):
    """Notes SIGN and SLOPE where enclosures show them."""
    open_ = kind < 0
    for name, ends, strict, where in ((SIGN, value, True, open_), (SLOPE, slope, False, open_ & sound)):
        up = ends[:, 0] > 0.0 if strict else (ends[:, 0] >= 0.0) & (ends[:, 1] > 0.0)
        down = ends[:, 1] < 0.0 if strict else (ends[:, 1] <= 0.0) & (ends[:, 0] < 0.0)
        chosen = where & (up | down) & (kind < 0)
        kind[chosen], sense[chosen] = name, np.where(up, 1, -1)[chosen]


def _size(ends):
    return np.maximum(np.abs(ends[:, 0]), np.abs(ends[:, 1]))


def _around(ends, r):
    r = SLACK * r + 1e-300
    return np.stack([ends[:, 0] - r, ends[:, 1] + r], axis=-1)


def _met(first, second):
    """Intersection; where one is no number the other."""
    low = np.fmax(first[:, 0], second[:, 0])
    return np.stack([low, np.fmin(first[:, 1], second[:, 1])], axis=-1)


# -- groups of boxes between places of proved sign


@dataclass
class _Groups:
    """Runs of boxes between places where the sign of f is proved (0 where it is not, at a bound)."""

    owner: np.ndarray
    low: np.ndarray
    high: np.ndarray
    left: np.ndarray
    right: np.ndarray
    worst: np.ndarray
    sense: np.ndarray
    lost: np.ndarray
    certain: np.ndarray


def _groups(curve, boxes):
    owner, a, b, kind, sense = boxes
    first = np.r_[True, owner[1:] != owner[:-1]]
    signed = kind == SIGN
    before = np.r_[False, signed[:-1]] & ~first
    left = np.where(signed, sense, np.where(before, np.r_[0, sense[:-1]], 0))
    ask = ~signed & ~before
    left[ask] = _signs(curve, owner[ask], a[ask])
    last = np.r_[first[1:], True]
    right = np.where(last, 0, np.r_[left[1:], 0])
    end = last & signed
    right[end] = sense[end]
    right[last & ~signed] = _signs(curve, owner[last & ~signed], b[last & ~signed])
    start = first | (left != 0)
    begin = np.flatnonzero(start)
    final = np.r_[begin[1:] - 1, owner.size - 1]
    lost = np.add.reduceat(np.where(kind == LOST, b - a, 0.0), begin)
    worst = np.maximum.reduceat(kind, begin)
    even = np.zeros(begin.size, dtype=bool)
    return _Groups(owner[begin], a[begin], b[final], left[begin], right[final], worst, sense[begin], lost, even)


def _signs(curve, owner, x):
    """Proved sign of f at places, 0 where there is none."""
    values, states = curve(owner, x, x)
    sign = np.where(values[:, 0, 0] > 0.0, 1, np.where(values[:, 0, 1] < 0.0, -1, 0))
    return np.where(states < POLE, sign, 0)


# -- zeros that are proved


def _proved(slope, plain, groups):
    """The zero of every monotone run between opposite signs; at a bound, one within a rounding of it."""
    single = groups.worst == SLOPE
    crossing = single & (groups.left * groups.right < 0)
    at_low = single & (groups.left == 0) & (groups.right == groups.sense)
    at_high = single & (groups.right == 0) & (groups.left == -groups.sense)
    place = np.where(at_low, groups.low, groups.high)
    which = np.flatnonzero(crossing)
    owner, low, high, left = (x[which] for x in (groups.owner, groups.low, groups.high, groups.left))
    start = 0.5 * (low + high) if plain is None else _sought(plain, owner, low, high, left)
    place[which] = _closed(slope, owner, low, high, left, start)
    both = single & (groups.left == 0) & (groups.right == 0)
    place[both] = 0.5 * (groups.low + groups.high)[both]
    chosen = crossing | at_low | at_high | both
    return groups.owner[chosen], place[chosen], np.full(chosen.sum(), SIMPLE)


def _sought(plain, owner, a, b, left):
    """Where zeros of monotone functions in brackets lie as far as plain numbers tell: some place of each bracket."""
    a, b, place, rests = a.copy(), b.copy(), 0.5 * (a + b), np.zeros(a.size, dtype=bool)
    for _ in range(MOST_SOUGHT):
        value, slope = plain(owner, place)
        before = np.sign(value) == left
        a, b = np.where(before, place, a), np.where(before, b, place)
        guess = place - value / slope
        step = np.abs(guess - place)
        guess = np.where((guess >= a) & (guess <= b), guess, 0.5 * (a + b))
        place = np.where(rests, place, guess)  # each rests by itself: no bit hangs on who else is sought
        rests |= step <= FOUND * np.abs(place)
        if rests.all():
            break
    return place


def _closed(enclosed, owner, a, b, left, start):
    """Zeros of monotone functions in brackets: Newton's steps, halving where one leaves the bracket."""
    a, b, place, enough = a.copy(), b.copy(), start, UNIT / 16 * (b - a)
    active = np.arange(a.size)
    for step in range(MOST_STEPS):
        if not active.size:
            break
        x = place[active]
        values, _ = enclosed(owner[active], x, x)
        value, slope = values[:, 0, 0] + values[:, 0, 1], values[:, 1, 0] + values[:, 1, 1]
        told = (values[:, 0, 0] > 0.0) | (values[:, 0, 1] < 0.0)
        before = told & (np.where(value > 0.0, 1, -1) == left[active])
        a[active] = np.where(before, x, a[active])
        b[active] = np.where(told & ~before, x, b[active])
        low, high = a[active], b[active]
        guess = x - value / slope
        inside = (guess >= low) & (guess <= high) & (step < PATIENCE or step % 2 == 0)  # Newton's are short at x^n
        guess = np.where(inside, guess, np.where(told, 0.5 * (low + high), x))
        place[active] = guess
        going = told & (np.abs(guess - x) > np.maximum(enough[active], 2.0 * UNIT * np.abs(x)))
        active = active[going & (high - low > enough[active])]
    return place


# -- zeros that rounding hides


def _clusters(curve, groups, exhausted, narrow):
    """A zero of each run that holds boxes lost in rounding, where its signs or its values show one."""
    which = np.flatnonzero((groups.worst == LOST) & (groups.lost > 0.0))
    owner, a, b = groups.owner[which], groups.low[which], groups.high[which]
    odd = groups.left[which] * groups.right[which] < 0
    spent = exhausted[owner]
    ends = [curve(owner, x, x)[0].sum(axis=2) for x in (a, b)]
    order = np.where(odd, np.where(spent, 0, 2), 1)
    index = np.arange(which.size)
    differ = ends[0][index, order] * ends[1][index, order] < 0.0
    order = np.where(odd & ~differ, 0, order)
    differ = ends[0][index, order] * ends[1][index, order] < 0.0
    place = 0.5 * (a + b)
    place[differ] = _bisected(curve, owner[differ], a[differ], b[differ], order[differ])
    values, states = curve(owner, place, place)
    zero = (values[:, 0, 0] <= 0.0) & (values[:, 0, 1] >= 0.0) & (states < POLE)
    zero |= b - a <= 64.0 * np.maximum(narrow[owner], UNIT * np.abs(place))  # no number comes nearer
    chosen = odd | (zero & ~spent)
    return owner[chosen], place[chosen], np.full(chosen.sum(), CLUSTER)


def _bisected(curve, owner, a, b, order):
    """Zeros in brackets of f, f′ or f″ (order 0, 1, 2), by halving."""
    index, a, b = np.arange(owner.size), a.copy(), b.copy()
    start = curve(owner, a, a)[0].sum(axis=2)[index, order]
    for _ in range(80):
        wide = b - a > 2.0 * UNIT * np.maximum(np.abs(a), np.abs(b))  # the others rest, whoever is sought beside them
        if not wide.any():
            break
        middle = 0.5 * (a + b)
        here = curve(owner, middle, middle)[0].sum(axis=2)[index, order]
        same = here * start > 0.0
        a = np.where(wide & (same | (here == 0.0)), middle, a)
        b = np.where(wide & ~same, middle, b)
    return 0.5 * (a + b)


# -- poles


def _poles(curve, groups, low, high):
    """Whether each group is a pole: on both its sides, as far as there are any, |f| grows towards it."""
    which = np.flatnonzero(groups.worst >= NARROW)
    result = np.zeros(groups.owner.size, dtype=bool)
    if not which.size:
        return result
    owner, a, b = groups.owner[which], groups.low[which], groups.high[which]
    width = np.maximum(b - a, 8.0 * UNIT * np.maximum(np.abs(a), np.abs(b)))
    sides, grows = np.zeros(which.size, dtype=bool), np.ones(which.size, dtype=bool)
    for edge, way in ((a, -1.0), (b, 1.0)):
        sizes = []
        for far in (1.0, 8.0):
            x = edge + way * far * width
            values, states = curve(owner, x, x)
            inside = (x >= low[owner]) & (x <= high[owner]) & (states < POLE)
            sizes.append(np.where(inside, np.abs(values[:, 0].sum(axis=1)), np.nan))
        there = ~np.isnan(sizes[0]) & ~np.isnan(sizes[1])
        sides |= there
        grows &= ~there | (sizes[0] > 1.001 * sizes[1])
    outside = groups.worst[which] == OUT
    result[which] = (sides & grows) | outside
    return result
