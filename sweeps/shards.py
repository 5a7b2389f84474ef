"""Shards: runs of a sweep's points, each measured and written as a whole file of columns.

A shard says which points it holds, of which definition and which kernels, and a checksum of each column, so that what
was cut short or changed on the disk is found before it reaches a map.
"""

import errno
import json
import os
import zlib
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import netCDF4
import numpy as np

from sweeps import dataset, systems
from sweeps.content import as_bytes
from sweeps.definition import Definition
from sweeps.estimate import READ_POINTS
from sweeps.files import replaced
from sweeps.grid import Grid
from sweeps.refusals import RefusedError

BLOCK_POINTS = 2**17  # measured at once
CHUNK_POINTS = 2**16
# nearly as fast as memory and half the bytes, for a file that the merge alone will read
CACHE_BYTES = 2**21  # of each variable: points are written and read once, in order
QUICK = {"compression": "blosc_lz4", "blosc_shuffle": 1, "complevel": 5}


class MapError(RefusedError):
    """What is wrong with a file that should be a map or a shard; `str()` is the message for a person."""


class DamagedError(MapError):
    """A shard that was cut short or changed on the disk.

    Attributes:
        path: the shard's file.
    """

    def __init__(self, path: str | Path, what: str):
        super().__init__(f"{path}: {what}; allowed: a whole file of `python -m sweeps shard`")
        self.path = Path(path)


class ForeignError(DamagedError):
    """A shard of another definition, or of other kernels."""

    def __init__(self, path: str | Path, name: str):
        MapError.__init__(
            self, f"{path}: {name}: is not that of this sweep; allowed: shards of this definition and kernels"
        )
        self.path = Path(path)


@contextmanager
def written(path: str | Path, flush: bool = True) -> Iterator[netCDF4.Dataset]:
    """A netCDF-4 file to fill, which takes its place once it is whole (see `sweeps.files.replaced`).

    Raises:
        OSError: where the disk is full or fails, with the system's reason: netCDF itself says "HDF error".
    """
    with replaced(path, flush) as temporary:
        try:
            with netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
                yield file
        except RuntimeError as error:
            raise _reason(temporary, path, error) from None


def _reason(temporary: Path, path: str | Path, error: RuntimeError) -> OSError:
    """Why netCDF could not write: what the system says to a further mebibyte."""
    try:
        handle = os.open(temporary, os.O_WRONLY)
        try:
            os.posix_fallocate(handle, temporary.stat().st_size, 2**20)
        finally:
            os.close(handle)
    except OSError as said:
        return OSError(said.errno, said.strerror, str(path))
    return OSError(errno.EIO, f"cannot be written ({error})", str(path))


def write_shard(
    definition: Definition,
    number: int,
    count: int,
    path: str | Path,
    threads: int = 1,
    progress: Callable[[int], None] = lambda points: None,
) -> None:
    """Measures shard `number` (from 1) of `count` and writes it to `path`; one block is written as the next computes.

    Args:
        definition: the sweep.
        number: which shard, 1 to count.
        count: into how many the sweep is cut; it changes no value.
        path: the file to write.
        threads: threads for the kernel.
        progress: called with the number of points after each block.
    """
    grid = Grid(definition)
    start, stop = grid.shard_bounds(count)[number - 1]
    checksums, motions = {}, 0
    with written(path, flush=False) as file:
        _create(file, definition, start, stop)
        with ThreadPoolExecutor(1) as writer:
            pending = None
            for low in range(start, stop, BLOCK_POINTS):
                columns, integrated = _measure(definition, grid, low, min(low + BLOCK_POINTS, stop), threads)
                motions += integrated
                if pending:
                    progress(pending.result())
                pending = writer.submit(_write, file, low - start, columns, checksums)
            progress(pending.result())
        file.checksums = json.dumps(checksums)
        file.motions_integrated = str(motions)


def _create(file: netCDF4.Dataset, definition: Definition, start: int, stop: int) -> None:
    file.createDimension("point", stop - start)
    large = stop - start >= CHUNK_POINTS  # the filter complains of what is too short to get shorter
    packing = dict(QUICK) if large and file.has_blosc_filter() else {}
    packing |= {"chunksizes": (min(stop - start, CHUNK_POINTS),), "chunk_cache": CACHE_BYTES}
    for variable in systems.resolve(definition.system).variables(definition).values():
        file.createVariable(variable.name, variable.dtype, ("point",), fill_value=False, **packing)
    file.setncatts(
        {
            "first_point": str(start),  # as text: a grid may have more points than an attribute's integer
            "point_after_last": str(stop),
            **identity(definition),
        }
    )


def identity(definition: Definition) -> dict[str, str]:
    """Attributes that say of which definition, files beside it and kernels a shard or a map is."""
    kernels = systems.resolve(definition.system).fingerprint()
    return {"definition": definition.text, "inputs": definition.inputs, "kernel_fingerprint": kernels}


def holds_shard(path: str | Path, definition: Definition, number: int, count: int) -> bool:
    """Whether a file holds shard `number` of `count` of a definition, as these kernels measure it."""
    try:
        with Shard(path, definition) as shard:
            return (shard.first, shard.after) == Grid(definition).shard_bounds(count)[number - 1]
    except MapError:
        return False


def _measure(definition: Definition, grid: Grid, low: int, high: int, threads: int) -> tuple[dict, int]:
    points = dataset.point_coordinates(grid, low, high)
    block = dataset.evaluate(points, definition, threads)
    arrays = {name: array.values for name, array in points.items()}
    motions = systems.resolve(definition.system).motions(arrays, definition.integration)
    return {name: variable.values for name, variable in block.data_vars.items()}, motions


def _write(file: netCDF4.Dataset, at: int, columns: Mapping[str, np.ndarray], checksums: dict[str, int]) -> int:
    for name, values in columns.items():
        file[name][at : at + values.size] = values
        checksums[name] = zlib.crc32(as_bytes(values), checksums.get(name, 0))
    return values.size


class Shard:
    """An open shard; use it as a context.

    Attributes:
        path: its file.
        first: number of its first point.
        after: number after its last point.
        motions: how many motions were integrated for its points.
    """

    def __init__(self, path: str | Path, definition: Definition):
        self.path = Path(path)
        if not self.path.is_file():
            raise MapError(f"{path}: there is no such file; allowed: a file of `python -m sweeps shard`")
        try:
            self._file = netCDF4.Dataset(self.path)
        except (OSError, RuntimeError) as error:
            raise DamagedError(path, f"cannot be read as netCDF ({error})") from None
        self._file.set_auto_maskandscale(False)
        for variable in self._file.variables.values():
            variable.set_var_chunk_cache(CACHE_BYTES)
        try:
            self._check(definition)
        except MapError:
            self.close()
            raise

    def _check(self, definition: Definition) -> None:
        held = {name: self._file.getncattr(name) for name in self._file.ncattrs()}
        wanted = identity(definition)
        for name, value in wanted.items():
            if name in held and held[name] != value:
                raise ForeignError(self.path, name)
        names = systems.resolve(definition.system).variables(definition)
        needed = ("first_point", "point_after_last", "checksums", "motions_integrated", *wanted, *names)
        missing = [name for name in needed if name not in held and name not in self._file.variables]
        if missing:
            raise DamagedError(self.path, f"{missing[0]}: is missing")
        try:
            self.first, self.after, self.motions = (int(held[n]) for n in (needed[0], needed[1], needed[3]))
            self._checksums = json.loads(held["checksums"])
        except ValueError:
            raise DamagedError(self.path, "has attributes that are no numbers") from None
        if any(self._file[name].shape != (self.after - self.first,) for name in names):
            raise DamagedError(self.path, "holds another number of points than it says")

    def blocks(self) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
        """(Number of the first point, columns) of one block of points after the other.

        Raises:
            DamagedError: after the last block, where a column's checksum is another.
        """
        found = {}
        for low in range(self.first, self.after, READ_POINTS):
            at, end = low - self.first, min(low + READ_POINTS, self.after) - self.first
            try:
                columns = {name: self._file[name][at:end] for name in self._file.variables}
            except (OSError, RuntimeError) as error:
                raise DamagedError(self.path, f"cannot be read ({error})") from None
            for name, values in columns.items():
                found[name] = zlib.crc32(as_bytes(values), found.get(name, 0))
            yield low, columns
        for name, checksum in found.items():
            if checksum != self._checksums.get(name):
                raise DamagedError(self.path, f"{name}: has another checksum than it was written with")

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    def __enter__(self):
        return self

    def __exit__(self, *failure):
        self.close()
