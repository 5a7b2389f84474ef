"""All equilibria of many points within bounds, F(x) = 0: each proved, or undecided with the reason.

A branch-and-prune search with Krawczyk's operator (`kernels.search.roots`) covers all of the bounds. So "there are k"
is proved, or the reason is reported:

* PROVED: each root is the only one in its box, and the remaining bounds contain none.
* ROUNDING: numerically there is a root (a double root, an exact pitchfork, two roots closer than doubles resolve), but
  rounding hides whether it is one, several or none; or F overflows in a part of the bounds. All remaining roots are
  proved.
* TOO_LARGE: the subdivision did not end within its number of boxes. Newton's method was started from the undecided
  boxes and from the named places; its roots are returned, each proved if possible. There may be further roots.
* FAMILY: equilibria form a line or more (a spin of any rate, a neutral angle). If the description names a place and F
  is not the gradient of a potential, the member nearest to the name is returned; else the point is flat and has none.

A point is crowded, and has no equilibria, if it has more than `most`, or a root near no name while all slots have
names. For flows with members that are requested by name, equilibria without a name are only counted.

Nothing depends on units: places are compared relative to their bounds, and F vanishes at a place if its enclosure
within some roundings of the place contains 0.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse.csgraph import connected_components

from kernels.search import codes
from sweeps.mechanics import branches
from sweeps.mechanics.landscape import SINGULAR, Landscape

PROVED, ROUNDING, TOO_LARGE, FAMILY = range(4)
REASONS = {
    ROUNDING: "rounding hides whether equilibria are one, several or none",
    TOO_LARGE: "the bounds are too large to be searched to the end",
    FAMILY: "equilibria form a family",
}

OFFSET = 0.3819660112501051  # fraction of the period by which the search of a periodic coordinate avoids round numbers
EDGE_MARGIN = 2.0**-20  # the searched box is this much wider, relative to the bounds: roots on a bound are interior
BOUND_SLACK = 1e-12  # roots this far outside, relative to the range, are taken to be at the bound
MIN_BOX_WIDTHS = (2.0**-50, 2.0**-32)  # narrowest boxes of one unknown and of several, relative to the range
SEARCH_OPERATIONS = 400_000  # operations of one point's search divided by the unknowns; it limits the boxes
MIN_BOXES = 100  # every point may use this many boxes, however long its equations are
PLACE_ROUNDING = 16.0 * codes.UNIT  # F vanishes at a place if its enclosure within this relative distance contains 0
RANGE_ROUNDING = 0.01 * codes.UNIT  # the same relative to the range, for places near 0
MERGE_DISTANCE = 1e-7  # roots nearer to each other than this, relative to the range, count as one
FEW_NARROW = 16  # undecided narrow boxes of a point after which a family is searched for
MAX_NARROW = 400  # undecided narrow boxes at which a point's search ends: a family fills any number
MAX_STARTS = 128  # starts of Newton's method from the undecided boxes of one point
MAX_ITERATIONS = 60  # steps of Newton's method
ISOLATION_HALF_WIDTHS = (1e-4, 1e-7, 1e-10)  # boxes about Newton's roots that are tried in turn, relative to the range
FAMILY_STEP = 0.01  # distance, relative to the range, at which a family has members on both sides
MAX_NAME_DISTANCE = 0.25  # a name applies to roots within this distance, relative to the range
CHUNK_POINTS = 1 << 12  # points that are searched together, which bounds the memory
CELL_BITS = 7  # points are excluded together if their parameters agree in this many leading bits
SHARED_WIDTH = 2.0**-12  # width, relative to the range, of the boxes that shared searches leave undecided
MAX_SHARED_N = 3  # searches of more unknowns are not shared: they would leave too many boxes
SHARED_WORK_FACTOR = 3  # boxes of a shared search, relative to those of one point


class NewtonZeros(NamedTuple):
    """Zeros of F that Newton's method found from undecided boxes; the first axis of each array counts them."""

    owner: np.ndarray  #: index of each zero's point
    place: np.ndarray  #: coordinates or states, shape (zeros, n)
    is_unique: np.ndarray  #: True if a box about the zero was proved to contain no second one
    half_width: np.ndarray  #: of the narrowest such box, shape (zeros, n)
    low: np.ndarray  #: lower ends of the widest such box, shape (zeros, n)
    high: np.ndarray  #: its upper ends
    dimension: np.ndarray  #: dimension of the family of zeros that this one is a member of; 0 if it is none
    direction: np.ndarray  #: tangent of the family, shape (zeros, n)


@dataclass(frozen=True)
class Equilibria:
    """Equilibria of points; `most` slots each, of m coordinates or states."""

    places: np.ndarray  #: shape (points, most, m); NaN in empty slots
    uncertainty: np.ndarray  #: shape (points, most, m), half-width of the region that rounding leaves; 0 if proved
    dimension: np.ndarray  #: shape (points, most), dimension of the family of each; 0 for an isolated equilibrium
    certified: np.ndarray  #: shape (points,), PROVED, ROUNDING, TOO_LARGE or FAMILY
    is_flat: np.ndarray  #: shape (points,), True if equilibria form a family without a named member
    direction: np.ndarray  #: shape (points, m), tangent of a flat point's family, relative to the ranges; else NaN
    counts: np.ndarray  #: shape (points,), number of equilibria, also at crowded points
    is_crowded: np.ndarray  #: shape (points,), True if there are more equilibria than slots
    #: shape (points,), True if it is decided which equilibrium is on which branch; True if branches are not followed
    is_order_decided: np.ndarray
    undecided_box: np.ndarray  #: shape (points, m, 2), box around all undecided boxes; NaN if all is proved
    is_absent: np.ndarray  #: shape (points, most), True if it is proved that the slot's equilibrium does not exist

    def __getitem__(self, index) -> "Equilibria":
        """Return the selected points."""
        return Equilibria(*(getattr(self, name)[index] for name in self.__dataclass_fields__))


def find(problem: Landscape, parameters) -> Equilibria:
    """Find all equilibria of points, given as one array (points,) for each parameter, in the description's order."""
    parameter_rows = [np.atleast_1d(np.asarray(p, dtype=np.float64)) for p in parameters] or [np.zeros(1)]
    defaults = zip(problem.canonical, parameter_rows, strict=True)
    rows = [p if default is None else np.full_like(p, default) for default, p in defaults]
    first, inverse = _unique_points(rows)
    rows = [p[first] for p in rows]
    cache_key, last_cache_key, equilibria = b"".join(p.tobytes() for p in rows), *problem.last
    if cache_key != last_cache_key:
        chunks = [[p[start : start + CHUNK_POINTS] for p in rows] for start in range(0, first.size, CHUNK_POINTS)]
        results = [_find_in_chunk(problem, chunk) for chunk in chunks]
        equilibria = Equilibria(
            *(np.concatenate([getattr(p, name) for p in results]) for name in Equilibria.__dataclass_fields__)
        )
        problem.last = cache_key, equilibria
    return equilibria[inverse]


def refusal(problem: Landscape, equilibria: Equilibria, parameters) -> str:
    """Return why no point has a usable equilibrium, or the empty string.

    Args:
        problem: equations and bounds.
        equilibria: those of the points.
        parameters: one array (points,) for each parameter.
    """
    if equilibria.is_crowded.all():
        return _crowding_message(problem, equilibria, parameters)
    if equilibria.is_crowded.any() or not np.isnan(equilibria.places).all():
        return ""
    if equilibria.is_flat.any():
        return _family_message(problem, equilibria.direction[equilibria.is_flat.argmax()])
    points, open_points = equilibria.counts.size, np.flatnonzero(~equilibria.is_absent.all(axis=1))
    if open_points.size:
        reason = REASONS[int(equilibria.certified[open_points].max())]
        return (
            f"none is found and none excluded at {open_points.size} of {points} points of the grid: {reason}; allowed: "
            + ("narrower bounds, or a name near one")
        )
    return f"none within the bounds, at {points} points of the grid; allowed: parameters and bounds with one"


def _family_message(problem, direction):
    """Return the message that names the coordinates along which equilibria form a line, and the remedy."""
    is_changing = np.abs(direction) > SINGULAR
    names = [place.name for place, is_in_line in zip(problem.places, is_changing, strict=True) if is_in_line]
    ratio = " : ".join(f"{component:.3g}" for component in direction[is_changing])
    line = ", ".join(names) + (f" (in the ratio {ratio} of their ranges)" if len(names) > 1 else "")
    remedy = (
        "a name for one of them" if problem.takes_members else f"a coordinate to hold (hold=…), {' or '.join(names)}"
    )
    statement = "F vanishes" if problem.takes_members else "V is flat"
    return f"{statement} along a line of them, which goes along {line}; allowed: {remedy}"


def _crowding_message(problem, equilibria, parameters):
    """Return the message about the first point with more equilibria than slots."""
    system, point = problem.system, int(np.argmax(equilibria.is_crowded))
    count = equilibria.counts[point]
    fault = f"there are {count}" if count > system.most else "one is near no name, and there is no room left"
    values = ", ".join(f"{name}={p[point]:g}" for name, p in zip(system.parameters, parameters, strict=False))
    allowed = f"at most {system.most} (`most`, or their names)"
    return f"{fault}, at {values or 'the only point'}; allowed: {allowed}"


def runs_of(arrays: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return the index of the first point of each run of equal neighbours, and each point's run."""
    change = np.ones(len(arrays[0]), dtype=bool)
    change[1:] = np.any([x[1:] != x[:-1] for x in arrays], axis=0)
    return np.flatnonzero(change), np.cumsum(change) - 1


def _unique_points(rows):
    """Return the indices of distinct points, in ascending order of the rows, and each point's index among these."""
    group_code = np.zeros(rows[0].size if rows else 1, dtype=np.int64)
    for row in rows:
        if (row[1:] != row[:-1]).any():  # most parameters are constant, and sorting takes longest
            values, number = np.unique(row, return_inverse=True)
            _, group_code = np.unique(group_code * values.size + number, return_inverse=True)
    _, first, inverse = np.unique(group_code, return_index=True, return_inverse=True)
    return first, inverse


def _cell_bounds(values):
    """Return the ends of the interval of numbers that share CELL_BITS leading bits with each value."""
    mantissa, power = np.frexp(values)
    bits = np.floor(np.ldexp(np.abs(mantissa), CELL_BITS))
    low, high = (np.ldexp(np.copysign(k, values), power - CELL_BITS) for k in (bits, bits + (values != 0.0)))
    return np.minimum(low, high), np.maximum(low, high)


def _find_in_chunk(problem, parameters):
    """Return the `Equilibria` of points: search their bounds, then assign roots to slots (or follow branches)."""
    with np.errstate(all="ignore"):
        search = EquilibriumSearch(problem, parameters)
        places, uncertainty, dimension = search.sorted_places()
        is_decided = np.ones(search.size, dtype=bool)
        counts = (~np.isnan(places).any(axis=-1)).sum(axis=1)
        max_slots = problem.system.most
        if problem.system.follow:
            index, is_decided = branches.follow_branches(ParameterPath(problem, parameters, places), max_slots)
            is_crowded = counts > max_slots
        else:
            index, is_crowded = _assign_slots(problem, parameters, places)
        index[is_crowded] = -1
        place_index = np.maximum(index, 0)
        slots = np.where(index[..., None] >= 0, np.take_along_axis(places, place_index[..., None], axis=1), np.nan)
        _replace_by_names(problem, parameters, slots)
        dimension = np.where(index >= 0, np.take_along_axis(dimension, place_index, axis=1), 0).astype(np.int8)
        uncertainty = np.take_along_axis(uncertainty, place_index[..., None], axis=1)
    flags = (
        search.certified.astype(np.int8),
        search.is_flat,
        search.direction,
        counts,
        is_crowded,
        is_decided,
        search.undecided_box,
    )
    return Equilibria(
        slots, uncertainty, dimension, *flags, _proved_absent(problem, parameters, slots, search.certified)
    )


def _proved_absent(problem, parameters, slots, certified):
    """Return True for empty slots for which it is proved that no equilibrium has their name, shape (points, most)."""
    is_absent = np.isnan(slots).any(axis=-1) & (certified == PROVED)[:, None]
    may_be_missing = np.isnan(problem.labels(parameters)).all(axis=-1) & (certified != PROVED)[:, None]
    for slot in np.flatnonzero(may_be_missing.any(axis=0)):
        rows = np.flatnonzero(may_be_missing[:, slot])
        with np.errstate(all="ignore"):
            is_absent[rows, slot] = problem.is_never_zero([p[rows] for p in parameters], slot)
    return is_absent


def _replace_by_names(problem, parameters, slots):
    """Replace roots by the named places if these are roots as well as numbers show: π to the last bit."""
    names, width = (problem.labels(parameters), MERGE_DISTANCE * np.ptp(problem.bounds(parameters), axis=-1))
    for slot in range(names.shape[1]):
        is_near = (np.abs(names[:, slot] - slots[:, slot]) <= width).all(axis=1)
        rows = np.flatnonzero(is_near & (names[:, slot] != slots[:, slot]).any(axis=1))
        values = [p[rows] for p in parameters]
        at_name, residual = (problem.enclose(values, x[rows, slot], x[rows, slot])[0][:, :, 0] for x in (names, slots))
        may_vanish = (at_name[..., 0] <= 0.0) & (at_name[..., 1] >= 0.0)
        rows = rows[(may_vanish | (np.abs(at_name).max(axis=-1) <= np.abs(residual).max(axis=-1))).all(axis=1)]
        slots[rows, slot] = names[rows, slot]


class EquilibriumSearch:
    """A search for all equilibria of some points.

    Attributes:
        owner, place, dimension: point, free unknowns and dimension of the family of each root.
        half_width, uncertainty: half-width of a box in which the root is unique, and of a box in which rounding hides
            it; either is 0.
        certified, is_flat, direction, undecided_box: of each point, as in :class:`Equilibria`.
    """

    def __init__(self, problem, parameters):
        self.problem, self.parameters = problem, parameters
        self.size = parameters[0].size
        self.constants = problem.constants(parameters)
        bounds = problem.bounds(parameters)[:, problem.free]
        self.periodic = problem.periodic[problem.free]
        bounds += (OFFSET * self.periodic * (bounds[..., 1] - bounds[..., 0]))[..., None]
        self.low, self.high = np.ascontiguousarray(bounds[..., 0]), np.ascontiguousarray(bounds[..., 1])
        self.width = self.high - self.low
        self.n = len(problem.free)
        self.narrowest = MIN_BOX_WIDTHS[self.n > 1]
        self.owner, self.place = np.empty(0, dtype=np.int64), np.empty((0, self.n))
        self.dimension = np.empty(0, dtype=np.int64)
        self.half_width, self.uncertainty = np.empty((2, 0, self.n))
        self.certified, self.is_flat = np.zeros(self.size, dtype=np.int64), np.zeros(self.size, dtype=bool)
        self.direction = np.full((self.size, problem.m), np.nan)
        self.undecided_box = np.full((self.size, problem.m, 2), np.nan)
        members = (
            self._add_members() if problem.takes_members and problem.system.labels else np.empty(0, dtype=np.int64)
        )
        self._search_points(np.setdiff1d(np.arange(self.size), members))

    # -- evaluations of F

    def enclose_jacobian(self, owner, low, high):
        """Return enclosures of F and J in the boxes (`low`, `high`), (boxes, n), of the points `owner`, (boxes,).

        Shapes (boxes, n, 1 + n, 2); with them state codes, (boxes,).
        """
        return self.problem.tape.slopes(self.constants, owner, low, high)

    def shared_boxes(self, points, bounds, max_boxes):
        """Return boxes with all roots of points, shape (boxes, 2, n), and each point's range of boxes, (points, 2).

        Boxes are excluded once for all points that share the leading bits of their parameters. Cells do not depend on
        the points, so no point's result depends on another point.

        Args:
            points: indices of points.
            bounds: the boxes to search, shape (points, 2, n).
            max_boxes: number of boxes at which a cell's search ends.
        """
        cells = [_cell_bounds(p[points]) for p in self.parameters]
        first, cell_index = _unique_points([low for low, _ in cells])
        constants = self.problem.constants(*([p[first] for p in ranges] for ranges in zip(*cells, strict=True)))
        owners, _, boxes = self.search_boxes(
            constants, bounds[first], (SHARED_WIDTH, max_boxes, MAX_NARROW, SHARED_WIDTH, True)
        )
        ranges = np.searchsorted(owners, np.arange(first.size + 1))
        return boxes[:, 0], np.stack([ranges[:-1], ranges[1:]], axis=-1)[cell_index]

    def search_boxes(self, constants, bounds, limits, starts=None, tape=None):
        """Return the boxes at which searches ended, as arrays (search, kind, boxes) with one row ("record") each.

        `search` is an index into `bounds`, `kind` a code of `kernels.search.codes` (a unique zero, or why the box is
        undecided), and `boxes` (records, 2, 2, n) are the searched box and the box about its root.

        Args:
            constants: rows of constants, one for each search.
            bounds: shape (searches, 2, n).
            limits: see `kernels.search.roots.Limits`.
            starts: boxes to begin with and each search's range of them; by default the bounds.
            tape: the function with the roots; by default F.
        """
        from kernels.search import roots  # compiled by its import

        progress, indices = np.zeros(2, dtype=np.int64), np.arange(len(bounds))
        starts, ranges = starts or (bounds, np.stack([indices, indices + 1], axis=-1))
        functions = (tape or self.problem.tape).formulas(np.ascontiguousarray(constants))
        search_regions = roots.SearchRegions(*(np.ascontiguousarray(x) for x in (bounds, starts, ranges)))
        capacity, results = 4 * len(bounds) + 1000, [(indices[:0], indices[:0], np.empty((0, 2, 2, self.n)))]
        while progress[0] < len(bounds):
            before = progress[0]
            records = np.empty((capacity, 2), dtype=np.int64)
            boxes = np.empty((capacity, 2, 2, self.n))
            boxes_found = roots.Boxes(records, boxes, progress)
            count = roots.search(functions, search_regions, roots.Limits(*limits), boxes_found)
            results.append((records[:count, 0].copy(), records[:count, 1].copy(), boxes[:count].copy()))
            capacity *= 1 if progress[0] > before else 4
        return tuple(np.concatenate(x) for x in zip(*results, strict=True))

    def is_zero(self, owner, place, near=RANGE_ROUNDING):
        """Return True if F's enclosure about a place contains 0: within roundings, or `near` ranges.

        Args:
            owner: point of each place.
            place: shape (places, n).
            near: half-width of the enclosed region, relative to the range.
        """
        tolerance = np.maximum(PLACE_ROUNDING * np.abs(place), near * self.width[owner])
        values, states = self.enclose_jacobian(owner, place - tolerance, place + tolerance)
        F = values[:, :, 0]
        nearby = self.enclose_jacobian(
            owner, place - EDGE_MARGIN * self.width[owner], place + EDGE_MARGIN * self.width[owner]
        )[0][:, :, 0]
        is_faint = (nearby[..., 0] < nearby[..., 1]) & (np.abs(nearby).max(axis=-1) < codes.MIN_RANGE)
        return ((F[..., 0] <= 0.0) & (F[..., 1] >= 0.0) & ~is_faint).all(axis=1) & (states < codes.POLE)

    def scaled_jacobian(self, owner, place):
        """Return F and J relative to the ranges, each row over its largest element; entries within rounding are 0."""
        values = self.enclose_jacobian(owner, place, place)[0]
        J = values[:, :, 1:].mean(axis=-1) * self.width[owner][:, None, :]
        J[(values[:, :, 1:, 0] <= 0.0) & (values[:, :, 1:, 1] >= 0.0)] = 0.0
        row_sizes = np.abs(J).max(axis=2)
        row_sizes = np.where(row_sizes > 0.0, row_sizes, 1.0)
        return values[:, :, 0].mean(axis=-1) / row_sizes, J / row_sizes[:, :, None]

    def apply_newton(self, owner, place, fixed_directions=None):
        """Return places after Newton's method; steps are at most a fifth of the bounds, least-norm if J is singular.

        Args:
            owner: point of each place.
            place: starts, shape (places, n).
            fixed_directions: shape (places, n, n), rows that are not 0 are directions along which places stay; with a
                family's directions fixed, J is regular.
        """
        start, place = place, place.copy()
        active = np.flatnonzero(~self.is_zero(owner, place))
        for _ in range(MAX_ITERATIONS):
            if active.size == 0:
                break
            F, J = self.scaled_jacobian(owner[active], place[active])
            if fixed_directions is not None:
                displacement = (place - start)[active] / self.width[owner[active]]
                F = np.concatenate([F, np.einsum("pij,pj->pi", fixed_directions[active], displacement)], axis=1)
                J = np.concatenate([J, fixed_directions[active]], axis=1)
            is_finite = np.isfinite(F).all(axis=1) & np.isfinite(J).all(axis=(1, 2))
            step = np.full((active.size, self.n), np.nan)
            step[is_finite] = -(np.linalg.pinv(J[is_finite], rcond=1e-13) @ F[is_finite][:, :, None])[..., 0]
            step *= np.minimum(1.0, 0.2 / np.maximum(np.linalg.norm(step, axis=1), 1e-300))[:, None]
            place[active] += step * self.width[owner[active]]
            active = active[np.abs(step).max(axis=1) > 1e-15]
        return place

    def is_within(self, owner, place):
        """Return True if a place is within the bounds, or outside by BOUND_SLACK at most."""
        slack = BOUND_SLACK * self.width[owner]
        return ((place >= self.low[owner] - slack) & (place <= self.high[owner] + slack)).all(axis=1)

    def null_directions(self, owner, place):
        """Return J's right singular vectors (places, n, n), and True for those of singular value 0, (places, n)."""
        _, J = self.scaled_jacobian(owner, place)
        J[~np.isfinite(J).all(axis=(1, 2))] = np.eye(self.n)
        _, values, vectors = np.linalg.svd(J)
        return vectors, values <= SINGULAR

    def family_dimension(self, owner, place):
        """Return the dimension of each place's family of roots, and one tangent of it.

        Where families cross, J has more null directions than at members nearby; the dimension is that of the latter.
        """
        vectors, is_null = self.null_directions(owner, place)
        dimension, direction = np.zeros(owner.size, dtype=np.int64), np.full(place.shape, np.nan)
        min_nullity = np.full(owner.size, self.n)
        for k in range(self.n):
            rows = np.flatnonzero(is_null[:, k])
            is_member, null = (np.ones(rows.size, dtype=bool), vectors[rows] * is_null[rows, :, None])
            for step in (-FAMILY_STEP, FAMILY_STEP):
                start = place[rows] + step * vectors[rows, k] * self.width[owner[rows]]
                member = self.apply_newton(owner[rows], self.apply_newton(owner[rows], start, null))
                distance = np.abs(member - place[rows]) / self.width[owner[rows]]
                is_member &= self.is_zero(owner[rows], member) & (
                    distance.max(axis=1) > 0.5 * FAMILY_STEP / np.sqrt(self.n)
                )
                nullity = np.where(is_member, self.null_directions(owner[rows], member)[1].sum(axis=1), self.n)
                min_nullity[rows] = np.minimum(min_nullity[rows], nullity)
            dimension[rows[is_member]] += 1
            direction[rows[is_member]] = vectors[rows[is_member], k]
        return np.minimum(dimension, np.maximum(min_nullity, 1)), direction

    # -- the search

    def _named_places(self, points):
        """Return (owner, place) of the places that the description names, within the searched period."""
        labels = self.problem.labels([p[points] for p in self.parameters])[:, :, self.problem.free]
        owner, place = np.repeat(points, labels.shape[1]), labels.reshape(-1, self.n).copy()
        reduced_place = self.low[owner] + np.mod(place - self.low[owner], self.width[owner])
        place = np.where(self.periodic, reduced_place, place)
        is_finite = np.isfinite(place).all(axis=1)
        return owner[is_finite], place[is_finite]

    def _add_members(self):
        """Add the members of families nearest to names; return the points that have one."""
        owner, name = self._named_places(np.arange(self.size))
        place = self.apply_newton(owner, name)
        is_member = (np.abs(place - name) <= MAX_NAME_DISTANCE * self.width[owner]).all(axis=1) & self.is_within(
            owner, place
        )
        is_member &= self.is_zero(owner, place)
        owner, place = owner[is_member], place[is_member]
        dimension, _ = self.family_dimension(owner, place)
        points = np.unique(owner[dimension > 0])
        in_family = np.isin(owner, points)
        self.certified[points] = FAMILY
        self._add_zeros(owner[in_family], place[in_family], dimension=dimension[in_family])
        return points

    def _search_points(self, points):
        """Find all equilibria of points, and record undecided boxes."""
        margin = EDGE_MARGIN * self.width[points]
        bounds = np.stack([self.low[points] - margin, self.high[points] + margin], axis=1)
        limit = max(MIN_BOXES, SEARCH_OPERATIONS // (len(self.problem.tape.rows) * (1 + self.n) * self.n))
        is_shared = self.problem.is_steady and self.problem.tape.has_ranges and self.n <= MAX_SHARED_N and points.size
        starts = self.shared_boxes(points, bounds, SHARED_WORK_FACTOR * limit) if is_shared else None
        box_point, kind, boxes = self._search_refined(points, bounds, limit, starts)
        owner, is_root = points[box_point], kind == codes.UNIQUE_ZERO
        root, half_width = boxes[:, 1].mean(axis=1), 0.5 * (boxes[:, 1, 1] - boxes[:, 1, 0])
        wide_rows = np.flatnonzero(is_root & (half_width > BOUND_SLACK * self.width[owner]).any(axis=1))
        newton_root = self.apply_newton(owner[wide_rows], root[wide_rows])
        is_in_box = (np.abs(newton_root - root[wide_rows]) <= half_width[wide_rows]).all(axis=1)
        root[wide_rows[is_in_box]] = newton_root[is_in_box]
        self._add_zeros(owner[is_root], root[is_root], half_width=half_width[is_root])
        low, high = boxes[:, 0, 0], boxes[:, 0, 1]
        is_undecided = ~is_root & ((high >= self.low[owner]) & (low <= self.high[owner])).all(axis=1)
        if is_undecided.any():
            self._decide_boxes(owner[is_undecided], kind[is_undecided], low[is_undecided], high[is_undecided])

    def _search_refined(self, points, bounds, limit, starts):
        """Return the records of `search_boxes` for F: undecided narrow boxes are divided further, and poles removed.

        A point's first search ends at FEW_NARROW narrow boxes, in which roundings hide the sign of F. If the root in
        these is no member of a family, which fills any number of boxes, the search is repeated with MAX_NARROW.

        Args:
            points: indices of points.
            bounds: boxes to search, shape (points, 2, n).
            limit: largest number of boxes of a point's search.
            starts: boxes to begin with and each point's range of them, of `shared_boxes`; None: the bounds.
        """
        few_limits, many_limits = ((self.narrowest, limit, n, SHARED_WIDTH, False) for n in (FEW_NARROW, MAX_NARROW))
        records = box_point, kind, boxes = self.search_boxes(self.constants[points], bounds, few_limits, starts)
        narrow_boxes = np.flatnonzero((kind == codes.ROUNDING_LIMITED) | (kind == codes.AT_MIN_WIDTH))
        retry, first, count = np.unique(box_point[narrow_boxes], return_index=True, return_counts=True)
        retry, middle = (retry[count > FEW_NARROW], narrow_boxes[first + count // 2][count > FEW_NARROW])
        owner = points[retry]
        place = self.apply_newton(owner, boxes[middle, 0].mean(axis=1))
        in_family = self.is_within(owner, place) & self.is_zero(owner, place, 2.0 * self.narrowest)
        in_family &= self.family_dimension(owner, place)[0] > 0
        retry = retry[~in_family]
        if retry.size:
            starts = starts and (starts[0], starts[1][retry])
            new = self.search_boxes(self.constants[points[retry]], bounds[retry], many_limits, starts)
            records = _replace_records(records, np.isin(box_point, retry), (retry[new[0]], *new[1:]))
        return self._search_about_poles(points, bounds, many_limits, records)

    def _search_about_poles(self, points, bounds, limits, records):
        """Search the boxes about poles again, with F's numerators; drop roots at which a denominator vanishes.

        Towards a pole of F boxes would be divided without end and hide a root near it. A pole is an ordinary root of
        the numerators: if it is unique in a box, F has none there.
        """
        box_point, kind, boxes = records
        pole_boxes = np.flatnonzero(kind == codes.CONTAINS_POLE)
        if not pole_boxes.size:
            return records
        numerators, denominators = self.problem.fractions
        at, first_boxes = np.unique(box_point[pole_boxes], return_index=True)
        starts = boxes[pole_boxes, 0], np.stack([first_boxes, np.append(first_boxes[1:], pole_boxes.size)], axis=-1)
        parameters = [p[points[at]] for p in self.parameters]
        constants, divisors = (self.problem.constants(parameters, tape=tape) for tape in (numerators, denominators))
        owner, kinds, places = self.search_boxes(constants, bounds[at], (*limits[:3], 0.0, False), starts, numerators)
        values = denominators.slopes(divisors, owner, places[:, 1, 0], places[:, 1, 1], 0)[0][:, :, 0]
        is_kept = (kinds != codes.UNIQUE_ZERO) | ~((values[..., 0] <= 0.0) & (values[..., 1] >= 0.0)).any(axis=1)
        # a root near a box without poles is found twice
        for k in np.flatnonzero(is_kept & (kinds == codes.UNIQUE_ZERO)):
            roots = boxes[(box_point == at[owner[k]]) & (kind == codes.UNIQUE_ZERO), 1]
            is_kept[k] = not ((roots[:, 0] <= places[k, 1, 1]) & (roots[:, 1] >= places[k, 1, 0])).all(axis=1).any()
        return _replace_records(
            records, kind == codes.CONTAINS_POLE, (at[owner[is_kept]], kinds[is_kept], places[is_kept])
        )

    def _add_zeros(self, owner, place, half_width=0.0, uncertainty=0.0, dimension=0):
        """Add equilibria within the bounds; those within BOUND_SLACK of a bound are moved to it."""
        slack = np.where(self.periodic, 0.0, BOUND_SLACK * self.width[owner] + half_width)
        is_within = ((place >= self.low[owner] - slack) & (place <= self.high[owner] + slack)).all(axis=1)
        place = np.clip(place, self.low[owner], self.high[owner])
        columns = (
            owner,
            place,
            *(np.broadcast_to(x, place.shape) for x in (half_width, uncertainty)),
            dimension + 0 * owner,
        )
        for name, values in zip(("owner", "place", "half_width", "uncertainty", "dimension"), columns, strict=True):
            setattr(self, name, np.concatenate([getattr(self, name), values[is_within]]))

    def _decide_boxes(self, owner, kind, low, high):
        """Search undecided boxes by Newton's method, add the zeros found, and record why boxes remain undecided.

        A zero is alone in a box about it, or a member of a family of zeros, or that of a cluster of undecided boxes.
        """
        zeros = self._newton_zeros(owner, kind, low, high)
        owner_order, new_zeros = np.argsort(self.owner, kind="stable"), []
        owners_in_order = self.owner[owner_order]
        for point in np.unique(owner):
            rows = slice(*np.searchsorted(owner, [point, point + 1]))
            known_zeros = owner_order[slice(*np.searchsorted(owners_in_order, [point, point + 1]))]
            zero_rows = slice(*np.searchsorted(zeros.owner, [point, point + 1]))
            point_zeros = NewtonZeros(*(values[zero_rows] for values in zeros))
            new_zeros += self._decide_point(point, (low[rows], high[rows], kind[rows]), point_zeros, known_zeros)
        if new_zeros:
            self._add_zeros(*(np.array(x) for x in zip(*new_zeros, strict=True)))

    def _newton_zeros(self, owner, kind, low, high):
        """Return the :class:`NewtonZeros` of points, in their order, zeros that are alone in a box first."""
        start_owner, starts = self._start_places(owner, kind, low, high)
        place = self.apply_newton(start_owner, starts)
        is_within = self.is_within(start_owner, place)
        start_owner, place = start_owner[is_within], place[is_within]
        is_unique, lows, highs, half_width = self._isolate_zeros(start_owner, place)
        place = np.where(is_unique[:, None], 0.5 * (lows[1] + highs[1]), place)
        dimension, direction = np.zeros(start_owner.size, dtype=np.int64), np.full(place.shape, np.nan)
        shared = np.flatnonzero(~is_unique & self.is_zero(start_owner, place, 2.0 * self.narrowest))
        dimension[shared], direction[shared] = self.family_dimension(start_owner[shared], place[shared])
        rows = np.concatenate([np.flatnonzero(is_unique), shared])
        rows = rows[np.lexsort((~is_unique[rows], start_owner[rows]))]
        columns = (start_owner, place, is_unique, half_width, lows[0], highs[0], dimension, direction)
        return NewtonZeros(*(values[rows] for values in columns))

    def _decide_point(self, point, boxes, zeros, known_zeros):
        """Return a point's new zeros (point, place, half-width, uncertainty), and record its family and open boxes.

        Args:
            point: index of the point.
            boxes: (low, high, kind) of its undecided boxes.
            zeros: its :class:`NewtonZeros`.
            known_zeros: indices of its zeros that were added before.
        """
        low, high, kind = boxes
        is_member = zeros.dimension > 0
        if is_member.any():
            self.certified[point] = FAMILY
            if not (self.problem.takes_members and self.problem.system.labels):
                tangent = zeros.direction[zeros.dimension.argmax()]
                self.is_flat[point], self.direction[point, self.problem.free] = True, tangent / np.abs(tangent).max()
        new_zeros = []
        roots = list(zip(self.place[known_zeros], self.half_width[known_zeros], strict=True))
        is_covered = np.zeros(len(kind), dtype=bool)
        for j in np.flatnonzero(zeros.is_unique):
            place, half_width = zeros.place[j], zeros.half_width[j]
            if not any((np.abs(c - place) <= r + half_width).all() for c, r in roots):
                new_zeros.append((point, place, half_width, 0.0 * half_width))
            roots.append((place, half_width))
            is_covered |= ((low >= zeros.low[j]) & (high <= zeros.high[j])).all(axis=1)
        low, high, kind = low[~is_covered], high[~is_covered], kind[~is_covered]
        candidates, width = zeros.place[~zeros.is_unique & ~is_member], MERGE_DISTANCE * self.width[point]
        clusters = self._cluster_roots(point, candidates, (low, high, kind), roots, width)
        if kind.size:
            reason = TOO_LARGE if (kind == codes.NOT_EXAMINED).any() else ROUNDING
            self.certified[point] = max(self.certified[point], reason)
            self.undecided_box[point, self.problem.free] = np.stack([low.min(axis=0), high.max(axis=0)], axis=-1)
        return [*new_zeros, *((point, *root) for root in clusters)]

    def _start_places(self, owner, kind, low, high):
        """Return (owner, place) of starts: centres of undecided boxes, evenly chosen, and named places."""
        points, owners, places = np.unique(owner), [], []
        has_names = self.problem.takes_members and self.problem.system.labels
        is_usable = (
            (kind == codes.ROUNDING_LIMITED)
            | (kind == codes.AT_MIN_WIDTH)
            | ((kind == codes.NOT_EXAMINED) & (not has_names))
        )
        for point in points:
            box_index = slice(*np.searchsorted(owner, [point, point + 1]))
            box_index = box_index.start + np.flatnonzero(is_usable[box_index])
            box_index = box_index[np.linspace(0, box_index.size - 1, min(box_index.size, MAX_STARTS)).astype(np.int64)]
            owners.append(np.full(box_index.size, point))
            places.append(0.5 * (low[box_index] + high[box_index]))
        named_owners, named_places = self._named_places(points)
        return np.concatenate([*owners, named_owners]), np.concatenate([*places, named_places])

    def _isolate_zeros(self, owner, place):
        """Return (is_isolated, lower_ends, upper_ends, half_width): whether a box about each place contains one root.

        The ends, shape (2, places, n), are those of the searched box and of the box about its root.
        """
        is_unique, lows, highs = (np.zeros(owner.size, dtype=bool), np.stack([place] * 2), np.stack([place] * 2))
        for half_width_fraction in ISOLATION_HALF_WIDTHS:
            open_rows = np.flatnonzero(~is_unique)
            if not open_rows.size:
                break
            half_widths = half_width_fraction * self.width[owner[open_rows]]
            box_row, kind, boxes = self.search_boxes(
                self.constants[owner[open_rows]],
                np.stack([place[open_rows] - half_widths, place[open_rows] + half_widths], axis=1),
                (self.narrowest, 1, MAX_NARROW, 0.0, False),
            )
            is_root = kind == codes.UNIQUE_ZERO
            rows = open_rows[box_row[is_root]]
            is_unique[rows] = True
            lows[:, rows], highs[:, rows] = (boxes[is_root, :, 0].swapaxes(0, 1), boxes[is_root, :, 1].swapaxes(0, 1))
        return is_unique, lows, highs, 0.5 * (highs[1] - lows[1])

    def _cluster_roots(self, point, candidates, boxes, noted_roots, width):
        """Return (root, 0, uncertainty) for each connected cluster of undecided boxes that contains a new root.

        The uncertainty covers the cluster; it is 0 if the cluster's search was cut off.
        """
        low, high, kind = boxes
        if not len(candidates) or not kind.size:
            return []
        is_adjacent = ((low[:, None] <= high + width) & (high[:, None] >= low - width)).all(axis=2)
        _, cluster = connected_components(is_adjacent)
        roots = {}
        for root in candidates:
            is_usable = (kind != codes.OVERFLOW) & (kind != codes.CONTAINS_POLE)
            box_index = np.flatnonzero(((root >= low - width) & (root <= high + width)).all(axis=1) & is_usable)
            is_known = any((np.abs(c - root) <= r + width).all() for c, r in noted_roots)
            if not box_index.size or is_known:
                continue
            in_cluster = cluster == cluster[box_index[0]]
            lower, upper = low[in_cluster].min(axis=0), high[in_cluster].max(axis=0)
            middle = np.where((lower <= 0.0) & (upper >= 0.0), 0.0, 0.5 * (lower + upper))
            if (kind[in_cluster] == codes.NOT_EXAMINED).any():  # a cluster that was cut off may contain several roots
                if not any((np.abs(root_place - root) <= width).all() for root_place, _, _ in roots.values()):
                    roots[len(cluster) + len(roots)] = root, 0.0 * root, 0.0 * root
            elif cluster[box_index[0]] not in roots:
                owner = np.array([point])
                is_middle_zero = self.is_zero(owner, middle[None], 2.0 * self.narrowest)[0]
                center = middle if is_middle_zero else root
                roots[cluster[box_index[0]]] = (center, 0.0 * center, np.maximum(center - lower, upper - center))
        return list(roots.values())

    # -- results

    def sorted_places(self):
        """Return sorted places of all coordinates or states, their uncertainty, and the families' dimensions."""
        problem, owner = self.problem, self.owner
        bounds = problem.bounds(self.parameters)
        place, half_width = problem.holds(self.parameters)[owner], np.zeros((owner.size, problem.m))
        low, high = bounds[owner, :, 0], bounds[owner, :, 1]
        place[:, problem.free] = self.place
        half_width[:, problem.free] = np.maximum(self.half_width, PLACE_ROUNDING * np.abs(self.place))
        place = np.where(problem.periodic & (place > high), place - (high - low), place)
        at_low = problem.periodic & (place - low < 1e-12 * (high - low))
        place = np.where(at_low, high - np.maximum(low - place, 0.0), place)
        fixed = [i for i in range(problem.m) if i not in problem.free]
        if fixed:
            F = problem.enclose([p[owner] for p in self.parameters], place - half_width, place + half_width)[0][
                :, fixed, 0
            ]
            is_zero = ((F[..., 0] <= 0.0) & (F[..., 1] >= 0.0)).all(axis=1)
        else:
            is_zero = np.ones(owner.size, dtype=bool)
        order = np.flatnonzero(is_zero & ~self.is_flat[owner])
        rounded = np.round((place - low) / (high - low), 9)[order]
        order = order[np.lexsort((place[order, 0], *rounded.T[::-1], owner[order]))]
        counts = np.bincount(owner[order], minlength=self.size)
        position = np.arange(order.size) - np.repeat(np.cumsum(counts) - counts, counts)
        places = np.full((self.size, max(counts.max(initial=0), 1), problem.m), np.nan)
        dimension, place_errors = np.zeros(places.shape[:2], dtype=np.int64), np.zeros(places.shape)
        places[owner[order], position], dimension[owner[order], position] = place[order], self.dimension[order]
        place_errors[owner[order, None], position[:, None], problem.free] = self.uncertainty[order]
        return places, place_errors, dimension


def _replace_records(records, is_removed, new_records):
    """Return records after removals and additions, in the order of their points."""
    columns = [np.concatenate([a[~is_removed], b]) for a, b in zip(records, new_records, strict=True)]
    order = np.argsort(columns[0], kind="stable")
    return tuple(column[order] for column in columns)


# -- slots


class ParameterPath:
    """The path from the parameters' defaults to points with known places, for `branches`."""

    def __init__(self, problem, parameters, places):
        self.problem, self.values, self.places = problem, parameters, places[..., problem.free]
        self.periodic = problem.periodic[problem.free]
        self.defaults = [p.default for p in problem.system.parameters.values()] or [0.0]

    def _at(self, share, points=slice(None)):
        """Return one array for each parameter, of points at a fraction of the path."""
        pairs = zip(self.defaults, self.values, strict=True)
        return [_interpolate_parameters(default, values[points], share) for default, values in pairs]

    def search(self, share):
        """Return the roots at a fraction of the path, (points, count, n), NaN-padded, and True if all are proved."""
        size, known = len(self.places), np.ones(len(self.places), dtype=bool)
        if share == 1.0:
            return self.places, known  # see `certified`
        search = EquilibriumSearch(self.problem, self._at(share) if share else [p[:1] for p in self._at(share)])
        roots = search.sorted_places()[0][..., self.problem.free]
        return roots.repeat(1 if share else size, axis=0), (search.certified < TOO_LARGE) & known

    def slopes(self, low, high):
        """Return enclosures of F and its derivatives by unknowns and parameters in boxes, as of `Tape.slopes`."""
        tape = self.problem.path_tape
        return tape.slopes(tape.constants([]), np.zeros(len(low), dtype=np.int64), low, high)

    def parameters(self, points, share):
        """Return the parameters of points at fractions of the path, shape (points, parameters)."""
        return np.stack(self._at(share, points), axis=-1)[:, : len(self.problem.parameters)]

    def bounds(self, share):
        """Return the range of each unknown at a fraction of the path, shape (points, n, 2)."""
        return self.problem.bounds(self._at(share))[:, self.problem.free]

    def distance(self, a, b, width):
        """Return the largest distance of any unknown of `a` and `b`, relative to its range `width`, shape (…,)."""
        return _largest_distance(a, b, width, self.periodic)

    def is_outside(self, place, bounds):
        """Return True for places outside the bounds of an unknown that is not periodic."""
        width = branches.SAME_PLACE * (bounds[..., 1] - bounds[..., 0])
        is_beyond = (place < bounds[..., 0] + width) | (place > bounds[..., 1] - width)
        return (is_beyond & ~self.periodic).any(axis=-1)


def _interpolate_parameters(default, values, fraction):
    """Return the parameters at a share of the path from a default to values; geometric if both are positive."""
    linear = default + fraction * (values - default)
    with np.errstate(all="ignore"):
        geometric = default ** (1.0 - fraction) * values**fraction if default > 0 else linear
    between = np.where((values > 0.0) & (default > 0.0), geometric, linear)
    return np.where(fraction == 1.0, values, np.where(fraction == 0.0, default, between))


def _largest_distance(a, b, width, is_periodic):
    """Return the largest distance of any coordinate, relative to its range; the shorter way round if periodic."""
    distance = np.abs(a - b) / width
    return np.where(is_periodic, np.abs(distance - np.round(distance)), distance).max(axis=-1)


def _assign_slots(problem, parameters, places):
    """Return the index of each slot's place, shape (points, most), -1 if empty, and True for crowded points.

    Named slots come first, each with the place nearest to its name.
    """
    system = problem.system
    points, count, _ = places.shape
    labels, width = problem.labels(parameters), np.ptp(problem.bounds(parameters), axis=-1)
    width[~(width > 0.0)] = 1.0
    slots = np.full((points, system.most), -1)
    is_unassigned = ~np.isnan(places).any(axis=-1)
    cost = np.full((points, labels.shape[1], count), np.inf)
    for label in range(labels.shape[1]):
        has_name = ~np.isnan(labels[:, label]).all(axis=1)
        name = labels[:, label : label + 1]
        distance = _largest_distance(places, np.where(np.isnan(name), places, name), width[:, None], problem.periodic)
        distance = np.round(distance / MERGE_DISTANCE) * MERGE_DISTANCE  # if two names coincide, the first one applies
        cost[:, label] = np.where(is_unassigned & has_name[:, None] & (distance < MAX_NAME_DISTANCE), distance, np.inf)
    rows = np.arange(points)
    for _ in range(labels.shape[1]):
        label, place_index = np.divmod(cost.reshape(points, -1).argmin(axis=1), count)
        new_rows = np.isfinite(cost[rows, label, place_index])
        slots[rows[new_rows], label[new_rows]] = place_index[new_rows]
        is_unassigned[rows[new_rows], place_index[new_rows]] = False
        cost[rows[new_rows], label[new_rows], :] = np.inf
        cost[rows[new_rows], :, place_index[new_rows]] = np.inf
    if problem.takes_members and system.labels:
        is_unassigned[:] &= system.most > labels.shape[1]
    is_free = (slots < 0) & (np.arange(system.most) >= labels.shape[1])
    num_free, rank = (is_free.cumsum(axis=1), is_unassigned.cumsum(axis=1))  # the k-th place goes to the k-th slot
    fits = is_unassigned & (rank <= num_free[:, -1:])
    for place_index in np.flatnonzero(fits.any(axis=0)):
        new_rows = np.flatnonzero(fits[:, place_index])
        slot = (num_free[new_rows] == rank[new_rows, place_index, None]).argmax(axis=1)
        slots[new_rows, slot] = place_index
    return slots, (is_unassigned & ~fits).any(axis=1)
