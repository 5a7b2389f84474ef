"""Equations of first order from descriptions: their derivation, and refusals before any measurement."""

import numpy as np
import pytest
import sympy as sp
from described import flow, particle

from kernels.flow import codes
from sweeps.mechanics import DescriptionError, System, equilibria
from sweeps.mechanics.derivation import derive
from sweeps.mechanics.equilibria import FAMILY, PROVED
from sweeps.mechanics.model import Model


def free_body(rates=True, **conserved):
    """Euler's equations in their own states."""
    system = System("Free body")
    I1, I2, I3 = (
        system.parameter(f"I{i}", "kg m2", default=v, positive=True) for i, v in enumerate((1.0, 2.0, 3.0), 1)
    )
    w = [system.state(f"w{i}", "rad s-1", bounds=(-2, 2)) for i in (1, 2, 3)]
    for i, (a, b, c) in enumerate(((I1, I2, I3), (I2, I3, I1), (I3, I1, I2))):
        if rates or i:
            system.rate(w[i], (b - c) / a * w[(i + 1) % 3] * w[(i + 2) % 3])
    for name, expression in conserved.items():
        system.conserved(expression(w, (I1, I2, I3)), name)
    system.equilibrium("middle", {w[0]: 0, w[1]: 1, w[2]: 0})
    return system


def energy(w, moments):
    return sum(i * x**2 for i, x in zip(moments, w, strict=True)) / 2


def test_equations_are_those_of_a_hand():
    """In a plane that turns, with a force across the radius: m x¨ = 2 m W y˙ + m W² x - k x - c x˙ - 3 y, and y¨."""
    system = particle(
        lambda x, y, m, k, c, W: k * (x**2 + y**2) / 2,
        "xy",
        R=lambda vx, vy, m, k, c, W: c * (vx**2 + vy**2) / 2,
        forces=lambda x, y, vx, vy, *_: (-3 * y, 3 * x),
        kinetic=lambda x, y, vx, vy, m, k, c, W: m * ((vx - W * y) ** 2 + (vy + W * x) ** 2) / 2 - (vx**2 + vy**2) / 2,
        **{"m": 2.0, "k": 5.0, "c": 0.3, "W": 0.7},
    )
    equations = derive(system)
    assert not equations.natural
    (x, y, vx, vy), (m, k, c, W) = equations.states, equations.parameters
    forces = [
        2 * m * W * vy + m * W**2 * x - k * x - c * vx - 3 * y,
        -2 * m * W * vx + m * W**2 * y - k * y - c * vy + 3 * x,
    ]
    assert [sp.expand(a - b) for a, b in zip(equations.f[2:], forces, strict=True)] == [0, 0]
    assert equations.f[:2] == (vx, vy)
    assert not equations.conservative
    by_hand = sp.Matrix([e / m for e in forces]).jacobian(equations.states)
    assert sp.simplify(equations.a.inv() * equations.slopes - by_hand) == sp.zeros(2, 4)


def test_routhian_terms_stay():
    """Two coordinates and a cyclic one: the gyroscopic force that the oscillators refuse."""
    system = System("Gyro")
    p = system.parameter("momentum", "kg m2 s-1", default=1.0)
    a = system.coordinate("alpha", "rad", bounds=(-1, 1))
    b = system.coordinate("beta", "rad", bounds=(-1, 1))
    spin = system.coordinate("psi", "rad", momentum=p)
    va, vb, vs = (system.velocity(x) for x in (a, b, spin))
    system.kinetic_energy((va**2 * sp.cos(b) ** 2 + vb**2) / 2 + (vs + va * sp.sin(b)) ** 2 / 2)
    system.potential(sp.cos(a) * sp.cos(b))
    system.equilibrium("upright", {a: 0, b: 0})
    equations = derive(system)
    assert equations.conservative
    assert not equations.natural
    slopes = equations.slopes.subs({a: 0, b: 0})
    assert slopes == sp.Matrix([[1, 0, 0, -p], [0, 1, p, 0]])


def test_conserved_quantities_take_their_zeros_out():
    assert Model(free_body()).n == 3
    assert Model(free_body(energy=energy)).n == 2
    momentum = {"momentum": lambda w, moments: sum((i * x) ** 2 for i, x in zip(moments, w, strict=True))}
    assert Model(free_body(energy=energy, **momentum)).n == 2  # their slopes are parallel there


@pytest.mark.slow  # compiling the fit takes as long as many quick tests
@pytest.mark.parametrize("has_name", [True, False])
def test_a_quantity_without_a_slope_takes_no_eigenvalue(has_name):
    """Lotka and Volterra's constant of the motion is least at the equilibrium, with eigenvalues ± i √(a c)."""
    constant = {"V": lambda x, y, a, c: x - c * sp.log(x) + y - a * sp.log(y)}
    settings = {"most": 1, "conserved": constant, "places": {"together": lambda a, c: (c, a)} if has_name else ()}
    system = flow(lambda x, y, a, c: (a * x - x * y, x * y - c * y), "xy", (0.01, 20), **settings, a=0.7, c=1.9)
    model, values = Model(system), np.random.default_rng(1).uniform(0.1, 3.0, (2, 20))
    assert model.n == 2
    points = {"a": np.repeat(values[0], 2), "c": np.repeat(values[1], 2), "eigenvalue": np.tile([1, 2], 20)}
    columns = model.survey(points | {"epsilon": np.full(40, 1e-30), "equilibrium": np.zeros(40, dtype=int)})
    exact = np.sqrt(points["a"] * points["c"]) * np.tile([-1, 1], 20)
    assert (columns["status"] == 0).all()
    assert (np.abs(columns["eigenvalue_real"]) <= columns["eigenvalue_real_error"]).all()
    assert (np.abs(columns["eigenvalue_imag"] - exact) <= columns["eigenvalue_imag_error"]).all()
    assert (columns["eigenvalue_imag_error"] < 1e-12).all()
    assert (columns["regime"] == codes.STABLE).all()  # no symmetry pairs them: that V is definite proves it
    assert (columns["regime_theory"] == codes.STABLE).all()


@pytest.mark.parametrize(
    ("describe", "message"),
    [
        (lambda: free_body(rates=False), "rate of w1: is missing"),
        (lambda: free_body(energy=lambda w, _: w[0] ** 2 + w[1] ** 2), "conserved energy: its rate of change"),
        (lambda: free_body(mass=lambda w, _: w[0] * sp.Symbol("weight")), "conserved mass: unbound symbol weight"),
        (lambda: free_body(mass=lambda w, _: sp.I * w[0]), "conserved mass: .* is complex or infinite"),
        (lambda: free_body(mass=lambda w, _: w[0] / sp.Integer(0)), "conserved mass: .* is complex or infinite"),
        (lambda: free_body(mass=lambda w, _: w[0] * 10**400), "conserved mass: .* is complex or infinite"),
        (lambda: System("Many", most=10**9), "most 1000000000: allowed: a whole number from 1"),
        (lambda: System("Text", most="3"), "most '3': allowed: a whole number from 1"),
        (lambda: System("None").parameter("a", default=float("nan")), "parameter a: default nan is out of range"),
    ],
)
def test_what_is_wrong_with_states_is_named(describe, message):
    with pytest.raises(DescriptionError, match=message):
        derive(describe())


def test_an_equilibrium_is_looked_for_near_its_name():
    """A rough name gives the exact equilibrium; a name without an equilibrium gives none."""
    settings = {"forces": lambda x, v, push: [push], "places": {"leaning": [0.2]}, "push": 0.3}
    system = particle(lambda x, push: x**4 / 4 + x**2 / 2, bounds=(-1, 1), **settings)
    zeros = Model(system).equilibria([np.array([0.3, 0.5, 5.0])])
    root = [np.real(r[np.abs(r.imag) < 1e-9][0]) for r in map(np.roots, ([1, 0, 1, -0.3], [1, 0, 1, -0.5]))]
    np.testing.assert_allclose(zeros.places[:2, 0, 0], root, rtol=1e-14)
    assert np.isnan(zeros.places[2]).all()
    assert (zeros.certified == PROVED).all()


def flow_of(system, **values):
    """Return the landscape of a system of first order and the equilibria of its search."""
    model = Model(system)
    columns = [np.array([values.get(name, p.default)]) for name, p in system.parameters.items()]
    return model.landscape, equilibria.find(model.landscape, columns)


def test_a_family_that_bends_is_followed_where_its_equations_hang_on_each_other():
    """∇A × ∇B = 0 are three equations of a line; off it their slopes are regular, and Newton's method slides along."""

    def rates(x, y, z):
        A, B = x + x**2 + 2 * y**2 - x * z, 2 * x - y**2 / 3 + 3 * z**2 + x * y
        first, second = (sp.Matrix([e.diff(s) for s in (x, y, z)]) for e in (A, B))
        return first.cross(second)

    _, zeros = flow_of(flow(rates, bounds=(-3, 3), places={"middle": [0, 0, 0]}))
    assert zeros.certified[0] == FAMILY
    assert zeros.dimension[0, 0] == 1


def test_families_that_cross_have_the_dimension_of_their_members():
    """x' = x y, y' = 0: from y > 0 motions leave, so the two zeros at the crossing are not a family's own."""
    _, zeros = flow_of(flow(lambda x, y, z: (x * y, 0, -z), bounds=(-2, 2), places={"middle": [0, 0, 0]}))
    assert zeros.dimension[0, 0] == 1


def test_a_family_gives_the_member_nearest_to_its_name_and_its_dimension():
    """Spins about the middle axis at any rate; without a name the family is reported with its direction."""
    _, zeros = flow_of(free_body(energy=energy))
    assert zeros.places[0, 0].tolist() == [0.0, 1.0, 0.0]
    assert zeros.dimension[0, 0] == 1
    assert zeros.certified[0] == FAMILY
    landscape, zeros = flow_of(flow(lambda x, v: (v, -v), "xv", (-1, 2)))
    assert zeros.is_flat.tolist() == [True]
    assert "along x; allowed: a name" in equilibria.refusal(landscape, zeros, [])
