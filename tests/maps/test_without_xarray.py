"""Plain maps beside xarray's Datasets of the same files, and that commands which take them load no more."""

import itertools
import math

import numpy as np
import pytest
import xarray as xr
from calls import python
from maps import BODIES, TOP, write

import sweeps
from sweeps import systems
from sweeps.maps import admission, summary
from sweeps.maps import plain as plain_maps
from sweeps.schema.refusals import MapError
from sweeps.shards import content, mapfile
from sweeps.systems.presentation import agreement
from sweeps.systems.rigid_body.presentation import figure_flip, figure_stability
from sweeps.views import figures, report, textmap

POINTS = {
    "grid": {"I1": {"start": 0.5, "stop": 1.5}, "I2": {"start": 0.5, "stop": 1.5}, "I3": 1.0, "omega0": 1.0},
    "sample": {"num": 40, "seed": 1},
}
HEAVY = {"numba", "xarray", "pandas", "dask", "matplotlib", "scipy", "netCDF4", "sympy", "ruamel.yaml"}


OTHERS = {"bodies": BODIES, "top": TOP}


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(None, id="grid"),
        pytest.param(POINTS, id="points"),
        *(pytest.param(definition, id=name, marks=pytest.mark.slow) for name, definition in OTHERS.items()),
    ],
)
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


def test_parts_that_lie_across_chunks_are_those_of_a_dataset(tmp_path, monkeypatch):
    monkeypatch.setattr(content, "CHUNK_POINTS", 24)  # two values of I1 and all after them
    path = write(tmp_path)
    with admission.opened(path) as plain, sweeps.open_map(path) as ds:
        assert math.prod(content.chunk_shape(ds["status"].shape)) == 24
        for part in (slice(1, None), slice(None, 0, -1), slice(1, None, 2)):
            box = {dim: part for dim, size in ds["status"].sizes.items() if size > 2}
            for name in ("omega_squared", "status"):
                np.testing.assert_array_equal(plain.variables[name].isel(box).values, ds[name].isel(box).values)


def test_the_slice_of_a_range_takes_its_numbers():
    numbers, ends = np.arange(5), (None, 0, 1, 2, 4, -1, -3)
    for start, stop, step in itertools.product(ends, ends, (1, 2, -1, -2)):
        part = range(5)[start:stop:step]
        assert numbers[plain_maps._slice(part)].tolist() == [*part]


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


def test_a_part_is_written_as_xarray_writes_it(both, tmp_path):
    plain, ds = (summary.pointwise(one) for one in both)
    cut = dict.fromkeys([dim for dim in ds[next(iter(ds.data_vars))].dims][2:], 0)
    part = ds.isel(cut)
    hashes = {mapfile.write_part(one, tmp_path / f"{k}.nc", "part") for k, one in enumerate((plain.isel(cut), part))}
    assert len(hashes) == 1
    texts = {name: {"dtype": "S1"} for name, variable in part.variables.items() if variable.dtype.kind in "OU"}
    whole = {
        name: {"_FillValue": None} for name, v in part.variables.items() if name in part.coords and name not in texts
    }
    part.load().drop_encoding().to_netcdf(tmp_path / "xarray.nc", encoding=texts | whole)
    found = [xr.open_dataset(tmp_path / name).load() for name in ("0.nc", "1.nc", "xarray.nc")]
    assert found[0].attrs["content_hash"] in hashes
    for one in found:
        assert "polhode part\n" in one.attrs["history"] or one is found[-1]
        for variable in (one, *one.variables.values()):
            for name in ("history", "content_hash", "sha256"):
                variable.attrs.pop(name, None)
    assert found[0].identical(found[1])
    assert found[0].identical(found[2])
    for name in ("0.nc", "xarray.nc"):  # texts: of any length, and character by character
        with sweeps.open_map(tmp_path / name) as again:
            assert {*again.variables} == {*part.variables}
            assert all(again[coordinate].equals(part[coordinate]) for coordinate in texts)


def test_pictures_read_of_it_what_they_read_of_a_dataset(both):
    plain, ds = both
    if ds.attrs["system"] != "rigid_body":
        pytest.skip("another system's pictures")
    frequency, *_ = systems.presentation_of(ds).compared
    one, other = (agreement.agreement(each, systems.of_map(ds).layout().variables, frequency) for each in both)
    assert one.worst == other.worst
    for name, value in other.columns.items():
        np.testing.assert_array_equal(one.columns[name], value, err_msg=name)
    assert figure_flip.most_unstable(plain) == figure_flip.most_unstable(ds)
    if systems.presentation_of(plain).draws_plainly(plain):
        shown, fixed = figure_stability.planes(plain)
        assert (shown, fixed) == figure_stability.planes(ds)
        one, other = (figure_stability._slice(each, 2, shown, fixed) for each in both)
        backwards = figure_stability._slice(ds.isel({shown[0]: slice(None, None, -1)}), 2, shown, fixed)
        for name, values in other.items():
            np.testing.assert_array_equal(one[name], values)
            np.testing.assert_array_equal(backwards[name], values)


def test_a_dollar_sign_begins_no_formula_in_either(both):
    for ds in both:
        ds.attrs["title"] = "1 $ = 2 $"
        assert figures.literal(ds).attrs["title"] == r"1 \$ = 2 \$"
    doubled = both[0].reworded({}, lambda value: value * 2 if isinstance(value, str) else value)
    for name, variable in both[0].variables.items():
        assert doubled[name].attrs.get("units", "") == variable.attrs.get("units", "") * 2
        wanted = [value * 2 if isinstance(value, str) else value for value in variable.values.ravel().tolist()]
        np.testing.assert_array_equal(doubled[name].values.ravel(), wanted)


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


def test_the_page_of_a_plain_map_is_that_of_a_dataset(tmp_path):
    path = write(tmp_path)
    pages = []
    for way in (figures.opened, sweeps.open_map):
        with way(path) as ds:
            report.write(ds, tmp_path / "report.html")
        pages.append((tmp_path / "report.html").read_bytes())
        assert isinstance(ds, xr.Dataset) == (way is sweeps.open_map)
    assert pages[0] == pages[1]


def test_show_and_slice_load_nothing_that_they_do_not_need(tmp_path):
    path, out = str(write(tmp_path)), str(tmp_path / "slice.nc")
    place = ["--axis", "2", "--omega0", "1", "--epsilon", "1e-6", "-o", out]
    code = (
        "import sys; from sweeps.__main__ import main\n"
        f"assert main(['show', {path!r}]) == 0; print(*sys.modules)\n"
        f"assert main(['slice', {path!r}, *{place}]) == 0; print(*sys.modules)"
    )
    lines = python(code, NUMBA_CACHE_DIR=str(tmp_path)).splitlines()  # what others are storing, Numba looks at
    loaded = [set(line.split()) for line in lines if "sweeps.__main__" in line]
    assert len(loaded) == 2
    assert not HEAVY & loaded[0]
    assert HEAVY & loaded[1] == {"netCDF4"}


def test_pictures_of_a_grid_load_neither_xarray_nor_the_compiler(tmp_path):
    path, out = str(write(tmp_path)), str(tmp_path / "figures")
    code = (
        f"import sys; sys.argv = ['polhode', 'figures', {path!r}, '-o', {out!r}, '--only', 'polhodes']\n"
        "from sweeps.process import startup; startup.configure()\n"
        "from sweeps.__main__ import main; assert main() == 0; print(*sys.modules)"
    )
    loaded = set(python(code).splitlines()[-1].split())
    heavy = {"numba.core", "xarray", "pandas", "netCDF4", "scipy", "sympy", "fontTools.subset"}
    assert not heavy & loaded
