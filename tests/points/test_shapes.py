import numpy as np
import pytest

from sweeps.points import catalogue
from sweeps.points.loading import read
from sweeps.schema.refusals import DefinitionError

SQUARE = {"I1_over_I3": {"start": 0.1, "stop": 0.9, "num": 5}, "room": {"start": 0.0, "stop": 1.0, "num": 3}}


def shaped(ratios=SQUARE, more=None, **others):
    return read({"axes": [2], "grid": {"ratios": ratios, "omega0": 1.0} | (more or {})} | others)


def points(sweep):
    found = sweep.grid.points(0, sweep.grid.size)
    return found["I1"], found["I2"], found["I3"]


def test_a_square_becomes_the_triangle_of_all_bodies():
    sweep = shaped(more={"I3": 2.0})
    assert sweep.grid.dims == ("point", "axis", "I3", "omega0", "epsilon", "phase")
    I1, I2, I3 = points(sweep)
    assert np.array_equal(I1.reshape(5, 3)[:, 0], 2 * np.linspace(0.1, 0.9, 5))
    flat, middle, round_ = I2.reshape(5, 3).T
    np.testing.assert_allclose(flat + I1[::3], I3[::3], rtol=1e-15)  # I1 + I2 = I3
    assert np.array_equal(round_, I3[::3])  # I2 = I3
    np.testing.assert_allclose(middle, (flat + round_) / 2, rtol=1e-15)


def test_every_point_is_a_body_and_any_part_is_that_part():
    grid = read(catalogue.FOLDER / "shapes.yaml").grid
    assert grid.shape[:2] == (1_000_000, 3)
    for start in (0, 1_500_000, grid.size - 999):
        part = grid.points(start, start + 999)
        second = [
            part["I2"] + part["I3"] - part["I1"],
            part["I1"] + part["I3"] - part["I2"],
            part["I1"] + part["I2"] - 1,
        ]
        assert min(moment.min() for moment in second) > 0
        assert max(part["I1"].max(), part["I2"].max()) < 1


def test_drawn_shapes_fill_the_triangle_evenly():
    ends = {"I1_over_I3": {"start": 1e-6, "stop": 1.0}, "room": {"start": 1e-6, "stop": 1.0}}
    sweep = shaped(ends, sample={"num": 4096, "seed": 2})
    x, y, _ = points(sweep)
    # moments of a triangle with corners (0, 1), (1, 0), (1, 1): its centroid, and variances of 1/18
    assert np.mean([x, y], axis=1) == pytest.approx([2 / 3, 2 / 3], abs=2e-3)
    assert np.var([x, y], axis=1) == pytest.approx([1 / 18, 1 / 18], rel=1e-2)
    assert np.mean(x > y) == pytest.approx(0.5, abs=1e-2)


def test_shapes_and_another_range_are_drawn_together():
    sweep = shaped(SQUARE | {"room": 0.5}, {"omega0": {"start": 1.0, "stop": 2.0}}, sample={"num": 64})
    I1, I2, _ = points(sweep)
    np.testing.assert_allclose(I2, 1 - 0.5 * I1, rtol=1e-15)
    assert np.unique(sweep.grid.points(0, 64)["omega0"]).size == 64


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (
            {"ratios": {"I1_over_I3": 1.2, "room": 0.5}},
            "grid.ratios.I1_over_I3: 1.2 is out of range; allowed: a number",
        ),
        ({"ratios": {"I1_over_I3": 0.2, "room": -1.0}}, "grid.ratios.room: -1.0 is out of range"),
        ({"ratios": {"room": 0.5}}, "grid.ratios.I1_over_I3: (nothing) is missing"),
        ({"ratios": 5}, "grid.ratios: 5 is not a mapping; allowed: shapes of bodies"),
        ({"ratios": {"I1_over_I3": 1.0, "room": 0.0}}, "grid.ratios.room: 0.0 reaches 0; allowed: room above 0"),
        ({"more": {"I1": 1.0}}, "is given beside I1; allowed: ratios (and I3, a number)"),
        ({"more": {"I3": [1.0, 2.0]}}, "grid.I3: [1.0, 2.0] is no number"),
        ({"bodies": [{"name": "A", "I1": 1.0, "I2": 1.0, "I3": 1.0}]}, "is given beside bodies"),
        ({"ratios": SQUARE | {"room": [0.1, 0.2]}, "sample": {"num": 3}}, "grid.ratios.room: [0.1, 0.2] is a list"),
    ],
)
def test_what_is_no_shape_is_refused(values, words):
    with pytest.raises(DefinitionError) as refused:
        shaped(**values)
    assert words in str(refused.value)
