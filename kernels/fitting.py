"""Types and columns that the parts of a fit share, each of which is compiled by itself: see :mod:`kernels.spectrum`."""

import numpy as np

from kernels.jit import boolean, float64, int64, types, void

EPSILON = float(np.finfo(np.float64).eps)
LEAST_MOVED = 1.5e-4  # smallest singular value of the samples over the largest: below it a mode was not moved

# Columns of a raw result; after HEAD follow real parts, imaginary parts, their errors (n each).
EQUATIONS, SCATTER, MOVED, ODD, SUM, SUM_ERROR, PRODUCT, PRODUCT_ERROR, DISCRIMINANT, DISCRIMINANT_ERROR = range(10)
HEAD = 10

ROWS, LANES = float64[::1], float64[:, ::1]
STEPPED = boolean(*2 * (LANES,), int64, int64, *3 * (LANES,), ROWS, ROWS, ROWS)  # projection.step
TOLD = void(LANES, LANES, int64, int64, LANES, ROWS, ROWS, ROWS, int64, LANES)  # invariants.tell
STEP, TELL = types.FunctionType(STEPPED), types.FunctionType(TOLD)
FITTED = void(
    STEP, TELL, LANES, LANES, int64, int64, int64, ROWS, ROWS, ROWS, float64, int64, LANES
)  # spectrum.fit_block
FIT = types.FunctionType(FITTED)
