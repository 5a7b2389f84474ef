"""From a definition to its map, pictures and report without a workflow engine: the same files as the Snakefile makes.

What is finished stays and is not made again: a shard or a map of the same definition, files and kernels, and pictures
and a report that are younger than their map.
"""

import multiprocessing
import os
import queue
import shutil
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import nullcontext
from functools import partial
from pathlib import Path

from kernels import stored
from kernels.fingerprint import cache_folder
from sweeps import interrupts, systems
from sweeps.files import replaced_folder
from sweeps.maps import admission
from sweeps.points import estimate
from sweeps.points.catalogue import Plan
from sweeps.points.sweep import Sweep
from sweeps.run import claims, progress, warmup
from sweeps.shards import merging
from sweeps.shards.shard import holds_shard, write_shard

FEW_SECONDS = 1.0  # of integrating on one core: what takes less is done before another process has loaded the kernels

_done = None  # in a process of ours: the queue that it tells how many points it has just done


def make(
    planned: Plan, results: str | Path = "results", workers: int = 1, again: bool = False, helper=None
) -> Iterator[Path]:
    """Makes the map of a sweep, its pictures and its report.

    Args:
        planned: the sweep.
        results: the folder for results; the sweep's own is below it.
        workers: processors to use; they change no bit.
        again: whether to make everything again, finished or not.
        helper: a `sweeps.views.helper.Helper` for this map that is there already; left out, one is begun where needed.

    Yields:
        Each file or folder once it is there.
    """
    with claims.claimed([planned.sweep.name], results):
        yield from _made(planned, Path(results) / planned.sweep.name, workers, again, helper)


def _made(planned: Plan, folder: Path, workers: int, again: bool, helper) -> Iterator[Path]:
    path = folder / "stability_map.nc"
    is_old = again or not admission.holds_map(path, planned.sweep)
    is_needed = not helper and (is_old or _is_older(folder / "figures", path))
    with _helping(path, workers) if is_needed else nullcontext(helper) as helper:
        if is_old:
            _compile(planned.sweep)
            count = planned.sweep.shards
            shards = [folder / "shards" / f"{k}-of-{count}.nc" for k in range(1, count + 1)]
            _measure(planned.sweep, shards, workers, again)
            _say(f"merging {len(shards)} shards" if len(shards) > 1 else "writing the map")
            merging.merge(planned.sweep, shards, path, workers)
            shutil.rmtree(folder / "shards")
        yield path
        yield from _shown(path, again, helper)


def _helping(path: Path, workers: int):
    """A second process for the pictures, which loads what it needs while the map is made; None where there is none."""
    if workers == 1:
        return nullcontext()
    from sweeps.views.helper import helping

    return helping(path)


def _is_older(made: Path, path: Path) -> bool:
    return not made.exists() or made.stat().st_mtime < path.stat().st_mtime


def _shown(path: Path, again: bool, helper) -> Iterator[Path]:
    """Pictures and report of a map, side by side where a second process helps."""
    folder, page = path.parent / "figures", path.parent / "report.html"
    report = partial(_report, path, page) if again or _is_older(page, path) else lambda: None
    if again or _is_older(folder, path):
        _draw(path, folder, helper, report)
    else:
        report()
    yield folder
    yield page


def _draw(path: Path, folder: Path, helper, meanwhile: Callable[[], None]) -> None:
    """Draws the pictures of a map; what the helper has not begun once something else is done, here."""
    _say(f"making {folder}")
    shutil.rmtree(folder, ignore_errors=True)
    with replaced_folder(folder) as temporary:
        asked = helper.draw_foreseen(temporary) if helper else None
        meanwhile()
        from sweeps.views import figures

        with figures.opened(path) as ds:
            figures.draw_some(ds, (), temporary)
        if asked:
            asked.result()
    os.utime(folder)


def _report(path: Path, file: Path) -> None:
    from sweeps.views import figures, report

    _say(f"making {file}")
    with figures.opened(path) as ds:
        report.write(ds, file)


def _compile(sweep: Sweep) -> None:
    """Compiles what its system calls, alone, where no workflow or earlier run has: the cache bears one writer."""
    system, compiled = sweep.system, cache_folder() / "compiled"
    default, others = estimate.compile_seconds(sweep)
    if not compiled.exists() and systems.calls_the_defaults(system):
        _say(f"compiling the kernels, once per machine, about {default:.0f} s")
        warmup.compile_kernels()
    if not system.compiled().exists():
        _say(f"compiling {system.name}, once per machine, about {others:.0f} s")
        warmup.compile_system(system)
    warmup.compile_missing(system)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


# ---------------------------------------------------------------------------------------------------------
# Shards


def _measure(sweep: Sweep, shards: list[Path], workers: int, again: bool) -> None:
    """Writes those shards that are not there yet: long ones several at a time, each by a process of its own."""
    count, bounds = len(shards), sweep.grid.shard_bounds(len(shards))
    numbers = range(1, count + 1)
    missing = [k for k in numbers if again or not holds_shard(shards[k - 1], sweep, k, count)]
    if count > len(missing):
        _say(f"{count - len(missing)} of {count} shards are there already")
    points = sum(stop - start for start, stop in (bounds[k - 1] for k in missing))
    jobs = [(sweep, k, count, shards[k - 1]) for k in missing]
    with progress.points(points, sweep.name) as advance:
        if len(jobs) == 1 or workers == 1 or estimate.measure_seconds(sweep) < FEW_SECONDS:
            for job in jobs:
                write_shard(*job, workers, advance)
        elif jobs:
            _share(jobs, workers, advance)


def _share(jobs: list[tuple], workers: int, advance: Callable[[int], None]) -> None:
    """Lets processes write the shards; netCDF bears one thread a process."""
    spawn = multiprocessing.get_context("spawn")  # a fork would copy the locks of running threads
    told = spawn.Queue()
    processes = min(workers, len(jobs))
    with ProcessPoolExecutor(processes, spawn, _begin, (told,)) as pool:
        with interrupts.left_to_the_parent():
            running = [pool.submit(_write, *job, max(1, workers // processes)) for job in jobs]
        try:
            _follow(running, told, advance)
        except BaseException:
            interrupts.abandon(pool)
            raise


def _follow(running: list[Future], told, advance: Callable[[int], None]) -> None:
    while True:
        over = all(future.done() for future in running)
        try:
            while True:
                advance(told.get(timeout=0.1))
        except queue.Empty:
            pass
        for future in running:
            if future.done():
                future.result()
        if over:
            return


def _begin(told) -> None:
    global _done
    _done = told
    stored.store_in_turn()  # what few sweeps call is compiled by whoever needs it first
    interrupts.end_with_the_parent()


def _write(sweep: Sweep, number: int, count: int, path: Path, threads: int) -> None:
    write_shard(sweep, number, count, path, threads, _done.put)
