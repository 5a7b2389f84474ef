"""Chunks: runs of points that are stored, and hashed, as one."""

from collections.abc import Sequence

CHUNK_POINTS = 2**16


def chunk_shape(shape: Sequence[int]) -> tuple[int, ...]:
    """Return the shape of the chunks of an array, of at most `CHUNK_POINTS` values.

    Its last dimensions are whole, the next is cut into even parts, and each before into single indices. So in C order a
    chunk is one run of values.
    """
    room, chunk = CHUNK_POINTS, []
    for size in reversed(shape):
        parts = -(-size // max(room, 1))
        chunk.append(-(-size // parts))
        room //= chunk[-1]
    return tuple(reversed(chunk))
