"""Blocks: how the points of a batch are cut into groups of W lanes that go through the same work together.

The lane loop stands innermost in every batch and W is known when it is compiled, so that LLVM makes packed
instructions of it. No lane reads another, and what is left of a block is padded with copies of its last point: in which
order points are taken, and which of them share a block, changes no bit of any point.
"""

import numpy as np

from kernels.compile.jit import OPTIONS, float64, njit

W = 32
LINE = 64  # bytes of a line of cache, and of the longest vector
ROWS, LANES = float64[::1], float64[:, ::1]  # types of rows of lanes, flat and by row


@njit(nogil=True, **OPTIONS)
def scratch(rows):
    """Return zeros for so many rows of W lanes, (rows * W,), where no vector lies across two lines of the cache."""
    S = np.zeros(rows * W + LINE // 8)
    first = (-S.ctypes.data) % LINE // 8
    return S[first : first + rows * W]


@njit(nogil=True, **OPTIONS)
def rows_of(count):
    """Return zeros as :func:`scratch`, shape (count, W)."""
    return scratch(count).reshape(count, W)


@njit(nogil=True, **OPTIONS)
def cut(keys, levels):
    """Return the order of the points and the starts of blocks: points of one kind, sorted by key, W at a time.

    A counting sort: equal keys keep the order of their points. The points of block j are order[starts[j]:starts[j +
    1]].

    Args:
        keys (numpy.ndarray of int64, shape (n,)): kind * levels + level, n > 0; not negative, and not much above n, for
            as many numbers are kept.
        levels (int): Points share a block only where key // levels is equal.
    """
    greatest = 0
    for i in range(keys.size):
        greatest = max(greatest, keys[i])
    kinds = greatest // levels + 1
    position = np.zeros(kinds * levels, dtype=np.int64)
    for i in range(keys.size):
        position[keys[i]] += 1
    blocks = 0
    for kind in range(kinds):
        points = 0
        for key in range(kind * levels, (kind + 1) * levels):
            points += position[key]
        blocks += (points + W - 1) // W
    starts, block, before = np.empty(blocks + 1, dtype=np.int64), 0, 0
    for kind in range(kinds):
        first = before
        for key in range(kind * levels, (kind + 1) * levels):
            before, position[key] = before + position[key], before
        for start in range(first, before, W):
            starts[block], block = start, block + 1
    starts[block] = before
    order = np.empty(keys.size, dtype=np.int64)
    for i in range(keys.size):
        order[position[keys[i]]] = i
        position[keys[i]] += 1
    return order, starts
