"""All equilibria of many points within bounds: where every ∂V/∂q vanishes.

They are looked for by enclosures (`line` for one coordinate, `boxes` for several), so that "there are k" is proved, or
it is said that it is not:

* PROVED: each place is alone in a box, and nothing else of the bounds holds one.
* UNDECIDED: some place (a double root, a triple one, a pitchfork on the spot, a line that is held) is there as far as
  numbers can tell, but rounding hides whether it is one, several or none; all else is proved.
* SEARCHED: subdivision did not end. Newton's method from the boxes that were left and from the places that the
  description names found what is given; that it is all cannot be proved.

Where V stays flat along a line through an equilibrium there is no single place: such a point is FLAT and has none,
unless the description holds a coordinate there. A point with more equilibria than `most`, or with one that is near no
name where no room is left, is CROWDED and has none either.

Nothing here knows a unit: places are compared over their bounds, forces over what they amount to near the place.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sweeps.mechanics import boxes, branches, line
from sweeps.mechanics.description import DescriptionError
from sweeps.mechanics.landscape import Landscape

PROVED, UNDECIDED, SEARCHED = range(3)

OFFSET = 0.3819660112501051  # a search of a periodic coordinate starts off the round numbers
SAME = 1e-7  # of the range: names nearer to each other than this fall together
STARTS = 128  # of a point whose subdivision did not end
ITERATIONS = 60
NEAR = 1e-3  # of the range: within this of a place its force is measured
STILL = 1e-8  # of that force
BOUND = 1e-12  # of the range: a place so far outside is at the bound
CHUNK = 1 << 12  # points at a time; a search of several coordinates takes fewer
CHUNK_SEVERAL = 256
FAR = 0.25  # of the range: no name reaches farther


@dataclass(frozen=True)
class Found:
    """Equilibria of points.

    Attributes:
        places: q0, shape (points, most, n); NaN where a point has no such equilibrium.
        flat: shape (points,), whether the equilibria form a line.
        certified: shape (points,), PROVED, UNDECIDED or SEARCHED.
        counts: shape (points,), how many there are, of which a crowded point shows none.
        crowded: shape (points,), whether they are more than there is room for.
        decided: shape (points,), whether it is known which of them is which branch, where branches are followed.
    """

    places: np.ndarray
    flat: np.ndarray
    certified: np.ndarray
    counts: np.ndarray
    crowded: np.ndarray
    decided: np.ndarray

    def __getitem__(self, index) -> "Found":
        """Some of the points."""
        return Found(*(getattr(self, name)[index] for name in self.__dataclass_fields__))


def joined(parts: Sequence[Found]) -> Found:
    """Points one after the other."""
    return Found(*(np.concatenate([getattr(p, name) for p in parts]) for name in Found.__dataclass_fields__))


def _size(parameters):
    return parameters[0].size


def find(landscape: Landscape, parameters) -> Found:
    """All equilibria of points, of which one array (points,) a parameter is given, in the description's order."""
    given = [np.atleast_1d(np.asarray(p, dtype=np.float64)) for p in parameters] or [np.zeros(1)]
    pairs = zip(landscape.canonical, given, strict=True)
    rows = [p if default is None else np.full_like(p, default) for default, p in pairs]
    first, inverse = _points(rows)
    rows = [p[first] for p in rows]
    asked, known, found = b"".join(p.tobytes() for p in rows), *landscape.last
    if asked != known:
        found = _find(landscape, rows)
        landscape.last = asked, found
    return found[inverse]


def refuse_crowded(landscape: Landscape, found: Found, parameters) -> None:
    """Refuses points that have more equilibria than there is room for.

    Raises:
        DescriptionError: for the first of them.
    """
    if not found.crowded.any():
        return
    system, point = landscape.equations.system, int(np.argmax(found.crowded))
    count = found.counts[point]
    wrong = f"there are {count}" if count > system.most else "one is near no name, and there is no room left"
    values = ", ".join(f"{name}={p[point]:g}" for name, p in zip(system.parameters, parameters, strict=False))
    allowed = f"at most {system.most} (`most`, or their names)"
    raise DescriptionError(f"equilibria: {wrong}, at {values or 'the only point'}; allowed: {allowed}")


def _points(rows):
    """Numbers of points that all differ, in ascending order of the rows, and which of them each point equals."""
    code = np.zeros(rows[0].size if rows else 1, dtype=np.int64)
    for row in rows:
        if (row[1:] != row[:-1]).any():  # sorting is most of the work, and most parameters are constant
            values, number = np.unique(row, return_inverse=True)
            _, code = np.unique(code * values.size + number, return_inverse=True)
    _, first, inverse = np.unique(code, return_index=True, return_inverse=True)
    return first, inverse


def _find(landscape, parameters):
    several = len(landscape.free) > 1
    chunk, parts = CHUNK_SEVERAL if several else CHUNK, []
    for start in range(0, _size(parameters), chunk):
        part = tuple(p[start : start + chunk] for p in parameters)
        with np.errstate(all="ignore"):
            places, flat, certified = (_space if several else _line)(landscape, part)
            places[flat] = np.nan
            places = _sorted(landscape, part, places)
            decided = np.ones(_size(part), dtype=bool)
            if landscape.equations.system.follow:
                slots, crowded, decided = _followed(landscape, part, places)
            else:
                slots, crowded = _arranged(landscape, part, places)
        counts = (~np.isnan(places).any(axis=-1)).sum(axis=1)
        parts.append(Found(slots, flat, certified.astype(np.int8), counts, crowded, decided))
    return joined(parts)


def _searched(landscape, parameters):
    """Bounds of the free coordinates, shape (points, free, 2): one turn of a periodic one, off the round numbers."""
    bounds = landscape.bounds(parameters)[:, landscape.free].copy()
    for k, i in enumerate(landscape.free):
        if landscape.equations.system.kept[i].periodic:
            bounds[:, k] += OFFSET * (bounds[:, k, 1] - bounds[:, k, 0])[:, None]
    return bounds


def _held(landscape, parameters):
    return [h for i, h in enumerate(landscape.holds(parameters).T) if i not in landscape.free]


def _constants(landscape, parameters):
    return landscape.tape.constants([*parameters, *_held(landscape, parameters)])


def _full(landscape, parameters, places):
    """Places of all coordinates from those of the free ones: (points, count, free) → (points, count, n), wrapped."""
    bounds, holds = landscape.bounds(parameters), landscape.holds(parameters)
    full = np.broadcast_to(holds[:, None, :], (*places.shape[:2], landscape.n)).copy()
    for k, i in enumerate(landscape.free):
        low, high = bounds[:, None, i, 0], bounds[:, None, i, 1]
        x = places[..., k]
        if landscape.equations.system.kept[i].periodic:
            x = np.where(x > high, x - (high - low), x)
            x = np.where(x - low < 1e-12 * (high - low), high - np.maximum(low - x, 0.0), x)
        full[..., i] = x
    full[np.isnan(places).any(axis=-1)] = np.nan
    return full


# -- one coordinate


def _line(landscape, parameters):
    constants, bounds = _constants(landscape, parameters), _searched(landscape, parameters)[:, 0]
    fixed = [*parameters, *_held(landscape, parameters)]
    bounds = np.broadcast_to(bounds, (_size(parameters), 2))

    def curve(owner, low, high):
        values, states = landscape.tape.curves(constants, owner, low, high)
        return values[:, 0], states

    def slope(owner, low, high):
        values, states = landscape.tape.slopes(constants, owner, low[:, None], high[:, None])
        return values[:, 0], states

    def plain(owner, x):
        return landscape.force([p[owner] for p in fixed], x)

    zeros = line.zeros(curve, bounds[:, 0], bounds[:, 1], plain, slope)
    table = _table(zeros.owner, zeros.place, bounds.shape[0])
    places = _full(landscape, parameters, table[..., None])
    certified = np.where(zeros.exhausted, SEARCHED, np.where(zeros.proved, PROVED, UNDECIDED))
    return _still(landscape, parameters, places), zeros.flat, certified


def _table(rows, values, points):
    """Ragged (row, value) pairs as an array (points, longest), NaN beyond each row's own."""
    order = np.lexsort((values, rows))
    rows, values = rows[order], values[order]
    table = np.full((points, max(np.bincount(rows, minlength=points).max(initial=0), 1)), np.nan)
    table[rows, _positions(rows, points)] = values
    return table


def _positions(rows, points):
    """The position of each item in its row, for rows in ascending order."""
    counts = np.bincount(rows, minlength=points)
    return np.arange(rows.size) - np.repeat(np.cumsum(counts) - counts, counts)


# -- several coordinates


def _space(landscape, parameters):
    constants, bounds = _constants(landscape, parameters), _searched(landscape, parameters)
    points = _size(parameters)
    low, high = np.ascontiguousarray(bounds[..., 0]), np.ascontiguousarray(bounds[..., 1])

    def slopes(owner, a, b):
        return landscape.tape.slopes(constants, owner, a, b)

    zeros = boxes.zeros(slopes, low, high)
    certified = np.full(points, PROVED)
    owner, place, hidden = zeros.owner, zeros.place, np.zeros(zeros.owner.size, dtype=bool)
    if zeros.left[0].size:
        more, covered = _left(landscape, parameters, slopes, zeros, low, high)
        wide = ((zeros.left[2] - zeros.left[1]) > 2.0 * boxes.NARROWEST * (high - low)[zeros.left[0]]).any(axis=1)
        certified[zeros.left[0][~covered]] = UNDECIDED
        certified[zeros.left[0][wide & ~covered]] = SEARCHED
        owner, place = np.concatenate([owner, more[0]]), np.concatenate([place, more[1]])
        hidden = np.concatenate([hidden, more[2]])
    order = np.argsort(owner, kind="stable")
    owner, place, hidden = owner[order], place[order], hidden[order]
    count = max(np.bincount(owner, minlength=points).max(initial=0), 1)
    table, doubt = np.full((points, count, low.shape[1]), np.nan), np.zeros((points, count), dtype=bool)
    positions = _positions(owner, points)
    table[owner, positions], doubt[owner, positions] = place, hidden
    places = _full(landscape, parameters, table)
    flat = _flat(landscape, parameters, places, doubt)
    return _still(landscape, parameters, places), flat, certified


def _left(landscape, parameters, slopes, zeros, low, high):
    """Zeros that Newton's method finds from the boxes that were left.

    Returns:
        (owner, place, whether no box proves it), and for each box that was left whether it lies in one that does.
    """
    owner, place = _descended(slopes, *_starts(landscape, parameters, zeros.left, low, high), low, high)
    wide = (high - low)[owner]
    inside = ((place >= low[owner] - BOUND * wide) & (place <= high[owner] + BOUND * wide)).all(axis=1)
    owner, place, wide = owner[inside], place[inside], wide[inside]
    proved, a, b = _proved(slopes, owner, place, wide)
    still = _resting(slopes, owner, place, NEAR * wide, low, high)
    place = np.clip(place, low[owner], high[owner])  # one at a bound, but for a rounding
    kept = np.flatnonzero(still | proved)
    kept = kept[np.lexsort((~proved[kept], owner[kept]))]
    reach = np.where(proved[:, None], 0.5 * (b - a), 0.0) + SAME * wide
    chosen: dict[int, list] = {}
    for j in kept:
        known = np.flatnonzero(zeros.owner == owner[j])
        near = (place[j] >= zeros.low[known] - SAME * wide[j]) & (place[j] <= zeros.high[known] + SAME * wide[j])
        mine = chosen.setdefault(owner[j], [])
        if not near.all(axis=1).any() and not any((np.abs(place[k] - place[j]) <= reach[k]).all() for k in mine):
            mine.append(j)
    rows = np.array([j for mine in chosen.values() for j in mine], dtype=np.int64)
    covered = np.zeros(zeros.left[0].size, dtype=bool)
    for j in rows[proved[rows]]:
        inside = (zeros.left[1] >= a[j]) & (zeros.left[2] <= b[j])
        covered |= (zeros.left[0] == owner[j]) & inside.all(axis=1)
    return (owner[rows], place[rows], ~proved[rows]), covered


def _resting(slopes, owner, place, near, low, high):
    """Whether the force at places is nothing beside what it amounts to nearby."""
    about = slopes(owner, np.maximum(place - near, low[owner]), np.minimum(place + near, high[owner]))[0]
    force = np.abs(slopes(owner, place, place)[0][:, :, 0]).max(axis=-1)
    return (force <= STILL * np.abs(about[:, :, 0]).max(axis=-1)).all(axis=1)


def _starts(landscape, parameters, left, low, high):
    """Places to start from: evenly many of the boxes that were left, and what the description names."""
    owner, place = [], []
    free = landscape.free
    for point in np.unique(left[0]):
        rows = np.flatnonzero(left[0] == point)
        rows = rows[np.linspace(0, rows.size - 1, min(rows.size, STARTS)).astype(np.int64)]
        place.append(0.5 * (left[1][rows] + left[2][rows]))
        owner.append(np.full(rows.size, point))
        names = landscape.labels(tuple(p[point : point + 1] for p in parameters))[0][:, free]
        names = names[np.isfinite(names).all(axis=1)]
        for k, i in enumerate(free):
            if landscape.equations.system.kept[i].periodic:
                names[:, k] = low[point, k] + np.mod(names[:, k] - low[point, k], (high - low)[point, k])
        place.append(names)
        owner.append(np.full(len(names), point))
    return np.concatenate(owner), np.concatenate(place)


def _descended(slopes, owner, place, low, high):
    """Newton's method with steps of a fifth of the bounds at most; where J is singular, its least step."""
    place, width = place.copy(), (high - low)[owner]
    active = np.arange(owner.size)
    for _ in range(ITERATIONS):
        if active.size == 0:
            break
        values = slopes(owner[active], place[active], place[active])[0].mean(axis=-1)
        F, J = values[:, :, 0], values[:, :, 1:] * width[active][:, None, :]
        rows = np.abs(J).max(axis=2)
        rows = np.where(rows > 0.0, rows, 1.0)
        F, J = F / rows, J / rows[:, :, None]
        sound = np.isfinite(F).all(axis=1) & np.isfinite(J).all(axis=(1, 2))
        step = np.full(F.shape, np.nan)
        step[sound] = -(np.linalg.pinv(J[sound], rcond=1e-13) @ F[sound][:, :, None])[..., 0]
        step *= np.minimum(1.0, 0.2 / np.maximum(np.linalg.norm(step, axis=1), 1e-300))[:, None]
        place[active] += step * width[active]
        active = active[np.abs(step).max(axis=1) > 1e-15]
    return owner, place


def _proved(slopes, owner, place, wide):
    """Whether a box about each place holds one zero, and such a box."""
    proved = np.zeros(owner.size, dtype=bool)
    a, b = place.copy(), place.copy()
    for part in (1e-4, 1e-7, 1e-10):
        rows = np.flatnonzero(~proved & np.isfinite(place).all(axis=1))
        if not rows.size:
            break
        x, y = place[rows] - part * wide[rows], place[rows] + part * wide[rows]
        one = boxes.alone(slopes, owner[rows], x, y)
        proved[rows[one]], a[rows[one]], b[rows[one]] = True, x[one], y[one]
    return proved, a, b


def _flat(landscape, parameters, places, doubt):
    """Whether V″ of a place that is not proved has a null direction along which ∂V/∂q stays zero."""
    point, slot = np.nonzero(doubt & ~np.isnan(places).any(axis=-1))
    flat = np.zeros(places.shape[0], dtype=bool)
    if not point.size:
        return flat
    q, chosen = places[point, slot], [p[point] for p in parameters]
    width = landscape.bounds(chosen)[:, landscape.free]
    width = width[..., 1] - width[..., 0]
    free = np.ix_(landscape.free, landscape.free)
    hessian = landscape.hessian(chosen, list(q.T))[:, free[0], free[1]] * width[:, :, None] * width[:, None, :]
    terms = landscape.hessian_terms(chosen, list(q.T))[:, free[0], free[1]] * width[:, :, None] * width[:, None, :]
    scale = terms.max(axis=(1, 2))
    good = np.isfinite(hessian).all(axis=(1, 2))
    values, vectors = np.linalg.eigh(np.where(good[:, None, None], hessian, 0.0))
    for k in range(len(landscape.free)):
        still = good & (np.abs(values[:, k]) <= 1e-9 * scale)
        for step in (-0.01, 0.01):
            moved = q.copy()
            moved[:, landscape.free] += step * vectors[:, :, k] * width
            force = landscape.enclosed(chosen, moved, moved)[0][:, landscape.free, 0]
            blur = np.abs(force).max(axis=2) * width <= 1e-9 * scale[:, None]
            still &= blur.all(axis=1)
        flat[point[still]] = True
    return flat


# -- both


def _still(landscape, parameters, places):
    """Places at which ∂V/∂q vanishes also by the coordinates that are held; NaN in place of others."""
    held = [i for i in range(landscape.n) if i not in landscape.free]
    point, slot = np.nonzero(~np.isnan(places).any(axis=-1))
    if not held or not point.size:
        return places
    q, chosen = places[point, slot], [p[point] for p in parameters]
    bounds = landscape.bounds(chosen)
    wide = NEAR * (bounds[..., 1] - bounds[..., 0])
    force = np.abs(landscape.enclosed(chosen, q, q)[0][:, held, 0]).max(axis=-1)
    near = np.abs(landscape.enclosed(chosen, q - wide, q + wide)[0][:, held, 0]).max(axis=-1)
    moving = ~(force <= STILL * near).all(axis=1)
    places = places.copy()
    places[point[moving], slot[moving]] = np.nan
    return places


def _followed(landscape, parameters, places):
    """Places in the slots of their branches, which points have more than there is room for, and which are decided."""
    system = landscape.equations.system
    held, decided = branches.followed(_way(landscape, parameters, places), system.most)
    slots = np.take_along_axis(places, np.maximum(held, 0)[..., None], axis=1)
    slots = np.where(held[..., None] >= 0, slots, np.nan)
    crowded = (~np.isnan(places).any(axis=-1)).sum(axis=1) > system.most
    slots[crowded] = np.nan
    return slots, crowded, decided


def _way(landscape, parameters, places):
    """The way from the parameters' defaults to points whose places are found already."""
    free, kept = landscape.free, landscape.equations.system.kept
    defaults = [p.default for p in landscape.equations.system.parameters.values()] or [0.0]

    def at(share, points=slice(None)):
        return [_between(d, p[points], share) for d, p in zip(defaults, parameters, strict=True)]

    def search(share):
        if share == 1.0:
            return places[..., free], np.ones(_size(parameters), dtype=bool)  # of which `certified` tells
        there = at(share) if share else [p[:1] for p in at(share)]
        found, flat, certified = (_space if len(free) > 1 else _line)(landscape, tuple(there))
        found[flat] = np.nan
        found = _sorted(landscape, there, found)[..., free]
        sure = certified != SEARCHED
        return found.repeat(1 if share else _size(parameters), axis=0), sure & np.ones(_size(parameters), dtype=bool)

    def slopes(low, high):
        numbers, owner = landscape.followed.constants([]), np.zeros(len(low), dtype=np.int64)
        return landscape.followed.slopes(numbers, owner, low, high)

    def along(points, share):
        count = len(landscape.equations.parameters)
        return np.stack(at(share, points), axis=-1)[:, :count]

    def bounds(share):
        return np.broadcast_to(landscape.bounds(at(share)), (_size(parameters), landscape.n, 2))[:, free]

    return branches.Way(search, slopes, along, bounds, np.array([kept[i].periodic for i in free]))


def _between(default, values, share):
    """A place on the way from a default to values: their own where it ends."""
    straight = default + share * (values - default)
    with np.errstate(all="ignore"):
        curved = default ** (1.0 - share) * values**share if default > 0 else straight
    between = np.where((values > 0.0) & (default > 0.0), curved, straight)
    return np.where(share == 1.0, values, np.where(share == 0.0, default, between))


def _distances(landscape, a, b, bounds):
    """Largest distance by any coordinate between places, over its range; periodic ones the short way."""
    width = bounds[..., 1] - bounds[..., 0]
    apart = np.abs(a - b) / np.where(width > 0.0, width, 1.0)
    periodic = np.array([c.periodic for c in landscape.equations.system.kept])
    apart = np.where(periodic, np.abs(apart - np.round(apart)), apart)
    return np.where(np.isnan(b), 0.0, apart).max(axis=-1)


def _sorted(landscape, parameters, places):
    """Places in the order of their coordinates, NaN last."""
    bounds = landscape.bounds(parameters)
    part = (places - bounds[:, None, :, 0]) / (bounds[..., 1] - bounds[..., 0])[:, None]
    keys = [np.where(np.isnan(places[..., 0]), np.inf, np.round(part[..., i], 9)) for i in range(places.shape[2])]
    order = np.lexsort([places[..., 0], *keys[::-1]], axis=1)
    return np.take_along_axis(places, order[..., None], axis=1)


def _arranged(landscape, parameters, places):
    """Places in the slots of the dimension `equilibrium`, and which points have more than there is room for.

    Those with names come first, each nearest to its name.
    """
    system = landscape.equations.system
    points, count, n = places.shape
    labels, bounds = landscape.labels(parameters), landscape.bounds(parameters)
    slots = np.full((points, system.most, n), np.nan)
    here = ~np.isnan(places).any(axis=-1)
    left = here.copy()
    cost = np.full((points, labels.shape[1], count), np.inf)
    for k in range(labels.shape[1]):
        named = ~np.isnan(labels[:, k]).all(axis=1)
        d = _distances(landscape, places, labels[:, k : k + 1], bounds[:, None])
        d = np.round(d / SAME) * SAME  # where names fall together the first of them is meant
        cost[:, k] = np.where(left & named[:, None] & (d < FAR), d, np.inf)
    rows = np.arange(points)
    for _ in range(labels.shape[1]):
        k, j = np.divmod(cost.reshape(points, -1).argmin(axis=1), count)
        chosen = np.isfinite(cost[rows, k, j])
        slots[rows[chosen], k[chosen]] = places[rows[chosen], j[chosen]]
        left[rows[chosen], j[chosen]] = False
        cost[rows[chosen], k[chosen], :] = np.inf
        cost[rows[chosen], :, j[chosen]] = np.inf
    free = np.isnan(slots[..., 0]) & (np.arange(system.most) >= labels.shape[1])
    room, rank = free.cumsum(axis=1), left.cumsum(axis=1)  # the k-th that is left goes into the k-th slot that is free
    put = left & (rank <= room[:, -1:])
    for j in np.flatnonzero(put.any(axis=0)):
        chosen = np.flatnonzero(put[:, j])
        slot = (room[chosen] == rank[chosen, j, None]).argmax(axis=1)
        slots[chosen, slot] = places[chosen, j]
    left &= ~put
    crowded = left.any(axis=1)
    slots[crowded] = np.nan
    return slots, crowded
