"""Shards: runs of a sweep's points, each measured and written as a whole file.

A shard is a netCDF-4 file with the columns of its own points, along the dimension `point`. Its attributes identify the
points, the definition and the kernels, and a hash of all of this. So a file that was cut short or changed on the disk
is detected before it reaches a map.
"""

import hashlib
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from math import ceil
from pathlib import Path

import numpy as np

from sweeps.points.columns import open_pool, submit_points
from sweeps.points.estimate import BLOCK_POINTS, BLOCKS_BEGUN, integration_seconds
from sweeps.points.sweep import Sweep
from sweeps.process import machine
from sweeps.reading.files import FileBytes
from sweeps.reading.hdf5 import Structure, read_structure
from sweeps.reading.stored_values import StoredValues
from sweeps.schema.refusals import MapError
from sweeps.schema.variables import POINT
from sweeps.shards.content_hash import ContentHash
from sweeps.shards.contract import identity
from sweeps.shards.mapfile import new_file

FACTS = ("first_point", "point_after_last", "motions_integrated")  # text: a grid may have more than 2^63 points
PART_SECONDS = 1.0  # estimated time of the points that a thread measures at once; an interrupt waits for their end


class DamagedError(MapError):
    """A shard that was cut short or changed on the disk."""

    def __init__(self, path: str | Path, what: str, allowed: str = "a whole file of `polhode shard`"):
        super().__init__(f"{path}: {what}; allowed: {allowed}")
        self.path = Path(path)


class ForeignError(DamagedError):
    """A shard of another definition, or of different kernels."""


def _seal_text(facts: Iterable[str], content_hash: str) -> str:
    """Return one hash of a shard's attributes (`facts`) and the content hash of its values."""
    return hashlib.sha256("\0".join((*facts, content_hash)).encode()).hexdigest()


# -- writing

Progress = Callable[[int], None]
Store = Callable[[Mapping[str, np.ndarray]], None]


def write_shard(
    sweep: Sweep, number: int, count: int, path: str | Path, threads: int = 1, progress: Progress = lambda points: None
) -> None:
    """Measure a shard and write it, each block while the next is measured.

    Args:
        sweep: the sweep.
        number: of the shard, from 1.
        count: number of shards.
        path: the file to write.
        threads: number of threads.
        progress: called with the number of points of each finished block.
    """
    start, stop = sweep.grid.shard_bounds(count)[number - 1]
    with new_file(path, {POINT.name: stop - start} | sweep.grid.extra_sizes, flush=False) as file:
        file.add_columns([POINT.name], sweep.variables)
        motions = measure_blocks(sweep, range(start, stop), file.put_columns, threads, progress)
        facts = dict(zip(FACTS, map(str, (start, stop, motions)), strict=True))
        origin = {name: text for name, text in identity(sweep).items() if text}
        file.seal(origin | facts | {"seal": _seal_text(facts.values(), file.digest.hexdigest())})


def measure_blocks(
    sweep: Sweep, points: range, put: Store, threads: int = 1, progress: Progress = lambda points: None
) -> int:
    """Measure points block by block, store each block while the next is measured, and return the number of motions.

    Args:
        sweep: the sweep.
        points: numbers of the points.
        put: called with the columns of each block.
        threads: number of threads.
        progress: called with the number of points of each finished block.
    """
    machine.keep_freed_memory()
    motions = 0
    with open_pool(threads) as pool:
        for size, block_motions, columns in _submit_blocks(sweep, points, pool, threads):
            motions += block_motions
            put(columns())
            progress(size)
    return motions


def _submit_blocks(
    sweep: Sweep, points: range, pool: ThreadPoolExecutor, threads: int
) -> Iterator[tuple[int, int, Callable[[], dict]]]:
    """Yield (number of points, of motions, wait) for each block, and start measuring the next block before yielding."""
    queue: deque = deque()
    for low in range(points.start, points.stop, BLOCK_POINTS):
        size = min(BLOCK_POINTS, points.stop - low)
        values = sweep.grid.points(low, low + size)
        motions = sweep.system.motions(values, sweep.definition.integration)
        num_chunks = max(threads, ceil(integration_seconds(sweep, size) / PART_SECONDS))
        queue.append((size, motions, submit_points(values, sweep, pool, num_chunks)))
        if len(queue) == BLOCKS_BEGUN:
            yield queue.popleft()
    yield from queue


# -- reading


def holds_shard(path: str | Path, sweep: Sweep, number: int, count: int) -> bool:
    """Return True if a file is shard `number` of `count` of a sweep, measured by the present kernels.

    Args:
        path: of the file.
        sweep: the sweep.
        number: of the shard, from 1.
        count: number of shards.
    """
    try:
        with open_shard(path, sweep) as shard:
            return (shard.first, shard.after) == sweep.grid.shard_bounds(count)[number - 1]
    except MapError:
        return False


@contextmanager
def open_shard(path: str | Path, sweep: Sweep) -> Iterator["Shard"]:
    """Yield a shard; raise a MapError if the file does not exist or is not a shard of this sweep."""
    try:
        file = FileBytes(path)
    except (OSError, ValueError):
        raise MapError(f"{path}: there is no such file; allowed: a file of `polhode shard`") from None
    with file:
        yield Shard(file, sweep)


class Shard:
    """An open shard with checked attributes and types."""

    def __init__(self, file: FileBytes, sweep: Sweep):
        self.path, self._file, self._sweep = Path(file.name), file, sweep  #: path: its file
        with self._name_damages():
            self._structure = read_structure(file)
        self._check(self._structure)

    @contextmanager
    def _name_damages(self) -> Iterator[None]:
        """Raise a DamagedError if the shard cannot be read in the block."""
        try:
            yield
        except (MapError, OSError) as error:
            reason = str(error).removeprefix(f"{self._file.name}: ").partition("; allowed")[0]
            raise DamagedError(self.path, reason) from None

    def _check(self, structure: Structure) -> None:
        """Refuse a file that is not a shard of this sweep, by its attributes, variables and seal."""
        attributes = {name: str(value) for name, value in structure.attributes.items()}
        variables, grid = self._sweep.variables, self._sweep.grid
        for name in (*FACTS, "seal"):
            if name not in attributes:
                raise DamagedError(self.path, f"{name}: is missing")
        for name, value in identity(self._sweep).items():
            if attributes.get(name, "") != value:
                allowed = "shards of this definition and kernels"
                raise ForeignError(self.path, f"{name}: is not that of this sweep", allowed)
        self._facts, self._seal = [attributes[name] for name in FACTS], attributes["seal"]
        try:
            #: first: number of its first point; after: number after its last point; motions: number of motions that
            #: were integrated for its points
            self.first, self.after, self.motions = map(int, self._facts)
        except ValueError:
            raise DamagedError(self.path, "has attributes that are no numbers") from None
        if not 0 <= self.first < self.after <= grid.size:
            raise DamagedError(self.path, "holds points that the sweep has not")
        for name, spec in variables.items():
            if name not in structure.variables:
                raise DamagedError(self.path, f"{name}: is missing")
            variable = structure.variables[name]
            if variable.shape != (self.after - self.first, *self._sweep.shape_at(name)):
                raise DamagedError(self.path, "holds another number of points than it says")
            if not variable.dtype or variable.dtype == "str" or np.dtype(variable.dtype) != np.dtype(spec.dtype):
                raise DamagedError(self.path, f"{name}: is of another type")

    def blocks(self) -> Iterator[dict[str, np.ndarray]]:
        """Yield the columns of its points, block after block.

        Raises:
            DamagedError: at the latest after the last block, if values are not those that were written.
        """
        digest, size = ContentHash(), self.after - self.first
        variables = {name: self._structure.variables[name] for name in self._sweep.variables}
        values = {name: StoredValues(self._file, name, variable) for name, variable in variables.items()}
        for name, spec in self._sweep.variables.items():
            digest.declare(name, (POINT.name, *spec.over), values[name].shape, spec.dtype)
        for low in range(0, size, BLOCK_POINTS):
            extent = slice(low, min(low + BLOCK_POINTS, size))
            box = {name: (extent, *(slice(None) for _ in reader.shape[1:])) for name, reader in values.items()}
            with self._name_damages():
                columns = {name: reader.read(box[name]) for name, reader in values.items()}
            for name, column in columns.items():
                digest.update(name, column)
            yield columns
        if _seal_text(self._facts, digest.hexdigest()) != self._seal:
            raise DamagedError(self.path, "has another checksum than it was written with")
