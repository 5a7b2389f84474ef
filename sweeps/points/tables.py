"""Tables of points: CSV, Parquet or netCDF in; checked rows out, any part of them without the rest.

A table is read once, a part at a time, every value held against what its parameter may be. What passes lies in the
cache beside the compiled kernels, row after row as doubles in the parameters' own units, under a name made of the
file's SHA-256 and of what was asked of it; so each shard reads its own rows alone, and no list of all is ever made.
"""

import csv
import hashlib
import json
import re
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import Any, get_args

import numpy as np
from isal import isal_zlib
from pydantic_core import PydanticCustomError

from kernels.cache import cache_folder
from sweeps import memory
from sweeps.files import replaced
from sweeps.points import units
from sweeps.schema.parameters import Derived, GridOf, Parameter
from sweeps.schema.refusals import UnreadableError, display, hint, shortened

PART_ROWS = 2**17  # of a file that are in memory at once
BLOCK_ROWS = 2**14  # of the cache that share a checksum
BLOCK_BYTES = 2**22  # of a CSV file that one thread parses at once
TRUTH_VALUE = re.compile(rb"(?i)\b(true|false)\b")
LONGEST_LINE = 2**16  # bytes: of a file with longer ones no block is parsed by itself
PARSERS = 2  # threads; the memory they take does not grow with the file
SUFFIXES = {".csv": "csv", ".parquet": "parquet", ".nc": "netcdf"}
FORMAT = "1"
SETTLED_SECONDS = 2.0  # after its last change a file's times tell the next one, on any file system
KEPT_SECONDS = 30 * 86_400.0  # a table that nobody asks for is forgotten


@dataclass(frozen=True)
class ColumnOf:
    """One column of a table.

    Attributes:
        place: its number in the file, from 0.
        parameter: what it holds.
        factor: by which its numbers are multiplied.
    """

    place: int
    parameter: Parameter
    factor: float

    @property
    def name(self) -> str:
        """The parameter's name."""
        return self.parameter.name


@dataclass(frozen=True)
class Table:
    """The rows of a table, checked; see `sweeps.points.scattered.Scattered`.

    Attributes:
        file: the table's path, as the definition names it.
        digest: SHA-256 of its content.
        names: its columns, as parameters.
        cached: the file of its rows.
        num: how many rows there are.
        ends: least and greatest value of each column.
    """

    file: str
    digest: str
    names: tuple[str, ...]
    cached: Path
    num: int
    ends: tuple[tuple[float, float], ...]

    @property
    def input(self) -> str:
        """The file as the definition names it, with its SHA-256."""
        return f"{self.file} {self.digest}"

    @cached_property
    def _checksums(self) -> list[int]:
        return _told(self.cached)["checksums"]

    def rows(self, start: int, stop: int) -> Mapping[str, np.ndarray]:
        """Name → values at the rows start … stop − 1 (from 0), shape (stop − start,).

        Raises:
            OSError: where the cache was damaged.
        """
        first, after = start // BLOCK_ROWS, -(-stop // BLOCK_ROWS)
        width = 8 * len(self.names)
        with self.cached.open("rb") as file:
            file.seek(first * BLOCK_ROWS * width)
            content = file.read((min(after * BLOCK_ROWS, self.num) - first * BLOCK_ROWS) * width if stop > start else 0)
        for k, number in enumerate(range(first, after) if stop > start else ()):
            part = content[k * BLOCK_ROWS * width : (k + 1) * BLOCK_ROWS * width]
            if isal_zlib.crc32(part) != self._checksums[number]:
                self.cached.unlink(missing_ok=True)
                raise OSError(0, "was damaged and is removed: the same command reads the table again", str(self.cached))
        low = start - first * BLOCK_ROWS
        values = np.frombuffer(content, "<f8").reshape(-1, len(self.names))[low : low + stop - start]
        return {name: values[:, k] for k, name in enumerate(self.names)}  # seen in the rows: most want one column


def read(file: str, folder: str, model: type[GridOf], grid: Mapping[str, Any]) -> Table:
    """A table, checked.

    Args:
        file: its path, relative to the definition's folder.
        folder: that folder.
        model: of the definition's grid, whose parameters its columns may be.
        grid: the plain values of the definition's grid, which gives what the table does not.

    Raises:
        UnreadableError: for a file that cannot be read, a column that is unknown or in unknown units, and the first
            row that is no point, by its number.
    """
    path = Path(folder) / file
    _check_file(path, file)
    try:
        digest, seen = _digest(path)
        source = _SOURCES[SUFFIXES[path.suffix.lower()]](path)
        columns = _columns(source.headings, model.parameters, grid)
        fixed = {name: float(value) for name, value in grid.items() if type(value) in (int, float)}
        asked = [(c.place, c.name, c.factor, c.parameter.quantity.bounds) for c in columns]
        key = hashlib.sha256(json.dumps([FORMAT, digest, path.suffix, asked, fixed]).encode()).hexdigest()[:40]
        cached = cache_folder() / "tables" / key
        if _told(cached) is None:
            _forget_others(cached)
            _write(cached, source, columns, fixed, model.derived)
    except OSError as error:
        raise _refused("", display(file), f"cannot be read ({error.strerror or error})", "a readable table") from None
    if seen:
        _note(path, seen)
    told = _told(cached)
    cached.touch()
    return Table(file, digest, tuple(c.name for c in columns), cached, told["num"], tuple(map(tuple, told["ends"])))


def _digest(path: Path) -> tuple[str, dict | None]:
    """SHA-256 of a file, and what to note of it if it had to be read for that.

    A file that is the same to the nanosecond of its last change, which was well before it was read, has the same
    content: every process of a sweep asks, and one reads.
    """
    looks = _looks(path)
    try:
        noted = json.loads(_noted(path).read_bytes())
        if noted["looks"] == looks and len(noted["digest"]) == 64:
            return noted["digest"], None
    except (OSError, ValueError, TypeError, KeyError):
        pass
    begun = time.time()
    with path.open("rb") as opened:
        digest = hashlib.file_digest(opened, "sha256").hexdigest()
    settled = begun - max(looks[-2:]) / 1e9 > SETTLED_SECONDS and _looks(path) == looks
    return digest, {"looks": looks, "digest": digest} if settled else None


def _looks(path: Path) -> list[int]:
    """What tells a file from what it was before: device, number, size, times of its last changes."""
    told = path.stat()
    return [told.st_dev, told.st_ino, told.st_size, told.st_mtime_ns, told.st_ctime_ns]


def _noted(path: Path) -> Path:
    """Where a file's digest is noted."""
    return cache_folder() / "tables" / f"seen-{hashlib.sha256(str(path.resolve()).encode()).hexdigest()[:40]}"


def _note(path: Path, seen: dict) -> None:
    with replaced(_noted(path), flush=False) as temporary:
        temporary.write_text(json.dumps(seen))


def _refused(column: str, shown: str, wrong: str, allowed: str) -> UnreadableError:
    return UnreadableError(("table", column) if column else ("table",), shown, wrong, allowed)


def _check_file(path: Path, file: str) -> None:
    kinds = "a CSV (.csv), Parquet (.parquet) or netCDF (.nc) file, its path relative to the definition's"
    if path.suffix.lower() not in SUFFIXES:
        raise _refused("", display(file), "is no table by its name", kinds)
    if not path.is_file():
        raise _refused("", display(file), "is not there, or is no file", kinds)


def _columns(headings: Sequence[tuple[str, str]], parameters: Sequence[Parameter], grid: Mapping) -> list[ColumnOf]:
    known = {p.name: p for p in parameters}
    named = ", ".join(p.name + ("" if p.quantity.units == "1" else f" ({p.quantity.units})") for p in parameters)
    found: dict[str, ColumnOf] = {}
    for place, (name, unit) in enumerate(headings):
        shown = display(name)
        if name not in known:
            raise _refused("", shown, "is no column that is known" + hint(name, known), f"the columns {named}")
        if name in found:
            raise _refused("", shown, "is the name of two columns", "each column once")
        if name in grid:
            raise _refused(name, shown, "is a column of the table and given in grid too", "one of these")
        wanted = known[name].quantity.units
        factor = units.factor(unit, wanted)
        if factor is None:
            raise _refused(name, display(unit), "is a unit that is not known", units.allowed(wanted))
        found[name] = ColumnOf(place, known[name], factor)
    return [found[name] for name in known if name in found]


# ---------------------------------------------------------------------------------------------------------
# Rows that are checked


def _write(
    cached: Path, source: "_Source", columns: Sequence[ColumnOf], fixed: Mapping[str, float], derived: Derived | None
) -> None:
    """Reads, checks and keeps all rows; nothing is left where one is refused."""
    memory.keep_freed()
    num, checksums, ends = 0, [], None
    names = [column.name for column in columns]
    with replaced(cached, flush=False) as temporary, temporary.open("wb") as file:
        for values in _even(source.parts([column.place for column in columns])):
            by_column = np.ascontiguousarray(values.T)
            for column, own in zip(columns, by_column, strict=True):
                own *= column.factor
                _check_column(column, own, num)
            _check_existence(derived, {**fixed, **dict(zip(names, by_column, strict=True))}, names, num)
            content = memoryview(np.ascontiguousarray(by_column.T, "<f8")).cast("B")
            file.write(content)
            size = BLOCK_ROWS * 8 * len(names)
            checksums += [isal_zlib.crc32(content[at : at + size]) for at in range(0, len(content), size)]
            these = np.stack([by_column.min(axis=1), by_column.max(axis=1)])
            ends = these if ends is None else np.stack([np.minimum(ends[0], these[0]), np.maximum(ends[1], these[1])])
            num += len(values)
        if num == 0:
            raise _refused("", display(source.path.name), "has no rows", "a row for each point, below the names")
        told = json.dumps({"num": num, "ends": ends.T.tolist(), "checksums": checksums}).encode()
        file.write(told + isal_zlib.crc32(told).to_bytes(4, "little") + len(told).to_bytes(8, "little"))


def _even(parts: Iterable[np.ndarray]) -> Iterator[np.ndarray]:
    """The same rows, `PART_ROWS` at a time: checksums are of whole blocks."""
    held, rows = [], 0
    for part in parts:
        held, rows = [*held, part], rows + len(part)
        while rows >= PART_ROWS:
            whole = np.concatenate(held)
            yield whole[:PART_ROWS]
            held, rows = [whole[PART_ROWS:]], rows - PART_ROWS
    if rows:
        yield np.concatenate(held)


def _told(cached: Path) -> dict | None:
    """What stands behind the rows in the cache; None where there is no whole file."""
    try:
        with cached.open("rb") as file:
            size = file.seek(-12, 2)
            check, length = (int.from_bytes(file.read(n), "little") for n in (4, 8))
            file.seek(max(0, size - length))
            told = file.read(min(length, size))
    except (OSError, ValueError):
        return None
    return json.loads(told) if len(told) == length and isal_zlib.crc32(told) == check else None


def _forget_others(cached: Path) -> None:
    """Removes tables from the cache that nobody has asked for in a long time."""
    old = time.time() - KEPT_SECONDS
    for other in cached.parent.glob("*") if cached.parent.is_dir() else ():
        if other.stat().st_mtime < old:
            other.unlink(missing_ok=True)


def _check_column(column: ColumnOf, values: np.ndarray, before: int) -> None:
    """Refuses the first value that is no number or is not allowed; `before` rows have been read."""
    allowed = f"{column.parameter.quantity.bounds}, in every row"
    low, high = values.min(), values.max()
    if not (np.isfinite(low) and np.isfinite(high)):
        row = int(np.argmin(np.isfinite(values)))
        raise _refused(column.name, f"row {before + row + 1:,}", "is missing, or no finite number", allowed)
    telling = [values] if low > 0 or high < 0 else [values, values[values > 0], values[values < 0], values[values == 0]]
    if any(_wrong(column, end) for part in telling if part.size for end in (part.min(), part.max())):
        row, wrong = next((k, w) for k, v in enumerate(values.tolist()) if (w := _wrong(column, v)))
        shown = f"row {before + row + 1:,} ({float(values[row])!r})"
        raise _refused(column.name, shown, "is out of range", wrong)


def _wrong(column: ColumnOf, value: float) -> str:
    """What a value should be; "" for one that is right."""
    try:
        for check in get_args(column.parameter.quantity.item)[1:]:
            check.func(float(value))
    except PydanticCustomError as refused:
        return refused.context["allowed"]
    return ""


def _check_existence(derived: Derived | None, columns: Mapping[str, Any], names: Sequence[str], before: int) -> None:
    """Refuses the first row that cannot exist."""
    impossible = derived.impossible(columns) if derived else None
    if impossible is not None and np.ndim(impossible) and impossible.any():
        row = int(np.argmax(impossible))
        shown = ", ".join(
            f"{name} {float(np.broadcast_to(columns[name], impossible.shape)[row]):.6g}" for name in names
        )
        shown = f"row {before + row + 1:,} ({shown})"
        raise _refused(
            "", shown, "is not a possible body: one moment is above the sum of the others", "moments of possible bodies"
        )


# ---------------------------------------------------------------------------------------------------------
# Files


class _Source:
    """A file of columns.

    Attributes:
        path: the file.
        headings: name and unit ("" for none) of each column.
    """

    path: Path
    headings: list[tuple[str, str]]

    def parts(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """The rows of some columns, `PART_ROWS` at a time, float64 of shape (rows, columns); NaN for what is none."""
        raise NotImplementedError


class _Csv(_Source):
    """Text with a line of names, then a line a row; commas (or semicolons, or tabs) between values."""

    def __init__(self, path: Path):
        self.path = path
        try:
            with path.open(encoding="utf-8-sig", newline="") as file:
                line, below = file.readline(2**16), file.readline(2**16)
        except UnicodeDecodeError:
            raise _refused("", display(path.name), "is not UTF-8 text", "a CSV file in UTF-8") from None
        self._between = next((sign for sign in ",;\t" if sign in line), ",")
        names, first = (next(csv.reader([text], delimiter=self._between), []) for text in (line, below))
        width = max(len(names), len(first))  # spreadsheets end lines with separators for columns that are empty
        while names and not names[-1].strip():
            names.pop()
        if not any(name.strip() for name in names):
            raise _refused("", display(path.name), "has no first line of names", "names of columns in the first line")
        self.headings = [units.heading(name) for name in names]
        self._spare = [str(place) for place in range(len(names), width)]

    def _read(self, what, dtype, **options):
        import pandas as pd

        if tuple(map(int, pd.__version__.split(".")[:2])) < (3, 1):  # before, its own floats were not always nearest
            options["float_precision"] = "round_trip"
        names = [*map(str, range(len(self.headings))), *self._spare]
        settings = {"sep": self._between, "names": names, "encoding": "utf-8-sig", "engine": "c"}
        return pd.read_csv(what, dtype=dtype, **settings, **options)

    def parts(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """The rows; see `_Source`. Blocks of lines are parsed side by side, up to one that is strange."""
        done = 0
        for part in self._side_by_side(places):
            if part is None:
                break
            yield part
            done += len(part)
        else:
            return
        for part in self._in_turn(places):  # which says what is wrong, and in which row
            yield part[done:]
            done = max(0, done - len(part))

    def _side_by_side(self, places: Sequence[int]) -> Iterator[np.ndarray | None]:
        """Rows of blocks of lines, in order; None, and no more, where one is anything but rows of numbers."""
        order = [str(place) for place in places]

        def parsed(block: bytes) -> np.ndarray | None:
            import pandas as pd

            if any(letter in block for letter in b"uUlL"):  # pandas reads a column of true and false as 1 and 0
                return None
            try:
                part = self._read(BytesIO(block), "f8", header=None, low_memory=False)
            except ValueError:  # pandas' own errors are among them
                return None
            is_sound = isinstance(part.index, pd.RangeIndex) and not part[self._spare].notna().any(axis=None)
            return part[order].to_numpy() if is_sound else None

        waiting: deque[Future] = deque()
        with ThreadPoolExecutor(PARSERS) as pool:
            for block in self._blocks():
                if block is None:
                    yield from (future.result() for future in waiting)
                    yield None
                    return
                waiting.append(pool.submit(parsed, block))
                if len(waiting) > PARSERS:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()

    def _blocks(self) -> Iterator[bytes | None]:
        """Whole lines below the first, some megabytes at a time; None where lines do not end as they should."""
        with self.path.open("rb") as file:
            first = file.readline(LONGEST_LINE)
            if b"\r" in first.removesuffix(b"\n").removesuffix(b"\r") or len(first) == LONGEST_LINE:
                yield None
            while block := file.read(BLOCK_BYTES):
                rest = file.readline(LONGEST_LINE)
                if len(rest) == LONGEST_LINE:
                    yield None
                yield block + rest

    def _in_turn(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """The rows, one part after the other."""
        import pandas as pd

        order = [str(place) for place in places]
        number = 0
        if self._has_truth_values():
            raise self._text(0)
        try:
            for part in self._read(self.path, "f8", header=0, chunksize=PART_ROWS):
                if not isinstance(part.index, pd.RangeIndex) or part[self._spare].notna().any(axis=None):
                    raise _refused("", display(self.path.name), "has more values in a row than names", "as many")
                yield part[order].to_numpy()
                number += 1
        except pd.errors.ParserError as error:
            found = re.search(r"line (\d+), saw (\d+)", str(error))
            shown = f"row {int(found[1]) - 1:,} ({found[2]} values)" if found else display(self.path.name)
            raise _refused("", shown, "is no row of the table", f"{len(order)} values in every row") from None
        except UnicodeDecodeError:
            raise _refused("", display(self.path.name), "is not UTF-8 text", "a CSV file in UTF-8") from None
        except ValueError:
            raise self._text(number) from None

    def _has_truth_values(self) -> bool:
        """Return whether a value of the file is the word true or false."""
        with self.path.open("rb") as file:
            file.readline()
            return any(TRUTH_VALUE.search(line) for line in file)

    def _text(self, number: int) -> UnreadableError:
        """What is no number in a part of the file."""
        import pandas as pd

        text = self._read(self.path, "str", header=0, chunksize=PART_ROWS, keep_default_na=False)
        for k, part in enumerate(text):
            if k < number:
                continue
            bad = np.stack(
                [
                    pd.to_numeric(part[name], errors="coerce").isna().to_numpy()
                    for name in part.columns[: len(self.headings)]
                ]
            )
            if not bad.any():
                break
            row = int(np.argmax(bad.any(axis=0)))
            place = int(np.argmax(bad[:, row]))
            shown = f"row {number * PART_ROWS + row + 1:,} ({display(str(part.iat[row, place]))})"
            return _refused(
                self.headings[place][0], shown, "is no number", "a number in every row, with a decimal point"
            )
        return _refused("", display(self.path.name), "holds what is no number", "numbers in every row")


class _Parquet(_Source):
    """A Parquet file; units stand in the names, as in CSV."""

    def __init__(self, path: Path):
        self.path = path
        try:
            import pyarrow
            from pyarrow import parquet
        except ImportError:
            raise _refused(
                "", display(path.name), "needs pyarrow, which is not here", "pip install -e '.[table]'"
            ) from None
        try:
            self._file = parquet.ParquetFile(path)
        except (pyarrow.ArrowException, ValueError) as error:
            raise _refused("", display(path.name), "is no Parquet file", shortened(str(error))) from None
        schema = self._file.schema_arrow
        self.headings = [units.heading(name) for name in schema.names]
        for (name, _), field in zip(self.headings, schema, strict=True):
            if not (pyarrow.types.is_floating(field.type) or pyarrow.types.is_integer(field.type)):
                raise _refused(name, display(str(field.type)), "is no type of numbers", "numbers in every row")

    def parts(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """The rows; see `_Source`."""
        for batch in self._file.iter_batches(PART_ROWS):
            yield np.column_stack([batch.column(k).to_numpy(zero_copy_only=False).astype("f8") for k in places])


class _Netcdf(_Source):
    """A netCDF file with variables along one dimension, their units as attributes."""

    def __init__(self, path: Path):
        import netCDF4

        self.path = path
        try:
            self._file = netCDF4.Dataset(path)
        except (OSError, RuntimeError) as error:
            raise _refused("", display(path.name), f"is no netCDF file ({shortened(str(error))})", "netCDF") from None
        numbers = [v for v in self._file.variables.values() if v.name not in self._file.dimensions]
        wrong = [v.name for v in numbers if v.ndim != 1 or v.dimensions != numbers[0].dimensions]
        if wrong or not numbers:
            shown = display(wrong[0]) if wrong else display(path.name)
            raise _refused("", shown, "does not lie along the one dimension of rows", "variables along one dimension")
        self.headings = [(v.name, str(getattr(v, "units", ""))) for v in numbers]
        self._columns = numbers
        for variable in numbers:
            if not np.issubdtype(variable.dtype, np.number):
                raise _refused(variable.name, str(variable.dtype), "is no type of numbers", "numbers in every row")

    def parts(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """The rows; see `_Source`."""
        chosen = [self._columns[k] for k in places]
        for start in range(0, chosen[0].size, PART_ROWS):
            part = [np.ma.filled(v[start : start + PART_ROWS].astype("f8"), np.nan) for v in chosen]
            yield np.column_stack(part)


_SOURCES = {"csv": _Csv, "parquet": _Parquet, "netcdf": _Netcdf}
