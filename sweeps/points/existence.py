"""How many points of a sweep are physically impossible, from its definition alone."""

import math

import numpy as np

from sweeps.points.grid import Grid
from sweeps.points.scattered import POINT
from sweeps.points.sweep import Sweep

MOST = 2**22  # bodies that are counted one by one; of more, so many are drawn
SEED = 1


def impossible(sweep: Sweep) -> tuple[int, bool]:
    """Return how many points of a sweep cannot exist, and whether that is counted (True) or estimated from a sample."""
    grid, system = sweep.grid, sweep.system
    given = [name for name in system.existence if name not in grid.following.names]
    if any(name in grid.following.names for name in system.existence):
        given = list(dict.fromkeys((*given, *grid.following.needed)))
    along = {name: (name if name in grid.dims else grid.auxiliary[name][0][0]) for name in given}
    sizes = {dim: grid.shape[grid.dims.index(dim)] for dim in dict.fromkeys(along.values())}
    bodies = math.prod(sizes.values())
    if not along:
        return 0, True
    if bodies <= MOST:
        counts = np.indices(tuple(sizes.values()), sparse=True)
        numbers = dict(zip(sizes, counts, strict=True))
    elif POINT in sizes:  # the first points that are drawn, which are spread as all are
        numbers = {dim: np.arange(MOST) % size for dim, size in sizes.items()}
    else:
        rng = np.random.default_rng(SEED)
        numbers = {dim: rng.integers(0, size, MOST) for dim, size in sizes.items()}
    values = {name: _values(grid, name, numbers[dim]) for name, dim in along.items()}
    mask = system.impossible(values | grid.following.at(values) if grid.following.names else values)
    if bodies > MOST:
        return round(float(np.mean(mask)) * grid.size), False
    return int(np.count_nonzero(mask)) * (grid.size // mask.size), True


def _values(grid: Grid, name: str, numbers: np.ndarray) -> np.ndarray:
    if name in grid.dims:
        return grid.values(name, numbers)
    if grid.scattered and name in grid.scattered.names:
        return grid.scattered.rows(0, int(numbers.max()) + 1)[name][numbers]
    return grid.auxiliary[name][1][numbers]
