"""Columns of a map for one page: points are thinned, scaling laws detected and used, and numbers packed as text."""

import base64
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from sweeps.maps.description import MapDescription
from sweeps.maps.summary import Summary, read_box
from sweeps.schema.iteration import blocks

if TYPE_CHECKING:
    import xarray as xr

BLOCK_POINTS = 2**17  # points that are read at a time, about 25 MB of columns
MAX_POINTS = 400_000  # points in memory; a page never has space for more
POWERS = (0, 1, -1, 2, -2)  # exponents of a parameter that are tried as scaling laws
LAW_TOLERANCE = 1e-11  # relative deviation from a scaling law, far below the digits that a page shows
MAX_EXACT_BYTES = 1_500_000  # maps with fewer bytes keep their doubles unchanged
MANTISSA_BITS = (24, 15)  # lengths of shortened mantissas: seven decimal digits, or four and a half
ERROR_SUFFIXES = ("_error", "_stderr")  # names with these endings are errors, which need at most seven digits
SLIDER_WEIGHT = 4  # a dimension outside the plane is thinned as if it were so many times longer
MIN_LENGTH = 8  # numeric dimensions keep at least so many values, enough for a legible picture

Columns = dict[str, np.ndarray]  # name → values on the page's grid, of length 1 along a dimension that it lacks
Grid = dict[str, np.ndarray]  # dimension → indices of the map's values that the page has


@dataclass
class PageColumn:
    """One variable over the page's points, reduced along every dimension that has a scaling law."""

    name: str  #: the variable
    #: over the map's dimensions; of length one if the variable lacks the dimension, or there is a law.
    values: np.ndarray
    #: dimension → k, the law: the variable times |coordinate|^k does not depend on that dimension.
    powers: dict[str, int] = field(default_factory=dict)
    exact: bool = False  #: True if the numbers are not shortened, because the page computes with them


def read_columns(ds: "xr.Dataset", description: MapDescription) -> tuple[Summary, Columns, Grid]:
    """Read a map once. Return (summary, columns, grid) with the finest grid that a page can have."""
    page_grid = thin_dimensions(description.sizes, description.real_dimensions, MAX_POINTS)
    columns = {}
    for name, column in description.columns.items():
        shape = [len(indices) if dim in column.dims else 1 for dim, indices in page_grid.items()]
        columns[name] = np.empty(shape, ds[name].dtype)
    summary = Summary(description)
    for box in blocks(description.sizes, BLOCK_POINTS):
        values = {name: read_box(ds, name, box) for name in columns}
        summary.add(box, {name: column for name, column in values.items() if name in description.variables})
        for name, cells in columns.items():
            _fill_column(cells, values[name], box, page_grid)
    return summary, columns, page_grid


def _fill_column(column: np.ndarray, values: np.ndarray, box: Mapping[str, slice], page_grid: Grid) -> None:
    """Write the values of a box (of `read_box`) into a column, at the points of the page's grid."""
    target = []
    for k, (dim, indices) in enumerate(page_grid.items()):
        inside, place = indices_in_box(box[dim], indices)
        is_constant = values.shape[k] == 1 and column.shape[k] == 1
        values = values if is_constant else np.take(values, inside, axis=k)
        target.append(slice(None) if is_constant else place)
    column[tuple(target)] = values


def thin_dimensions(sizes: Mapping[str, int], numeric: set[str], max_points: int) -> Grid:
    """Return dimension → evenly spaced indices, first and last included, with at most `max_points` points.

    The longest numeric dimensions lose values first, down to `MIN_LENGTH`; then all dimensions do. The two longest
    numeric dimensions span the page's plane and keep more values than dimensions that become sliders.

    Args:
        sizes: dimension → length.
        numeric: dimensions with real numbers as values.
        max_points: number of points of the thinned grid.
    """
    counts = dict(sizes)
    plane = sorted((d for d in sizes if d in numeric), key=lambda dim: -sizes[dim])[:2]
    while math.prod(counts.values()) > max_points:
        candidates = [d for d in counts if d in numeric and counts[d] > MIN_LENGTH]
        candidates = candidates or [d for d in counts if counts[d] > 1]
        longest = max(candidates, key=lambda d: counts[d] * (1 if d in plane else SLIDER_WEIGHT))
        min_length = MIN_LENGTH if longest in numeric and counts[longest] > MIN_LENGTH else 1
        counts[longest] = max(min_length, min(counts[longest] - 1, int(counts[longest] * 0.97)))
    return {d: np.unique(np.linspace(0, sizes[d] - 1, n).round().astype(int)) for d, n in counts.items()}


def indices_in_box(box: slice, indices: np.ndarray) -> tuple[np.ndarray, slice]:
    """Return (indices relative to the box's start, their slice in `indices`) of the indices that are in a box."""
    low, high = np.searchsorted(indices, [box.start, box.stop])
    return indices[low:high] - box.start, slice(low, high)


def thin_columns(description: MapDescription, columns: Columns, page_grid: Grid, points: int) -> tuple[Columns, Grid]:
    """Return (columns, grid) on a coarser grid.

    Args:
        description: of the map.
        columns: name → values on `page_grid`.
        page_grid: dimension → indices of the map's values.
        points: maximum number of points of the coarser grid.
    """
    lengths = {dim: len(indices) for dim, indices in page_grid.items()}
    coarser, columns = thin_dimensions(lengths, description.real_dimensions, points), dict(columns)
    for name, values in columns.items():
        for k, indices in enumerate(coarser.values()):
            if values.shape[k] > 1:
                values = np.take(values, indices, axis=k)
        columns[name] = values
    return columns, {dim: page_grid[dim][indices] for dim, indices in coarser.items()}


def scaling_laws(description: MapDescription, columns: Columns, page_grid: Grid) -> list[PageColumn]:
    """Return columns without the dimensions along which they follow a power law; coordinates stay exact.

    Args:
        description: of the map.
        columns: name → values on `page_grid`.
        page_grid: dimension → indices of the map's values.
    """
    scales = {dim: _magnitudes(description, dim, indices) for dim, indices in page_grid.items()}
    return [reduce_column(name, values, scales, name in description.coordinates) for name, values in columns.items()]


def _magnitudes(description: MapDescription, dim: str, indices: np.ndarray) -> np.ndarray | None:
    """Return magnitudes of a dimension's values; None for a dimension that cannot have a scaling law."""
    if dim not in description.real_dimensions:
        return None
    values = np.abs(description.coordinates[dim].values[indices])
    return values if np.isfinite(values).all() and (values > 1e-100).all() and (values < 1e100).all() else None


def reduce_column(
    name: str, values: np.ndarray, scales: Mapping[str, np.ndarray | None], exact: bool = False
) -> PageColumn:
    """Return a column without the dimensions along which it follows a power law.

    Args:
        name: of the variable.
        values: over the dimensions of `scales`.
        scales: dimension → |coordinate|, or None if that is not a number or has a zero.
        exact: as of `PageColumn`.
    """
    powers = {}
    for k, (dim, scale) in enumerate(scales.items()):
        if values.shape[k] < 2:
            continue
        for power in POWERS if scale is not None and values.dtype.kind == "f" else (0,):
            first = _reduce_along(values, k, scale, power)
            if first is not None:
                values, powers[dim] = first, power
                break
    return PageColumn(name, values, powers, exact)


@np.errstate(over="ignore", invalid="ignore")
def _reduce_along(values: np.ndarray, k: int, scale, power: int) -> np.ndarray | None:
    """Return the first slice along dimension k, multiplied by |coordinate|^power; None if that product varies."""
    factor = 1.0 if power == 0 else (scale**power).reshape([-1 if i == k else 1 for i in range(values.ndim)])
    first = np.take(values, [0], axis=k) * (factor if power == 0 else np.take(factor, [0], axis=k))
    for i in (-1, values.shape[k] // 2):  # two cheap comparisons refute most laws
        if not _is_constant(
            np.take(values, [i], axis=k) * (1.0 if power == 0 else np.take(factor, [i], axis=k)), first
        ):
            return None
    products = values * factor
    overflows = not np.array_equal(np.isfinite(products), np.isfinite(values))
    is_law = _is_constant(products, first) and not overflows
    return first.astype(values.dtype) if is_law else None


def _is_constant(values: np.ndarray, first: np.ndarray) -> bool:
    """Return True if all values equal `first` within LAW_TOLERANCE; NaN equals NaN."""
    if values.dtype.kind != "f":
        return bool((values == first).all())
    with np.errstate(invalid="ignore"):
        is_near = np.abs(values - first) <= LAW_TOLERANCE * np.abs(first)
    return bool((is_near | (values == first) | (np.isnan(values) & np.isnan(first))).all())


@dataclass(frozen=True)
class Packed:
    """A column as text: base64 of deflated little-endian bytes, the first bytes of all numbers before the second."""

    name: str  #: the variable
    shape: tuple[int, ...]  #: lengths over the map's dimensions
    powers: dict[str, int]  #: the scaling laws, as in `PageColumn`
    dtype: str  #: "f8", "f4", "i1", "i2" or "i4"
    exponent: int  #: numbers must be multiplied by 2^exponent
    digits: int  #: number of correct significant decimal digits
    text: str  #: the bytes


def pack_column(column: PageColumn, bits: int = 53) -> Packed:
    """Pack a column as base64 of zlib of shuffled little-endian bytes; floats keep `bits` bits of mantissa."""
    values, exponent, digits = column.values, 0, 6
    if values.dtype.kind == "f" and bits < 53:
        values, exponent = _to_single(np.asarray(values, "f8"), bits)
        digits = min(6, int(bits * math.log10(2)))
    elif values.dtype.kind != "f":
        values = _to_narrow_integers(values)
    little = np.ascontiguousarray(values, values.dtype.newbyteorder("<")).reshape(-1)
    shuffled = little.view("u1").reshape(little.size, -1).T.tobytes()
    text = base64.b64encode(zlib.compress(shuffled, 6)).decode("ascii")
    code = f"{values.dtype.kind}{values.dtype.itemsize}"
    return Packed(column.name, column.values.shape, column.powers, code, exponent, digits, text)


def _to_single(values: np.ndarray, bits: int) -> tuple[np.ndarray, int]:
    """Return (single-precision numbers, exponent of their factor 2); (doubles, 0) if the range is too large."""
    finite = np.abs(values[np.isfinite(values) & (values != 0.0)])
    if finite.size == 0:
        return values.astype("f4"), 0
    exponent = math.frexp(float(finite.max()))[1] - 100  # the largest near 2^100, infinite at 2^128
    small_values = np.ldexp(values, -exponent)
    if math.frexp(float(finite.min()))[1] - exponent < -120:
        return values, 0
    if bits < 24:
        mantissa, exponents = np.frexp(small_values)
        small_values = np.ldexp(np.round(np.ldexp(mantissa, bits)), exponents - bits)
    return small_values.astype("f4"), exponent


def _to_narrow_integers(values: np.ndarray) -> np.ndarray:
    """Return integers in the smallest type that can represent them; integers of more than 32 bits as doubles."""
    values = values.astype("i1") if values.dtype.kind == "b" else values
    low, high = int(values.min()), int(values.max())
    for kind in ("i1", "i2", "i4"):
        if np.iinfo(kind).min <= low and high <= np.iinfo(kind).max:
            return values.astype(kind)
    return values.astype("f8")


def pack_within(columns: list[PageColumn], budget: int) -> list[Packed] | None:
    """Pack columns with as many digits as `budget` (characters) allows; return None if they do not fit."""
    raw = sum(column.values.nbytes for column in columns)
    for bits in (53, *MANTISSA_BITS) if raw <= MAX_EXACT_BYTES else MANTISSA_BITS:
        if raw * bits / 64 / 4 > budget:  # no column deflates to a quarter of its noise
            continue
        packed_columns, chars_left = [], budget
        for column in columns:
            column_bits = min(bits, MANTISSA_BITS[0]) if column.name.endswith(ERROR_SUFFIXES) else bits
            packed_columns.append(pack_column(column, 53 if column.exact else column_bits))
            chars_left -= len(packed_columns[-1].text)
            if chars_left < 0:
                break
        else:
            return packed_columns
    return None
