"""Measurement of points: the only call of the kernels. A column is one variable's values, one for each point.

A shard under Snakemake, a chunk under Dask and a call in a notebook all come here.
"""

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from itertools import pairwise

import numpy as np

from sweeps.points import compile_kernels
from sweeps.points.sweep import Sweep
from sweeps.process import machine, progress
from sweeps.schema.refusals import DefinitionError


def measure_points(
    points: Mapping[str, np.ndarray], sweep: Sweep, threads: int = 1, num_pieces: int = 0
) -> dict[str, np.ndarray]:
    """Measure points, and return each of the sweep's variables → values, in its type.

    Args:
        points: each of the system's arguments → values, shape (n,).
        sweep: its system is measured, with its settings of a run; its grid is not used.
        threads: number of threads that share the work; it changes no bit.
        num_pieces: number of pieces whose progress a bar shows on a terminal or in a notebook; 0 for none.
    """
    bar = progress.count_pieces(num_pieces, "measuring") if num_pieces else nullcontext(lambda: None)
    with bar as advance, open_pool(threads) as pool:
        return submit_points(points, sweep, pool, num_pieces or threads, lambda _: advance())()


@contextmanager
def open_pool(threads: int) -> Iterator[ThreadPoolExecutor]:
    """Yield a pool of at least one measuring thread for the block; cancel pending work if the block fails."""
    with ThreadPoolExecutor(max(1, threads)) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def submit_points(
    points: Mapping[str, np.ndarray],
    sweep: Sweep,
    pool: ThreadPoolExecutor,
    num_parts: int,
    when_done: Callable[[Future], None] = lambda _: None,
) -> Callable[[], dict]:
    """Submit points to the thread pool in parts, and return a function that waits for them and returns the columns.

    Args:
        points: each of the system's arguments → values, shape (n,).
        sweep: its system is measured.
        pool: the threads.
        num_parts: number of parts.
        when_done: called when each part is finished, in its thread.
    """
    compile_kernels.ensure_compiled(sweep)
    if not machine.rounds_to_nearest():
        problem = "another program in this process has set the processor's rounding mode"
        raise DefinitionError(f"arithmetic: {problem}; allowed: rounding to nearest, without flushing to zero")
    size = next(iter(points.values())).size
    num_parts = max(1, min(num_parts, size))  # at least one, so that there are columns to join
    bounds = pairwise(np.linspace(0, size, num_parts + 1).astype(int))
    chunks = ({name: values[low:high] for name, values in points.items()} for low, high in bounds)
    futures = [pool.submit(sweep.system.columns, chunk, sweep.definition.integration) for chunk in chunks]
    for future in futures:
        future.add_done_callback(when_done)
    return lambda: _join_columns([future.result() for future in futures], sweep)


def _join_columns(chunks: list[dict[str, np.ndarray]], sweep: Sweep) -> dict[str, np.ndarray]:
    """Return the columns of all parts, each in the type of its variable."""
    columns = {name: [chunk[name] for chunk in chunks] for name in sweep.variables}
    full_columns = {name: values[0] if len(values) == 1 else np.concatenate(values) for name, values in columns.items()}
    return {name: values.astype(sweep.variables[name].dtype, copy=False) for name, values in full_columns.items()}
