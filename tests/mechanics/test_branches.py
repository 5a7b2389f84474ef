"""Equilibria that are followed keep their numbers when neighbours vanish; counts and positions do not change."""

import numpy as np
import pytest
import sympy as sp
from described import particle

from sweeps.mechanics import branches
from sweeps.mechanics.derivation import derive
from sweeps.mechanics.equilibria import PROVED, find
from sweeps.mechanics.landscape import Landscape
from sweeps.schema.refusals import DescriptionError


def landscape_of(V, bounds, most, follow=True, **settings):
    """Return the landscape of a particle."""
    return Landscape(derive(particle(V, bounds=bounds, most=most, follow=follow, **settings)))


def cusp(follow=True, tilt=-2.0, push=0.0, max_places=3):
    """V = x⁴/4 + a x²/2 + b x: three equilibria within the cusp 4 a³ + 27 b² < 0, one outside."""
    return landscape_of(lambda x, a, b: x**4 / 4 + a * x**2 / 2 + b * x, (-4, 4), max_places, follow, a=tilt, b=push)


def places(landscape, *parameters):
    zeros = find(landscape, np.broadcast_arrays(*map(np.asarray, parameters)))
    return zeros, zeros.places[:, :, 0]


def test_a_branch_keeps_its_number_through_a_fold():
    b = np.linspace(-2, 2, 41)
    zeros, positions = places(cusp(), -2.0, b)
    _, ascending = places(cusp(False), -2.0, b)
    assert np.array_equal(
        np.sort(positions, axis=1), np.sort(ascending, axis=1), equal_nan=True
    )  # the same places under other names
    fold = 2 / 3 * np.sqrt(2 / 3) * 2  # b² = -4 a³/27
    assert (np.isnan(positions[:, 0]) == (b < -fold)).all()
    assert (np.isnan(positions[:, 2]) == (b > fold)).all()
    assert (np.isnan(positions[:, 1]) == (np.abs(b) > fold)).all()
    assert (np.diff(positions[~np.isnan(positions[:, 2]), 2]) < 0).all()
    assert (zeros.certified == PROVED).all()
    assert np.isnan(ascending[0, 2])  # by their places alone the branch would have another number beyond the fold


def test_a_branch_that_comes_round_keeps_its_number():
    """V = -cos(x - a): the places turn with a, past the ends of the interval of 2π that is searched."""
    values = np.linspace(-9, 9, 60)
    _, positions = places(landscape_of(lambda x, a: -sp.cos(x - a), (-sp.pi, sp.pi), 2, periodic=True, a=0.3), values)
    start = np.cos(positions[np.abs(values - 0.3).argmin()] - 0.3).round()
    np.testing.assert_allclose(np.cos(positions - values[:, None]), np.broadcast_to(start, positions.shape), atol=1e-12)


def test_a_name_depends_on_its_point_alone():
    rng = np.random.default_rng(2)
    a, b = rng.uniform(-3, 1, 50), rng.uniform(-1, 1, 50)
    _, positions = places(cusp(), a, b)
    for selection in (slice(3, 4), slice(10, 30), slice(None, None, -1)):
        assert np.array_equal(places(cusp(), a[selection], b[selection])[1], positions[selection], equal_nan=True)


def parabolic_cusp(tilt, push=0.0):
    """The cusp in x with y bound to a parabola: V = x⁴/4 + a x²/2 + b x + (y - x²)²/2."""

    def V(x, y, a, b):
        return x**4 / 4 + a * x**2 / 2 + b * x + (y - x**2) ** 2 / 2

    return landscape_of(V, [(-3, 3), (-2, 10)], 3, names="xy", a=tilt, b=push)


def test_branches_of_two_coordinates_keep_their_numbers_through_folds():
    b = np.array([-1.5, -1.0, 0.5, 1.0, 1.5])
    zeros, positions = places(parabolic_cusp(-2.0), -2.0, b)
    _, alone = places(cusp(), -2.0, b)  # the same of one coordinate
    np.testing.assert_allclose(positions, alone, atol=1e-12)
    np.testing.assert_allclose(zeros.places[:, :, 1], positions**2, atol=1e-12)
    assert zeros.is_order_decided.all()
    assert (zeros.certified == PROVED).all()


@pytest.mark.parametrize(
    ("of", "values"), [(cusp, np.linspace(1, -2, 16)), (parabolic_cusp, np.array([0.5, -0.5, -1.5]))]
)
def test_the_middle_branch_of_a_pitchfork_keeps_its_number(of, values):
    zeros, positions = places(of(tilt=1.0), values, 0.0)
    np.testing.assert_allclose(positions[:, 0], 0.0, atol=1e-9)
    split = values < 0
    assert np.isnan(positions[~split, 1:]).all()
    np.testing.assert_allclose(positions[split, 1:], np.sqrt(-values[split])[:, None] * [-1, 1], rtol=1e-12)
    assert zeros.is_order_decided.all()


@pytest.fixture(scope="module")
def wells():
    """Two double wells and a spring: V = (x² - 1)²/4 + (y² - 1)²/4 + c (x - y)²/2."""
    return landscape_of(
        lambda x, y, c: (x**2 - 1) ** 2 / 4 + (y**2 - 1) ** 2 / 4 + c * (x - y) ** 2 / 2, (-2, 2), 9, names="xy", c=0.1
    )


def in_closed_form(c):
    """The nine: with x = y 0 and ±1; with x = -y x² = 1 - 2c; with xy = -c and x² + y² = 1 - c four more."""
    with np.errstate(invalid="ignore"):
        across, total, difference = np.sqrt(1 - 2 * c), np.sqrt(1 - 3 * c), np.sqrt(1 + c)  # x - y, x + y of the four
    p, q = (difference + total) / 2, (difference - total) / 2
    return np.array(
        [
            (-1, -1), (-p, q), (-across, across), (-q, p), (0, 0), (q, -p), (across, -across), (p, -q), (1, 1),
        ]
    )  # fmt: skip


def test_coupled_double_wells_keep_their_names_through_two_rounds_of_pitchforks(wells):
    """At c = 1/3 four meet the two of x = -y, at c = 1/2 these meet the origin."""
    c = np.array([0.1, 0.3, 0.4, 0.45, 0.6])
    zeros = find(wells, [c])
    assert zeros.counts.tolist() == [9, 9, 5, 5, 3]
    for k, value in enumerate(c):
        np.testing.assert_allclose(zeros.places[k], in_closed_form(value), atol=1e-12)
    assert zeros.is_order_decided.all()
    assert (zeros.certified == PROVED).all()


def test_a_branch_that_another_one_crosses_keeps_its_number():
    """V = x³/3 - a x²/2: places 0 and a, which pass through each other."""
    crossing = landscape_of(lambda x, a: x**3 / 3 - a * x**2 / 2, (-4, 4), 2, a=1.0)
    zeros, positions = places(crossing, [2.0, -1.0, -2.0])
    np.testing.assert_allclose(positions, [[0, 2], [0, -1], [0, -2]], atol=1e-12)
    assert zeros.is_order_decided.all()


def test_what_cannot_be_decided_is_said():
    """From the very place of a fold two come to be, and neither continues the old branch more than its twin."""
    zeros, positions = places(landscape_of(lambda x, a: x**3 / 3 + a * x, (-4, 4), 2, a=0.0), [-1.0, 0.0, 1.0])
    assert zeros.counts.tolist() == [2, 1, 0]
    assert zeros.is_order_decided.tolist() == [False, True, False]
    assert np.array_equal(np.sort(positions[0]), [-1.0, 1.0])


def test_places_that_are_born_together_are_numbered_by_place_and_take_no_place_that_was_not_free():
    slots = np.array([7, -1, -1, -1, -1])
    branches.assign_new_roots(slots, [(3, 0.51), (1, 0.51 + branches.MAX_GAP / 2), (2, 0.2)], {1: 0.4})
    assert slots.tolist() == [7, 1, 2, 3, -1]


def test_what_cannot_be_followed_is_refused():
    with pytest.raises(DescriptionError, match="follow: is for equilibria without names"):
        landscape_of(lambda x: x**2, (-1, 1), None, places={"bottom": [0]})
