"""Results do not depend on units, on the stiffest term or on 1 m: past silent errors, each by its symptom."""

import numpy as np
import pytest
import repeated
import sympy as sp
from described import model_of, particle, points_at
from oscillators import LIBRARY

from kernels.estimator import statuses
from kernels.flow import oscillations as kernel
from sweeps.mechanics import System, equilibria
from sweeps.mechanics.model import Model

FACTORS = [(1e9, 1e20, 1e6), (1e-9, 1e-20, 1e-6), (1e9, 1e-20, 1e-6), (1e-9, 1e20, 1e6)]  # length, mass, time


def plane(V, bounds, max_places=8, **parameters):
    """Unit masses in a potential of x, y, …, as many as there are bounds."""
    return Model(particle(V, "xyzw"[: len(bounds)], bounds, most=max_places, **parameters))


@pytest.mark.parametrize("stiffness", repeated.but((1e3, 1e13), (1e3, 2e5, 1e9, 1e13)))
def test_an_elastic_pendulum_hangs_at_its_place(stiffness):
    system = System("Elastic pendulum", most=4)
    k = system.parameter("stiffness", "N m-1", default=100.0, positive=True)
    r = system.coordinate("r", "m", bounds=(0.2, 3), positive=True)
    angle = system.coordinate("angle", "rad", bounds=(-sp.pi, sp.pi), periodic=True)
    system.particle(1, (r * sp.sin(angle), -r * sp.cos(angle)))
    system.potential(k * (r - 1) ** 2 / 2 - sp.Rational(980665, 100000) * r * sp.cos(angle))
    model = Model(system)
    theory = model.theory(points_at(model, stiffness=stiffness))
    below = theory["place"][np.abs(theory["place"][:, 1]) < 1]
    assert below[0] == pytest.approx([1 + 9.80665 / stiffness, 0], abs=1e-15)
    soft = theory["omega_squared"][np.abs(theory["place"][:, 1]) < 1][0]
    assert soft == pytest.approx(9.80665 / (1 + 9.80665 / stiffness), rel=1e-12)
    assert (~np.isnan(theory["place"][:, 0])).sum() == 4  # both modes of two places: none is lost or invented
    assert (theory["certified"] == equilibria.PROVED).all()


@pytest.fixture(scope="module")
def quartic():
    return plane(lambda x, a, b: a * x**3 / 3 + b * x**4 / 4, [(-1, 2)], max_places=2, a=0.0, b=0.0)


@pytest.mark.parametrize(("a", "b"), [(1.0, 0.0), (0.0, 100.0), (0.0, -100.0), (1e-30, 0.0), (0.0, 1e30)])
def test_a_degenerate_equilibrium_is_marginal_and_has_no_rate(quartic, a, b):
    columns = quartic.survey(points_at(quartic, a=a, b=b))
    assert columns["x_equilibrium"][0] == pytest.approx(0.0, abs=1e-15)
    assert columns["regime"][0] == columns["regime_theory"][0] == kernel.MARGINAL
    assert columns["growth_rate"][0] == columns["frequency"][0] == 0.0
    assert np.isnan(columns["x_equilibrium"][1])


@pytest.mark.parametrize("power", [4, 6, 12, 20])
@pytest.mark.parametrize("bounds", [(-1, 2), (-2, 3), (-0.7, 11)])
def test_a_flat_bottom_is_marginal_within_any_bounds(power, bounds):
    """The place is found to 1e-17 of the bounds, and V″ there is some 1e-33: no scale of its own."""
    model = plane(lambda x: x**power, [bounds], max_places=1)
    theory = model.theory(points_at(model))
    assert theory["omega_squared"].tolist() == [0.0]
    assert theory["scale"][0] > 0.1


def test_a_row_without_an_equilibrium_has_no_theory():
    model = plane(lambda x, k: k * (x - 3) ** 2 / 2, [(-1, 2)], max_places=1, k=1.0)
    columns = model.survey(points_at(model))
    assert columns["status"].tolist() == [statuses.NO_EQUILIBRIUM]
    for name in ("omega_squared_theory", "frequency_theory", "rate_scale", "omega_squared", "x_equilibrium"):
        assert np.isnan(columns[name]).all()
    assert columns["regime_theory"].tolist() == [-1]


def argon(**options):
    """Argon by Lennard-Jones: 0.34 nm, 1.65e-21 J, 39.95 u (half of it: two atoms)."""
    system = System("Argon", most=1)
    depth = system.parameter("depth", "J", default=1.65e-21, positive=True)
    s = system.parameter("sigma", "m", default=3.4e-10, positive=True)
    r = system.coordinate("r", "m", bounds=(s / 2, 4 * s), positive=True, **options)
    system.kinetic_energy(sp.Float(3.3e-26) * system.velocity(r) ** 2 / 2)
    system.potential(4 * depth * ((s / r) ** 12 - (s / r) ** 6))
    return Model(system)


def test_the_size_that_is_left_out_follows_from_the_potential():
    model = argon()
    theory = model.theory(points_at(model))
    place = 2 ** (1 / 6) * 3.4e-10
    assert theory["place"][0, 0] == pytest.approx(place, rel=1e-14)
    assert 0.01 * place < theory["sizes"][0, 0] < 0.3 * place
    assert theory["omega_squared"][0] == pytest.approx(72 * 1.65e-21 / (2 ** (1 / 3) * 3.4e-10**2) / 3.3e-26, rel=1e-12)


@pytest.mark.parametrize(("size", "epsilon"), [(1.0, 1e-6), (1.0, 0.5), (4e-10, 0.5)])
def test_a_nudge_that_leaves_the_neighbourhood_is_said(size, epsilon):
    model = argon(size=size)
    columns = model.survey(points_at(model, epsilon=epsilon))
    assert columns["status"].tolist() == [statuses.PERTURBATION_TOO_LARGE]
    assert np.isnan(columns["omega_squared"]).all()


@pytest.mark.slow
def test_planar_water_with_a_bend_by_acos_has_three_vibrations_and_three_free_motions():
    """Six coordinates, for which the expansion of sums once took minutes."""
    system = System("Planar water", most=1)
    bond, angle = sp.Float(9.57e-11), sp.Float(1.824)
    oxygen, hydrogen = (
        system.parameter(n, "kg", default=d, positive=True) for n, d in (("O", 2.66e-26), ("H", 1.67e-27))
    )
    start = dict(
        zip(
            ("x", "y", "x1", "y1", "x2", "y2"), (0, 0, bond, 0, bond * sp.cos(angle), bond * sp.sin(angle)), strict=True
        )
    )
    q = {
        name: system.coordinate(
            name, "m", bounds=(at - bond / 3, at + bond / 3), hold=at if name in ("x", "y", "y1") else None
        )
        for name, at in start.items()
    }
    ends = [(q["x1"] - q["x"], q["y1"] - q["y"]), (q["x2"] - q["x"], q["y2"] - q["y"])]
    for mass, place in ((oxygen, ("x", "y")), (hydrogen, ("x1", "y1")), (hydrogen, ("x2", "y2"))):
        system.particle(mass, [q[name] for name in place])
    lengths = [sp.sqrt(a**2 + b**2) for a, b in ends]
    bend = sp.acos((ends[0][0] * ends[1][0] + ends[0][1] * ends[1][1]) / (lengths[0] * lengths[1]))
    system.potential(
        sum(845 * (length - bond) ** 2 / 2 for length in lengths) + sp.Float(7e-19) * (bend - angle) ** 2 / 2
    )
    model = Model(system)
    theory = model.theory(points_at(model))
    assert theory["certified"].tolist() == [equilibria.PROVED] * 6
    square = np.sort(theory["omega_squared"])
    assert np.abs(square[:3]).max() < 1e-12 * theory["scale"][0] ** 2
    assert (np.sqrt(square[3:]) > 2e14).all()  # some 1,600 to 3,900 cm⁻¹
    assert (np.sqrt(square[3:]) < 8e14).all()


def test_a_kinetic_energy_that_is_not_positive_is_said():
    system = particle(lambda x, c: x**2 / 2, bounds=(-1, 2), most=1, c=0.5)
    (x,), (c,) = (tuple(each.symbol for each in table.values()) for table in (system.coordinates, system.parameters))
    system.kinetic_energy((1.5 - c) * system.velocity(x) ** 2)
    model = Model(system)
    columns = model.survey(points_at(model, c=[2.0, 3.0]))
    assert columns["status"].tolist() == [statuses.KINETIC_ENERGY_NOT_POSITIVE] * 2


UNITS = {  # parameter → exponents of length, mass and time
    **dict.fromkeys(("mass", "mass1", "mass2", "outer_mass", "inner_mass"), (0, 1, 0)),
    **dict.fromkeys(("length", "length1", "length2", "radius", "bond"), (1, 0, 0)),
    **{"gravity": (1, 0, -2), "spin_rate": (0, 0, -1), "alpha": (0, 1, -2), "beta": (-2, 1, -2), "exponent": (0, 0, 0)},
    **{"strength": (3, 1, -2), "angular_momentum": (2, 1, -1), "stiffness": (0, 1, -2), "depth": (2, 1, -2)},
}


@pytest.mark.parametrize("name", repeated.but(("pendulum",), LIBRARY))  # further code takes long to compile
def test_shipped_maps_do_not_know_the_units(name):
    model = model_of(name)
    exponents = {p: UNITS[p] for p in model.names}
    rows = points_at(model, spin_rate=7.3) if name == "bead_on_hoop" else points_at(model)
    plain = model.survey(rows)
    for factors in FACTORS:
        unit = {p: np.prod([f**e for f, e in zip(factors, exponents[p], strict=True)]) for p in exponents}
        columns = model.survey(rows | {p: rows[p] * unit[p] for p in exponents})
        for column in ("regime", "regime_theory", "status", "equilibria_certified", "samples_used", "steps_per_sample"):
            assert np.array_equal(plain[column], columns[column]), column
        rates = plain["rate_scale"] ** 2
        deviation = np.abs(columns["omega_squared"] * factors[2] ** 2 - plain["omega_squared"]) / rates
        assert np.nanmax(deviation) <= 1e-10
        assert columns["amplitude"] == pytest.approx(plain["amplitude"], rel=1e-10, nan_ok=True)
