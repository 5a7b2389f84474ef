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
    power: int  #: of the spin rate in its unit: 2 for s-2, 1 for rad s-1 and s-1, -1 for s, 0 for all others
    dtype: type = np.float64  #: of what leaves the batch; inside it every column is float64
    work: str = ""  #: what is done for it alone, and spared where nobody wants it


def numbers(names, first=0, width=1):
    """Return a named tuple of the numbers 0, 1, … of names, or of where their rows begin, from row ``first`` on."""
    return namedtuple("Numbers", names)(*(width * (first + k) for k in range(len(names))))


def arrays(*values, dtypes=None):
    """Return arrays of one length as kernels are compiled for: contiguous, writable, float64 (or dtypes).

    A kernel would be compiled again, for seconds and in silence, for values that are only read (a broadcast number).
    """
    wide = np.broadcast_arrays(*(np.atleast_1d(x) for x in values))
    dtypes = dtypes or (np.float64,) * len(wide)
    return tuple(np.require(x, dtype, ("C", "W")) for x, dtype in zip(wide, dtypes, strict=True))
