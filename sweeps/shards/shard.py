"""Shards: runs of a sweep's points, each measured and written as a whole file.

A shard is a netCDF-4 file with the columns of its own points, along the dimension `point`. It states which points those
are, of which definition and which kernels, and a hash of all of this. So what was cut short or changed on the disk is
found before it reaches a map.
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

FACTS = (
    "first_point",
    "point_after_last",
    "motions_integrated",
)  # text: a grid may have more than 2^63 points
PART_SECONDS = 1.0  # estimated time of a part that a thread measures; an interrupt waits for its end


class DamagedError(MapError):
    """A shard that was cut short or changed on the disk."""

    def __init__(self, path: str | Path, what: str, allowed: str = "a whole file of `polhode shard`"):
        super().__init__(f"{path}: {what}; allowed: {allowed}")
        self.path = Path(path)


class ForeignError(DamagedError):
    """A shard of another definition, or of other kernels."""


def extra_sizes(sweep: Sweep) -> dict[str, int]:
    """Return name → length of the dimensions of its variables other than those of the points."""
    return {dim: values.size for dim, values in sweep.grid.extra_dimensions.items()}


def _seal_of(stated: Iterable[str], content_hash: str) -> str:
    """Return one hash of the values of a shard and of what it states of them."""
    return hashlib.sha256("\0".join((*stated, content_hash)).encode()).hexdigest()


# -- writing

Progress = Callable[[int], None]
Put = Callable[[Mapping[str, np.ndarray]], None]


def write_shard(
    sweep: Sweep, number: int, count: int, path: str | Path, threads: int = 1, progress: Progress = lambda points: None
) -> None:
    """Measure shard `number` (from 1) of `count` and write it to `path`, each block while the next is measured."""
    start, stop = sweep.grid.shard_bounds(count)[number - 1]
    with new_file(path, {POINT.name: stop - start} | extra_sizes(sweep), flush=False) as file:
        file.add_columns([POINT.name], sweep.variables)
        motions = measure(sweep, range(start, stop), file.put_columns, threads, progress)
        stated = dict(zip(FACTS, map(str, (start, stop, motions)), strict=True))
        origin = {name: text for name, text in identity(sweep).items() if text}
        file.seal(origin | stated | {"seal": _seal_of(stated.values(), file.digest.hexdigest())})


def measure(sweep: Sweep, points: range, put: Put, threads: int = 1, progress: Progress = lambda points: None) -> int:
    """Measure points block by block, store each block while the next is measured, and return the number of motions.

    `put` is called with the columns of each block, `progress` with the number of its points after it.
    """
    machine.keep_freed()
    motions = 0
    with open_pool(threads) as pool:
        for size, integrated, columns in _measure_blocks(sweep, points, pool, threads):
            motions += integrated
            put(columns())
            progress(size)
    return motions


def _measure_blocks(
    sweep: Sweep, points: range, pool: ThreadPoolExecutor, threads: int
) -> Iterator[tuple[int, int, Callable[[], dict]]]:
    """Yield (number of points, of motions, wait) for each block, and start measuring the next block before yielding."""
    waiting = deque()
    for low in range(points.start, points.stop, BLOCK_POINTS):
        size = min(BLOCK_POINTS, points.stop - low)
        values = sweep.grid.points(low, low + size)
        motions = sweep.system.motions(values, sweep.definition.integration)
        parts = max(threads, ceil(integration_seconds(sweep, size) / PART_SECONDS))
        waiting.append((size, motions, submit_points(values, sweep, pool, parts)))
        if len(waiting) == BLOCKS_BEGUN:
            yield waiting.popleft()
    yield from waiting


# -- reading


def holds_shard(path: str | Path, sweep: Sweep, number: int, count: int) -> bool:
    """Return True if a file holds shard `number` of `count` of a sweep, as these kernels measure it."""
    try:
        with open_shard(path, sweep) as shard:
            return (shard.first, shard.after) == sweep.grid.shard_bounds(count)[number - 1]
    except MapError:
        return False


@contextmanager
def open_shard(path: str | Path, sweep: Sweep) -> Iterator["Shard"]:
    """Yield a shard; raise a MapError where there is no such file, or no shard of this sweep."""
    try:
        file = FileBytes(path)
    except (OSError, ValueError):
        raise MapError(f"{path}: there is no such file; allowed: a file of `polhode shard`") from None
    with file:
        yield Shard(file, sweep)


class Shard:
    """An open shard."""

    def __init__(self, file: FileBytes, sweep: Sweep):
        self.path, self._file, self._sweep = Path(file.name), file, sweep  #: path: its file
        with self._damages_named():
            self._held = read_structure(file)
        self._check(self._held)

    @contextmanager
    def _damages_named(self) -> Iterator[None]:
        """Report this shard as damaged where it cannot be read in the block."""
        try:
            yield
        except (MapError, OSError) as error:
            reason = str(error).removeprefix(f"{self._file.name}: ").partition("; allowed")[0]
            raise DamagedError(self.path, reason) from None

    def _check(self, held: Structure) -> None:
        stated = {name: str(value) for name, value in held.attributes.items()}
        variables, grid = self._sweep.variables, self._sweep.grid
        for name in (*FACTS, "seal"):
            if name not in stated:
                raise DamagedError(self.path, f"{name}: is missing")
        for name, value in identity(self._sweep).items():
            if stated.get(name, "") != value:
                allowed = "shards of this definition and kernels"
                raise ForeignError(self.path, f"{name}: is not that of this sweep", allowed)
        self._stated, self._sealed = [stated[name] for name in FACTS], stated["seal"]
        try:
            #: first: number of its first point; after: number after its last point; motions: how many motions were
            #: integrated for its points
            self.first, self.after, self.motions = map(int, self._stated)
        except ValueError:
            raise DamagedError(self.path, "has attributes that are no numbers") from None
        if not 0 <= self.first < self.after <= grid.size:
            raise DamagedError(self.path, "holds points that the sweep has not")
        for name, spec in variables.items():
            if name not in held.variables:
                raise DamagedError(self.path, f"{name}: is missing")
            one = held.variables[name]
            if one.shape != (self.after - self.first, *self._sweep.shape_at(name)):
                raise DamagedError(self.path, "holds another number of points than it says")
            if not one.dtype or one.dtype == "str" or np.dtype(one.dtype) != np.dtype(spec.dtype):
                raise DamagedError(self.path, f"{name}: is of another type")

    def blocks(self) -> Iterator[dict[str, np.ndarray]]:
        """Yield the columns of its points, block after block.

        Raises:
            DamagedError: at the latest behind the last block, where values are not those that were written.
        """
        digest, size = ContentHash(), self.after - self.first
        held = {name: self._held.variables[name] for name in self._sweep.variables}
        values = {name: StoredValues(self._file, name, one) for name, one in held.items()}
        for name, spec in self._sweep.variables.items():
            digest.declare(name, (POINT.name, *spec.over), values[name].shape, spec.dtype)
        for low in range(0, size, BLOCK_POINTS):
            part = slice(low, min(low + BLOCK_POINTS, size))
            box = {name: (part, *(slice(None) for _ in one.shape[1:])) for name, one in values.items()}
            with self._damages_named():
                columns = {name: one.read(box[name]) for name, one in values.items()}
            for name, column in columns.items():
                digest.update(name, column)
            yield columns
        if _seal_of(self._stated, digest.hexdigest()) != self._sealed:
            raise DamagedError(self.path, "has another checksum than it was written with")
