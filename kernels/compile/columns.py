"""Tables of columns: what a batch writes, in one entry each, and numbered places for compiled code to write them to.

A batch's columns stand in one table of :class:`Column`; their numbers are :func:`numbers` of the names, a named tuple
that Numba freezes, so that ``out[AT.frequency, i]`` costs what ``out[4, i]`` does.
"""

from collections import namedtuple
from typing import NamedTuple

import numpy as np


class Column(NamedTuple):
    """One column of a batch."""

    name: str
    power: int  #: power of the spin rate in its unit: 2 for s-2, 1 for rad s-1 and s-1, -1 for s, else 0
    dtype: type = np.float64  #: type of the result; inside a batch every column is float64
    work: str = ""  #: work for this column alone, which is saved if the column is not requested


def numbers(names, first=0, width=1):
    """Return a named tuple of ``names`` → 0, 1, … (or the starts of rows of a ``width``), from row ``first`` on."""
    return namedtuple("Numbers", names)(*(width * (first + k) for k in range(len(names))))


def arrays(*values, dtypes=None):
    """Return arrays of one length as kernels are compiled for: contiguous, writable, float64 (or dtypes).

    A kernel would be compiled again, for seconds and in silence, for values that are only read (a broadcast number).
    """
    broadcast = np.broadcast_arrays(*(np.atleast_1d(x) for x in values))
    dtypes = dtypes or (np.float64,) * len(broadcast)
    return tuple(np.require(x, dtype, ("C", "W")) for x, dtype in zip(broadcast, dtypes, strict=True))
