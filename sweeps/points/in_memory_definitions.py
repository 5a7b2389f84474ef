"""Definitions in place of a file: mappings, keywords, DataFrames and Datasets."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps import systems
from sweeps.points import catalogue, compile_kernels
from sweeps.points.loading import read_sweep
from sweeps.points.sweep import Sweep
from sweeps.schema.datasets import DataArray, Dataset
from sweeps.schema.refusals import DefinitionError, display

if TYPE_CHECKING:
    import pandas as pd

FORMS = "a path, a name, a mapping, a DataFrame, a Dataset, or keywords"


def sweep_of(definition: Any, keywords: Mapping[str, Any]) -> Sweep:
    """Return the sweep of the definition and the keywords of `sweeps.survey`."""
    keys = {name: value for name, value in keywords.items() if name in systems.KEYS}
    grid_keys = {name: value for name, value in keywords.items() if name not in systems.KEYS}
    grid = {n: _values_with_unit(v) if _is_of("xarray", "DataArray", v) else v for n, v in grid_keys.items()}
    if _is_of("xarray", "Dataset", definition):
        definition = _of_dataset(definition)
    folder = ""
    if _is_of("pandas", "DataFrame", definition):
        path = _store_table(definition)
        definition, folder = {"table": path.name}, str(path.parent)
        if systems.is_file(keys.get("system")):  # relative to the current folder, not to the table's
            keys["system"] = str(Path(keys["system"]).absolute())
    if isinstance(definition, str | Path):
        if keywords:
            problem = f"{display(definition)} is given beside {next(iter(keywords))}"
            raise DefinitionError(f"definition: {problem}; allowed: a file, or keywords")
        source: Path | dict = catalogue.find_definition(str(definition))
    elif isinstance(definition, Mapping | type(None)):
        source = _merge_grid({**(definition or {}), **keys}, grid)
    else:
        raise DefinitionError(f"definition: {display(definition)} is no definition; allowed: {FORMS}")
    sweep = read_sweep(source, check=False, folder=folder)
    compile_kernels.ensure_compiled(sweep)  # the check calls kernels
    sweep.system.check(sweep.definition, sweep.grid)
    return sweep


def _merge_grid(values: dict, grid: Mapping) -> dict:
    """Return a mapping with a system by its name, and with the entries of `grid` added to its grid, if it has one."""
    if not isinstance(values.get("system", ""), str):
        from sweeps import mechanics

        if isinstance(values["system"], mechanics.System):
            values["system"] = systems.register_system(values["system"])
    grid_values = values.get("grid", {})
    return {**values, "grid": {**grid_values, **grid}} if grid and isinstance(grid_values, Mapping) else values


def _is_of(library: str, kind: str, value: object) -> bool:
    """Return True for an object of a library that has been loaded, as it must have been to make one."""
    return library in sys.modules and isinstance(value, getattr(sys.modules[library], kind))


def _of_dataset(ds: Dataset) -> "dict | pd.DataFrame":
    """Return the grid that the coordinates of a Dataset span, or a table of points.

    Coordinates come before variables. If one of them is no axis of its own (its dimension has another name), each row
    of the dimension is a point of a table. The coordinate `axis` becomes the key `axes`: the axes to spin about.
    """
    variables = {name: variable for name, variable in (ds.coords or ds.data_vars).items() if name != "point"}
    if not all(variable.dims in ((), (name,)) for name, variable in variables.items()):
        table = ds[[*variables]].to_dataframe().reset_index(drop=True)[[*variables]]
        units = {name: variable.attrs.get("units", "1") for name, variable in variables.items()}
        return table.rename(columns={name: f"{name} ({unit})" for name, unit in units.items() if unit != "1"})
    grid = {name: _values_with_unit(variable) for name, variable in variables.items()}
    axes = {"axes": np.atleast_1d(ds["axis"].values).tolist()} if grid.pop("axis", None) is not None else {}
    return {**axes, "grid": grid}


def _values_with_unit(variable: DataArray) -> object:
    """Return the values of a coordinate as plain numbers, or as texts with their unit."""
    unit = variable.attrs.get("units", "")
    values = variable.values.tolist()
    if unit in ("", "1"):
        return values
    return [f"{v!r} {unit}" for v in values] if isinstance(values, list) else f"{values!r} {unit}"


def _store_table(table: "pd.DataFrame") -> Path:
    """Write a DataFrame into the folder of cached tables, and return the file."""
    from sweeps.points import tables

    return tables.store_text(table.to_csv(index=False, float_format="%.17g").encode())
