from functools import cache
from inspect import signature

import mpmath
import numpy as np
import pytest
import sympy as sp
from described import flow, model_of, particle

from kernels.estimator import statuses
from sweeps.mechanics import System, equilibria
from sweeps.mechanics.derivation import derive
from sweeps.mechanics.landscape import Landscape
from sweeps.mechanics.model import Model


@cache
def landscape_of(system):
    """The landscape of a system, derived once."""
    return Landscape(derive(system))


def places(system, **parameters):
    """Return positions and flatness of the points with these parameters and the defaults of all further parameters."""
    landscape = landscape_of(system)
    count = max((np.size(value) for value in parameters.values()), default=1)
    columns = [np.resize(parameters.get(p.name, p.default), count) for p in system.parameters.values()]
    zeros = equilibria.find(landscape, columns)
    return zeros.places, zeros.is_flat


def bead(V, *, bounds=(-3, 4), max_places=8, **settings):
    """A bead of unit mass in a potential of x and named parameters."""
    return particle(V, bounds=bounds, most=max_places, **settings)


def test_hoop_has_the_places_of_its_formula_on_both_sides_of_the_pitchfork():
    radius, spin = np.meshgrid(np.geomspace(0.1, 10, 41), np.linspace(0, 20, 41))
    radius, spin = radius.ravel(), spin.ravel()
    zeros, flat = places(model_of("bead_on_hoop").system, radius=radius, spin_rate=spin)
    with np.errstate(divide="ignore"):
        cosine = 9.80665 / (radius * spin**2)
    is_tilted = cosine < 1
    assert not flat.any()
    assert zeros[:, 0, 0] == pytest.approx(0, abs=1e-14)
    assert np.abs(zeros[:, 1, 0]) == pytest.approx(np.pi, abs=1e-14)
    assert np.array_equal(~np.isnan(zeros[:, 2, 0]), is_tilted)
    # near the pitchfork the place is the root of a difference: one rounding of it over its own slope
    allowed = 1e-14 / np.sqrt(1 - cosine[is_tilted] ** 2)
    assert (np.abs(zeros[is_tilted, 2, 0] - np.arccos(cosine[is_tilted])) <= allowed).all()
    assert zeros[is_tilted, 3, 0] == pytest.approx(-zeros[is_tilted, 2, 0], abs=1e-7)


def test_pitchfork_is_resolved_far_below_the_scan():
    excess = np.array([1e-4, 1e-8, 1e-12])  # roots at sqrt(2 excess), from 1e-2 to 1e-6: cells are 0.1 wide
    zeros, _ = places(model_of("bead_on_hoop").system, radius=9.80665 * (1 + excess), spin_rate=1.0)
    assert zeros[:, 2, 0] == pytest.approx(np.sqrt(2 * excess), rel=2e-2)
    assert zeros[:, 3, 0] == pytest.approx(-np.sqrt(2 * excess), rel=2e-2)
    exactly, _ = places(model_of("bead_on_hoop").system, radius=1.0, gravity=1.0, spin_rate=1.0)
    assert np.isnan(exactly[0]).any(axis=-1).tolist() == [False, False, True, True]
    radius = np.geomspace(0.1, 10, 57)  # on the line but for a rounding: the bottom, whatever the rounding leaves
    near, _ = places(model_of("bead_on_hoop").system, radius=radius, spin_rate=np.sqrt(9.80665 / radius))
    assert np.abs(near[:, 0, 0]).max() < 1e-7
    assert np.isnan(near[:, 2:]).all()


def test_spherical_pendulum_swings_in_a_cone_of_its_momentum():
    L = np.geomspace(0.1, 50, 9)
    theta = places(model_of("spherical_pendulum").system, angular_momentum=L)[0][:, 0, 0]
    assert ((theta > 0) & (theta < np.pi / 2)).all()
    np.testing.assert_allclose(9.80665 * np.sin(theta) ** 4, L**2 * np.cos(theta), rtol=2e-12)  # 1/cos θ of a rounding


def test_the_error_of_a_place_covers_its_distance_from_the_closed_form():
    rng, landscape = np.random.default_rng(4), landscape_of(model_of("central_potential").system)
    s, L = rng.uniform(-1.95, 8.0, 200), np.exp(rng.uniform(-4, 4, 200))
    parameters = [np.ones(200), np.ones(200), s, L]
    zeros = equilibria.find(landscape, parameters).places[:, 0]
    error = landscape.place_error(parameters, zeros, 0.0)[:, 0]
    with mpmath.workdps(40):
        deviation = [
            abs(float(x) - mpmath.mpf(b) ** (2 / (mpmath.mpf(a) + 2)))
            for a, b, x in zip(s, L, zeros[:, 0], strict=True)
        ]
    deviation = np.array(deviation, dtype=float)
    assert (deviation <= error).all()
    assert np.median(error[deviation > 0] / deviation[deviation > 0]) < 10  # the bar of an error's sharpness


def test_a_periodic_coordinate_counts_its_end_once():
    for offset in (0.0, 0.3, np.pi / 2):
        system = bead(lambda x, c: -sp.cos(x - c), bounds=(-sp.pi, sp.pi), periodic=True, max_places=4, c=offset)
        zeros, _ = places(system)
        assert (~np.isnan(zeros[0, :, 0])).sum() == 2


def test_named_places_are_taken_to_the_last_bit():
    masses, lengths = np.random.default_rng(3).uniform(0.1, 10, (2, 30))
    zeros, flat = places(model_of("double_pendulum").system, mass2=masses, length2=lengths)
    assert not flat.any()
    four = np.array([[0, 0], [0, np.pi], [np.pi, 0], [np.pi, np.pi]])
    assert np.array_equal(np.abs(zeros), np.broadcast_to(four, zeros.shape))


def test_flat_directions_are_said():
    wire, flat = places(model_of("bead_on_wire").system, gravity=4.0, length=1.0, spin_rate=np.array([1.0, 2.0]))
    assert flat.tolist() == [False, True]
    assert np.isnan(wire[:, 0, 0]).tolist() == [False, True]
    free = particle(lambda x, y: (x - y - 1) ** 2, "xy", most=2)
    zeros, flat = places(free)
    assert flat.tolist() == [True]
    assert np.isnan(zeros).all()
    landscape = landscape_of(free)
    message = equilibria.refusal(landscape, equilibria.find(landscape, []), [])
    assert "along x, y (in the ratio 1 : 1 of their ranges)" in message


def test_a_held_coordinate_finds_the_molecule():
    zeros, flat = places(model_of("linear_triatomic").system)
    assert not flat.any()
    assert zeros[0, 0] == pytest.approx([0, 1.16e-10, 2.32e-10], rel=1e-12)


def test_a_held_coordinate_where_nothing_is_flat_has_no_equilibrium():
    system = System("Held off its place", most=2)
    m = system.parameter("mass", "kg", default=1, positive=True)
    x = system.coordinate("x", "m", bounds=(-1, 2), hold=1)
    y = system.coordinate("y", "m", bounds=(-1, 2))
    system.particle(m, (x, y))
    system.potential(x**2 + y**2)
    zeros, _ = places(system)
    assert np.isnan(zeros).all()


def test_more_equilibria_than_said_are_said_and_spoil_no_other_point():
    system = bead(lambda x, c: x**4 / 4 - c * x**2 / 2, max_places=2, c=1.0)
    landscape = Landscape(derive(system))
    columns = [np.array([1.0, -1.0, 0.5])]
    zeros = equilibria.find(landscape, columns)
    assert zeros.is_crowded.tolist() == [True, False, True]
    assert np.isnan(zeros.places[::2]).all()
    assert zeros.places[1, 0, 0] == pytest.approx(0.0, abs=1e-15)
    assert equilibria.refusal(landscape, zeros, columns) == ""  # one point has some
    assert "there are 3, at c=1; allowed: at most 2" in equilibria.refusal(landscape, zeros[:1], columns)


def test_none_is_not_said_where_the_search_was_undecided(monkeypatch):
    landscape = Landscape(derive(bead(lambda x: sp.exp(-x), bounds=(0, 800))))  # underflows
    zeros = equilibria.find(landscape, [])
    assert "none is found and none excluded at 1 of 1" in equilibria.refusal(landscape, zeros, [])


@pytest.mark.parametrize("name", ["lagrange_points", "central_potential", "foucault"])
def test_points_that_are_searched_together_have_the_equilibria_that_each_has_alone(name, monkeypatch):
    landscape, rng = landscape_of(model_of(name).system), np.random.default_rng(5)
    ranges = {"mass_ratio": (1e-3, 0.5), "exponent": (-1.9, 6.0), "spin_rate": (0.0, 2.0)}
    parameters = [
        rng.uniform(*ranges.get(p.name, (p.default, p.default)), 60) for p in landscape.system.parameters.values()
    ]
    together = equilibria.find(landscape, parameters)
    for i in (0, 31):
        alone = equilibria.find(landscape, [p[i : i + 1] for p in parameters])
        assert np.array_equal(alone.places[0], together.places[i], equal_nan=True)  # to the last bit
    monkeypatch.setattr(equilibria, "MAX_SHARED_N", 0)
    monkeypatch.setattr(equilibria, "SEARCH_OPERATIONS", equilibria.SHARED_WORK_FACTOR * equilibria.SEARCH_OPERATIONS)
    landscape.last = None, None
    plain = equilibria.find(landscape, parameters)
    assert np.array_equal(plain.certified, together.certified)
    assert np.array_equal(plain.counts, together.counts)
    # each is refined to its own rounding, from another box
    np.testing.assert_allclose(plain.places, together.places, rtol=1e-14, atol=1e-15)


def test_parameters_that_move_no_equilibrium_are_known():
    free = {"mass", "gravity", "length"}
    for name, none in {"pendulum": free, "bead_on_hoop": {"mass"}, "double_well": {"mass"}}.items():
        landscape = landscape_of(model_of(name).system)
        names = landscape.equations.system.parameters
        assert {n for n, default in zip(names, landscape.canonical, strict=True) if default is not None} == none
    # a factor that can vanish makes V flat there, and stays
    system = bead(lambda x, c: c * (x - 1) ** 2, c=1.0)
    assert Landscape(derive(system)).canonical == (None,)
    zeros, flat = places(system, c=[0.0, 2.0])
    assert flat.tolist() == [True, False]
    assert zeros[1, 0, 0] == pytest.approx(1.0, abs=1e-15)


# -- names that no equilibrium has


def laser(E, P, D, r):
    return [P - E, 2 * (E * D - P), (r - D - E * P) / 2]


LASING = {"lasing": lambda r: (sp.sqrt(r - 1), sp.sqrt(r - 1), 1)}
DARK = {"dark": lambda r: (0, 0, r)}
AT = {"at": lambda r: (sp.sqrt(r), 1)}
#: equations and names, the parameter's default, and the interval in which the last name's position is real
NAMED = {
    "laser whose dark state has no name": (laser, LASING, 2.0, (1.0, np.inf)),
    "laser": (laser, DARK | LASING, 2.0, (1.0, np.inf)),
    "fold": (lambda x, r: [r - x**2], {"node": lambda r: (sp.sqrt(r),)}, 2.0, (0.0, np.inf)),
    "family, at any y": (lambda x, y, r: [x**2 - r, (x**2 - r) * y], AT, 2.0, (0.0, np.inf)),
    "circle at rest": (lambda x, y, r: [(x**2 + y**2 - 1) * x, (x**2 + y**2 - 1) * y], None, 0.5, (-1.0, 1.0)),
    "steady precession": (None, None, None, (np.sqrt(8.0 * np.cos(0.5)) / 0.6, np.inf)),
}


@pytest.mark.parametrize("case", NAMED)
def test_a_name_without_a_real_place_has_no_equilibrium_where_the_equations_have_none(case):
    rates, names, default, (low, high) = NAMED[case]
    ends = [end for end in (low, high) if np.isfinite(end)]
    values = np.unique([end + side for end in ends for side in (-1.7, -0.5, -1e-3, -1e-6, 1e-6, 1e-3, 0.5, 1.7)])
    if rates is None:
        model = model_of("steady_precession")
    else:
        unknowns = "xyz"[: len(signature(rates).parameters) - 1]
        names = names or {"on": lambda r: (r, sp.sqrt(1 - r**2))}
        model = Model(flow(rates, unknowns, (-10, 10), places=names, r=default))
    columns = [np.full(values.size, float(p.default)) for p in model.system.parameters.values()]
    columns[-1] = values
    status = model.place_columns(columns, np.full(values.size, len(model.system.labels) - 1))["status"]
    is_real = (values > low) & (values < high)
    assert (status[is_real] == statuses.OK).all()
    assert (status[~is_real] == statuses.NO_EQUILIBRIUM).all()


def test_a_name_is_undecided_where_its_place_is_not_real_but_the_equations_may_have_one():
    # at rest for any x and y on two lines; r is real, its root is not, and the equations do not contain r
    system = flow(lambda x, y, r: [x**2 - 1, (x**2 - 1) * y], "xy", places={"at": lambda r: (1, sp.sqrt(r))}, r=2.0)
    status = Model(system).place_columns([np.array([-1.0, 1.0])], np.zeros(2, dtype=int))["status"]
    assert status.tolist() == [statuses.EQUILIBRIUM_UNDECIDED, statuses.OK]
