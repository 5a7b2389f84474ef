"""Chunks: runs of points that are stored, hashed and copied as one.

A variable of a map is cut into chunks of equal shape: its last dimensions whole, the next in even parts, and one index
of each before. In C order a chunk is one run of points, so whoever measures points in order fills one chunk after the
other.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

CHUNK_POINTS = 2**16


def chunk_shape(shape: Sequence[int], width: int = 1) -> tuple[int, ...]:
    """Return the shape of the chunks of an array, of at most `CHUNK_POINTS` values that count for `width` each."""
    room, chunk = CHUNK_POINTS // width, []
    for size in reversed(shape):
        parts = -(-size // max(room, 1))
        chunk.append(-(-size // parts))
        room //= chunk[-1]
    return tuple(reversed(chunk))


@dataclass(frozen=True)
class Chunks:
    """The cut of an array of one shape, none of whose dimensions is empty; chunks are numbered in C order."""

    array: tuple[int, ...]  #: shape of the array
    width: int = 1  #: how many numbers each value stands for

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Shape of a chunk; at the end of a dimension that it does not divide a chunk sticks out."""
        return chunk_shape(self.array, self.width)

    @cached_property
    def points(self) -> int:
        """Number of values that a chunk has room for."""
        return math.prod(self.shape)

    def bounds(self, number: int) -> tuple[int, int]:
        """Return the first value of a chunk and the one after its last, numbered in C order."""
        line, part = divmod(number, self._parts)
        first = line * self._line + part * self.points
        return first, min(first + self.points, (line + 1) * self._line)

    def holding(self, point: int) -> int:
        """Return the number of the chunk that holds a value."""
        line, place = divmod(point, self._line)
        return line * self._parts + place // self.points

    def between(self, first: int, after: int) -> Iterator[tuple[int, int, int]]:
        """Yield (chunk, first value, value after the last) for each chunk that holds values first … after − 1."""
        while first < after:
            number = self.holding(first)
            end = min(self.bounds(number)[1], after)
            yield number, first, end
            first = end

    def offset(self, number: int) -> tuple[int, ...]:
        """Return the index of a chunk's first value."""
        index = []
        for parts, length in zip(reversed(self._along), reversed(self.shape), strict=True):
            number, place = divmod(number, parts)
            index.append(place * length)
        return tuple(reversed(index))

    @cached_property
    def _along(self) -> tuple[int, ...]:
        return tuple(-(-size // length) for size, length in zip(self.array, self.shape, strict=True))

    @cached_property
    def _split(self) -> int:
        """The dimension that is cut into parts; all before are cut into single indices."""
        whole = (size == length for size, length in zip(reversed(self.array), reversed(self.shape), strict=True))
        last = next((k for k, is_whole in enumerate(whole) if not is_whole), len(self.array) - 1)
        return len(self.array) - 1 - last

    @cached_property
    def _parts(self) -> int:
        return self._along[self._split] if self.array else 1

    @cached_property
    def _line(self) -> int:
        """Number of values over the cut dimension and those after it."""
        return math.prod(self.array[self._split :]) if self.array else 1
