"""Compiling the kernels before anything else needs them.

Numba's disk cache is not safe when several processes compile at once, so the workflow compiles in one job of its own.
"""

import numpy as np

from kernels import survey


def compile_kernels() -> None:
    """Compiles, and stores in the cache, every kernel that a sweep calls."""
    point = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "axis": 2, "omega0": 1.0, "epsilon": 1e-6, "phase": 0.6}
    survey.survey({name: np.array([value]) for name, value in point.items()}, 4.0, 16, 1e-10)
