import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import body_sweeps, grid_sweeps, sweeps

from sweeps.points.loading import read_sweep

PARAMETERS = ["I1", "I2", "I3", "omega0", "epsilon", "phase"]
HUGE = {name: {"start": 1.0, "stop": 2.0, "num": 10**13} for name in ("I1", "I2", "I3", "omega0")}
quick = settings(max_examples=25, deadline=None, derandomize=True)


def grid_of(lengths, **more):
    """Return a grid with these lengths of its six parameters."""
    starts = zip(PARAMETERS, lengths, strict=True)
    entries = {name: list(np.linspace(0.1, 0.9, length)) for name, length in starts}
    return read_sweep({"grid": entries} | more).grid


def broadcast_points(grid):
    """Every coordinate at every point, by NumPy's own broadcasting."""
    mesh = np.meshgrid(*(grid.coordinates[dim] for dim in grid.dims), indexing="ij")
    columns = {dim: values.ravel() for dim, values in zip(grid.dims, mesh, strict=True)}
    if "body" in columns:
        names = list(grid.coordinates["body"])
        body = np.array([names.index(name) for name in columns["body"]])
        for name in set(PARAMETERS) - set(columns):
            columns[name] = grid.auxiliary[name][1][body]
    return columns


@given(sweeps, st.data())
@quick
def test_points_are_those_of_the_full_grid(mapping, data):
    grid = read_sweep(mapping).grid
    start = data.draw(st.integers(0, grid.size))
    stop = data.draw(st.integers(start, grid.size))
    expected = broadcast_points(grid)
    points = grid.points(start, stop)
    assert list(points) == ["axis", *PARAMETERS]
    for name, column in points.items():
        assert column.dtype == (np.int64 if name == "axis" else np.float64)
        np.testing.assert_array_equal(column, expected[name][start:stop], err_msg=name)


@given(grid_sweeps())
@quick
def test_dimensions_of_a_grid(mapping):
    grid = read_sweep(mapping).grid
    assert grid.dims == ("axis", *PARAMETERS)
    assert grid.shape == tuple(len(grid.coordinates[dim]) for dim in grid.dims)
    assert grid.size == np.prod(grid.shape)
    assert grid.auxiliary == {}
    assert grid.coordinates["axis"].dtype == np.int8
    assert list(grid.coordinates["axis"]) == sorted(mapping["axes"])
    for name in PARAMETERS:  # CF: coordinate variables are strictly monotonic
        steps = np.diff(grid.coordinates[name])
        assert np.all(steps > 0) or np.all(steps < 0)


@given(body_sweeps())
@quick
def test_dimensions_and_coordinates_of_bodies(mapping):
    grid = read_sweep(mapping).grid
    bodies = mapping["bodies"]
    per_body = [name for name in PARAMETERS[3:] if any(name in body for body in bodies)]
    assert grid.dims == ("body", "axis", *(name for name in PARAMETERS[3:] if name not in per_body))
    assert list(grid.coordinates["body"]) == [body["name"] for body in bodies]
    assert set(grid.auxiliary) == {"I1", "I2", "I3", "moments_are_ratios", *per_body}
    for name in PARAMETERS[:3]:
        expected = [body.get("ratios", body)[name] for body in bodies]
        np.testing.assert_array_equal(grid.auxiliary[name][1], expected)
    for name in per_body:
        expected = [body.get(name, mapping["grid"].get(name)) for body in bodies]
        np.testing.assert_array_equal(grid.auxiliary[name][1], expected)
    assert list(grid.auxiliary["moments_are_ratios"][1]) == ["ratios" in body for body in bodies]


@pytest.mark.parametrize("start", [0, 12345, 10**40, 3 * 10**52 - 100])
def test_points_of_a_grid_beyond_64_bits(start):
    grid = read_sweep({"grid": HUGE}).grid
    assert grid.size == 3 * 10**52
    points = grid.points(start, start + 100)
    for offset in (0, 1, 57, 99):
        remainder, index = start + offset, {}
        for dim, length in zip(reversed(grid.dims), reversed(grid.shape), strict=True):
            remainder, index[dim] = divmod(remainder, length)
        assert points["axis"][offset] == index["axis"] + 1
        for name in HUGE:
            # 1 + i/(n − 1), to the two roundings of a double
            assert points[name][offset] == pytest.approx(1 + index[name] / (10**13 - 1), rel=1e-15)


@pytest.mark.parametrize(("start", "stop"), [(-1, 2), (2, 1), (0, 10**9)])
def test_points_outside_the_grid_and_more_shards_than_points_are_refused(start, stop):
    grid = grid_of([2] * 6)
    for count in (0, -1, 193):
        with pytest.raises(ValueError, match="allowed: 1 to 192"):
            grid.shard_bounds(count)
    with pytest.raises(ValueError, match="allowed: 0 ≤ start ≤ stop ≤ 192"):
        grid.points(start, stop)


@given(st.lists(st.integers(1, 4), min_size=6, max_size=6), st.data())
@quick
def test_shards_cover_each_point_once_and_evenly(lengths, data):
    grid = grid_of(lengths)
    count = data.draw(st.integers(1, grid.size))
    bounds = grid.shard_bounds(count)
    numbers = np.concatenate([np.arange(*bound) for bound in bounds])
    np.testing.assert_array_equal(numbers, np.arange(grid.size))
    sizes = [stop - start for start, stop in bounds]
    assert len(sizes) == count
    assert max(sizes) - min(sizes) <= 1


@pytest.mark.parametrize(
    ("nums", "rotations", "shards", "expected"),
    [
        ((10, 10, 10), 4, "auto", 1),
        ((500, 500, 400), 4, "auto", 10),  # 1e8 points of 64 samples: 100 s
        ((500, 500, 400), 40, "auto", 100),
        ((10, 10, 10), 4, 7, 7),
        ((1, 1, 2), 4, 7, 2),
        ((1, 1, 2), 60_000_000, "auto", 2),  # never more files than points
        ((10**9, 10**9, 10**9), 4, "auto", 10_000),
    ],
)
def test_a_shard_is_worth_ten_seconds(nums, rotations, shards, expected):
    entries = [{"start": 1.0, "stop": 2.0, "num": num} if num > 1 else 1.0 for num in nums]
    mapping = {"axes": [1], "grid": dict(zip(("I1", "I2", "I3"), entries, strict=True)) | {"omega0": 1.0}}
    sweep = read_sweep(mapping | {"integration": {"rotations": rotations}, "shards": shards})
    assert sweep.shards == expected
