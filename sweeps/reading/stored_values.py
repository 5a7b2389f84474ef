"""Values of a file from their places in it, chunk by chunk: bounded in memory, and no decoding but our own."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
from isal import isal_zlib

from sweeps.reading.files import FileBytes
from sweeps.reading.hdf5 import DEFLATE, FLETCHER, SHUFFLE, StoredVariable
from sweeps.schema.boxes import runs
from sweeps.schema.refusals import MapError

PART_VALUES = 2**18  # of a variable in one piece that are read at a time, at most


class StoredValues:
    """A variable's values, read when they are asked for.

    Args:
        file: the file.
        name: the variable's name, for what is wrong with it.
        held: where its values lie, and how.
        flags: the least and the greatest value that a flag may have; None for other variables, and where any may be.
    """

    def __init__(self, file: FileBytes, name: str, held: StoredVariable, flags: tuple[int, int] | None = None):
        self._file, self._name, self._flags, self._held = file, name, flags, held
        self._stored = np.dtype(held.dtype)
        self.shape, self.dtype = held.shape, self._stored.newbyteorder("=")
        parts = next(runs([max(1, n) for n in held.shape], PART_VALUES))  # of one piece: each is in one piece itself
        self._chunk = tuple(max(1, n) for n in held.chunk or [part.stop for part in parts])
        self._place = {tuple(place[:-3]): tuple(place[-2:]) for place in held.places.tolist()} if held.chunk else {}

    def whole(self) -> np.ndarray:
        """Return all the values."""
        return self._box([(0, size) for size in self.shape])

    def read(self, key: tuple) -> np.ndarray:
        """Return the values at a tuple of numbers and slices."""
        boxes, picked = [], []
        for index, size in zip(key, self.shape, strict=True):
            part = range(size)[index]
            if isinstance(part, int):
                boxes.append((part, part + 1))
                picked.append(0)
            else:  # a box from the least to the greatest number: a step, of either sign, begins at an end of it
                boxes.append((min(part[0], part[-1]), max(part[0], part[-1]) + 1) if part else (0, 0))
                picked.append(slice(None, None, part.step))
        return self._box(boxes)[tuple(picked)]

    def _box(self, box: Sequence[tuple[int, int]]) -> np.ndarray:
        """Return the values from low to high − 1 along each dimension."""
        values = np.empty([high - low for low, high in box], dtype=self.dtype)
        if not values.size:
            return values
        corners = [range(low // n * n, high, n) for (low, high), n in zip(box, self._chunk, strict=True)]
        for corner in product(*corners):
            here, there = [], []
            for at, n, (low, high) in zip(corner, self._chunk, box, strict=True):
                first, after = max(at, low), min(at + n, high)
                here.append(slice(first - at, after - at))
                there.append(slice(first - low, after - low))
            chunk = self._decoded(corner) if self._held.chunk else self._from_one_piece(corner)
            values[tuple(there)] = chunk[tuple(here)]
        return self._checked(values)

    def _from_one_piece(self, corner: tuple[int, ...]) -> np.ndarray:
        """Return a part of values that stand one after the other in the file."""
        shape = [min(n, size - at) for at, n, size in zip(corner, self._chunk, self.shape, strict=True)]
        first = int(np.ravel_multi_index(corner, self.shape)) if corner else 0
        width = self._stored.itemsize
        address = int(self._held.places[0, -2]) + first * width
        return np.frombuffer(self._file.read_at(address, math.prod(shape) * width), self._stored).reshape(shape)

    def _decoded(self, corner: tuple[int, ...]) -> np.ndarray:
        """Return a whole chunk, decompressed."""
        if corner not in self._place:
            raise self._damaged()
        width, filters = self._stored.itemsize, self._held.filters
        size, content = math.prod(self._chunk) * width, self._file.read_at(*self._place[corner])
        for place, code in reversed(list(enumerate(filters))):
            if code == FLETCHER:
                content = content[:-4]
            elif code == DEFLATE:
                content = self._inflated(content, size + 4 * (FLETCHER in filters[:place]))
            elif code == SHUFFLE:
                whole = len(content) // width * width  # a rest that fills no value stays at the end
                shuffled = np.frombuffer(content[:whole], np.uint8).reshape(width, -1)
                content = shuffled.T.tobytes() + content[whole:]
        if len(content) != size:
            raise self._damaged()
        return np.frombuffer(content, self._stored).reshape(self._chunk)

    def _inflated(self, content: bytes, size: int) -> bytes:
        """Return at most one byte more than a chunk should have: a chunk that swells beyond is refused."""
        inflating = isal_zlib.decompressobj()
        try:
            inflated = inflating.decompress(content, size + 1)
            if not inflating.eof and len(inflated) == size:  # the check of its end may be left
                inflated += inflating.decompress(inflating.unconsumed_tail, 1)
        except isal_zlib.error:
            raise self._damaged() from None
        if not inflating.eof:
            raise self._damaged()
        return inflated

    def _damaged(self) -> MapError:
        where = f"{self._file.path}: {self._name}"
        return MapError(f"{where}: a chunk is damaged; allowed: a whole file that Polhode wrote")

    def _checked(self, values: np.ndarray) -> np.ndarray:
        """Return the values; refuse a flag without a meaning."""
        low, high = self._flags or (None, None)
        for extreme in (values.min(), values.max()) if self._flags else ():
            if not low <= extreme <= high:
                wrong = f"{self._name}: holds the flag {extreme}, without a meaning"
                raise MapError(f"{self._file.path}: {wrong}; allowed: {low} to {high}")
        return values
