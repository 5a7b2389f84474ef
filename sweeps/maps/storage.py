"""Maps in and out as `xarray` Datasets, with checks that say what is wrong."""

from contextlib import suppress
from itertools import accumulate, islice, product
from pathlib import Path
from typing import TYPE_CHECKING

import netCDF4
import numpy as np
import xarray as xr

from sweeps import systems
from sweeps.maps import validation
from sweeps.process.files import replace_output
from sweeps.process.machine import cores
from sweeps.schema.refusals import MapError
from sweeps.schema.variables import DEFLATED, Variable
from sweeps.shards import contract
from sweeps.shards.content_hash import ContentHash, chunk_shape, hash_content

if TYPE_CHECKING:
    from sweeps.points.sweep import Sweep

AS_IT_IS = "iufU"  # kinds of values that a file holds as memory does


def write_map(ds: xr.Dataset, path: str | Path) -> str:
    """Write a Dataset of `sweeps.survey` as a map, and return its content hash, for which a lazy one is read again."""
    table = systems.of_map(ds).layout().variables
    encoding = {name: {"_FillValue": None} for name in ds.coords}
    for name, variable in ds.data_vars.items():
        spec = table.get(name) or Variable(name, None, "", variable.dtype.str)
        fill = np.nan if spec.missing_is_nan else None
        encoding[name] = {"chunksizes": chunk_shape(variable.shape), "_FillValue": fill}
        encoding[name] |= DEFLATED if spec.deflated else {}
    lazy = ds[[name for name, variable in ds.data_vars.items() if variable.chunks]]
    with replace_output(path) as temporary:
        ds.assign_attrs(history=contract.history()).to_netcdf(
            temporary, engine="netcdf4", format="NETCDF4", encoding=encoding, compute=not lazy.data_vars
        )
        if lazy.data_vars:
            _compute(lazy.unify_chunks(), temporary)
        elif all(variable.dtype.kind in AS_IT_IS for variable in ds.variables.values()):
            return _sealed(temporary, hash_content(ds))
        with xr.open_dataset(temporary, engine="netcdf4", decode_cf=False) as written:
            digest = hash_content(written, 2**22)
        return _sealed(temporary, digest)


def _compute(lazy: xr.Dataset, path: Path) -> None:
    """Compute the lazy variables of a Dataset into a file that has everything else.

    Blocks, each of all variables at once, as many together as there are processors: each is measured once, and no more
    of them are held.
    """
    from dask import compute

    ends = (
        [(dim, slice(end - n, end)) for n, end in zip(of, accumulate(of), strict=True)]
        for dim, of in lazy.chunks.items()
    )
    boxes = map(dict, product(*ends))
    with netCDF4.Dataset(path, "a") as file:
        file.set_auto_maskandscale(False)
        while batch := list(islice(boxes, _processors())):
            for box, block in zip(batch, compute(*map(lazy.isel, batch)), strict=True):
                for name, variable in block.data_vars.items():
                    file[name][tuple(box[dim] for dim in variable.dims)] = variable.values


def _processors() -> int:
    """Return the processors of the Dask cluster of this process, else of the machine."""
    with suppress(ImportError, ValueError):
        from distributed import default_client

        return max(sum(default_client().nthreads().values()), 1)
    return cores()


def _sealed(path: Path, digest: ContentHash) -> str:
    with netCDF4.Dataset(path, "a") as file:
        digest.seal(file)
    return digest.hexdigest()


class _Backend(xr.backends.BackendEntrypoint):
    """The way by which `xarray` opens maps: nothing that a file says is trusted."""

    open_dataset_parameters = ("filename_or_obj", "drop_variables", "any_flags")

    def open_dataset(self, filename_or_obj, *, drop_variables=None, any_flags=False) -> xr.Dataset:
        """Return the map at a path; see `open_map`."""
        return validation.open_file(filename_or_obj, any_flags).drop_vars(drop_variables or ())


def open_map(path: str | Path, **options) -> xr.Dataset:
    """Open a map, lazily, with checks that report any fault; the returned Dataset may be trusted.

    Names, types, dimensions, flags and units are those of the system's own tables, and no attribute of the file
    decides how its numbers are read. The attribute `content_hash` and each variable's `encoding["sha256"]` are those
    that the file states of its own values; `polhode verify` computes them again. For the rest see `sweeps.open_map`.

    Raises:
        MapError: for a file that is missing, not netCDF, or not a map of this contract; of the Dataset, where values
            that are read are damaged.
    """
    path = validation.map_of(path)
    return validation.require_variables(path, xr.open_dataset(path, engine=_Backend, **options))


def holds_map(path: str | Path, sweep: "Sweep") -> bool:
    """Return True if a file holds the map of a sweep, as these kernels measure it."""
    try:
        with open_map(path) as ds:
            return all(ds.attrs.get(name, "") == value for name, value in contract.identity(sweep).items())
    except MapError:
        return False
