"""Names and numbers of what kernels take and give: operations of tapes, kinds of boxes, regimes.

Whoever writes or reads them need not load the kernels themselves, which are compiled by their import.
"""

from typing import NamedTuple

import numpy as np

# States of an enclosure: see kernels.enclosures.
SOUND, POLE, OUTSIDE = range(3)

# Operations: row (code, a, b) of a tape, a and b rows above it, or the number of a variable or constant, or a power.
VARIABLE, CONSTANT, ADD, MUL, WHOLE_POWER, POWER = range(6)
EXP, LOG, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, ASINH, ACOSH, ATANH, ERF = range(10, 25)

ORDER, FAR_ORDER = 12, 20  # of the generated Taylor steps, near equilibria and far from them

# Kinds of boxes: see kernels.roots.
ZERO = 0  # a box that holds exactly one zero
LOST = 1  # F changes by less than the rounding of F itself
NARROW = 2  # as narrow as a box may be
BROKEN = 3  # narrow, and F is not defined, or unbounded, in a part of it
OVERFLOW = 4  # F is beyond all numbers, or underflows
LEFT = 5  # the number of boxes was used up

UNIT = 2.0**-52  # of rounding
FAINT = 1e-280  # a range so small may be underflow

# Of kernels.spectrum: columns of a raw result; after HEAD follow real parts, imaginary parts, their errors (n each).
EQUATIONS, SCATTER, MOVED, ODD, SUM, SUM_ERROR, PRODUCT, PRODUCT_ERROR, DISCRIMINANT, DISCRIMINANT_ERROR = range(10)
HEAD = 10
LEAST_MOVED = 1.5e-4  # smallest singular value of the samples over the largest: below it a mode was not moved
SAME = 1e-6  # of the spacing's inverse: imaginary parts nearer than this are one where eigenvalues are ordered
ASYMPTOTICALLY_STABLE, STABLE, UNSTABLE, FLUTTER, MARGINAL = range(5)  # regimes of eigenvalues

# Of kernels.floquet: regimes by their number + 1, and smooth invariants of two degrees of freedom.
REGIMES = ("undetermined", "stable", "asymptotically_stable", "unstable", "period_doubling", "flutter", "marginal")
INVARIANTS = ("first_invariant", "second_invariant", "krein_discriminant", "det_minus_identity", "det_plus_identity")


class Formulas(NamedTuple):
    """Functions of several variables as a tape."""

    tape: np.ndarray  #: int64, shape (operations, 3): rows (code, a, b)
    outputs: np.ndarray  #: int64, shape (functions,): rows of the tape that are wanted
    #: enclosures of the constants, shape (constants, 2), or (points, constants, 2) of many points.
    constants: np.ndarray
