r"""Branches: equilibria that keep their slots through folds and pitchforks.

Which root of one point is which root of another has no answer but along a way from one to the other. The way here leads
from the parameters' defaults to the point, each parameter on a straight line of its own (of its logarithm where both
ends are positive). So a point's branches depend on the description and the point alone, never on what other points a
sweep has, in which order, or in which shard.

At each of `STEPS` steps all roots are searched anew, with the proof that there are so many, and those that were there
are carried on to them: with a proof that each has become this one (:func:`carried`), as far as it meets nothing. One
that is stopped has met another there, and so has one of the new roots that, carried back, is stopped on its way to the
old ones. Of these two sorts those are one branch that lie where each other's course leads: a branch that goes straight
through a pitchfork, or through another one, keeps its slot. What is stopped and led on by none has vanished (a fold),
and its slot is free; what is new takes the first slot that is free where it comes to be.

What cannot be decided is said, by point: two that are led to one place nearly as well; one that stops or comes to be
alone, which no fold does; a search without a proof. And no way can tell this: where a loop about a cusp changes which
root is which, the slots of neighbouring points change somewhere on it.

*Carried zeros* of F(x, p), whose parameters p go straight from one place to another, t from 0 to 1: a box of
half-widths r goes along with the chord m(t) from the zero at the one end to Newton's at the other. It holds exactly one
zero at every t if

.. math:: |Y F(m(t), p(t))| + |1 - Y J|\, r < r, \qquad
          F(m(t), p(t)) \in F(m(\tfrac12), p(\tfrac12)) + (t - \tfrac12)\,(J \Delta x + F_p \Delta p)

with Y near the inverse of J(m(1/2), p(1/2)), J and F_p enclosed over all that the box passes: Krawczyk's operator of
every t. J is then regular there, so these zeros are one smooth curve. A piece that cannot be passed so is halved; where
it is too short to be halved the zero has met something: a fold, a pitchfork, an end of where F is defined.

Source: Neumaier, Interval Methods for Systems of Equations, section 5.1; Allgower and Georg, Numerical Continuation
Methods, chapter 2.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kernels.codes import POLE, UNIT
from kernels.matrices import by_matrix

STEPS = 8
SHIFT = 0.381966  # of a step, which the steps' ends lie before round fractions of the path, where places like to meet
SPARE = 8  # slots on the path, beyond those there is room for at its end
SAME = 1e-6  # of the range: places that are one
NEAR = 0.05  # of the range: how far from where a course leads a root may lie to be led on
SURE = 0.2  # of the distance of the next best: one that is nearer than this is led on without a doubt
HALVINGS = 8  # of a piece
NEWTON, FOUND = 6, 1e-13  # steps, and when no more are needed, over the range
LEAP = 0.25  # of the range, the most in one go
GROWTHS, LARGER = 3, 1.5  # of a box, how often, and than what is to lie inside
LEAST = 1e-10  # of the range: half a box
STALLED = 400
SLACK = 1.0 + 1e-14
GAP = 64.0 / STEPS * 2.0**-HALVINGS  # of the path, between where the one stops and where the other does


@dataclass(frozen=True)
class Way:
    """The way from the defaults to points."""

    #: fraction of the path → places (points, count, n), NaN for none, and whether each point's are proved to be all
    #: that are there, (points,).
    search: Callable
    slopes: Callable  #: as of :func:`carried`
    parameters: Callable  #: (points, shares) → parameters, as of :func:`carried`
    bounds: Callable  #: fraction of the path → the range of each variable, shape (points, n, 2)
    periodic: np.ndarray  #: whether the range closes, shape (n,)

    def apart(self, a, b, width):
        """Return the largest distance between places in any variable, over its range; periodic ones the shorter way."""
        part = np.abs(a - b) / width
        return np.where(self.periodic, np.abs(part - np.round(part)), part).max(axis=-1)

    def outside(self, place, bounds):
        """Return True for places outside the bounds of a variable that is not periodic."""
        width = SAME * (bounds[..., 1] - bounds[..., 0])
        beyond = (place < bounds[..., 0] + width) | (place > bounds[..., 1] - width)
        return (beyond & ~self.periodic).any(axis=-1)


@dataclass
class Carried:
    """Where zeros have come to."""

    place: np.ndarray  #: shape (zeros, n), at the fraction of the path that each has reached
    share: np.ndarray  #: shape (zeros,), `end` for those that came through
    speed: np.ndarray  #: dx/ds over the last piece, shape (zeros, n); 0 for one that did not get away
    through: np.ndarray  #: shape (zeros,), whether each is proved to have become the one at `place`


def followed(way: Way, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Return which root each slot holds at the end of the path, and for which points that is decided.

    Returns:
        Numbers of the roots that are found at the end of the path, shape (points, most), -1 for a slot that is empty (a
        point with more roots than slots shows some of them), and shape (points,), False where it could not be decided
        which root is which.
    """
    roots, decided = way.search(0.0)
    slots = np.full((len(roots), most + SPARE), -1)
    for row, there in zip(slots, ~np.isnan(roots).any(axis=-1), strict=True):
        born(row, [(j, 0.0) for j in np.flatnonzero(there)], {})
    shares = [0.0, *((step - SHIFT) / STEPS for step in range(1, STEPS)), 1.0]
    for begin, end in pairwise(shares):
        new, sure = way.search(end)
        slots, is_handed_on = _handed_on(way, roots, new, slots, begin, end)
        roots, decided = new, decided & sure & is_handed_on
    return _fitted(slots, most), decided


def _fitted(slots, most):
    """Return the first slots, with the roots of the spare slots in those of them that are free."""
    fitted = slots[:, :most].copy()
    for spare in slots[:, most:].T:
        moved = (spare >= 0) & (fitted < 0).any(axis=1)
        fitted[moved, (fitted[moved] < 0).argmax(axis=1)] = spare[moved]
    return fitted


def born(slots, new, freed) -> None:
    """Store new roots in the first slots that are free where each root appears; leave out a root without a free slot.

    The slots of one point are changed in place. New are (number of the root, fraction of the path where it appears);
    `freed` has for a slot the fraction from which it is free; the others always were.
    """
    shares = sorted({share for _, share in new})
    first = {}
    for k, share in enumerate(shares):  # both of a fold are there at once, but for a rounding
        first[share] = first[shares[k - 1]] if k and share - shares[k - 1] <= GAP else share
    for j, share in sorted(new, key=lambda root: (first[root[1]], root[0])):
        free = [k for k, root in enumerate(slots) if root < 0 and freed.get(k, -1.0) <= share + GAP]
        if free:
            slots[free[0]] = j


# -- one step


def _handed_on(way, old, new, slots, begin, end):
    """Return the slots with the numbers of the new roots, and whether that is decided, of each point."""
    point, slot = np.nonzero(slots >= 0)
    forth = _carried(way, point, old[point, slots[point, slot]], begin, end)
    root = _met(way, new, point, forth, way.bounds(end))
    result, decided = np.full(slots.shape, -1), np.ones(len(slots), dtype=bool)
    result[point, slot] = root
    decided[point[forth.through & (root < 0) & ~way.outside(forth.place, way.bounds(end)[point])]] = False
    claimed = np.zeros(new.shape[:2], dtype=bool)
    claimed[point[root >= 0], root[root >= 0]] = True
    rest, number = np.nonzero(~claimed & ~np.isnan(new).any(axis=-1))
    back = _carried(way, rest, new[rest, number], end, begin)
    freed = np.where(forth.through, end, forth.share)  # one that came through has left the bounds
    for k in np.unique(np.concatenate([rest, point[root < 0]])):
        a, b = np.flatnonzero((point == k) & (root < 0)), np.flatnonzero(rest == k)
        before = old[k, slots[k, slot[a]]]
        still = np.array_equal(*(way.parameters(np.array([k]), share) for share in (begin, end)))
        pairs, sure = _paired(way, before, (forth, a), (back, b), way.bounds(end)[k], still)
        decided[k] &= sure
        for i, j in pairs:
            result[k, slot[a[i]]] = number[b[j]]
        left = [j for j in range(b.size) if j not in {pair[1] for pair in pairs}]
        born(result[k], [(number[b[j]], back.share[b[j]]) for j in left], dict(zip(slot[a], freed[a], strict=True)))
    return result, decided


def _carried(way, point, place, begin, end) -> Carried:
    bounds = way.bounds(begin)[point]
    return carried(way.slopes, way.parameters, point, place, begin, end, bounds[..., 1] - bounds[..., 0])


def _met(way, new, point, forth, bounds):
    """Return the number of the new root that each one is proved to have become, -1 for none."""
    width = (bounds[..., 1] - bounds[..., 0])[point]
    apart = way.apart(forth.place[:, None], new[point], width[:, None])
    apart = np.where(np.isnan(apart) | ~forth.through[:, None], np.inf, apart)
    if not apart.size:
        return np.full(point.size, -1)
    return np.where(apart.min(axis=1) <= SAME, apart.argmin(axis=1), -1)


def _paired(way, before, ahead, behind, bounds, still):
    """Return which of a point's old stopped roots is which new stopped one, and whether that is certain.

    The old ones were at `before`, shape (roots, n); `ahead` and `behind` say what became of all old and all new ones,
    and which of them are this point's; `still` says whether the path stands still.
    """
    (forth, a), (back, b) = ahead, behind
    stopped, started = ~forth.through[a], ~back.through[b] | ~way.outside(back.place[b], bounds)
    width = bounds[:, 1] - bounds[:, 0]
    gap = (back.share[b] - forth.share[a, None]) * (not still)
    led = forth.place[a, None] + forth.speed[a, None] * gap[..., None]
    met = back.place[b] - back.speed[b] * gap[..., None]
    cost = np.maximum(way.apart(led, back.place[b], width), way.apart(met, forth.place[a, None], width))
    cost = np.where(stopped[:, None] & started & (np.abs(gap) <= GAP), cost, np.inf)
    proved = back.through[b] & (way.apart(before[:, None], back.place[b], width) <= SAME)
    cost = np.where(proved & stopped[:, None], 0.0, cost)
    pairs, sure = [], True
    while cost.size and cost.min() <= NEAR:
        i, j = np.unravel_index(cost.argmin(), cost.shape)
        best, others = cost[i, j], np.concatenate([np.delete(cost[i], j), np.delete(cost[:, j], i)])
        sure &= bool((best <= SURE * others).all())
        cost[i], cost[:, j] = np.inf, np.inf
        pairs.append((i, j))
    alone = (stopped.sum() - len(pairs)) % 2 or (started.sum() - len(pairs)) % 2
    return pairs, sure and not alone


# -- zeros that are carried along a piece of the way


def carried(slopes: Callable, way: Callable, owner, place, begin: float, end: float, width) -> Carried:
    """Follow zeros from one fraction of the path to another, forwards or backwards.

    Args:
        slopes: (low, high), shape (boxes, n + parameters) → enclosures (boxes, n, 1 + n + parameters, 2) of F and its
            derivatives by variables and parameters, and states (boxes,).
        way: (owner, share) → parameters, shape (zeros, parameters).
        owner: whose each zero is, as `way` takes it.
        place: where each is at `begin`, shape (zeros, n).
        begin: fraction of the path where they are.
        end: fraction of the path where they go.
        width: ranges of the variables, shape (zeros, n): what is small and what is large.
    """
    x, s = place.copy(), np.full(owner.size, begin)
    speed, step, careful = np.zeros(place.shape), np.full(owner.size, end - begin), np.zeros(owner.size, dtype=bool)
    shortest = abs(end - begin) * 2.0**-HALVINGS
    active = np.arange(owner.size)
    with np.errstate(all="ignore"):
        for _ in range(STALLED):
            if not active.size:
                break
            there = s[active] + step[active]
            there = np.where((there - end) * np.sign(step[active]) >= 0.0, end, there)
            ends = [way(owner[active], share) for share in (s[active], there)]
            guess = x[active] + speed[active] * (there - s[active])[:, None]
            arrived = _passed(slopes, x[active], guess, *ends, width[active])
            good = np.isfinite(arrived).all(axis=1)
            won = active[good]
            speed[won] = (arrived[good] - x[won]) / (there[good] - s[won])[:, None]
            x[won], s[won] = arrived[good], there[good]
            step[active] *= np.where(good, np.where(careful[active], 1.0, 2.0), 0.5)
            careful[active] = ~good  # one more of the same length before longer ones are tried again
            active = active[(s[active] != end) & (np.abs(step[active]) >= shortest)]
    return Carried(x, s, speed, s == end)


def _passed(slopes, x, guess, p, q, width):
    """Return the places at the ends of pieces from parameters p to q; NaN where identity of zeros is not proved."""
    y, n = guess, x.shape[1]
    for _ in range(NEWTON):
        at = np.concatenate([y, q], axis=1)
        values = slopes(at, at)[0][:, :, : 1 + n].mean(axis=-1)
        values[~np.isfinite(values).all(axis=(1, 2))] = np.nan
        step = by_matrix(np.linalg.solve, values[:, :, 1:], values[:, :, :1])[..., 0]  # NaN where J is singular
        y = y - step
        if not (np.abs(step) > FOUND * width).any():
            break
    left = np.flatnonzero((np.abs(y - x) < LEAP * width).all(axis=1))  # no NaN
    arrived = np.full(x.shape, np.nan)
    if left.size:
        begin, end = (np.concatenate(z, axis=1)[left] for z in ((x, p), (y, q)))
        proved = left[_single(slopes, begin, end, width[left])]
        arrived[proved] = y[proved]
    return arrived


def _single(slopes, begin, end, width):
    """Return whether a box on a straight way between places and parameters holds one zero all the way."""
    n, middle = width.shape[1], 0.5 * (begin + end)
    here, _ = slopes(middle, middle)
    F, J = here[:, :, 0], here[:, :, 1 : 1 + n].mean(axis=-1)
    proved, left = np.zeros(len(width), dtype=bool), np.flatnonzero(np.linalg.det(np.nan_to_num(J)) != 0.0)
    left = left[np.isfinite(J[left]).all(axis=(1, 2))]
    Y, r = np.linalg.inv(J[left]), LEAST * width[left]
    for _ in range(GROWTHS):
        if not left.size:
            break
        given, share = _needed(slopes, F[left], Y, begin[left], end[left], r)
        need = SLACK * (given + np.einsum("bij,bj->bi", share, r))
        inside = (need < r).all(axis=1)
        proved[left[inside]] = True
        open_ = np.flatnonzero(~inside & ((share @ r[:, :, None])[..., 0] < r).all(axis=1))  # no NaN
        larger = np.linalg.solve(np.eye(n) - share[open_], LARGER * given[open_][:, :, None])[..., 0]
        left, Y, r = left[open_], Y[open_], np.maximum(r[open_], larger)
        kept = (r < LEAP * width[left]).all(axis=1)
        left, Y, r = left[kept], Y[kept], r[kept]
    return proved


def _needed(slopes, F, Y, begin, end, r):
    """Return the size of Y F all the way, shape (boxes, n), and |1 - Y J| in the box; NaN where F breaks."""
    n, change = r.shape[1], np.abs(end - begin)
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    low[:, :n], high[:, :n] = low[:, :n] - SLACK * r, high[:, :n] + SLACK * r
    values, states = slopes(low, high)
    D, spread = 0.5 * (values[:, :, 1:].sum(axis=-1)), SLACK * 0.5 * (values[:, :, 1:, 1] - values[:, :, 1:, 0])
    absolute, size = np.abs(Y), np.abs(values[:, :, 1:]).max(axis=-1)
    rounding = (n + 8) * UNIT
    spread = spread + rounding * size
    moved = np.einsum("bij,bj->bi", D, end - begin)
    reach = np.einsum("bij,bj->bi", spread, change)
    drift = np.abs(np.einsum("bij,bj->bi", Y, moved)) + np.einsum("bij,bj->bi", absolute, reach)
    start = np.abs(np.einsum("bij,bj->bi", Y, F.mean(axis=-1)))
    start += np.einsum("bij,bj->bi", absolute, 0.5 * (F[..., 1] - F[..., 0]) + rounding * np.abs(F).max(axis=-1))
    bent = np.abs(np.eye(n) - Y @ D[:, :, :n]) + absolute @ spread[:, :, :n] + rounding * np.eye(n)
    bent[states >= POLE] = np.nan
    return SLACK * (start + 0.5 * drift), bent
