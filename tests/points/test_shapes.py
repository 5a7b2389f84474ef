import re

import numpy as np
import pytest

from sweeps.points import catalogue
from sweeps.points.loading import read_sweep
from sweeps.schema.refusals import DefinitionError

SQUARE = {"I1_over_I3": {"start": 0.1, "stop": 0.9, "num": 5}, "thickness": {"start": 0.0, "stop": 1.0, "num": 3}}


def shape_sweep(ratios=SQUARE, more=None, **others):
    return read_sweep({"axes": [2], "grid": {"ratios": ratios, "omega0": 1.0} | (more or {})} | others)


def points(sweep):
    columns = sweep.grid.points(0, sweep.grid.size)
    return columns["I1"], columns["I2"], columns["I3"]


def test_a_square_becomes_the_triangle_of_all_bodies():
    grid = shape_sweep(more={"I3": 2.0}).grid
    assert grid.dims == ("axis", "I1_over_I3", "thickness", "I3", "omega0", "epsilon", "phase")
    assert grid.shape == (1, 5, 3, 1, 1, 1, 1)
    (over_I1, I1), (over_I2, I2) = grid.auxiliary["I1"], grid.auxiliary["I2"]
    assert (over_I1, over_I2) == (("I1_over_I3", "I3"), ("I1_over_I3", "thickness", "I3"))
    I1, I2 = np.asarray(I1), np.asarray(I2)
    assert np.array_equal(I1[:, 0], 2 * np.linspace(0.1, 0.9, 5))
    flat, middle, round_ = I2[..., 0].T
    np.testing.assert_allclose(flat + I1[:, 0], 2.0, rtol=1e-15)  # I1 + I2 = I3
    assert np.array_equal(round_, np.full(5, 2.0))  # I2 = I3
    np.testing.assert_allclose(middle, (flat + round_) / 2, rtol=1e-15)


def test_moments_along_dimensions_are_those_of_the_points():
    grid = shape_sweep(more={"I3": [0.5, 2.0, 3.0], "omega0": [1.0, -2.0]}).grid
    columns = grid.points(0, grid.size)
    for name, (dims, values) in grid.auxiliary.items():
        shape = [n if dim in dims else 1 for dim, n in zip(grid.dims, grid.shape, strict=True)]
        spread = np.broadcast_to(np.asarray(values).reshape(shape), grid.shape)
        assert np.array_equal(spread.reshape(-1), columns[name])
        selection = tuple(slice(1, n) for n in values.shape)
        assert np.array_equal(values[selection], np.asarray(values)[selection])
    second = [sum(columns[n] for n in ("I1", "I2", "I3")) / 2 - columns[n] for n in ("I1", "I2", "I3")]
    assert min(moment.min() for moment in second) > -1e-15


def test_every_point_is_a_body_and_any_part_is_that_part():
    grid = read_sweep(catalogue.FOLDER / "shapes.yaml").grid
    assert grid.shape[:3] == (3, 1000, 1000)
    for start in (0, 1_500_000, grid.size - 999):
        columns = grid.points(start, start + 999)
        second = [
            columns["I2"] + columns["I3"] - columns["I1"],
            columns["I1"] + columns["I3"] - columns["I2"],
            columns["I1"] + columns["I2"] - 1,
        ]
        assert min(moment.min() for moment in second) > 0
        assert max(columns["I1"].max(), columns["I2"].max()) < 1
        thickness = (np.arange(start, start + 999) % 1000 + 0.5) / 1000
        np.testing.assert_allclose(columns["I2"], 1 - columns["I1"] * (1 - thickness), rtol=0, atol=1e-14)


def test_drawn_shapes_fill_the_triangle_evenly():
    ends = {"I1_over_I3": {"start": 1e-6, "stop": 1.0}, "thickness": {"start": 1e-6, "stop": 1.0}}
    sweep = shape_sweep(ends, sample={"num": 4096, "seed": 2})
    x, y, _ = points(sweep)
    # moments of a triangle with corners (0, 1), (1, 0), (1, 1): its centroid, and variances of 1/18
    assert np.mean([x, y], axis=1) == pytest.approx([2 / 3, 2 / 3], abs=2e-3)
    assert np.var([x, y], axis=1) == pytest.approx([1 / 18, 1 / 18], rel=1e-2)
    assert np.mean(x > y) == pytest.approx(0.5, abs=1e-2)


def test_shapes_are_drawn_with_sizes_and_spin_rates():
    ends = {"start": 1.0, "stop": 9.0}
    sweep = shape_sweep(SQUARE | {"thickness": 0.5}, {"I3": ends, "omega0": ends}, sample={"num": 64})
    I1, I2, I3 = points(sweep)
    np.testing.assert_allclose(I2, I3 - 0.5 * I1, rtol=1e-15)
    assert (I1 / I3 <= 0.9).all()
    assert np.unique(I3).size == np.unique(sweep.grid.points(0, 64)["omega0"]).size == 64


def ratios_of(I1_over_I3, thickness):
    return {"ratios": {"I1_over_I3": I1_over_I3, "thickness": thickness}}


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (ratios_of(1.2, 0.5), "grid.ratios.I1_over_I3: 1.2 is out of range; allowed: a number"),
        ({"ratios": {"thickness": 0.5}}, "grid.ratios.I1_over_I3: is missing"),
        ({"ratios": 5}, "grid.ratios: 5 is not a mapping; allowed: shapes of physically possible bodies"),
        (ratios_of(1.0, 0.0), "grid.ratios.thickness: 0.0 reaches 0; allowed: thickness above 0"),
        ({"more": {"I1": 1.0}}, "is given beside I1; allowed: ratios (and I3), or moments"),
        ({"more": {"I3": 10**400}}, "grid.I3: a whole number of 1329 bits is not finite as a double"),
        (ratios_of(0.5, [0.1, 0.2]) | {"sample": {"num": 3}}, "grid.ratios.thickness: [0.1, 0.2] is a list"),
    ],
)
def test_what_is_no_shape_is_refused(values, words):
    with pytest.raises(DefinitionError, match=re.escape(words)):
        shape_sweep(**values)
