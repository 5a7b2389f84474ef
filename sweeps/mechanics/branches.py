"""Branches: equilibria that keep their slots through folds and pitchforks.

Which root of one point is which root of another has no answer but along a way from one to the other. The way here leads
from the parameters' defaults to the point, each parameter on a straight line of its own (of its logarithm where both
ends are positive). So a point's branches depend on the description and the point alone, never on what other points a
sweep has, in which order, or in which shard.

At each of `STEPS` steps all roots are searched anew, with the proof that there are so many, and those that were there
are carried on to them: with a proof that each has become this one (`continuation`), as far as it meets nothing. One
that is stopped has met another there, and so has one of the new roots that, carried back, is stopped on its way to the
old ones. Of these two sorts those are one branch that lie where each other's course leads: a branch that goes straight
through a pitchfork, or through another one, keeps its slot. What is stopped and led on by none has vanished (a fold),
and its slot is free; what is new takes the first slot that is free where it comes to be.

What cannot be decided is said, by point: two that are led to one place nearly as well; one that stops or comes to be
alone, which no fold does; a search without a proof. And no way can tell this: where a loop about a cusp changes which
root is which, the slots of neighbouring points change somewhere on it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sweeps.mechanics.continuation import HALVINGS, Carried, carried

STEPS = 8
SHIFT = 0.381966  # of a step, which the steps' ends lie before round fractions of the path, where places like to meet
SPARE = 8  # slots on the path, beyond those there is room for at its end
SAME = 1e-6  # of the range: places that are one
NEAR = 0.05  # of the range: how far from where a course leads a root may lie to be led on
SURE = 0.2  # of the distance of the next best: one that is nearer than this is led on without a doubt
GAP = 64.0 / STEPS * 2.0**-HALVINGS  # of the path, between where the one stops and where the other does


@dataclass(frozen=True)
class Way:
    """The way from the defaults to points."""

    #: fraction of the path → places (points, count, n), NaN for none, and whether each point's are proved to be all
    #: that are there, (points,).
    search: Callable
    slopes: Callable  #: as of `continuation.carried`
    parameters: Callable  #: (points, shares) → parameters, as of `continuation.carried`
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

    Args:
        slots: of one point, changed in place.
        new: (number of the root, fraction of the path where it appears).
        freed: slot → fraction of the path from which it is free; the others always were.
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

    Args:
        way: the path.
        before: where the old ones are, shape (roots, n).
        ahead: the old ones: what became of all, and which of them are this point's.
        behind: the same of the new ones.
        bounds: shape (n, 2).
        still: whether the path stands still.
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
