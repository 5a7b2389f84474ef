"""Linear theory's columns of a batch, in one pass over its points.

The same formulas as :func:`kernels.linear.omega_squared`, :func:`kernels.linear.regime`, :func:`kernels.linear.rates`,
:func:`kernels.linear.growing_fraction`, :func:`kernels.rigid_body.shape` and
:func:`kernels.triangle.triangle_margin`, term by term and rounding by rounding: those make an array of each
intermediate value, which takes ten times as long.
"""

import math

import numpy as np

from kernels import columns, linear, rigid_body
from kernels.jit import EXACT, EXACT_INLINE, njit
from kernels.triangle import FLAT

REALS = ("omega_squared_theory", "growth_rate_theory", "frequency_theory", "growing_fraction", "triangle_margin")
KINDS = ("regime_theory", "shape")
NAMES = REALS + KINDS
REAL, KIND = columns.numbers(REALS), columns.numbers(KINDS)


@njit(nogil=True, **EXACT)
def fill(I1, I2, I3, axis, omega0, cosine, sine, reals, kinds):
    """Fill the columns of points.

    Parameters
    ----------
    I1, I2, I3, axis, omega0 : numpy.ndarray, shape (n,)
        As for :func:`kernels.linear.omega_squared`.
    cosine, sine : numpy.ndarray, shape (n,) or (1,)
        Of the nudge's direction; one where all points share theirs.
    reals, kinds : numpy.ndarray, shapes (len(REALS), n) and (len(KINDS), n)
        The result, float64 and int8.
    """
    shared = cosine.size == 1
    x_part, y_part = cosine[0] if shared else 0.0, sine[0] if shared else 0.0
    for i in range(I1.size):
        a, b, c = rigid_body.relabel(I1[i], I2[i], I3[i], axis[i])
        omega = omega0[i]
        spin, cc, minus_cb = abs(omega), (a - b) / c, (a - c) / b
        square = cc * minus_cb
        rate, regime = math.sqrt(abs(square)), _regime(a, b, c)
        stable = (regime == linear.STABLE_MINOR) | (regime == linear.STABLE_MAJOR)
        reals[REAL.omega_squared_theory, i] = square * omega * omega
        reals[REAL.growth_rate_theory, i] = (rate if regime == linear.UNSTABLE else 0.0) * spin
        reals[REAL.frequency_theory, i] = (rate if stable else 0.0) * spin
        x, y = x_part if shared else cosine[i], y_part if shared else sine[i]
        reals[REAL.growing_fraction, i] = _growing_fraction(-minus_cb, cc, omega, x, y)
        reals[REAL.triangle_margin, i], kinds[KIND.shape, i] = _body(I1[i], I2[i], I3[i])
        kinds[KIND.regime_theory, i] = regime


@njit(**EXACT_INLINE)
def _regime(a, b, c):
    stable = linear.STABLE_MINOR if a < b else linear.STABLE_MAJOR
    kind = linear.UNSTABLE if (a < b) != (a < c) else stable
    equal = linear.SPHERE if b == c else linear.MARGINAL
    return equal if (a == b) | (a == c) else kind


@njit(**EXACT_INLINE)
def _growing_fraction(cb, cc, omega, cosine, sine):
    unstable = ((cb > 0.0) & (cc > 0.0)) | ((cb < 0.0) & (cc < 0.0))
    x, y = cosine * math.sqrt(abs(cc)), sine * math.sqrt(abs(cb))
    along = x + y if (cb > 0.0) == (omega > 0.0) else x - y
    share = 0.5 * along * along / (x * x + y * y)
    return share if unstable else 0.0


@njit(**EXACT_INLINE)
def _body(I1, I2, I3):
    """Triangle margin and shape."""
    missing = (I1 != I1) | (I2 != I2) | (I3 != I3)
    low, high = min(I1, I2), max(I1, I2)
    least, middle, greatest = min(low, I3), max(low, min(high, I3)), max(high, I3)
    margin = (least / greatest - (greatest - middle) / greatest) / (1.0 + middle / greatest + least / greatest)
    margin = 0.0 if (margin < 0.0) & (margin >= -FLAT) else margin
    oblate, prolate = least == middle, middle == greatest
    one = rigid_body.OBLATE if oblate else (rigid_body.PROLATE if prolate else rigid_body.ASYMMETRIC)
    shape = rigid_body.SPHERE if oblate & prolate else one
    return math.nan if missing else margin, rigid_body.ASYMMETRIC if missing else shape


def columns_of(I1, I2, I3, axis, omega0, phase):
    """Columns of REALS and KINDS by name, of arrays of one length as of :func:`kernels.columns.arrays`."""
    if phase.size and (phase == phase[0]).all():  # a block of a grid mostly has one
        phase = phase[:1]
    reals, kinds = np.empty((len(REALS), I1.size)), np.empty((len(KINDS), I1.size), dtype=np.int8)
    fill(I1, I2, I3, axis, omega0, np.cos(phase), np.sin(phase), reals, kinds)
    return dict(zip(REALS, reals, strict=True)) | dict(zip(KINDS, kinds, strict=True))
