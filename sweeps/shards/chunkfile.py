"""netCDF-4 files whose chunks are encoded here, in whatever thread, and go from file to file as they are.

netCDF makes a file, its dimensions, variables and attributes; HDF5 then takes each chunk as it will lie on the disk,
past its own filters. What lies there is what those filters would have made, so every reader of netCDF-4 opens it.
"""

import errno
import math
import os
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import h5py
import netCDF4
import numpy as np
from isal import isal_zlib

from sweeps.process.files import replaced
from sweeps.schema.variables import DEFLATED, Variable
from sweeps.shards.chunks import Chunks
from sweeps.shards.content import as_bytes

# what may be raised at a damaged file
UNREADABLE = (OSError, RuntimeError, ValueError, KeyError, OverflowError, zlib.error)


@contextmanager
def written(path: str | Path, flush: bool = True) -> Iterator[Path]:
    """Yield a temporary path for a netCDF-4 file, which is renamed when complete (see `sweeps.process.files.replaced`).

    Raises:
        OSError: where the disk is full or fails, with the system's reason: netCDF itself says "HDF error".
    """
    with replaced(path, flush) as temporary:
        try:
            yield temporary
        except RuntimeError as error:
            raise _reason(temporary, path, error) from None
        except OSError as error:
            if error.filename is not None:
                raise
            raise OSError(error.errno or errno.EIO, _words(error), str(path)) from None


def _words(error: OSError) -> str:
    return os.strerror(error.errno) if error.errno else f"cannot be written ({error})"


def _reason(temporary: Path, path: str | Path, error: RuntimeError) -> OSError:
    """Why netCDF could not write: what the system says to a further mebibyte."""
    try:
        handle = os.open(temporary, os.O_WRONLY)
        try:
            os.posix_fallocate(handle, temporary.stat().st_size, 2**20)
        finally:
            os.close(handle)
    except OSError as said:
        return OSError(said.errno, said.strerror, str(path))
    return OSError(errno.EIO, f"cannot be written ({error})", str(path))


def define(
    file: netCDF4.Dataset,
    dimensions: Mapping[str, int],
    variables: Mapping[str, Variable],
    attributes: Mapping[str, str] | None = None,
    further: Mapping[str, int] | None = None,
) -> None:
    """Define the dimensions of a map and its variables, whose chunks a `ChunkFile` writes.

    Args:
        file: the file, open for writing.
        dimensions: name → length, in storage order.
        variables: name → variable; each lies over all dimensions, and over those of its own.
        attributes: of every variable, beside its own.
        further: name → length of the dimensions that variables have of their own.
    """
    further = dict(further or {})
    for dim, size in {**dimensions, **further}.items():
        file.createDimension(dim, size)
    chunks = cut(tuple(dimensions.values()), {v.name: tuple(further[d] for d in v.over) for v in variables.values()})
    for spec in variables.values():
        packing = DEFLATED if spec.deflated else {}
        fill = np.nan if spec.missing_is_nan else False
        sizes = (*chunks.shape, *(further[dim] for dim in spec.over))
        variable = file.createVariable(
            spec.name, spec.dtype, (*dimensions, *spec.over), fill_value=fill, chunksizes=sizes, **packing
        )
        variable.setncatts(spec.attributes_among(variables) | dict(attributes or {}))


def cut(shape: tuple[int, ...], shapes_at: Mapping[str, tuple[int, ...]]) -> Chunks:
    """Return the chunks of a grid of this shape, none too large; `shapes_at` one point, by name."""
    return Chunks(shape, max(map(math.prod, shapes_at.values()), default=1))


class ChunkFile:
    """The chunks of a file's variables."""

    def __init__(self, file: h5py.File, variables: Mapping[str, Variable], chunks: Chunks):
        self._file, self._variables, self.chunks = file, variables, chunks
        self._ids = {name: file[name].id for name in variables}
        points = len(chunks.array)
        self._own = {name: file[name].shape[points:] for name in variables}  # shape of what it has at one point
        self._widths = {name: math.prod(shape) for name, shape in self._own.items()}

    def put(self, name: str, number: int, stored: bytes | memoryview) -> None:
        """Write a chunk as it is stored in the file."""
        self._ids[name].write_direct_chunk(self._offset(name, number), stored)

    def take(self, name: str, number: int) -> bytes:
        """Read a chunk as it is stored in the file, without HDF5, whose lock stops other threads."""
        lies = self._ids[name].get_chunk_info_by_coord(self._offset(name, number))
        return os.pread(self._file.id.get_vfd_handle(), lies.size, lies.byte_offset or 0)

    def _offset(self, name: str, number: int) -> tuple[int, ...]:
        return (*self.chunks.offset(number), *(0 for _ in self._own[name]))

    def encode(self, name: str, number: int, first: int, values: np.ndarray) -> bytes | memoryview:
        """Return a chunk as stored in a file, holding values from the one numbered `first` on, and zeros elsewhere."""
        spec, width = self._variables[name], self._widths[name]
        if values.size < self.chunks.points * width:
            whole = np.zeros(self.chunks.points * width, dtype=spec.dtype)
            at = (first - self.chunks.bounds(number)[0]) * width
            whole[at : at + values.size] = values.reshape(-1)
            values = whole
        content = as_bytes(values)
        return isal_zlib.compress(content, DEFLATED["complevel"]) if spec.deflated else content

    def decode(self, name: str, number: int, first: int, after: int, stored: bytes) -> np.ndarray:
        """Return the values of the points first … after − 1 of a chunk as stored in a file."""
        spec, width = self._variables[name], self._widths[name]
        dtype = np.dtype(spec.dtype).newbyteorder("<")
        content = isal_zlib.decompress(stored) if spec.deflated else stored
        start = self.chunks.bounds(number)[0]
        return np.frombuffer(content, dtype)[(first - start) * width : (after - start) * width]
