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
from sweeps.pipeline import claims, up_to_date
from sweeps.pipeline.up_to_date import FIGURES, MAP, REPORT
from sweeps.points import catalogue, compile_kernels
from sweeps.points.sweep import Sweep
from sweeps.process import machine, progress
from sweeps.shards import merging
from sweeps.shards.shard import holds_shard, write_shard
from sweeps.views import drawing


def make(
    definition: Path,
    inputs: str,
    results: Path,
    workers: int = 1,
    again: bool = False,
    drawing_worker: Callable[[], AbstractContextManager] = nullcontext,
    replace: bool = False,
) -> Iterator[Path]:
    """Make the map of a sweep, its figures and its report, and yield each; for the arguments see `run.run`."""
    with progress.waiting(f"{definition}: deriving its equations"):
        plan = catalogue.plan_sweep(definition, results, check=False)
    sweep, folder = plan.sweep, results / plan.sweep.name
    progress.say(plan.intention(folder))
    with claims.claim_folders([sweep.name], results):
        claims.assign_to_definition(folder, definition, replace)
        is_new = again or not storage.holds_map(folder / MAP, sweep)
        old_outputs = {FIGURES, REPORT} if is_new else up_to_date.find_outdated(folder)
        if is_new:
            compile_kernels.ensure_compiled(sweep)  # the search for equilibria in the check is compiled, too
            sweep.system.check(sweep.definition, sweep.grid)
        draws = workers > 1 and FIGURES in old_outputs
        with drawing_worker() if draws else nullcontext() as worker:  # It loads Matplotlib while this process measures.
            if is_new:
                measure(sweep, folder / MAP, workers, again)
                machine.give_back()
            shutil.rmtree(folder / "shards", ignore_errors=True)
            yield folder / MAP
            _show(folder, old_outputs, worker)
        is_covered = up_to_date.covers_text(inputs, sweep.definition.text) and not sweep.has_other_inputs
        up_to_date.record(folder, inputs if is_covered else "")
        yield from (folder / FIGURES, folder / REPORT)


def _show(folder: Path, old_outputs: set[str], worker: Executor | None) -> None:
    """Make those of the pictures and the report of a map that are outdated, side by side if there is a worker."""
    write_report = partial(_report, folder) if REPORT in old_outputs else lambda: None
    if FIGURES in old_outputs:
        _draw(folder, worker, write_report)
    else:
        write_report()


def _draw(folder: Path, worker: Executor | None, meanwhile: Callable[[], None]) -> None:
    """Draw the pictures of a map, and call `meanwhile` once the worker, if there is one, has begun."""
    from sweeps.views import figures

    path, pictures = folder / MAP, folder / FIGURES
    progress.say(f"writing {pictures}")
    shutil.rmtree(pictures, ignore_errors=True)
    with figures.open_to_draw(path) as ds:
        submit = partial(worker.submit, drawing.draw_picture, path, {}) if worker else None
        list(figures.draw_all(ds, pictures, submit=submit, meanwhile=meanwhile))
    os.utime(pictures)


def _report(folder: Path) -> None:
    from sweeps.views import figures, report

    progress.say(f"writing {folder / REPORT}")
    with figures.open_to_draw(folder / MAP) as ds:
        report.write_report(ds, folder / REPORT)


# -- the map


def measure(sweep: Sweep, path: Path, workers: int, again: bool) -> None:
    """Write the map, at once or from shards; those that an interrupted run has finished are kept."""
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
