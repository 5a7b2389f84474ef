"""Columns and limits that the parts of a fit share: see :mod:`kernels.spectrum`."""

import numpy as np

EPSILON = float(np.finfo(np.float64).eps)
LEAST_MOVED = 1.5e-4  # smallest singular value of the samples over the largest: below it a mode was not moved
SAME = 1e-6  # of the spacing's inverse: imaginary parts nearer than this are one where eigenvalues are ordered

# Columns of a raw result; after HEAD follow real parts, imaginary parts, their errors (n each).
EQUATIONS, SCATTER, MOVED, ODD, SUM, SUM_ERROR, PRODUCT, PRODUCT_ERROR, DISCRIMINANT, DISCRIMINANT_ERROR = range(10)
HEAD = 10
