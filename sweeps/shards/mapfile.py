"""netCDF-4 files of maps and shards: written a run of points at a time, and hashed as they are written."""

import errno
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np

from sweeps.process.files import replaced
from sweeps.schema.boxes import run_in_boxes
from sweeps.schema.variables import DEFLATED, Variable
from sweeps.shards.chunks import chunk_shape
from sweeps.shards.content import ContentHash

CACHE_BYTES = 2**21  # of chunks that are begun, of each variable: some four chunks of doubles


@contextmanager
def written(path: str | Path, sizes: Mapping[str, int], flush: bool = True) -> Iterator["MapFile"]:
    """Yield a new file with dimensions of these sizes; it is at `path` when the block has ended without error.

    For `flush` see `sweeps.process.files.replaced`.

    Raises:
        OSError: where the disk is full or fails, with the system's reason: netCDF itself says "HDF error".
    """
    with replaced(path, flush) as temporary:
        try:
            with netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
                yield MapFile(file, sizes)
        except RuntimeError as error:
            raise _reason(temporary, path, error) from None


def _reason(temporary: Path, path: str | Path, error: RuntimeError) -> OSError:
    """Return why netCDF could not write: what the system says to a further mebibyte."""
    try:
        handle = os.open(temporary, os.O_WRONLY)
        try:
            os.posix_fallocate(handle, temporary.stat().st_size, 2**20)
        finally:
            os.close(handle)
    except OSError as said:
        return OSError(said.errno, said.strerror, str(path))
    return OSError(errno.EIO, f"cannot be written ({error})", str(path))


class MapFile:
    """A file that is being written, and the hash of its content."""

    def __init__(self, file: netCDF4.Dataset, sizes: Mapping[str, int]):
        self._file, self._digest, self._points = file, ContentHash(), ()
        for dim, size in sizes.items():
            file.createDimension(dim, size)

    def add(self, name: str, dims: Sequence[str], dtype: Any, attributes: Mapping, **options: Any) -> None:
        """Add a variable over some dimensions; `options` are those of `netCDF4.Dataset.createVariable`."""
        kind = str if np.dtype(dtype).kind in "OU" else dtype
        variable = self._file.createVariable(name, kind, dims, **{"fill_value": False} | options)
        variable.setncatts(dict(attributes))
        self._digest.declare(name, dims, variable.shape, dtype)

    def add_text(self, name: str, dims: Sequence[str], length: int, attributes: Mapping) -> None:
        """Add text as characters of UTF-8, along one more dimension `string{length}`."""
        variable = self._file.createVariable(name, "S1", (*dims, f"string{length}"), fill_value=False)
        variable.setncatts(dict(attributes) | {"_Encoding": "utf-8"})
        self._digest.declare(name, dims, variable.shape[:-1], str)

    def add_columns(self, dims: Sequence[str], variables: Mapping[str, Variable], attributes: Mapping = {}) -> None:
        """Add variables that have a value at every point, in dimensions `dims`, and `attributes` beside their own."""
        self._points = tuple(len(self._file.dimensions[dim]) for dim in dims)
        for name, spec in variables.items():
            shape = (*self._points, *(len(self._file.dimensions[dim]) for dim in spec.over))
            packing = {"chunksizes": chunk_shape(shape), "chunk_cache": CACHE_BYTES} | (
                DEFLATED if spec.deflated else {}
            )
            packing["fill_value"] = np.nan if spec.missing_is_nan else False
            self.add(name, (*dims, *spec.over), spec.dtype, spec.attributes_among(variables) | attributes, **packing)

    def put(self, name: str, box: tuple[slice, ...], values: np.ndarray) -> None:
        """Write the next values of a variable, in C order, to a box."""
        variable, stored = self._file[name], values
        if values.dtype.kind in "OU":
            stored = values.astype(object) if variable.dtype is str else _characters(values, variable.shape[-1])
        variable[box] = stored
        self._digest.update(name, values)

    def put_columns(self, first: int, columns: Mapping[str, np.ndarray]) -> None:
        """Write the values of the next points; `first` is the number of the first of them, from 0."""
        for name, values in columns.items():
            done = 0
            for box in run_in_boxes(self._points, first, first + len(values)):
                lengths = [part.stop - part.start for part in box]
                part = values[done : done + math.prod(lengths)]
                self.put(name, box, part.reshape(*lengths, *values.shape[1:]))
                done += len(part)

    def hexdigest(self) -> str:
        """Return the hash of what has been written, once that is all."""
        return self._digest.hexdigest()

    def seal(self, attributes: Mapping[str, str]) -> str:
        """Write the global attributes and the hashes of all that has been written; return the content hash."""
        self._file.setncatts(dict(attributes))
        self._digest.seal(self._file)
        return self.hexdigest()


def _characters(texts: np.ndarray, length: int) -> np.ndarray:
    """Return texts as characters of UTF-8, along one more dimension."""
    encoded = np.array([str(text).encode() for text in texts.reshape(-1)], f"S{length}")
    return encoded.view("S1").reshape(*texts.shape, length)
