"""Codes in the arguments and results of the search for zeros: operations, states of enclosures, kinds of boxes.

A module that writes or reads them need not import the kernels themselves, which are compiled by their import.
"""

import sys
from typing import NamedTuple

import numpy as np

# States of an enclosure: see kernels.search.enclosures.
REGULAR, POLE, OUTSIDE = range(3)

# Operations: row (code, a, b) of a tape, a and b rows above it, or the number of a variable or constant, or a power.
VARIABLE, CONSTANT, ADD, MUL, WHOLE_POWER, POWER = range(6)
EXP, LOG, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH, TANH, ASINH, ACOSH, ATANH, ERF = range(10, 25)

# Kinds of boxes: see kernels.search.roots.
UNIQUE_ZERO = 0  # the box contains exactly one zero
ROUNDING_LIMITED = 1  # F changes across the box by less than the rounding of F
AT_MIN_WIDTH = 2  # the box is undecided and has the minimum width
CONTAINS_POLE = 3  # the box is narrow, and F is undefined or unbounded in a subset of it
OVERFLOW = 4  # F overflows or underflows in the box
NOT_EXAMINED = 5  # the search had reached its maximum number of boxes

UNIT = sys.float_info.epsilon  # machine epsilon, 2^-52: twice the largest relative error of rounding to nearest
MIN_RANGE = 1e-280  # an enclosure with smaller ends may be wide by underflow alone


class Formulas(NamedTuple):
    """Functions of several variables as a tape."""

    tape: np.ndarray  #: int64, shape (operations, 3): rows (code, a, b)
    outputs: np.ndarray  #: int64, shape (functions,): rows of the tape with the functions' values
    #: enclosures of the constants, shape (constants, 2), or (points, constants, 2) of many points.
    constants: np.ndarray
