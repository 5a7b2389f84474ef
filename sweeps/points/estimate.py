"""Predicted points, files, memory, disk and time of a sweep, from its definition; and its impossible points."""

import math
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil

from sweeps.points import compile_kernels
from sweeps.points.scattered import POINT
from sweeps.points.sweep import Grid, Sweep
from sweeps.schema.refusals import DefinitionError

BLOCK_POINTS = 2**17  # measured at once
BLOCKS_BEGUN = 2  # measured at once, so that no thread waits for the end of one
BLOCKS = 2 * BLOCKS_BEGUN + 2  # blocks in memory: points and columns of each begun one, one joined, one written
PROCESS_BYTES = 400_000_000  # interpreter, compiled kernels and libraries
VARIABLE_BYTES = 6_000  # attributes and index of chunks of one variable in a netCDF file
FILE_BYTES = 30_000  # headers of a netCDF file without variables
MAX_COUNTED_BODIES = 2**22  # number of bodies up to which each is checked; of more, a sample of this size
SEED = 1
PAGE_BYTES = 10_000_000  # report and pictures together, at most about

# On one core of a machine of 2024 with its files at hand, s.
MEASURE_SECONDS = 0.5  # time for opening shards and map
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
    compile_seconds: float  #: time for compiling the kernels that are not compiled yet on this machine, s
    wait_seconds: float  #: time until map, pictures and report exist, on one core, compiling included, s

    def __str__(self):
        return f"about {format_duration(self.wait_seconds)} on one core, up to {in_words(self.disk_bytes)} of disk"


def estimate_needs(sweep: Sweep) -> Estimate:
    """Estimate memory, disk and time of `sweep` without making its grid."""
    definition, system, grid = sweep.definition, sweep.system, sweep.grid
    bytes_per_point = _bytes_per_point(sweep)
    num_rows = grid.point_rows.num if grid.point_rows else 0
    coordinates = 8 * (sum(grid.shape) - num_rows)
    lazy_bytes = 8 * (num_rows + sum(v.size for _, v in grid.auxiliary.values()))  # made a part at a time
    headers = FILE_BYTES + VARIABLE_BYTES * len(sweep.variables | system.coordinates(definition))
    seconds = integration_seconds(sweep, grid.size)
    compile_time = compile_kernels.compile_seconds(sweep)
    working_bytes = system.cost(definition).working_bytes
    return Estimate(
        points=grid.size,
        shards=sweep.shards,
        memory_bytes=PROCESS_BYTES
        + BLOCKS * min(grid.size, BLOCK_POINTS) * bytes_per_point
        + coordinates
        + working_bytes,
        working_bytes=working_bytes,
        disk_bytes=2 * (grid.size * bytes_per_point + coordinates) + lazy_bytes + (sweep.shards + 1) * headers,
        seconds=seconds,
        compile_seconds=compile_time,
        wait_seconds=compile_time
        + system.start_seconds
        + MEASURE_SECONDS
        + MEASURE_FACTOR * seconds
        + system.point_seconds * grid.size
        + system.picture_seconds
        + REPORT_SECONDS
        + REPORT_SECONDS_PER_POINT * grid.size,
    )


def format_duration(seconds: float) -> str:
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


def refuse_if_too_large(sweep: Sweep, needs: Estimate, results_dir: str | Path) -> None:
    """Refuse a sweep if its `needs` exceed the memory of this machine or the free disk at `results_dir`."""
    if lines := list_shortages(sweep, needs, results_dir):
        raise DefinitionError("\n".join(lines))


def list_shortages(sweep: Sweep, needs: Estimate, results_dir: str | Path) -> list[str]:
    """Return one line for each of memory and disk (at `results_dir`) that is too small for the `needs` of `sweep`."""
    folder = Path(results_dir).absolute()
    parent_folder = next(parent for parent in (folder, *folder.parents) if parent.exists())
    disk = "disk", needs.disk_bytes, shutil.disk_usage(parent_folder).free
    limits = disk, ("memory", needs.memory_bytes, psutil.virtual_memory().available)
    lines = []
    for resource, size, free in (limit for limit in limits if limit[1] > limit[2]):
        mostly = resource == "memory" and 2 * needs.working_bytes > size
        demand = "samples or draws of the points in work" if mostly else f"grid: {needs.points:,} points"
        allowed = f"{in_words(free)}, what is free here"
        lines.append(f"{sweep.name}: {demand} need {in_words(size)} of {resource}; allowed: {allowed}")
    return lines


def in_words(size: int) -> str:
    """Return a number of bytes in words: "2.5 GB (2,500,000,000 bytes)"."""
    exact = f"{size:,} bytes"
    for power, unit in ((18, "EB"), (15, "PB"), (12, "TB"), (9, "GB"), (6, "MB"), (3, "kB")):
        if size >= 10**power:
            return f"{size / 10**power:,.3g} {unit} ({exact})"
    return exact


# -- points that are physically impossible


def count_impossible(sweep: Sweep) -> tuple[int, bool]:
    """Return the number of points of a sweep that cannot exist, and False if it is estimated from a sample."""
    grid, system = sweep.grid, sweep.system
    free_names = [name for name in system.existence if name not in grid.derived_parameters.names]
    if any(name in grid.derived_parameters.names for name in system.existence):
        free_names = list(dict.fromkeys((*free_names, *grid.derived_parameters.needed_names)))
    along = {name: (name if name in grid.dims else grid.auxiliary[name][0][0]) for name in free_names}
    sizes = {dim: grid.shape[grid.dims.index(dim)] for dim in dict.fromkeys(along.values())}
    bodies = math.prod(sizes.values())
    if not along:
        return 0, True
    if bodies <= MAX_COUNTED_BODIES:
        counts = np.indices(tuple(sizes.values()), sparse=True)
        numbers = dict(zip(sizes, counts, strict=True))
    elif POINT in sizes:  # the first points that are drawn, which are spread as all are
        numbers = {dim: np.arange(MAX_COUNTED_BODIES) % size for dim, size in sizes.items()}
    else:
        rng = np.random.default_rng(SEED)
        numbers = {dim: rng.integers(0, size, MAX_COUNTED_BODIES) for dim, size in sizes.items()}
    values = {name: _values_at(grid, name, numbers[dim]) for name, dim in along.items()}
    mask = system.impossible(values | grid.derived_parameters.at(values) if grid.derived_parameters.names else values)
    if bodies > MAX_COUNTED_BODIES:
        return round(float(np.mean(mask)) * grid.size), False
    return int(np.count_nonzero(mask)) * (grid.size // mask.size), True


def _values_at(grid: Grid, name: str, numbers: np.ndarray) -> np.ndarray:
    """Return the values of one argument at points by their numbers in a grid, table or list of bodies."""
    if name in grid.dims:
        return grid.values(name, numbers)
    if grid.point_rows and name in grid.point_rows.names:
        return grid.point_rows.rows(0, int(numbers.max()) + 1)[name][numbers]
    return grid.auxiliary[name][1][numbers]
