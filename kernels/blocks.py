"""Blocks: how the points of a batch are cut into groups of W lanes that go through the same work together.

The lane loop stands innermost in every batch and W is known when it is compiled, so that LLVM makes packed
instructions of it. No lane reads another, and what is left of a block is padded with copies of its last point: in which
order points are taken, and which of them share a block, changes no bit of any point.
"""

import numpy as np
from numba import int64, njit, types

from kernels.options import OPTIONS

W = 32
LINE = 64  # bytes of a line of cache, and of the longest vector


@njit(nogil=True, **OPTIONS)
def scratch(rows):
    """Zeros for so many rows of W lanes, (rows * W,), where no vector lies across two lines of the cache."""
    S = np.zeros(rows * W + LINE // 8)
    first = (-S.ctypes.data) % LINE // 8
    return S[first : first + rows * W]


@njit(nogil=True, **OPTIONS)
def rows_of(count):
    """As :func:`scratch`, shape (count, W)."""
    return scratch(count).reshape(count, W)


@njit(types.UniTuple(int64[::1], 2)(int64[::1], int64), nogil=True, **OPTIONS)
def cut(keys, levels):
    """Order of the points and starts of the blocks: points of one kind together, sorted by key, W at a time.

    A counting sort: equal keys keep the order of their points.

    Parameters
    ----------
    keys : numpy.ndarray of int64, shape (n,)
        kind * levels + level, n > 0; not negative, and not much above n, for as many numbers are kept.
    levels : int
        Points share a block only where key // levels is equal.

    Returns
    -------
    order : numpy.ndarray of int64, shape (n,)
        Numbers of the points.
    starts : numpy.ndarray of int64, shape (blocks + 1,)
        The points of block j are order[starts[j]:starts[j + 1]].
    """
    greatest = 0
    for key in keys:
        greatest = max(greatest, key)
    after = np.zeros(greatest + 2, dtype=np.int64)
    for key in keys:
        after[key + 1] += 1
    for key in range(1, after.size):
        after[key] += after[key - 1]
    starts, position = [0], after.copy()
    for kind in range(0, after.size - 1, levels):
        first, last = after[kind], after[min(kind + levels, after.size - 1)]
        for start in range(first, last, W):
            starts.append(min(start + W, last))
    order = np.empty(keys.size, dtype=np.int64)
    for i in range(keys.size):
        order[position[keys[i]]] = i
        position[keys[i]] += 1
    return order, np.array(starts)
