"""All equilibria of many points within bounds: where ∂V/∂q vanishes.

*One coordinate.* ∂V/∂q is scanned over SCAN cells; a cell in which a higher derivative changes sign, down from the
DEPTH-th of V to V″, is cut there, so that roots in one cell are seen apart (Rolle's theorem: each pair of them has a
root of the next derivative in between). Cells that the Taylor
series keeps from zero are left out. Each change of sign is then closed down by Chandrupatla's method
(`scipy.optimize.elementwise.find_root`), and an extremum that touches zero is a root too.

*Several.* Levenberg-Marquardt from a lattice of starts and from the places that the description names. That all are
found cannot be proved here; `most` is the author's word for how many there are, and more is an error.

Roots closer than a millionth of the range (1e-7 for one coordinate) are one, whichever bound of a periodic
coordinate they stand at. Where V stays flat along a line through an equilibrium there is no single place: such a point
is FLAT and has none, unless the description holds a coordinate there.

Source: Chandrupatla, Advances in Engineering Software 28 (1997) 145; Nocedal and Wright, Numerical Optimization, 10.3.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy as sp
from scipy.optimize import elementwise

from sweeps.mechanics.derivation import Equations
from sweeps.mechanics.description import DescriptionError
from sweeps.mechanics.graph import lambdified

SCAN = 40
DEPTH = 5
ROUNDINGS = 8 * np.finfo(np.float64).eps
XTOL = 1e-16  # of a bracket
OFFSET = 0.3819660112501051  # a scan of a periodic coordinate starts off the round numbers
SAME_1D, SAME = 1e-7, 1e-6  # of the range; a triple root is known to 1e-8 in doubles
STARTS = 64
ITERATIONS = 60
CHUNK = 1 << 14  # points at a time; a search of several coordinates takes fewer
MOST_FACTORED = 60  # operations
FAR = 0.25  # of the range: no name reaches farther


@dataclass(frozen=True)
class Found:
    """Equilibria of points.

    Attributes:
        places: q0, shape (points, most, n); NaN where a point has no such equilibrium.
        flat: shape (points,), whether the equilibria form a line.
    """

    places: np.ndarray
    flat: np.ndarray


class Landscape:
    """V's derivatives and a_ij of a system as functions of arrays.

    Each takes parameters (a tuple of arrays) and q (a sequence of n arrays), all of one shape.
    """

    def __init__(self, equations: Equations):
        self.equations = equations
        self.n = equations.n
        arguments = (*equations.parameters, *equations.q)
        self._gradient = lambdified(arguments, equations.gradient)
        self._hessian = lambdified(arguments, equations.hessian)
        self._a = lambdified(arguments, equations.a)
        self._third = lambdified(arguments, equations.third)
        self._cascade = None
        self.last: tuple = (None, None)  # the points that were searched last, and what was found
        pulls = [sum(map(sp.Abs, sp.Add.make_args(sp.expand(e)))) for e in equations.gradient]
        self._pulls = lambdified(arguments, pulls)
        terms = [sum(map(sp.Abs, sp.Add.make_args(sp.expand(e)))) for e in equations.hessian]
        self._terms = lambdified(arguments, terms)
        coordinates = equations.system.kept
        self._sizes = lambdified(arguments, [c.size for c in coordinates])
        self._bounds = lambdified(equations.parameters, [b for c in coordinates for b in c.bounds])
        held = [c.hold if c.hold is not None else 0 for c in coordinates]
        self._holds = lambdified(equations.parameters, held)
        labels = equations.system.labels.values()
        nan = sp.nan
        self._labels = lambdified(equations.parameters, [label.get(q, nan) for label in labels for q in equations.q])

    @cached_property
    def canonical(self) -> tuple[float | None, ...]:
        """For each parameter that no equilibrium depends on its default, for each other None.

        A factor of ∂V/∂q_i that is free of q and never 0 (the mass and the length of a pendulum) moves no root.
        """
        system, places = self.equations.system, set()
        for e in self.equations.gradient:
            factor, rest = _factored(e).as_independent(*self.equations.q, as_Add=False)
            places |= rest.free_symbols | (set() if factor.is_nonzero else factor.free_symbols)
        for c in system.kept:
            places |= set().union(*(e.free_symbols for e in (*c.bounds, c.hold) if e is not None))
        for place in system.labels.values():
            places |= set().union(*(e.free_symbols for e in place.values()))
        return tuple(None if p.symbol in places else p.default for p in system.parameters.values())

    def gradient(self, parameters, q):
        """∂V/∂q_i, a list of n arrays."""
        return self._gradient(*parameters, *q)

    def rounding(self, parameters, q):
        """What rounding leaves of ∂V/∂q_i where it vanishes, a list of n arrays: from its terms' absolute values."""
        return [ROUNDINGS * value for value in self._pulls(*parameters, *q)]

    def hessian(self, parameters, q):
        """V″, shape (..., n, n)."""
        return self._matrix(self._hessian, parameters, q)

    def a(self, parameters, q):
        """a_ij, shape (..., n, n)."""
        return self._matrix(self._a, parameters, q)

    def hessian_terms(self, parameters, q):
        """The sums of the absolute values of the terms of V″, shape (..., n, n)."""
        return self._matrix(self._terms, parameters, q)

    def derivative(self, order, axis, parameters, q):
        """∂^order V/∂q_axis^order."""
        if self._cascade is None:
            x, arguments = self.equations.q[axis], (*self.equations.parameters, *self.equations.q)
            parts = [self.equations.gradient[axis].diff(x, k) for k in range(DEPTH)]
            self._cascade = [lambdified(arguments, [part]) for part in parts]
        return self._cascade[order - 1](*parameters, *q)[0]

    def third(self, parameters, q):
        """The third derivatives of V and the first of a, a list of arrays."""
        return self._third(*parameters, *q)

    def sizes(self, parameters, q):
        """The size of a nudge of relative size one in each coordinate, shape (..., n)."""
        return np.stack(self._sizes(*parameters, *q), axis=-1)

    def _matrix(self, function, parameters, q):
        values = np.stack(function(*parameters, *q), axis=-1)
        return values.reshape(*values.shape[:-1], self.n, self.n)

    def bounds(self, parameters):
        """(low, high) of each coordinate, shape (points, n, 2)."""
        values = np.stack(self._bounds(*parameters), axis=-1)
        return values.reshape(-1, self.n, 2)

    def holds(self, parameters):
        """Values of the coordinates that are held, shape (points, n)."""
        return np.stack(self._holds(*parameters), axis=-1)

    def labels(self, parameters):
        """Places that the description names, shape (points, labels, n); NaN where there is none."""
        count = len(self.equations.system.labels)
        if not count:
            return np.empty((parameters[0].size, 0, self.n))
        return np.stack(self._labels(*parameters), axis=-1).reshape(-1, count, self.n)


def _factored(e):
    return sp.factor(e) if e.count_ops() < MOST_FACTORED else sp.factor_terms(e)


def find(landscape: Landscape, parameters) -> Found:
    """All equilibria of points.

    Args:
        landscape: V's derivatives.
        parameters: one array (points,) a parameter, in the description's order.

    Raises:
        DescriptionError: if a point has more equilibria than `most`.
    """
    given = [np.atleast_1d(np.asarray(p, dtype=np.float64)) for p in parameters]
    pairs = zip(landscape.canonical, given, strict=True)
    rows = [p if default is None else np.full_like(p, default) for default, p in pairs]
    first, inverse = _points(rows)
    rows = [p[first] for p in rows]
    asked, known, found = b"".join(p.tobytes() for p in rows), *landscape.last
    if asked != known:
        found = _find(landscape, rows)
        landscape.last = asked, found
    return Found(found.places[inverse], found.flat[inverse])


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
    free = [i for i, c in enumerate(landscape.equations.system.kept) if c.hold is None]
    parts = []
    chunk = CHUNK if len(free) == 1 else CHUNK // STARTS
    for start in range(0, parameters[0].size, chunk):
        part = tuple(p[start : start + chunk] for p in parameters)
        with np.errstate(all="ignore"):
            places, flat = (_scan if len(free) == 1 else _search)(landscape, part, free)
        places[flat] = np.nan
        parts.append(Found(_arranged(landscape, part, places), flat))
    return Found(np.concatenate([p.places for p in parts]), np.concatenate([p.flat for p in parts]))


# -- one coordinate


def _scan(landscape, parameters, free):
    (axis,) = free
    points = parameters[0].size
    bounds, holds = landscape.bounds(parameters)[:, axis], landscape.holds(parameters)
    periodic = landscape.equations.system.kept[axis].periodic
    fractions = (np.arange(SCAN + 1) + (OFFSET if periodic else 0.0)) / SCAN
    nodes = bounds[:, :1] + (bounds[:, 1:] - bounds[:, :1]) * fractions

    def at(x, index, order):
        chosen = [p[index] for p in parameters]
        q = [x if i == axis else np.broadcast_to(holds[index, i], x.shape) for i in range(landscape.n)]
        return landscape.derivative(order, axis, chosen, q) if order else landscape.rounding(chosen, q)[axis]

    index = np.broadcast_to(np.arange(points)[:, None], nodes.shape)
    nothing = np.abs(at(nodes, index, 1)) <= at(nodes, index, 0)
    flat = (nothing[:, 1:] & nothing[:, :-1]).any(axis=1)
    near = _near(at, index[:, :-1].ravel(), nodes[:, :-1].ravel(), nodes[:, 1:].ravel())
    row, low, high = _cut(at, *near)
    below, above = at(low, row, 1), at(high, row, 1)
    crossing = below * above < 0.0
    root = _roots(lambda x, i: at(x, i, 1), low[crossing], high[crossing], row[crossing])
    touching = np.abs(below) <= at(low, row, 0)  # a node or an extremum on zero; the cell above starts on it
    roots = [np.column_stack([row[crossing], root]), np.column_stack([row[touching], low[touching]])]
    if not periodic:
        last = nothing[:, -1]
        roots.append(np.column_stack([np.flatnonzero(last), nodes[last, -1]]))
    table = np.concatenate(roots)
    places = _table(table[:, 0].astype(int), _wrapped(table[:, 1], bounds[table[:, 0].astype(int)], periodic), points)
    full = np.broadcast_to(holds[:, None, :], (*places.shape, landscape.n)).copy()
    full[..., axis] = places
    full[np.isnan(places)] = np.nan
    return _still(landscape, parameters, _distinct(landscape, parameters, full, SAME_1D)), flat


def _near(at, row, low, high):
    """The cells that can hold a root: those where the Taylor terms of ∂V/∂q, all against it, could bring it to zero."""
    width, left, factor = high - low, np.abs(at(low, row, 1)), 1.0
    for order in range(2, DEPTH + 1):
        factor = factor * width / (order - 1)
        left = left - factor * np.abs(at(low, row, order)) * (2.0 if order == DEPTH else 1.0)
    kept = ~(left > 0.0)
    return row[kept], low[kept], high[kept]


def _cut(at, row, low, high):
    """Cells cut where a derivative of V changes sign, from the highest down to V″."""
    for order in range(DEPTH, 1, -1):
        bent = at(low, row, order) * at(high, row, order) < 0.0
        turn = _roots(lambda x, i, order=order: at(x, i, order), low[bent], high[bent], row[bent])
        row = np.concatenate([row[~bent], row[bent], row[bent]])
        low, high = np.concatenate([low[~bent], low[bent], turn]), np.concatenate([high[~bent], turn, high[bent]])
    return row, low, high


def _roots(function, low, high, index):
    """Roots of function(x, index) in brackets, to a rounding of the bracket's width."""
    if low.size == 0:
        return low
    width = high - low
    result = elementwise.find_root(
        lambda u, low, width, index: function(low + u * width, index),
        (np.zeros_like(low), np.ones_like(low)),
        args=(low, width, index),
        tolerances={"xrtol": 0.0, "xatol": XTOL, "frtol": 0.0, "fatol": 0.0},
        maxiter=100,
    )
    return low + result.x * width


def _wrapped(x, bounds, periodic):
    if not periodic:
        return x
    low, period = bounds[:, 0], bounds[:, 1] - bounds[:, 0]
    return np.where(x > bounds[:, 1], x - period, np.where(x < low, x + period, x))


def _table(rows, values, points):
    """Ragged (row, value) pairs as an array (points, longest), NaN beyond each row's own."""
    order = np.lexsort((values, rows))
    rows, values = rows[order], values[order]
    counts = np.bincount(rows, minlength=points)
    position = np.arange(rows.size) - np.repeat(np.cumsum(counts) - counts, counts)
    table = np.full((points, max(counts.max(initial=0), 1)), np.nan)
    table[rows, position] = values
    return table


# -- several coordinates


def _search(landscape, parameters, free):
    points = parameters[0].size
    bounds, holds, labels = landscape.bounds(parameters), landscape.holds(parameters), landscape.labels(parameters)
    per_axis = max(2, int(STARTS ** (1.0 / len(free))))
    fractions = (np.arange(per_axis) + OFFSET) / per_axis
    lattice = np.stack(np.meshgrid(*[fractions] * len(free), indexing="ij"), -1).reshape(-1, len(free))
    starts = np.broadcast_to(holds[:, None], (points, len(lattice), landscape.n)).copy()
    starts[..., free] = bounds[:, None, free, 0] + lattice * (bounds[:, None, free, 1] - bounds[:, None, free, 0])
    starts = np.concatenate([starts, labels], axis=1)
    for i in set(range(landscape.n)) - set(free):
        starts[..., i] = holds[:, None, i]
    index = np.repeat(np.arange(points), starts.shape[1])
    q = _descended(landscape, [p[index] for p in parameters], starts.reshape(-1, landscape.n), free, bounds[index])
    places = q.reshape(points, -1, landscape.n)
    places = _still(landscape, parameters, places)
    places = _inside(landscape, places, bounds)
    flat = _flat(landscape, parameters, places, free, bounds)
    return _distinct(landscape, parameters, places, SAME), flat


def _descended(landscape, parameters, q, free, bounds):
    """Levenberg-Marquardt on ∂V/∂q, in units of the range; quadratic near a root, and no matrix is singular."""
    q = q.copy()
    width = (bounds[:, :, 1] - bounds[:, :, 0])[:, free]
    active = np.flatnonzero(np.isfinite(q).all(axis=1))
    for _ in range(ITERATIONS):
        if active.size == 0:
            break
        chosen = [p[active] for p in parameters]
        gradient, J = _scaled(landscape, chosen, q[active], free, width[active])
        weight = np.linalg.norm(gradient, axis=1) * np.linalg.norm(J, axis=(1, 2))
        size = np.square(J).sum(axis=(1, 2))
        damping = 0.1 * weight + 1e-14 * size + (size == 0.0)  # never singular, however flat V is
        normal = np.einsum("pki,pkj->pij", J, J) + damping[:, None, None] * np.eye(len(free))
        right = -np.einsum("pki,pk->pi", J, gradient)
        sound = np.isfinite(normal).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
        step = np.full(right.shape, np.nan)
        step[sound] = np.linalg.solve(normal[sound], right[sound][..., None])[..., 0]
        step *= np.minimum(1.0, 0.2 / np.maximum(np.linalg.norm(step, axis=1), 1e-300))[:, None]
        moved = q[active]
        moved[:, free] += step * width[active]
        q[active] = moved
        active = active[np.linalg.norm(step, axis=1) > 1e-15]
    return q


def _scaled(landscape, parameters, q, free, width):
    """Gradient and Hessian by the free coordinates, over their ranges."""
    columns = list(q.T)
    gradient = np.stack([landscape.gradient(parameters, columns)[i] for i in free], axis=-1) * width
    hessian = landscape.hessian(parameters, columns)[:, free][:, :, free] * width[:, :, None] * width[:, None, :]
    return gradient, hessian


def _inside(landscape, places, bounds):
    places = places.copy()
    for i, c in enumerate(landscape.equations.system.kept):
        low, high = bounds[:, None, i, 0], bounds[:, None, i, 1]
        x = places[..., i]
        if c.periodic:
            x = low + np.mod(x - low, high - low)
            places[..., i] = np.where(np.abs(x - low) < SAME * (high - low), low + (high - low), x)
        elif c.hold is None:
            places[(x < low) | (x > high)] = np.nan
    return places


def _flat(landscape, parameters, places, free, bounds):
    """Whether V″ of some equilibrium has a null direction along which ∂V/∂q stays zero."""
    points, count, n = places.shape
    index = np.repeat(np.arange(points), count)
    q, chosen = places.reshape(-1, n), [p[index] for p in parameters]
    width = (bounds[:, :, 1] - bounds[:, :, 0])[index][:, free]
    _, hessian = _scaled(landscape, chosen, q, free, width)
    terms = landscape.hessian_terms(chosen, list(q.T))[:, free][:, :, free] * width[:, :, None] * width[:, None, :]
    good = np.isfinite(hessian).all(axis=(1, 2))
    values, vectors = np.linalg.eigh(np.where(good[:, None, None], hessian, 0.0))
    scale = np.abs(terms).max(axis=(1, 2))
    flat = np.zeros(q.shape[0], dtype=bool)
    for k in range(len(free)):
        moved = q.copy()
        moved[:, free] += 0.01 * vectors[:, :, k] * width
        gradient, _ = _scaled(landscape, chosen, moved, free, width)
        flat |= good & (np.abs(values[:, k]) <= 1e-9 * scale) & (np.abs(gradient).max(axis=1) <= 1e-9 * scale)
    return flat.reshape(points, count).any(axis=1)


# -- both


def _still(landscape, parameters, places):
    """Places at which every ∂V/∂q vanishes, also by the coordinates that are held; NaN in place of others."""
    points, count, n = places.shape
    index = np.repeat(np.arange(points), count)
    q, chosen = places.reshape(-1, n), [p[index] for p in parameters]
    gradient = np.abs(np.stack(landscape.gradient(chosen, list(q.T)), axis=-1))
    bounds = landscape.bounds(parameters)
    terms = landscape.hessian_terms(chosen, list(q.T))
    scale = np.einsum("pij,pj->pi", terms, (bounds[:, :, 1] - bounds[:, :, 0])[index])
    moving = ~(gradient <= 1e-9 * scale + 1e-300).all(axis=1)
    q = q.copy()
    q[moving] = np.nan
    return q.reshape(places.shape)


def _distances(landscape, a, b, bounds):
    """Largest distance by any coordinate between places, over its range; periodic ones the short way."""
    width = bounds[..., 1] - bounds[..., 0]
    apart = np.abs(a - b) / np.where(width > 0.0, width, 1.0)
    periodic = np.array([c.periodic for c in landscape.equations.system.kept])
    apart = np.where(periodic, np.abs(apart - np.round(apart)), apart)
    return np.where(np.isnan(b), 0.0, apart).max(axis=-1)


def _distinct(landscape, parameters, places, same):
    """The places without those that an earlier one stands for, in the order of their coordinates, NaN last."""
    bounds = landscape.bounds(parameters)
    places = places.copy()
    for j in range(1, places.shape[1]):
        earlier = places[:, :j]
        d = _distances(landscape, earlier, places[:, j : j + 1], bounds[:, None])
        places[(np.nan_to_num(d, nan=np.inf) < same).any(axis=1), j] = np.nan
    keys = [np.where(np.isnan(places[..., 0]), np.inf, np.round(places[..., i], 9)) for i in range(places.shape[2])]
    order = np.lexsort(keys[::-1], axis=1)
    return np.take_along_axis(places, order[..., None], axis=1)


def _arranged(landscape, parameters, places):
    """Places in the slots of the dimension `equilibrium`: those with names first, each nearest to its name."""
    system = landscape.equations.system
    points, count, n = places.shape
    labels, bounds = landscape.labels(parameters), landscape.bounds(parameters)
    slots = np.full((points, system.most, n), np.nan)
    here = ~np.isnan(places).any(axis=-1)
    _check_count(system, parameters, here)
    left = here.copy()
    cost = np.full((points, labels.shape[1], count), np.inf)
    for k in range(labels.shape[1]):
        named = ~np.isnan(labels[:, k]).all(axis=1)
        d = _distances(landscape, places, labels[:, k : k + 1], bounds[:, None])
        d = np.round(d / SAME_1D) * SAME_1D  # where names fall together the first of them is meant
        cost[:, k] = np.where(left & named[:, None] & (d < FAR), d, np.inf)
    rows = np.arange(points)
    for _ in range(labels.shape[1]):
        k, j = np.divmod(cost.reshape(points, -1).argmin(axis=1), count)
        chosen = np.isfinite(cost[rows, k, j])
        slots[rows[chosen], k[chosen]] = places[rows[chosen], j[chosen]]
        left[rows[chosen], j[chosen]] = False
        cost[rows[chosen], k[chosen], :] = np.inf
        cost[rows[chosen], :, j[chosen]] = np.inf
    for j in range(count):
        for slot in range(system.most):
            put = left[:, j] & np.isnan(slots[:, slot, 0]) & (slot >= labels.shape[1])
            slots[put, slot] = places[put, j]
            left[put, j] = False
    if left.any():
        _refuse(
            system, parameters, np.flatnonzero(left.any(axis=1))[0], "one is near no name, and there is no room left"
        )
    return slots


def _check_count(system, parameters, here):
    crowded = np.flatnonzero(here.sum(axis=1) > system.most)
    if crowded.size:
        _refuse(system, parameters, crowded[0], f"there are {here[crowded[0]].sum()}")


def _refuse(system, parameters, point, wrong):
    values = ", ".join(f"{name}={p[point]:g}" for name, p in zip(system.parameters, parameters, strict=True))
    allowed = f"at most {system.most} (`most`, or their names)"
    raise DescriptionError(f"equilibria: {wrong}, at {values}; allowed: {allowed}")
