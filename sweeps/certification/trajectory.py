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
    starts = range(0, len(arrays[0]), BLOCK_ROWS)
    return np.concatenate([function(*(array[k : k + BLOCK_ROWS] for array in arrays)) for k in starts])


@dataclass(frozen=True)
class Trajectory:
    """Rows of a file. Resolutions are half a unit of the last digit of a column, and at least 2 ulp."""

    times: np.ndarray  #: s, from the first row, shape (n,)
    attitude: np.ndarray | None  #: quaternions (scalar first), matrices row by row, or Euler angles; (n, 4, 9 or 3)
    rates: np.ndarray | None  #: angular velocity in the body's axes, rad/s, (n, 3)
    attitude_resolution: np.ndarray  #: of each entry of `attitude`
    rates_resolution: np.ndarray  #: rad/s, (3,); NaN without rates
    place: np.ndarray | None = None  #: longitude and latitude, rad, (n, 2)
    sequence: str = ""  #: of Euler angles
    is_conjugate: bool = False  #: True if the attitude takes vectors from space to the body
    names: dict[str, list[str]] = field(default_factory=dict)  #: role → names of columns

    def check_attitude(self) -> None:
        """Refuse attitudes that are no rotations."""
        size = np.ones(1)
        if self.attitude is not None and self.attitude.shape[1] == 4:
            size = np.abs(self.attitude).max(axis=1)
        elif self.attitude is not None and self.attitude.shape[1] == 9:
            size = np.abs(np.linalg.det(self.attitude.reshape(-1, 3, 3)))
        if not (size > SMALLEST).all():
            kind = "quaternion is zero" if self.attitude.shape[1] == 4 else "matrix is singular"
            raise DefinitionError(f"row {int(np.argmin(size > SMALLEST)) + 1:,}: the {kind}; allowed: rotations")

    def quaternions(self, rows: Any = slice(None), step: np.ndarray | float = 0.0) -> np.ndarray:
        """Return unit quaternions, body to space, (n, 4), of some rows with `step` added to their entries."""
        return by_blocks(self._to_quaternions, self.attitude[rows] + step if np.any(step) else self.attitude[rows])

    def _to_quaternions(self, entries: np.ndarray) -> np.ndarray:
        if entries.shape[1] == 4:
            q = entries / np.sqrt(np.einsum("ij,ij->i", entries, entries))[:, None]
        elif entries.shape[1] == 9:
            matrices = entries.reshape(-1, 3, 3)
            matrices = matrices * np.sign(np.linalg.det(matrices))[:, None, None]
            q = Rotation.from_matrix(matrices).as_quat(scalar_first=True)
        else:
            q = Rotation.from_euler(self.sequence, entries).as_quat(scalar_first=True)
        return q * [1, -1, -1, -1] if self.is_conjugate else q

    @property
    def is_mirrored(self) -> bool:
        """True if the attitudes are matrices of determinant −1."""
        is_matrix = self.attitude is not None and self.attitude.shape[1] == 9
        return is_matrix and bool(np.linalg.det(self.attitude[0].reshape(3, 3)) < 0)

    def length_error(self) -> float:
        """Return the largest distance of a quaternion's length from 1, or of a matrix from orthogonality."""
        if self.attitude is None or self.attitude.shape[1] == 3:
            return 0.0
        if self.attitude.shape[1] == 4:
            return float(np.abs(np.sqrt(np.einsum("ij,ij->i", self.attitude, self.attitude)) - 1.0).max())
        matrices = self.attitude.reshape(-1, 3, 3)
        return float(np.abs(np.einsum("nij,nik->njk", matrices, matrices) - np.eye(3)).max() / 2)


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
        self.headings = [(name, given or unit) for (name, unit), given in zip(headings, units, strict=True)]
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
    found = columns.find(source.headings, choice, source.texts)
    used = [k for places in found.places.values() for k in places]
    rows = list(source.row_blocks(used))
    table = np.concatenate(rows) if rows else np.empty((0, len(used)))
    del rows
    names = [source.headings[k][0] for k in used]
    _check(table, names, used.index(found.places["time"][0]))
    table *= found.factors(used)
    digits = columns.units_of_last_digits(source.sample_rows(), used) * np.abs(found.factors(used)) / 2
    epsilon = np.array([np.finfo(np.float32 if k in source.single else np.float64).eps for k in used])

    def select(role: str) -> np.ndarray | None:
        places = found.places.get(role)
        first = used.index(places[0]) if places else 0
        return table[:, first : first + len(places)] if places else None

    def resolution(role: str, size: float) -> np.ndarray:
        places = [used.index(k) for k in found.places.get(role, ())]
        ulp = np.exp2(np.floor(np.log2(size))) * epsilon[places]
        return np.fmax(digits[places], 2 * ulp)

    times, rates, place = select("time")[:, 0], select("rates"), select("longitude")
    if rates is not None and not (np.abs(rates[0]).max() >= MIN_SPIN_RATE and np.abs(rates).max() <= MAX_SPIN_RATE):
        raise DefinitionError(f"row 1: |omega| is {np.abs(rates[0]).max():g} rad/s; allowed: {RATES}")
    speed = 1.0 if rates is None else float(np.linalg.norm(rates[0]))
    trajectory = Trajectory(
        times=times - times[0],
        attitude=select("attitude"),
        rates=rates,
        attitude_resolution=resolution("attitude", 1.0),
        rates_resolution=resolution("rates", speed) if rates is not None else np.full(3, np.nan),
        place=None if place is None else np.column_stack([place, select("latitude")]),
        sequence=found.sequence,
        is_conjugate=(choice.direction == "space-to-body") != getattr(source, "space_to_body", False),
        names={role: [source.headings[k][0] for k in places] for role, places in found.places.items()},
    )
    trajectory.check_attitude()
    return trajectory


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
        wrong = "repeats" if steps[row - 1] == 0 else "goes back"
        raise DefinitionError(f"row {row + 1:,}: the time {wrong}; allowed: times that increase")
