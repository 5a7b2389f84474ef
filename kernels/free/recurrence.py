r"""Exact solution of a small motion at equal spacings, by a recurrence of three terms.

**Addition theorem.** For any solution of Euler's equations ``dw_i/dt = c_i w_j w_k`` the differences of the three ``X_i
= c_j c_k w_i^2`` are constant (:mod:`kernels.free.exact`). There is one even function P of the spacing h with

.. math:: w_i(t+h) + w_i(t-h) = \frac{2f_jf_k}{P - \Delta(t)}\,w_i(t), \qquad
          w_i(t+h) - w_i(t-h) = \frac{2c_if_i}{P - \Delta(t)}\,w_j(t)\,w_k(t)

:math:`f_i = \sqrt{P + X_i(0)}`, :math:`\Delta(t) = X_i(t) - X_i(0)`, which is the same for all i. In Jacobi's functions
of ``p h`` the three f are ``p ns``, ``p cs`` and ``p ds``, on the axes of sn, dn and cn; here no axis has a role,
and no parameter is near one. The mean of the X apart, P is Weierstrass' function:

.. math:: P + \bar X = \wp(h) = h^{-2} + \sum_{n\ge2}a_nh^{2n-2}, \qquad
          a_2 = \tfrac1{20}g_2, \quad a_3 = \tfrac1{28}g_3, \quad e_i = \bar X - X_i(0)

**Recurrence.** In first differences :math:`\delta_{n+1} = w_{n+1} - w_n`, with the relative digits of the rate,

.. math:: \delta_{n+1} = \delta_n + \left[g + (2 + g)\frac e{1 - e}\right]w_n, \qquad w_{n+1} = w_n + \delta_{n+1},
          \qquad e = q\,w_b^2

where g is formed without a difference from 2, and the start's part of Δ is included in g and q. Each component has a
g of its own; all share e. Two transverse components do not need the third, and a third of the exact step's work.

**Small motions only.** If no spin can change by more than 1e-8 of itself
(:func:`kernels.estimator.reduction.is_small`), e is below 1e-8 over the number of samples while the window is open and
below 1e-4 over it in the log slope's: ``e + e^2`` stands for ``e/(1 - e)``, which leaves out 1e-12 at most, and no
division is left in the loop. Large motions would lose digits too, because each transverse component has a recurrence of
its own: roundings of a component at its largest grow while it falls back towards the spin axis. They are left to
:func:`kernels.free.exact.step`.

**Rounding.** A rounding of a sample or of a difference continues as a motion of its own size, added to the true one:
over n samples some sqrt(n) roundings of the largest transverse size so far, a little less than by the exact step.

Sources: DLMF 23.9.2-23.9.5 (Laurent series), 22.8 and 23.10 (addition theorems).
"""

import math

from kernels.compile.llvm_formulas import formula
from kernels.free.elliptic_constants import coefficients


@formula
def weierstrass(e1, e2, e3):
    """Return ``wp(1) - 1`` for lattice values e_i of sum zero and sizes below 1/3: relative error of wp 1e-16.

    a_n goes as (2n - 1)/r^(2n), r the distance of the nearest pole but that at 0: where the square of the elliptic
    frequency is below 1/4, r is above 2 pi, and the omitted terms are below 1e-18.

    Args:
        `e1`, `e2`, `e3` (float): The lattice values.
    """
    a2 = (e1 * e1 + e2 * e2 + e3 * e3) * 0.1
    a3 = (e1 * e2 * e3) * (1 / 7)
    s2, s3, t = a2 * a2, a3 * a3, a2 * a3
    a4, a5 = s2 * (1 / 3), t * (3 / 11)
    a6 = (2 * a2 * s2 + 3 * s3) * (1 / 39)
    a7 = s2 * a3 * (2 / 33)
    a8 = 5 * a2 * (11 * a2 * s2 + 36 * s3) * (1 / 7293)
    a9 = a3 * (29 * a2 * s2 + 11 * s3) * (1 / 2717)
    a10 = (2 * (a2 * a8 + a3 * a7 + a4 * a6) + a5 * a5) * (3 / (21 * 7))
    a11 = (a2 * a9 + a3 * a8 + a4 * a7 + a5 * a6) * (6 / (23 * 8))
    a12 = (2 * (a2 * a10 + a3 * a9 + a4 * a8 + a5 * a7) + a6 * a6) * (3 / (25 * 9))
    return ((a12 + a11 + a10) + (a9 + a8) + (a7 + a6)) + ((a5 + a4) + a3) + a2


@formula
def constants(moments, epsilon, start, h):
    """Return the first differences of the components (da, db, dc), and the recurrence's ga, gb, gc and q.

    Args:
        moments (tuple of 3 float): Moments in cyclic order, of the spin axis first, in any common unit near one.
        epsilon (float): Relative size of the perturbation, the unit of the transverse components.
        start (tuple of 3 float): Start, in units of the spin (a = 1 or -1).
        `h` (float): Spacing, radians of spin: ``h max(1, max|c_i|) <= 1/2``, which keeps ``(p h)^2`` below a half.
    """
    (a, b, c), (ca, cb, cc) = start, coefficients(*moments)
    e2, h2 = epsilon * epsilon, h * h
    of_b = cc * ca * e2 * h2
    xa, xb, xc = cb * cc * h2 * (a * a), of_b * (b * b), ca * cb * e2 * h2 * (c * c)
    mean = (xa + xb + xc) * (1 / 3)
    per_P = 1.0 / (1.0 + (weierstrass(mean - xa, mean - xb, mean - xc) - mean))
    # xb and xc are below 1e-10: f_b = 1 + yb/2 and f_c = 1 + yc/2, without squares
    ya, yb, yc = xa * per_P, xb * per_P, xc * per_P
    fa, along = math.sqrt(1.0 + ya), h * math.sqrt(per_P)
    linear = 2.0 * ya / (1.0 + fa)  # 2(f_a - 1)
    gb, gc = linear + yc * fa, linear + yb * fa
    da = 0.5 * a * (yb + yc) + ca * e2 * along * fa * (b * c)
    db = 0.5 * b * gb + cb * (along + 0.5 * along * yb) * (c * a)
    dc = 0.5 * c * gc + cc * (along + 0.5 * along * yc) * (a * b)
    gb, gc = gb - yb * (2.0 + gb - 2.0 * yb), gc - yb * (2.0 + gc - 2.0 * yb)  # (g - 2 yb)/(1 + yb)
    return da, db, dc, yc - yb, gb, gc, of_b * per_P


@formula
def bend_factor(b, q):
    """Return ``e/(1 - e)`` but for e^3: small motions' differences grow as ``[g + (2 + g) e/(1 - e)] x``."""
    e = q * (b * b)
    return e + e * e


@formula
def next_difference(dx, x, g, bend_factor):
    """Return a component's next first difference.

    Args:
        `dx` (float): This first difference.
        `x` (float): The component between the two.
        g, bend_factor (float): The component's g, and e/(1 - e).
    """
    return dx + x * (g + (2.0 + g) * bend_factor)
