"""A map's columns for one page: as many points as fit, scaling laws found and used, numbers packed as text."""

import base64
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from sweeps.maps.description import MapDescription
from sweeps.maps.summary import Summary, read
from sweeps.schema.boxes import blocks

if TYPE_CHECKING:
    import xarray as xr

BLOCK_POINTS = 2**17  # some 25 MB of columns at a time, whatever the map's size
MOST_POINTS = 400_000  # more never fit into a page, so no more are kept in memory
POWERS = (0, 1, -1, 2, -2)  # of a parameter, tried as scaling laws
LAW_TOLERANCE = 1e-11  # relative: far below the digits that a page shows
EXACT_BYTES = 1_500_000  # a map below that keeps its doubles as they are
MANTISSA_BITS = (24, 15)  # of numbers that must be shortened: seven digits, or four and a half
UNCERTAIN = ("_error", "_stderr")  # ends of names of columns whose numbers never need more than seven digits
SLIDER_WEIGHT = 4  # a dimension outside the plane is thinned as if it were that many times longer
FEWEST = 8  # a dimension is not thinned below that


@dataclass
class PageColumn:
    """One variable over the points kept, reduced along every dimension where a scaling law holds."""

    name: str  #: the variable
    #: over the map's dimensions; of length one where the variable has not the dimension, or a law holds.
    values: np.ndarray
    #: dimension → k, the law: the variable times |coordinate|^k does not depend on that dimension.
    powers: dict[str, int] = field(default_factory=dict)
    exact: bool = False  #: whether the page has its numbers as they are, because it works with them


def gather(ds: "xr.Dataset", described: MapDescription) -> tuple[Summary, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Read a map once.

    Returns:
        Its totals, the columns at the points that a page can hold at most, and the indices kept along each dimension.
    """
    kept = thinned(described.sizes, described.real_dimensions, MOST_POINTS)
    shapes = {name: [len(kept[d]) if d in one.dims else 1 for d in kept] for name, one in described.columns.items()}
    columns = {name: np.empty(shape, ds[name].dtype) for name, shape in shapes.items()}
    summary = Summary(described)
    for box in blocks(described.sizes, BLOCK_POINTS):
        values = {name: read(ds, name, box) for name in columns}
        summary.add(box, {name: column for name, column in values.items() if name in described.variables})
        for name, column in columns.items():
            _keep(column, values[name], box, kept)
    return summary, columns, kept


def _keep(column: np.ndarray, values: np.ndarray, box: Mapping[str, slice], kept: Mapping[str, np.ndarray]) -> None:
    """Add the kept points of one column in one box, as `read` returns them."""
    into = []
    for k, (dim, indices) in enumerate(kept.items()):
        inside, place = within(box[dim], indices)
        is_constant = values.shape[k] == 1 and column.shape[k] == 1
        values = values if is_constant else np.take(values, inside, axis=k)
        into.append(slice(None) if is_constant else place)
    column[tuple(into)] = values


def thinned(sizes: Mapping[str, int], numeric: set[str], most: int) -> dict[str, np.ndarray]:
    """Return the indices to keep along each dimension so that at most `most` points are left, ends included.

    The longest numeric dimensions lose values first; others only when no numeric one is longer than `FEWEST`. The
    two longest of all make the page's plane and keep more of theirs than those that become sliders.
    """
    kept = dict(sizes)
    plane = sorted((d for d in sizes if d in numeric), key=lambda dim: -sizes[dim])[:2]
    while math.prod(kept.values()) > most:
        candidates = [d for d in kept if d in numeric and kept[d] > FEWEST] or [d for d in kept if kept[d] > 1]
        longest = max(candidates, key=lambda d: kept[d] * (1 if d in plane else SLIDER_WEIGHT))
        least = FEWEST if longest in numeric and kept[longest] > FEWEST else 1
        kept[longest] = max(least, min(kept[longest] - 1, int(kept[longest] * 0.97)))
    return {d: np.unique(np.linspace(0, sizes[d] - 1, n).round().astype(int)) for d, n in kept.items()}


def within(box: slice, kept: np.ndarray) -> tuple[np.ndarray, slice]:
    """Return the kept indices of one dimension inside a box, and their slice among all kept indices."""
    low, high = np.searchsorted(kept, [box.start, box.stop])
    return kept[low:high] - box.start, slice(low, high)


def fewer(
    described: MapDescription, columns: Mapping[str, np.ndarray], kept: Mapping[str, np.ndarray], points: int
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return columns and kept indices thinned to at most so many points."""
    chosen = thinned({dim: len(indices) for dim, indices in kept.items()}, described.real_dimensions, points)
    columns = dict(columns)
    for name, values in columns.items():
        for k, indices in enumerate(chosen.values()):
            if values.shape[k] > 1:
                values = np.take(values, indices, axis=k)
        columns[name] = values
    return columns, {dim: kept[dim][indices] for dim, indices in chosen.items()}


def scaling_laws(
    described: MapDescription, columns: Mapping[str, np.ndarray], kept: Mapping[str, np.ndarray]
) -> list[PageColumn]:
    """Return columns without the dimensions along which they only scale; coordinates keep their exact values."""
    scales = {dim: _scale(described, dim, indices) for dim, indices in kept.items()}
    return [reduced(name, values, scales, name in described.coordinates) for name, values in columns.items()]


def _scale(described: MapDescription, dim: str, indices: np.ndarray) -> np.ndarray | None:
    """Return magnitudes of a dimension's values; None for a dimension along which no law can hold."""
    if dim not in described.real_dimensions:
        return None
    values = np.abs(described.coordinates[dim].values[indices])
    return values if np.isfinite(values).all() and (values > 1e-100).all() and (values < 1e100).all() else None


def reduced(name: str, values: np.ndarray, scales: Mapping[str, np.ndarray | None], exact: bool = False) -> PageColumn:
    """Return a column without the dimensions along which it only scales.

    Args:
        name: the variable.
        values: over the dimensions of `scales`.
        scales: dimension → |coordinate|, or None where it is no number or has a zero.
        exact: as of the column.
    """
    powers = {}
    for k, (dim, scale) in enumerate(scales.items()):
        if values.shape[k] < 2:
            continue
        for power in POWERS if scale is not None and values.dtype.kind == "f" else (0,):
            first = _without(values, k, scale, power)
            if first is not None:
                values, powers[dim] = first, power
                break
    return PageColumn(name, values, powers, exact)


@np.errstate(over="ignore", invalid="ignore")
def _without(values: np.ndarray, k: int, scale, power: int) -> np.ndarray | None:
    """Return the first slice along dimension k, in the unit of the law; None where the law does not hold."""
    factor = 1.0 if power == 0 else (scale**power).reshape([-1 if i == k else 1 for i in range(values.ndim)])
    first = np.take(values, [0], axis=k) * (factor if power == 0 else np.take(factor, [0], axis=k))
    for i in (-1, values.shape[k] // 2):  # most laws fail here already
        if not _same(np.take(values, [i], axis=k) * (1.0 if power == 0 else np.take(factor, [i], axis=k)), first):
            return None
    scaled = values * factor
    is_law = _same(scaled, first) and np.array_equal(np.isfinite(scaled), np.isfinite(values))  # and no overflow
    return first.astype(values.dtype) if is_law else None


def _same(values: np.ndarray, first: np.ndarray) -> bool:
    if values.dtype.kind != "f":
        return bool((values == first).all())
    with np.errstate(invalid="ignore"):
        near = np.abs(values - first) <= LAW_TOLERANCE * np.abs(first)
    return bool((near | (values == first) | (np.isnan(values) & np.isnan(first))).all())


@dataclass(frozen=True)
class Packed:
    """A column as text: base64 of deflated bytes, little-endian, the first bytes of all numbers before the second."""

    name: str  #: the variable
    shape: tuple[int, ...]  #: lengths over the map's dimensions
    powers: dict[str, int]  #: the scaling laws, as in `PageColumn`
    dtype: str  #: "f8", "f4", "i1", "i2" or "i4"
    exponent: int  #: numbers are to be multiplied by two to this power
    digits: int  #: significant decimal digits that are right
    text: str  #: the bytes


def pack(column: PageColumn, bits: int = 53) -> Packed:
    """Pack a column, its floats with `bits` bits of mantissa (53: unchanged)."""
    values, exponent, digits = column.values, 0, 6
    if values.dtype.kind == "f" and bits < 53:
        values, exponent = _single(np.asarray(values, "f8"), bits)
        digits = min(6, int(bits * math.log10(2)))
    elif values.dtype.kind != "f":
        values = _narrow(values)
    little = np.ascontiguousarray(values, values.dtype.newbyteorder("<")).reshape(-1)
    shuffled = little.view("u1").reshape(little.size, -1).T.tobytes()
    text = base64.b64encode(zlib.compress(shuffled, 6)).decode("ascii")
    code = f"{values.dtype.kind}{values.dtype.itemsize}"
    return Packed(column.name, column.values.shape, column.powers, code, exponent, digits, text)


def _single(values: np.ndarray, bits: int) -> tuple[np.ndarray, int]:
    """Return values as short single-precision numbers times a power of two; doubles where they span too much."""
    finite = np.abs(values[np.isfinite(values) & (values != 0.0)])
    if finite.size == 0:
        return values.astype("f4"), 0
    exponent = math.frexp(float(finite.max()))[1] - 100  # the largest near 2^100, infinite at 2^128
    scaled = np.ldexp(values, -exponent)
    if math.frexp(float(finite.min()))[1] - exponent < -120:
        return values, 0
    if bits < 24:
        mantissa, powers = np.frexp(scaled)
        scaled = np.ldexp(np.round(np.ldexp(mantissa, bits)), powers - bits)
    return scaled.astype("f4"), exponent


def _narrow(values: np.ndarray) -> np.ndarray:
    """Return whole numbers in the narrowest type that holds them: those beyond 32 bits as doubles."""
    values = values.astype("i1") if values.dtype.kind == "b" else values
    low, high = int(values.min()), int(values.max())
    for kind in ("i1", "i2", "i4"):
        if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max:
            return values.astype(kind)
    return values.astype("f8")


def pack_within(columns: list[PageColumn], budget: int) -> list[Packed] | None:
    """Pack columns with as many digits as `budget` (characters) allows; return None where they do not fit."""
    raw = sum(column.values.nbytes for column in columns)
    for bits in (53, *MANTISSA_BITS) if raw <= EXACT_BYTES else MANTISSA_BITS:
        if raw * bits / 64 / 4 > budget:  # no column deflates to a quarter of its noise
            continue
        packed, room = [], budget
        for column in columns:
            most = min(bits, MANTISSA_BITS[0]) if column.name.endswith(UNCERTAIN) else bits
            packed.append(pack(column, 53 if column.exact else most))
            room -= len(packed[-1].text)
            if room < 0:
                break
        else:
            return packed
    return None
