import numpy as np
import pytest
from naive import bodies
from numba import config

from kernels.events import flips
from kernels.free import rigid_body
from kernels.near_axis import survey


def columns(points, tolerance=1e-10):
    """Columns of flips for points given as a mapping, with whether the search was given up."""
    n = np.broadcast(*points.values()).size
    out, is_unfinished = np.empty((len(flips.MEASURED), n)), np.zeros(n, dtype=bool)
    flips.fill_columns(rigid_body.points_of(points), np.arange(n), tolerance, out, is_unfinished)
    return dict(zip(flips.MEASURED, out, strict=True)) | {"given_up": is_unfinished}


NAMES = ("I1", "I2", "I3", "axis", "omega0", "epsilon", "phase")


@pytest.mark.compiled
@pytest.mark.parametrize("epsilon", [1e-12, 1e-8, 1e-6, 1e-4, 1e-2, 0.1, 0.3, 0.9])
def test_measured_flips_and_tilts_are_the_exact_ones(epsilon):
    points = bodies(3000, 1, epsilon=epsilon)
    flip_columns = columns(points)
    sure = ~flip_columns["given_up"]
    assert sure.mean() > 0.99
    has_flip = np.isfinite(flip_columns["flip_period"])
    np.testing.assert_array_equal(has_flip[sure], np.isfinite(flip_columns["flip_period_exact"])[sure])
    assert 0.2 < has_flip.mean() < 0.8
    # the bar is 1e-9; the search has the tolerance 1e-10
    np.testing.assert_allclose(flip_columns["flip_period"][sure], flip_columns["flip_period_exact"][sure], rtol=1e-10)
    np.testing.assert_allclose(flip_columns["max_tilt"][sure], flip_columns["max_tilt_exact"][sure], rtol=1e-10)


@pytest.mark.compiled
def test_units_and_sense():
    points = bodies(200, 2, epsilon=1e-3)
    flip_columns = columns(points)
    for factor in (1e-9, 1e6):
        faster_spin = columns(points | {"omega0": points["omega0"] * factor})
        np.testing.assert_allclose(faster_spin["flip_period"] * factor, flip_columns["flip_period"], rtol=1e-12)
        np.testing.assert_allclose(faster_spin["max_tilt"], flip_columns["max_tilt"], rtol=1e-12)
    back = columns(points | {"omega0": -points["omega0"]})
    # time backwards: the interval between the two flips is the same one, found from its later end
    reversed_spin = columns(points | {"omega0": -points["omega0"], "phase": points["phase"] + np.pi})
    np.testing.assert_allclose(reversed_spin["flip_period"], flip_columns["flip_period"], rtol=1e-10)
    np.testing.assert_allclose(back["flip_period"], back["flip_period_exact"], rtol=1e-10)


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_flips_and_tilts_from_any_direction_are_the_exact_ones(axis):
    # on a principal plane a transverse component is 0 (or a rounding of pi) at the start: an event not to be missed
    phase = np.array([0.0, np.pi / 2, np.pi, 1.5 * np.pi, -0.0, 0.6, 2.0, 3.0, 5.0])
    flip_columns = columns(dict(zip(NAMES, (1.0, 2.0, 2.7, axis, 1.5, 1e-4, phase), strict=True)))
    assert not flip_columns["given_up"].any()
    for name in ("flip_period", "max_tilt"):
        np.testing.assert_allclose(flip_columns[name], flip_columns[f"{name}_exact"], rtol=1e-10)


def test_what_stands_still_and_what_only_turns():
    nudges = np.array([1e-3, 1e-2, 0.1])
    spheres = columns(dict(zip(NAMES, (2.0, 2.0, 2.0, 1, 1.0, nudges, 0.6), strict=True)))
    assert np.isnan(spheres["flip_period"]).all()
    np.testing.assert_allclose(spheres["max_tilt"], np.arctan(nudges), rtol=1e-14)
    assert not spheres["given_up"].any()
    top = columns(dict(zip(NAMES, (1.0, 1.0, 2.0, 3, 1.0, 1e-3, 0.6), strict=True)))
    assert np.isnan(top["flip_period"][0])
    assert top["max_tilt"][0] == pytest.approx(np.arctan(1e-3), rel=1e-13, abs=0)


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="ten thousand rotations in plain Python are slow")
def test_a_search_that_does_not_end_is_told():
    # a symmetric top nudged off a transverse axis drifts: its flip is a million rotations away
    points = {"I1": 1.0, "I2": 1.0, "I3": 2.0, "axis": 1, "omega0": 1.0, "epsilon": 1e-6, "phase": 0.6}
    flip_columns = survey.measure_points(points, 4.0, 16, 1e-10, nonlinear=True)
    assert flip_columns["status"][0] == survey.SHORT_WINDOW
    assert np.isnan(flip_columns["flip_period"][0])
    assert np.isnan(flip_columns["max_tilt"][0])
    assert flip_columns["flip_period_exact"][0] > 2 * np.pi * flips.MAX_ROTATIONS
    # the same motion with a larger nudge ends within the bound
    flip_columns = survey.measure_points(points | {"epsilon": 1e-2}, 4.0, 16, 1e-10, nonlinear=True)
    assert flip_columns["status"][0] == survey.OK
    np.testing.assert_allclose(flip_columns["flip_period"], flip_columns["flip_period_exact"], rtol=1e-9)


@pytest.mark.parametrize("neighbour", [(1e-300, 1.5, 3.0, 1), (1.0, 1e-9, 1.0, 3), (1.0, 1.0, 1.001, 1)])
def test_no_search_depends_on_its_neighbours(neighbour, monkeypatch):
    """A body with a far shorter or longer step, or without a flip, shares a block with a flipping body."""
    point = dict(zip(NAMES, (1.9, 1.2, 2.4, 1, 1.0, 1e-2, 0.6), strict=True))
    neighbour_point = dict(zip(NAMES, (*neighbour, 1.0, 1e-6, 0.6), strict=True))
    # the compiler freezes the bounds; without it rotations more and fewer than the 2.3 that the way to a flip takes
    for max_rotations in (4, 1) if config.DISABLE_JIT else (flips.MAX_ROTATIONS,):
        monkeypatch.setattr(flips, "MAX_ROTATIONS", max_rotations)
        monkeypatch.setattr(flips, "MAX_STEPS", 400 if config.DISABLE_JIT else flips.MAX_STEPS)
        alone = columns(point)
        together = columns({name: np.array([point[name], neighbour_point[name]]) for name in NAMES})
        for name in alone:
            np.testing.assert_array_equal(together[name][:1], alone[name], err_msg=name)


@pytest.mark.compiled
def test_the_survey_adds_the_columns_and_changes_no_other():
    points = bodies(200, 3, epsilon=1e-3)
    plain, more = (survey.measure_points(points, 4.0, 16, 1e-10, nonlinear=flag) for flag in (False, True))
    assert set(more) - set(plain) == set(flips.MEASURED)
    for name in plain:
        np.testing.assert_array_equal(more[name], plain[name], err_msg=name)
    by_hand = columns(points)
    for name in flips.MEASURED:
        np.testing.assert_array_equal(more[name], by_hand[name], err_msg=name)


def test_the_frequency_at_its_own_amplitude_tends_to_linear_theory():
    points = dict(zip(NAMES, (1.0, 2.0, 2.7, 3, 1.5, np.array([1e-6, 1e-4, 1e-2]), 0.6), strict=True))
    frequency, linear = columns(points)["frequency_exact"], survey.predict_points(points)["frequency_theory"]
    deviation = np.abs(frequency / linear - 1)
    assert deviation[0] < 1e-11
    assert deviation[2] / deviation[1] == pytest.approx(1e4, rel=1e-2)  # the square of the nudge
