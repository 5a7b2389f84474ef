"""Equilibria that are followed keep their numbers where others vanish; counts and places are those of the search."""

import numpy as np
import pytest
import sympy as sp

from sweeps.mechanics import System, branches
from sweeps.mechanics.derivation import derive
from sweeps.mechanics.description import DescriptionError
from sweeps.mechanics.equilibria import PROVED, Landscape, find


def cusp(follow, tilt=-2.0, push=0.0, most=3):
    """V = x⁴/4 + a x²/2 + b x: three equilibria within the cusp 4 a³ + 27 b² < 0, one outside."""
    system = System("cusp", most=most, follow=follow)
    x = system.coordinate("x", "m", bounds=(-4, 4))
    a, b = system.parameter("a", default=tilt), system.parameter("b", default=push)
    system.kinetic_energy(system.velocity(x) ** 2 / 2)
    system.potential(x**4 / 4 + a * x**2 / 2 + b * x)
    return Landscape(derive(system))


def places(landscape, *parameters):
    found = find(landscape, np.broadcast_arrays(*map(np.asarray, parameters)))
    return found, found.places[:, :, 0]


def test_a_branch_keeps_its_number_through_a_fold():
    b = np.linspace(-2, 2, 41)
    found, kept = places(cusp(True), -2.0, b)
    _, ordered = places(cusp(False), -2.0, b)
    assert np.array_equal(
        np.sort(kept, axis=1), np.sort(ordered, axis=1), equal_nan=True
    )  # the same places under other names
    fold = 2 / 3 * np.sqrt(2 / 3) * 2  # b² = -4 a³/27
    assert (np.isnan(kept[:, 0]) == (b < -fold)).all()
    assert (np.isnan(kept[:, 2]) == (b > fold)).all()
    assert (np.isnan(kept[:, 1]) == (np.abs(b) > fold)).all()
    assert (np.diff(kept[~np.isnan(kept[:, 2]), 2]) < 0).all()
    assert (found.certified == PROVED).all()
    assert np.isnan(ordered[0, 2])  # by their places alone the branch would have another number beyond the fold


def test_the_middle_branch_of_a_pitchfork_keeps_its_number():
    a = np.linspace(1, -2, 16)
    _, kept = places(cusp(True, tilt=1.0), a, 0.0)
    assert np.abs(kept[:, 0]).max() < 1e-9
    split = a < 0
    assert np.isnan(kept[~split, 1:]).all()
    np.testing.assert_allclose(kept[split, 1:], np.sqrt(-a[split])[:, None] * [-1, 1], rtol=1e-12)


def test_a_branch_that_comes_round_keeps_its_number():
    """V = -cos(x - a): the places turn with a, past the ends of the one turn that is searched."""
    system = System("turned", most=2, follow=True)
    x = system.coordinate("x", "rad", bounds=(-sp.pi, sp.pi), periodic=True)
    a = system.parameter("a", default=0.3)
    system.kinetic_energy(system.velocity(x) ** 2 / 2)
    system.potential(-sp.cos(x - a))
    values = np.linspace(-9, 9, 60)
    _, kept = places(Landscape(derive(system)), values)
    start = np.cos(kept[np.abs(values - 0.3).argmin()] - 0.3).round()
    np.testing.assert_allclose(np.cos(kept - values[:, None]), np.broadcast_to(start, kept.shape), atol=1e-12)


def test_a_name_depends_on_its_point_alone():
    rng = np.random.default_rng(2)
    a, b = rng.uniform(-3, 1, 50), rng.uniform(-1, 1, 50)
    _, whole = places(cusp(True), a, b)
    for part in (slice(3, 4), slice(10, 30), slice(None, None, -1)):
        assert np.array_equal(places(cusp(True), a[part], b[part])[1], whole[part], equal_nan=True)


def test_more_than_there_is_room_for_is_said():
    found, kept = places(cusp(True, most=2), [-2.0, -2.0], [0.0, 2.0])
    assert found.crowded.tolist() == [True, False]
    assert np.isnan(kept[0]).all()
    assert np.isfinite(kept[1]).sum() == 1


def test_pairs_are_as_many_as_can_be_and_move_as_little():
    old, new = np.array([[0.1, 0.5, 0.6]]), np.array([[0.12, np.nan, np.nan]])
    assert branches._paired(old, new).tolist() == [[0, -1, -1]]
    new = np.array([[0.55, 0.9, np.nan]])
    assert branches._paired(np.array([[0.0, 0.5, np.nan]]), new).tolist() == [[0, 1, -1]]  # none passes another


def test_what_cannot_be_followed_is_refused():
    system = System("two", most=2, follow=True)
    x, y = (system.coordinate(name, "m", bounds=(-1, 1)) for name in "xy")
    system.particle(1, (x, y))
    system.potential(x**2 + y**2)
    with pytest.raises(
        DescriptionError, match="follow: is for equilibria without names of systems with one coordinate"
    ):
        Landscape(derive(system))
