r"""All zeros of a vector function of several variables in a box, each proved, as far as subdivision ends.

A box is dropped where a component of F, or its mean value form :math:`F_i(m) + J_i(X)(X - m)`, cannot be zero. With
Y near the inverse of J(m), Krawczyk's operator

.. math:: K(X) = m - Y F(m) + (I - Y J(X))(X - m)

holds every zero of X: where it lies inside X there is exactly one, where it misses X there is none, and else X is cut
to it or in two. Y takes the scales away: a soft direction beside a stiff one is as good as alone. X is a little larger
than the box that it stands for, so that a zero on a cut is inside one of both.

What is left where a point's boxes are too many, or too narrow, is handed back: a zero with a singular J, a line of
zeros, or too many variables for this.

Source: Moore, Kearfott and Cloud, Introduction to Interval Analysis, section 8.4; Neumaier, Interval Methods for
Systems of Equations, section 5.1.
"""

from dataclasses import dataclass

import numpy as np

from kernels.enclosures import OUTSIDE, POLE

NARROWEST = 2.0**-30  # of the bounds
INFLATED = 0.05  # of a box, on each side
MOST_BOXES = 40_000  # of a point
BATCH = 1 << 16
SHRUNK = 0.6
CUT = 0.4871  # of a box: zeros at round places are seldom cut through
UNIT = 2.0**-52
SLACK = 1.0 + 1e-14
POLISH = 8


@dataclass
class BoxZeros:
    """Zeros of many points' functions.

    Attributes:
        owner: point of each zero that is proved.
        place: where it is, shape (zeros, n).
        low, high: a box in which it is alone, shape (zeros, n).
        left: owner, low and high of the boxes that could not be decided.
    """

    owner: np.ndarray
    place: np.ndarray
    low: np.ndarray
    high: np.ndarray
    left: tuple[np.ndarray, np.ndarray, np.ndarray]


def zeros(slopes, low, high, most=MOST_BOXES) -> BoxZeros:
    """All zeros of a function of each point.

    Args:
        slopes: (owner, low, high) → enclosures (boxes, n, 1 + n, 2) of F and J, and states (boxes,).
        low: lower bounds, shape (points, n).
        high: upper bounds.
        most: the most boxes of a point.
    """
    points = low.shape[0]
    owner, a, b = np.arange(points), low.copy(), high.copy()
    used, found, left = np.zeros(points, dtype=np.int64), [], []
    empty = owner[:0], a[:0], b[:0]
    with np.errstate(all="ignore"):
        while owner.size:
            used += np.bincount(owner, minlength=points)
            over = (used > most)[owner]
            left.append((owner[over], a[over], b[over]))
            owner, a, b = owner[~over], a[~over], b[~over]
            parts = [
                _step(slopes, owner[i : i + BATCH], a[i : i + BATCH], b[i : i + BATCH], low, high)
                for i in range(0, owner.size, BATCH)
            ]
            found += [part[0] for part in parts]
            left += [part[1] for part in parts]
            owner, a, b = (np.concatenate(x) for x in zip(empty, *[part[2] for part in parts], strict=True))
        none = owner[:0], a[:0], b[:0]
        left = tuple(np.concatenate(x) for x in zip(none, *left, strict=True))
        owner, a, b = (np.concatenate(x) for x in zip(none, *found, strict=True))
        place = _polished(slopes, owner, a, b)
        kept = _alone(owner, place, a, b)
    return BoxZeros(owner[kept], place[kept], a[kept], b[kept], left)


def _step(slopes, owner, a, b, low, high):
    """Boxes with one zero, boxes that are left, and boxes that are to be looked at again."""
    wide = INFLATED * (b - a)
    x, y = np.maximum(a - wide, low[owner]), np.minimum(b + wide, high[owner])
    values, states = slopes(owner, x, y)
    F, J = values[:, :, 0], values[:, :, 1:]
    kept = ~((F[..., 0] > 0.0) | (F[..., 1] < 0.0)).any(axis=1) & (states != OUTSIDE)
    owner, a, b, x, y, J, sound = (z[kept] for z in (owner, a, b, x, y, J, states < POLE))
    center, radius, kept = _operator(slopes, owner, x, y, J)
    kept |= ~sound
    owner, a, b, x, y, J, sound, center, radius = (z[kept] for z in (owner, a, b, x, y, J, sound, center, radius))
    sound &= np.isfinite(center).all(axis=1) & np.isfinite(radius).all(axis=1)
    lower, upper = (np.where(sound[:, None], center + sign * radius, sign * np.inf) for sign in (-1.0, 1.0))
    none = ((lower > b) | (upper < a)).any(axis=1)
    single = ~none & ((lower > x) & (upper < y)).all(axis=1)
    scale = high[owner] - low[owner]
    open_ = ~none & ~single
    narrow = open_ & ((b - a) <= NARROWEST * scale).all(axis=1)
    again = open_ & ~narrow
    further = _cut(*(z[again] for z in (owner, a, b, lower, upper, scale, J, y - x)))
    return (owner[single], x[single], y[single]), (owner[narrow], a[narrow], b[narrow]), further


def _operator(slopes, owner, low, high, J):
    """Middle and radius of K of boxes, and whether the mean value form lets them hold a zero."""
    middle = 0.5 * (low + high)
    here, _ = slopes(owner, middle, middle)
    r = SLACK * np.maximum(high - middle, middle - low)
    F = here[:, :, 0]
    reach = SLACK * np.einsum("bij,bj->bi", np.abs(J).max(axis=-1), r)
    kept = ~((F[..., 0] - reach > 0.0) | (F[..., 1] + reach < 0.0)).any(axis=1)
    return *_krawczyk(here[:, :, 1:].mean(axis=-1), F, J, middle, r), kept


def _cut(owner, a, b, lower, upper, scale, J, width):
    """Boxes cut to K where that helps, else in two where F changes most."""
    low, high = _met(a, b, lower, upper, scale)
    rows, widest = np.arange(owner.size), ((b - a) / scale).argmax(axis=1)
    shrunk = (high - low)[rows, widest] <= SHRUNK * (b - a)[rows, widest]
    smear = np.abs(J).max(axis=-1) * width[:, None, :]
    share = (smear / smear.sum(axis=2, keepdims=True)).max(axis=1)
    share = np.where(np.isfinite(share), share, 1.0) + 1e-3 * (high - low) / scale
    axis = np.where((high - low) > NARROWEST * scale, share, 0.0).argmax(axis=1)
    place = low[rows, axis] + CUT * (high - low)[rows, axis]
    first_high, second_low = high.copy(), low.copy()
    first_high[rows[~shrunk], axis[~shrunk]] = place[~shrunk]
    second_low[rows[~shrunk], axis[~shrunk]] = place[~shrunk]
    second = owner[~shrunk], second_low[~shrunk], high[~shrunk]
    return tuple(np.concatenate(z) for z in zip((owner, low, first_high), second, strict=True))


def _met(a, b, lower, upper, scale):
    """X ∩ K, in no direction narrower than a box may be: what is done with one variable waits for the others."""
    low, high = np.fmax(a, lower), np.fmin(b, upper)
    more = np.maximum(0.0, 0.5 * (NARROWEST * scale - (high - low)))
    return np.maximum(a, low - more), np.minimum(b, high + more)


def alone(slopes, owner, low, high):
    """Whether each box holds exactly one zero, by Krawczyk's operator."""
    with np.errstate(all="ignore"):
        values, states = slopes(owner, low, high)
        center, radius, _ = _operator(slopes, owner, low, high, values[:, :, 1:])
        return ((center - radius > low) & (center + radius < high)).all(axis=1) & (states < POLE)


def _krawczyk(J, F, slope, middle, r):
    """Middle and radius of K, from J(m), F(m) and J(X); Y is any matrix, so the inverse need not be good."""
    n = r.shape[1]
    Jc, Jr = 0.5 * (slope[..., 0] + slope[..., 1]), SLACK * 0.5 * (slope[..., 1] - slope[..., 0])
    size = np.abs(J).max(axis=(1, 2))[:, None, None]
    good = np.isfinite(size) & (size > 0.0)
    J = np.where(good, J, np.eye(n))
    try:
        Y = np.linalg.inv(J)
    except np.linalg.LinAlgError:
        Y = np.linalg.inv(J + np.where(good, size, 1.0) * np.diag(1e-9 * (1.0 + np.arange(n) / 7.0)))
    absolute = np.abs(Y)
    product = np.abs(np.eye(n) - Y @ Jc) + absolute @ Jr + (n + 4) * UNIT * (absolute @ np.abs(Jc) + np.eye(n))
    Fc, Fr = F.mean(axis=-1), SLACK * 0.5 * (F[..., 1] - F[..., 0])
    step = np.einsum("bij,bj->bi", Y, Fc)
    blur = np.einsum("bij,bj->bi", absolute, Fr + (n + 4) * UNIT * np.abs(Fc))
    radius = SLACK * (np.einsum("bij,bj->bi", product, r) + blur) + 2.0 * UNIT * (np.abs(middle) + np.abs(step))
    return middle - step, radius


def _polished(slopes, owner, low, high):
    """Newton's method from the middle of each box, inside it."""
    place = 0.5 * (low + high)
    for _ in range(POLISH):
        if not owner.size:
            break
        values = slopes(owner, place, place)[0].mean(axis=-1)
        try:
            step = np.linalg.solve(values[:, :, 1:], values[:, :, :1])[..., 0]
        except np.linalg.LinAlgError:
            break
        place = np.clip(np.where(np.isfinite(step), place - step, place), low, high)
    return place


def _alone(owner, place, low, high):
    """Which zeros are not in an earlier one's box, where that is alone."""
    order = np.argsort(owner, kind="stable")
    kept = np.ones(owner.size, dtype=bool)
    bounds = np.flatnonzero(np.diff(owner[order])) + 1
    for rows in np.split(order, bounds):
        for position, j in enumerate(rows[1:], 1):
            earlier = rows[:position][kept[rows[:position]]]
            inside = ((place[j] >= low[earlier]) & (place[j] <= high[earlier])).all(axis=1)
            kept[j] = not inside.any()
    return kept
