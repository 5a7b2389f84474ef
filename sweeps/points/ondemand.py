"""Coordinates with more values than need be in memory."""

import math
from collections.abc import Callable

import numpy as np


class OnDemand:
    """Values that are made where they are asked for; it reads as an array.

    Args:
        shape: of all of them.
        dtype: NumPy type.
        part: the values of a box, given by a slice of each dimension, start and stop inside the shape.
    """

    def __init__(self, shape: tuple[int, ...], dtype: str, part: Callable[..., np.ndarray]):
        self.shape, self.ndim, self.size, self.dtype = shape, len(shape), math.prod(shape), np.dtype(dtype)
        self._part = part

    def __getitem__(self, box: slice | tuple[slice, ...]) -> np.ndarray:
        box = box if isinstance(box, tuple) else (box,)
        ends = (part.indices(size) for part, size in zip(box, self.shape, strict=True))
        return self._part(*(slice(a, max(a, b)) for a, b, _ in ends)).astype(self.dtype, copy=False)

    def __array__(self, dtype=None, copy=None) -> np.ndarray:
        return self[(slice(None),) * self.ndim].astype(dtype or self.dtype, copy=False)
