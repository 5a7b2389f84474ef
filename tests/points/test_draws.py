import re

import numpy as np
import pytest
import scipy

from sweeps.points.loading import read_sweep
from sweeps.points.scattered import UnitCubeDraw
from sweeps.schema.definition import METHODS, Sample
from sweeps.schema.refusals import DefinitionError

GRID = {"I1": {"start": 0.5, "stop": 1.5}, "I2": {"start": 1.5, "stop": 0.5}, "I3": 1.0}
SPUN = GRID | {"omega0": {"start": 0.1, "stop": 100.0, "spacing": "log"}}
NUM = 2**16 + 77


def sample_sweep(grid=SPUN, **sample):
    return read_sweep({"axes": [2], "sample": {"num": 1000, "seed": 3} | sample, "grid": grid})


def shares_of(method, num, dimensions=3, seed=5):
    return UnitCubeDraw(Sample(method=method, num=num, seed=seed), dimensions).shares(0, num)


def test_sobol_points_are_scipys_and_random_ones_numpys():
    engine = scipy.stats.qmc.Sobol(3, rng=5)
    assert np.array_equal(shares_of("sobol", NUM), np.concatenate([engine.random(2**16), engine.random(77)]))
    assert np.array_equal(shares_of("random", NUM), np.random.default_rng(5).random((NUM, 3)))


@pytest.mark.parametrize("num", [1, 2, 3, 1000, 4097])
def test_a_latin_hypercube_has_one_point_in_each_slice(num):
    shares = shares_of("latin", num)
    for column in shares.T:
        assert np.array_equal(np.sort(np.floor(column * num)), np.arange(num))
    assert shares.min() >= 0
    assert shares.max() < 1


def test_a_latin_hypercube_fills_the_cube_as_scipys_does():
    shares = shares_of("latin", 1000)
    theirs = [
        scipy.stats.qmc.discrepancy(scipy.stats.qmc.LatinHypercube(3, rng=seed).random(1000)) for seed in range(5)
    ]
    assert scipy.stats.qmc.discrepancy(shares) < 2 * max(theirs)
    # correlations of independent columns have a standard deviation of 1/sqrt(1000)
    assert np.abs(np.corrcoef(shares.T) - np.eye(3)).max() < 5 / np.sqrt(1000)


@pytest.mark.parametrize("method", METHODS)
def test_a_part_is_that_part_of_the_whole(method):
    all_shares = shares_of(method, NUM, 2)
    for start, stop in ((0, 0), (0, 1), (17, 18), (2**16 - 3, 2**16 + 5), (NUM - 1, NUM)):
        second_draw = UnitCubeDraw(Sample(method=method, num=NUM, seed=5), 2)
        assert np.array_equal(second_draw.shares(start, stop), all_shares[start:stop])
    assert not np.array_equal(shares_of(method, NUM, 2, 6)[:9], all_shares[:9])


def test_points_are_those_of_scipy_in_the_order_of_the_keys():
    points = sample_sweep(num=256).grid.points(0, 256)
    shares = scipy.stats.qmc.Sobol(3, rng=3).random(256)
    assert np.array_equal(points["I1"], 0.5 + shares[:, 0])
    assert np.array_equal(points["I2"], 1.5 - shares[:, 1])
    np.testing.assert_allclose(points["omega0"], 0.1 * 1000.0 ** shares[:, 2], rtol=1e-14)  # omega0 is log-uniform.


def test_a_range_through_zero_has_no_zero():
    sweep = sample_sweep({"I1": 1.0, "I2": 1.5, "I3": 2.0, "omega0": {"start": -1.0, "stop": 1.0}}, num=64)
    values = sweep.definition.sampled_ranges["omega0"].at_shares(np.array([0.0, 0.5, 1.0]))
    assert (values == [-1.0, 2.0**-31, 1.0]).all()


def test_a_part_of_a_large_sample_is_made_at_once():
    grid = sample_sweep(method="latin", num=10**12).grid
    assert grid.points(10**12 - 2, 10**12)["I1"].shape == (2,)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"sample": {"num": 0}}, "sample.num: 0 is out of range"),
        ({"sample": 100}, "sample: 100 is not a mapping; allowed: points drawn over the grid's ranges"),
        ({"sample": {"num": 9, "method": "sobel"}}, "sample.method: 'sobel' is not available (did you mean sobol?)"),
        ({"sample": {"num": 9, "sead": 1}}, "sample.sead: is an unknown key (did you mean seed?)"),
        (
            {"sample": {"num": 2**31}},
            "requests more points than exist; allowed: at most 1,073,741,824 points with sobol",
        ),
        ({"grid": {"I1": 1.0, "I2": 2.0, "I3": 2.5, "omega0": 1.0}}, "has no range to sample; allowed: a range"),
        ({"bodies": [{"name": "A", "ratios": {"I1": 1.0, "I2": 1.0, "I3": 1.0}}]}, "is given beside bodies"),
    ],
)
def test_what_cannot_be_drawn_is_refused(values, words):
    grid = {"omega0": {"start": 1.0, "stop": 2.0}} if "bodies" in values else SPUN
    with pytest.raises(DefinitionError, match=re.escape(words)):
        read_sweep({"sample": {"num": 16}, "grid": grid} | values)
