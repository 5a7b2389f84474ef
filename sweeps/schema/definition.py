"""A sweep's definition: the frozen models that those of every system of equations build on.

The models here and in `sweeps.systems` are the only description of valid definitions: each key's meaning, unit and
allowed values are in its `key`, and a refusal quotes them. `sweeps.points.loading` reads them.
"""

import hashlib
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter
from typing import Annotated, Any

from pydantic import BeforeValidator, PrivateAttr, model_validator

from sweeps.schema import DEFAULT_SYSTEM
from sweeps.schema.parameters import Range, Strict, key, mapping
from sweeps.schema.refusals import Problem, display, keys_of, refusal, refusals
from sweeps.schema.values import TOLERANCE, Positive, Tolerance, choice, integer, line_of_text

NAME_PATTERN = r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}"
DEFAULT_NAME = "sweep"
MAX_SHARDS = 10_000
MAX_SAMPLES = 10**9
METHODS = ("sobol", "latin", "random")
MAX_SAMPLED, MAX_SOBOL = 2**40, 2**30  # numbers of sampled points; SciPy's Sobol points have 30 binary digits


class Sample(Strict):
    """Points drawn over the ranges of a grid, in place of all their combinations."""

    method: Annotated[str, choice(METHODS)] = key(
        "sobol (scrambled; most even, best with num a power of two), latin (Latin hypercube) or random", "sobol"
    )
    num: Annotated[int, integer(1, MAX_SAMPLED, f"a whole number from 1 to {MAX_SAMPLED:,}; sobol: {MAX_SOBOL:,}")] = (
        key("number of points: a whole number ≥ 1", ...)
    )
    seed: Annotated[int, integer(0, 2**63 - 1, "a whole number ≥ 0")] = key(
        "seed: a whole number ≥ 0; equal seeds give equal points", 0
    )


class Integration(Strict):
    """Settings of each run: its length, its samples, its accuracy."""

    rotations: Positive = key("length of a run in rotations, 2π/|omega0|: > 0", 4.0)
    samples_per_rotation: Annotated[int, integer(4, MAX_SAMPLES, f"a whole number from 4 to {MAX_SAMPLES:,}")] = key(
        "samples in a rotation: whole, ≥ 4; rotations × samples_per_rotation from 8 to 1e9", 16
    )
    tolerance: Tolerance = key(f"relative error allowed on the perturbation, {TOLERANCE}", 1e-10)

    @property
    def samples(self) -> int:
        """Number of samples in a run: rotations × samples_per_rotation, rounded."""
        return round(self.rotations * self.samples_per_rotation)

    @model_validator(mode="after")
    def _check_samples(self) -> "Integration":
        """Refuse runs with fewer than 8 or too many samples."""
        samples = self.rotations * self.samples_per_rotation
        if not (math.isfinite(samples) and 8 <= round(samples) <= MAX_SAMPLES):
            reason = f"makes {samples:.4g} samples with samples_per_rotation {self.samples_per_rotation}"
            allowed = f"rotations × samples_per_rotation from 8 to {MAX_SAMPLES:,}"
            raise refusals([Problem(("rotations",), display(self.rotations), reason, allowed)])
        return self


def _file_count(value: Any) -> int | str:
    """Return a number of files, or "auto"."""
    allowed = f"auto, or a whole number from 1 to {MAX_SHARDS:,} (each is a file and a job)"
    if value == "auto":
        return "auto"
    if isinstance(value, bool) or not isinstance(value, int):
        raise refusal("is neither auto nor a whole number", allowed)
    if not 1 <= value <= MAX_SHARDS:
        raise refusal("is out of range", allowed)
    return value


def _freeze_mapping(value: Any) -> tuple[tuple[str, float | str], ...]:
    """Return a mapping from names of coordinates to numbers or words as pairs, which can be hashed."""
    allowed = "a mapping from coordinates of the map to finite numbers or words"
    if not isinstance(value, Mapping) or not all(isinstance(name, str) and len(name) <= 200 for name in value):
        raise refusal("is not a mapping from names", allowed)
    for name, at in value.items():
        is_number = isinstance(at, int | float) and not isinstance(at, bool) and abs(at) <= sys.float_info.max
        if not is_number and not (isinstance(at, str) and len(at) <= 200 and at.isprintable()):
            raise refusal(f"has no number and no word at {name!r}", allowed)
    return tuple(value.items())


class Definition(Strict):
    """A sweep of any system: its varied parameters, the settings of its runs, its number of files.

    Each system's own model adds its `grid` and further keys. `name` and `text` are no keys of the file: the file's
    stem, and the YAML as run.
    """

    title: Annotated[str, line_of_text(200)] = key(
        "title of maps and figures: one line of text; default the sweep's name", ...
    )
    system: str = key(
        "the equations of motion: name of a system, or path of a .py file relative to this file's folder",
        DEFAULT_SYSTEM,
    )
    grid: Strict = key("what is varied", ...)
    integration: Integration = mapping("how each run is made", Integration)
    sample: Sample = key(
        "points drawn over the grid's ranges, in place of all their combinations: a mapping with " + keys_of(Sample)
    )
    table: Annotated[str, line_of_text(1000)] = key(
        "a file of points, in place of ranges: CSV, Parquet or netCDF, its path relative to the "
        "definition's, its columns named as the keys of grid"
    )
    start_at: Annotated[
        tuple[tuple[str, Any], ...], BeforeValidator(_freeze_mapping, json_schema_input_type=dict[str, float | str])
    ] = key(
        "where the report opens: a mapping from coordinates of the map to values; the nearest grid values "
        "are used; changes no result"
    )
    shards: Annotated[int | str, BeforeValidator(_file_count)] = key(
        f"files the work is cut into: auto, or 1 to {MAX_SHARDS:,}; changes no result", "auto"
    )
    _name: str = PrivateAttr(DEFAULT_NAME)
    _text: str = PrivateAttr("")
    _folder: str = PrivateAttr("")
    _reader: Callable[[str, str, str], "Definition"] = PrivateAttr(None)
    _rows: Any = PrivateAttr(None)
    name = property(attrgetter("_name"), doc="The sweep's name: its file's stem.")
    text = property(attrgetter("_text"), doc="The YAML as run: the file's own text, or the mapping written as YAML.")
    folder = property(attrgetter("_folder"), doc="Its file's folder: paths in the definition are relative to it.")
    rows = property(attrgetter("_rows"), doc="The rows of its table (see `sweeps.points.tables`); None without one.")

    @property
    def outlines(self) -> str:
        """Outlines of bodies for pictures, from files that the definition names."""
        return ""

    @property
    def input_notes(self) -> str:
        """Remarks on files that the definition names, a line each."""
        return ""

    @property
    def follows_attitude(self) -> bool:
        """True if the map contains the attitude: quaternions are verified too."""
        return False

    @property
    def differing_bits(self) -> str:
        """The reason why a point measured alone has different bits; "" if it has the same."""
        return ""

    @property
    def remarks(self) -> Sequence[tuple[str, str]]:
        """Further lines of `check`: (heading or "", line)."""
        return ()

    @property
    def facts(self) -> Mapping[str, Any]:
        """Further facts of `check --json`."""
        return {}

    def keep_source(self, text: str, name: str, folder: str, rows: Any, reader: Callable) -> None:
        """Store `text`, `name`, `folder`, the `rows` of its table, and the `reader` of the text in another process."""
        self._text, self._name, self._folder, self._rows, self._reader = text, name, folder, rows, reader

    @property
    def inputs(self) -> str:
        """The files that the definition names, one a line with the SHA-256 of its content; empty without any."""
        return self._rows.input if self._rows is not None else ""

    @property
    def digest(self) -> str:
        """The SHA-256 of its text and of the files that it names, 64 hexadecimal digits."""
        return hashlib.sha256(f"{self.text}\0{self.inputs}".encode("utf-8", "surrogatepass")).hexdigest()

    @classmethod
    def list_points(cls, values: Mapping, folder: str) -> tuple[dict, bytes] | None:
        """Return plain values and a table (CSV) of the points that a definition gives in another way; None without."""
        return None

    @classmethod
    def needs_files(cls, values: Mapping) -> str:
        """Return the reason why a definition (plain values) needs files that it names; "" if it needs none."""
        return ""

    @property
    def pair(self) -> Strict | None:
        """The two entries that give some parameters (see `sweeps.systems.bodies.shapes.RATIOS`); None without."""
        derived = getattr(self.grid, "derived", None)
        return getattr(self.grid, derived.key) if derived else None

    @property
    def sampled_ranges(self) -> dict[str, Range]:
        """Key of the grid → each range over which points are drawn; {} without `sample`."""
        if self.sample is None:
            return {}
        entries = {name: getattr(self.grid, name) for name in type(self.grid).model_fields}
        if (pair := self.pair) is not None:
            entries = dict(pair) | {n: e for n, e in entries.items() if n not in self.grid.derived.names}
        return {name: e for name, e in entries.items() if isinstance(e, Range) and e.start != e.stop}

    @model_validator(mode="after")
    def _check_sample(self) -> "Definition":
        """Refuse a `sample` with bodies, without a range, or of more points than its sequence has."""
        if self.sample is None:
            return self
        if getattr(self, "bodies", ()):
            reason, allowed = "is given beside bodies", "sample over ranges in grid, or bodies"
        elif not self.sampled_ranges:
            reason, allowed = "has no range to sample", "a range {start, stop} in grid, with two ends that differ"
        elif self.sample.method == "sobol" and self.sample.num > MAX_SOBOL:
            reason = "requests more points than exist"
            allowed = f"at most {MAX_SOBOL:,} points with sobol; or latin or random"
        else:
            return self
        raise refusals([Problem(("sample",), display(self.sample), reason, allowed)])

    def __reduce__(self):
        """Pickle a definition as its text: the models of a system need not be importable by name."""
        return self._reader, (self._text, self._name, self._folder)


def add_num_to_ranges(values: Mapping) -> dict:
    """Return the plain values of a definition with `num` added to the ranges of its grid that lack it."""
    grid = values.get("grid")
    if "sample" not in values or not isinstance(grid, dict):
        return dict(values)
    return {**values, "grid": {key: _with_num(entry) for key, entry in grid.items()}}


def _with_num(entry: Any) -> Any:
    """Return a grid's entry with `num` of its range: 2, or 1 for equal ends."""
    if not isinstance(entry, dict) or "num" in entry:
        return entry
    if "start" not in entry:  # a mapping of ranges
        return {key: _with_num(item) for key, item in entry.items()}
    return {**entry, "num": 1 if entry["start"] == entry.get("stop") else 2}
