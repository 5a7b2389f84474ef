r"""Scaling collapse: points with the same motion up to units.

A common factor of the moments drops out of Euler's equations, and the spin rate is no more than a unit of time. So the
motion of a point, in radians of spin and in units of the perturbation, depends on

.. math:: (I_a/I_c,\ I_b/I_c,\ \varepsilon,\ \varphi,\ \mathrm{sign}\,\omega_0)

alone, with (a, b, c) cyclic from the spin axis. Points with these five numbers equal to the bit are one motion,
and are integrated once.
"""

import math

import numpy as np

from kernels.compile.jit import INLINE, OPTIONS, njit
from kernels.free import rigid_body

EMPTY_SLOT = np.int32(-1)


@njit(**INLINE)
def _bits(value):
    """Return the 64 bits of a double; the two zeros are one number."""
    return np.uint64(np.float64(value + 0.0).view(np.int64))


@njit(**INLINE)
def _hash(x, y, z, u, v):
    """Return a hash of five doubles: their bits times odd constants, finished as MurmurHash3 is."""
    bits = _bits(x) * np.uint64(0x9E3779B97F4A7C15) + _bits(y) * np.uint64(0xC2B2AE3D27D4EB4F)
    bits += _bits(z) * np.uint64(0x165667B19E3779F9) + _bits(u) * np.uint64(0x27D4EB2F165667C5) + _bits(v)
    bits = (bits ^ (bits >> np.uint64(33))) * np.uint64(0xFF51AFD7ED558CCD)
    bits = (bits ^ (bits >> np.uint64(33))) * np.uint64(0xC4CEB9FE1A85EC53)
    return bits ^ (bits >> np.uint64(33))


@njit(nogil=True, **OPTIONS)
def distinct(points):
    """Return the distinct motions of Spins and the motion of each point; a point with NaN or inf has its own.

    Returns:
        first (numpy.ndarray of int64, shape (m,)): The first point of each motion, in ascending order.
        motion (numpy.ndarray of int32, shape (n,)): The number of each point's motion, 0 to m - 1.
    """
    I1, I2, I3, axis, omega0, epsilon, phase = points
    n = I1.size
    table_size = 1
    while table_size < 2 * n:
        table_size *= 2
    table, keys = np.full(table_size, EMPTY_SLOT, dtype=np.int32), np.empty((n, 5))
    first, motion = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int32)
    count, last = 0, EMPTY_SLOT
    for i in range(n):
        Ia, Ib, Ic = rigid_body.relabel(I1[i], I2[i], I3[i], axis[i])
        key = (Ia / Ic, Ib / Ic, epsilon[i], phase[i], 1.0 if omega0[i] > 0.0 else -1.0)
        nth = EMPTY_SLOT
        if math.isfinite(key[0] + key[1] + key[2] + key[3] + omega0[i]):
            # neighbouring points of a grid mostly differ by their spin rates only
            if last != EMPTY_SLOT and _is_same(keys, last, key):
                nth = last
            else:
                slot = np.int64(_hash(*key) & np.uint64(table_size - 1))
                while table[slot] != EMPTY_SLOT and not _is_same(keys, table[slot], key):
                    slot = (slot + 1) & (table_size - 1)
                nth = table[slot]
                if nth == EMPTY_SLOT:
                    table[slot] = count
        if nth == EMPTY_SLOT:
            nth = np.int32(count)
            first[nth] = i
            keys[nth, 0], keys[nth, 1], keys[nth, 2], keys[nth, 3], keys[nth, 4] = key
            count += 1
        motion[i] = last = nth
    return first[:count].copy(), motion


@njit(**INLINE)
def _is_same(keys, number, key):
    is_equal = (keys[number, 0] == key[0]) & (keys[number, 1] == key[1]) & (keys[number, 2] == key[2])
    return is_equal & (keys[number, 3] == key[3]) & (keys[number, 4] == key[4])
