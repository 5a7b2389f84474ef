r"""Scaling collapse: which points of a block have one and the same motion, up to units.

A common factor of the moments drops out of Euler's equations, and the spin rate is no more than a unit of time. So the
motion of a point, in radians of spin and in units of the nudge, depends on

.. math:: (I_a/I_c,\ I_b/I_c,\ \varepsilon,\ \varphi,\ \mathrm{sign}\,\omega_0)

alone, with (a, b, c) cyclic from the spin axis. Points whose five numbers are equal to the bit are one motion; the
integration of one of them gives all of them.
"""

import math

import numpy as np
from numba import njit

from kernels import rigid_body
from kernels.rigid_body import INLINE, OPTIONS

FREE = -1


@njit(**INLINE)
def _bits(value):
    """The 64 bits of a double; the two zeros are one number."""
    return np.uint64(np.float64(value + 0.0).view(np.int64))


@njit(**INLINE)
def _hash(x, y, z, u, v):
    """A hash of five doubles: their bits times odd constants, finished as MurmurHash3 is."""
    bits = _bits(x) * np.uint64(0x9E3779B97F4A7C15) + _bits(y) * np.uint64(0xC2B2AE3D27D4EB4F)
    bits += _bits(z) * np.uint64(0x165667B19E3779F9) + _bits(u) * np.uint64(0x27D4EB2F165667C5) + _bits(v)
    bits = (bits ^ (bits >> np.uint64(33))) * np.uint64(0xFF51AFD7ED558CCD)
    bits = (bits ^ (bits >> np.uint64(33))) * np.uint64(0xC4CEB9FE1A85EC53)
    return bits ^ (bits >> np.uint64(33))


@njit(nogil=True, **OPTIONS)
def representatives(I1, I2, I3, axis, omega0, epsilon, phase):
    """The first point of the same motion, for each point; a point that is no number stands for itself.

    Parameters
    ----------
    I1, I2, I3, axis, omega0, epsilon, phase : numpy.ndarray, shape (n,)
        Points, as for :func:`kernels.survey.measured`.

    Returns
    -------
    numpy.ndarray of int64, shape (n,)
        Number of a point, its own or a smaller one.
    """
    n = I1.size
    room = 1
    while room < 2 * n:
        room *= 2
    table, keys = np.full(room, FREE), np.empty((n, 5))
    first = np.empty(n, dtype=np.int64)
    for i in range(n):
        Ia, Ib, Ic = rigid_body.relabel(I1[i], I2[i], I3[i], axis[i])
        keys[i, 0], keys[i, 1], keys[i, 2] = Ia / Ic, Ib / Ic, epsilon[i]
        keys[i, 3], keys[i, 4] = phase[i], 1.0 if omega0[i] > 0.0 else -1.0
        first[i] = i
        if not math.isfinite(keys[i, 0] + keys[i, 1] + keys[i, 2] + keys[i, 3] + omega0[i]):
            continue
        slot = np.int64(_hash(keys[i, 0], keys[i, 1], keys[i, 2], keys[i, 3], keys[i, 4]) & np.uint64(room - 1))
        while table[slot] != FREE:
            other = table[slot]
            same = True
            for j in range(5):
                same &= keys[i, j] == keys[other, j]
            if same:
                first[i] = other
                break
            slot = (slot + 1) & (room - 1)
        if first[i] == i:
            table[slot] = i
    return first
