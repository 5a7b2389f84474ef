"""Cosine and sine of an angle at once, and arctangent, in plain arithmetic: a loop over lanes stays packed.

The angle is reduced to at most pi/4 by multiples of pi/2. pi/2 is a sum of three numbers, and the products of the
first two are exact (Cody and Waite); the remainder is a sum of two. Then follow the series of fdlibm, sine to the 13th
power and cosine to the 14th. Errors are below one unit in the last place, as those of the C library.

Sources: W. J. Cody and W. Waite, Software Manual for the Elementary Functions (1980), chapter 8; fdlibm 5.3 (Sun
Microsystems, 1993), e_rem_pio2.c, k_sin.c and k_cos.c, for the constants.
"""

import math

import numpy as np

from kernels.compile.jit import INLINE, njit
from kernels.compile.llvm_formulas import formula

MAX_ANGLE = 1e5  # rad, largest exactly reduced angle: 33 bits of pi/2 times 17 of the multiple are 50
HALF_PI = (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
SINES = (
    *(-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04),
    *(2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10),
)
COSINES = (
    *(4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05),
    *(-2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11),
)


@njit(**INLINE)
def reduce_angle(angle):
    """Return an angle (rad) for :func:`cosine_sine`: itself up to MAX_ANGLE, else its direction within half a turn."""
    return angle if abs(angle) <= MAX_ANGLE else math.atan2(math.sin(angle), math.cos(angle))


@formula
def cosine_sine(angle):
    """Return the cosine and sine of an angle up to MAX_ANGLE, rad; NaN of NaN."""
    turns = np.floor(angle * (2.0 / math.pi) + 0.5)
    above, middle = angle - turns * HALF_PI[0], turns * HALF_PI[1]
    near = above - middle
    remainder = ((above - near) - middle) - turns * HALF_PI[2]
    x = near + remainder
    tail = (near - x) + remainder
    z = x * x
    series = SINES[1] + z * (SINES[2] + z * (SINES[3] + z * (SINES[4] + z * SINES[5])))
    sine = x - ((z * (0.5 * tail - z * x * series) - tail) - z * x * SINES[0])
    series = COSINES[2] + z * (COSINES[3] + z * (COSINES[4] + z * COSINES[5]))
    series = z * (COSINES[0] + z * (COSINES[1] + z * series))
    two_terms = 1.0 - 0.5 * z
    cosine = two_terms + (((1.0 - two_terms) - 0.5 * z) + (z * series - x * tail))
    quarter = turns - 4.0 * np.floor(0.25 * turns)
    odd = (quarter == 1.0) | (quarter == 3.0)
    across, along = (cosine if odd else sine), (sine if odd else cosine)
    return -along if (quarter == 1.0) | (quarter == 2.0) else along, -across if quarter >= 2.0 else across


@formula
def arctangent(t):
    """Return the arctangent of t, |t| <= 1/4, rad; the series ends with t^25, and its truncation is 2e-17."""
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
