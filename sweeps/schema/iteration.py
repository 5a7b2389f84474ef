"""Boxes of bounded size that cover an array or a grid."""

from collections.abc import Iterator, Mapping, Sequence
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
