"""Maps in and out: encoding, merge in bounded memory, checks that say what is wrong.

Doubles are stored as they are, for their digits do not compress, unless most are zero or missing. Diagnostics, counts
and flags are deflated, which every netCDF reader opens.
"""

import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr

from sweeps import dataset, systems
from sweeps.content import ContentHash, hashed
from sweeps.definition import Definition
from sweeps.files import remove_leftovers, replaced
from sweeps.grid import Grid, shard_count
from sweeps.reading import MAX_FILE_BYTES, plain, read_text
from sweeps.refusals import UnreadableError
from sweeps.shards import CACHE_BYTES, DamagedError, ForeignError, MapError, Shard, identity, write_shard, written
from sweeps.systems.oscillator import VARIABLES as OSCILLATIONS
from sweeps.variables import Variable

CHUNK_POINTS = 2**16
DEFLATE = {"compression": "zlib", "complevel": 1, "shuffle": True}


def merge(
    definition: Definition, shards: Iterable[str | Path], path: str | Path, threads: int = 1, renew: bool = False
) -> str:
    """Writes the map of a definition from its shards, a block of points at a time.

    A shard that was cut short or changed on the disk is measured again, where its name says which it is
    (`2-of-7.nc`).

    Args:
        definition: the sweep.
        shards: the files of `sweeps.shards.write_shard`, in any order; together they hold each point once. A folder
            stands for the files 1-of-n.nc to n-of-n.nc in it, n the number that the sweep is cut into.
        path: the map to write.
        threads: threads that hash while the map is written.
        renew: whether shards of another definition or other kernels are measured again as well: what a run that was
            killed left behind before an edit.

    Returns:
        The map's content hash.

    Raises:
        MapError: for a file that is no shard of this sweep, and for points that are missing or given twice.
    """
    shards = [file for shard in shards for file in _files(Path(shard), definition)]
    for _ in range(len(shards) + 1):
        try:
            told = _merge_once(definition, shards, path, threads)
        except DamagedError as damaged:
            position = re.fullmatch(r"(\d+)-of-(\d+)\.nc", damaged.path.name)
            if not position or (isinstance(damaged, ForeignError) and not renew):
                raise
            print(f"{damaged}: measured again", file=sys.stderr)
            write_shard(definition, *map(int, position.groups()), damaged.path, threads)
        else:
            for shard in shards:
                remove_leftovers(shard)
            return told
    raise MapError(f"{path}: shards are damaged faster than they can be measured; allowed: a disk that keeps them")


def _files(path: Path, definition: Definition) -> list[Path]:
    if not path.is_dir():
        return [path]
    count = shard_count(definition, Grid(definition))
    return [path / f"{k}-of-{count}.nc" for k in range(1, count + 1)]


def _merge_once(definition: Definition, paths: Sequence[Path], path: str | Path, threads: int) -> str:
    grid = Grid(definition)
    shards = sorted(_extents(definition, paths))
    _check_coverage(shards, grid)
    with written(path) as file, ThreadPoolExecutor(threads) as pool:
        digest, motions = _create_map(file, definition, grid), 0
        for first, after, source in shards:
            with Shard(source, definition) as shard:  # one open file at a time: there may be thousands
                if (shard.first, shard.after) != (first, after):
                    raise DamagedError(source, "was changed while it was read")
                motions += shard.motions
                _copy(shard, file, grid, digest, pool)
        for name, own in digest.digests().items():
            file[name].sha256 = own
        file.motions_integrated = str(motions)
        file.content_hash = digest.hexdigest()
    return digest.hexdigest()


def _extents(definition: Definition, paths: Sequence[Path]) -> Iterator[tuple[int, int, Path]]:
    """(First point, point after the last, file) of each shard."""
    for path in paths:
        with Shard(path, definition) as shard:
            yield shard.first, shard.after, path


def _copy(shard: Shard, file: netCDF4.Dataset, grid: Grid, digest: ContentHash, pool: ThreadPoolExecutor) -> None:
    """Write the points of a shard to where they belong in the map, and add them to the hash."""
    for low, columns in shard.blocks():
        hashing = [pool.submit(digest.update, name, columns[name]) for name in columns]
        _place(file, grid, low, columns)
        for done in hashing:
            done.result()


def _check_coverage(shards: Sequence[tuple[int, int, Path]], grid: Grid) -> None:
    covered = 0
    for first, after, _ in shards:
        if first != covered:
            what = "missing" if first > covered else "given twice"
            low, high = sorted((first, covered))
            raise MapError(f"shards: points {low} to {high - 1} are {what}; allowed: each point once")
        covered = after
    if covered != grid.size:
        raise MapError(f"shards: points {covered} to {grid.size - 1} are missing; allowed: each point once")


def _variables(definition: Definition) -> dict[str, Variable]:
    return systems.resolve(definition.system).variables(definition)


def _create_map(file: netCDF4.Dataset, definition: Definition, grid: Grid) -> ContentHash:
    """Define the dimensions, variables and attributes of a map, and write its coordinates."""
    file.set_auto_maskandscale(False)
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
        fill = np.nan if spec.missing_is_nan else False
        packing = DEFLATE if spec.sparse or spec.dtype != "f8" else {}
        variable = file.createVariable(
            spec.name,
            spec.dtype,
            grid.dims,
            fill_value=fill,
            chunksizes=chunk_shape(grid.shape),
            chunk_cache=CACHE_BYTES,
            **packing,
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


def _place(file: netCDF4.Dataset, grid: Grid, low: int, columns: Mapping[str, np.ndarray]) -> None:
    """Write a run of points that begins with number `low` to where it belongs in the map."""
    size = next(iter(columns.values())).size
    for slices, begin, end in grid.hyperslabs(low, low + size):
        shape = [s.stop - s.start for s in slices]
        for name, values in columns.items():
            file[name][slices] = values[begin - low : end - low].reshape(shape)


def _history() -> str:
    return f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ} python -m sweeps"


def write_map(ds: xr.Dataset, path: str | Path) -> str:
    """Writes a Dataset from `sweeps.survey` as a map, and returns its content hash; lazy ones are computed twice."""
    ds, digest = _with_hashes(ds)
    encoding = {name: {"_FillValue": None} for name in ds.coords}
    for name, variable in ds.data_vars.items():
        encoding[name] = {"chunksizes": chunk_shape(variable.shape), "_FillValue": None}
        if variable.dtype.kind == "f":
            encoding[name]["_FillValue"] = np.nan
        if variable.dtype != np.float64:
            encoding[name] |= {"zlib": True, "complevel": DEFLATE["complevel"], "shuffle": True}
    with replaced(path) as temporary:
        ds.assign_attrs(history=_history(), content_hash=digest).to_netcdf(
            temporary, engine="netcdf4", format="NETCDF4", encoding=encoding
        )
    return digest


def _with_hashes(ds: xr.Dataset) -> tuple[xr.Dataset, str]:
    """The Dataset with the hash of each variable's values in its attributes, and the content hash."""
    digest = hashed(ds)
    own = digest.digests()
    ds = ds.assign({name: ds[name].assign_attrs(sha256=own[name]) for name in ds.data_vars})
    return ds.assign_coords({name: ds[name].assign_attrs(sha256=own[name]) for name in ds.coords}), digest.hexdigest()


def write_part(ds: xr.Dataset, path: str | Path, command: str) -> str:
    """Writes what `command` made of a map, for programs that show lines and planes, and returns its content hash.

    What is no dimension any more stays as a scalar coordinate; text becomes characters, which CDO and ncview can read.
    """
    texts = {name: {"dtype": "S1"} for name, variable in ds.variables.items() if variable.dtype.kind in "OU"}
    floats = {name: {"_FillValue": np.nan} for name, variable in ds.data_vars.items() if variable.dtype.kind == "f"}
    others = {name: {"_FillValue": None} for name in ds.variables if name not in texts and name not in floats}
    ds, digest = _with_hashes(ds.load().drop_encoding())
    history = f"{_history()} {command}\n{ds.attrs.get('history', '')}".strip()
    with replaced(path) as temporary:
        ds.assign_attrs(history=history, content_hash=digest).to_netcdf(
            temporary, engine="netcdf4", format="NETCDF4", encoding=texts | floats | others
        )
    return digest


def holds_map(path: str | Path, definition: Definition) -> bool:
    """Whether a file holds the map of a definition, as these kernels measure it."""
    try:
        with open_map(path) as ds:
            return all(ds.attrs.get(name, "") == value for name, value in identity(definition).items())
    except MapError:
        return False


def _open(path: str | Path, **options) -> xr.Dataset:
    if not Path(path).is_file():
        raise MapError(f"{path}: there is no such file; allowed: a netCDF-4 file that Polhode wrote")
    try:
        return xr.open_dataset(path, engine="netcdf4", decode_times=False, **options)
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise MapError(f"{path}: cannot be read as netCDF ({error}); allowed: a file that Polhode wrote") from None


def definition_of(ds: xr.Dataset) -> dict:
    """The plain values of the definition that a map carries; none where it carries none that can be read."""
    text = ds.attrs.get("definition", "")
    if not isinstance(text, str) or len(text) > MAX_FILE_BYTES:
        return {}
    try:
        values = plain(read_text(text))
    except UnreadableError:
        return {}
    return values if isinstance(values, dict) else {}


def _promised(ds: xr.Dataset) -> set[str]:
    """Variables that a map's own definition chose; none where it chose none."""
    integration = definition_of(ds).get("integration")
    chosen = integration.get("variables") if isinstance(integration, dict) else None
    return set(map(str, chosen)) if isinstance(chosen, tuple) else set()


def _unprintable(ds: xr.Dataset) -> str | None:
    """The name of an attribute or a text that a terminal might obey."""
    holders = {"": ds.attrs} | {f"{name}:": variable.attrs for name, variable in ds.variables.items()}
    for holder, attributes in holders.items():
        for name, value in attributes.items():
            if name != "definition" and not all(c.isprintable() or c in "\n\t" for c in str(value)):
                return holder + name
    for name, variable in ds.variables.items():
        if variable.dtype.kind in "OUS" and not all(str(text).isprintable() for text in variable.values.reshape(-1)):
            return str(name)
    return None


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
    if (unprintable := _unprintable(ds)) is not None:
        ds.close()
        raise MapError(f"{path}: {unprintable}: holds control characters; allowed: printable text")
    name = str(ds.attrs.get("system", systems.DEFAULT))
    described = systems.is_file(name)  # a file named by a map is never run: its author may be anybody
    if not described and name not in systems.names():
        ds.close()
        raise MapError(f"{path}: system: {name!r} is not available; allowed: {', '.join(systems.names())}")
    wanted = set(OSCILLATIONS if described else systems.resolve(name).variables())
    missing = sorted((_promised(ds) or wanted) - set(ds.variables))
    if missing:
        ds.close()
        raise MapError(f"{path}: {missing[0]}: is missing ({len(missing)} in all); allowed: every variable of a map")
    return ds
