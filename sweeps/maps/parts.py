"""What a command makes of a map, as a file for programs that show lines and planes."""

from pathlib import Path
from typing import TYPE_CHECKING

import netCDF4
import numpy as np

from sweeps.files import replaced
from sweeps.maps.plain import PlainMap
from sweeps.shards import contract
from sweeps.shards.content import hashed

if TYPE_CHECKING:
    import xarray as xr


def write_part(ds: "PlainMap | xr.Dataset", path: str | Path, command: str) -> str:
    """Write a part of a map made by `command`, and return its content hash.

    What is no dimension any more stays as a scalar coordinate; text becomes characters, which CDO and ncview can read.
    """
    digest = hashed(ds)
    history = f"{contract.history(command)}\n{ds.attrs.get('history', '')}".strip()
    with replaced(path) as temporary, netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
        file.set_auto_maskandscale(False)
        for dim, size in ds.sizes.items():
            file.createDimension(dim, size)
        own = digest.digests()
        for name in (*ds.data_vars, *ds.coords):
            _put(file, name, ds, {"sha256": own[name]})
        file.setncatts(ds.attrs | {"history": history, "content_hash": digest.hexdigest()})
    return digest.hexdigest()


def _put(file: netCDF4.Dataset, name: str, ds: "PlainMap | xr.Dataset", more: dict) -> None:
    """Writes one variable or coordinate."""
    variable, is_data = ds.variables[name], name in ds.data_vars
    values, dims, missing = variable.values, variable.dims, None
    if values.dtype.kind in "OU":
        values, more = _characters(values), {"_Encoding": "utf-8"} | more
        dims = (*dims, f"string{values.shape[-1]}")
        if dims[-1] not in file.dimensions:
            file.createDimension(dims[-1], values.shape[-1])
    elif values.dtype.kind == "f" and is_data:
        missing = np.nan
    if is_data and (beside := _beside(ds, variable.dims)):
        more = more | {"coordinates": beside}
    made = file.createVariable(name, values.dtype, dims, fill_value=missing)
    made.setncatts(dict(variable.attrs) | more)
    made[...] = values


def _characters(values: np.ndarray) -> np.ndarray:
    """Text as characters of UTF-8, along one more dimension."""
    encoded = np.array([str(text).encode() for text in values.reshape(-1)])
    return encoded.view("S1").reshape(*values.shape, -1)


def _beside(ds: "PlainMap | xr.Dataset", dims: tuple[str, ...]) -> str:
    """Names of the coordinates, other than the dimensions' own, that a variable over some dimensions has."""
    found = (str(name) for name, one in ds.coords.items() if name not in ds.sizes and {*one.dims} <= {*dims})
    return " ".join(sorted(found))
