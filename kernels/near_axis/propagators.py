"""Propagators that a definition can name, and the steps by which compiled code carries motions over a sample interval.

Nothing is imported here but the standard library, so that the names can be read before any compiler is. Steps are plain
numbers, because Numba compiles a kernel again for a member of an enumeration.
"""

from typing import NamedTuple


class Propagator(NamedTuple):
    """How perturbed rotations are followed."""

    summary: str  #: for whoever writes a definition
    method: str  #: for whoever reads a map
    is_certified: bool  #: True if the motion is compared with the exact solution, False if it is the exact solution


PROPAGATORS = {
    "direct": Propagator(
        "Taylor steps, each point certified by the closed form",
        "direct integration of Euler's equations, certified by the closed form",
        is_certified=True,
    ),
    "exact": Propagator("steps of the closed form", "exact steps of the closed-form rotation", is_certified=False),
}

# Steps of one sample interval or a part of it: Taylor steps as in :data:`kernels.free.taylor.STEPS`, and the exact
# solution by its map or, for small motions, by its recurrence.
TAYLOR_8, NEAR_8, NEAREST_8, TAYLOR_10, NEAR_10, NEAREST_10, TAYLOR_12, NEAR_12, NEAREST_12 = range(9)
EXACT, RECURRENCE = range(9, 11)

IS_EXACT = (*9 * (False,), True, True)  # True if the step has no truncation error
ORDER = (*3 * (8.0,), *3 * (10.0,), *3 * (12.0,), 12.0, 12.0)  # Taylor order; not used if the step is exact
# True if the step is short as in :func:`kernels.free.direct.is_near`, and in :func:`kernels.free.direct.is_nearest`
IS_NEAR, IS_NEAREST = (*3 * (False, True, False), False, False), (*3 * (False, False, True), False, False)
