"""The animations of small oscillations: the motion is that of the full equations, and the moving parts are drawn."""

from itertools import pairwise

import numpy as np
import pytest
import repeated

import sweeps
from sweeps import systems
from sweeps.schema.refusals import MapError
from sweeps.systems.oscillator.presentation import figure_motion
from sweeps.systems.oscillator.system import ANIMATED
from sweeps.systems.presentation.moving import equations

GRIDS = {
    "pendulum": {"length": [1.0, 2.0], "gravity": 9.80665},
    "bead_on_hoop": {"radius": [0.5, 1.0], "spin_rate": [1.0, 2.0, 4.0, 5.0]},
    "double_pendulum": {"mass2": [0.5, 1.0], "length2": 1.0},
}


@pytest.fixture(scope="module")
def maps():
    cache = {}

    def of(name):
        return cache.setdefault(name, sweeps.survey({"system": name, "grid": GRIDS[name]}))

    return of


def test_those_that_are_animated_are_those_that_are_shown():
    assert set(ANIMATED) == set(GRIDS)
    assert systems.make_presentation(systems.resolve("double_well")).animations(None) == {}


@pytest.mark.parametrize("name", repeated.but(("pendulum",), ("pendulum", "bead_on_hoop", "double_pendulum")))
def test_it_moves(maps, monkeypatch, name):
    monkeypatch.setattr(figure_motion, "FRAMES", 4)
    pictures = systems.make_presentation(systems.resolve(name)).animations(maps(name))["motion"]()
    pictures = list(pictures)
    assert len(pictures) == 4
    assert all(picture.shape == pictures[0].shape for picture in pictures)
    assert all((before != after).any() for before, after in pairwise(pictures))
    assert pictures[0][0, 0].tolist() == [255] * 4


@pytest.mark.slow
def test_it_begins_beside_what_the_map_found_stable_and_unstable(maps):
    ds, model = maps("bead_on_hoop"), systems.resolve("bead_on_hoop").mechanism
    for spin, names in ((1.0, ("bottom", "top")), (5.0, ("right", "bottom"))):
        point = ds.sel(radius=1.0, spin_rate=spin).isel(mass=0, gravity=0, epsilon=0, phase=0)
        runs = [figure_motion.motion_near(point, regime, model) for regime in ("stable", "unstable")]
        assert tuple(run.name for run in runs) == names
    assert runs[0].place == pytest.approx(np.arccos(9.80665 / 25), abs=1e-12)


def test_nothing_is_drawn_where_no_equilibrium_tells(maps):
    ds, marginal = maps("pendulum"), 2
    ds = ds.assign(regime=0 * ds["regime"] + marginal)
    animation = systems.make_presentation(systems.resolve("pendulum")).animations(ds)["motion"]
    assert not list(animation())


def test_a_map_that_names_another_system_has_no_animation_of_it(maps):
    animation = systems.make_presentation(systems.resolve("double_pendulum")).animations(maps("pendulum"))["motion"]
    with pytest.raises(MapError, match="length1: is missing"):
        list(animation())


@pytest.mark.parametrize("name", GRIDS)
def test_the_picture_is_that_of_the_description(name):
    """Lengths of rods and the hoop's radius, and masses at the positions of their coordinates."""
    model = systems.resolve(name).mechanism
    point = {p.name: p.default for p in model.system.parameters.values()}
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (5, model.equations.m))
    values = point | {str(x): y for x, y in zip(model.equations.q, q.T, strict=True)}
    values |= {str(v): 0.0 for v in model.equations.v} | {"time": 0.0}
    shapes = list(equations.picture_points(model.equations, values))
    masses = [positions[:, 0] for kind, positions in shapes if kind == "mass"]
    end = np.zeros((5, 2))
    for mass, angle in zip(masses, q.T, strict=True):
        end = end + np.column_stack([np.sin(angle), -np.cos(angle)])  # all lengths are 1 m
        np.testing.assert_allclose(mass, end, atol=1e-15)  # a sum of two numbers near 1
    if name == "pendulum":
        (rod,) = (positions for kind, positions in shapes if kind == "line")
        np.testing.assert_array_equal(rod[:, -1], masses[0])
