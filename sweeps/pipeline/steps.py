"""Steps from a definition to its map, pictures and report without a workflow engine: the same files as the Snakefile.

Finished files are kept: a shard or a map of the same definition, files and kernels, and pictures and a report that are
younger than their map.
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


def make_outputs(
    definition: Path,
    inputs: str,
    results: Path,
    workers: int = 1,
    again: bool = False,
    drawing_worker: Callable[[], AbstractContextManager] = nullcontext,
    replace: bool = False,
) -> Iterator[Path]:
    """Make the map of a sweep, its figures and its report, and yield each.

    Args:
        definition: the file of a definition.
        inputs: hash of the inputs, of `up_to_date.inputs_hash`.
        results: the folder for results.
        workers: number of processors.
        again: as of `run.run`.
        drawing_worker: as of `run.run`.
        replace: as of `run.run`.
    """
    with progress.announce(f"{definition}: deriving its equations"):
        plan = catalogue.plan_sweep(definition, results, check=False)
    sweep, folder = plan.sweep, results / plan.sweep.name
    progress.print_line(plan.intention(folder))
    with claims.claim_folders([sweep.name], results):
        claims.assign_to_definition(folder, definition, replace)
        is_new = again or not storage.holds_map(folder / MAP, sweep)
        outdated = {FIGURES, REPORT} if is_new else up_to_date.find_outdated(folder)
        if is_new:
            compile_kernels.ensure_compiled(sweep)  # the search for equilibria in the check is compiled, too
            sweep.system.check(sweep.definition, sweep.grid)
        draws = workers > 1 and FIGURES in outdated
        with drawing_worker() if draws else nullcontext() as worker:  # It imports Matplotlib meanwhile.
            if is_new:
                measure_map(sweep, folder / MAP, workers, again)
                machine.return_freed_memory()
            shutil.rmtree(folder / "shards", ignore_errors=True)
            yield folder / MAP
            _write_views(sweep, folder, outdated, worker)
        covers_inputs = up_to_date.covers_text(inputs, sweep.definition.text) and not sweep.has_other_inputs
        up_to_date.record(folder, inputs if covers_inputs else "")
        yield from (folder / FIGURES, folder / REPORT)


def _write_views(sweep: Sweep, folder: Path, outdated: set[str], worker: Executor | None) -> None:
    """Write a map's pictures and report if they are outdated, in parallel if there is a worker."""
    write_report = partial(_write_report, sweep, folder) if REPORT in outdated else lambda: None
    if FIGURES in outdated:
        _draw_pictures(folder, worker, write_report)
    else:
        write_report()


def _draw_pictures(folder: Path, worker: Executor | None, meanwhile: Callable[[], None]) -> None:
    """Draw the pictures of a map, and call `meanwhile` when the worker (if there is one) has begun."""
    from sweeps.views import figures

    path, pictures = folder / MAP, folder / FIGURES
    progress.print_line(f"writing {pictures}")
    shutil.rmtree(pictures, ignore_errors=True)
    with figures.open_to_draw(path) as ds:
        submit = partial(worker.submit, drawing.draw_picture, path, {}) if worker else None
        list(figures.draw_all(ds, pictures, submit=submit, meanwhile=meanwhile))
    os.utime(pictures)


def _write_report(sweep: Sweep, folder: Path) -> None:
    """Write the report of the map in a results folder."""
    from sweeps.views import figures, report

    progress.print_line(f"writing {folder / REPORT}")
    with figures.open_to_draw(folder / MAP) as ds:
        report.write_report(ds, folder / REPORT, system=sweep.system)


# -- the map


def measure_map(sweep: Sweep, path: Path, workers: int, again: bool) -> None:
    """Write the map, at once or from shards; shards that an interrupted run has finished are kept.

    Args:
        sweep: the sweep.
        path: the map to write.
        workers: number of threads.
        again: True to measure finished shards again.
    """
    count = sweep.shards
    shards = merging.shard_files(path.with_name("shards"), count)
    missing = [k for k in range(1, count + 1) if again or not holds_shard(shards[k - 1], sweep, k, count)]
    if count == len(missing) == 1:
        with progress.count_points(sweep.grid.size, sweep.name, math.prod(sweep.each.values())) as advance:
            merging.measure_whole(sweep, path, workers, advance)
    else:
        _write_shards(sweep, shards, missing, workers)
        progress.print_line(f"merging {count} shards")
        merging.merge_shards(sweep, shards, path, workers)


def _write_shards(sweep: Sweep, shards: list[Path], missing: list[int], workers: int) -> None:
    """Write the missing shards (numbers from 1) in order."""
    count, bounds = len(shards), sweep.grid.shard_bounds(len(shards))
    if num_finished := count - len(missing):
        progress.print_line(f"{num_finished} of {count} shards exist already")
    points = sum(stop - start for start, stop in (bounds[k - 1] for k in missing))
    try:
        with progress.count_points(points, sweep.name, math.prod(sweep.each.values())) as advance:
            for k in missing:
                write_shard(sweep, k, count, shards[k - 1], workers, advance)
                num_finished += 1
    except BaseException as error:
        error.add_note(f"{num_finished:,} of {count:,} shards finished")
        raise
