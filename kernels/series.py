"""Functions of libraries in plain arithmetic: a loop over lanes that calls them stays packed."""

import math

from kernels.jit import EXACT_INLINE, INLINE, njit


@njit(**EXACT_INLINE)
def hypot(x, y):
    """Return sqrt(x² + y²) without overflow, to two units in the last place.

    Numba compiles ``math.hypot`` with the options of whoever calls it first, so that its last bit, and with it that of
    every later caller, would depend on the order of compiling.
    """
    x, y = abs(x), abs(y)
    large, small = (x, y) if x >= y else (y, x)
    if large == 0.0:
        return large + small
    ratio = small / large if small != large else 1.0
    return large * math.sqrt(1.0 + ratio * ratio)


@njit(**INLINE)
def arctangent(t):
    """Arctangent of at most a quarter, rad; the series in t² is cut after t^24, which leaves 2e-17 at the end."""
    z = t * t
    series = z * (1 / 25) - 1 / 23
    series = series * z + 1 / 21
    series = series * z - 1 / 19
    series = series * z + 1 / 17
    series = series * z - 1 / 15
    series = series * z + 1 / 13
    series = series * z - 1 / 11
    series = series * z + 1 / 9
    series = series * z - 1 / 7
    series = series * z + 1 / 5
    series = series * z - 1 / 3
    return t + t * (z * series)
