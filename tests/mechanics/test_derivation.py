import re

import pytest
import repeated
import sympy as sp
from described import flow, model_of
from oscillators import LIBRARY
from sympy import cos, cot, sin

from sweeps.mechanics import DescriptionError, System
from sweeps.mechanics.derivation import derive
from sweeps.mechanics.first_order import graph


def symbols(system):
    """Name → symbol of parameters and coordinates, and name_dot → velocity."""
    table = {p.name: p.symbol for p in system.parameters.values()}
    for c in system.coordinates.values():
        table |= {c.name: c.symbol, f"{c.name}_dot": c.velocity}
    return table


# By hand: a_ij, the effective potential, and each equation of motion, left-hand side, its acceleration terms included.
# The lecture's and Landau and Lifshitz's results for a pendulum, polar coordinates and the double pendulum (section 5,
# problem 1); Goldstein's for the hoop (2.7) and for effective potentials (3.3); section 24 for the molecule.
def pendulum(mass, length, gravity, theta, theta_dot):
    A = sp.Symbol("A0")
    return [[mass * length**2]], [A + gravity / length * sin(theta)], [mass * length**2]


def bead_on_hoop(mass, gravity, radius, spin_rate, theta, theta_dot):
    A = sp.Symbol("A0")
    equation = A - spin_rate**2 * sin(theta) * cos(theta) + gravity / radius * sin(theta)
    return [[mass * radius**2]], [equation], [mass * radius**2]


def central_potential(mass, strength, exponent, angular_momentum, r, r_dot, theta, theta_dot, phi, phi_dot):
    A, B = sp.symbols("A0 A1")
    azimuth_rate = angular_momentum / (mass * r**2 * sin(theta) ** 2)  # the rate of the azimuth
    radial = A - r * theta_dot**2 - r * sin(theta) ** 2 * azimuth_rate**2 + strength * r ** (exponent - 1) / mass
    polar = B + 2 * r_dot * theta_dot / r - sin(theta) * cos(theta) * azimuth_rate**2
    return [[mass, 0], [0, mass * r**2]], [radial, polar], [mass, mass * r**2]


def spherical_pendulum(mass, length, gravity, angular_momentum, theta, theta_dot, phi, phi_dot):
    A = sp.Symbol("A0")
    cone = angular_momentum**2 / (mass**2 * length**4) * cot(theta) / sin(theta) ** 2
    return [[mass * length**2]], [A - cone + gravity / length * sin(theta)], [mass * length**2]


def bead_on_wire(mass, length, gravity, spin_rate, x, x_dot):
    A = sp.Symbol("A0")
    slope = x / length
    equation = (1 + slope**2) * A + slope * x_dot**2 / length + gravity * slope - spin_rate**2 * x
    return [[mass * (1 + slope**2)]], [equation], [mass]


def double_well(mass, alpha, beta, x, x_dot):
    A = sp.Symbol("A0")
    return [[mass]], [mass * A - alpha * x + beta * x**3], [1]


def double_pendulum(mass1, mass2, length1, length2, gravity, theta1, theta1_dot, theta2, theta2_dot):
    A, B = sp.symbols("A0 A1")
    total, difference = mass1 + mass2, theta1 - theta2
    a = [
        [total * length1**2, mass2 * length1 * length2 * cos(difference)],
        [mass2 * length1 * length2 * cos(difference), mass2 * length2**2],
    ]
    upper = total * length1 * A + mass2 * length2 * (B * cos(difference) + theta2_dot**2 * sin(difference))
    lower = length2 * B + length1 * (A * cos(difference) - theta1_dot**2 * sin(difference))
    equations = [upper + total * gravity * sin(theta1), lower + gravity * sin(theta2)]
    return a, equations, [length1, mass2 * length2]


def linear_triatomic(outer_mass, inner_mass, stiffness, bond, depth, x1, x1_dot, x2, x2_dot, x3, x3_dot):
    A, B, C = sp.symbols("A0 A1 A2")
    width = sp.sqrt(stiffness / (2 * depth))
    pull = [2 * depth * width * (1 - sp.exp(-width * s)) * sp.exp(-width * s) for s in (x2 - x1 - bond, x3 - x2 - bond)]
    equations = [outer_mass * A - pull[0], inner_mass * B + pull[0] - pull[1], outer_mass * C + pull[1]]
    return sp.diag(outer_mass, inner_mass, outer_mass).tolist(), equations, [1, 1, 1]


@pytest.mark.parametrize("name", repeated.but(("double_pendulum", "bead_on_hoop"), LIBRARY))
def test_kinetic_matrix_and_equations_are_the_textbooks(name):
    system = model_of(name).system
    derived = derive(system)
    a, equations, factors = globals()[name](**symbols(system))
    assert (derived.a - sp.Matrix(a)).applyfunc(sp.simplify).is_zero_matrix
    accelerations = sp.Matrix(sp.symbols(f"A0:{derived.m}"))
    residual = derived.a * accelerations - sp.Matrix(derived.forces)
    for mine, textbook, factor in zip(residual, equations, factors, strict=True):
        assert sp.simplify(sp.expand(mine - factor * textbook)) == 0


def bead():
    """Return a system of a particle of one coordinate, its mass and the coordinate."""
    system = System("Bead")
    m, x = system.parameter("mass", "kg", default=1, positive=True), system.coordinate("x", "m", bounds=(-1, 2))
    system.particle(m, (x,))
    return system, m, x


REFUSED = {  # message → what is added to the bead, of mass m, place x and velocity v
    "V: unbound symbol k; allowed: mass, t, x": lambda s, m, x, v: s.potential(sp.Symbol("k") * x**2),
    "V: unbound symbol x_dot; allowed: mass, t, x": lambda s, m, x, v: s.potential(x * v),
    "V: I*x is complex or infinite": lambda s, m, x, v: s.potential(sp.I * x),
    "V: Abs(x) has a kink": lambda s, m, x, v: s.potential(abs(x)),
    "V: floor(x) jumps": lambda s, m, x, v: s.potential(sp.floor(x)),
    "V: atan2(mass, x) has a cut; allowed: 2": lambda s, m, x, v: s.potential(sp.atan2(m, x)),
    "function: gamma(x + 3) cannot be integrated": lambda s, m, x, v: s.potential(sp.gamma(x + 3)),
    "has a coordinate in its exponent": lambda s, m, x, v: s.potential((x + 3) ** x),
    "T: Abs(x_dot) has a kink": lambda s, m, x, v: s.kinetic_energy(abs(v)),
    "T: not quadratic in the velocities (mass*x_dot**2/2 + x_dot**3)": lambda s, m, x, v: s.kinetic_energy(v**3),
    "T: not quadratic in the velocities": lambda s, m, x, v: s.kinetic_energy(v**4),
    "T: I*mass*x_dot**2 is complex": lambda s, m, x, v: s.kinetic_energy(sp.I * m * v**2),
    "T: a_ij is complex or infinite at x": lambda s, m, x, v: s.kinetic_energy(sp.sqrt(x) * m * v**2),
    "T: a_ij is not positive at x": lambda s, m, x, v: s.kinetic_energy(x * m * v**2),
    "T: a_ij is not positive": lambda s, m, x, v: s.kinetic_energy(-m * v**2),
    "R: negative": lambda s, m, x, v: s.dissipation(-5 * v**2),
    "R: not of degree two": lambda s, m, x, v: s.dissipation(v**4),
    "R: unbound symbol k2": lambda s, m, x, v: s.dissipation(sp.Symbol("k2") * v**2),
    "force on x: unbound symbol drive": lambda s, m, x, v: s.force(x, sp.Symbol("drive")),
    "force: mass is no coordinate": lambda s, m, x, v: s.force(m, x),
    "states: beside coordinates": lambda s, m, x, v: s.state("z", bounds=(0, 1)),
    "conserved place: beside coordinates": lambda s, m, x, v: s.conserved(x, "place"),
    "rate: x is no state": lambda s, m, x, v: s.rate(x, x),
    "equilibrium None: allowed: words": lambda s, m, x, v: s.equilibrium(None, {x: 0}),
    "equilibrium rest: None is no place; allowed: {x: place": lambda s, m, x, v: s.equilibrium("rest", None),
    "high: mass is no coordinate or state; allowed: x": lambda s, m, x, v: s.equilibrium("high", {m: 0}),
    "name None is taken or no word": lambda s, m, x, v: s.coordinate(None, bounds=(0, 1)),
    "name ['y'] is taken or no word": lambda s, m, x, v: s.coordinate(["y"], bounds=(0, 1)),
    "size of y: 0; allowed": lambda s, m, x, v: s.coordinate("y", bounds=(-1, 1), size=0),
    "unit of y: None holds 'None'": lambda s, m, x, v: s.coordinate("y", None, bounds=(0, 1)),
    "unit of c: 'Nm-1' holds 'Nm'; allowed": lambda s, m, x, v: s.parameter("c", "Nm-1", default=1),
    "name None is taken": lambda s, m, x, v: s.conserved(x, None),
    "draw: 'dot' is no part of a picture; allowed: mass, body": lambda s, m, x, v: s.draw("dot", [(x, 0)]),
    "y: has a momentum, but T or V contains it": lambda s, m, x, v: s.potential(s.coordinate("y", momentum=m) ** 2),
}


@pytest.mark.parametrize("message", REFUSED)
def test_descriptions_that_are_refused(message):
    system, m, x = bead()
    with pytest.raises(DescriptionError, match=re.escape(message)):
        REFUSED[message](system, m, x, system.velocity(x)), graph(derive(system))


def test_explicit_time_stands_in_forces_and_masses():
    """A pendulum with a shaken pivot and a changing length: Lagrange's equations by hand."""
    system = System("Shaken")
    theta = system.coordinate("theta", "rad", bounds=(-1, 1))
    t, v = system.time, system.velocity(theta)
    length, lift = 2 + cos(t) / 2, cos(3 * t) / 10
    system.particle(1, (length * sin(theta), lift - length * cos(theta)))
    system.potential(9 * (lift - length * cos(theta)))
    derived = derive(system)
    by_hand = -length * sin(theta) * (9 + lift.diff(t, 2)) - 2 * length * length.diff(t) * v
    assert sp.simplify(derived.a[0] - length**2) == 0
    assert sp.simplify(derived.forces[0] - by_hand) == 0
    assert not derived.conservative


def test_gyroscopic_forces_are_not_natural_and_total_derivatives_are():
    system, m, x = bead()
    y = system.coordinate("y", "m", bounds=(-1, 2))
    angle = system.time
    system.particle(m, (x * cos(angle) - y * sin(angle), x * sin(angle) + y * cos(angle)))
    assert not derive(system).natural
    system, m, x = bead()
    system.particle(m, (x + 3 * system.time,))
    system.potential(x**2)
    assert derive(system).V.diff(x) == 2 * x
    assert derive(system).natural


def test_removes_a_coupled_cyclic_coordinate_after_routh():
    # a sliding wedge (cyclic) and a block on it: the block's mass is reduced by the recoil of the wedge
    system = System("Wedge", most=1)
    m, M, p = (system.parameter(n, default=1, positive=True) for n in ("block", "wedge", "momentum"))
    x = system.coordinate("x", "m", bounds=(-1, 2))
    X = system.coordinate("X", "m", momentum=p)
    system.particle(m, (X + x,))
    system.particle(M, (X,))
    system.potential(x**2)
    derived = derive(system)
    assert sp.simplify(derived.a[0] - m * M / (m + M)) == 0
    assert sp.simplify(derived.V - x**2 - p**2 / (2 * (m + M))) == 0


def test_what_only_the_defaults_conserve_is_refused():
    """With births of 0.5 the total grows at 0.5; it was once omitted as a zero mode, and the system called stable."""
    settings = {"conserved": {"total": lambda x, y, births: x + y}, "places": {"empty": [0, 0]}, "births": 0.0}
    system = flow(lambda x, y, births: (y - x + births * x, x - y + births * y), "xy", **settings)
    with pytest.raises(DescriptionError, match="conserved total: its rate of change is"):
        derive(system)


@pytest.mark.parametrize(
    "pulse",
    [
        lambda u: sp.exp(300 * cos(u) - 300),  # no polynomial of degree 300 for SymPy to factor
        lambda u: sp.exp(300.0 * cos(u) - 300),  # 5e-131 exp(300 cos u) is taken for 0
        lambda u: cos(u) ** 3000,
    ],
)
def test_pulses_of_the_kinetic_energy_are_derived_in_a_moment(pulse):
    """By hand: (2 + p(t)) x'' + p' x' + x = 0, and with p(x), (2 + p) x'' + p' x'²/2 + x = 0."""
    for of_time in (True, False):
        system = System("Pulses")
        x = system.coordinate("x", bounds=(-1, 1))
        v, u = system.velocity(x), system.time if of_time else x
        system.kinetic_energy((2 + pulse(u)) * v**2 / 2)
        system.potential(x**2 / 2)
        equations = derive(system)
        by_hand = -x - pulse(u).diff(u) * (v if of_time else v**2 / 2)
        place = {u: sp.Float("0.1", 40), x: sp.Float("0.1", 40), v: sp.Float("0.7", 40)}
        assert equations.forces[0].subs(place).evalf(30) == pytest.approx(by_hand.subs(place).evalf(30), rel=1e-14)
        assert equations.a[0].subs(place).evalf(30) == pytest.approx((2 + pulse(u)).subs(place).evalf(30), rel=1e-14)
