"""Predicted points, files, memory, disk and time of a sweep, from its definition; and its impossible points."""

import math
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil

from sweeps.points import compile
from sweeps.points.scattered import POINT
from sweeps.points.sweep import Grid, Sweep
from sweeps.schema.refusals import DefinitionError

BLOCK_POINTS = 2**17  # measured at once
BLOCKS_BEGUN = 2  # measured at once, so that no thread waits for the end of one
BLOCKS = 2 * BLOCKS_BEGUN + 2  # in memory: what these are measured from and into, what is joined, and what is written
PROCESS_BYTES = 400_000_000  # interpreter, compiled kernels and libraries
VARIABLE_BYTES = 6_000  # of a netCDF file, for each variable: its attributes, its chunks' index
FILE_BYTES = 30_000  # of a netCDF file besides
MOST = 2**22  # bodies that are counted one by one; of more, so many are drawn
SEED = 1
PAGE_BYTES = 10_000_000  # report and pictures together, at most about

# On one core of a machine of 2024 with its files at hand, s.
MEASURE_SECONDS = 0.5  # to open shards and map
MEASURE_FACTOR = 1.5  # writing, hashing and merging take about half as long as the integration itself
REPORT_SECONDS = 0.6
REPORT_SECONDS_PER_POINT = 1e-6


@dataclass(frozen=True)
class Estimate:
    """The points, files, memory, disk and time that a sweep needs."""

    points: int  #: number of grid points
    shards: int  #: number of files the work is cut into
    memory_bytes: int  #: memory of one process, bytes
    working_bytes: int  #: as much of it as samples or draws take while points are measured
    disk_bytes: int  #: disk for shards and map, which exist at the same time, uncompressed, bytes
    seconds: float  #: integration time on one core, s
    compile_seconds: float  #: time for compiling what is not compiled yet on this machine, s
    wait_seconds: float  #: what a person waits for map, pictures and report on one core, all of the above included, s

    def __str__(self):
        return f"about {span(self.wait_seconds)} on one core, up to {in_words(self.disk_bytes)} of disk"


def estimate(sweep: Sweep) -> Estimate:
    """Estimate memory, disk and time of `sweep` without making its grid."""
    definition, system, grid = sweep.definition, sweep.system, sweep.grid
    bytes_per_point = _bytes_per_point(sweep)
    scattered = grid.scattered.num if grid.scattered else 0
    coordinates = 8 * (sum(grid.shape) - scattered)
    beside = 8 * (scattered + sum(v.size for _, v in grid.auxiliary.values()))  # made a part at a time
    headers = FILE_BYTES + VARIABLE_BYTES * len(sweep.variables | system.coordinates(definition))
    seconds = integration_seconds(sweep, grid.size)
    compiling = compile.seconds(sweep)
    working = system.cost(definition).working_bytes
    return Estimate(
        points=grid.size,
        shards=sweep.shards,
        memory_bytes=PROCESS_BYTES + BLOCKS * min(grid.size, BLOCK_POINTS) * bytes_per_point + coordinates + working,
        working_bytes=working,
        disk_bytes=2 * (grid.size * bytes_per_point + coordinates) + beside + (sweep.shards + 1) * headers,
        seconds=seconds,
        compile_seconds=compiling,
        wait_seconds=compiling
        + system.start_seconds
        + MEASURE_SECONDS
        + MEASURE_FACTOR * seconds
        + system.point_seconds * grid.size
        + system.picture_seconds
        + REPORT_SECONDS
        + REPORT_SECONDS_PER_POINT * grid.size,
    )


def span(seconds: float) -> str:
    """Return a time to wait: "9 s", "3 min", "5 h", "2e+07 years"."""
    for size, unit in ((3.156e7, "years"), (86_400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2 * size:
            return f"{seconds / size:,.2g} {unit}" if seconds < 100 * size else f"{seconds / size:,.3g} {unit}"
    return f"{seconds:.2g} s"


def integration_seconds(sweep: Sweep, points: int) -> float:
    """Return an estimate of the time, s, in which one core integrates the motions of so many points."""
    return points * sweep.system.cost(sweep.definition).samples / sweep.system.samples_per_second


def _bytes_per_point(sweep: Sweep) -> int:
    return sum(np.dtype(v.dtype).itemsize * math.prod(sweep.shape_at(name)) for name, v in sweep.variables.items())


def refuse_if_too_large(sweep: Sweep, needed: Estimate, results_dir: str | Path) -> None:
    """Refuse a sweep that needs more disk or memory than this machine has."""
    if lines := lacking(sweep, needed, results_dir):
        raise DefinitionError("\n".join(lines))


def lacking(sweep: Sweep, needed: Estimate, results_dir: str | Path) -> list[str]:
    """Return one line for each resource of this machine that is too small for `sweep`, which takes `needed`."""
    folder = Path(results_dir).absolute()
    existing = next(parent for parent in (folder, *folder.parents) if parent.exists())
    disk = "disk", needed.disk_bytes, shutil.disk_usage(existing).free
    limits = disk, ("memory", needed.memory_bytes, psutil.virtual_memory().available)
    lines = []
    for what, size, free in (limit for limit in limits if limit[1] > limit[2]):
        mostly = what == "memory" and 2 * needed.working_bytes > size
        wrong = "samples or draws of the points in work" if mostly else f"grid: {needed.points:,} points"
        allowed = f"{in_words(free)}, what is free here"
        lines.append(f"{sweep.name}: {wrong} need {in_words(size)} of {what}; allowed: {allowed}")
    return lines


def in_words(size: int) -> str:
    """Return a number of bytes in words: "2.5 GB (2,500,000,000 bytes)"."""
    exact = f"{size:,} bytes"
    for power, unit in ((18, "EB"), (15, "PB"), (12, "TB"), (9, "GB"), (6, "MB"), (3, "kB")):
        if size >= 10**power:
            return f"{size / 10**power:,.3g} {unit} ({exact})"
    return exact


# -- points that are physically impossible


def impossible(sweep: Sweep) -> tuple[int, bool]:
    """Return how many points of a sweep cannot exist, and whether that is counted (True) or estimated from a sample."""
    grid, system = sweep.grid, sweep.system
    given = [name for name in system.existence if name not in grid.following.names]
    if any(name in grid.following.names for name in system.existence):
        given = list(dict.fromkeys((*given, *grid.following.needed)))
    along = {name: (name if name in grid.dims else grid.auxiliary[name][0][0]) for name in given}
    sizes = {dim: grid.shape[grid.dims.index(dim)] for dim in dict.fromkeys(along.values())}
    bodies = math.prod(sizes.values())
    if not along:
        return 0, True
    if bodies <= MOST:
        counts = np.indices(tuple(sizes.values()), sparse=True)
        numbers = dict(zip(sizes, counts, strict=True))
    elif POINT in sizes:  # the first points that are drawn, which are spread as all are
        numbers = {dim: np.arange(MOST) % size for dim, size in sizes.items()}
    else:
        rng = np.random.default_rng(SEED)
        numbers = {dim: rng.integers(0, size, MOST) for dim, size in sizes.items()}
    values = {name: _values(grid, name, numbers[dim]) for name, dim in along.items()}
    mask = system.impossible(values | grid.following.at(values) if grid.following.names else values)
    if bodies > MOST:
        return round(float(np.mean(mask)) * grid.size), False
    return int(np.count_nonzero(mask)) * (grid.size // mask.size), True


def _values(grid: Grid, name: str, numbers: np.ndarray) -> np.ndarray:
    if name in grid.dims:
        return grid.values(name, numbers)
    if grid.scattered and name in grid.scattered.names:
        return grid.scattered.rows(0, int(numbers.max()) + 1)[name][numbers]
    return grid.auxiliary[name][1][numbers]
