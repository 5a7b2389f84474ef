"""Along which dimensions the bodies of a map are spread: their moments, their shapes, points or names."""

from typing import TYPE_CHECKING

from sweeps.schema.boxes import dimensions
from sweeps.systems.bodies.shape_coordinates import COORDINATES
from sweeps.systems.bodies.variables import MOMENTS

if TYPE_CHECKING:
    import xarray as xr

SHAPE = tuple(COORDINATES)


def is_of_shapes(ds: "xr.Dataset") -> bool:
    """Return True if a map is a grid of shapes."""
    return {*SHAPE} <= {*ds.dims}


def is_grid(ds: "xr.Dataset") -> bool:
    """Return True if a map is a grid of moments or of shapes."""
    return {*MOMENTS} <= {*ds.dims} or is_of_shapes(ds)


def moments_over(ds: "xr.Dataset") -> tuple[str, ...]:
    """Return the dimensions that the moments of a map lie along."""
    own = {dim for name in MOMENTS for dim in ds[name].dims}
    return tuple(dim for dim in dimensions(ds) if dim in own)
