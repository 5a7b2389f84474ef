"""All equilibria of many points within bounds, F(x) = 0: each proved, or undecided with the reason.

A branch and prune with Krawczyk's operator (`kernels.roots`) looks at all of the bounds. So "there are k" is proved, or
it is said why it is not:

* PROVED: each place is alone in a box, and nothing else of the bounds holds one.
* ROUNDING: some place (a double root, a pitchfork on the spot, two roots closer than numbers can tell) is there as far
  as numbers show, but rounding hides whether it is one, several or none; or F is beyond all numbers in a part of the
  bounds. All else is proved.
* TOO_LARGE: the subdivision did not end within its number of boxes. Newton's method from what was left and from the
  places that the description names found what is given, each proved where it can be; there may be others.
* FAMILY: equilibria form a line or more (a spin of any rate, a neutral angle). Where the description names a place and
  F is not a potential's slope, the family's member nearest to the name is given, else none: the point is flat.

A point with more equilibria than `most`, or with one that is near no name where no room is left, is CROWDED and has
none; but where named places of a flow are asked for, others are none of them, and are only counted.

Nothing here knows a unit: places are compared over their bounds, and F vanishes where its enclosure within some
roundings of a place holds 0.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components

from kernels import codes
from sweeps.mechanics import branches
from sweeps.mechanics.landscape import SINGULAR, Landscape

PROVED, ROUNDING, TOO_LARGE, FAMILY = range(4)
REASONS = {
    ROUNDING: "rounding hides whether equilibria are one, several or none",
    TOO_LARGE: "the bounds are too large to be searched to the end",
    FAMILY: "equilibria form a family",
}

OFFSET = 0.3819660112501051  # a search of a periodic coordinate starts off the round numbers
EDGE = 2.0**-20  # of the range: as far beyond the bounds is searched, so that places at a bound are inside
BOUND = 1e-12  # of the range: a place so far outside is at the bound
NARROWEST = (2.0**-50, 2.0**-32)  # boxes of one unknown and of several, over the range
WORK, LEAST = 400_000, 100  # operations of a search, times the unknowns, and boxes
ROUNDINGS, TINY = 16.0 * codes.UNIT, 0.01 * codes.UNIT  # of a place, of the range: F vanishes within
SAME = 1e-7  # of the range: places nearer to each other than this fall together
FEW, MANY = 16, 400  # narrow boxes of a point: a family fills more than any number, and is looked for after a few
STARTS = 128  # of a point whose subdivision did not end
ITERATIONS = 60
PARTS = (1e-4, 1e-7, 1e-10)  # of the range: boxes about a place that Newton's method found
ASIDE = 0.01  # of the range: a family has members so far off
FAR = 0.25  # of the range: no name reaches farther
CHUNK = 1 << 12  # points at a time
CELL = 7  # leading bits of parameters that are searched together
ROUGH = 2.0**-12  # width of boxes that are left to each of these points, and about poles, over the range
SHARING, SHARED = 3, 3  # unknowns of a search that is shared, and how many times the boxes of one point it may take


@dataclass(frozen=True)
class Found:
    """Equilibria of points."""

    places: np.ndarray  #: shape (points, most, m); NaN where a point has no such equilibrium
    hidden: np.ndarray  #: shape (points, most, m), how far rounding hides where they are; 0 where they are proved
    dimension: np.ndarray  #: shape (points, most), of the family that each lies in; 0 for one that is alone
    certified: np.ndarray  #: shape (points,), PROVED, ROUNDING, TOO_LARGE or FAMILY
    flat: np.ndarray  #: shape (points,), whether they form a family of which no member is named
    direction: np.ndarray  #: shape (points, m), along which a flat point's family goes, over the ranges; NaN elsewhere
    counts: np.ndarray  #: shape (points,), how many there are, of which a crowded point shows none
    crowded: np.ndarray  #: shape (points,), whether they are more than there is room for
    #: shape (points,), whether it is known which of them is which branch, where branches are followed.
    decided: np.ndarray
    undecided: np.ndarray  #: shape (points, m, 2), a box about all that could not be decided; NaN where all is proved
    absent: np.ndarray  #: shape (points, most), whether it is proved that there is none of a slot's name

    def __getitem__(self, index) -> "Found":
        """Return the selected points."""
        return Found(*(getattr(self, name)[index] for name in self.__dataclass_fields__))


def find(problem: Landscape, parameters) -> Found:
    """Find all equilibria of points, given as one array (points,) for each parameter, in the description's order."""
    given = [np.atleast_1d(np.asarray(p, dtype=np.float64)) for p in parameters] or [np.zeros(1)]
    pairs = zip(problem.canonical, given, strict=True)
    rows = [p if default is None else np.full_like(p, default) for default, p in pairs]
    first, inverse = _points(rows)
    rows = [p[first] for p in rows]
    key, last_key, equilibria = b"".join(p.tobytes() for p in rows), *problem.last
    if key != last_key:
        chunks = [[p[start : start + CHUNK] for p in rows] for start in range(0, first.size, CHUNK)]
        parts = [_found(problem, chunk) for chunk in chunks]
        equilibria = Found(*(np.concatenate([getattr(p, name) for p in parts]) for name in Found.__dataclass_fields__))
        problem.last = key, equilibria
    return equilibria[inverse]


def refusal(problem: Landscape, equilibria: Found, parameters) -> str:
    """Return why none of the points has an equilibrium to begin from, or each too many; the empty string if one has."""
    if equilibria.crowded.all():
        return _crowded(problem, equilibria, parameters)
    if equilibria.crowded.any() or not np.isnan(equilibria.places).all():
        return ""
    if equilibria.flat.any():
        return _symmetry(problem, equilibria.direction[equilibria.flat.argmax()])
    points, open_ = equilibria.counts.size, np.flatnonzero(~equilibria.absent.all(axis=1))
    if open_.size:
        reason = REASONS[int(equilibria.certified[open_].max())]
        return (
            f"none is found and none excluded at {open_.size} of {points} points of the grid: {reason}; allowed: "
            + ("narrower bounds, or a name near one")
        )
    return f"none within the bounds, at {points} points of the grid; allowed: parameters and bounds with one"


def _symmetry(problem, direction):
    """Return along what the equilibria of a flat point form a line, and what chooses one of them."""
    moved = np.abs(direction) > SINGULAR
    names = [place.name for place, part in zip(problem.places, moved, strict=True) if part]
    shares = " : ".join(f"{part:.3g}" for part in direction[moved])
    along = ", ".join(names) + (f" (in the ratio {shares} of their ranges)" if len(names) > 1 else "")
    mend = "a name for one of them" if problem.takes_members else f"a coordinate to hold (hold=…), {' or '.join(names)}"
    what = "F vanishes" if problem.takes_members else "V is flat"
    return f"{what} along a line of them, which goes along {along}; allowed: {mend}"


def _crowded(problem, equilibria, parameters):
    """Return the message about the first point that has more equilibria than the dimension holds."""
    system, point = problem.system, int(np.argmax(equilibria.crowded))
    count = equilibria.counts[point]
    wrong = f"there are {count}" if count > system.most else "one is near no name, and there is no room left"
    values = ", ".join(f"{name}={p[point]:g}" for name, p in zip(system.parameters, parameters, strict=False))
    allowed = f"at most {system.most} (`most`, or their names)"
    return f"{wrong}, at {values or 'the only point'}; allowed: {allowed}"


def runs_of(arrays: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the index of the first point of each run of equal neighbours, and each point's run."""
    change = np.ones(len(arrays[0]), dtype=bool)
    change[1:] = np.any([x[1:] != x[:-1] for x in arrays], axis=0)
    return np.flatnonzero(change), np.cumsum(change) - 1


def _points(rows):
    """Return numbers of points that all differ, in ascending order of the rows, and which of them each point equals."""
    code = np.zeros(rows[0].size if rows else 1, dtype=np.int64)
    for row in rows:
        if (row[1:] != row[:-1]).any():  # sorting is most of the work, and most parameters are constant
            values, number = np.unique(row, return_inverse=True)
            _, code = np.unique(code * values.size + number, return_inverse=True)
    _, first, inverse = np.unique(code, return_index=True, return_inverse=True)
    return first, inverse


def _cell(values):
    """Return the ends of the range of numbers that share the CELL leading bits of each value."""
    part, power = np.frexp(values)
    bits = np.floor(np.ldexp(np.abs(part), CELL))
    a, b = (np.ldexp(np.copysign(k, values), power - CELL) for k in (bits, bits + (values != 0.0)))
    return np.minimum(a, b), np.maximum(a, b)


def _found(problem, parameters):
    with np.errstate(all="ignore"):
        all_ = _All(problem, parameters)
        places, hidden, dimension = all_.table()
        decided = np.ones(all_.size, dtype=bool)
        counts = (~np.isnan(places).any(axis=-1)).sum(axis=1)
        most = problem.system.most
        if problem.system.follow:
            index, decided = branches.followed(_way(problem, parameters, places), most)
            crowded = counts > most
        else:
            index, crowded = _arranged(problem, parameters, places)
        index[crowded] = -1
        taken = np.maximum(index, 0)
        slots = np.where(index[..., None] >= 0, np.take_along_axis(places, taken[..., None], axis=1), np.nan)
        _take_names(problem, parameters, slots)
        dimension = np.where(index >= 0, np.take_along_axis(dimension, taken, axis=1), 0).astype(np.int8)
        hidden = np.take_along_axis(hidden, taken[..., None], axis=1)
    of_points = all_.certified.astype(np.int8), all_.flat, all_.direction, counts, crowded, decided, all_.undecided
    return Found(slots, hidden, dimension, *of_points, _absent(problem, parameters, slots, all_.certified))


def _absent(problem, parameters, slots, certified):
    """Return True for empty slots of which it is proved that no equilibrium has their name, shape (points, most)."""
    absent = np.isnan(slots).any(axis=-1) & (certified == PROVED)[:, None]
    lost = np.isnan(problem.labels(parameters)).all(axis=-1) & (certified != PROVED)[:, None]
    for k in np.flatnonzero(lost.any(axis=0)):
        rows = np.flatnonzero(lost[:, k])
        with np.errstate(all="ignore"):
            absent[rows, k] = problem.is_never_zero([p[rows] for p in parameters], k)
    return absent


def _take_names(problem, parameters, slots):
    """Take named places in place of those found, where F may be 0 there or is no farther from it: π to the last bit."""
    names, width = problem.labels(parameters), SAME * np.ptp(problem.bounds(parameters), axis=-1)
    for k in range(names.shape[1]):
        near = (np.abs(names[:, k] - slots[:, k]) <= width).all(axis=1)
        rows = np.flatnonzero(near & (names[:, k] != slots[:, k]).any(axis=1))
        of_rows = [p[rows] for p in parameters]
        named, residual = (problem.enclosed(of_rows, x[rows, k], x[rows, k])[0][:, :, 0] for x in (names, slots))
        zero = (named[..., 0] <= 0.0) & (named[..., 1] >= 0.0)
        rows = rows[(zero | (np.abs(named).max(axis=-1) <= np.abs(residual).max(axis=-1))).all(axis=1)]
        slots[rows, k] = names[rows, k]


class _All:
    """All equilibria of some points, and what could not be decided.

    Attributes:
        owner, place, dimension: of each equilibrium its point, the free unknowns, and the dimension of its family.
        reach, hidden: half a box that it is alone in, and half one within which rounding hides where it is; or 0.
        certified, flat, direction, undecided: of each point, as of :class:`Found`.
    """

    def __init__(self, problem, parameters):
        self.problem, self.parameters = problem, parameters
        self.size = parameters[0].size
        self.constants = problem.constants(parameters)
        bounds = np.broadcast_to(problem.bounds(parameters), (self.size, problem.m, 2))[:, problem.free].copy()
        self.periodic = problem.periodic[problem.free]
        bounds += (OFFSET * self.periodic * (bounds[..., 1] - bounds[..., 0]))[..., None]
        self.low, self.high = np.ascontiguousarray(bounds[..., 0]), np.ascontiguousarray(bounds[..., 1])
        self.width = self.high - self.low
        self.n = len(problem.free)
        self.narrowest = NARROWEST[self.n > 1]
        self.owner, self.place = np.empty(0, dtype=np.int64), np.empty((0, self.n))
        self.dimension, self.reach, self.hidden = np.empty(0, dtype=np.int64), *np.empty((2, 0, self.n))
        self.certified, self.flat = np.zeros(self.size, dtype=np.int64), np.zeros(self.size, dtype=bool)
        self.direction = np.full((self.size, problem.m), np.nan)
        self.undecided = np.full((self.size, problem.m, 2), np.nan)
        members = self._members() if problem.takes_members and problem.system.labels else np.empty(0, dtype=np.int64)
        self._search(np.setdiff1d(np.arange(self.size), members))

    # -- what is asked of F

    def slopes(self, owner, low, high):
        """Return enclosures (boxes, n, 1 + n, 2) of F and J in boxes, and states."""
        return self.problem.tape.slopes(self.constants, owner, low, high)

    def rough(self, points, bounds, most):
        """Return boxes that hold all zeros of points, (boxes, 2, n), and the first of each point's and where they end.

        Excluded once for all points whose parameters agree in their leading bits, wherever these lie: so that a point's
        result depends on no other point.
        """
        cells = [_cell(p[points]) for p in self.parameters]
        first, cell = _points([low for low, _ in cells])
        constants = self.problem.constants(*([p[first] for p in ends] for ends in zip(*cells, strict=True)))
        which, _, boxes = self.run(constants, bounds[first], (ROUGH, most, MANY, ROUGH, True))
        ends = np.searchsorted(which, np.arange(first.size + 1))
        return boxes[:, 0], np.stack([ends[:-1], ends[1:]], axis=-1)[cell]

    def run(self, constants, bounds, limits, starts=None, tape=None):
        """Search boxes; return for each record the box, its kind, the box it stands for, and one about the zero."""
        from kernels import roots  # compiled by its import

        progress, each = np.zeros(2, dtype=np.int64), np.arange(len(bounds))
        starts, shares = starts or (bounds, np.stack([each, each + 1], axis=-1))
        functions = (tape or self.problem.tape).formulas(np.ascontiguousarray(constants))
        where = roots.Where(*(np.ascontiguousarray(x) for x in (bounds, starts, shares)))
        room, parts = 4 * len(bounds) + 1000, [(each[:0], each[:0], np.empty((0, 2, 2, self.n)))]
        while progress[0] < len(bounds):
            before, records, boxes = progress[0], np.empty((room, 2), dtype=np.int64), np.empty((room, 2, 2, self.n))
            boxes_found = roots.Boxes(records, boxes, progress)
            count = roots.search(functions, where, roots.Limits(*limits), boxes_found)
            parts.append((records[:count, 0].copy(), records[:count, 1].copy(), boxes[:count].copy()))
            room *= 1 if progress[0] > before else 4
        return tuple(np.concatenate(x) for x in zip(*parts, strict=True))

    def still(self, owner, place, near=TINY):
        """Return whether F vanishes within some roundings of places, or within a fraction of the ranges."""
        near = np.maximum(ROUNDINGS * np.abs(place), near * self.width[owner])
        values, states = self.slopes(owner, place - near, place + near)
        F = values[:, :, 0]
        about = self.slopes(owner, place - EDGE * self.width[owner], place + EDGE * self.width[owner])[0][:, :, 0]
        faint = (about[..., 0] < about[..., 1]) & (np.abs(about).max(axis=-1) < codes.FAINT)
        return ((F[..., 0] <= 0.0) & (F[..., 1] >= 0.0) & ~faint).all(axis=1) & (states < codes.POLE)

    def jacobian(self, owner, place):
        """Return F and J in ranges, each row over its largest element; 0 for an entry lost in its own rounding."""
        values = self.slopes(owner, place, place)[0]
        J = values[:, :, 1:].mean(axis=-1) * self.width[owner][:, None, :]
        J[(values[:, :, 1:, 0] <= 0.0) & (values[:, :, 1:, 1] >= 0.0)] = 0.0
        rows = np.abs(J).max(axis=2)
        rows = np.where(rows > 0.0, rows, 1.0)
        return values[:, :, 0].mean(axis=-1) / rows, J / rows[:, :, None]

    def descended(self, owner, place, kept=None):
        """Apply Newton's method with steps of a fifth of the bounds at most; where J is singular, its least step.

        Along the directions `kept` (places, n, n), those that are not 0, the places stay: off a family J is regular.
        """
        start, place = place, place.copy()
        active = np.flatnonzero(~self.still(owner, place))
        for _ in range(ITERATIONS):
            if active.size == 0:
                break
            F, J = self.jacobian(owner[active], place[active])
            if kept is not None:
                gone = (place - start)[active] / self.width[owner[active]]
                F = np.concatenate([F, np.einsum("pij,pj->pi", kept[active], gone)], axis=1)
                J = np.concatenate([J, kept[active]], axis=1)
            sound = np.isfinite(F).all(axis=1) & np.isfinite(J).all(axis=(1, 2))
            step = np.full((active.size, self.n), np.nan)
            step[sound] = -(np.linalg.pinv(J[sound], rcond=1e-13) @ F[sound][:, :, None])[..., 0]
            step *= np.minimum(1.0, 0.2 / np.maximum(np.linalg.norm(step, axis=1), 1e-300))[:, None]
            place[active] += step * self.width[owner[active]]
            active = active[np.abs(step).max(axis=1) > 1e-15]
        return place

    def inside(self, owner, place):
        """Return whether places lie within the bounds, or outside by a rounding at most."""
        slack = BOUND * self.width[owner]
        return ((place >= self.low[owner] - slack) & (place <= self.high[owner] + slack)).all(axis=1)

    def null(self, owner, place):
        """Return for each place the directions, shape (places, n, n), and which of them J loses: (places, n)."""
        _, J = self.jacobian(owner, place)
        J[~np.isfinite(J).all(axis=(1, 2))] = np.eye(self.n)
        _, values, vectors = np.linalg.svd(J)
        return vectors, values <= SINGULAR

    def family(self, owner, place):
        """Return the dimension of the family that each place lies in, and one direction of it.

        Where families cross, J loses more directions than at the members nearby, and these have the dimension.
        """
        vectors, lost = self.null(owner, place)
        dimension, direction = np.zeros(owner.size, dtype=np.int64), np.full(place.shape, np.nan)
        least = np.full(owner.size, self.n)
        for k in range(self.n):
            rows = np.flatnonzero(lost[:, k])
            both, kept = np.ones(rows.size, dtype=bool), vectors[rows] * lost[rows, :, None]
            for step in (-ASIDE, ASIDE):
                start = place[rows] + step * vectors[rows, k] * self.width[owner[rows]]
                there = self.descended(owner[rows], self.descended(owner[rows], start, kept))
                far = np.abs(there - place[rows]) / self.width[owner[rows]]
                both &= self.still(owner[rows], there) & (far.max(axis=1) > 0.5 * ASIDE / np.sqrt(self.n))
                lost_there = np.where(both, self.null(owner[rows], there)[1].sum(axis=1), self.n)
                least[rows] = np.minimum(least[rows], lost_there)
            dimension[rows[both]] += 1
            direction[rows[both]] = vectors[rows[both], k]
        return np.minimum(dimension, np.maximum(least, 1)), direction

    # -- the search

    def _names(self, points):
        """Return places that the description names: their points and the free unknowns."""
        labels = self.problem.labels([p[points] for p in self.parameters])[:, :, self.problem.free]
        owner, place = np.repeat(points, labels.shape[1]), labels.reshape(-1, self.n).copy()
        turned = self.low[owner] + np.mod(place - self.low[owner], self.width[owner])
        place = np.where(self.periodic, turned, place)
        good = np.isfinite(place).all(axis=1)
        return owner[good], place[good]

    def _members(self):
        """Take the members of families that are nearest to names; return the points that have one."""
        owner, name = self._names(np.arange(self.size))
        place = self.descended(owner, name)
        near = (np.abs(place - name) <= FAR * self.width[owner]).all(axis=1) & self.inside(owner, place)
        near &= self.still(owner, place)
        owner, place = owner[near], place[near]
        dimension, _ = self.family(owner, place)
        points = np.unique(owner[dimension > 0])
        chosen = np.isin(owner, points)
        self.certified[points] = FAMILY
        self._note(owner[chosen], place[chosen], dimension=dimension[chosen])
        return points

    def _search(self, points):
        """Look for all equilibria of points, and say what could not be decided."""
        edge = EDGE * self.width[points]
        bounds = np.stack([self.low[points] - edge, self.high[points] + edge], axis=1)
        most = max(LEAST, WORK // (len(self.problem.tape.rows) * (1 + self.n) * self.n))
        shares = self.problem.is_steady and self.problem.tape.has_ranges and self.n <= SHARING and points.size
        starts = self.rough(points, bounds, SHARED * most) if shares else None
        which, kind, boxes = self._searched(points, bounds, most, starts)
        owner, zero = points[which], kind == codes.ZERO
        place, reach = boxes[:, 1].mean(axis=1), 0.5 * (boxes[:, 1, 1] - boxes[:, 1, 0])
        wide = np.flatnonzero(zero & (reach > BOUND * self.width[owner]).any(axis=1))
        nearer = self.descended(owner[wide], place[wide])
        inside = (np.abs(nearer - place[wide]) <= reach[wide]).all(axis=1)  # the one zero that the box holds
        place[wide[inside]] = nearer[inside]
        self._note(owner[zero], place[zero], reach=reach[zero])
        low, high = boxes[:, 0, 0], boxes[:, 0, 1]
        doubt = ~zero & ((high >= self.low[owner]) & (low <= self.high[owner])).all(axis=1)
        if doubt.any():
            self._decide(owner[doubt], kind[doubt], low[doubt], high[doubt])

    def _searched(self, points, bounds, most, starts):
        """Search boxes as `run`, and again where more than a few hide whether there are zeros and lie in no family."""
        few, many = ((self.narrowest, most, narrow, ROUGH, False) for narrow in (FEW, MANY))
        records = which, kind, boxes = self.run(self.constants[points], bounds, few, starts)
        narrow = np.flatnonzero((kind == codes.LOST) | (kind == codes.NARROW))
        again, first, count = np.unique(which[narrow], return_index=True, return_counts=True)
        again, some = again[count > FEW], narrow[first + count // 2][count > FEW]
        at = points[again]
        place = self.descended(at, boxes[some, 0].mean(axis=1))
        member = self.inside(at, place) & self.still(at, place, 2.0 * self.narrowest)
        member &= self.family(at, place)[0] > 0
        again = again[~member]
        if again.size:
            starts = starts and (starts[0], starts[1][again])
            more = self.run(self.constants[points[again]], bounds[again], many, starts)
            records = _merged(records, np.isin(which, again), (again[more[0]], *more[1:]))
        return self._about_poles(points, bounds, many, records)

    def _about_poles(self, points, bounds, limits, records):
        """Search what is left about poles for zeros of the numerators of F, but for those where a denominator vanishes.

        Towards a pole boxes would be cut for ever, and hide a zero beside it. Of the numerators the pole is a zero as
        others are: alone in a box, it leaves no room for one of F.
        """
        which, kind, boxes = records
        rows = np.flatnonzero(kind == codes.BROKEN)
        if not rows.size:
            return records
        numerators, denominators = self.problem.fractions
        at, first = np.unique(which[rows], return_index=True)
        starts = boxes[rows, 0], np.stack([first, np.append(first[1:], rows.size)], axis=-1)
        parameters = [p[points[at]] for p in self.parameters]
        constants, divisors = (self.problem.constants(parameters, tape=tape) for tape in (numerators, denominators))
        owner, found, places = self.run(constants, bounds[at], (*limits[:3], 0.0, False), starts, numerators)
        values = denominators.slopes(divisors, owner, places[:, 1, 0], places[:, 1, 1], 0)[0][:, :, 0]
        kept = (found != codes.ZERO) | ~((values[..., 0] <= 0.0) & (values[..., 1] >= 0.0)).any(axis=1)
        for j in np.flatnonzero(kept & (found == codes.ZERO)):  # found twice where it is beside a box without poles
            others = boxes[(which == at[owner[j]]) & (kind == codes.ZERO), 1]
            kept[j] = not ((others[:, 0] <= places[j, 1, 1]) & (others[:, 1] >= places[j, 1, 0])).all(axis=1).any()
        return _merged(records, kind == codes.BROKEN, (at[owner[kept]], found[kept], places[kept]))

    def _note(self, owner, place, reach=0.0, hidden=0.0, dimension=0):
        """Note equilibria within the bounds; one at a bound but for a rounding is at it."""
        slack = np.where(self.periodic, 0.0, BOUND * self.width[owner] + reach)
        inside = ((place >= self.low[owner] - slack) & (place <= self.high[owner] + slack)).all(axis=1)
        place = np.clip(place, self.low[owner], self.high[owner])
        new = owner, place, *(np.broadcast_to(x, place.shape) for x in (reach, hidden)), dimension + 0 * owner
        for name, values in zip(("owner", "place", "reach", "hidden", "dimension"), new, strict=True):
            setattr(self, name, np.concatenate([getattr(self, name), values[inside]]))

    def _decide(self, owner, kind, low, high):
        """Find what Newton's method finds from boxes that could not be decided; note it, and why they could not be."""
        at, start = self._starts(owner, kind, low, high)
        place = self.descended(at, start)
        inside = self.inside(at, place)
        at, place = at[inside], place[inside]
        proved, a, b, reach = self._alone(at, place)
        place = np.where(proved[:, None], 0.5 * (a[1] + b[1]), place)
        kept = np.flatnonzero(proved | self.still(at, place, 2.0 * self.narrowest))
        kept = kept[np.lexsort((~proved[kept], at[kept]))]
        dimension, direction = np.zeros(at.size, dtype=np.int64), np.full(place.shape, np.nan)
        open_ = kept[~proved[kept]]
        dimension[open_], direction[open_] = self.family(at[open_], place[open_])
        order, undecided = np.argsort(self.owner, kind="stable"), []
        owners_in_order = self.owner[order]
        for point in np.unique(owner):
            mine = slice(*np.searchsorted(owner, [point, point + 1]))
            rows = kept[slice(*np.searchsorted(at[kept], [point, point + 1]))]
            zeros = order[slice(*np.searchsorted(owners_in_order, [point, point + 1]))]
            boxes, width = (low[mine], high[mine], kind[mine]), SAME * self.width[point]
            alone, hidden = rows[proved[rows]], rows[~proved[rows]]
            if dimension[hidden].any():
                self.certified[point] = FAMILY
                if not (self.problem.takes_members and self.problem.system.labels):
                    along = direction[hidden[dimension[hidden].argmax()]]
                    self.flat[point], self.direction[point, self.problem.free] = True, along / np.abs(along).max()
                hidden = hidden[dimension[hidden] == 0]
            noted = list(zip(self.place[zeros], self.reach[zeros], strict=True))
            for j in alone:
                if not any((np.abs(c - place[j]) <= r + reach[j]).all() for c, r in noted):
                    undecided.append((point, place[j], reach[j], 0.0 * reach[j]))
                noted.append((place[j], reach[j]))
            covered = np.zeros(len(boxes[2]), dtype=bool)
            for j in alone:
                covered |= ((boxes[0] >= a[0][j]) & (boxes[1] <= b[0][j])).all(axis=1)
            boxes = tuple(x[~covered] for x in boxes)
            undecided += [(point, *c) for c in self._clusters(point, place[hidden], boxes, noted, width)]
            if boxes[2].size:
                reason = TOO_LARGE if (boxes[2] == codes.LEFT).any() else ROUNDING
                self.certified[point] = max(self.certified[point], reason)
                ends = np.stack([boxes[0].min(axis=0), boxes[1].max(axis=0)], axis=-1)
                self.undecided[point, self.problem.free] = ends
        if undecided:
            self._note(*(np.array(x) for x in zip(*undecided, strict=True)))

    def _starts(self, owner, kind, low, high):
        """Return places to start from: evenly many of the undecided boxes, and those that the description names."""
        points, owners, places = np.unique(owner), [], []
        named = self.problem.takes_members and self.problem.system.labels
        usable = (kind == codes.LOST) | (kind == codes.NARROW) | ((kind == codes.LEFT) & (not named))
        for point in points:
            rows = slice(*np.searchsorted(owner, [point, point + 1]))
            rows = rows.start + np.flatnonzero(usable[rows])
            rows = rows[np.linspace(0, rows.size - 1, min(rows.size, STARTS)).astype(np.int64)]
            owners.append(np.full(rows.size, point))
            places.append(0.5 * (low[rows] + high[rows]))
        more, names = self._names(points)
        return np.concatenate([*owners, more]), np.concatenate([*places, names])

    def _alone(self, owner, place):
        """Return whether a box about each place holds one zero, the ends of both boxes, and the zero's half-widths."""
        proved, a, b = np.zeros(owner.size, dtype=bool), np.stack([place] * 2), np.stack([place] * 2)
        for part in PARTS:
            rows = np.flatnonzero(~proved)
            if not rows.size:
                break
            wide = part * self.width[owner[rows]]
            which, kind, boxes = self.run(
                self.constants[owner[rows]],
                np.stack([place[rows] - wide, place[rows] + wide], axis=1),
                (self.narrowest, 1, MANY, 0.0, False),
            )
            one = kind == codes.ZERO
            chosen = rows[which[one]]
            proved[chosen] = True
            a[:, chosen], b[:, chosen] = boxes[one, :, 0].swapaxes(0, 1), boxes[one, :, 1].swapaxes(0, 1)
        return proved, a, b, 0.5 * (b[1] - a[1])

    def _clusters(self, point, places, boxes, noted, width):
        """Return one place of each group of boxes in which Newton's method found a zero that is not noted yet.

        With 0, its reach, and how far the group's boxes reach from it, where they were searched to the end.
        """
        low, high, kind = boxes
        if not len(places) or not kind.size:
            return []
        near = ((low[:, None] <= high + width) & (high[:, None] >= low - width)).all(axis=2)
        _, group = connected_components(near)
        zeros = {}
        for place in places:
            usable = (kind != codes.OVERFLOW) & (kind != codes.BROKEN)
            inside = np.flatnonzero(((place >= low - width) & (place <= high + width)).all(axis=1) & usable)
            is_noted = any((np.abs(c - place) <= r + width).all() for c, r in noted)
            if not inside.size or is_noted:
                continue
            rows = group == group[inside[0]]
            a, b = low[rows].min(axis=0), high[rows].max(axis=0)
            middle = np.where((a <= 0.0) & (b >= 0.0), 0.0, 0.5 * (a + b))
            if (kind[rows] == codes.LEFT).any():  # a group of boxes that may hold many
                if not any((np.abs(other - place) <= width).all() for other, _, _ in zeros.values()):
                    zeros[len(group) + len(zeros)] = place, 0.0 * place, 0.0 * place
            elif group[inside[0]] not in zeros:
                owner = np.array([point])
                resting = self.still(owner, middle[None], 2.0 * self.narrowest)[0]
                chosen = middle if resting else place
                zeros[group[inside[0]]] = chosen, 0.0 * chosen, np.maximum(chosen - a, b - chosen)
        return list(zeros.values())

    # -- what is found

    def table(self):
        """Return sorted places of all coordinates or states, how far each is hidden, and the families' dimensions."""
        problem, points = self.problem, self.owner
        holds = np.broadcast_to(problem.holds(self.parameters), (self.size, problem.m))
        bounds = np.broadcast_to(problem.bounds(self.parameters), (self.size, problem.m, 2))
        place, reach = holds[points].copy(), np.zeros((points.size, problem.m))
        low, high = bounds[points, :, 0], bounds[points, :, 1]
        place[:, problem.free] = self.place
        reach[:, problem.free] = np.maximum(self.reach, ROUNDINGS * np.abs(self.place))
        place = np.where(problem.periodic & (place > high), place - (high - low), place)
        at_low = problem.periodic & (place - low < 1e-12 * (high - low))
        place = np.where(at_low, high - np.maximum(low - place, 0.0), place)
        held = [i for i in range(problem.m) if i not in problem.free]
        if held:
            F = problem.enclosed([p[points] for p in self.parameters], place - reach, place + reach)[0][:, held, 0]
            still = ((F[..., 0] <= 0.0) & (F[..., 1] >= 0.0)).all(axis=1)
        else:
            still = np.ones(points.size, dtype=bool)
        kept = np.flatnonzero(still & ~self.flat[points])
        part = np.round((place - low) / (high - low), 9)[kept]
        kept = kept[np.lexsort((place[kept, 0], *part.T[::-1], points[kept]))]
        counts = np.bincount(points[kept], minlength=self.size)
        position = np.arange(kept.size) - np.repeat(np.cumsum(counts) - counts, counts)
        places = np.full((self.size, max(counts.max(initial=0), 1), problem.m), np.nan)
        dimension, hidden = np.zeros(places.shape[:2], dtype=np.int64), np.zeros(places.shape)
        places[points[kept], position], dimension[points[kept], position] = place[kept], self.dimension[kept]
        hidden[points[kept, None], position[:, None], problem.free] = self.hidden[kept]
        return places, hidden, dimension


def _merged(records, gone, more):
    """Return records without those that are gone, and with more, by the numbers of their points."""
    parts = [np.concatenate([a[~gone], b]) for a, b in zip(records, more, strict=True)]
    order = np.argsort(parts[0], kind="stable")
    return tuple(part[order] for part in parts)


# -- slots


def _way(problem, parameters, places):
    """Return the way from the parameters' defaults to points whose places are found already."""
    free, size = problem.free, parameters[0].size
    defaults = [p.default for p in problem.system.parameters.values()] or [0.0]

    def at(share, points=slice(None)):
        return [_between(d, p[points], share) for d, p in zip(defaults, parameters, strict=True)]

    def search(share):
        if share == 1.0:
            return places[..., free], np.ones(size, dtype=bool)  # of which `certified` tells
        there = _All(problem, at(share) if share else [p[:1] for p in at(share)])
        sure = there.certified < TOO_LARGE
        return there.table()[0][..., free].repeat(1 if share else size, axis=0), sure & np.ones(size, dtype=bool)

    def slopes(low, high):
        numbers, owner = problem.followed.constants([]), np.zeros(len(low), dtype=np.int64)
        return problem.followed.slopes(numbers, owner, low, high)

    def along(points, share):
        return np.stack(at(share, points), axis=-1)[:, : len(problem.parameters)]

    def bounds(share):
        return np.broadcast_to(problem.bounds(at(share)), (size, problem.m, 2))[:, free]

    return branches.Way(search, slopes, along, bounds, problem.periodic[free])


def _between(default, values, share):
    """Return a place on the way from a default to values: the values where it ends."""
    straight = default + share * (values - default)
    with np.errstate(all="ignore"):
        curved = default ** (1.0 - share) * values**share if default > 0 else straight
    between = np.where((values > 0.0) & (default > 0.0), curved, straight)
    return np.where(share == 1.0, values, np.where(share == 0.0, default, between))


def _distances(problem, a, b, bounds):
    """Return largest distance by any coordinate between places, over its range; periodic ones the short way."""
    width = bounds[..., 1] - bounds[..., 0]
    apart = np.abs(a - b) / np.where(width > 0.0, width, 1.0)
    apart = np.where(problem.periodic, np.abs(apart - np.round(apart)), apart)
    return np.where(np.isnan(b), 0.0, apart).max(axis=-1)


def _arranged(problem, parameters, places):
    """Return which place each slot of the dimension `equilibrium` holds, -1 for none, and which points are crowded.

    Those with names come first, each nearest to its name.
    """
    system = problem.system
    points, count, _ = places.shape
    labels, bounds = problem.labels(parameters), problem.bounds(parameters)
    slots = np.full((points, system.most), -1)
    left = ~np.isnan(places).any(axis=-1)
    cost = np.full((points, labels.shape[1], count), np.inf)
    for k in range(labels.shape[1]):
        named = ~np.isnan(labels[:, k]).all(axis=1)
        d = _distances(problem, places, labels[:, k : k + 1], bounds[:, None])
        d = np.round(d / SAME) * SAME  # where names fall together the first of them is meant
        cost[:, k] = np.where(left & named[:, None] & (d < FAR), d, np.inf)
    rows = np.arange(points)
    for _ in range(labels.shape[1]):
        k, j = np.divmod(cost.reshape(points, -1).argmin(axis=1), count)
        chosen = np.isfinite(cost[rows, k, j])
        slots[rows[chosen], k[chosen]] = j[chosen]
        left[rows[chosen], j[chosen]] = False
        cost[rows[chosen], k[chosen], :] = np.inf
        cost[rows[chosen], :, j[chosen]] = np.inf
    if problem.takes_members and system.labels:
        left[:] &= system.most > labels.shape[1]
    free = (slots < 0) & (np.arange(system.most) >= labels.shape[1])
    room, rank = free.cumsum(axis=1), left.cumsum(axis=1)  # the k-th that is left goes into the k-th slot that is free
    put = left & (rank <= room[:, -1:])
    for j in np.flatnonzero(put.any(axis=0)):
        chosen = np.flatnonzero(put[:, j])
        slot = (room[chosen] == rank[chosen, j, None]).argmax(axis=1)
        slots[chosen, slot] = j
    return slots, (left & ~put).any(axis=1)
