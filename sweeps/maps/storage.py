"""Reading and writing of maps as `xarray` Datasets, with checks of everything that is read."""

from collections.abc import Hashable
from contextlib import suppress
from itertools import accumulate, islice, product
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr

from sweeps import systems
from sweeps.maps import validation
from sweeps.process.files import replace_output
from sweeps.process.machine import num_processors
from sweeps.schema.variables import DEFLATED, Variable
from sweeps.shards import contract
from sweeps.shards.content_hash import chunk_shape, hash_content


def write_map(ds: xr.Dataset, path: str | Path) -> str:
    """Write a Dataset of `sweeps.survey` as a map, and return the content hash of what the file contains."""
    table = systems.of_map(ds).layout().variables
    encoding: dict[Hashable, dict[str, Any]] = {name: {"_FillValue": None} for name in ds.coords}
    for name, variable in ds.data_vars.items():
        spec = table.get(str(name)) or Variable(str(name), None, "", variable.dtype.str)
        fill = np.nan if spec.missing_is_nan else None
        encoding[name] = {"chunksizes": chunk_shape(variable.shape), "_FillValue": fill}
        encoding[name] |= DEFLATED if spec.deflated else {}
    lazy = ds[[name for name, variable in ds.data_vars.items() if variable.chunks]]
    with replace_output(path) as temporary:
        ds.assign_attrs(history=contract.history()).to_netcdf(
            temporary, engine="netcdf4", format="NETCDF4", encoding=encoding, compute=not lazy.data_vars
        )
        if lazy.data_vars:
            _compute_blocks(lazy.unify_chunks(), temporary)
        with xr.open_dataset(temporary, engine="netcdf4", decode_cf=False) as file_ds:
            digest = hash_content(file_ds, 2**22)
        with netCDF4.Dataset(temporary, "a") as file:
            digest.seal(file)
        return digest.hexdigest()


def _compute_blocks(lazy: xr.Dataset, path: Path) -> None:
    """Compute the lazy variables of a Dataset into a file that has everything else.

    As many blocks as there are processors, each with all variables, are computed at a time: each block is measured
    once, and no further block is in memory.
    """
    from dask import compute

    ends = (
        [(dim, slice(end - n, end)) for n, end in zip(chunks, accumulate(chunks), strict=True)]
        for dim, chunks in lazy.chunks.items()
    )
    boxes = map(dict, product(*ends))
    with netCDF4.Dataset(path, "a") as file:
        file.set_auto_maskandscale(False)
        while batch := list(islice(boxes, _num_processors())):
            for box, block in zip(batch, compute(*map(lazy.isel, batch)), strict=True):
                for name, variable in block.data_vars.items():
                    file[name][tuple(box[dim] for dim in variable.dims)] = variable.values


def _num_processors() -> int:
    """Return the processors of the Dask cluster of this process, else of the machine."""
    with suppress(ImportError, ValueError):
        from distributed import default_client

        return max(sum(default_client().nthreads().values()), 1)
    return num_processors()


class _Backend(xr.backends.BackendEntrypoint):
    """The `xarray` backend for maps, which validates everything that it reads from a file."""

    open_dataset_parameters = ("filename_or_obj", "drop_variables", "any_flags")

    def open_dataset(self, filename_or_obj, *, drop_variables=None, any_flags=False) -> xr.Dataset:
        """Return the map at a path; see `open_map`.

        Args:
            filename_or_obj: the path.
            drop_variables: names of variables that are left out.
            any_flags: True to read flags without a meaning as they are.
        """
        return validation.open_file(filename_or_obj, any_flags).drop_vars(drop_variables or ())


def open_map(path: str | Path, **options) -> xr.Dataset:
    """Open a map, lazily, with checks that report any fault; the returned Dataset may be trusted.

    Names, types, dimensions, flags and units are those of the system's own tables, and no attribute of the file
    decides how its numbers are read. The attribute `content_hash` and each variable's `encoding["sha256"]` are stated
    by the file; `polhode verify` computes them again. See also `sweeps.open_map`.

    Raises:
        MapError: for a file that is missing, not netCDF, or not a map of this contract; and when damaged values of the
            Dataset are read.
    """
    path = validation.map_of(path)
    return validation.require_variables(path, xr.open_dataset(path, engine=_Backend, **options))
