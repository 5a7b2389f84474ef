"""The content of a map, as one hash: equal content, equal hash, however it is stored."""

import hashlib
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweeps.schema.iteration import runs, tiles

if TYPE_CHECKING:
    import netCDF4
    import xarray as xr

CHUNK_POINTS = 2**16


def chunk_shape(shape: Sequence[int]) -> tuple[int, ...]:
    """Return the shape of the chunks of an array: runs of at most `CHUNK_POINTS` values, stored, and hashed, as one.

    Its last dimensions are whole, the next is cut into even parts, and each before into single indices.
    """
    room, chunk = CHUNK_POINTS, []
    for size in reversed(shape):
        parts = -(-size // max(room, 1))
        chunk.append(-(-size // parts))
        room //= chunk[-1]
    return tuple(reversed(chunk))


class ContentHash:
    """SHA-256 of what a Dataset holds: names, dimensions, types and values; no attribute, no encoding.

    Each variable has a hash of its own: over the SHA-256 of each of its runs of values in C order, where the runs are
    those of `chunk_shape` and the values are little-endian bytes (text: UTF-8, each item ended by a zero byte). The
    content hash runs over name, dimensions, type and that hash of each variable and coordinate, in the order of names.
    """

    def __init__(self):
        self._heads, self._bodies = {}, {}

    def declare(self, name: str, dims: Sequence[str], shape: Sequence[int], dtype) -> None:
        """Announce a variable before its values."""
        kind = "str" if np.dtype(dtype).kind in "UOST" else np.dtype(dtype).newbyteorder("<").str
        self._heads[name] = f"{name}\0{','.join(f'{d}={n}' for d, n in zip(dims, shape, strict=True))}\0{kind}\0"
        self._bodies[name] = _VariableHash(tuple(shape))

    def update(self, name: str, values: np.ndarray) -> None:
        """Add the next values of a variable, in C order."""
        for _ in self.runs(name, values):
            pass

    def runs(self, name: str, values: np.ndarray) -> Iterator[tuple[tuple[slice, ...], np.ndarray]]:
        """Add the next values of a variable, in C order; yield the box and the values of each run that is whole now."""
        return self._bodies[name].runs(np.asarray(values).reshape(-1))

    def digests(self) -> dict[str, str]:
        """Return name → hash of the variable's values, 64 hexadecimal digits."""
        return {name: body.total.hexdigest() for name, body in self._bodies.items()}

    def seal(self, file: "netCDF4.Dataset") -> None:
        """Write the hash of each variable's values and the content hash into a finished file."""
        for name, digest in self.digests().items():
            file[name].sha256 = digest
        file.content_hash = self.hexdigest()

    def hexdigest(self) -> str:
        """Return the content hash, 64 hexadecimal digits."""
        total = hashlib.sha256()
        for name in sorted(self._heads):
            total.update(self._heads[name].encode() + self._bodies[name].total.digest())
        return total.hexdigest()


class _VariableHash:
    """The hash of one variable, whose values come in pieces of any length and are hashed in whole runs."""

    def __init__(self, shape: tuple[int, ...]):
        self._boxes = tiles(shape, chunk_shape(shape))
        self._box, self._parts, self.total = next(self._boxes, ()), [], hashlib.sha256()

    def runs(self, values: np.ndarray) -> Iterator[tuple[tuple[slice, ...], np.ndarray]]:
        while values.size:
            size = math.prod(part.stop - part.start for part in self._box)
            left = size - sum(part.size for part in self._parts)
            self._parts.append(values[:left])
            if values.size >= left:
                run = np.concatenate(self._parts)
                self.total.update(hashlib.sha256(as_bytes(run)).digest())
                yield self._box, run
                self._box, self._parts = next(self._boxes, ()), []
            values = values[left:]


def as_bytes(values: np.ndarray) -> bytes | memoryview:
    """Return values in C order as little-endian bytes; text as UTF-8, each item ended by a zero byte."""
    values = np.asarray(values)
    if values.dtype.kind in "UOST":
        return b"".join(str(item).encode() + b"\0" for item in values.reshape(-1))
    values = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    return values.reshape(-1).view(np.uint8).data


def content_hash(ds: "xr.Dataset") -> str:
    """Return the content hash of a Dataset (see `ContentHash`); lazy variables are computed one at a time."""
    return hash_content(ds).hexdigest()


def hash_content(ds: "xr.Dataset", room: int | None = None) -> ContentHash:
    """Return the hashes of a Dataset's content, with at most `room` values of a variable in memory, or all of them."""
    digest = ContentHash()
    for name, variable in ds.variables.items():
        digest.declare(name, variable.dims, variable.shape, variable.dtype)
        for box in runs(variable.shape, room or max(variable.size, 1)):
            digest.update(name, variable[box].values)
    return digest
