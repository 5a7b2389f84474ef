r"""Linear theory of a spin that is nudged off a principal axis.

Close to rotation about axis a at the rate :math:`\omega_0` Euler's equations are, to first order,

.. math:: \dot\omega_b = c_b\omega_0\,\omega_c, \quad \dot\omega_c = c_c\omega_0\,\omega_b
          \quad\Rightarrow\quad \ddot\varepsilon = -\Omega^2\varepsilon, \qquad
          \Omega^2 = -c_bc_c\,\omega_0^2 = \omega_0^2\frac{(I_a - I_b)(I_a - I_c)}{I_bI_c}

so about the axis of least or greatest moment the nudge oscillates at Ω, and about the middle one it grows as
:math:`e^{\sqrt{|\Omega^2|}t}`. Where :math:`\Omega^2 = 0` it is secular: linear in t.

Source: Landau and Lifshitz, Mechanics, section 37 (problem 1 and the text around figure 51); Goldstein, Poole and
Safko, Classical Mechanics, 3rd edition, section 5.6. The signs were derived again from Euler's equations.
"""

import numpy as np

from kernels.rigid_body import cyclic

STABLE_MINOR, STABLE_MAJOR, UNSTABLE, MARGINAL, SPHERE = range(5)


def seen_from(I1, I2, I3, axis):
    """Broadcast arrays (I_a, I_b, I_c) of the moments as seen from the spin axis."""
    moments = tuple(np.asarray(x, dtype=np.float64) for x in (I1, I2, I3))
    axis = np.asarray(axis)
    if axis.size and (axis == axis.flat[0]).all():  # a block of a grid mostly has one axis
        return np.broadcast_arrays(*(moments[i] for i in cyclic(axis.flat[0])), axis)[:3]
    *moments, axis = np.broadcast_arrays(*moments, axis)
    return tuple(np.choose(i, moments) for i in cyclic(axis))


def omega_squared(I1, I2, I3, omega0, axis):
    r"""Return Ω² = ω0² (I_a - I_b)(I_a - I_c)/(I_b I_c), the signed squared rate of a small perturbation.

    Differences come before ratios and ratios before products: a common scale of the moments from 1e-300 to 1e160
    neither overflows nor loses the sign. Moments are not checked for being positive.

    Args:
        I1, I2, I3 (array_like): Principal moments of inertia, in a common unit (kg m2); only their ratios count.
        omega0 (array_like): Spin rate in rad s-1, of either sign.
        axis (array_like of int): Spin axis, 1, 2 or 3. All five broadcast together.

    Returns:
        numpy.ndarray of float64: Ω² in s-2: positive where the perturbation oscillates, negative where it grows, 0
            where it is secular.
    """
    Ia, Ib, Ic = seen_from(I1, I2, I3, axis)
    return ((Ia - Ib) / Ic * ((Ia - Ic) / Ib)) * np.asarray(omega0, dtype=np.float64) * omega0


def regime(I1, I2, I3, axis):
    """Return the regime of linear theory, from the signs of the differences of the moments alone.

    Args:
        I1, I2, I3, axis (array_like): As for :func:`omega_squared`.

    Returns:
        numpy.ndarray of int8: STABLE_MINOR (a is the least moment), STABLE_MAJOR (the greatest), UNSTABLE (between),
            MARGINAL (equal to one other: Ω² = 0) or SPHERE (all equal).
    """
    Ia, Ib, Ic = seen_from(I1, I2, I3, axis)
    below_b, below_c = Ia < Ib, Ia < Ic
    equal, between = (Ia == Ib) | (Ia == Ic), below_b != below_c
    marginal = np.where(Ib == Ic, np.int8(SPHERE), np.int8(MARGINAL))
    stable = np.where(below_b, np.int8(STABLE_MINOR), np.int8(STABLE_MAJOR))
    return np.where(equal, marginal, np.where(between, np.int8(UNSTABLE), stable))
