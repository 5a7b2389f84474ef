"""Equations of first order from descriptions: what is derived, and what is refused, each before any work."""

import numpy as np
import pytest
import sympy as sp

from sweeps.mechanics import DescriptionError, System
from sweeps.mechanics.flow import derive, is_flow
from sweeps.mechanics.relative import FlowModel as Model


def turning():
    """A particle in a plane that turns, with drag in the plane and a force that follows the radius."""
    system = System("Turning plane")
    m = system.parameter("mass", "kg", default=2.0, positive=True)
    k = system.parameter("stiffness", "N m-1", default=5.0)
    c = system.parameter("drag", "kg s-1", default=0.3, positive=True)
    W = system.parameter("spin_rate", "rad s-1", default=0.7)
    x = system.coordinate("x", "m", bounds=(-1, 1))
    y = system.coordinate("y", "m", bounds=(-1, 1))
    vx, vy = system.velocity(x), system.velocity(y)
    system.kinetic_energy(m * ((vx - W * y) ** 2 + (vy + W * x) ** 2) / 2)
    system.potential(k * (x**2 + y**2) / 2)
    system.dissipation(c * (vx**2 + vy**2) / 2)
    system.force({x: -3 * y, y: 3 * x})
    system.equilibrium("centre", {x: 0, y: 0})
    return system, (m, k, c, W), (x, y, vx, vy)


def spinning(rates=True, **conserved):
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
    """m x¨ = 2 m W y˙ + m W² x - k x - c x˙ - 3 y, and its twin."""
    system, (m, k, c, W), (x, y, vx, vy) = turning()
    flow = derive(system)
    assert is_flow(system)
    assert flow.q == (x, y, vx, vy)
    forces = [
        2 * m * W * vy + m * W**2 * x - k * x - c * vx - 3 * y,
        -2 * m * W * vx + m * W**2 * y - k * y - c * vy + 3 * x,
    ]
    assert [sp.expand(a - b) for a, b in zip(flow.f[2:], forces, strict=True)] == [0, 0]
    assert flow.f[:2] == (vx, vy)
    assert not flow.conservative
    by_hand = sp.Matrix([*flow.f[:2], *(e / m for e in forces)]).jacobian(flow.q)
    assert sp.simplify(flow.jacobian - by_hand) == sp.zeros(4)


def test_routhian_terms_stay():
    """Two coordinates beside a cyclic one: the gyroscopic force that the oscillators refuse."""
    system = System("Gyro")
    p = system.parameter("momentum", "kg m2 s-1", default=1.0)
    a = system.coordinate("alpha", "rad", bounds=(-1, 1))
    b = system.coordinate("beta", "rad", bounds=(-1, 1))
    spin = system.coordinate("psi", "rad", momentum=p)
    va, vb, vs = (system.velocity(x) for x in (a, b, spin))
    system.kinetic_energy((va**2 * sp.cos(b) ** 2 + vb**2) / 2 + (vs + va * sp.sin(b)) ** 2 / 2)
    system.potential(sp.cos(a) * sp.cos(b))
    system.equilibrium("upright", {a: 0, b: 0})
    assert is_flow(system)
    flow = derive(system)
    assert flow.conservative
    slopes = flow.slopes.subs({a: 0, b: 0})
    assert slopes == sp.Matrix([[1, 0, 0, -p], [0, 1, p, 0]])


def test_oscillators_stay_oscillators():
    system = System("Pendulum")
    length = system.parameter("length", "m", default=1.0, positive=True)
    theta = system.coordinate("theta", "rad", bounds=(-sp.pi, sp.pi), periodic=True)
    system.particle(1, (length * sp.sin(theta), -length * sp.cos(theta)))
    system.potential(-length * sp.cos(theta))
    assert not is_flow(system)


def test_conserved_quantities_take_their_zeros_out():
    assert Model(spinning()).n == 3
    assert Model(spinning(energy=energy)).n == 2
    momentum = {"momentum": lambda w, moments: sum((i * x) ** 2 for i, x in zip(moments, w, strict=True))}
    assert Model(spinning(energy=energy, **momentum)).n == 2  # their slopes are parallel there


@pytest.mark.parametrize(
    ("made", "told"),
    [
        (lambda: spinning(rates=False), "rate of w1: is missing"),
        (lambda: spinning(energy=lambda w, _: w[0] ** 2 + w[1] ** 2), "conserved energy: its rate of change"),
        (lambda: spinning(mass=lambda w, _: w[0] * sp.Symbol("weight")), "conserved mass: unbound symbol weight"),
        (lambda: spinning(mass=lambda w, _: sp.I * w[0]), "conserved mass: .* is complex or infinite"),
        (lambda: spinning(mass=lambda w, _: w[0] / sp.Integer(0)), "conserved mass: .* is complex or infinite"),
    ],
)
def test_what_is_wrong_with_states_is_named(made, told):
    with pytest.raises(DescriptionError, match=told):
        derive(made())


def refusal(change):
    system, (m, _, c, _), (x, y, vx, vy) = turning()

    def made():
        change(system, m, c, x, y, vx, vy)
        derive(system)

    with pytest.raises(DescriptionError, match="allowed") as refused:
        made()
    return str(refused.value)


def test_what_is_wrong_with_coordinates_is_named():
    assert "not quadratic" in refusal(lambda s, m, c, x, y, vx, vy: s.kinetic_energy(vx**3))
    assert "R: negative" in refusal(lambda s, m, c, x, y, vx, vy: s.dissipation(-5 * vx**2))
    assert "R: not of degree two" in refusal(lambda s, m, c, x, y, vx, vy: s.dissipation(vx**4))
    assert "R: unbound symbol k2" in refusal(lambda s, m, c, x, y, vx, vy: s.dissipation(sp.Symbol("k2") * vx**2))
    assert "force on x: unbound" in refusal(lambda s, m, c, x, y, vx, vy: s.force({x: sp.Symbol("drive")}))
    assert "is no coordinate" in refusal(lambda s, m, c, x, y, vx, vy: s.force({c: x}))
    assert "beside coordinates" in refusal(lambda s, m, c, x, y, vx, vy: s.state("z", bounds=(0, 1)))
    assert "beside coordinates" in refusal(lambda s, m, c, x, y, vx, vy: s.conserved(x, "place"))
    assert "rate" in refusal(lambda s, m, c, x, y, vx, vy: s.rate(x, y))


def test_a_pivot_that_is_shaken_is_refused_and_told_what_is_possible():
    system = System("Shaken")
    system.parameter("length", "m", default=1.0, positive=True)
    theta = system.coordinate("theta", "rad", bounds=(-1, 1))
    lift = sp.cos(3 * system.time) / 10
    system.particle(1, (sp.sin(theta), -sp.cos(theta) + lift))
    system.dissipation(system.velocity(theta) ** 2)
    with pytest.raises(DescriptionError, match="a frame that turns steadily"):
        derive(system)


def test_an_equilibrium_is_looked_for_near_its_name():
    """Named roughly, found exactly; one that is not there is not made up."""
    system = System("Wind")
    g = system.parameter("push", "N", default=0.3)
    x = system.coordinate("x", "m", bounds=(-1, 1))
    system.kinetic_energy(system.velocity(x) ** 2 / 2)
    system.potential(x**4 / 4 + x**2 / 2)
    system.force({x: g})
    system.equilibrium("leaning", {x: 0.2})
    found = Model(system).equilibria([np.array([0.3, 0.5, 5.0])])
    root = [np.real(r[np.abs(r.imag) < 1e-9][0]) for r in map(np.roots, ([1, 0, 1, -0.3], [1, 0, 1, -0.5]))]
    np.testing.assert_allclose(found[:2, 0, 0], root, rtol=1e-14)
    assert np.isnan(found[2]).all()
