"""netCDF in and out: encoding, write-then-rename, merge in bounded memory, content hash.

A file is written under a temporary name beside its place, flushed to the disk and renamed: a reader never sees half a
file, and a killed writer leaves the old one.
"""

import errno
import hashlib
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr

from sweeps import dataset, systems
from sweeps.definition import Definition
from sweeps.grid import Grid
from sweeps.systems.oscillator import VARIABLES as OSCILLATIONS
from sweeps.variables import Variable

BLOCK_POINTS = 2**16
CHUNK_POINTS = 2**16
DEFLATE = {"compression": "zlib", "complevel": 1, "shuffle": True}


class MapError(ValueError):
    """What is wrong with a file that should be a map or a shard; `str()` is the message for a person."""


@contextmanager
def replaced(path: str | Path) -> Iterator[Path]:
    """Gives a temporary path beside `path`; once the block has ended well, what it wrote takes that place.

    The content reaches the disk before the name does. Where the block fails, the temporary file is removed and
    whatever stood at `path` is as it was.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        _flush(temporary)
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(path)
        _flush(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _flush(path: Path) -> None:
    """Forces a file's (or a folder's) content to the disk, where the system can."""
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:  # folders cannot be opened on every system
        return
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EBADF, errno.EINVAL, errno.ENOTSUP):  # a full or failing disk must be heard
            raise
    finally:
        os.close(handle)


# ---------------------------------------------------------------------------------------------------------
# Content hash


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
        """Add the next values of a variable, in C order."""
        self._bodies[name].update(_bytes(values))

    def hexdigest(self) -> str:
        """The content hash, 64 hexadecimal digits."""
        total = hashlib.sha256()
        for name in sorted(self._heads):
            total.update(self._heads[name].encode() + self._bodies[name].digest())
        return total.hexdigest()


def _bytes(values: np.ndarray) -> bytes | memoryview:
    values = np.asarray(values)
    if values.dtype.kind in "UOST":
        return b"".join(str(item).encode() + b"\0" for item in values.reshape(-1))
    values = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    return values.reshape(-1).view(np.uint8).data


def content_hash(ds: xr.Dataset) -> str:
    """Content hash of a Dataset (see `ContentHash`); lazy variables are computed one at a time."""
    digest = ContentHash()
    for name, variable in ds.variables.items():
        digest.declare(name, variable.dims, variable.shape, variable.dtype)
        digest.update(name, variable.values)
    return digest.hexdigest()


# ---------------------------------------------------------------------------------------------------------
# Shards


def write_shard(
    definition: Definition,
    number: int,
    count: int,
    path: str | Path,
    threads: int = 1,
    progress: Callable[[int], None] = lambda points: None,
) -> None:
    """Measures shard `number` (from 1) of `count` and writes it to `path`, block by block.

    Args:
        definition: the sweep.
        number: which shard, 1 to count.
        count: into how many the sweep is cut; it changes no value.
        path: the file to write.
        threads: threads for the kernel.
        progress: called with the number of points after each block.
    """
    grid = Grid(definition)
    start, stop = grid.shard_bounds(count)[number - 1]
    with replaced(path) as temporary, netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
        file.createDimension("point", stop - start)
        for variable in _variables(definition).values():
            file.createVariable(variable.name, variable.dtype, ("point",), fill_value=False)
        file.setncatts(_shard_attributes(definition, start, stop))
        for low in range(start, stop, BLOCK_POINTS):
            high = min(low + BLOCK_POINTS, stop)
            points = dataset.point_coordinates(grid, low, high)
            block = dataset.evaluate(points, definition, threads)
            for name, values in block.data_vars.items():
                file[name][low - start : high - start] = values.values
            progress(high - low)


def _variables(definition: Definition) -> dict[str, Variable]:
    return systems.resolve(definition.system).variables(definition)


def _shard_attributes(definition: Definition, start: int, stop: int) -> dict:
    return {
        "first_point": str(start),  # as text: a grid may have more points than an attribute's integer
        "point_after_last": str(stop),
        "definition": definition.text,
        "kernel_fingerprint": systems.resolve(definition.system).fingerprint(),
    }


def _open_shard(path: str | Path, definition: Definition) -> xr.Dataset:
    shard = _open(path)
    kernels = systems.resolve(definition.system).fingerprint()
    wanted = {"definition": definition.text, "kernel_fingerprint": kernels}
    for name, value in wanted.items():
        if shard.attrs.get(name) != value:
            shard.close()
            raise MapError(f"{path}: {name}: is not that of this sweep; allowed: shards of this definition and kernels")
    for name in ("first_point", "point_after_last", *_variables(definition)):
        if name not in shard.attrs and name not in shard.variables:
            shard.close()
            raise MapError(f"{path}: {name}: is missing; allowed: a file of `python -m sweeps shard`")
    return shard


# ---------------------------------------------------------------------------------------------------------
# Maps


def merge(definition: Definition, shards: Iterable[str | Path], path: str | Path) -> str:
    """Writes the map of a definition from its shards, a block of points at a time.

    Args:
        definition: the sweep.
        shards: the files of :func:`write_shard`, in any order; together they hold each point once.
        path: the map to write.

    Returns:
        The map's content hash.

    Raises:
        MapError: for a file that is no shard of this sweep, and for points that are missing or given twice.
    """
    grid = Grid(definition)
    opened = []
    try:
        for shard in shards:
            opened.append(_open_shard(shard, definition))
        opened.sort(key=lambda shard: int(shard.attrs["first_point"]))
        _check_coverage(opened, grid)
        with replaced(path) as temporary, netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
            digest = _create_map(file, definition, grid)
            for shard in opened:
                _copy(shard, file, grid, digest)
            file.content_hash = digest.hexdigest()
    finally:
        for shard in opened:
            shard.close()
    return digest.hexdigest()


def _check_coverage(shards: list[xr.Dataset], grid: Grid) -> None:
    after = 0
    for shard in shards:
        first = int(shard.attrs["first_point"])
        if first != after:
            what = "missing" if first > after else "given twice"
            low, high = sorted((first, after))
            raise MapError(f"shards: points {low} to {high - 1} are {what}; allowed: each point once")
        after = int(shard.attrs["point_after_last"])
    if after != grid.size:
        raise MapError(f"shards: points {after} to {grid.size - 1} are missing; allowed: each point once")


def _create_map(file: netCDF4.Dataset, definition: Definition, grid: Grid) -> ContentHash:
    """Define the dimensions, variables and attributes of a map, and write its coordinates."""
    digest = ContentHash()
    for dim, size in zip(grid.dims, grid.shape, strict=True):
        file.createDimension(dim, size)
    for name, array in dataset.grid_coordinates(grid).items():
        kind = str if array.dtype.kind == "U" else array.dtype
        variable = file.createVariable(name, kind, array.dims, fill_value=False)
        variable.setncatts(array.attrs)
        values = array.values.astype(object) if kind is str else array.values
        variable[:] = values
        digest.declare(name, array.dims, array.shape, array.dtype)
        digest.update(name, values)
    beside = " ".join(sorted(grid.auxiliary))
    for spec in _variables(definition).values():
        fill = np.nan if spec.dtype == "f8" else False
        variable = file.createVariable(
            spec.name, spec.dtype, grid.dims, fill_value=fill, chunksizes=chunk_shape(grid.shape), **DEFLATE
        )
        variable.setncatts(spec.attributes | ({"coordinates": beside} if beside else {}))
        digest.declare(spec.name, grid.dims, grid.shape, spec.dtype)
    file.setncatts(dataset.provenance(definition) | {"history": _history()})
    return digest


def chunk_shape(shape: Sequence[int]) -> tuple[int, ...]:
    """Chunk of a map's variables: the last dimensions whole and the next in even parts, so a run of points."""
    room, chunk = CHUNK_POINTS, []
    for size in reversed(shape):
        parts = -(-size // max(room, 1))
        chunk.append(-(-size // parts))
        room //= chunk[-1]
    return tuple(reversed(chunk))


def _copy(shard: xr.Dataset, file: netCDF4.Dataset, grid: Grid, digest: ContentHash) -> None:
    """Copy a shard's points into the map, a block at a time."""
    first, after = int(shard.attrs["first_point"]), int(shard.attrs["point_after_last"])
    for low in range(first, after, BLOCK_POINTS):
        high = min(low + BLOCK_POINTS, after)
        block = shard.isel(point=slice(low - first, high - first)).load()
        boxes = grid.hyperslabs(low, high)
        for name in _variables(grid.definition):
            values = block[name].values
            digest.update(name, values)
            for slices, begin, end in boxes:
                box = values[begin - low : end - low]
                file[name][slices] = box.reshape([s.stop - s.start for s in slices])


def _history() -> str:
    return f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ} python -m sweeps"


def write_map(ds: xr.Dataset, path: str | Path) -> str:
    """Writes a Dataset from `sweeps.survey` as a map, and returns its content hash; lazy ones are computed twice."""
    digest = content_hash(ds)
    encoding = {
        name: {"zlib": True, "complevel": DEFLATE["complevel"], "shuffle": True, "chunksizes": chunk_shape(v.shape)}
        for name, v in ds.data_vars.items()
    }
    for name, variable in ds.variables.items():
        encoding.setdefault(name, {})["_FillValue"] = (
            np.nan if name in ds.data_vars and variable.dtype == "f8" else None
        )
    with replaced(path) as temporary:
        ds.assign_attrs(history=_history(), content_hash=digest).to_netcdf(
            temporary, engine="netcdf4", format="NETCDF4", encoding=encoding
        )
    return digest


def _open(path: str | Path, **options) -> xr.Dataset:
    if not Path(path).is_file():
        raise MapError(f"{path}: there is no such file; allowed: a netCDF-4 file that Polhode wrote")
    try:
        return xr.open_dataset(path, engine="netcdf4", decode_times=False, **options)
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise MapError(f"{path}: cannot be read as netCDF ({error}); allowed: a file that Polhode wrote") from None


def open_map(path: str | Path, **options) -> xr.Dataset:
    """Opens a map, lazily, with checks that say what is wrong.

    Args:
        path: results/<sweep>/stability_map.nc, or any file of that contract.
        options: passed on to `xarray.open_dataset` (say, `chunks={}` for Dask arrays).

    Returns:
        The Dataset, as results/README.md describes it.

    Raises:
        MapError: for a file that is missing, not netCDF, or not a map of this contract.
    """
    ds = _open(path, **options)
    version = str(ds.attrs.get("contract_version", ""))
    if version.split(".")[0] != dataset.CONTRACT_VERSION.split(".")[0]:
        ds.close()
        found = version or "nothing"
        raise MapError(f"{path}: contract_version: is {found}; allowed: {dataset.CONTRACT_VERSION}, a map of Polhode")
    name = str(ds.attrs.get("system", systems.DEFAULT))
    described = systems.is_file(name)  # a file named by a map is never run: its author may be anybody
    if not described and name not in systems.names():
        ds.close()
        raise MapError(f"{path}: system: {name!r} is not available; allowed: {', '.join(systems.names())}")
    wanted = OSCILLATIONS if described else systems.resolve(name).variables()
    missing = sorted(set(wanted) - set(ds.variables))
    if missing:
        ds.close()
        raise MapError(f"{path}: {missing[0]}: is missing ({len(missing)} in all); allowed: every variable of a map")
    return ds
