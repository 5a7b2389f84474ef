"""Codes in the arguments and results of kernels: operations of tapes, kinds of boxes, regimes.

A module that writes or reads them need not import the kernels themselves, which are compiled by their import.
"""

from typing import NamedTuple

import numpy as np

# States of an enclosure: see kernels.enclosures.
SOUND, POLE, OUTSIDE = range(3)

# Operations: row (code, a, b) of a tape, a and b rows above it, or the number of a variable or constant, or a power.
VARIABLE, CONSTANT, ADD, MUL, WHOLE_POWER, POWER = range(6)
EXP, LOG, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, ASINH, ACOSH, ATANH, ERF = range(10, 25)

ORDER, FAR_ORDER = 12, 20  # orders of the generated Taylor steps: near equilibria, and of free motions

# Kinds of boxes: see kernels.roots.
UNIQUE_ZERO = 0  # the box contains exactly one zero
ROUNDING_LIMITED = 1  # F changes across the box by less than the rounding of F
AT_MIN_WIDTH = 2  # the box is undecided and has the minimum width
CONTAINS_POLE = 3  # the box is narrow, and F is undefined or unbounded in a subset of it
OVERFLOW = 4  # F overflows or underflows in the box
NOT_EXAMINED = 5  # the search had reached its maximum number of boxes

UNIT = 2.0**-52  # machine epsilon: twice the largest relative error of rounding to nearest
MIN_RANGE = 1e-280  # an enclosure with smaller ends may be wide by underflow alone

# Columns of a raw result of kernels.spectrum; from HEAD on: real parts, imaginary parts, errors of both (n each).
(EQUATIONS, SCATTER, EXCITATION, ODD, SUM, SUM_ERROR, PRODUCT, PRODUCT_ERROR, DISCRIMINANT, DISCRIMINANT_ERROR) = range(
    10
)
HEAD = 10
MIN_EXCITATION = 1.5e-4  # smallest singular value of the samples over the largest; below it, a mode was not excited
MIN_IMAG_GAP = 1e-6  # imaginary parts times the sample spacing that differ by less count as equal in the sorting
ASYMPTOTICALLY_STABLE, STABLE, UNSTABLE, FLUTTER, MARGINAL = range(5)  # regimes of eigenvalues

# Regimes of kernels.floquet by their number + 1, and smooth invariants of two degrees of freedom.
REGIMES = ("undetermined", "stable", "asymptotically_stable", "unstable", "period_doubling", "flutter", "marginal")
INVARIANTS = ("first_invariant", "second_invariant", "krein_discriminant", "det_minus_identity", "det_plus_identity")


class Formulas(NamedTuple):
    """Functions of several variables as a tape."""

    tape: np.ndarray  #: int64, shape (operations, 3): rows (code, a, b)
    outputs: np.ndarray  #: int64, shape (functions,): rows of the tape with the functions' values
    #: enclosures of the constants, shape (constants, 2), or (points, constants, 2) of many points.
    constants: np.ndarray
