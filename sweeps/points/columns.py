"""Points in, columns out: the one way to a measured value. A column is one variable's values, one a point.

A shard under Snakemake, a chunk under Dask and a call in a notebook all come here.
"""

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import pairwise

import numpy as np

from sweeps.points import compile
from sweeps.points.sweep import Sweep
from sweeps.process import machine
from sweeps.schema.refusals import DefinitionError


def columns(points: Mapping[str, np.ndarray], sweep: Sweep, threads: int = 1) -> dict[str, np.ndarray]:
    """Measure points, and return each of the sweep's variables → values, in its type.

    Args:
        points: each of the system's arguments → values, shape (n,).
        sweep: whose system is measured, and how each run is made; its grid takes no part.
        threads: threads that share the work; they change no bit.
    """
    with measurers(threads) as pool:
        return begun(points, sweep, pool, threads)()


@contextmanager
def measurers(threads: int) -> Iterator[ThreadPoolExecutor]:
    """Yield a pool of at least one measuring thread for the block; cancel pending work if the block fails."""
    with ThreadPoolExecutor(max(1, threads)) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def begun(points: Mapping[str, np.ndarray], sweep: Sweep, pool: ThreadPoolExecutor, parts: int) -> Callable[[], dict]:
    """Submit points to the thread pool in parts, and return a function that waits for them and returns the columns."""
    compile.ensure(sweep)
    if not machine.rounds_to_nearest():
        wrong = "another program in this process has set the processor's rounding mode"
        raise DefinitionError(f"arithmetic: {wrong}; allowed: rounding to nearest, without flushing to zero")
    size = next(iter(points.values())).size
    parts = max(1, min(parts, size))  # one without points has no columns to join
    bounds = pairwise(np.linspace(0, size, parts + 1).astype(int))
    cut = ({name: values[low:high] for name, values in points.items()} for low, high in bounds)
    futures = [pool.submit(sweep.system.columns, one, sweep.definition.integration) for one in cut]
    return lambda: _typed([future.result() for future in futures], sweep)


def _typed(parts: list[dict[str, np.ndarray]], sweep: Sweep) -> dict[str, np.ndarray]:
    """Return the columns of all parts, each in the type of its variable."""
    columns = {name: [part[name] for part in parts] for name in sweep.variables}
    joined = {name: one[0] if len(one) == 1 else np.concatenate(one) for name, one in columns.items()}
    return {name: one.astype(sweep.variables[name].dtype, copy=False) for name, one in joined.items()}
