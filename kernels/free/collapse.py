r"""Scaling collapse: points with the same motion up to units.

A common factor of the moments drops out of Euler's equations, and the spin rate is no more than a unit of time. So the
motion of a point, in radians of spin and in units of the perturbation, depends on

.. math:: (I_a/I_c,\ I_b/I_c,\ \varepsilon,\ \varphi,\ \mathrm{sign}\,\omega_0)

alone, with (a, b, c) cyclic from the spin axis. Points with these five numbers equal to the bit are one motion,
and are integrated once.
"""

import numpy as np

from kernels.free import linear


def distinct(points):
    """Return the distinct motions of Spins and the motion of each point; a point with NaN or inf has its own.

    Returns:
        first (numpy.ndarray of int64, shape (m,)): The first point of each motion, in ascending order.
        motion (numpy.ndarray of int64, shape (n,)): The number of each point's motion, 0 to m - 1.
    """
    with np.errstate(all="ignore"):
        a, b, c = linear.moments_from_axis(points.I1, points.I2, points.I3, points.axis)
        keys = np.stack([a / c, b / c, points.epsilon, points.phase, points.omega0 > 0.0])
        is_finite = np.isfinite(keys.sum(axis=0) + points.omega0)
    order = np.lexsort(keys)
    differs = (np.diff(keys[:, order], axis=1, prepend=np.nan) != 0.0).any(axis=0)
    starts = np.flatnonzero(differs | ~is_finite[order])
    order_of_motions = np.argsort(order[starts])  # motions are numbered by their first points
    motion = np.empty_like(order)
    motion[order] = np.repeat(np.argsort(order_of_motions), np.diff(starts, append=order.size))
    return order[starts][order_of_motions], motion
