"""A worker process that draws pictures of a map while the command draws further pictures or writes the report."""

import multiprocessing
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from sweeps.process import interrupts, startup


@contextmanager
def start_worker() -> Iterator[Executor]:
    """Start a worker process, which imports Matplotlib at once; at the end of the block, wait for it and end it."""
    pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), _prepare_worker)
    try:
        with interrupts.ignore_interrupts():
            pool.submit(int)  # starts the process
        yield pool
    finally:
        interrupts.end_processes(pool)


def draw_picture(path: str | Path, cut: Mapping[str, slice], *what) -> list[str]:
    """Draw one picture or animation of the map at `path`, cut by dimension → slice; see `figures.draw_one`."""
    from sweeps.views import figures

    with figures.open_to_draw(path) as ds:
        return figures.draw_one(figures.escape_dollars(ds.isel(cut)), *what)


def _prepare_worker() -> None:
    interrupts.exit_with_parent()
    startup.configure()
    from sweeps.views import figures  # noqa: F401
