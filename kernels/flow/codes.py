"""Codes and limits in the arguments and results of measured flows: columns of a fit, regimes, orders of steps.

A module that writes or reads them need not import the kernels themselves, which are compiled by their import.
"""

import sys

ORDER, FAR_ORDER = 12, 20  # orders of the generated Taylor steps: near equilibria, and of free motions

UNIT = sys.float_info.epsilon  # machine epsilon, 2^-52: twice the largest relative error of rounding to nearest

# Columns of a raw result of kernels.flow.spectrum; from HEAD on: real parts, imaginary parts, errors of both (n each).
(EQUATIONS, SCATTER, EXCITATION, ODD, SUM, SUM_ERROR, PRODUCT, PRODUCT_ERROR, DISCRIMINANT, DISCRIMINANT_ERROR) = range(
    10
)
HEAD = 10
MIN_EXCITATION = 1.5e-4  # smallest singular value of the samples over the largest; below it, a mode was not excited
MIN_IMAG_GAP = 1e-6  # imaginary parts times the sample spacing that differ by less count as equal in the sorting
ASYMPTOTICALLY_STABLE, STABLE, UNSTABLE, FLUTTER, MARGINAL = range(5)  # regimes of eigenvalues

# Regimes of kernels.flow.floquet by their number + 1, and smooth invariants of two degrees of freedom.
REGIMES = ("undetermined", "stable", "asymptotically_stable", "unstable", "period_doubling", "flutter", "marginal")
INVARIANTS = ("first_invariant", "second_invariant", "krein_discriminant", "det_minus_identity", "det_plus_identity")
