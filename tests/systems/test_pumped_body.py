"""Pumped bodies from a definition to a picture: refusals, impossible bodies, Mathieu's curves, verification."""

from itertools import islice

import numpy as np
import pytest

import sweeps
from kernels.flow.codes import REGIMES
from sweeps.maps import verify
from sweeps.points import estimate as counted
from sweeps.points.loading import read_sweep
from sweeps.systems import resolve
from sweeps.systems.pumped_body.presentation import PumpedBodyPresentation, figure_kapitza_racket
from sweeps.systems.pumped_body.system import least_margin

GRID = {"I1": 1.0, "I2": 1.9, "I3": 2.0, "frequency": 0.3, "omega0": 0.5}
RACKET = {"system": "pumped_body", "modulation": "inverse", "axes": [3]}


@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("depth", [0.3, 0.99])
def test_the_triangle_inequality_is_held_against_the_whole_period(depth, inverse):
    """Against 4,000 phases of 3,000 bodies: some have two minima that differ by less than neighbouring phases."""
    rng, u = np.random.default_rng(8), np.linspace(0.0, 2.0 * np.pi, 4_001)
    second = rng.uniform(0.0, 1.0, (3, 3_000))
    points = dict(zip(("I1", "I2", "I3"), second.sum(axis=0) - second, strict=True))
    points |= {f"depth{i}": rng.uniform(-depth, depth, 3_000) for i in (1, 2, 3)}
    points |= {f"lag{i}": rng.uniform(-9.0, 9.0, 3_000) for i in (1, 2, 3)}
    margin = np.full(3_000, np.inf)
    for phase in u:
        factors = [1.0 + points[f"depth{i}"] * np.cos(phase + points[f"lag{i}"]) for i in (1, 2, 3)]
        moments = np.array([points[f"I{i}"] * (1 / f if inverse else f) for i, f in enumerate(factors, 1)])
        margin = np.minimum(margin, 1.0 - 2.0 * moments.max(axis=0) / moments.sum(axis=0))
    least = least_margin(points, inverse)
    difference = least - margin
    assert difference.max() < 1e-13  # roundings, up to a hundredfold by 1 - 0.99
    assert difference.min() > -1e-5  # the curvature, up to some ten, over half the distance of two phases squared
    alike = {name: np.full(3, values[-1]) for name, values in points.items()}
    np.testing.assert_array_equal(least_margin(alike, inverse), least[-1])


def test_impossible_points_are_counted():
    sweep = read_sweep({"system": "pumped_body", "axes": [3], "grid": GRID | {"depth3": [0.0, 0.3, 0.6]}})
    assert counted.count_impossible(sweep) == (1, True)  # 3.2 > 2.9


SIDES = {"depth2": {"start": 0.0, "stop": 0.3, "num": 9}}
SIDES |= {"frequency": {"start": 0.05, "stop": 0.5, "num": 12, "spacing": "log"}}


@pytest.mark.slow
def test_the_map_is_verified_and_drawn(tmp_path):
    """Sides are logarithmic where values spread by ratio."""
    ds = sweeps.survey(RACKET | {"grid": GRID | SIDES})
    assert (ds["regime"] == REGIMES.index("stable") - 1).any()
    ds.to_netcdf(tmp_path / "map.nc")
    checks = verify.verify(tmp_path / "map.nc", points=4)
    assert {"SciPy DOP853"} <= {check.name for check in checks}
    assert not [check for check in checks if check.findings or check.skip_reason]
    presentation = PumpedBodyPresentation(resolve("pumped_body"))
    figure = presentation.figures(ds)["tongues_axis_3"]()
    gids = {artist.get_gid() for ax in figure.axes for artist in (*ax.lines, *ax.collections)}
    assert gids >= {"law", "measured"}
    assert (figure.axes[0].get_xscale(), figure.axes[0].get_yscale()) == ("log", "linear")
    calm = ds.assign(regime=0 * ds["regime"], growth_per_period=0.0 * ds["growth_per_period"])
    assert presentation.figures(calm)["tongues_axis_3"]() is None  # a map of one colour has no picture


def test_the_held_racket_keeps_its_axis_and_the_other_flips():
    """Both motions of the film: attitudes stay orthogonal, and the body at rest keeps its energy."""
    ds = sweeps.survey(RACKET | {"grid": GRID | SIDES | {"I2": [1.9, 2.0182]}})
    point = figure_kapitza_racket.stabilised_point(ds)
    assert point["I2"] == 2.0182  # the only intermediate axis of the two
    times = np.linspace(0.0, 150.0, 2_000)
    for depth, flips in ((point["depth2"], False), (0.0, True)):
        moments, L, attitudes = figure_kapitza_racket.integrate(point | {"depth2": depth}, True, times)
        assert (L[:, 2] < 0.0).any() == flips
        assert (
            np.abs(attitudes @ attitudes.swapaxes(1, 2) - np.eye(3)).max() < 1e-7
        )  # DOP853 at 1e-9, some hundred steps
        energy = (L**2 / moments).sum(axis=1)
        assert (np.ptp(energy) < 1e-8) == flips
    first, *_, last = islice(PumpedBodyPresentation(resolve("pumped_body")).animations(ds)["held"](), 8)
    assert np.abs(last[::7, ::7] - first[::7, ::7].astype(float)).max() > 100  # it moves
    steady = ds.isel(I2=[0])
    assert not list(PumpedBodyPresentation(resolve("pumped_body")).animations(steady)["held"]())
