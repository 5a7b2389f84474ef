r"""Measurement of a signed rate² and its standard error from samples of a perturbation, blind to any theory.

*The recurrence.* Sampled every h, both transverse components of any linear second-order motion obey

.. math:: \varepsilon(t+h) - 2\varepsilon(t) + \varepsilon(t-h) = -2D\,\varepsilon(t), \qquad
          D = 1 - \cos\Omega h \ \text{(stable)}, \quad 1 - \cosh\lambda h \ \text{(unstable)}

so D is a least-squares slope over all samples and both components: no choice of regime, no transient to skip. The
sums are those of the residuals after :math:`D_0`, the D of the first three samples,

.. math:: r = \varepsilon(t+h) - 2\varepsilon(t) + \varepsilon(t-h) + 2D_0\,\varepsilon(t), \qquad
          D = D_0 - \frac{\sum r\varepsilon}{2\sum\varepsilon^2}, \qquad
          \sigma_D^2 = \frac{\sum r^2 - (\sum r\varepsilon)^2/\sum\varepsilon^2}{(n - 1)\,4\sum\varepsilon^2}

in one pass and without the cancellation that sums of the second differences themselves would suffer. With
:math:`s^2 = D/2` the signed rate² is :math:`(2\arcsin s/h)^2`, or minus :math:`(2\,\mathrm{arsinh}|s|/h)^2` if D is
negative; arccos(1 - D) would lose the small rates.

The standard error is the scatter only: it does not include the bias of a finite amplitude.

*The log slope.* The second estimator is a straight line through the logarithm of the transverse size, inside a
window of its own.

Source: derived here; the recurrence is Prony's method for one frequency (Hildebrand, Introduction to Numerical
Analysis, section 9.4).
"""

import math

import numpy as np

from kernels.compile.jit import INLINE, OPTIONS, njit
from kernels.compile.llvm_formulas import formula, parse_formula

MAX_GROWTH = 10.0  # the window ends when the transverse size exceeds this multiple of its initial value
# The window also ends below this fraction of the initial size: squared, such a sample weighs less in the sums than the
# rounding of the first samples.
MIN_SIZE = 1e-6
# The log slope's window begins and ends at these multiples of the initial size, and ends at this fraction of the spin.
LOG_FROM, LOG_TO, LOG_BELOW = 2.0, 1000.0, 1e-2
MIN_E_FOLDS = 2.0  # growth over the log slope's window, below which it is not compared with the rate
# A motion small enough for the log slope does not grow if D of its first three samples exceeds this: their bias is
# below # 1e-5.
MIN_ROTATING_D = 1e-3
LN2 = 0.6931471805599453
MIN_SAMPLES = 5  # number of samples below which the status is short_window
MAX_SERIES_D = 0.13  # |1 - cosh x| at the largest angle between samples, x = 1/2 rad, with a margin of 2 %
ARCSINE_SERIES = tuple(2.0 ** (n + 1) / (n * n * math.comb(2 * n, n)) for n in range(1, 15))


@formula
def second_difference(x, x1, x2):
    """Return ``x`` - 2 ``x1`` + ``x2`` of samples, `x2` the first; as two differences, which keep digits."""
    return (x - x1) - (x1 - x2)


@formula
def dot(b, c, b1, c1):
    """Return the scalar product of the vectors (`b`, `c`) and (`b1`, `c1`) in the transverse plane."""
    return b * b1 + c * c1


@formula
def first_guess(now, before, earlier):
    """Return D_0 (dimensionless) of the samples `now`, `before` and `earlier`, each (b, c); NaN if `before` is zero."""
    (b, c), (b1, c1), (b2, c2) = now, before, earlier
    projection = second_difference(b, b1, b2) * b1 + second_difference(c, c1, c2) * c1
    return -0.5 * projection / (b1 * b1 + c1 * c1)


@formula
def residual(now, before, earlier, guess):
    """Return the residual of three successive samples, of each component, in their unit.

    Args:
        now, before, earlier (tuple of 2 float): The samples, each (b, c).
        guess (float): D_0.
    """
    (b, c), (b1, c1), (b2, c2) = now, before, earlier
    return second_difference(b, b1, b2) + 2.0 * guess * b1, second_difference(c, c1, c2) + 2.0 * guess * c1


@formula
def residual_sums(now, before, earlier, guess):
    """Return the terms of three samples in the sums of r x, r r and x x, in the square of the samples' unit.

    Args:
        now, before, earlier, guess: As in :func:`residual`.
    """
    (rb, rc), (b1, c1) = residual(now, before, earlier, guess), before
    return dot(rb, rc, b1, c1), dot(rb, rc, rb, rc), dot(b1, c1, b1, c1)


@njit(**OPTIONS)
def rate_squared(D, spacing):
    """Return the signed rate² (s-2) and its derivative by D, which is positive, 2/h² at D = 0.

    D, at most 2, is 1 - cos(Omega h) or 1 - cosh(lambda h) of samples h = ``spacing`` apart, in s or any unit of time.
    """
    s = math.sqrt(abs(0.5 * D))
    if s < 1e-9:
        return 2.0 * D / spacing / spacing, 2.0 / spacing / spacing
    if D > 0.0:
        angle = math.asin(min(s, 1.0))
        value, slope = 4.0 * angle * angle, 2.0 * angle / (s * math.sqrt(max(1.0 - s * s, 1e-300)))
    else:
        angle = math.asinh(s)
        value, slope = -4.0 * angle * angle, 2.0 * angle / (s * math.sqrt(1.0 + s * s))
    return value / spacing / spacing, slope / spacing / spacing


# rate_squared(D) for h = 1 and |D| up to TURN with its derivative, in plain arithmetic: a loop over lanes stays packed.
# 4 arcsin²√(D/2) = Σ 2^(n+1) Dⁿ/(n² C(2n, n)), of either sign; the terms after n = 14 are below 1e-18 of it.
_SERIES_CODE = "\n".join(
    [
        "value, slope = TURNS[13], 14 * TURNS[13]",
        *(f"value, slope = value * D + TURNS[{n - 1}], slope * D + {n} * TURNS[{n - 1}]" for n in range(13, 1, -1)),
        "return (value * D + TURNS[0]) * D, slope * D + TURNS[0]",
    ]
)
rate_squared_of_turn = parse_formula("rate_squared_of_turn", ["D"], _SERIES_CODE, {"TURNS": ARCSINE_SERIES})


@njit(**INLINE)
def multiply_products(P, up, Q, over, x):
    """Return the products of :func:`slope_of_products` after one more factor.

    Args:
        `P`, up, `Q`, over (float): The products: mantissas in [1, 2) and exponents of 2.
        `x` (float): The factor, > 0.
    """
    bits = np.float64(P * x).view(np.int64)
    up = up + float((bits >> 52) - 1023)
    P = np.int64((bits & 0xFFFFFFFFFFFFF) | 0x3FF0000000000000).view(np.float64)
    Q = Q * P
    carry = Q >= 2.0
    return P, up, (0.5 * Q if carry else Q), over + (up + 1.0 if carry else up)


@njit(**INLINE)
def add_log_sample(size, min_size, max_size, is_open, sums):
    """Return whether a sample is inside the log slope's window, and the sums, to which it is added if it is.

    The window begins at a size of at least min_size, while the main window is open, and ends at either limit: the
    samples inside are consecutive.

    Args:
        size, min_size, max_size (float): Size of the sample, and limits of the window.
        is_open (bool): Whether the main window is open.
        sums (tuple of 8 float): 1 if the window can still begin or continue; number of samples; their products, as in
            :func:`slope_of_products`; size of the first and of the last.
    """
    can_begin, n, P, up, Q, over, first, log_product = sums
    large, has_start = size >= min_size, n > 0.0
    stays = (size <= max_size) & (large | ~has_start) & (is_open | has_start)
    inside = large & stays & (can_begin > 0.0)
    newP, new_up, newQ, new_over = multiply_products(P, up, Q, over, size)
    P, up = newP if inside else P, new_up if inside else up
    Q, over = newQ if inside else Q, new_over if inside else over
    first, log_product = size if inside & ~has_start else first, size if inside else log_product
    return inside, (can_begin if stays else 0.0, n + (1.0 if inside else 0.0), P, up, Q, over, first, log_product)


@njit(**INLINE)
def slope_of_products(n, P, up, Q, over):
    r"""Return the least-squares slope of ln x against the sample's number, from products of successive x.

    With :math:`2^{up}P = \prod x_j` and :math:`2^{over}Q = \prod_i\prod_{j\le i}x_j`, j from 0 to n - 1, the slope is
    :math:`[\tfrac12(n + 1)\ln P - \ln Q]\cdot12/(n(n^2 - 1))`: two logarithms a line in place of one a sample.

    Args:
        `n` (float): Number of samples, at least 2.
        `P`, up, `Q`, over (float): The products: mantissas and exponents of 2.
    """
    log_product, log_double_product = logarithm(P) + up * LN2, logarithm(Q) + over * LN2
    return (0.5 * (n + 1.0) * log_product - log_double_product) * 12.0 / (n * (n * n - 1.0))


@njit(**INLINE)
def logarithm(x):
    """Return the natural logarithm of a normal positive double, in plain arithmetic: a loop over lanes stays packed.

    With x = 2^e m, m in (sqrt(1/2), sqrt(2)], and s = (m - 1)/(m + 1): ln x = e ln 2 + 2 artanh s. The series in s² is
    cut after s^23, which leaves 3e-19 of 2 artanh s at the ends.
    """
    bits = np.float64(x).view(np.int64)
    exponent = float((bits >> 52) - 1023)
    mantissa = np.int64((bits & 0xFFFFFFFFFFFFF) | 0x3FF0000000000000).view(np.float64)
    upper = mantissa > 1.4142135623730951
    mantissa = mantissa * 0.5 if upper else mantissa
    exponent = exponent + 1.0 if upper else exponent
    s = (mantissa - 1.0) / (mantissa + 1.0)
    z = s * s
    series = z * (1 / 23) + 1 / 21
    series = series * z + 1 / 19
    series = series * z + 1 / 17
    series = series * z + 1 / 15
    series = series * z + 1 / 13
    series = series * z + 1 / 11
    series = series * z + 1 / 9
    series = series * z + 1 / 7
    series = series * z + 1 / 5
    series = series * z + 1 / 3
    return exponent * LN2 + (2.0 * s + 2.0 * s * z * series)
