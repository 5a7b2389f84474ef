"""Shards → map: chunks are copied as they lie in the files, and only those that two shards share are put together.

A map that is not cut into shards is written as it is measured.
"""

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import zip_longest
from pathlib import Path

import h5py
import netCDF4
import numpy as np

from sweeps.points.grid import Grid
from sweeps.points.scattered import PART_POINTS
from sweeps.points.sweep import Sweep
from sweeps.process.files import remove_leftovers
from sweeps.schema.boxes import runs
from sweeps.shards import contract
from sweeps.shards.chunkfile import ChunkFile, define, written
from sweeps.shards.content import ContentHash
from sweeps.shards.shard import (
    DamagedError,
    ForeignError,
    MapError,
    Piece,
    Shard,
    chunks_of,
    further,
    measure,
    pieces,
    write_shard,
)


def merge(sweep: Sweep, shards: Iterable[str | Path], path: str | Path, threads: int = 1, renew: bool = False) -> str:
    """Write the map of a sweep from its shards, one chunk at a time, and return its content hash.

    A shard that was cut short or changed on the disk is measured again, where its name says which it is
    (`2-of-7.nc`).

    Args:
        sweep: the sweep.
        shards: the files of `sweeps.shards.shard.write_shard`, in any order; together they hold each point
            once. A folder stands for the files 1-of-n.nc to n-of-n.nc in it, n the number that the sweep is cut into.
        path: the map to write.
        threads: threads for what is measured again.
        renew: whether shards of another definition or other kernels are measured again as well: what a run that was
            killed left behind before an edit.

    Returns:
        The map's content hash.

    Raises:
        MapError: for a file that is no shard of this sweep, and for points that are missing or given twice.
    """
    shards = [file for shard in shards for file in _files(Path(shard), sweep)]
    for _ in range(len(shards) + 1):
        try:
            told = _merge_once(sweep, shards, path)
        except DamagedError as damaged:
            position = re.fullmatch(r"(\d+)-of-(\d+)\.nc", damaged.path.name)
            if not position or (isinstance(damaged, ForeignError) and not renew):
                raise
            print(f"{damaged}: measured again", file=sys.stderr)
            write_shard(sweep, *map(int, position.groups()), damaged.path, threads)
        else:
            for shard in shards:
                remove_leftovers(shard)
            return told
    raise MapError(f"{path}: shards are damaged faster than they can be measured; allowed: a disk that keeps them")


def measure_whole(
    sweep: Sweep, path: str | Path, threads: int = 1, progress: Callable[[int], None] = lambda points: None
) -> str:
    """Measure all points of a sweep, write its map without shards, and return its content hash.

    Args:
        sweep: the sweep.
        path: the map to write.
        threads: threads for the kernel.
        progress: called with the number of points after each block.
    """

    def fill(file: ChunkFile, digest: ContentHash) -> int:
        def put(_: int, piece: Piece, columns: Mapping[str, np.ndarray]) -> None:
            for name, values in columns.items():
                file.put(name, piece.chunk, file.encode(name, piece.chunk, piece.first, values))
                digest.update(name, values)

        return measure(sweep, pieces(file.chunks, 0, sweep.grid.size), put, threads, progress)

    return _filled(sweep, path, fill)


def _files(path: Path, sweep: Sweep) -> list[Path]:
    if not path.is_dir():
        return [path]
    return [path / f"{k}-of-{sweep.shards}.nc" for k in range(1, sweep.shards + 1)]


def _merge_once(sweep: Sweep, paths: Sequence[Path], path: str | Path) -> str:
    shards = []
    for source in paths:
        with Shard(source, sweep) as shard:
            shards.append((shard.first, shard.after, source))
    shards.sort()
    _check_coverage(shards, sweep.grid)

    def fill(file: ChunkFile, digest: ContentHash) -> int:
        target, motions = _Target(file, digest, not sweep.grid.further), 0
        for first, after, source in shards:
            with Shard(source, sweep) as shard:  # one open file at a time: there may be thousands
                if (shard.first, shard.after) != (first, after):
                    raise DamagedError(source, "was changed while it was read")
                motions += shard.motions
                target.take(shard)
        return motions

    return _filled(sweep, path, fill)


def _filled(sweep: Sweep, path: str | Path, fill: Callable[[ChunkFile, ContentHash], int]) -> str:
    """Writes a map whose chunks `fill` puts into it and hashes, saying how many motions they took; its content hash."""
    with written(path) as temporary:
        digest = _create(temporary, sweep)
        with h5py.File(temporary, "r+") as hdf:
            motions = fill(ChunkFile(hdf, sweep.variables, chunks_of(sweep)), digest)
        with netCDF4.Dataset(temporary, "a") as whole:  # hashes only a whole map has
            whole.motions_integrated = str(motions)
            digest.seal(whole)
    return digest.hexdigest()


def _check_coverage(shards: Sequence[tuple[int, int, Path]], grid: Grid) -> None:
    covered = 0
    for first, after, _ in shards:
        if first != covered:
            what = "missing" if first > covered else "given twice"
            low, high = sorted((first, covered))
            raise MapError(f"shards: points {low} to {high - 1} are {what}; allowed: each point once")
        covered = after
    if covered != grid.size:
        raise MapError(f"shards: points {covered} to {grid.size - 1} are missing; allowed: each point once")


def _create(path: Path, sweep: Sweep) -> ContentHash:
    """Makes the file of a map: dimensions, variables and attributes, and the values of its coordinates."""
    grid, variables = sweep.grid, sweep.variables
    beside = " ".join(sorted(grid.auxiliary))
    digest = ContentHash()
    with netCDF4.Dataset(path, "w", format="NETCDF4") as file:
        define(
            file,
            dict(zip(grid.dims, grid.shape, strict=True)),
            variables,
            {"coordinates": beside} if beside else {},
            further(sweep),
        )
        coordinates = contract.coordinates(sweep)
        for name, (dims, values, attributes) in coordinates.items():
            kind = str if values.dtype.kind == "U" else values.dtype
            file.createVariable(name, kind, dims, fill_value=False).setncatts(attributes)
            digest.declare(name, dims, values.shape, values.dtype)
        parts = zip_longest(*(runs(values.shape, PART_POINTS) for _, values, _ in coordinates.values()))
        for boxes in parts:  # of a part of the points all of their own coordinates, which come together
            for (name, (_, values, _)), box in zip(coordinates.items(), boxes, strict=True):
                if box is not None:
                    part = values[box]
                    file[name][box] = part.astype(object) if part.dtype.kind == "U" else part
                    digest.update(name, part)
        for spec in variables.values():
            shape = (*grid.shape, *sweep.shape_at(spec.name))
            digest.declare(spec.name, (*grid.dims, *spec.over), shape, spec.dtype)
        file.setncatts(contract.provenance(sweep) | {"history": contract.history()})
    return digest


def _ahead(items: Iterator) -> Iterator:
    """The same, the next one made in a thread while one is used."""
    with ThreadPoolExecutor(1) as pool:
        pending = pool.submit(next, items, None)
        while (item := pending.result()) is not None:
            pending = pool.submit(next, items, None)
            yield item


class _Target:
    """The chunks of a map that is being written, and the hash of what they hold.

    Where variables have further dimensions, chunks are not the runs that the content hash is made of (`hashed_whole`
    is False): their values are hashed again.
    """

    def __init__(self, file: ChunkFile, digest: ContentHash, hashed_whole: bool = True):
        self._file, self._digest, self._hashed_whole = file, digest, hashed_whole
        self._parts: dict[str, list[np.ndarray]] = {}  # of the chunk that the last shard ended in
        self._begun = 0

    def take(self, shard: Shard) -> None:
        for piece, stored in _ahead(shard.pieces()):
            if piece.whole and self._hashed_whole:
                hashes = shard.digests(piece)
                for name, chunk in stored.items():
                    self._file.put(name, piece.chunk, chunk)
                    self._digest.add_run(name, hashes[name])
            else:
                self._gather(piece, stored)

    def _gather(self, piece: Piece, stored: dict[str, bytes]) -> None:
        if not self._parts:
            self._begun = piece.first
        for name, chunk in stored.items():
            values = self._file.decode(name, piece.chunk, piece.first, piece.after, chunk)
            self._digest.update(name, values)
            self._parts.setdefault(name, []).append(values)
        if piece.after == self._file.chunks.bounds(piece.chunk)[1]:
            for name, parts in self._parts.items():
                values = np.concatenate(parts)
                self._file.put(name, piece.chunk, self._file.encode(name, piece.chunk, self._begun, values))
            self._parts = {}
