"""What a map holds, as one hash: equal content, equal hash, however it is stored."""

import hashlib
from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np
import xarray as xr


class ContentHash:
    """SHA-256 of what a Dataset holds: names, dimensions, types and values; no attribute, no encoding.

    Each variable has a hash of its own over its bytes in C order (little-endian; text as UTF-8, each item ended by a
    zero byte). The content hash runs over name, dimensions, type and that hash of each variable and coordinate, in
    the order of names.
    """

    def __init__(self):
        self._heads, self._bodies = {}, {}

    def declare(self, name: str, dims: Sequence[str], shape: Sequence[int], dtype) -> None:
        """Announce a variable before its values."""
        kind = "str" if np.dtype(dtype).kind in "UOST" else np.dtype(dtype).newbyteorder("<").str
        self._heads[name] = f"{name}\0{','.join(f'{d}={n}' for d, n in zip(dims, shape, strict=True))}\0{kind}\0"
        self._bodies[name] = hashlib.sha256()

    def update(self, name: str, values: np.ndarray) -> None:
        """Add the next values of a variable, in C order; different variables may be updated by different threads."""
        self._bodies[name].update(as_bytes(values))

    def digests(self) -> dict[str, str]:
        """Name → hash of the variable's own values, 64 hexadecimal digits."""
        return {name: body.hexdigest() for name, body in self._bodies.items()}

    def hexdigest(self) -> str:
        """The content hash, 64 hexadecimal digits."""
        total = hashlib.sha256()
        for name in sorted(self._heads):
            total.update(self._heads[name].encode() + self._bodies[name].digest())
        return total.hexdigest()


def as_bytes(values: np.ndarray) -> bytes | memoryview:
    """Values in C order as little-endian bytes; text as UTF-8, each item ended by a zero byte."""
    values = np.asarray(values)
    if values.dtype.kind in "UOST":
        return b"".join(str(item).encode() + b"\0" for item in values.reshape(-1))
    values = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    return values.reshape(-1).view(np.uint8).data


def content_hash(ds: xr.Dataset) -> str:
    """Content hash of a Dataset (see `ContentHash`); lazy variables are computed one at a time."""
    return hashed(ds).hexdigest()


def hashed(ds: xr.Dataset, room: int | None = None) -> ContentHash:
    """The hashes of a Dataset's content.

    Args:
        ds: what to hash.
        room: most values of a variable to hold in memory at a time; left out, a variable whole.
    """
    digest = ContentHash()
    for name, variable in ds.variables.items():
        digest.declare(name, variable.dims, variable.shape, variable.dtype)
        for box in runs(variable.shape, room or max(variable.size, 1)):
            digest.update(name, variable[box].values)
    return digest


def runs(shape: Sequence[int], room: int) -> Iterator[tuple[slice, ...]]:
    """Boxes of at most `room` values that hold an array's values in C order, one run after the other."""
    box, left = [], room
    for size in reversed(shape):
        box.append(max(1, min(size, left)))
        left = left // box[-1] if box[-1] == size else 1
    for corner in product(*(range(0, n, step) for n, step in zip(shape, reversed(box), strict=True))):
        yield tuple(slice(at, at + step) for at, step in zip(corner, reversed(box), strict=True))
