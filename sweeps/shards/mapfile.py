"""netCDF-4 files of maps, slices and shards, which are written and hashed a run of points at a time."""

import errno
import fcntl
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import netCDF4
import numpy as np
from isal import isal_zlib

from sweeps.process.files import NO_LOCKS, replace_output
from sweeps.schema.iteration import runs
from sweeps.schema.variables import DEFLATED, Variable
from sweeps.shards import contract
from sweeps.shards.content_hash import ContentHash, as_bytes, chunk_shape

if TYPE_CHECKING:
    import xarray as xr

WITHOUT_LOCKS = "the file system has no locks (to write without: set HDF5_USE_FILE_LOCKING=FALSE)"
PART_VALUES = 2**21  # values of a variable that are in memory at a time when a slice is written, 16 MiB of doubles


@contextmanager
def new_file(path: str | Path, sizes: Mapping[str, int], flush: bool = True) -> Iterator["MapFile"]:
    """Yield a new file with dimensions of these sizes; it is at `path` when the block has ended without error.

    For `flush` see `sweeps.process.files.replace_output`.

    Raises:
        OSError: if the disk is full or fails, or the file system has no locks, with the reason that the system gives:
            netCDF reports "HDF error" or "Permission denied".
    """
    with replace_output(path, flush=flush) as temporary:
        try:
            with closing(MapFile(temporary, sizes)) as file:
                yield file
        except RuntimeError as error:
            raise _write_error(temporary, path, error) from None
        except OSError as error:
            if isinstance(error, PermissionError) and not _has_locks(temporary):
                raise OSError(errno.ENOLCK, WITHOUT_LOCKS, str(path)) from None
            if error.filename is not None:
                raise
            words = os.strerror(error.errno) if error.errno else f"cannot be written ({error})"
            raise OSError(error.errno or errno.EIO, words, str(path)) from None


def _has_locks(path: Path) -> bool:
    """Return True if the file system of a file supports locks."""
    with open(path, "rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            return error.errno not in NO_LOCKS
    return True


def _write_error(temporary: Path, path: str | Path, error: RuntimeError) -> OSError:
    """Return the reason of a failed write: the system's error if the file grows by a mebibyte."""
    try:
        handle = os.open(temporary, os.O_WRONLY)
        try:
            os.posix_fallocate(handle, temporary.stat().st_size, 2**20)
        finally:
            os.close(handle)
    except OSError as failure:
        return OSError(failure.errno, failure.strerror, str(path))
    return OSError(errno.EIO, f"cannot be written ({error})", str(path))


class MapFile:
    """A file that is being written, and the hash of its content.

    netCDF makes the file, its dimensions, variables and attributes. Chunks of columns are compressed by ISA-L, ten
    times as fast as by HDF5's own filter, and written directly; the file is the same as if HDF5 had filtered them.
    """

    def __init__(self, path: Path, sizes: Mapping[str, int]):
        self._path, self._file, self.digest = path, netCDF4.Dataset(path, "w", format="NETCDF4"), ContentHash()
        for dim, size in sizes.items():
            self._file.createDimension(dim, size)
        self._deflated_names: set[str] = set()

    def add(
        self, name: str, dims: Sequence[str], dtype: Any, attributes: Mapping, length: int = 0, **options: Any
    ) -> None:
        """Add a variable over some dimensions.

        Args:
            name: of the variable.
            dims: names of its dimensions.
            dtype: type of its values.
            attributes: name → value.
            length: if it is not 0, text becomes characters of UTF-8 along a further dimension `string{length}`.
            options: of `netCDF4.Dataset.createVariable`.
        """
        kind, attributes = (str if np.dtype(dtype).kind in "OU" else dtype), dict(attributes)
        text_dims: tuple[str, ...] = ()
        if length:
            kind, text_dims, attributes["_Encoding"] = "S1", (f"string{length}",), "utf-8"
        variable = self._file.createVariable(name, kind, (*dims, *text_dims), **{"fill_value": False} | options)
        variable.setncatts(attributes)
        self.digest.declare(name, dims, variable.shape[: len(dims)], dtype)

    def add_columns(self, dims: Sequence[str], variables: Mapping[str, Variable], attributes: Mapping = {}) -> None:
        """Add variables with values at all points (dimensions `dims`).

        Args:
            dims: dimensions of the points.
            variables: name → description.
            attributes: further attributes of each variable.
        """
        self._deflated_names = {name for name, spec in variables.items() if spec.deflated}
        for name, spec in variables.items():
            shape = [len(self._file.dimensions[dim]) for dim in (*dims, *spec.over)]
            storage: dict[str, Any] = {"chunksizes": chunk_shape(shape)} | (DEFLATED if spec.deflated else {})
            storage["fill_value"] = np.nan if spec.missing_is_nan else False
            all_attributes = {**spec.attributes_among(variables), **attributes}
            self.add(name, (*dims, *spec.over), spec.dtype, all_attributes, **storage)

    def put(self, name: str, values: np.ndarray) -> None:
        """Write the next values of a variable, in C order."""
        variable = self._file[name]
        for box, run in self.digest.runs(name, values):
            block = run.reshape([extent.stop - extent.start for extent in box])
            if run.dtype.kind in "OU":
                block = block.astype(object) if variable.dtype is str else _encode_texts(block, variable.shape[-1])
            variable[box] = block

    def put_columns(self, columns: Mapping[str, np.ndarray]) -> None:
        """Write the values of the next points; call it after all variables that are no columns are written."""
        if not isinstance(self._file, h5py.File):
            self._reopen(partial(h5py.File, locking=False), "r+")
        for name, values in columns.items():
            chunks = self._file[name].id
            for box, run in self.digest.runs(name, values):
                content = as_bytes(_fill_chunk(run, box, self._file[name].chunks))
                content = (
                    isal_zlib.compress(content, DEFLATED["complevel"]) if name in self._deflated_names else content
                )
                chunks.write_direct_chunk(tuple(extent.start for extent in box), content)

    def seal(self, attributes: Mapping[str, str]) -> str:
        """Write the global attributes and the hashes of all that has been written; return the content hash."""
        self._reopen(netCDF4.Dataset, "a")
        self._file.setncatts(dict(attributes))
        self.digest.seal(self._file)
        return self.digest.hexdigest()

    def _reopen(self, library: Callable, mode: str) -> None:
        self.close()
        self._file = library(self._path, mode)

    def close(self) -> None:
        """Close the file, unless that is done."""
        self._file, file = None, self._file
        if file is not None:
            file.close()


def write_part(ds: "xr.Dataset", path: str | Path, command: str) -> str:
    """Write a slice of a map or a motion, and return its content hash.

    Dimensions that were removed stay as scalar coordinates; text becomes characters, which CDO and ncview can read.

    Args:
        ds: the Dataset.
        path: the file to write.
        command: the command of `polhode`, for the attribute `history`.
    """
    lengths = {
        name: _longest_text(variable.values) for name, variable in ds.variables.items() if variable.dtype.kind in "OU"
    }
    with new_file(path, {**ds.sizes, **{f"string{length}": length for length in lengths.values()}}) as file:
        for name in (*ds.data_vars, *ds.coords):
            variable, attributes = ds.variables[name], dict(ds.variables[name].attrs)
            if name in ds.data_vars and (coordinate_names := _coordinate_names(ds, variable.dims)):
                attributes["coordinates"] = coordinate_names
            missing = np.nan if name in ds.data_vars and variable.dtype.kind == "f" else False
            file.add(name, variable.dims, variable.dtype, attributes, lengths.get(name, 0), fill_value=missing)
            for box in runs(variable.shape, PART_VALUES):
                file.put(name, variable[box].values)
        history = f"{contract.history(command)}\n{ds.attrs.get('history', '')}".strip()
        return file.seal(ds.attrs | {"history": history})


def _longest_text(texts: np.ndarray) -> int:
    """Return the number of bytes of the longest text, in UTF-8."""
    return max(len(str(text).encode()) for text in texts.reshape(-1)) or 1


def _coordinate_names(ds: "xr.Dataset", dims: tuple[str, ...]) -> str:
    """Return names of the coordinates, other than the dimensions' own, that a variable over some dimensions has."""
    names = (
        str(name) for name, coordinate in ds.coords.items() if name not in ds.sizes and {*coordinate.dims} <= {*dims}
    )
    return " ".join(sorted(names))


def _fill_chunk(run: np.ndarray, box: tuple[slice, ...], chunk: tuple[int, ...]) -> np.ndarray:
    """Return a run as a whole chunk: at the end of a dimension with zeros beyond it."""
    lengths = [extent.stop - extent.start for extent in box]
    return np.pad(run.reshape(lengths), [(0, chunk_length - n) for chunk_length, n in zip(chunk, lengths, strict=True)])


def _encode_texts(texts: np.ndarray, length: int) -> np.ndarray:
    """Return texts as characters of UTF-8, along one more dimension."""
    characters = np.array([str(text).encode() for text in texts.reshape(-1)], f"S{length}")
    return characters.view("S1").reshape(*texts.shape, length)
