"""A trajectory: time, attitude and angular velocity of a body, in SI units, from the columns of a file."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from sweeps.certification import columns
from sweeps.reading import attitude_files, tables
from sweeps.reading.files import FileBytes
from sweeps.schema.refusals import DefinitionError, MapError, UnreadableError, display
from sweeps.schema.values import MAX_SPIN_RATE, MIN_SPIN_RATE

SUFFIXES = tables.SUFFIXES | {".aem": attitude_files.AttitudeMessage}
BLOCK_ROWS = 2**15  # rows at once, where many are compared
SMALLEST = 1e-6  # size of a quaternion or determinant of a matrix below which the file's digits show no rotation
RATES = "angular velocities up to 1e150 rad/s, the first of at least 1e-150"


def by_blocks(function: Callable, *arrays: np.ndarray) -> np.ndarray:
    """Return a function of rows, applied to blocks of them, so that what it needs on the way is small."""
    first = function(*(array[:BLOCK_ROWS] for array in arrays))
    if len(first) == len(arrays[0]):
        return first
    result = np.empty((len(arrays[0]), *first.shape[1:]))
    for k in range(0, len(result), BLOCK_ROWS):
        result[k : k + BLOCK_ROWS] = function(*(array[k : k + BLOCK_ROWS] for array in arrays)) if k else first
    return result


@dataclass(frozen=True)
class Trajectory:
    """Rows of a file. Resolutions are half a unit of the last digit of a column, and at least 2 ulp."""

    times: np.ndarray  #: s, from the first row, shape (n,)
    q: np.ndarray | None  #: attitude: unit quaternions, scalar first, from the body to the file's frame, (n, 4)
    rates: np.ndarray | None  #: angular velocity in the body's axes, rad/s, (n, 3)
    rates_resolution: np.ndarray  #: rad/s, (3,); NaN without rates
    attitude_resolution: float = 0.0  #: of the coarsest entry of the attitude
    attitude_offset: float = 0.0  #: rad, the largest change of the first attitude by the resolution of one entry
    length_error: float = 0.0  #: largest distance of a quaternion's length from 1, or of a matrix from orthogonality
    is_mirrored: bool = False  #: True if the attitudes are matrices of determinant −1
    place: np.ndarray | None = None  #: longitude and latitude, rad, (n, 2)
    names: dict[str, list[str]] = field(default_factory=dict)  #: role → names of columns


def _unit_quaternions(entries: np.ndarray, sequence: str) -> np.ndarray:
    """Return unit quaternions, (n, 4), of quaternions, of matrices row by row, or of Euler angles, (n, 4, 9 or 3)."""
    if entries.shape[1] == 4:
        return entries / np.linalg.norm(entries, axis=1, keepdims=True)
    if entries.shape[1] == 3:
        return Rotation.from_euler(sequence, entries).as_quat(scalar_first=True)
    matrices = entries.reshape(-1, 3, 3)
    proper = matrices * np.sign(np.linalg.det(matrices))[:, None, None]
    return Rotation.from_matrix(proper).as_quat(scalar_first=True)


def _sizes(entries: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the size of each attitude, with the sign of a determinant, and the largest `length_error`."""
    if entries.shape[1] == 4:
        size = by_blocks(lambda q: np.linalg.norm(q, axis=1), entries)
        return size, float(np.abs(size - 1.0).max())
    if entries.shape[1] == 3:
        return np.ones(1), 0.0
    matrices = entries.reshape(-1, 3, 3)
    products = np.einsum("nij,nik->njk", matrices, matrices)
    return np.linalg.det(matrices), float(np.abs(products - np.eye(3)).max() / 2)


def _attitudes(entries: np.ndarray, resolution: np.ndarray, sequence: str, is_conjugate: bool) -> dict[str, Any]:
    """Return the attributes of a `Trajectory` about its attitudes; `entries` are overwritten."""
    size, length_error = _sizes(entries)
    if not (np.abs(size) > SMALLEST).all():
        kind = "quaternion is zero" if entries.shape[1] == 4 else "matrix is singular"
        raise DefinitionError(f"row {int(np.argmin(np.abs(size) > SMALLEST)) + 1:,}: the {kind}; allowed: rotations")
    near = Rotation.from_quat(_unit_quaternions(entries[:1] + np.diag(resolution), sequence), scalar_first=True)
    first = Rotation.from_quat(_unit_quaternions(entries[:1], sequence), scalar_first=True)
    if entries.shape[1] == 4:
        q = np.divide(entries, size[:, None], out=entries)
    else:
        q = by_blocks(lambda some: _unit_quaternions(some, sequence), entries)
    if is_conjugate:
        q[:, 1:] *= -1.0
    facts = {"q": q, "length_error": length_error, "is_mirrored": bool(size[0] < 0)}
    offset = float((first.inv() * near).magnitude().max())
    return facts | {"attitude_resolution": float(resolution.max()), "attitude_offset": offset}


def read(run: Any, choice: columns.ColumnChoice) -> Trajectory:
    """Return the trajectory in a file (.csv, .parquet, .nc, .aem), a DataFrame, a Dataset, or a mapping of arrays.

    Raises:
        DefinitionError: naming what cannot be judged, and what is allowed.
    """
    try:
        if not isinstance(run, str | Path):
            return _parse(_Arrays(run), choice)
        suffix = Path(run).suffix.lower()
        if suffix not in SUFFIXES:
            raise DefinitionError(f"is of the unknown format {suffix or '(none)'}; allowed: {', '.join(SUFFIXES)}")
        with FileBytes(run) as file:
            return _parse(tables.open_source(file, suffix, True, SUFFIXES), choice)
    except UnreadableError as refused:
        problem = str(refused.problem)
    except (MapError, DefinitionError) as refused:
        problem = str(refused).removeprefix(f"{run}: ")
    except OSError as error:
        problem = f"cannot be read ({error.strerror}); allowed: a regular file"
    raise DefinitionError(f"{run if isinstance(run, str | Path) else 'run'}: {problem}")


class _Arrays(tables.Source):
    """Columns in memory."""

    def __init__(self, table: Any):
        if hasattr(table, "data_vars"):
            table = {name: table[name] for name in table.variables if table[name].dims == ("time",)}
        arrays = {str(name): np.ma.filled(table[name], np.nan) for name in table}
        units = [getattr(table[name], "attrs", {}).get("units", "") for name in table]
        headings = map(tables.heading, arrays)
        self.headings = [(name, own_unit or unit) for (name, unit), own_unit in zip(headings, units, strict=True)]
        kinds = [array.dtype.kind if array.ndim == 1 else "" for array in arrays.values()]
        self.texts = {k for k, kind in enumerate(kinds) if kind not in tuple("iuf")}
        self.single = {k for k, array in enumerate(arrays.values()) if array.dtype == np.float32}
        self._arrays = list(arrays.values())

    def row_blocks(self, places: Sequence[int]):
        """Return all rows; see `sweeps.reading.tables.Source`."""
        if len({len(self._arrays[k]) for k in places}) > 1:
            raise DefinitionError("columns: are of different lengths; allowed: arrays of one length")
        yield np.column_stack([self._arrays[k].astype("f8") for k in places])


def _parse(source: tables.Source, choice: columns.ColumnChoice) -> Trajectory:
    """Return the trajectory in the columns of a source, checked."""
    columns_found = columns.find(source.headings, choice, source.texts)
    column_numbers = [k for places in columns_found.places.values() for k in places]
    blocks = list(source.row_blocks(column_numbers))[::-1]
    table, end = np.empty((sum(map(len, blocks)), len(column_numbers))), 0
    while blocks:  # each is freed when it is copied
        block = blocks.pop()
        table[end : (end := end + len(block))] = block
    names = [source.headings[k][0] for k in column_numbers]
    _check(table, names, column_numbers.index(columns_found.places["time"][0]))
    table *= columns_found.factors(column_numbers)
    factors = np.abs(columns_found.factors(column_numbers))
    digits = columns.units_of_last_digits(source.sample_rows(), column_numbers) * factors / 2
    epsilon = np.array([np.finfo(np.float32 if k in source.single else np.float64).eps for k in column_numbers])

    def select(role: str) -> np.ndarray | None:
        places = columns_found.places.get(role)
        first = column_numbers.index(places[0]) if places else 0
        return table[:, first : first + len(places)] if places else None

    def resolution(role: str, size: float) -> np.ndarray:
        places = [column_numbers.index(k) for k in columns_found.places.get(role, ())]
        ulp = np.exp2(np.floor(np.log2(size))) * epsilon[places]
        return np.fmax(digits[places], 2 * ulp)

    times, rates, place = select("time")[:, 0], select("rates"), select("longitude")
    if rates is not None and not (np.abs(rates[0]).max() >= MIN_SPIN_RATE and np.abs(rates).max() <= MAX_SPIN_RATE):
        raise DefinitionError(f"row 1: |omega| is {np.abs(rates[0]).max():g} rad/s; allowed: {RATES}")
    speed = 1.0 if rates is None else float(np.linalg.norm(rates[0]))
    attitude: dict[str, Any] = {"q": None}
    if (entries := select("attitude")) is not None:
        is_conjugate = (choice.direction == "space-to-body") != getattr(source, "space_to_body", False)
        attitude = _attitudes(entries, resolution("attitude", 1.0), columns_found.sequence, is_conjugate)
    return Trajectory(
        times=times - times[0],
        rates=rates,
        rates_resolution=resolution("rates", speed) if rates is not None else np.full(3, np.nan),
        place=None if place is None else np.column_stack([place, select("latitude")]),
        names={role: [source.headings[k][0] for k in places] for role, places in columns_found.places.items()},
        **attitude,
    )


def _check(table: np.ndarray, names: Sequence[str], time: int) -> None:
    """Refuse rows that cannot be judged; no row is sorted or left out."""
    if len(table) < 2:
        raise DefinitionError(f"has {len(table)} rows; allowed: two rows at least")
    is_finite = np.isfinite(table)
    if not is_finite.all():
        row, column = map(int, np.argwhere(~is_finite)[0])
        value = f"row {row + 1:,} of {display(names[column])} is missing or not finite"
        raise DefinitionError(f"{value}; allowed: a finite number in every row")
    steps = np.diff(table[:, time])
    if not (steps > 0).all():
        row = int(np.argmin(steps > 0)) + 1
        problem = "repeats" if steps[row - 1] == 0 else "goes back"
        raise DefinitionError(f"row {row + 1:,}: the time {problem}; allowed: times that increase")
