"""Pictures of slices: whatever `isel` and `sel` leave of a map is drawn, or refused in words."""

from functools import cache

import netCDF4
import numpy as np
import pytest
import xarray as xr
from maps import random_map
from matplotlib.figure import Figure
from report_pages import KINDS
from small_maps import SMALL

import sweeps
from sweeps import plot
from sweeps.__main__ import main
from sweeps.maps import slices, storage
from sweeps.schema.refusals import RefusedError
from sweeps.views import figures

MAPS = {
    "rigid_body": KINDS["plane"],
    "shapes": KINDS["shapes"],
    "bodies": {
        "bodies": [
            {"name": "Tennis racket", "I1": 0.00121, "I2": 0.01638, "I3": 0.01748, "omega0": 3.0},
            {"name": "Plate", "ratios": {"I1": 1.0, "I2": 1.0, "I3": 2.0}, "omega0": 1.0},
        ],
        "grid": {"epsilon": [1e-6, 1e-3, 1e-2]},
    },
    "draws": KINDS["points"],
    **{name: {"system": name} | SMALL[name] for name in ("symmetric_top", "twist", "tumbling")},
    "pendulum": {"system": "pendulum", "grid": {"length": [0.5, 1.0, 2.0], "gravity": [1.6, 9.8], "epsilon": 1e-6}},
}


@cache
def make(name):
    """Return the map of a name."""
    return random_map(MAPS[name])


def choices(ds, count):
    """Yield random choices along the dimensions: all of one, one place, or some in any order, some of them twice."""
    random = np.random.default_rng(29)
    for _ in range(count):
        selection = {}
        for dim, size in ds.sizes.items():
            kind = random.integers(3)
            if kind:
                places = random.integers(size, size=random.integers(1, 4)).tolist()
                selection[dim] = places if kind == 1 else places[0]
        yield selection


def stored_order(ds, dim, places):
    """Return places along a dimension as a slice has them, once each: numbers up or down, names as they are given."""
    if not isinstance(places, list):
        return [places]
    is_text = ds[dim].dtype.kind in "OU"
    if is_text:
        return list(dict.fromkeys(places))
    return places if places == sorted({*places}, reverse=True) else sorted({*places})


@pytest.mark.parametrize("name", MAPS)
def test_a_slice_has_the_dimensions_and_the_values_of_its_map(name):
    ds = make(name)
    assert slices.with_all_dimensions(ds) is ds
    for selection in choices(ds, 12):
        expected = ds.isel({dim: stored_order(ds, dim, places) for dim, places in selection.items()})
        for slice_of_map in (ds.isel(selection), ds.isel(selection).transpose()):
            restored = slices.with_all_dimensions(slice_of_map)
            if isinstance(selection.get("point", selection.get("body")), int):  # its own numbers and the grid's agree
                restored, expected = restored.squeeze(), expected.squeeze()
            for variable in ds.data_vars:
                assert restored[variable].dims == expected[variable].dims
                np.testing.assert_array_equal(restored[variable].values, expected[variable].values)


@pytest.mark.slow
@pytest.mark.parametrize("name", MAPS)
def test_every_picture_of_a_random_slice_is_drawn_or_refused_in_words(name):
    for selection in choices(make(name), 4):
        slice_of_map = make(name).isel(selection)
        for picture in figures.pictures(slice_of_map):
            try:
                assert isinstance(plot.draw(slice_of_map, picture).figure, Figure)
            except RefusedError as refused:
                assert "nothing to show" in str(refused)  # noqa: PT017


def test_a_slice_by_label_is_drawn_as_its_place_in_the_map():
    ds = make("rigid_body")
    assert "1 point" in ds.isel(dict.fromkeys(ds.dims, 0)).polhode.summary()
    by_label = plot.stability(ds, axis=2, at={"omega0": 2.0, "I3": 1.0})
    for slice_of_map in (
        ds.sel(axis=2, omega0=2.0).sel(I3=1.0),
        ds.sel(axis=[2], omega0=[2.0], I3=[1.0]),
        ds.isel(axis=1).sel(omega0=2.0).isel(I3=[1]),
    ):
        for axes in (plot.stability(slice_of_map), slice_of_map.polhode.stability()):
            meshes = [[a.get_array() for a in ax.collections if a.get_array() is not None] for ax in (by_label, axes)]
            np.testing.assert_array_equal(meshes[0][0], meshes[1][0])
            assert [text.get_text() for text in by_label.figure.texts] == [
                text.get_text() for text in axes.figure.texts
            ]
    with pytest.raises(RefusedError, match="1 is not in this map; allowed: 2"):
        plot.stability(ds.sel(axis=2), axis=1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda ds: xr.Dataset({"t": ("x", [1.0])}), "ds: its attribute contract_version is missing; allowed: a"),
        (lambda ds: ds.growth_rate, "ds: is of type DataArray; allowed: a Dataset"),
        (lambda ds: ds.isel(axis=0, drop=True), "ds: the coordinate axis is missing; allowed: a slice that keeps"),
        (lambda ds: ds.isel(I1=[]), "ds: has no points along I1; allowed: a slice with one point"),
        (lambda ds: ds.assign_attrs(system="other"), "ds: its system 'other' is not available; allowed: "),
        (lambda ds: ds[[]], "ds: holds no variable; allowed: a Dataset"),
    ],
)
def test_what_is_no_map_is_refused_in_words(change, message):
    ds = change(make("rigid_body"))
    for call in (plot.stability, plot.theory_against_measured, lambda one: xr.Dataset.polhode(one).summary()):
        with pytest.raises(RefusedError) as error:
            call(ds)
        assert str(error.value).startswith(message)


@pytest.mark.parametrize("name", ["rigid_body", "pendulum"])
def test_pictures_of_a_file_that_slice_wrote(name, tmp_path):
    storage.write_map(make(name), tmp_path / "map.nc")
    ds = make(name)
    long = [dim for dim in ds["status"].dims if ds.sizes[dim] > 1]
    place = [text for dim in long[2:] for text in (f"--{dim}", str(ds[dim].values[0]))]
    assert main(["slice", str(tmp_path / "map.nc"), *place, "-o", str(tmp_path / "slice.nc")]) == 0
    with netCDF4.Dataset(tmp_path / "slice.nc") as file:
        assert len(file["status"].dimensions) == 2
    with sweeps.open_map(tmp_path / "slice.nc") as cut_ds:
        (picture,) = figures.draw_all(cut_ds, tmp_path / "figures", only=[next(iter(figures.pictures(ds)))])
    assert picture.stat().st_size > 10_000  # bytes of PNG
