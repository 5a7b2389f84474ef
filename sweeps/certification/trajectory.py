"""A trajectory: time, attitude and angular velocity of a body, in SI units, from the columns of a file."""

from collections.abc import Sequence
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
SMALLEST = 1e-6  # size of a quaternion or determinant of a matrix below which the file's digits show no rotation
RATES = "angular velocities up to 1e150 rad/s, the first of at least 1e-150"


@dataclass(frozen=True)
class Trajectory:
    """Rows of a file. Resolutions are half a unit of the last digit of a column, and at least 2 ulp."""

    times: np.ndarray  #: s, from the first row, shape (n,)
    rates: np.ndarray | None  #: angular velocity in the body's axes, rad/s, (n, 3)
    rates_resolution: np.ndarray | None  #: rad/s, (3,)
    q: Rotation | None = None  #: attitudes, from the body to the file's frame
    attitude_resolution: float = 0.0  #: of the coarsest entry of the attitude
    attitude_offset: float = 0.0  #: rad, the largest change of the first attitude by the resolution of one entry
    length_error: float = 0.0  #: largest distance of a quaternion's length from 1, or of a matrix from orthogonality
    is_mirrored: bool = False  #: True if the attitudes are matrices of determinant −1
    place: np.ndarray | None = None  #: longitude and latitude, rad, (n, 2)
    names: dict[str, list[str]] = field(default_factory=dict)  #: role → names of columns


def _rotations(entries: np.ndarray, sequence: str) -> tuple[Rotation, float, bool]:
    """Return the attitudes in quaternions, matrices row by row, or Euler angles, `length_error` and `is_mirrored`."""
    if entries.shape[1] == 3:
        return Rotation.from_euler(sequence, entries), 0.0, False
    matrices = entries.reshape(-1, 3, 3) if entries.shape[1] == 9 else None
    sizes = np.linalg.norm(entries, axis=1) if matrices is None else np.linalg.det(matrices)
    is_zero = ~(np.abs(sizes) > SMALLEST)
    if is_zero.any():
        kind = "quaternion is zero" if matrices is None else "matrix is singular"
        raise DefinitionError(f"row {int(np.argmax(is_zero)) + 1:,}: the {kind}; allowed: rotations")
    if matrices is None:
        return Rotation.from_quat(entries, scalar_first=True), float(np.abs(sizes - 1.0).max()), False
    length_error = float(np.abs(matrices.transpose(0, 2, 1) @ matrices - np.eye(3)).max() / 2)
    return Rotation.from_matrix(matrices * np.sign(sizes)[:, None, None]), length_error, bool(sizes[0] < 0)


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
        self._arrays = [np.ma.filled(table[name], np.nan) for name in table]
        units = [getattr(table[name], "attrs", {}).get("units", "") for name in table]
        headings = [tables.heading(str(name)) for name in table]
        self.headings = [(name, own_unit or unit) for (name, unit), own_unit in zip(headings, units, strict=True)]
        is_number = [array.ndim == 1 and array.dtype.kind in "iuf" for array in self._arrays]
        self.texts = set(np.flatnonzero(~np.array(is_number, dtype=bool)))
        self.single = {k for k, array in enumerate(self._arrays) if array.dtype == np.float32}

    def row_blocks(self, places: Sequence[int]):
        """Return all rows; see `sweeps.reading.tables.Source`."""
        if len({len(self._arrays[k]) for k in places}) > 1:
            raise DefinitionError("columns: are of different lengths; allowed: arrays of one length")
        yield np.column_stack([self._arrays[k].astype("f8") for k in places])


def _parse(source: tables.Source, choice: columns.ColumnChoice) -> Trajectory:
    """Return the trajectory in the columns of a source, checked."""
    places, factors, sequence = columns.find(source.headings, choice, source.texts)
    numbers = [k for role in places for k in places[role]]
    ends = np.cumsum([len(places[role]) for role in places])

    def by_role(values: np.ndarray) -> dict[str, np.ndarray]:
        return dict(zip(places, np.split(values, ends[:-1], axis=-1), strict=True))

    table = np.concatenate(list(source.row_blocks(numbers)))
    values = by_role(table)
    _check(table, values["time"][:, 0], [source.headings[k][0] for k in numbers])
    table *= factors
    digits = columns.units_of_last_digits(source.sample_rows(), numbers) * np.abs(factors) / 2
    epsilon = np.array([np.finfo(np.float32 if k in source.single else np.float64).eps for k in numbers])

    def resolution(role: str, size: float) -> np.ndarray:
        ulp = np.exp2(np.floor(np.log2(size))) * by_role(epsilon)[role]
        return np.fmax(by_role(digits)[role], 2 * ulp)

    rates, attitude = values.get("rates"), {}
    if rates is not None and not (np.abs(rates[0]).max() >= MIN_SPIN_RATE and np.abs(rates).max() <= MAX_SPIN_RATE):
        raise DefinitionError(f"row 1: |omega| is {np.abs(rates[0]).max():g} rad/s; allowed: {RATES}")
    if (entries := values.get("attitude")) is not None:
        steps = resolution("attitude", 1.0)
        q, length_error, is_mirrored = _rotations(entries, sequence)
        near, *_ = _rotations(entries[:1] + np.diag(steps), sequence)
        is_conjugate = (choice.direction == "space-to-body") != getattr(source, "space_to_body", False)
        attitude = {
            "q": q.inv() if is_conjugate else q, "attitude_resolution": float(steps.max()),
            "attitude_offset": float((q[0].inv() * near).magnitude().max()),
            "length_error": length_error, "is_mirrored": is_mirrored,
        }  # fmt: skip
    return Trajectory(
        times=values["time"][:, 0] - values["time"][0],
        rates=None if rates is None else rates.copy(),  # not a part of the table, so that its memory is free
        rates_resolution=None if rates is None else resolution("rates", float(np.linalg.norm(rates[0]))),
        place=np.hstack([values["longitude"], values["latitude"]]) if "longitude" in values else None,
        names={role: [source.headings[k][0] for k in places[role]] for role in places},
        **attitude,
    )


def _check(table: np.ndarray, times: np.ndarray, names: Sequence[str]) -> None:
    """Refuse rows that cannot be judged; no row is sorted or left out."""
    if len(table) < 2:
        raise DefinitionError(f"has {len(table)} rows; allowed: two rows at least")
    is_finite = np.isfinite(table)
    if not is_finite.all():
        row, column = map(int, np.argwhere(~is_finite)[0])
        value = f"row {row + 1:,} of {display(names[column])} is missing or not finite"
        raise DefinitionError(f"{value}; allowed: a finite number in every row")
    steps = np.diff(times)
    if not (steps > 0).all():
        row = int(np.argmin(steps > 0)) + 1
        problem = "repeats" if steps[row - 1] == 0 else "goes back"
        raise DefinitionError(f"row {row + 1:,}: the time {problem}; allowed: times that increase")
