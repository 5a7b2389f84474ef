"""What a sweep will take, from its definition alone: points, files, memory, disk, time."""

import shutil
from dataclasses import dataclass
from pathlib import Path

import psutil

from sweeps.points.sweep import Sweep
from sweeps.schema.refusals import DefinitionError

BLOCK_POINTS = 2**17  # measured at once
BLOCKS = 4  # in memory together: what one is measured from and into, and what is written meanwhile
PROCESS_BYTES = 400_000_000  # interpreter, compiled kernels and libraries


@dataclass(frozen=True)
class Estimate:
    """What a sweep will take.

    Attributes:
        points: number of grid points.
        shards: number of files the work is cut into.
        memory_bytes: memory of one process, bytes.
        disk_bytes: disk for shards and map, which exist at the same time, uncompressed, bytes.
        seconds: integration time on one core, s.
    """

    points: int
    shards: int
    memory_bytes: int
    disk_bytes: int
    seconds: float


def estimate(sweep: Sweep, bytes_per_point: int | None = None) -> Estimate:
    """What `sweep` will take; nothing of the grid is made, so grids of any size are answered at once."""
    definition, system, grid = sweep.definition, sweep.system, sweep.grid
    if bytes_per_point is None:
        bytes_per_point = system.bytes_per_point(definition)
    coordinates = 8 * sum(grid.shape)
    return Estimate(
        points=grid.size,
        shards=sweep.shards,
        memory_bytes=PROCESS_BYTES + BLOCKS * min(grid.size, BLOCK_POINTS) * bytes_per_point + coordinates,
        disk_bytes=2 * (grid.size * bytes_per_point + coordinates),
        seconds=grid.size * definition.integration.samples / system.samples_per_second,
    )


def refuse_if_too_large(sweep: Sweep, results_dir: str | Path, bytes_per_point: int | None = None) -> None:
    """Refuses a sweep that this machine's disk or memory would not hold.

    Args:
        sweep: the sweep.
        results_dir: folder the results go to; it need not exist yet.
        bytes_per_point: uncompressed bytes of a map per point; left out, those of the system's variables.

    Raises:
        DefinitionError: naming what is needed and what there is, in bytes.
    """
    needed = estimate(sweep, bytes_per_point)
    limits = (
        ("disk", needed.disk_bytes, shutil.disk_usage(_existing(Path(results_dir))).free),
        ("memory", needed.memory_bytes, psutil.virtual_memory().available),
    )
    lines = [_too_large(sweep, needed.points, *limit) for limit in limits if limit[1] > limit[2]]
    if lines:
        raise DefinitionError("\n".join(lines))


def _too_large(sweep: Sweep, points: int, what: str, needed: int, available: int) -> str:
    return (
        f"{sweep.name}: grid: {points:,} points need {in_words(needed)} of {what}; "
        f"allowed: {in_words(available)}, what is free here"
    )


def _existing(folder: Path) -> Path:
    return next(parent for parent in (folder.absolute(), *folder.absolute().parents) if parent.exists())


def in_words(size: int) -> str:
    """A number of bytes for people: "2.5 GB (2,500,000,000 bytes)"."""
    exact = f"{size:,} bytes"
    for power, unit in ((18, "EB"), (15, "PB"), (12, "TB"), (9, "GB"), (6, "MB"), (3, "kB")):
        if size >= 10**power:
            return f"{size / 10**power:,.3g} {unit} ({exact})"
    return exact
