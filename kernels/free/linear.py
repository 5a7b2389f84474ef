r"""Linear theory of a perturbed spin about a principal axis.

Close to rotation about axis a at the rate :math:`\omega_0` Euler's equations are, to first order,

.. math:: \dot\omega_b = c_b\omega_0\,\omega_c, \quad \dot\omega_c = c_c\omega_0\,\omega_b
          \quad\Rightarrow\quad \ddot\varepsilon = -\Omega^2\varepsilon, \qquad
          \Omega^2 = -c_bc_c\,\omega_0^2 = \omega_0^2\frac{(I_a - I_b)(I_a - I_c)}{I_bI_c}

so about the axis of least or greatest moment the perturbation oscillates at Ω, and about the intermediate axis it grows
as :math:`e^{\sqrt{|\Omega^2|}t}`. If :math:`\Omega^2 = 0` it is secular: linear in t.

:func:`predict_columns` makes the columns of many points in one pass, by the same formulas, bit for bit: arrays of each
intermediate value take ten times as long.

*The growing share of the perturbation.* In the coordinates :math:`x = \omega_b/\sqrt{|c_b|}`, :math:`y =
\omega_c/\sqrt{|c_c|}` the two modes are orthogonal: :math:`x \pm sy` grows/decays, s the sign of
:math:`c_b\omega_0`. The share is :math:`(x + sy)^2/2(x^2 + y^2)`: 1 on the growing mode, 0 on the exactly decaying
direction, and 0 if nothing grows.

*The axis that the angular momentum encircles* in the body, at the motion's own amplitude, is decided by

.. math:: N = L^2 - 2T I_{mid} = \sum_i I_i(I_i - I_{mid})\,\omega_i^2
            = I_{max}(I_{max} - I_{mid})\,\omega_{max}^2 - I_{min}(I_{mid} - I_{min})\,\omega_{min}^2

the axis of greatest inertia if N > 0, that of least inertia if N < 0: the component along that axis keeps
its sign for ever. N is one difference of two terms, formed in double-double. The start is not exact: cosine and
sine are off by at most 4 units of 2⁻⁵² of themselves (NumPy's bound), and their product with ε, which moves N by less
than 18 such units of the sum of the terms. If |N| is below 20 of them, the motion is on the separatrix within the
precision of doubles. Both terms vanish if all moments are equal, and if ω lies in the plane of two equal moments: such
a spin is steady and encircles no axis. About an axis of the middle moment ε is a common factor and left out, so that it
cannot underflow.

Source: Landau and Lifshitz, Mechanics, section 37 (problem 1 and the text around figure 51); Goldstein, Poole and
Safko, Classical Mechanics, 3rd edition, section 5.6. The signs were derived again from Euler's equations.
"""

import math

import numpy as np

from kernels.compile import columns
from kernels.compile.jit import INLINE, OPTIONS, njit
from kernels.free import elliptic_constants, rigid_body
from kernels.free.triangle import FLATNESS_TOLERANCE

STABLE_MINOR, STABLE_MAJOR, UNSTABLE, MARGINAL, SPHERE = range(5)

REALS = ("omega_squared_theory", "growth_rate_theory", "frequency_theory", "growing_fraction", "triangle_margin")
KINDS = ("regime_theory", "shape", "encircles")
NAMES = REALS + KINDS
REAL, KIND = columns.numbers(REALS), columns.numbers(KINDS)

NO_AXIS, MINOR_AXIS, MAJOR_AXIS, SEPARATRIX = range(4)
SEPARATRIX_TOLERANCE = 20.0 * 2.0**-52  # |N| over the sum of its terms, below which the motion is on the separatrix


def moments_from_axis(I1, I2, I3, axis):
    """Return the moments I1, I2, I3 as arrays (I_a, I_b, I_c) in cyclic order from the spin axis on.

    Args:
        I1, I2, I3, axis (array_like): As in :func:`omega_squared`.
    """
    moments = tuple(np.asarray(x, dtype=np.float64) for x in (I1, I2, I3))
    axis = np.asarray(axis)
    if axis.size and (axis == axis.flat[0]).all():  # most blocks of a grid have one axis
        return np.broadcast_arrays(*(moments[i] for i in rigid_body.cyclic(axis.flat[0])), axis)[:3]
    *moments, axis = np.broadcast_arrays(*moments, axis)
    return tuple(np.choose(i, moments) for i in rigid_body.cyclic(axis))


def omega_squared(I1, I2, I3, omega0, axis):
    r"""Return Ω² = ω0² (I_a - I_b)(I_a - I_c)/(I_b I_c), the signed squared rate of a small perturbation.

    Differences come before ratios and ratios before products: a common scale of the moments from 1e-300 to 1e160
    neither overflows nor loses the sign. Moments are not checked for being positive.

    Args:
        `I1`, `I2`, `I3` (array_like): Principal moments of inertia, in a common unit (kg m2); only their ratios count.
        omega0 (array_like): Spin rate in rad s-1, of either sign.
        axis (array_like of int): Spin axis, 1, 2 or 3. All five broadcast together.

    Returns:
        numpy.ndarray of float64: Ω² in s-2: positive if the perturbation oscillates, negative if it grows, 0 if it
            is secular.
    """
    Ia, Ib, Ic = moments_from_axis(I1, I2, I3, axis)
    return ((Ia - Ib) / Ic * ((Ia - Ic) / Ib)) * np.asarray(omega0, dtype=np.float64) * omega0


def regime(I1, I2, I3, axis):
    """Return the regime of linear theory, from the signs of the differences of the moments alone.

    As int8: STABLE_MINOR (a is the least moment), STABLE_MAJOR (the greatest), UNSTABLE (between), MARGINAL (equal to
    a second moment: Ω² = 0) or SPHERE (all equal).

    Args:
        I1, I2, I3, axis (array_like): As in :func:`omega_squared`.
    """
    Ia, Ib, Ic = moments_from_axis(I1, I2, I3, axis)
    below_b, below_c = Ia < Ib, Ia < Ic
    equal, between = (Ia == Ib) | (Ia == Ic), below_b != below_c
    marginal = np.where(Ib == Ic, np.int8(SPHERE), np.int8(MARGINAL))
    stable = np.where(below_b, np.int8(STABLE_MINOR), np.int8(STABLE_MAJOR))
    return np.where(equal, marginal, np.where(between, np.int8(UNSTABLE), stable))


@njit(nogil=True, **OPTIONS)
def fill_columns(points, cosine, sine, reals, kinds):
    """Write the columns of REALS and KINDS.

    Args:
        points (rigid_body.Spins): n points.
        cosine, sine (numpy.ndarray, shape (n,) or (1,)): Of the perturbation's direction; one if all points share it.
        reals (numpy.ndarray of float64, shape (len(REALS), n)): Written.
        kinds (numpy.ndarray of int8, shape (len(KINDS), n)): Written.
    """
    I1, I2, I3, axis, omega0, epsilon, _ = points
    shared = cosine.size == 1
    x_part, y_part = cosine[0] if shared else 0.0, sine[0] if shared else 0.0
    for i in range(I1.size):
        a, b, c = rigid_body.relabel(I1[i], I2[i], I3[i], axis[i])
        omega, cc, minus_cb = omega0[i], (a - b) / c, (a - c) / b
        square = cc * minus_cb
        rate, regime = math.sqrt(abs(square)), _regime(a, b, c)
        stable = (regime == STABLE_MINOR) | (regime == STABLE_MAJOR)
        reals[REAL.omega_squared_theory, i] = square * omega * omega
        reals[REAL.growth_rate_theory, i] = (rate if regime == UNSTABLE else 0.0) * abs(omega)
        reals[REAL.frequency_theory, i] = (rate if stable else 0.0) * abs(omega)
        x, y = x_part if shared else cosine[i], y_part if shared else sine[i]
        reals[REAL.growing_fraction, i] = _growing_fraction(-minus_cb, cc, omega, x, y)
        reals[REAL.triangle_margin, i], kinds[KIND.shape, i] = _margin_and_shape(I1[i], I2[i], I3[i])
        kinds[KIND.regime_theory, i], kinds[KIND.encircles, i] = regime, _encircled_axis(a, b, c, epsilon[i], x, y)


@njit(**INLINE)
def _regime(a, b, c):
    """Return the regime of a spin about the axis with moment a, from the order of the moments alone."""
    stable = STABLE_MINOR if a < b else STABLE_MAJOR
    kind = UNSTABLE if (a < b) != (a < c) else stable
    equal = SPHERE if b == c else MARGINAL
    return equal if (a == b) | (a == c) else kind


@njit(**INLINE)
def _growing_fraction(cb, cc, omega, cosine, sine):
    """Return the growing mode's fraction of the initial quadratic form |cc| x² + |cb| y²; 0 if nothing grows."""
    unstable = ((cb > 0.0) & (cc > 0.0)) | ((cb < 0.0) & (cc < 0.0))
    # x and y each times sqrt(|c_b c_c|): no division, so nothing to guard
    x, y = cosine * math.sqrt(abs(cc)), sine * math.sqrt(abs(cb))
    along = x + y if (cb > 0.0) == (omega > 0.0) else x - y
    share = 0.5 * along * along / (x * x + y * y)
    return share if unstable else 0.0


@njit(**INLINE)
def _encircled_axis(a, b, c, epsilon, cosine, sine):
    """Return NO_AXIS, MINOR_AXIS, MAJOR_AXIS or SEPARATRIX; moments in cyclic order, the spin axis first."""
    a, b, c, _ = elliptic_constants.scaled(a, b, c)
    smallest, middle, greatest = elliptic_constants.inertia_order(a, b, c)
    I_min, I_mid, I_max = elliptic_constants.by_role(smallest, middle, greatest, a, b, c)
    size = 1.0 if a == I_mid else epsilon
    w_min, _, w_max = elliptic_constants.by_role(smallest, middle, greatest, 1.0, size * cosine, size * sine)
    N = elliptic_constants.separatrix_offset(I_min, I_mid, I_max, w_min, w_max)
    terms = I_max * (I_max - I_mid) * (w_max * w_max) + I_min * (I_mid - I_min) * (w_min * w_min)
    axis = MINOR_AXIS if N < 0.0 else MAJOR_AXIS
    return (axis if abs(N) > SEPARATRIX_TOLERANCE * terms else SEPARATRIX) if terms > 0.0 else NO_AXIS


@njit(**INLINE)
def _margin_and_shape(I1, I2, I3):
    """Return triangle margin and shape."""
    missing = (I1 != I1) | (I2 != I2) | (I3 != I3)
    low, high = min(I1, I2), max(I1, I2)
    smallest, middle, greatest = min(low, I3), max(low, min(high, I3)), max(high, I3)
    margin = (smallest / greatest - (greatest - middle) / greatest) / (1.0 + middle / greatest + smallest / greatest)
    margin = 0.0 if (margin < 0.0) & (margin >= -FLATNESS_TOLERANCE) else margin
    oblate, prolate = smallest == middle, middle == greatest
    kind = rigid_body.OBLATE if oblate else (rigid_body.PROLATE if prolate else rigid_body.ASYMMETRIC)
    shape = rigid_body.SPHERE if oblate & prolate else kind
    return math.nan if missing else margin, rigid_body.ASYMMETRIC if missing else shape


def predict_columns(points):
    """Return the columns of REALS and KINDS by name, of points as :class:`kernels.free.rigid_body.Spins`."""
    phase = points.phase
    if phase.size and (phase == phase[0]).all():  # most blocks of a grid have one phase
        phase = phase[:1]
    reals, kinds = np.empty((len(REALS), points.I1.size)), np.empty((len(KINDS), points.I1.size), dtype=np.int8)
    fill_columns(points, np.cos(phase), np.sin(phase), reals, kinds)
    return dict(zip(REALS, reals, strict=True)) | dict(zip(KINDS, kinds, strict=True))
