"""The content hash of a map: equal for equal content, independently of how it is stored."""

import hashlib
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sweeps.schema.iteration import runs, tiles

if TYPE_CHECKING:
    import netCDF4
    import xarray as xr

CHUNK_POINTS = 2**16  # values of a chunk; changing it would change every content hash


def chunk_shape(shape: Sequence[int]) -> tuple[int, ...]:
    """Return the shape of the chunks of an array: at most `CHUNK_POINTS` values, stored and hashed together.

    Its last dimensions are whole, the next dimension is cut into even parts, and all dimensions before have length 1.
    """
    points_left, chunk = CHUNK_POINTS, []
    for size in reversed(shape):
        num_runs = -(-size // max(points_left, 1))
        chunk.append(-(-size // num_runs))
        points_left //= chunk[-1]
    return tuple(reversed(chunk))


class ContentHash:
    """SHA-256 of names, dimensions, types and values of a Dataset; attributes and encoding have no effect.

    The hash of a variable is that of the SHA-256 digests of its chunks (`chunk_shape`) in C order. Values are hashed
    as little-endian bytes (text as UTF-8, each item ended by a zero byte). The content hash is that of name,
    dimensions, type and hash of each variable and coordinate, in the order of names.
    """

    def __init__(self):
        self._heads, self._bodies = {}, {}

    def declare(self, name: str, dims: Sequence[str], shape: Sequence[int], dtype) -> None:
        """Announce a variable before its values.

        Args:
            name: of the variable.
            dims: names of its dimensions.
            shape: their lengths.
            dtype: type of its values.
        """
        kind = "str" if np.dtype(dtype).kind in "UOST" else np.dtype(dtype).newbyteorder("<").str
        self._heads[name] = f"{name}\0{','.join(f'{d}={n}' for d, n in zip(dims, shape, strict=True))}\0{kind}\0"
        self._bodies[name] = _VariableHash(tuple(shape))

    def update(self, name: str, values: np.ndarray) -> None:
        """Add the next values of a variable, in C order."""
        for _ in self.runs(name, values):
            pass

    def runs(self, name: str, values: np.ndarray) -> Iterator[tuple[tuple[slice, ...], np.ndarray]]:
        """Add the next values of a variable, in C order; yield (box, values) of each chunk that is complete now."""
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
    """The hash of a variable: values are added in pieces of any length and hashed in whole chunks."""

    def __init__(self, shape: tuple[int, ...]):
        self._boxes = tiles(shape, chunk_shape(shape))
        self._box, self.total = next(self._boxes, ()), hashlib.sha256()
        self._pieces: list[np.ndarray] = []

    def runs(self, values: np.ndarray) -> Iterator[tuple[tuple[slice, ...], np.ndarray]]:
        """Add values, and yield (box, values) of each run that they complete; see `ContentHash.runs`."""
        while values.size:
            size = math.prod(piece.stop - piece.start for piece in self._box)
            missing = size - sum(piece.size for piece in self._pieces)
            self._pieces.append(values[:missing])
            if values.size >= missing:
                run = np.concatenate(self._pieces)
                self.total.update(hashlib.sha256(as_bytes(run)).digest())
                yield self._box, run
                self._box, self._pieces = next(self._boxes, ()), []
            values = values[missing:]


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


def hash_content(ds: "xr.Dataset", max_values: int | None = None) -> ContentHash:
    """Return the hashes of a Dataset, with at most `max_values` values of a variable in memory (None: all values)."""
    digest = ContentHash()
    for name, variable in ds.variables.items():
        digest.declare(name, variable.dims, variable.shape, variable.dtype)
        for box in runs(variable.shape, max_values or max(variable.size, 1)):
            digest.update(name, variable[box].values)
    return digest
