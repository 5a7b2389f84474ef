"""Plain maps beside xarray's Datasets of the same files, and that commands which take them load no more."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from maps import BODIES, TOP, write

import sweeps
from sweeps.maps import admission, summary
from sweeps.schema.refusals import MapError
from sweeps.views import textmap

POINTS = {
    "grid": {"I1": {"start": 0.5, "stop": 1.5}, "I2": {"start": 0.5, "stop": 1.5}, "I3": 1.0, "omega0": 1.0},
    "sample": {"num": 40, "seed": 1},
}
ROOT = Path(admission.__file__).parents[2]
HEAVY = {"numba", "xarray", "pandas", "dask", "matplotlib", "scipy", "netCDF4", "sympy", "ruamel.yaml"}


@pytest.fixture(scope="module", params=[None, BODIES, TOP, POINTS], ids=["grid", "bodies", "top", "points"])
def path(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("plain")
    return write(folder) if request.param is None else write(folder, request.param)


@pytest.fixture
def both(path):
    with admission.opened(path) as plain, sweeps.open_map(path) as ds:
        yield plain, ds


def test_it_holds_what_a_dataset_of_the_file_holds(both):
    plain, ds = both
    assert dict(plain.sizes) == dict(ds.sizes)
    assert plain.attrs == ds.attrs
    assert [*plain.data_vars] == [*ds.data_vars]
    assert {*plain.coords} == {*ds.coords}
    for name in ds.variables:
        one, other = plain[name], ds[name]
        assert (one.dims, one.shape, one.ndim) == (other.dims, other.shape, other.ndim)
        assert one.dtype.kind == other.dtype.kind
        assert {key: str(value) for key, value in one.attrs.items()} == {k: str(v) for k, v in other.attrs.items()}
        np.testing.assert_array_equal(one.values, other.values)


def test_its_parts_are_those_of_a_dataset(both):
    plain, ds = both
    rng = np.random.default_rng(3)
    for name, variable in [*plain.data_vars.items()][::12]:
        for dim in {variable.dims[0], variable.dims[-1]}:
            size = variable.sizes[dim]
            low, step = int(rng.integers(size)), int(rng.integers(1, 4))
            for part in (low, -1, slice(low, None, step), slice(None, None, -1), slice(low, low)):
                found, wanted = variable.isel({dim: part}), ds[name].isel({dim: part})
                assert found.dims == wanted.dims
                np.testing.assert_array_equal(found.values, wanted.values)
                rest = {other: slice(1, None) for other in found.dims[:2]}
                np.testing.assert_array_equal(found.isel(rest).values, wanted.isel(rest).values)
        around = variable.dims[::-1]
        np.testing.assert_array_equal(variable.transpose(*around).values, ds[name].transpose(*around).values)
    further = {dim for dim in ds.dims if dim in ("quantile", "input")}
    assert [*plain.drop_dims(further).variables] == [n for n in plain.variables if n in ds.drop_dims(further).variables]
    cut = {plain.dims[0]: 0}
    assert dict(plain.isel(cut).sizes) == dict(ds.isel(cut).sizes)


def test_it_is_summed_up_and_drawn_alike(both):
    one, other = (summary.summarise(ds) for ds in both)
    assert (one.counts, one.table, one.unlike, one.checks) == (other.counts, other.table, other.unlike, other.checks)
    assert {p: d.worst for p, d in one.deviations.items()} == {p: d.worst for p, d in other.deviations.items()}
    drawn = [textmap.draw(summary.pointwise(ds), {}, 100) for ds in both]
    assert drawn[0] == drawn[1]


def test_a_map_without_a_variable_is_refused_alike(path, tmp_path):
    with sweeps.open_map(path) as ds:
        poor = ds.load().drop_vars(next(iter(ds.data_vars))).drop_encoding()
    poor.to_netcdf(tmp_path / "poor.nc")
    said = []
    for way in (admission.opened, sweeps.open_map):
        with pytest.raises(MapError) as refused:
            way(tmp_path / "poor.nc")
        said.append(str(refused.value))
    assert said[0] == said[1]
    assert "is missing" in said[0]


def test_show_loads_nothing_that_it_does_not_need(tmp_path):
    code = "import sys; from sweeps.__main__ import main; assert main(sys.argv[1:]) == 0; print(*sys.modules)"
    words = [sys.executable, "-c", code, "show", str(write(tmp_path)), "--json"]
    done = subprocess.run(words, capture_output=True, text=True, check=True, env=os.environ | {"PYTHONPATH": str(ROOT)})
    assert not HEAVY & set(done.stdout.splitlines()[-1].split())
