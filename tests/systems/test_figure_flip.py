"""The animation of the flip: whose it is, how the body turns, and what the file holds."""

from itertools import pairwise

import numpy as np
import pytest
from PIL import Image, ImageSequence
from scipy.spatial.transform import Rotation

import sweeps
from kernels import exact
from sweeps.systems.rigid_body import figure_flip
from sweeps.views import figures, report_columns

GRID = {"grid": {"I1": {"start": 0.4, "stop": 1.6, "num": 5}, "I2": [0.7, 1.1, 2.5], "I3": [1.0, 1.3], "omega0": -5.0}}


@pytest.fixture(scope="module")
def ds():
    return sweeps.survey(GRID)


def test_it_is_the_most_unstable_body_that_can_exist(ds, monkeypatch):
    monkeypatch.setattr(report_columns, "BLOCK_POINTS", 7)
    point = figure_flip.most_unstable(ds)
    rates = np.where(ds.triangle_margin.values >= 0, ds.growth_rate.values, -1.0)
    row = ds.sel({name: point[name] for name in ds.dims})
    assert float(row.growth_rate) == rates.max()
    assert ds.growth_rate.values.max() > rates.max()  # else the triangle would decide nothing


def test_a_map_where_nothing_flips_has_no_animation():
    assert (
        figure_flip.frames(sweeps.survey({"axes": [3], "grid": {"I1": 1.0, "I2": 2.0, "I3": 2.5, "omega0": 1.0}})) == []
    )


def test_the_box_has_the_moments_of_the_body():
    moments = np.array([1.0, 2.0, 2.6])
    a, b, c = figure_flip.box(moments)
    ratios = np.array([b * b + c * c, c * c + a * a, a * a + b * b])  # a uniform box's moments over M/3
    np.testing.assert_allclose(ratios / ratios[0], moments / moments[0], rtol=1e-14)  # rounding


def test_the_body_turns_as_its_angular_velocity_says():
    """Against SciPy's rotations, composed at ten times as many midpoints; and L stays upright."""
    moments, omega = np.array([1.0, 2.0, 2.6]), np.array([0.3, 5.0, -0.2])
    times = np.linspace(0.0, 3.0, 4)
    found = figure_flip.attitudes(moments, omega, times)
    h = 3.0 / 6000
    turn = Rotation.from_matrix(found[0])
    for vector in Rotation.from_rotvec(exact.rotation(moments, omega, (np.arange(6000) + 0.5) * h) * h):
        turn = turn * vector
    assert (Rotation.from_matrix(found[-1]).inv() * turn).magnitude() < 1e-3  # (|ω| h)² of the coarser, summed
    for matrix, spin in zip(found, exact.rotation(moments, omega, times), strict=True):
        L = matrix @ (moments * spin)
        np.testing.assert_allclose(L / np.linalg.norm(L), [0, 0, 1], atol=1e-4)  # likewise


def test_the_file_is_an_animation_that_moves(ds, tmp_path, monkeypatch):
    monkeypatch.setattr(figure_flip, "FRAMES", 6)
    monkeypatch.setattr(figures, "pictures", lambda ds: {})
    assert list(figures.draw_all(ds, tmp_path)) == [tmp_path / "flip.gif"]
    with Image.open(tmp_path / "flip.gif") as animation:
        assert animation.info["loop"] == 0
        pictures = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(animation)]
    assert len(pictures) == 6
    for one, other in pairwise(pictures):
        assert (one != other).any()
