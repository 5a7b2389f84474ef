"""Values of a file from their places in it, chunk by chunk: bounded in memory, and no decoding but our own."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np
from isal import isal_zlib

from sweeps.reading.files import FileBytes
from sweeps.reading.hdf5 import DEFLATE, FLETCHER, SHUFFLE, StoredVariable
from sweeps.schema.iteration import runs
from sweeps.schema.refusals import MapError

PART_VALUES = 2**18  # maximum number of values per read of a variable without chunks


class StoredValues:
    """A variable's values, read on access.

    Args:
        file: the file.
        name: the variable's name, for messages.
        variable: its structure, with the addresses of its values.
        flags: the least and the greatest value of a flag; None for further variables, and to allow any.
    """

    def __init__(self, file: FileBytes, name: str, variable: StoredVariable, flags: tuple[int, int] | None = None):
        self._file, self._name, self._flags, self._variable = file, name, flags, variable
        self._dtype = np.dtype(variable.dtype)
        self.shape, self.dtype = variable.shape, self._dtype.newbyteorder("=")
        piece_shape = next(runs([max(1, n) for n in variable.shape], PART_VALUES))  # each part is contiguous
        self._chunk = tuple(max(1, n) for n in variable.chunk or [part.stop for part in piece_shape])
        self._place = (
            {tuple(place[:-3]): tuple(place[-2:]) for place in variable.places.tolist()} if variable.chunk else {}
        )

    def read_all(self) -> np.ndarray:
        """Return all the values."""
        return self._box([(0, size) for size in self.shape])

    def read(self, key: tuple) -> np.ndarray:
        """Return the values at a tuple of numbers and slices."""
        boxes: list[tuple[int, int]] = []
        selection: list[int | slice] = []
        for index, size in zip(key, self.shape, strict=True):
            numbers = range(size)[index]
            if isinstance(numbers, int):
                boxes.append((numbers, numbers + 1))
                selection.append(0)
            else:  # a box from the least to the greatest number: a step, of either sign, begins at an end of it
                boxes.append((min(numbers[0], numbers[-1]), max(numbers[0], numbers[-1]) + 1) if numbers else (0, 0))
                selection.append(slice(None, None, numbers.step))
        return self._box(boxes)[tuple(selection)]

    def _box(self, box: Sequence[tuple[int, int]]) -> np.ndarray:
        """Return the values from low to high − 1 along each dimension."""
        values = np.empty([high - low for low, high in box], dtype=self.dtype)
        if not values.size:
            return values
        corners = [range(low // n * n, high, n) for (low, high), n in zip(box, self._chunk, strict=True)]
        for corner in product(*corners):
            from_chunk, to_box = [], []
            for at, n, (low, high) in zip(corner, self._chunk, box, strict=True):
                first, after = max(at, low), min(at + n, high)
                from_chunk.append(slice(first - at, after - at))
                to_box.append(slice(first - low, after - low))
            chunk = self._decode_chunk(corner) if self._variable.chunk else self._from_one_piece(corner)
            values[tuple(to_box)] = chunk[tuple(from_chunk)]
        return self._check_flags(values)

    def _from_one_piece(self, corner: tuple[int, ...]) -> np.ndarray:
        """Return a part of values that are contiguous in the file."""
        shape = [min(n, size - at) for at, n, size in zip(corner, self._chunk, self.shape, strict=True)]
        first = int(np.ravel_multi_index(corner, self.shape)) if corner else 0
        width = self._dtype.itemsize
        address = int(self._variable.places[0, -2]) + first * width
        return np.frombuffer(self._file.read_at(address, math.prod(shape) * width), self._dtype).reshape(shape)

    def _decode_chunk(self, corner: tuple[int, ...]) -> np.ndarray:
        """Return a whole chunk, decompressed."""
        if corner not in self._place:
            raise self._damage_error()
        width, filters = self._dtype.itemsize, self._variable.filters
        size, content = math.prod(self._chunk) * width, self._file.read_at(*self._place[corner])
        for place, code in reversed(list(enumerate(filters))):
            if code == FLETCHER:
                content = content[:-4]
            elif code == DEFLATE:
                content = self._inflate(content, size + 4 * (FLETCHER in filters[:place]))
            elif code == SHUFFLE:
                whole_bytes = len(content) // width * width  # a rest that fills no value stays at the end
                planes = np.frombuffer(content[:whole_bytes], np.uint8).reshape(width, -1)
                content = planes.T.tobytes() + content[whole_bytes:]
        if len(content) != size:
            raise self._damage_error()
        return np.frombuffer(content, self._dtype).reshape(self._chunk)

    def _inflate(self, content: bytes, size: int) -> bytes:
        """Return at most one byte more than a chunk should have: a chunk that swells beyond is refused."""
        decompressor = isal_zlib.decompressobj()
        try:
            chunk = decompressor.decompress(content, size + 1)
            if not decompressor.eof and len(chunk) == size:  # the check of its end may be left
                chunk += decompressor.decompress(decompressor.unconsumed_tail, 1)
        except isal_zlib.error:
            raise self._damage_error() from None
        if not decompressor.eof:
            raise self._damage_error()
        return chunk

    def _damage_error(self) -> MapError:
        where = f"{self._file.path}: {self._name}"
        return MapError(f"{where}: a chunk is damaged; allowed: a whole file that Polhode wrote")

    def _check_flags(self, values: np.ndarray) -> np.ndarray:
        """Return the values; refuse a flag without a meaning."""
        low, high = self._flags or (None, None)
        for extreme in (values.min(), values.max()) if self._flags else ():
            if not low <= extreme <= high:
                problem = f"{self._name}: holds the flag {extreme}, without a meaning"
                raise MapError(f"{self._file.path}: {problem}; allowed: {low} to {high}")
        return values
