"""The function of `polhode run` and `sweeps.run`, without a workflow engine: the same files as the Snakefile's.

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

from sweeps.pipeline import claims, up_to_date
from sweeps.pipeline.up_to_date import FIGURES, MAP, REPORT
from sweeps.points import catalogue, compile_kernels
from sweeps.points.sweep import Sweep
from sweeps.process import machine, progress
from sweeps.schema.refusals import DefinitionError
from sweeps.shards import merging
from sweeps.shards.shard import holds_shard, write_shard
from sweeps.views import drawing


def run(
    definition: Path,
    cores: int | None = None,
    again: bool = False,
    results: str | Path = "results",
    drawing_worker: Callable[[], AbstractContextManager] = nullcontext,
    replace: bool = False,
) -> Iterator[Path]:
    """Make the map, figures and report of a sweep unless they are there, and yield each.

    The size of the work is printed on the error stream first.

    Args:
        definition: the file of a definition.
        cores: number of processors; all by default.
        again: True to make everything again.
        results: the folder for results; the sweep's own is below it.
        drawing_worker: `sweeps.views.drawing.start_worker` to draw in a further process as well. Only Polhode's own
            commands can start it: in a user's program, it would run the script again.
        replace: True to replace the results of another definition with the same file name.
    """
    if cores is not None and cores < 1:
        raise DefinitionError(f"cores: {cores} is out of range; allowed: 1 or more")
    workers = cores or machine.num_processors()
    with progress.announce(f"{definition}: deriving its equations"):
        plan = catalogue.plan_sweep(definition, results, check=False)
    sweep, folder = plan.sweep, Path(results) / plan.sweep.name
    if not again and not up_to_date.find_outdated(folder, sweep):  # nothing is written, not even a claim
        yield from (folder / name for name in up_to_date.OUTPUTS)
        return
    with claims.claim_folders([sweep.name], results):
        claims.assign_to_definition(folder, definition, replace)
        outdated = set(up_to_date.OUTPUTS) if again else up_to_date.find_outdated(folder, sweep)
        is_new = MAP in outdated
        if outdated:
            progress.print_line(plan.intention(folder))
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
        up_to_date.record(folder)
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
