"""From a definition to its map, pictures and report without a workflow engine: the same files as the Snakefile makes.

What is finished stays and is not made again: a shard or a map of the same definition, files and kernels, and pictures
and a report that are younger than their map.
"""

import math
import os
import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path

from sweeps.maps import storage
from sweeps.pipeline import claims, finished
from sweeps.points import compile
from sweeps.points.catalogue import Plan
from sweeps.points.sweep import Sweep
from sweeps.process import machine, progress
from sweeps.shards import merging
from sweeps.shards.shard import holds_shard, write_shard
from sweeps.views import drawing

Beside = Callable[[], AbstractContextManager]


def make(
    planned: Plan,
    results: str | Path = "results",
    workers: int = 1,
    again: bool = False,
    beside: Beside = nullcontext,
    replace: bool = False,
) -> Iterator[Path]:
    """Make the map of a sweep, its figures and its report, and yield each; for the arguments see `making.make`."""
    sweep, folder = planned.sweep, Path(results) / planned.sweep.name
    path = folder / "stability_map.nc"
    with claims.claimed([sweep.name], results):
        claims.assign_to_definition(folder, planned.path, replace)
        finished.remove_incomplete(folder)
        is_old = again or not storage.holds_map(path, sweep)
        if is_old:
            compile.ensure(sweep)  # the search for equilibria in the check is compiled, too
            sweep.system.check(sweep.definition, sweep.grid)
        draws = workers > 1 and (is_old or _is_older(folder / "figures", path))
        with beside() if draws else nullcontext() as worker:  # loads Matplotlib while this process measures
            if is_old:
                measure(sweep, path, workers, again)
                machine.give_back()
            if (folder / "shards").exists():
                shutil.rmtree(folder / "shards")
            yield path
            drawn = list(_shown(path, again, worker))
            finished.note_sizes(folder)
            yield from drawn


def _is_older(made: Path, path: Path) -> bool:
    return not made.exists() or made.stat().st_mtime < path.stat().st_mtime


def _shown(path: Path, again: bool, worker: Executor | None) -> Iterator[Path]:
    """Make the pictures and the report of a map, side by side where there is a worker."""
    pictures, page = path.with_name("figures"), path.with_name("report.html")
    report = partial(_report, path, page) if again or _is_older(page, path) else lambda: None
    if again or _is_older(pictures, path):
        _draw(path, pictures, worker, report)
    else:
        report()
    yield from (pictures, page)


def _draw(path: Path, folder: Path, worker: Executor | None, meanwhile: Callable[[], None]) -> None:
    """Draw the pictures of a map, and call `meanwhile` once the worker, if there is one, has begun."""
    from sweeps.views import figures

    progress.say(f"writing {folder}")
    shutil.rmtree(folder, ignore_errors=True)
    with figures.open_to_draw(path) as ds:
        submit = partial(worker.submit, drawing.draw, path, {}) if worker else None
        list(figures.draw_all(ds, folder, submit=submit, meanwhile=meanwhile))
    os.utime(folder)


def _report(path: Path, file: Path) -> None:
    from sweeps.views import figures, report

    progress.say(f"writing {file}")
    with figures.open_to_draw(path) as ds:
        report.write(ds, file)


# -- the map


def measure(sweep: Sweep, path: Path, workers: int, again: bool) -> None:
    """Write the map, at once or from shards, of which those that an interrupted run has finished are kept."""
    count = sweep.shards
    shards = merging.files(path.with_name("shards"), count)
    missing = [k for k in range(1, count + 1) if again or not holds_shard(shards[k - 1], sweep, k, count)]
    if count == len(missing) == 1:
        with progress.points(sweep.grid.size, sweep.name, math.prod(sweep.each.values())) as advance:
            merging.measure_whole(sweep, path, workers, advance)
    else:
        _write(sweep, shards, missing, workers)
        progress.say(f"merging {count} shards")
        merging.merge(sweep, shards, path, workers)


def _write(sweep: Sweep, shards: list[Path], missing: list[int], workers: int) -> None:
    """Write the shards that are not there yet, one after the other: finished ones are kept."""
    count, bounds = len(shards), sweep.grid.shard_bounds(len(shards))
    if done := count - len(missing):
        progress.say(f"{done} of {count} shards exist already")
    points = sum(stop - start for start, stop in (bounds[k - 1] for k in missing))
    try:
        with progress.points(points, sweep.name, math.prod(sweep.each.values())) as advance:
            for k in missing:
                write_shard(sweep, k, count, shards[k - 1], workers, advance)
                done += 1
    except BaseException as error:
        error.add_note(f"{done:,} of {count:,} shards finished")
        raise
