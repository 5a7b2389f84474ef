"""Points in, columns out: the one way to a measured value. A column is one variable's values, one a point.

A shard under Snakemake, a chunk under Dask and a call in a notebook all go through `columns`.
"""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np

from sweeps.points.sweep import Sweep


def columns(points: Mapping[str, np.ndarray], sweep: Sweep, threads: int = 1) -> dict[str, np.ndarray]:
    """Measures points.

    Args:
        points: each of the system's arguments → values, shape (n,).
        sweep: whose system is measured, and how each run is made; its grid takes no part.
        threads: threads that share the work; they change no bit.

    Returns:
        Each of the sweep's variables → values, shape (n,) and those of its further dimensions, in its type.
    """
    size = next(iter(points.values())).size

    def part(bounds):
        own = {name: values[slice(*bounds)] for name, values in points.items()}
        return sweep.system.columns(own, sweep.definition.integration)

    threads = max(1, min(threads, size))  # a part without points has no columns to join
    if threads == 1:
        parts = [part((0, size))]
    else:
        bounds = list(pairwise(np.linspace(0, size, threads + 1).astype(int)))
        with ThreadPoolExecutor(threads) as pool:
            parts = list(pool.map(part, bounds))
    return {
        name: _joined([columns[name] for columns in parts]).astype(variable.dtype, copy=False)
        for name, variable in sweep.variables.items()
    }


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)
