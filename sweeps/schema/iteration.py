"""Boxes of bounded size that cover an array or a grid, and evenly spaced points of it."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product


def runs(shape: Sequence[int], max_size: int) -> Iterator[tuple[slice, ...]]:
    """Yield boxes of at most `max_size` values (or one) that cover an array in C order."""
    box, size_left = [], max_size
    for size in reversed(shape):
        box.append(max(1, min(size, size_left)))
        size_left = size_left // box[-1] if box[-1] == size else 1
    yield from tiles(shape, box[::-1])


def tiles(shape: Sequence[int], box: Sequence[int]) -> Iterator[tuple[slice, ...]]:
    """Yield the boxes of shape `box` that cover an array, in C order; at the end of a dimension they may be smaller."""
    for corner in product(*(range(0, n, step) for n, step in zip(shape, box, strict=True))):
        yield tuple(slice(at, min(at + step, n)) for at, step, n in zip(corner, box, shape, strict=True))


def blocks(sizes: Mapping[str, int], max_points: int) -> Iterator[dict[str, slice]]:
    """Yield boxes (dimension → slice) of at most `max_points` points (or one) that cover a grid, in storage order."""
    for box in runs(tuple(sizes.values()), max_points):
        yield dict(zip(sizes, box, strict=True))


def spaced_indices(length: int, max_count: int) -> list[int]:
    """Return at most `max_count` indices of a dimension, evenly spaced."""
    return list(range(0, length, max(1, math.ceil(length / max_count))))


def coprime_stride(lengths: Iterable[int], max_points: int) -> int:
    """Return the stride that keeps at most `max_points` points of a grid: 1, or a prime that divides no length.

    A common factor with the length of a dimension would select only some of its values.
    """
    lengths = tuple(lengths)
    stride = max(1, -(-math.prod(lengths) // max_points))

    def is_coprime(stride: int) -> bool:
        is_prime = all(stride % k for k in range(2, math.isqrt(stride) + 1))
        return is_prime and all(n % stride for n in lengths)

    while stride > 1 and not is_coprime(stride):
        stride += 1
    return stride
