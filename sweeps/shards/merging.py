"""Merging of shards into a map, a block of points at a time. A map without shards is written as it is measured."""

import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path

from sweeps.points.scattered import PART_POINTS
from sweeps.points.sweep import Grid, Sweep
from sweeps.process.files import remove_leftovers
from sweeps.schema.iteration import runs
from sweeps.shards import contract
from sweeps.shards.mapfile import MapFile, new_file
from sweeps.shards.shard import (
    DamagedError,
    ForeignError,
    MapError,
    Progress,
    measure_blocks,
    open_shard,
    write_shard,
)


def merge_shards(sweep: Sweep, shards: Iterable[str | Path], path: str | Path, threads: int = 1, renew=False) -> str:
    """Write the map of a sweep from its shards, a block at a time, and return its content hash.

    A shard that was cut short or changed on the disk is measured again if its name contains its number (`2-of-7.nc`).

    Args:
        sweep: the sweep.
        shards: the files of `sweeps.shards.shard.write_shard`, in any order, or their folders; together they contain
            each point once.
        path: the map to write.
        threads: number of threads that measure damaged shards again.
        renew: True to measure shards of another definition or kernels, left by an earlier run, again as well.

    Raises:
        MapError: for a file that is no shard of this sweep, and for points that are missing or given twice.
    """
    sources = map(Path, shards)
    files = [file for s in sources for file in (shard_files(s, sweep.shards) if s.is_dir() else [s])]
    for _ in range(len(files) + 1):
        try:
            content_hash = _merge_once(sweep, files, path)
        except DamagedError as damaged:
            position = re.fullmatch(r"(\d+)-of-(\d+)\.nc", damaged.path.name)
            if not position or (isinstance(damaged, ForeignError) and not renew):
                raise
            print(f"{damaged}: measured again", file=sys.stderr)
            write_shard(sweep, int(position[1]), int(position[2]), damaged.path, threads)
        else:
            for file in files:
                remove_leftovers(file)
            return content_hash
    raise MapError(f"{path}: shards are damaged faster than they can be measured; allowed: a disk that keeps them")


def measure_whole(sweep: Sweep, path: str | Path, threads: int = 1, progress: Progress = lambda points: None) -> str:
    """Measure all points of a sweep, write its map without shards, and return its content hash.

    Args:
        sweep: the sweep.
        path: the map to write.
        threads: number of threads.
        progress: called with the number of points of each finished block.
    """
    with _new_map(sweep, path) as file:
        motions = measure_blocks(sweep, range(sweep.grid.size), file.put_columns, threads, progress)
        return _seal_map(file, sweep, motions)


def shard_files(folder: Path, count: int) -> list[Path]:
    """Return the files of `count` shards in a folder."""
    return [folder / f"{k}-of-{count}.nc" for k in range(1, count + 1)]


def _merge_once(sweep: Sweep, paths: Sequence[Path], path: str | Path) -> str:
    """Merge shards in the order of their points into the map at `path`; return its content hash."""
    shards = []
    for source in paths:
        with open_shard(source, sweep) as shard:
            shards.append((shard.first, shard.after, source))
    shards.sort()
    _check_coverage(shards, sweep.grid)
    motions = 0
    with _new_map(sweep, path) as file:
        for first, after, source in shards:
            with open_shard(source, sweep) as shard:  # one open file at a time: there may be thousands
                if (shard.first, shard.after) != (first, after):
                    raise DamagedError(source, "was changed while it was read")
                for columns in shard.blocks():
                    file.put_columns(columns)
                motions += shard.motions
        return _seal_map(file, sweep, motions)


def _check_coverage(shards: Sequence[tuple[int, int, Path]], grid: Grid) -> None:
    """Refuse shards (first point, after last point, file) with gaps or overlaps."""
    next_point = 0
    for first, after, _ in shards:
        if first != next_point:
            problem = "missing" if first > next_point else "given twice"
            low, high = sorted((first, next_point))
            raise MapError(f"shards: points {low} to {high - 1} are {problem}; allowed: each point once")
        next_point = after
    if next_point != grid.size:
        raise MapError(f"shards: points {next_point} to {grid.size - 1} are missing; allowed: each point once")


@contextmanager
def _new_map(sweep: Sweep, path: str | Path) -> Iterator[MapFile]:
    """Yield the file of a map with its coordinates and empty columns."""
    grid, names = sweep.grid, " ".join(sorted(sweep.grid.auxiliary))
    with new_file(path, grid.sizes | grid.extra_sizes) as file:
        file.add_columns(grid.dims, sweep.variables, {"coordinates": names} if names else {})
        coordinates = contract.coordinates(sweep)
        for name, (dims, values, attributes) in coordinates.items():
            file.add(name, dims, values.dtype, attributes)
        box_groups = zip_longest(*(runs(values.shape, PART_POINTS) for _, values, _ in coordinates.values()))
        for boxes in box_groups:  # coordinates of sampled points are drawn together, a group of points at a time
            for (name, (_, values, _)), box in zip(coordinates.items(), boxes, strict=True):
                if box is not None:
                    file.put(name, values[box])
        yield file


def _seal_map(file: MapFile, sweep: Sweep, motions: int) -> str:
    return file.seal(contract.provenance(sweep) | {"history": contract.history(), "motions_integrated": str(motions)})
