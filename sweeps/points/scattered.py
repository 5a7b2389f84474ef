r"""Sampled points and points listed in a table (as opposed to a grid), along the dimension `point`.

Both, `SampledPoints` and `sweeps.points.tables.Table`, have `names` of parameters, a number of points, `num`, and
`rows`. No list of all points is ever made: a caller requests a range of them.

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

from sweeps.schema.definition import Definition, Sample, add_num_to_ranges
from sweeps.schema.parameters import Range, spread
from sweeps.schema.refusals import UnreadableError, display

if TYPE_CHECKING:
    from sweeps.points.tables import Table

POINT = "point"
PART_POINTS = 2**17  # points per read or write of coordinates, which bounds the memory
EXCLUSIVE_KEYS = ("sample", "bodies")  # keys of a definition that exclude a table
SOBOL_BITS = 30  # binary digits of SciPy's Sobol points
FEISTEL_ROUNDS = 4  # rounds that make a Feistel network a strong pseudorandom permutation (Luby and Rackoff, 1988)
GOLDEN = 0x9E3779B97F4A7C15


class OnDemand:
    """Array of values that are computed when they are read.

    `compute` returns the values of a box, given by a slice of each dimension, start and stop inside the shape.
    """

    def __init__(self, shape: tuple[int, ...], dtype: str, compute: Callable[..., np.ndarray]):
        self.shape, self.ndim, self.size, self.dtype = shape, len(shape), math.prod(shape), np.dtype(dtype)
        self._compute = compute

    def __getitem__(self, box: slice | tuple[slice, ...]) -> np.ndarray:
        box = box if isinstance(box, tuple) else (box,)
        ends = (index.indices(size) for index, size in zip(box, self.shape, strict=True))
        return self._compute(*(slice(a, max(a, b)) for a, b, _ in ends)).astype(self.dtype, copy=False)

    def __array__(self, dtype=None, copy=None) -> np.ndarray:
        return self[(slice(None),) * self.ndim].astype(dtype or self.dtype, copy=False)


class SampledPoints:
    """Points drawn over the ranges of a definition's grid."""

    def __init__(self, definition: Definition):
        self._ranges, self.num = definition.sampled_ranges, definition.sample.num
        self._grid, self._pair = definition.grid, dict(definition.pair or {})
        self._draw = UnitCubeDraw(definition.sample, len(self._ranges))
        names = tuple(name for name in self._ranges if name not in self._pair)
        self.names = (*self._grid.derived.names, *names) if self._pair else names
        follows = {name for over in self._grid.derived.over.values() for name in over} if self._pair else set()
        self._depends_on = follows - {*self._pair}

    def rows(self, start: int, stop: int) -> Mapping[str, np.ndarray]:
        """Return name → values at the points start … stop − 1 (from 0), float64 of shape (stop − start,)."""
        shares, derived, columns = self._draw.shares(start, stop), self._grid.derived, {}
        for k, (name, ends) in enumerate(self._ranges.items()):
            in_pair = name in self._pair
            columns[name] = derived.at_shares(name, ends, shares[:, k]) if in_pair else ends.at_shares(shares[:, k])
        if self._pair:
            parents = {name: _first_value(getattr(self._grid, name)) for name in self._depends_on}
            pair = {name: np.full(stop - start, _first_value(entry)) for name, entry in self._pair.items()}
            values = parents | pair | columns
            columns = {name: derived.compute_values(name, values) for name in derived.names} | columns
            columns = {name: columns[name] for name in self.names}
        return columns


def _first_value(entry: object) -> float:
    values = spread(entry)
    return values.start if isinstance(values, Range) else float(values[0])


def complete_values(values: Mapping, model: type[Definition], folder: str) -> "tuple[dict, Table | None]":
    """Return the plain values of a definition with ranges over the sampled or listed points, and its table.

    The ranges are validated as those of a grid.

    Args:
        values: the plain values of the definition.
        model: the model of its system's definitions.
        folder: the definition's folder, to which the table's path is relative.
    """
    if (listed := model.list_points(values, folder)) is not None:
        from sweeps.points import tables

        path = tables.store_text(listed[1])
        values, folder = {**listed[0], "table": path.name}, str(path.parent)
    values, file = add_num_to_ranges(values), values.get("table")
    grid = values.get("grid", {})
    grid_model = model.model_fields["grid"].annotation
    derived = getattr(grid_model, "derived", None)
    if derived and isinstance(grid, dict) and isinstance(grid.get(derived.key), dict):
        values = {**values, "grid": derived.complete_values(values)}
    if not isinstance(file, str) or not isinstance(grid, dict):
        return values, None
    for excluded_key in (*EXCLUSIVE_KEYS, *([derived.key] if derived else [])):
        if excluded_key in values or excluded_key in grid:
            raise UnreadableError(("table",), display(file), f"is given beside {excluded_key}", "one of these")
    from sweeps.points import tables  # loaded only if there is a table

    table = tables.read_table(file, folder, grid_model, grid)
    ends = dict(zip(table.names, table.ends, strict=True))
    ranges = {n: low if low == high else {"start": low, "stop": high, "num": 2} for n, (low, high) in ends.items()}
    return {**values, "grid": grid | ranges}, table


def lazy_columns(source: "SampledPoints | Table") -> dict[str, OnDemand]:
    """Return each parameter at all points; a table's rows are read once for all parameters."""
    last = lru_cache(maxsize=1)(source.rows)

    def values(name: str, box: slice) -> np.ndarray:
        rows = last if box.stop - box.start <= PART_POINTS else source.rows
        return np.array(rows(box.start, box.stop)[name])  # a copy, so that no further column stays in memory

    return {name: OnDemand((source.num,), "f8", partial(values, name)) for name in source.names}


# -- draws of the unit cube


class UnitCubeDraw:
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

        return qmc.Sobol(self._dimensions, scramble=True, bits=SOBOL_BITS, rng=self._sample.seed)

    def _sobol(self, start: int, stop: int) -> np.ndarray:
        """Return the points start … stop − 1 of the scrambled Sobol sequence, fractions in [0, 1)."""
        with self._lock:  # the engine counts the points that it has drawn
            if self._engine.num_generated > start:
                self._engine.reset()
            if self._engine.num_generated < start:
                self._engine.fast_forward(start - self._engine.num_generated)
            first = self._engine.random(min(1, stop - start))  # alone: SciPy warns if the number is no power of two
            return np.concatenate([first, self._engine.random(stop - start - len(first))])

    def _latin(self, start: int, stop: int) -> np.ndarray:
        """Return the points start … stop − 1 of a Latin hypercube, fractions in [0, 1), each from its number."""
        num = self._sample.num
        numbers = np.arange(start, stop, dtype=np.uint64)
        fractions = np.empty((stop - start, self._dimensions))
        for d in range(self._dimensions):
            keys = np.random.SeedSequence([self._sample.seed, d]).generate_state(FEISTEL_ROUNDS + 1, np.uint64)
            fractions_in_slice = (_mix_bits(numbers ^ keys[FEISTEL_ROUNDS]) >> np.uint64(11)) * 2.0**-53
            # the last slice's upper end must not round to 1
            fractions[:, d] = np.minimum(
                (_permute_numbers(numbers, num, keys) + fractions_in_slice) / num, 1 - 2.0**-53
            )
        return fractions


def _mix_bits(values: np.ndarray) -> np.ndarray:
    """Apply the finishing function of SplitMix64 to uint64."""
    values = values + np.uint64(GOLDEN)
    values = (values ^ (values >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    values = (values ^ (values >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return values ^ (values >> np.uint64(31))


def _permute_numbers(numbers: np.ndarray, num: int, keys: np.ndarray) -> np.ndarray:
    """Return a permutation of 0 … num − 1 at some numbers, uint64."""
    digits = max(2, (num - 1).bit_length())
    places = _apply_network(numbers, digits, keys)
    while (outside := np.flatnonzero(places >= np.uint64(num))).size:
        places[outside] = _apply_network(places[outside], digits, keys)
    return places


def _apply_network(values: np.ndarray, digits: int, keys: np.ndarray) -> np.ndarray:
    """Return a permutation of all numbers of so many binary digits: each half is changed by its partner, in turn."""
    upper, lower = digits // 2, digits - digits // 2
    masks = [np.uint64(2**width - 1) for width in (upper, lower)]
    halves = [values >> np.uint64(lower), values & masks[1]]
    for round_number, key in enumerate(keys[:FEISTEL_ROUNDS]):
        half = round_number % 2
        halves[half] = halves[half] ^ (_mix_bits(halves[1 - half] ^ key) & masks[half])
    return (halves[0] << np.uint64(lower)) | halves[1]
