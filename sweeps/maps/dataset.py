"""Columns → `xarray.Dataset`: names, units, flags and provenance, each from one table."""

from collections.abc import Mapping
from functools import partial

import numpy as np
import xarray as xr

from sweeps.points.columns import measure_points
from sweeps.points.estimate import integration_seconds
from sweeps.points.sweep import Grid, Sweep
from sweeps.shards import contract

LONG_SECONDS = 10.0  # estimated time of a survey from which on its progress is shown
PIECES = 40  # steps of the bar


def survey_grid(sweep: Sweep, chunks=None, threads: int = 1) -> xr.Dataset:
    """Return the map of a sweep as a Dataset over the grid's dimensions.

    Args:
        sweep: the sweep.
        chunks: as of `sweeps.survey`; the Dataset is lazy unless it is None.
        threads: number of threads that measure a Dataset that is not lazy.
    """
    grid, variables = sweep.grid, sweep.variables.values()
    coordinates = {name: xr.Variable(*coordinate) for name, coordinate in contract.coordinates(sweep).items()}
    arrays = [coordinates[name] for name in grid.arguments]
    if chunks is not None:
        sizes = _chunk_sizes(grid, chunks)
        arrays = [array.chunk({d: sizes[d] for d in array.dims}) for array in arrays]
    is_long = chunks is None and integration_seconds(sweep, grid.size) > LONG_SECONDS * threads
    results = xr.apply_ufunc(
        partial(_measure_columns, sweep=sweep, threads=threads, num_pieces=PIECES * is_long),
        *arrays,
        output_core_dims=[list(variable.over) for variable in variables],
        dask="parallelized",
        output_dtypes=[np.dtype(variable.dtype) for variable in variables],
        dask_gufunc_kwargs={"output_sizes": grid.extra_sizes} if grid.extra_sizes else {},
    )
    data = {}
    for spec, result in zip(variables, results if len(variables) > 1 else (results,), strict=True):
        data[spec.name] = result.transpose(*grid.dims, *grid.extra_dimensions, missing_dims="ignore")
        data[spec.name].attrs = spec.attributes_among(sweep.variables)
    return xr.Dataset(data, coordinates, contract.provenance(sweep))


def _measure_columns(
    *arrays: np.ndarray, sweep: Sweep, threads: int, num_pieces: int
) -> tuple[np.ndarray, ...] | np.ndarray:
    """Return the system's columns, in the order of its variables, for broadcastable arrays in that of its arguments."""
    shape = np.broadcast_shapes(*(array.shape for array in arrays))
    names = sweep.grid.arguments
    points = {name: np.broadcast_to(a, shape).reshape(-1) for name, a in zip(names, arrays, strict=True)}
    columns = measure_points(points, sweep, threads, num_pieces).values()
    results = tuple(column.reshape(shape + column.shape[1:]) for column in columns)
    return results if len(results) > 1 else results[0]  # apply_ufunc takes a single output bare


def _chunk_sizes(grid: Grid, chunks) -> dict[str, int]:
    """Return dimension → chunk length, from a mapping, a number of points or "auto" (last dimensions whole)."""
    if isinstance(chunks, Mapping):
        unknown = sorted(set(chunks) - set(grid.dims))
        if unknown:
            raise ValueError(f"chunks: {unknown} are no dimensions; allowed: {', '.join(grid.dims)}")
        return {dim: chunks.get(dim, size) for dim, size in grid.sizes.items()}
    points_left = 2**18 if chunks == "auto" else int(chunks)
    sizes = {}
    for dim, size in zip(reversed(grid.dims), reversed(grid.shape), strict=True):
        sizes[dim] = max(1, min(size, points_left))
        points_left //= sizes[dim]
    return sizes
