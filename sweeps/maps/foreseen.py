"""A map before it is measured: all that it will say but its measured values."""

from typing import TYPE_CHECKING

import numpy as np

from sweeps.maps.plain import PlainMap, PlainVariable
from sweeps.shards import contract

if TYPE_CHECKING:
    from sweeps.points.sweep import Sweep


class UnmeasuredError(Exception):
    """Somebody asks a map that is only foreseen for a measured value."""


class Unmeasured:
    """Values that are not there yet.

    Args:
        shape: of the values.
        dtype: likewise.
    """

    def __init__(self, shape: tuple[int, ...], dtype: str):
        self.shape, self.dtype = shape, np.dtype(dtype)

    def __getitem__(self, key):
        raise UnmeasuredError


def foreseen(sweep: "Sweep") -> PlainMap:
    """The map that a sweep over a grid will have, with its coordinates and attributes.

    Args:
        sweep: whose points are those of a grid.
    """
    grid, coordinates = sweep.grid, contract.coordinates(sweep)
    coords = {name: PlainVariable(dims, np.asarray(v), attrs) for name, (dims, v, attrs) in coordinates.items()}
    unmeasured = {}
    for name, variable in sweep.variables.items():
        data = Unmeasured((*grid.shape, *sweep.shape_at(name)), variable.dtype)
        unmeasured[name] = PlainVariable((*grid.dims, *variable.over), data, variable.attributes)
    return PlainMap(unmeasured, coords, contract.provenance(sweep))
