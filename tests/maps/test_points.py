"""Maps of points without a grid: made, merged, opened, shown, verified."""

import hashlib
import json
import re

import netCDF4
import numpy as np
import pytest
import xarray as xr
from damages import PICTURE_COLUMNS

import sweeps
from sweeps.__main__ import main
from sweeps.maps import storage
from sweeps.points import catalogue
from sweeps.points.loading import read_sweep
from sweeps.schema.refusals import MapError
from sweeps.shards import content_hash, merging
from sweeps.shards.shard import write_shard

DEFINITION = {
    "title": "Drawn",
    "axes": [1, 2],
    "sample": {"num": 200, "seed": 1},
    "grid": {
        "I1": {"start": 0.5, "stop": 1.5},
        "I2": {"start": 0.5, "stop": 1.5},
        "I3": 1.0,
        "omega0": {"start": 0.1, "stop": 100.0, "spacing": "log"},
    },
    "integration": {"variables": PICTURE_COLUMNS},
}
GRIDS = {
    "symmetric_top": {"ratio": {"start": 0.5, "stop": 1.9}, "omega3": {"start": 1.0, "stop": 9.0}, "half_angle": 20.0},
    "tumbling": {
        "I1": {"start": 0.6, "stop": 0.7},
        "I2": {"start": 0.8, "stop": 0.9},
        "I3": 1.0,
        "energy": {"start": 1.05, "stop": 1.4},
        "omega0": 1.0,
    },
    "twist": {"I1": {"start": 0.3, "stop": 0.5}, "I2": 0.85, "I3": 1.0, "chi": 0.1, "theta": 1.5, "omega0": 1.0},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("points")


@pytest.fixture(scope="module")
def path(folder):
    storage.write_map(sweeps.survey(DEFINITION), folder / "map.nc")
    return str(folder / "map.nc")


def test_points_are_one_dimension_with_their_own_coordinates(path):
    with sweeps.open_map(path) as ds:
        assert ds.omega_squared.dims == ("point", "axis", "I3", "epsilon", "phase")
        assert ds.sizes["point"] == 200
        assert {name: ds[name].dims for name in ("I1", "I2", "omega0")} == dict.fromkeys(
            ("I1", "I2", "omega0"), ("point",)
        )
        assert ds["point"].values.tolist() == list(range(1, 201))
        assert ds["I1"].attrs["units"] == "kg m2"
        # the same bodies by way of a list, to the last bit
        rows = zip(*(ds[name].values[:3].tolist() for name in ("I1", "I2", "omega0")), strict=True)
        bodies = [{"name": f"{k}", "I1": a, "I2": b, "I3": 1.0, "omega0": w} for k, (a, b, w) in enumerate(rows)]
        of_bodies = sweeps.survey({"axes": [1, 2], "bodies": bodies, "grid": {}})
        assert np.array_equal(ds.omega_squared.values[:3].ravel(), of_bodies.omega_squared.values.ravel())


@pytest.mark.parametrize("system", GRIDS)
def test_every_system_has_points(system):
    sweep = read_sweep({"system": system, "sample": {"method": "latin", "num": 24}, "grid": GRIDS[system]})
    points = sweep.grid.points(0, sweep.grid.size)
    assert sweep.grid.dims[0] == "point"
    for name, sampled_range in sweep.definition.sampled_ranges.items():
        column = np.unique(points[name])
        assert sampled_range.start <= column[0] < column[-1] <= sampled_range.stop
        assert column.size == 24


def test_a_point_is_chosen_by_its_number_or_its_own_coordinates(path, capsys):
    assert main(["point", path, "--axis", "2", "--point", "7", "--json"]) == 0
    row = json.loads(capsys.readouterr().out)["point"]
    values = {name: f"{row[name]['value'] + 1e-9!r}" for name in ("I1", "I2", "omega0")}
    options = [text for name, value in values.items() for text in (f"--{name}", value)]
    assert main(["point", path, "--axis", "2", *options]) == 0
    assert "point = 7 (nearest to I1 = " in capsys.readouterr().out


def test_pictures_report_and_summary_are_of_points(path, tmp_path, capsys):
    from sweeps.views import figures, report

    with sweeps.open_map(path) as ds:
        draw_functions = figures.pictures(ds)
        assert list(draw_functions) == ["triangle", "points", "theory_against_measured"]
        assert draw_functions["triangle"]() is None  # I1 is above I3 somewhere
        figure = draw_functions["points"]()
        assert [len(ax.collections[0].get_offsets()) for ax in figure.axes[:2]] == [200, 200]
        assert figures.animations(ds) == {}
        report.write_report(ds, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert '"cloud":["I1","I2","omega0"]' in page
    assert "Hover for values" in page
    assert main(["show", path]) == 0
    output = capsys.readouterr().out
    assert "200 point × 2 axis" in output
    assert "y axis" not in output


SHAPES = {
    "axes": [2],
    "grid": {
        "ratios": {"I1_over_I3": [0.2, 0.6, 0.9], "thickness": {"start": 0.1, "stop": 0.7, "num": 4}},
        "I3": [1.0, 2.0],
        "omega0": 1.0,
    },
    "integration": {"variables": PICTURE_COLUMNS},
    "shards": 2,
}


@pytest.fixture(scope="module")
def shapes(tmp_path_factory):
    """The path of a map of a grid of shapes, merged from two shards."""
    folder = tmp_path_factory.mktemp("shapes")
    sweep = read_sweep(SHAPES, "shapes_here")
    for number in (1, 2):
        write_shard(sweep, number, 2, folder / f"{number}-of-2.nc")
    merging.merge_shards(sweep, [folder], folder / "map.nc")
    return folder / "map.nc"


def test_a_grid_of_shapes_has_moments_along_its_dimensions(shapes):
    expected = sweeps.survey(SHAPES)
    with sweeps.open_map(shapes) as ds:
        assert (ds["I1"].dims, ds["I2"].dims) == (("I1_over_I3", "I3"), ("I1_over_I3", "thickness", "I3"))
        xr.testing.assert_equal(ds.load(), expected.load())
        assert ds.attrs["content_hash"] == content_hash.hash_content(expected).hexdigest()
        assert float((ds.I1 + ds.I2 - ds.I3).min()) > 0  # every point is a body
        assert int((ds["triangle_margin"] < 0).sum()) == 0
    with netCDF4.Dataset(shapes) as file:  # CF: auxiliary coordinates are named by every variable
        assert file["omega_squared"].coordinates == "I1 I2"
    assert main(["verify", str(shapes), "--points", "3"]) == 0


def test_a_shape_is_found_by_its_moments(shapes, capsys):
    options = ["--I1", "1.21", "--I2", "1.5", "--I3", "1.9"]  # x = 0.6, y = 0.76: room 0.6
    assert main(["point", str(shapes), "--json", *options]) == 0
    point = json.loads(capsys.readouterr().out)["point"]
    values = [point[name]["value"] for name in ("I1_over_I3", "thickness", "I1", "I2", "I3")]
    assert values == pytest.approx([0.6, 0.5, 1.2, 1.4, 2.0])
    assert main(["point", str(shapes), "--I1", "1.21"]) == 2
    assert "--thickness 0.1, 0.3, 0.5, 0.7, or --I2" in capsys.readouterr().err


def test_moments_of_shapes_along_other_dimensions_are_refused(shapes, tmp_path):
    with xr.open_dataset(shapes, engine="netcdf4") as ds:
        ds = ds.load()
    for name, dims in (("I1", ("thickness", "I3")), ("I2", ("thickness", "I1_over_I3", "I3"))):
        sizes = [ds.sizes[dim] for dim in dims]
        ds.assign_coords({name: (dims, np.ones(sizes))}).to_netcdf(tmp_path / f"{name}.nc", engine="netcdf4")
        with pytest.raises(MapError, match=f"{name}: lies along {' × '.join(dims)}; allowed"):
            sweeps.open_map(tmp_path / f"{name}.nc")


def test_the_hash_of_a_table_stands_in_its_map(tmp_path, capsys):
    (tmp_path / "bodies.csv").write_text("I1,I2,omega0\n1.0,1.5,2.0\n1.5,1.0,3.0\n")
    (tmp_path / "my.yaml").write_text("table: bodies.csv\naxes: [2]\ngrid: {I3: 2.0}\n")
    storage.write_map(sweeps.survey(tmp_path / "my.yaml"), tmp_path / "map.nc")
    with sweeps.open_map(tmp_path / "map.nc") as ds:
        name, digest = ds.attrs["inputs"].split()
        assert (name, digest) == ("bodies.csv", hashlib.sha256((tmp_path / "bodies.csv").read_bytes()).hexdigest())
        assert ds["omega0"].values.tolist() == [2.0, 3.0]
    assert main(["verify", str(tmp_path / "map.nc"), "--points", "2", "--definition", str(tmp_path / "my.yaml")]) == 0
    assert main(["verify", str(tmp_path / "map.nc"), "--points", "2"]) == 0
    assert "not checked" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["point", "--axis", "2"], "--point 1 to 200 (200 values), or --I1 0.5"),
        (["point", "--axis", "2", "--point", "201"], "--point: 201 is not in this map"),
        (["point", "--axis", "2", "--point", "2", "--I1", "1"], "along point, which is chosen already"),
        (["point", "--axis", "2", "--I1", "one"], "--I1: 'one' is no number"),
        (["slice", "-o", "slice.nc", "--axis", "2"], "form no plane"),
    ],
)
def test_what_points_cannot_do_is_said(path, arguments, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main([arguments[0], path, *arguments[1:]]) == 2
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_definitions_of_the_readme_run(tmp_path):
    text = (catalogue.FOLDER.parents[1] / "sweeps/handbook/text/howto/points.md").read_text(encoding="utf-8")
    sample_text, bodies_text, shapes_text = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)[:3]
    (tmp_path / "bodies.csv").write_text("I1 (kg m2),I2 (kg m2),omega0 (rpm)\n0.5,0.9,60\n0.7,0.9,30\n")
    ends = "grid: {I1: {start: 0.5, stop: 0.9}, I2: 0.8, I3: 1.0, omega0: 1.0}\n"
    of_shapes = ("axis", "I1_over_I3", "thickness")
    for text, dims, shape in (
        (sample_text + ends, ("point", "axis"), (1_000_000, 3)),
        (bodies_text, ("point", "axis"), (2, 3)),
        (shapes_text, of_shapes, (3, 50, 50)),
    ):
        (tmp_path / "my.yaml").write_text(text)
        grid = read_sweep(tmp_path / "my.yaml").grid
        assert (grid.dims[: len(dims)], grid.shape[: len(dims)]) == (dims, shape)
        assert np.isfinite(grid.points(0, 3)["I1"]).all()
