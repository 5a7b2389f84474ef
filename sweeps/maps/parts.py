"""What a command makes of a map, as a file for programs that show lines and planes."""

from pathlib import Path
from typing import TYPE_CHECKING

import netCDF4
import numpy as np

from sweeps.maps.plain import PlainMap
from sweeps.process.files import replaced
from sweeps.schema.boxes import runs
from sweeps.shards import contract
from sweeps.shards.content import ContentHash

if TYPE_CHECKING:
    import xarray as xr

PART_VALUES = 2**21  # of a variable in memory at a time


def write_part(ds: "PlainMap | xr.Dataset", path: str | Path, command: str) -> str:
    """Write a part of a map made by `command`, and return its content hash.

    What is no dimension any more stays as a scalar coordinate; text becomes characters, which CDO and ncview can read.
    """
    digest = ContentHash()
    history = f"{contract.history(command)}\n{ds.attrs.get('history', '')}".strip()
    with replaced(path) as temporary, netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
        file.set_auto_maskandscale(False)
        for dim, size in ds.sizes.items():
            file.createDimension(dim, size)
        for name in (*ds.data_vars, *ds.coords):
            _put(file, name, ds, digest)
        file.setncatts(ds.attrs | {"history": history})
        digest.seal(file)
    return digest.hexdigest()


def _put(file: netCDF4.Dataset, name: str, ds: "PlainMap | xr.Dataset", digest: ContentHash) -> None:
    """Write one variable or coordinate part by part, and hash each part."""
    variable, is_data = ds.variables[name], name in ds.data_vars
    dtype, dims, beside = variable.dtype, variable.dims, _beside(ds, variable.dims) if is_data else ""
    missing, more = np.nan if is_data and dtype.kind == "f" else None, {"coordinates": beside} if beside else {}
    text = _characters(variable.values) if dtype.kind in "OU" else None
    if text is not None:
        dtype, dims, more = text.dtype, (*dims, f"string{text.shape[-1]}"), more | {"_Encoding": "utf-8"}
        if dims[-1] not in file.dimensions:
            file.createDimension(dims[-1], text.shape[-1])
    made = file.createVariable(name, dtype, dims, fill_value=missing)
    made.setncatts(dict(variable.attrs) | more)
    digest.declare(name, variable.dims, variable.shape, variable.dtype)
    for box in runs(variable.shape, PART_VALUES):
        part = variable[box].values
        digest.update(name, part)
        made[box] = part if text is None else text[box]


def _characters(values: np.ndarray) -> np.ndarray:
    """Text as characters of UTF-8, along one more dimension."""
    encoded = np.array([str(text).encode() for text in values.reshape(-1)])
    return encoded.view("S1").reshape(*values.shape, -1)


def _beside(ds: "PlainMap | xr.Dataset", dims: tuple[str, ...]) -> str:
    """Names of the coordinates, other than the dimensions' own, that a variable over some dimensions has."""
    found = (str(name) for name, one in ds.coords.items() if name not in ds.sizes and {*one.dims} <= {*dims})
    return " ".join(sorted(found))
