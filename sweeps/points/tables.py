"""Tables of points in CSV, Parquet or netCDF: their rows are checked, and can be read in any part.

A table is read once, a part at a time, and every value is compared with the bounds of its parameter. The rows are
stored in the cache of the compiled kernels, in HDF5 with checksums, as doubles in the parameters' own units, under a
name made of the file's SHA-256 and the requested columns; so each shard reads its own rows only.
"""

import hashlib
import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from kernels.compile.cache import cache_folder
from sweeps.process import machine
from sweeps.process.files import remove_all_leftovers, replace_output
from sweeps.reading import tables
from sweeps.reading.files import FileBytes
from sweeps.reading.tables import refusal
from sweeps.schema import units
from sweeps.schema.parameters import GridOf, Parameter
from sweeps.schema.refusals import MapError, display, hint
from sweeps.schema.variables import allowed_values, extremes

BLOCK_ROWS = 2**14  # rows of the cache that share a checksum
ROWS, NAMES = "rows", "names"  # datasets of the cache: the numbers, and the texts of the column `name`
DAMAGES = (OSError, RuntimeError, KeyError)  # errors that h5py raises for a damaged file
KINDS = "a CSV (.csv), Parquet (.parquet) or netCDF (.nc) file, its path relative to the definition's"
FORMAT = "3"
MAX_CACHE_AGE = 30 * 86_400.0  # s, age at which an unused table is removed from the cache


@dataclass(frozen=True)
class ColumnOf:
    """One column of a table."""

    place: int  #: its number in the file, from 0
    parameter: Parameter  #: the parameter that it contains
    factor: float  #: factor from the unit of the file to that of the parameter


@dataclass(frozen=True)
class Table:
    """The rows of a table, checked; see `sweeps.points.scattered`."""

    file: str  #: the table's path, as the definition names it
    digest: str  #: SHA-256 of its content
    names: tuple[str, ...]  #: its columns, as parameters
    cache_file: Path  #: the file of its rows
    num: int  #: how many rows there are
    ends: tuple[tuple[float, float], ...]  #: least and greatest value of each column
    text_columns: tuple[str, ...] = ()  #: names of columns of text, which are no parameters
    point_names: tuple[str, ...] = ()  #: texts of the column `name`, one for each row; () without that column

    @property
    def input(self) -> str:
        """The file as the definition names it, with its SHA-256."""
        return f"{self.file} {self.digest}"

    def rows(self, start: int, stop: int) -> Mapping[str, np.ndarray]:
        """Return name → values at the rows start … stop − 1 (from 0), shape (stop − start,)."""
        try:
            with h5py.File(self.cache_file, locking=False) as file:
                values = file[ROWS][start:stop]
        except DAMAGES:
            self.cache_file.unlink(missing_ok=True)
            reason = "was damaged and is removed: the same command reads the table again"
            raise OSError(0, reason, str(self.cache_file)) from None
        # views of the rows: most callers need one column
        return {name: values[:, k] for k, name in enumerate(self.names)}


def cache_dir() -> Path:
    """Return the folder of the rows of tables that were read."""
    return cache_folder() / "tables"


def store_text(text: bytes) -> Path:
    """Write a table into the folder of cached tables, under a name made of its content, and return the file."""
    path = cache_dir() / f"points-{hashlib.sha256(text).hexdigest()[:16]}.csv"
    if not path.exists():
        with replace_output(path) as temporary:
            temporary.write_bytes(text)
    path.touch()
    return path


def read_table(file: str, folder: str, model: type[GridOf], grid: Mapping[str, Any]) -> Table:
    """Return a table, checked.

    Args:
        file: its path relative to `folder`, the definition's.
        folder: the definition's folder.
        model: the model of the definition's grid, which has the parameters.
        grid: the values of the definition's grid.

    Raises:
        UnreadableError: for a file that cannot be read, a column that is unknown or in unknown units, and the first
            row that is no point, by its number.
    """
    path = Path(folder) / file
    if path.suffix.lower() not in tables.SUFFIXES:
        raise refusal("", display(file), "is no table by its name", KINDS)
    remove_all_leftovers(cache_dir())
    try:
        with FileBytes(path) as open_file:
            return _read_open_file(file, open_file, model, grid)
    except MapError as error:
        raise refusal("", display(file), f"cannot be read ({error})", "a table that stays as it is") from None
    except OSError as error:
        is_missing = isinstance(error, FileNotFoundError) or not error.errno
        problem = "is not there, or is no file" if is_missing else f"cannot be read ({error.strerror})"
        raise refusal("", display(file), problem, KINDS) from None


def _read_open_file(file: str, open_file: FileBytes, model: type[GridOf], grid: Mapping[str, Any]) -> Table:
    """Read the table in an open file; see `read`. One state of the file gives digest, columns and rows."""
    path, digest = Path(open_file.path), hashlib.file_digest(open_file, "sha256").hexdigest()
    source = tables.open_source(open_file, path.suffix.lower())
    columns, text_columns = _match_columns(source, model.parameters, grid)
    place = next((k for k in sorted(source.texts) if source.headings[k][0].lower() == "name"), None)
    layout = [(c.place, c.parameter.name, c.factor, c.parameter.quantity.bounds) for c in columns]
    cache_key = json.dumps([layout, place, FORMAT, digest, path.suffix])  # everything that determines the rows
    cache_file = cache_dir() / hashlib.sha256(cache_key.encode()).hexdigest()[:40]
    if _read_header(cache_file) is None:
        _forget_others(cache_file)
        _write_rows(cache_file, source, columns, place)
    num, ends, point_names = _read_header(cache_file)
    text_columns = tuple(name for name in text_columns if name.lower() != "name" or not point_names)
    cache_file.touch()
    names = tuple(c.parameter.name for c in columns)
    return Table(file, digest, names, cache_file, num, tuple(map(tuple, ends.tolist())), text_columns, point_names)


def _match_columns(
    source: tables.Source, parameters: Sequence[Parameter], grid: Mapping
) -> tuple[list[ColumnOf], tuple[str, ...]]:
    """Return the columns that are parameters, in the order of these, and the names of columns of text."""
    by_name = {p.name: p for p in parameters}
    column_list = ", ".join(p.name + ("" if p.quantity.units == "1" else f" ({p.quantity.units})") for p in parameters)
    columns: dict[str, ColumnOf] = {}
    text_columns = [
        name for place, (name, _) in enumerate(source.headings) if place in source.texts and name not in by_name
    ]
    for place, (name, unit) in enumerate(source.headings):
        if name in text_columns:
            continue
        value = display(name)
        if name not in by_name:
            raise refusal("", value, "is no column that is known" + hint(name, by_name), f"the columns {column_list}")
        if name in columns:
            raise refusal("", value, "is the name of two columns", "each column once")
        if name in grid:
            raise refusal(name, value, "is a column of the table and given in grid too", "one of these")
        factor = units.factor(unit, stored_unit := by_name[name].quantity.units)
        if factor is None:
            raise refusal(name, display(unit), "is a unit that is not known", units.unit_list(stored_unit))
        columns[name] = ColumnOf(place, by_name[name], factor)
    if not columns:
        raise refusal("", display(source.name), "has no column of a parameter", f"the columns {column_list}")
    return [columns[name] for name in by_name if name in columns], tuple(text_columns)


# -- rows that are checked


def _write_rows(cache_file: Path, source: tables.Source, columns: Sequence[ColumnOf], place: int | None) -> None:
    """Read, check and store all rows, and the names in the column at `place`; store nothing if a row is refused."""
    machine.keep_freed_memory()
    names, ends = [column.parameter.name for column in columns], []
    with replace_output(cache_file, flush=False) as temporary, h5py.File(temporary, "w", libver="latest") as file:
        shape = {"shape": (0, len(names)), "maxshape": (None, len(names)), "chunks": (BLOCK_ROWS, len(names))}
        rows = file.create_dataset(ROWS, dtype="<f8", fletcher32=True, **shape)
        for values in filter(len, source.row_blocks([column.place for column in columns])):
            num, by_column = len(rows), np.ascontiguousarray(values.T) * [[column.factor] for column in columns]
            for column, column_values in zip(columns, by_column, strict=True):
                _check_column(column, column_values, num)
            rows.resize(num + len(values), axis=0)
            rows[num:] = by_column.T
            ends.append([by_column.min(axis=1), by_column.max(axis=1)])
        if not ends:
            raise refusal("", display(source.name), "has no rows", "a row for each point, below the names")
        texts = None if place is None or len(rows) > tables.MAX_NAMES else source.names(place)
        if texts and any(texts) and len(texts) == len(rows):
            file.create_dataset(NAMES, data=texts, dtype=h5py.string_dtype())
        rows.attrs["ends"] = np.stack([np.min(ends, axis=0)[0], np.max(ends, axis=0)[1]], axis=1)


def _read_header(cache_file: Path) -> tuple[int, np.ndarray, tuple[str, ...]] | None:
    """Return the number of rows in the cache, the ends of their columns and the names; None without a whole file."""
    try:
        with h5py.File(cache_file, locking=False) as file:
            names = tuple(file[NAMES].asstr()[:]) if NAMES in file else ()
            return len(file[ROWS]), file[ROWS].attrs["ends"], names
    except DAMAGES:
        return None


def _forget_others(cache_file: Path) -> None:
    """Remove tables from the cache that nobody has used for a long time."""
    oldest = time.time() - MAX_CACHE_AGE
    for old_file in cache_file.parent.glob("*") if cache_file.parent.is_dir() else ():
        if old_file.stat().st_mtime < oldest:
            old_file.unlink(missing_ok=True)


def _check_column(column: ColumnOf, values: np.ndarray, before: int) -> None:
    """Refuse the first value that is no number or is not allowed; `before` rows have been read."""
    allowed = f"{column.parameter.quantity.bounds}, in every row"
    low, high = values.min(), values.max()
    if not (np.isfinite(low) and np.isfinite(high)):
        row = int(np.argmin(np.isfinite(values)))
        raise refusal(column.parameter.name, f"row {before + row + 1:,}", "is missing, or no finite number", allowed)
    item = column.parameter.quantity.item
    if any(allowed_values(item, end) for end in extremes(values)):
        row, bounds = next((k, w) for k, v in enumerate(values.tolist()) if (w := allowed_values(item, v)))
        value = f"row {before + row + 1:,} ({float(values[row])!r})"
        raise refusal(column.parameter.name, value, "is out of range", bounds)
