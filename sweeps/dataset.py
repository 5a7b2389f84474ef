"""Columns → `xarray.Dataset`: names, units, flags and provenance, each from one table.

`evaluate` is the one function that turns coordinates into a Dataset. A shard under Snakemake, a chunk under Dask and a
call in a notebook all go through it.
"""

import platform
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib.metadata import version
from itertools import pairwise

import numpy as np
import xarray as xr

from sweeps import systems
from sweeps.definition import Definition
from sweeps.grid import Grid

CONTRACT_VERSION = "1.0"
CONVENTIONS = "CF-1.11"


def evaluate(coordinates: Mapping[str, xr.DataArray], definition: Definition, threads: int = 1) -> xr.Dataset:
    """Measures the points of some coordinates.

    Args:
        coordinates: a `DataArray` for each of the system's arguments (for the rigid body I1, I2, I3, axis, omega0,
            epsilon and phase), of any dimensions; they broadcast together by name. Dask arrays stay lazy.
        definition: whose system is measured, and how each run is made; its grid takes no part.
        threads: threads that share the work of one call; they change no bit.

    Returns:
        A Dataset with the variables of the system over the dimensions of the coordinates.
    """
    system = systems.resolve(definition.system)
    variables = system.variables(definition).values()
    arrays = [coordinates[name] for name in system.arguments(definition)]
    results = xr.apply_ufunc(
        partial(_columns, definition=definition, threads=threads),
        *arrays,
        output_core_dims=[[] for _ in variables],
        dask="parallelized",
        output_dtypes=[np.dtype(variable.dtype) for variable in variables],
        keep_attrs=False,
    )
    named = zip(variables, results if len(variables) > 1 else (results,), strict=True)
    return xr.Dataset(
        {v.name: (result.dims, result.data, v.attributes) for v, result in named},
        coords={name: array for name, array in _index_coordinates(arrays)},
    )


def _index_coordinates(arrays):
    for array in arrays:
        yield from array.coords.items()


def _columns(*arrays: np.ndarray, definition: Definition, threads: int) -> tuple[np.ndarray, ...]:
    """The system's columns, in the order of its variables, for broadcastable arrays in the order of its arguments."""
    system = systems.resolve(definition.system)
    shape = np.broadcast_shapes(*(array.shape for array in arrays))
    flat = [np.broadcast_to(array, shape).reshape(-1) for array in arrays]
    names = system.arguments(definition)

    def part(bounds):
        points = {name: array[slice(*bounds)] for name, array in zip(names, flat, strict=True)}
        return system.columns(points, definition.integration)

    cuts = np.linspace(0, flat[0].size, threads + 1).astype(int)
    bounds = list(pairwise(cuts))
    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(part, bounds)) if threads > 1 else [part(bounds[0])]
    columns = tuple(
        np.concatenate([columns[name] for columns in parts]).astype(variable.dtype, copy=False).reshape(shape)
        for name, variable in system.variables(definition).items()
    )
    return columns if len(columns) > 1 else columns[0]  # apply_ufunc takes a single output bare


def point_coordinates(grid: Grid, start: int, stop: int) -> dict[str, xr.DataArray]:
    """Coordinates of the points start … stop − 1 of a grid, along one dimension `point`."""
    return {name: xr.DataArray(values, dims="point") for name, values in grid.points(start, stop).items()}


def grid_coordinates(grid: Grid) -> dict[str, xr.DataArray]:
    """Coordinates of a whole grid, each along its own dimension (or, if auxiliary, along another), with attributes."""
    table = systems.resolve(grid.definition.system).coordinates(grid.definition)
    arrays = {}
    for dim, values in grid.coordinates.items():
        arrays[dim] = xr.DataArray(values, dims=dim, coords={dim: values}, attrs=table[dim].attributes)
    for name, (dim, values) in grid.auxiliary.items():
        values = values if values.dtype.kind == "U" else values.astype(table[name].dtype)
        arrays[name] = xr.DataArray(values, dims=dim, attrs=table[name].attributes)
    return arrays


def survey_grid(definition: Definition, chunks=None, threads: int = 1) -> xr.Dataset:
    """The map of a definition as a Dataset over the grid's dimensions; lazy where `chunks` is given."""
    grid = Grid(definition)
    coordinates = grid_coordinates(grid)
    arrays = {name: coordinates[name] for name in grid.arguments}
    if chunks is not None:
        sizes = _chunk_sizes(grid, chunks)
        arrays = {name: array.chunk({d: sizes[d] for d in array.dims}) for name, array in arrays.items()}
    dataset = evaluate(arrays, definition, threads)
    dataset = dataset.assign_coords({name: array.variable for name, array in coordinates.items()})
    dataset = dataset.transpose(*grid.dims)
    return dataset.assign_attrs(provenance(definition))


def _chunk_sizes(grid: Grid, chunks) -> dict[str, int]:
    """Chunk length of each dimension: as given by name, or ("auto", or a number of points) the last ones whole."""
    if isinstance(chunks, Mapping):
        unknown = sorted(set(chunks) - set(grid.dims))
        if unknown:
            raise ValueError(f"chunks: {unknown} are no dimensions; allowed: {', '.join(grid.dims)}")
        return {dim: chunks.get(dim, size) for dim, size in zip(grid.dims, grid.shape, strict=True)}
    room = 2**18 if chunks == "auto" else int(chunks)
    sizes = {}
    for dim, size in zip(reversed(grid.dims), reversed(grid.shape), strict=True):
        sizes[dim] = max(1, min(size, room))
        room //= sizes[dim]
    return sizes


def provenance(definition: Definition) -> dict:
    """Global attributes of a map, but for its history and content hash, which storage adds."""
    system = systems.resolve(definition.system)
    return {
        "title": definition.title,
        "source": f"Polhode {version('polhode')} (Python {platform.python_version()}, NumPy {version('numpy')}, "
        f"Numba {version('numba')}), {system.method(definition)}",
        "references": system.references,
        "Conventions": CONVENTIONS,
        "contract_version": CONTRACT_VERSION,
        "system": definition.system,
        "definition": definition.text,
        "kernel_fingerprint": system.fingerprint(),
    } | ({"inputs": definition.inputs} if definition.inputs else {})
