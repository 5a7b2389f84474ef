"""A map before it is measured, beside the map that a sweep then has."""

import numpy as np
import pytest

from sweeps.maps import admission
from sweeps.maps.foreseen import UnmeasuredError, foreseen
from sweeps.points.loading import read
from sweeps.shards import merging, shard
from sweeps.views import figures, helper

SHAPES = {"ratios": {"I1_over_I3": [0.3, 0.6, 0.9], "room": [0.2, 0.5, 0.8]}, "omega0": [1.0, 10.0]}


@pytest.fixture(scope="module")
def sweep():
    return read({"grid": SHAPES, "title": "Costs $5"})


@pytest.fixture(scope="module")
def path(sweep, tmp_path_factory):
    folder = tmp_path_factory.mktemp("foreseen")
    shard.write_shard(sweep, 1, 1, folder / "1-of-1.nc")
    merging.merge(sweep, [folder / "1-of-1.nc"], folder / "map.nc")
    return folder / "map.nc"


def test_what_is_foreseen_is_what_the_map_then_says(sweep, path):
    early = foreseen(sweep)
    with admission.opened(path) as ds:
        assert (early.sizes, set(early.coords)) == (ds.sizes, set(ds.coords))
        assert set(early.data_vars) == set(ds.data_vars)
        for name, coordinate in ds.coords.items():
            assert early[name].dims == coordinate.dims
            assert early[name].dtype == coordinate.dtype
            np.testing.assert_array_equal(early[name].values, coordinate.values)
        for name, variable in ds.data_vars.items():
            assert (early[name].dims, early[name].dtype) == (variable.dims, variable.dtype)
        assert early.attrs == {name: text for name, text in ds.attrs.items() if name in early.attrs}


def test_it_gives_no_measured_value(sweep):
    with pytest.raises(UnmeasuredError):
        _ = foreseen(sweep)["omega_squared"].values


def test_pictures_drawn_early_are_those_of_the_map_bit_for_bit(sweep, path, tmp_path):
    folders = tmp_path / "early" / helper.EARLY, tmp_path / "late"
    folders[0].parent.mkdir()
    helper._foresee(sweep, folders[0])
    folders[1].mkdir(parents=True)
    assert figures.take(folders[0], folders[1]) == ["polhodes.png"]  # nothing on this grid is a tennis racket
    early = (folders[1] / "polhodes.png").read_bytes()
    with figures.opened(path) as ds:
        assert "polhodes.png" not in figures.draw_some(ds, ["polhodes"], folders[1])  # it is there
        (folders[1].parent / "taken-polhodes").unlink()
        figures.draw_some(ds, ["polhodes"], folders[1])
    assert (folders[1] / "polhodes.png").read_bytes() == early
