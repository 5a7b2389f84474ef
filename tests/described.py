"""Points of described systems, at random places of their parameters."""

import numpy as np


def points(system, last, each, count, varied, seed, **beside):
    """Every equilibrium, and each of the numbers 1 to `each` of the coordinate `last`, at ``count`` random places."""
    rng = np.random.default_rng(seed)
    slots = system.most * each
    columns = {name: np.full(count * slots, p.default) for name, p in system.parameters.items()}
    columns |= {name: np.repeat(rng.uniform(*ends, count), slots) for name, ends in varied.items()}
    columns["equilibrium"] = np.tile(np.repeat(np.arange(system.most), each), count)
    columns[last] = np.tile(np.arange(1, each + 1), count * system.most)
    return columns | {name: np.full(count * slots, value) for name, value in beside.items()}
