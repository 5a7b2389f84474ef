"""Branches: equilibria that keep their slots through folds and pitchforks.

Which root of one point is which root of another has no answer but along a way from one to the other. The way here leads
from the parameters' defaults to the point, each parameter on a straight line of its own (of its logarithm where both
ends are positive), in `STEPS` steps. So a point's branches depend on the description and the point alone, never on what
other points a sweep has, in which order, or in which shard.

At each step all roots are searched anew, with the proof that there are so many. Those that were there before are handed
on: roots of one coordinate cannot pass each other, so of all ways to pair old ones with new ones in their order those
with the most pairs count, and of these the one that moves them least. An old root that is left over has met another and
vanished (a fold), and its slot is free; a new one takes the first slot that is. At a pitchfork the branch that stays
where it was keeps its slot, and the two beside it are new.

What no way can tell: where a loop about a cusp changes which root is which, the slots of neighbouring points change
somewhere on it. Steps that are longer than roots are apart may mistake one branch for another.
"""

from collections.abc import Callable

import numpy as np

STEPS = 32
SPARE = 8  # slots on the way, beyond those there is room for at its end
PAIR = 1e3  # what a pair is worth, in ranges that roots move


def followed(search: Callable, defaults, parameters, most: int, periodic: bool) -> np.ndarray:
    """Which root each slot holds.

    Args:
        search: parameters → roots in shares of the range between the bounds, NaN for none, shape (points, count).
        defaults: one number a parameter.
        parameters: one array (points,) a parameter.
        most: number of slots.
        periodic: whether the range closes.

    Returns:
        Numbers of the roots that `search` gives at the parameters, shape (points, most); -1 for a slot that is empty. A
        point with more roots than slots shows some of them.
    """
    points = parameters[0].size
    roots = search([np.full(points, float(d)) for d in defaults])
    slots = _born(np.full((points, most + SPARE), -1), roots)
    for step in range(1, STEPS + 1):
        before = _taken(roots, slots)
        share = step / STEPS
        roots = search([_between(d, p, share) for d, p in zip(defaults, parameters, strict=True)])
        slots = _born(_handed_on(before, roots, periodic), roots)
    return _fitted(slots, most)


def _between(default, values, share):
    """A place on the way from a default to values: their own where it ends."""
    if share == 1.0:
        return values
    straight = default + share * (values - default)
    with np.errstate(all="ignore"):
        curved = default ** (1.0 - share) * values**share if default > 0 else straight
    return np.where((values > 0.0) & (default > 0.0), curved, straight)


def _taken(roots, slots):
    """Places in slots; NaN in empty ones."""
    return np.where(slots >= 0, np.take_along_axis(roots, np.maximum(slots, 0), axis=1), np.nan)


def _born(slots, roots):
    """Slots with those roots put into the first free ones that no slot holds yet; what finds no room is left out."""
    slots = slots.copy()
    for j in range(roots.shape[1]):
        new = ~np.isnan(roots[:, j]) & ~(slots == j).any(axis=1) & (slots < 0).any(axis=1)
        slots[new, (slots[new] < 0).argmax(axis=1)] = j
    return slots


def _fitted(slots, most):
    """The first slots, with what the spare ones hold in those of them that are free."""
    fitted = slots[:, :most].copy()
    for spare in slots[:, most:].T:
        moved = (spare >= 0) & (fitted < 0).any(axis=1)
        fitted[moved, (fitted[moved] < 0).argmax(axis=1)] = spare[moved]
    return fitted


def _handed_on(old, new, periodic):
    """Numbers of the new roots that the old ones have become, shape of `old`; -1 for those that vanished."""
    cut = _cut(old) if periodic else np.zeros(len(old))
    old, new = (np.mod(x - cut[:, None], 1.0) if periodic else x for x in (old, new))
    first, second = np.argsort(old, axis=1), np.argsort(new, axis=1)  # NaN last
    pairs = _paired(np.take_along_axis(old, first, axis=1), np.take_along_axis(new, second, axis=1))
    told = np.where(pairs >= 0, np.take_along_axis(second, np.maximum(pairs, 0), axis=1), -1)
    slots = np.full(old.shape, -1)
    np.put_along_axis(slots, first, told, axis=1)
    return slots


def _cut(places):
    """The middle of the widest gap between places of a range that closes, where no root passes."""
    ordered = np.sort(places, axis=1)
    count = (~np.isnan(ordered)).sum(axis=1)
    after = np.roll(ordered, -1, axis=1)
    last = np.maximum(count - 1, 0)
    rows = np.arange(len(places))
    after[rows, last] = ordered[:, 0] + 1.0
    gap = np.nan_to_num(after - ordered, nan=-1.0)
    widest = gap.argmax(axis=1)
    return np.where(count > 0, ordered[rows, widest] + 0.5 * gap[rows, widest], 0.0)


def _paired(old, new):
    """For each of the old places the number of the new one that it pairs with in order, or -1; both ascending."""
    points, m, c = len(old), old.shape[1], new.shape[1]
    best = np.zeros((m + 1, c + 1, points))
    taken = np.zeros((m + 1, c + 1, points), dtype=np.int8)  # 0: pair, 1: the old one vanishes, 2: the new one is new
    taken[1:, 0], taken[0, 1:] = 1, 2
    for i in range(1, m + 1):
        for j in range(1, c + 1):
            pair = np.nan_to_num(PAIR - np.abs(old[:, i - 1] - new[:, j - 1]), nan=-np.inf)
            ways = np.stack([best[i - 1, j - 1] + pair, best[i - 1, j], best[i, j - 1]])
            taken[i, j] = ways.argmax(axis=0)
            best[i, j] = ways.max(axis=0)
    found, rows = np.full((points, m), -1), np.arange(points)
    i, j = np.full(points, m), np.full(points, c)
    for _ in range(m + c):
        way, inside = taken[i, j, rows], (i > 0) | (j > 0)
        pair = inside & (way == 0)
        found[rows[pair], i[pair] - 1] = j[pair] - 1
        i, j = i - (inside & (way != 2)), j - (inside & (way != 1))
    return found
