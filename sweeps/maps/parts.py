"""What a command makes of a map, as a file for programs that show lines and planes."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sweeps.maps.plain import PlainMap
from sweeps.schema.boxes import runs
from sweeps.shards import contract
from sweeps.shards.mapfile import written

if TYPE_CHECKING:
    import xarray as xr

PART_VALUES = 2**21  # of a variable in memory at a time


def write_part(ds: "PlainMap | xr.Dataset", path: str | Path, command: str) -> str:
    """Write a part of a map made by `command`, and return its content hash.

    What is no dimension any more stays as a scalar coordinate; text becomes characters, which CDO and ncview can read.
    """
    lengths = {name: _length(one.values) for name, one in ds.variables.items() if one.dtype.kind in "OU"}
    with written(path, {**ds.sizes, **{f"string{length}": length for length in lengths.values()}}) as file:
        for name in (*ds.data_vars, *ds.coords):
            variable, attributes = ds.variables[name], dict(ds.variables[name].attrs)
            if name in ds.data_vars and (beside := _beside(ds, variable.dims)):
                attributes["coordinates"] = beside
            if name in lengths:
                file.add_text(name, variable.dims, lengths[name], attributes)
            else:
                missing = np.nan if name in ds.data_vars and variable.dtype.kind == "f" else False
                file.add(name, variable.dims, variable.dtype, attributes, fill_value=missing)
            for box in runs(variable.shape, PART_VALUES):
                file.put(name, variable[box].values)
        history = f"{contract.history(command)}\n{ds.attrs.get('history', '')}".strip()
        return file.seal(ds.attrs | {"history": history})


def _length(texts: np.ndarray) -> int:
    """Return the number of bytes of the longest text, in UTF-8."""
    return max(len(str(text).encode()) for text in texts.reshape(-1)) or 1


def _beside(ds: "PlainMap | xr.Dataset", dims: tuple[str, ...]) -> str:
    """Return names of the coordinates, other than the dimensions' own, that a variable over some dimensions has."""
    names = (str(name) for name, one in ds.coords.items() if name not in ds.sizes and {*one.dims} <= {*dims})
    return " ".join(sorted(names))
