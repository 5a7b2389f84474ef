r"""Points that are no grid: drawn, or listed in a table. They stand along the dimension `point`, in any number.

Either, `Drawn` or a `sweeps.points.tables.Table`, has `names` of parameters, a number of points, `num`, and `rows`. No
list of all points is ever made: whoever needs some asks for these.

Sobol points are SciPy's, random points those of NumPy's `default_rng(seed).random((num, d))`; generators are advanced.
A Latin hypercube puts one point into each of `num` slices along every dimension. The slice of a point is a permutation
of its number, made by a Feistel network over :math:`2^k \ge` num numbers, walked until it falls below num: so no list
of `num` numbers is ever made, as SciPy's own does.

Source: Black and Rogaway (2002), Ciphers with arbitrary finite domains; Steele, Lea and Flood (2014), Fast splittable
pseudorandom number generators.
"""

import math
from collections.abc import Callable, Mapping
from functools import cached_property, lru_cache, partial
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from sweeps.schema.definition import Definition, Sample, ends_alone
from sweeps.schema.parameters import Range, spread
from sweeps.schema.refusals import UnreadableError, display

if TYPE_CHECKING:
    from sweeps.points.tables import Table

POINT = "point"
PART_POINTS = 2**17  # of which coordinates are read, and written, at once
BESIDE = ("sample", "bodies")  # other ways to say what points there are
BITS = 30  # of SciPy's Sobol points
ROUNDS = 4  # of the Feistel network: as many as make it like any permutation (Luby and Rackoff, 1988)
GOLDEN = 0x9E3779B97F4A7C15


class OnDemand:
    """Values that are made where they are asked for; it reads as an array.

    `part` returns the values of a box, given by a slice of each dimension, start and stop inside the shape.
    """

    def __init__(self, shape: tuple[int, ...], dtype: str, part: Callable[..., np.ndarray]):
        self.shape, self.ndim, self.size, self.dtype = shape, len(shape), math.prod(shape), np.dtype(dtype)
        self._part = part

    def __getitem__(self, box: slice | tuple[slice, ...]) -> np.ndarray:
        box = box if isinstance(box, tuple) else (box,)
        ends = (part.indices(size) for part, size in zip(box, self.shape, strict=True))
        return self._part(*(slice(a, max(a, b)) for a, b, _ in ends)).astype(self.dtype, copy=False)

    def __array__(self, dtype=None, copy=None) -> np.ndarray:
        return self[(slice(None),) * self.ndim].astype(dtype or self.dtype, copy=False)


class Drawn:
    """Points drawn over the ranges of a definition's grid."""

    def __init__(self, definition: Definition):
        self._ranges, self.num = definition.drawn, definition.sample.num
        self._grid, self._pair = definition.grid, dict(definition.pair or {})
        self._draw = Draw(definition.sample, len(self._ranges))
        names = tuple(name for name in self._ranges if name not in self._pair)
        self.names = (*self._grid.derived.names, *names) if self._pair else names
        follows = {name for over in self._grid.derived.over.values() for name in over} if self._pair else set()
        self._others = follows - {*self._pair}

    def rows(self, start: int, stop: int) -> Mapping[str, np.ndarray]:
        """Return name → values at the points start … stop − 1 (from 0), float64 of shape (stop − start,)."""
        shares = self._draw.shares(start, stop)
        drawn = {}
        for k, (name, spaced) in enumerate(self._ranges.items()):
            is_one = name in self._pair
            drawn[name] = self._grid.derived.drawn(name, spaced, shares[:, k]) if is_one else spaced.drawn(shares[:, k])
        if self._pair:
            one = {name: _first(getattr(self._grid, name)) for name in self._others}
            values = one | {name: np.full(stop - start, _first(e)) for name, e in self._pair.items()} | drawn
            drawn = {name: self._grid.derived.given(name, values) for name in self._grid.derived.names} | drawn
            drawn = {name: drawn[name] for name in self.names}
        return drawn


def _first(entry: object) -> float:
    values = spread(entry)
    return values.start if isinstance(values, Range) else float(values[0])


def completed(values: Mapping, model: type[Definition], folder: str) -> "tuple[dict, Table | None]":
    """Return the plain values of a definition with ranges over the sampled or listed points, and its table.

    So whatever is asked of the values of a grid is asked of those of scattered points as well.
    """
    values, file = ends_alone(values), values.get("table")
    grid = values.get("grid", {})
    wanted = model.model_fields["grid"].annotation
    derived = getattr(wanted, "derived", None)
    if derived and isinstance(grid, dict) and isinstance(grid.get(derived.key), dict):
        values = {**values, "grid": derived.completed(values)}
    if not isinstance(file, str) or not isinstance(grid, dict):
        return values, None
    for other in (*BESIDE, *([derived.key] if derived else [])):
        if other in values or other in grid:
            raise UnreadableError(("table",), display(file), f"is given beside {other}", "one of these")
    from sweeps.points import tables  # loaded for a table that is there

    table = tables.read(file, folder, wanted, grid)
    ends = dict(zip(table.names, table.ends, strict=True))
    ranges = {n: low if low == high else {"start": low, "stop": high, "num": 2} for n, (low, high) in ends.items()}
    return {**values, "grid": grid | ranges}, table


def columns(source: "Drawn | Table") -> dict[str, OnDemand]:
    """Return each parameter at all points; a table's rows are read once for all parameters."""
    last = lru_cache(maxsize=1)(source.rows)

    def values(name: str, part: slice) -> np.ndarray:
        rows = last if part.stop - part.start <= PART_POINTS else source.rows
        return np.array(rows(part.start, part.stop)[name])  # apart from the other parameters

    return {name: OnDemand((source.num,), "f8", partial(values, name)) for name in source.names}


# -- draws of the unit cube


class Draw:
    """Points of the unit cube."""

    def __init__(self, sample: Sample, dimensions: int):
        self._sample, self._dimensions, self._lock = sample, dimensions, Lock()

    def shares(self, start: int, stop: int) -> np.ndarray:
        """Return the points start … stop − 1 (from 0), float64 of shape (stop − start, dimensions), each in [0, 1)."""
        ways = {"sobol": self._sobol, "latin": self._latin, "random": self._random}
        return ways[self._sample.method](start, stop)

    def _random(self, start: int, stop: int) -> np.ndarray:
        bits = np.random.PCG64(self._sample.seed)
        bits.advance(start * self._dimensions)
        return np.random.Generator(bits).random((stop - start, self._dimensions))

    @cached_property
    def _engine(self):
        from scipy.stats import qmc

        return qmc.Sobol(self._dimensions, scramble=True, bits=BITS, rng=self._sample.seed)

    def _sobol(self, start: int, stop: int) -> np.ndarray:
        with self._lock:  # the engine counts what it has drawn
            if self._engine.num_generated > start:
                self._engine.reset()
            if self._engine.num_generated < start:
                self._engine.fast_forward(start - self._engine.num_generated)
            first = self._engine.random(min(1, stop - start))  # alone: of others than 2^k at once SciPy warns
            return np.concatenate([first, self._engine.random(stop - start - len(first))])

    def _latin(self, start: int, stop: int) -> np.ndarray:
        num = self._sample.num
        numbers = np.arange(start, stop, dtype=np.uint64)
        fractions = np.empty((stop - start, self._dimensions))
        for d in range(self._dimensions):
            keys = np.random.SeedSequence([self._sample.seed, d]).generate_state(ROUNDS + 1, np.uint64)
            within = (_mixed(numbers ^ keys[ROUNDS]) >> np.uint64(11)) * 2.0**-53
            # the last slice's upper end must not round to 1
            fractions[:, d] = np.minimum((_permuted(numbers, num, keys) + within) / num, 1 - 2.0**-53)
        return fractions


def _mixed(values: np.ndarray) -> np.ndarray:
    """Apply the finishing function of SplitMix64 to uint64."""
    values = values + np.uint64(GOLDEN)
    values = (values ^ (values >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    values = (values ^ (values >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return values ^ (values >> np.uint64(31))


def _permuted(numbers: np.ndarray, num: int, keys: np.ndarray) -> np.ndarray:
    """Return a permutation of 0 … num − 1 at some numbers, uint64."""
    digits = max(2, (num - 1).bit_length())
    places = _network(numbers, digits, keys)
    while (walking := np.flatnonzero(places >= np.uint64(num))).size:
        places[walking] = _network(places[walking], digits, keys)
    return places


def _network(values: np.ndarray, digits: int, keys: np.ndarray) -> np.ndarray:
    """Return a permutation of all numbers of so many binary digits: each half is changed by the other, in turn."""
    upper, lower = digits // 2, digits - digits // 2
    masks = [np.uint64(2**width - 1) for width in (upper, lower)]
    halves = [values >> np.uint64(lower), values & masks[1]]
    for turn, key in enumerate(keys[:ROUNDS]):
        changed = turn % 2
        halves[changed] = halves[changed] ^ (_mixed(halves[1 - changed] ^ key) & masks[changed])
    return (halves[0] << np.uint64(lower)) | halves[1]
