"""Functions of libraries as series in plain arithmetic: a loop over lanes that calls them stays packed."""

from kernels.jit import INLINE, njit


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
