"""Tables in CSV, Parquet and netCDF-4: headings, and rows as doubles, a part at a time.

Rows of CSV and Parquet are read in a child process (see `sweeps.reading.sandbox`). Of netCDF-4 a child finds where the
numbers lie, as of a map.
"""

import csv
import re
from collections import Counter, deque
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from io import BytesIO

import numpy as np

from sweeps.reading import hdf5, sandbox
from sweeps.reading.files import FileBytes
from sweeps.reading.stored_values import StoredValues
from sweeps.schema.refusals import MapError, UnreadableError, cut_text, display

PART_ROWS = 2**17  # number of rows in memory at once
BLOCK_BYTES = 2**22  # bytes of a CSV file that are searched at once
TRUTH_VALUE = re.compile(rb"(?i)\b(true|false)\b")
LONGEST_LINE = 2**16  # bytes
SAMPLE_BYTES = 2**18  # bytes at the beginning and at the end of a text file in which digits of numbers are counted
MAX_COLUMNS = 1000  # number of columns of a table
MAX_NAMES = 100_000  # rows of a table up to which its column of names is read
MAX_NAME_LENGTH = 100  # characters of a name; a longer one is cut
SMALL_TABLE = 2**26  # bytes in memory that any table may have
MAX_SIZE_RATIO = 100  # bytes in memory over bytes of the file, of a larger table
SECONDS_PER_BYTE = 2.0**-20  # processor seconds per byte, in addition to `sandbox.MAX_SECONDS`
HEADING = re.compile(r"\s*(?P<name>[^\s(\[]+)\s*(?:[(\[]\s*(?P<unit>.*?)\s*[)\]])?\s*")
NETCDF_PACKING = ("_Unsigned", "valid_min", "valid_max", "valid_range")


def refusal(column: str, value: str, reason: str, allowed: str) -> UnreadableError:
    """Return the error about a table, or (unless "") a `column`: its `value`, the `reason`, the `allowed` values."""
    return UnreadableError(("table", column) if column else ("table",), value, reason, allowed)


def heading(text: str) -> tuple[str, str]:
    """Return name and unit ("" for none) of a heading: "I1", "I1 (kg m2)", "I1 [kg m^2]"."""
    match = HEADING.fullmatch(text[:LONGEST_LINE])
    return (match["name"], match["unit"] or "") if match else (text.strip(), "")


def open_source(
    file: FileBytes, suffix: str, other_types: bool = False, readers: "Mapping[str, type[Source]] | None" = None
) -> "Source":
    """Return the columns of a file of the kind of its suffix, by its entry in `readers`.

    With `other_types`, columns of types other than numbers are in `Source.texts`, and variables of netCDF-4 along
    further dimensions are left out; they are refused otherwise.
    """
    source = (readers or SUFFIXES)[suffix](file, other_types)
    if len(source.headings) > MAX_COLUMNS:
        raise refusal("", display(source.name), f"has {len(source.headings):,} columns", f"at most {MAX_COLUMNS:,}")
    return source


def sample_lines(file: FileBytes, begin: int) -> list[str]:
    """Return the whole lines of the first and of the last `SAMPLE_BYTES` of a text file from byte `begin` on."""
    size = file.size - begin
    lines = file.read_at(begin, min(SAMPLE_BYTES, size)).splitlines() if size > 0 else []
    if size > SAMPLE_BYTES:
        lines = lines[:-1] + file.read_at(file.size - SAMPLE_BYTES, SAMPLE_BYTES).splitlines()[1:]
    return [line.decode("utf-8", "replace") for line in lines]


def _has_truth_value(block: bytes) -> bool:
    """Return True if a truth value is among the words of a block."""
    low = block.lower()  # a search for letters that are not there is fast
    return (b"true" in low or b"false" in low) and TRUTH_VALUE.search(block) is not None


def _is_text(value: str) -> bool:
    """Return True for a value of a CSV file in which no digit is, and which is neither missing nor a truth value."""
    return value.strip().lower() not in ("", "true", "false", "nan") and not any(map(str.isdigit, value))


class Source:
    """A file of columns."""

    headings: list[tuple[str, str]]

    def __init__(self, file: FileBytes, other_types: bool = False):
        self._file, self.name, self._other_types = file, file.name.rpartition("/")[2], other_types
        self.texts: set[int] = set()  #: numbers of the columns of text
        self.single: set[int] = set()  #: numbers of the columns in single precision

    def row_blocks(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """Yield rows of some columns, `PART_ROWS` at a time, float64 of shape (rows, columns); NaN for no number."""
        seconds = sandbox.MAX_SECONDS + self._file.size * SECONDS_PER_BYTE
        try:
            for block in sandbox.parts_from_child(partial(self._rows_as_bytes, places), seconds):
                yield np.frombuffer(block, "<f8").reshape(-1, len(places)).copy()
        except sandbox.ChildError as error:
            problem = f"is damaged ({error})"
            problem = problem if str(error) else "cannot be read (it is damaged, or takes too much time or memory)"
            raise refusal("", display(self.name), problem, "a whole table") from None

    def _rows_as_bytes(self, places: Sequence[int]) -> Iterator[bytes]:
        for block in self.read_rows(places):
            yield np.ascontiguousarray(block, "<f8").tobytes()

    def read_rows(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """Yield the rows, in the child; see `row_blocks`."""
        raise NotImplementedError

    def sample_rows(self) -> list[list[str]]:
        """Return the values of some rows as written; [] for a binary file."""
        return []

    def names(self, place: int) -> list[str] | None:
        """Return the texts of a column, printable and of bounded length; None for a table of too many rows.

        Raises:
            UnreadableError: if the column cannot be read.
        """
        try:
            texts = sandbox.run_in_child(partial(self._names_as_answer, place), self._file.size)["names"]
        except sandbox.ChildError:
            reason, allowed = "cannot be read as text", "a text in every row"
            raise refusal(self.headings[place][0], display(self.name), reason, allowed) from None
        return None if len(texts) > MAX_NAMES else [_printable(text)[:MAX_NAME_LENGTH] for text in texts]

    def _names_as_answer(self, place: int) -> dict:
        """Return the first texts of a column, one more than `MAX_NAMES` at most; runs in the child."""
        texts = []
        for block in self.read_texts(place):
            texts += block
            if len(texts) > MAX_NAMES:
                break
        return {"names": texts[: MAX_NAMES + 1]}

    def read_texts(self, place: int) -> Iterator[list[str]]:
        """Yield the texts of a column, part by part, in the child."""
        raise NotImplementedError

    def _refuse_swollen(self, values: int) -> None:
        """Refuse a table of more values than a file of its size holds."""
        if 8 * values > max(SMALL_TABLE, MAX_SIZE_RATIO * self._file.size):
            problem = f"declares {values:,} values, {MAX_SIZE_RATIO} times what it holds"
            raise refusal("", display(self.name), problem, "a table whose numbers are in the file")


def _printable(value: object) -> str:
    return cut_text("".join(c if c.isprintable() else " " for c in str(value)[:200]))


# -- CSV


class _Csv(Source):
    """Text with a line of names, then a line a row; commas (or semicolons, or tabs) between values."""

    def __init__(self, file: FileBytes, other_types: bool = False):
        super().__init__(file, other_types)
        try:
            line, below = (self._line(number).decode("utf-8-sig") for number in (0, 1))
        except UnicodeDecodeError:
            raise refusal("", display(self.name), "is not UTF-8 text", "a CSV file in UTF-8") from None
        self._between = next((sign for sign in ",;\t" if sign in line), ",")
        names, first = (next(csv.reader([text], delimiter=self._between), []) for text in (line, below))
        width = max(len(names), len(first))  # spreadsheets end lines with separators for columns that are empty
        if width > MAX_COLUMNS:
            raise refusal("", display(self.name), f"has {width:,} columns", f"at most {MAX_COLUMNS:,}")
        while names and not names[-1].strip():
            names.pop()
        if not any(name.strip() for name in names):
            raise refusal("", display(self.name), "has no first line of names", "names of columns in the first line")
        self.headings = [heading(name) for name in names]
        self._spare = [str(place) for place in range(len(names), width)]
        pairs = enumerate(zip(self.headings, first, strict=False))
        self.texts = {place for place, ((name, _), value) in pairs if name.lower() == "name" or _is_text(value)}

    def sample_rows(self) -> list[list[str]]:
        """Return the values of the first and the last rows as written (see `sample_lines`)."""
        return list(csv.reader(sample_lines(self._file, len(self._line(0)) + 1), delimiter=self._between))

    def _line(self, number: int) -> bytes:
        """Return a line near the start of the file by its number from 0, b"" if there is none."""
        lines = self._file.read_at(0, min(self._file.size, 2 * LONGEST_LINE + 2)).splitlines()
        line = lines[number] if number < len(lines) else b""
        if len(line) > LONGEST_LINE:
            raise self._too_long(number)
        return line

    def _too_long(self, row: int | None = None) -> UnreadableError:
        value = display(self.name) if not row else f"row {row:,}"
        return refusal("", value, f"has a line of more than {LONGEST_LINE:,} bytes", "lines that are shorter")

    def _read(self, what, dtype, **options):
        """Return rows of CSV text as a DataFrame of one type, with pandas's options."""
        import pandas as pd

        if tuple(map(int, pd.__version__.split(".")[:2])) < (3, 1):  # before, its own floats were not always nearest
            options["float_precision"] = "round_trip"
        names = [*map(str, range(len(self.headings))), *self._spare]
        settings = {"sep": self._between, "names": names, "encoding": "utf-8-sig", "engine": "c"}
        return pd.read_csv(what, dtype=dtype, **settings, **options)

    def row_blocks(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """Return the rows; see `Source`."""
        self._read(BytesIO(b"1\n"), "f8", header=None)  # loads here what the child, which can open no file, needs
        return super().row_blocks(places)

    def _blocks(self) -> Iterator[bytes]:
        """Yield whole lines below the first, some megabytes at a time."""
        at = len(self._line(0)) + 1
        while at < self._file.size:
            block = self._file.read_at(at, min(BLOCK_BYTES + LONGEST_LINE, self._file.size - at))
            if len(block) > BLOCK_BYTES:
                end = block.find(b"\n", BLOCK_BYTES - 1)
                if end < 0:
                    raise self._too_long()
                block = block[: end + 1]
            at += len(block)
            yield block

    def read_rows(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """Yield the rows, in the child."""
        import pandas as pd

        order = [str(place) for place in places]
        # pandas reads a column of true and false as 1 and 0
        if self.texts - {*places} or any(map(_has_truth_value, self._blocks())):
            yield from self._parsed_texts(order)
            return
        try:
            for block in self._row_parts("f8"):
                yield block[order].to_numpy()
        except pd.errors.ParserError as error:
            match = re.search(r"line (\d+), saw (\d+)", str(error))
            value = f"row {int(match[1]) - 1:,} ({match[2]} values)" if match else display(self.name)
            raise refusal("", value, "is no row of the table", f"{len(order)} values in every row") from None
        except UnicodeDecodeError:
            raise refusal("", display(self.name), "is not UTF-8 text", "a CSV file in UTF-8") from None
        except ValueError:
            deque(self._parsed_texts(order), maxlen=0)  # raises the error that names the text
            raise refusal("", display(self.name), "holds what is no number", "numbers in every row") from None

    def _row_parts(self, dtype: str, **options):
        """Yield the rows as DataFrames of one type, part by part; refuse rows of more values than names."""
        import pandas as pd

        for block in self._read(self._stream(), dtype, header=0, chunksize=PART_ROWS, **options):
            if not isinstance(block.index, pd.RangeIndex) or block[self._spare].notna().any(axis=None):
                raise refusal("", display(self.name), "has more values in a row than names", "as many")
            yield block

    def _parsed_texts(self, order: list[str]) -> Iterator[np.ndarray]:
        """Yield the numbers of some columns, read as text; refuse the first text that is not a number by its row."""
        import pandas as pd

        first = 1
        for block in self._row_parts("str"):
            values = block[order]
            is_text = (values.apply(pd.to_numeric, errors="coerce").isna() & values.notna()).to_numpy()
            if is_text.any():
                row, at = map(int, np.argwhere(is_text)[0])
                value = f"row {first + row:,} ({display(str(values.iat[row, at]))})"
                column = self.headings[int(order[at])][0]
                raise refusal(column, value, "is no number", "a number in every row, with a decimal point")
            yield values.astype("f8").to_numpy()
            first += len(block)

    def read_texts(self, place: int) -> Iterator[list[str]]:
        """Yield the texts of a column, part by part, in the child."""
        for block in self._row_parts("str", keep_default_na=False):
            yield block[str(place)].fillna("").tolist()

    def _stream(self) -> FileBytes:
        self._file.seek(0)
        return self._file


# -- Parquet


class _Parquet(Source):
    """A Parquet file; units stand in the names, as in CSV."""

    def __init__(self, file: FileBytes, other_types: bool = False):
        super().__init__(file, other_types)
        try:
            import pyarrow.parquet  # noqa: F401 -- here, since the child can open no file
        except ImportError:
            problem, allowed = "needs pyarrow, which is not here", "pip install -e '.[table]'"
            raise refusal("", display(self.name), problem, allowed) from None
        try:
            answer = sandbox.run_in_child(self._read_schema, file.size)
        except sandbox.ChildError as error:
            reason = str(error) or "reading it failed, or took too much"
            raise refusal("", display(self.name), "is no Parquet file", reason) from None
        self.headings = [heading(name) for name in answer["names"]]
        self.texts = {k for k, kind in enumerate(answer["kinds"]) if kind and (self._other_types or "string" in kind)}
        self.single = set(answer["single"])
        for k, ((name, _), kind) in enumerate(zip(self.headings, answer["kinds"], strict=True)):
            if kind and k not in self.texts:
                raise refusal(name, display(kind), "is no type of numbers", "numbers in every row")
        self._rows = answer["rows"]

    def _open_parquet(self):
        """Return the Parquet file, read from its first byte."""
        from pyarrow import PythonFile, parquet

        self._file.seek(0)
        return parquet.ParquetFile(PythonFile(self._file, "r"), pre_buffer=False)

    def _read_schema(self) -> dict:
        """Return names, types that are no numbers (else ""), and the number of rows; runs in the child."""
        from pyarrow import types

        parquet_file = self._open_parquet()
        schema = parquet_file.schema_arrow
        kinds = ["" if types.is_floating(f.type) or types.is_integer(f.type) else str(f.type) for f in schema]
        single = [k for k, f in enumerate(schema) if types.is_float32(f.type)]
        rows = parquet_file.metadata.num_rows
        return {"names": list(schema.names), "kinds": kinds, "single": single, "rows": rows}

    def row_blocks(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """Yield the rows; see `Source`."""
        self._refuse_swollen(self._rows * len(places))
        rows_left = self._rows
        for block in super().row_blocks(places):
            if len(block) > rows_left:
                raise refusal("", display(self.name), "holds more rows than it declares", "a whole table")
            rows_left -= len(block)
            yield block

    def read_rows(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """Yield the rows, in the child."""
        parquet_file = self._open_parquet()
        names = [parquet_file.schema_arrow.names[k] for k in places]
        for batch in parquet_file.iter_batches(PART_ROWS, columns=names, use_threads=False):
            columns = [batch.column(name).to_numpy(zero_copy_only=False) for name in names]
            yield np.column_stack([column.astype("f8") for column in columns])

    def read_texts(self, place: int) -> Iterator[list[str]]:
        """Yield the texts of a column, part by part, in the child."""
        parquet_file = self._open_parquet()
        name = parquet_file.schema_arrow.names[place]
        for batch in parquet_file.iter_batches(PART_ROWS, columns=[name], use_threads=False):
            yield [value or "" for value in batch.column(name).to_pylist()]


# -- netCDF-4


class _Netcdf(Source):
    """A netCDF-4 file with variables along one dimension, their units as attributes."""

    def __init__(self, file: FileBytes, other_types: bool = False):
        super().__init__(file, other_types)
        try:
            variables = hdf5.read_structure(file).variables
        except MapError as refused:
            reason = str(refused).removeprefix(f"{file.name}: ").partition("; allowed")[0]
            allowed = "a netCDF-4 file (nccopy -k nc4 makes one of other netCDF)"
            raise refusal("", display(self.name), f"is no netCDF file that can be read ({reason})", allowed) from None
        if self._other_types:
            along = Counter(variable.dims[0] for variable in variables.values() if len(variable.dims) == 1)
            longest_dims = [(dim,) for dim, _ in along.most_common(1)]
            variables = {name: v for name, v in variables.items() if [v.dims] == longest_dims and _is_plain(v)}
        dims = {dim for variable in variables.values() for dim in variable.dims if not self._other_types}
        columns = {name: variable for name, variable in variables.items() if name not in dims}
        of_rows = next((variable.dims for variable in columns.values()), ())
        problem = [name for name, variable in columns.items() if len(variable.dims) != 1 or variable.dims != of_rows]
        if problem or not columns:
            value = display(problem[0] if problem else self.name)
            raise refusal("", value, "does not lie along the one dimension of rows", "variables along one dimension")
        self._columns = list(columns.items())
        self.headings = [(name, str(variable.attributes.get("units", ""))) for name, variable in self._columns]
        self.single = {k for k, (_, variable) in enumerate(self._columns) if variable.dtype == "float32"}
        for name, variable in self._columns:
            if not _is_plain(variable):
                raise refusal(name, variable.dtype or "unknown", "is no type of numbers", "numbers in every row")
            if packing := [word for word in NETCDF_PACKING if word in variable.attributes]:
                raise refusal(name, packing[0], "is an attribute that changes its numbers", "plain numbers")

    def row_blocks(self, places: Sequence[int]) -> Iterator[np.ndarray]:
        """Yield the rows; see `Source`."""
        variables = [self._columns[k] for k in places]
        rows = variables[0][1].shape[0]
        self._refuse_swollen(rows * len(places))
        columns = [(StoredValues(self._file, name, variable), variable.attributes) for name, variable in variables]
        for start in range(0, rows, PART_ROWS):
            block = (slice(start, min(start + PART_ROWS, rows)),)
            yield np.column_stack([_unpack_values(values.read(block), attributes) for values, attributes in columns])


def _is_plain(variable: hdf5.StoredVariable) -> bool:
    """Return True for a variable of numbers."""
    return variable.dtype != "str" and np.dtype(variable.dtype or "V").kind in "iuf"


def _unpack_values(values: np.ndarray, attributes: dict) -> np.ndarray:
    """Return numbers stored by netCDF's conventions: NaN for missing values, scaled and shifted."""
    from netCDF4 import default_fillvals  # of what was never written

    kind = values.dtype.str[1:]
    missing = [n for key in ("_FillValue", "missing_value") for n in _numbers_of(attributes, key)]
    missing += [default_fillvals[kind]] if kind in default_fillvals and values.itemsize > 1 else []
    numbers = np.where(np.isin(values, np.array(missing).astype(values.dtype)), np.nan, values.astype("f8"))
    return (
        numbers * [*_numbers_of(attributes, "scale_factor"), 1.0][0] + [*_numbers_of(attributes, "add_offset"), 0.0][0]
    )


def _numbers_of(attributes: dict, name: str) -> list:
    """Return the numbers of an attribute; none for text."""
    return numbers if isinstance(numbers := attributes.get(name), list) else []


SUFFIXES = {".csv": _Csv, ".parquet": _Parquet, ".nc": _Netcdf}
