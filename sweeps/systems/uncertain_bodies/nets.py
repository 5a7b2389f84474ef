r"""Scrambled Sobol points without SciPy's statistics, which take longer to import than a million of them to make.

Direction numbers of a dimension follow from a primitive polynomial over GF(2) and its first ones. Their binary digits
are scrambled by a random lower triangular matrix and shifted by random digits (Matoušek's kind of Owen's scrambling).
In Gray code point :math:`2^k + i` is point i, :math:`i < 2^k`, with one constant exclusive-ored in, so the points are
made by doubling. Bit for bit they are those of `scipy.stats.qmc.Sobol` with the same generator.

Source: Joe and Kuo (2008), SIAM J. Sci. Comput. 30, 2635 (their table new-joe-kuo-6); Matoušek (1998), J. Complexity
14, 527; Antonov and Saleev (1979), USSR Comput. Math. Math. Phys. 19, 252.
"""

from functools import cache

import numpy as np

BITS = 30  # binary digits of a point
# Of each dimension after the first: its polynomial's digits, and the first direction numbers.
DIRECTIONS = (
    (3, (1,)),
    (7, (1, 3)),
    (11, (1, 3, 1)),
    (13, (1, 1, 1)),
    (19, (1, 1, 3, 3)),
    (25, (1, 3, 5, 13)),
    (37, (1, 1, 5, 5, 17)),
    (41, (1, 1, 5, 5, 5)),
    (47, (1, 1, 7, 11, 19)),
    (55, (1, 1, 5, 1, 1)),
    (59, (1, 1, 1, 3, 11)),
    (61, (1, 3, 5, 5, 31)),
    (67, (1, 3, 3, 9, 7, 49)),
    (91, (1, 1, 1, 15, 21, 21)),
    (97, (1, 3, 1, 13, 27, 49)),
    (103, (1, 1, 1, 15, 7, 5)),
    (109, (1, 3, 1, 15, 13, 25)),
)
MOST_DIMENSIONS = 1 + len(DIRECTIONS)


def sobol(dimension: int, size: int, rng: np.random.Generator) -> np.ndarray:
    """Return the first `size` scrambled Sobol points, a power of two, shape (size, dimension)."""
    (own,) = rng.spawn(1)
    shift = own.integers(2, size=(dimension, BITS), dtype=np.uint32) @ (1 << np.arange(BITS, dtype=np.uint32))
    lower = np.tril(own.integers(2, size=(dimension, BITS, BITS), dtype=np.uint32), -1)
    turns = _scrambled(_directions(dimension), lower)
    points = np.empty((size, dimension), np.uint32)
    points[0] = shift
    for digit in range(size.bit_length() - 1):
        turn = turns[:, digit] ^ (turns[:, digit - 1] if digit else 0)
        np.bitwise_xor(points[: 1 << digit], turn, out=points[1 << digit : 2 << digit])
    return points * 2.0**-BITS


@cache
def _directions(dimension: int) -> np.ndarray:
    """Direction numbers as whole numbers of `BITS` binary digits, shape (dimension, BITS)."""
    rows = [[1] * BITS]
    for polynomial, first in DIRECTIONS[: dimension - 1]:
        row, degree = list(first), len(first)
        while len(row) < BITS:
            new = row[-degree]
            for k in range(1, degree + 1):
                if polynomial >> (degree - k) & 1:
                    new ^= row[-k] << k
            row.append(new)
        rows.append(row)
    return np.array(rows, np.uint32) << np.arange(BITS - 1, -1, -1, dtype=np.uint32)


def _scrambled(directions: np.ndarray, lower: np.ndarray) -> np.ndarray:
    """Direction numbers whose digits, the highest first, are multiplied by 1 + a strictly lower matrix, modulo 2."""
    places = np.arange(BITS - 1, -1, -1, dtype=np.uint32)
    digits = directions[:, :, None] >> places & 1  # (dimension, number, digit)
    mixed = (digits + digits @ lower.transpose(0, 2, 1)) & 1
    return (mixed << places).sum(axis=2, dtype=np.uint32)
