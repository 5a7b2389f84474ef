"""Small maps of several kinds, on the disk, for tests of code that reads maps."""

import numpy as np
import xarray as xr

import sweeps
from sweeps.maps import storage
from sweeps.points.loading import read_sweep
from sweeps.schema.variables import Role
from sweeps.shards import contract

DEFINITION = {
    "title": "For tests",
    "axes": [1, 2, 3],
    "grid": {
        "I1": {"start": 0.5, "stop": 1.5, "num": 5},
        "I2": [0.75, 1.0, 1.4],
        "I3": 1.0,
        "omega0": [-3.0, 1.0],
        "epsilon": [1e-6, 1e-2],
    },
}
BODIES = {
    "bodies": [
        {"name": "Tennis racket", "I1": 0.00121, "I2": 0.01638, "I3": 0.01748},
        {"name": "Plate", "ratios": {"I1": 1.0, "I2": 1.0, "I3": 2.0}},
    ],
    "grid": {"omega0": 10.0, "epsilon": [1e-6, 1e-3, 1e-2]},
}
TOP = {
    "system": "symmetric_top",
    "grid": {"ratio": [0.5, 1.5, 2.5], "omega3": [-1.0, 10.0], "half_angle": [10.0, 30.0]},
}


def random_map(definition):
    """Return the map of a definition with random values: kernels would be compiled for seconds."""
    sweep, rng = read_sweep(definition), np.random.default_rng(1)
    variables = {}
    for name, spec in sweep.variables.items():
        shape = (*sweep.grid.shape, *sweep.shape_at(name))
        num_flags = 2 if spec.role == Role.STATUS else len(spec.flags) - 1
        values = rng.integers(0, num_flags, shape) if spec.flags else rng.uniform(0.5, 1.5, shape)
        variables[name] = (*sweep.grid.dims, *spec.over), values.astype(spec.dtype), spec.attributes
    coordinates = {name: xr.Variable(*column) for name, column in contract.coordinates(sweep).items()}
    return xr.Dataset(variables, coordinates, contract.provenance(sweep))


def write(folder, definition=DEFINITION, name="map.nc"):
    """Measures a definition, writes its map into a folder and returns its path."""
    storage.write_map(sweeps.survey(definition), folder / name)
    return folder / name


def assert_same_bits(first, second):
    """Assert that two maps have the same names, dimensions, types and bytes, NaN and signed zeros included."""
    assert set(first.variables) == set(second.variables)
    for name in first.variables:
        a, b = first[name], second[name]
        assert a.dims == b.dims, name
        if a.dtype.kind in "UOT":
            assert a.values.tolist() == b.values.tolist(), name
        else:
            assert a.dtype == b.dtype, name
            assert a.values.tobytes() == b.values.tobytes(), name
