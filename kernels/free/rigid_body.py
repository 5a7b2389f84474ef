r"""Euler's equations of the free rigid body, and their conserved quantities.

.. math:: I_a \dot\omega_a = (I_b - I_c)\,\omega_b\omega_c \qquad (a, b, c) \text{ cyclic}

or, with the Euler coefficients :math:`c_a = (I_b - I_c)/I_a`, simply
:math:`\dot\omega_a = c_a\,\omega_b\omega_c`. A common factor of the moments drops out of every c_i, and a possible body
(:math:`I_a \le I_b + I_c`) has :math:`|c_i| \le 1`.

Conserved along every solution:

* twice the kinetic energy, :math:`2E = \sum I_i\omega_i^2`,
* the squared angular momentum, :math:`L^2 = \sum I_i^2\omega_i^2`,
* their combination that vanishes on the principal axis a, the perturbation's own invariant,
  :math:`J = I_b(I_b - I_a)\,\omega_b^2 + I_c(I_c - I_a)\,\omega_c^2 = L^2 - 2E I_a`.
  Divided by :math:`I_bI_c` it is :math:`c_b\omega_c^2 - c_c\omega_b^2`, which is the form used here: for a small
  perturbation 2E and L² hardly change with an error that changes J in full.

Source: Landau and Lifshitz, Mechanics, section 36, equations (36.5) and 37.1.
"""

from typing import NamedTuple

import numpy as np

from kernels.compile import columns
from kernels.compile.jit import INLINE, njit
from kernels.compile.llvm_formulas import formula
from kernels.free.triangle import sort_moments

ASYMMETRIC, OBLATE, PROLATE, SPHERE = range(4)


class Spins(NamedTuple):
    """Perturbed spins, arrays of shape (n,) of the types that kernels are compiled for (:func:`points_of`)."""

    I1: np.ndarray  #: principal moments in a common unit, > 0
    I2: np.ndarray
    I3: np.ndarray
    axis: np.ndarray  #: axis of the spin: 1, 2 or 3
    omega0: np.ndarray  #: rad s-1, not 0
    epsilon: np.ndarray  #: size of the perturbation relative to the spin, between 0 and 1
    phase: np.ndarray  #: its direction in the (b, c) plane, rad


def points_of(points):
    """Return the :class:`Spins` of a mapping of its names to numbers or arrays, which are broadcast."""
    dtypes = [np.int64 if name == "axis" else np.float64 for name in Spins._fields]
    return Spins(*columns.arrays(*(points[name] for name in Spins._fields), dtypes=dtypes))


def cyclic(axis):
    """Return the indices of (I_a, I_b, I_c) in (I1, I2, I3), cyclic from the spin axis, 1, 2 or 3 (an array's), on.

    Raises:
        ValueError: If an axis is none of 1, 2, 3.
    """
    axis = np.asarray(axis)
    if not np.isin(axis, (1, 2, 3)).all():
        raise ValueError(f"axis must be 1, 2 or 3, not {axis!r}")
    a = axis.astype(np.int64) - 1
    return a, (a + 1) % 3, (a + 2) % 3


@njit(**INLINE)
def relabel(x1, x2, x3, axis):
    """Return the values `x1`, `x2`, `x3` of the axes 1, 2, 3 in cyclic order from ``axis`` on, as (I_a, I_b, I_c)."""
    return (
        x1 if axis == 1 else (x2 if axis == 2 else x3),
        x2 if axis == 1 else (x3 if axis == 2 else x1),
        x3 if axis == 1 else (x1 if axis == 2 else x2),
    )


@formula
def euler_coefficients(Ia, Ib, Ic):
    """Return c_i = (I_j - I_k)/I_i of Euler's equations, of moments in cyclic order in any common unit.

    The difference is formed before the ratio: the sign of each is exact, down to moments one ulp apart.

    Args:
        `Ia`, `Ib`, `Ic` (float): Moments of inertia, the spin axis first.
    """
    return (Ib - Ic) / Ia, (Ic - Ia) / Ib, (Ia - Ib) / Ic


@formula
def derivative(wa, wb, wc, ca, cb, cc):
    """Return the right-hand side of Euler's equations: (c_a w_b w_c, c_b w_c w_a, c_c w_a w_b), in rad s-2.

    Args:
        `wa`, `wb`, `wc` (float): Angular velocity, rad s-1.
        `ca`, `cb`, `cc` (float): Euler coefficients.
    """
    return ca * (wb * wc), cb * (wc * wa), cc * (wa * wb)


@formula
def twice_energy(wa, wb, wc, Ia, Ib, Ic):
    """Return twice the kinetic energy, 2E = sum I_i w_i^2, kg m2 s-2.

    Args:
        `wa`, `wb`, `wc` (float): Angular velocity, rad s-1.
        `Ia`, `Ib`, `Ic` (float): Moments of inertia, kg m2.
    """
    return Ia * (wa * wa) + (Ib * (wb * wb) + Ic * (wc * wc))


@formula
def squared_momentum(wa, wb, wc, Ia, Ib, Ic):
    """Return the squared angular momentum, L^2 = sum (I_i w_i)^2, kg2 m4 s-2.

    Args:
        `wa`, `wb`, `wc` (float): Angular velocity, rad s-1.
        `Ia`, `Ib`, `Ic` (float): Moments of inertia, kg m2.
    """
    La, Lb, Lc = Ia * wa, Ib * wb, Ic * wc
    return La * La + (Lb * Lb + Lc * Lc)


@formula
def perturbation_invariant(wb, wc, cb, cc):
    """Return J/(I_b I_c) = c_b w_c^2 - c_c w_b^2 and the sum of its absolute terms, both s-2.

    Args:
        `wb`, `wc` (float): Transverse components of the angular velocity, rad s-1.
        `cb`, `cc` (float): Euler coefficients.
    """
    p = cb * (wc * wc)
    q = cc * (wb * wb)
    return p - q, abs(p) + abs(q)


def shape(I1, I2, I3):
    """Return the symmetry class: ASYMMETRIC, OBLATE (two least equal), PROLATE (two greatest equal) or SPHERE.

    Equality is exact equality of floats.

    Args:
        `I1`, `I2`, `I3` (array_like): Moments in a common unit; they are broadcast together.

    Returns:
        numpy.ndarray of int8: The symmetry classes.
    """
    smallest, middle, greatest = sort_moments(I1, I2, I3)
    oblate, prolate = smallest == middle, middle == greatest
    kind = np.select([oblate & prolate, oblate, prolate], [SPHERE, OBLATE, PROLATE], ASYMMETRIC)
    return kind.astype(np.int8)
