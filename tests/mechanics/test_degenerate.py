"""Frequencies about degenerate equilibria against the motion's own period, by SciPy."""

import math

import numpy as np
import pytest
import sympy as sp
from described import particle
from scipy.integrate import quad, solve_ivp

from sweeps.mechanics.degenerate import CONFINING_ORDERS, Degenerate, quarter_integral
from sweeps.mechanics.derivation import derive


def equations_of(V, inertia=lambda x: 1):
    system = particle(V, bounds=(-2, 2), most=3, kinetic=lambda x, v: (inertia(x) - 1) * v**2 / 2)
    return derive(system)


def oscillations(V, x, v=0.0, place=0.0, inertia=lambda x: 1):
    equations = equations_of(V, inertia)
    x, v, place = (np.atleast_1d(np.asarray(y, dtype=float)) for y in (x, v, place))
    values = [np.zeros(x.size)] * len(equations.parameters)
    return Degenerate(equations).oscillations(values, np.broadcast_to(place, x.shape), x, np.broadcast_to(v, x.shape))


@pytest.mark.parametrize("m", [2, *CONFINING_ORDERS])
def test_the_quarter_of_a_period_is_the_integral(m):
    # u = 1 - w² takes the root at the end away
    integral, _ = quad(
        lambda w: 2 * w / math.sqrt(-math.expm1(m * math.log1p(-w * w))) if w else 2 / math.sqrt(m), 0, 1
    )
    assert quarter_integral(m) == pytest.approx(integral, rel=1e-9)


POTENTIALS = {
    "x⁴": (lambda x: 3 * x**4, 4),
    "x⁶": (lambda x: x**6, 6),
    "x¹⁰": (lambda x: x**10 / 7, 10),
    "x⁴ + x⁶": (lambda x: x**4 + 2 * x**6, 4),
    "x⁴ − x⁵": (lambda x: x**4 - x**5, 4),
    "cosh": (lambda x: sp.cosh(x) - x**2 / 2, 4),
}


@pytest.mark.parametrize("name", POTENTIALS)
@pytest.mark.parametrize(("x", "v"), [(0.05, 0.0), (0.03, 1e-3), (0.01, -1e-4)])
def test_frequencies_are_those_of_the_motion(name, x, v):
    V, order = POTENTIALS[name]
    theory = oscillations(V, x, v)
    equations = equations_of(V)
    force = sp.lambdify(equations.q, -equations.gradient[0], "math")

    def crosses(_, y):
        return y[0]

    guess = 2 * math.pi / theory["degenerate_frequency"][0]
    times = (0, 2.2 * guess)
    settings = {"events": crosses, "method": "DOP853", "rtol": 1e-10, "atol": 1e-11 * x / np.array([1.0, guess])}
    motion = solve_ivp(lambda t, y: [y[1], force(y[0])], times, [x, v], **settings)
    period = motion.t_events[0][2] - motion.t_events[0][0]
    assert theory["degenerate_order"] == [order]
    deviation = abs(theory["degenerate_frequency"][0] - 2 * math.pi / period)
    assert deviation <= theory["degenerate_frequency_error"][0] + 1e-7 / period  # SciPy's own


def test_a_mass_that_changes_is_in_the_error():
    theory = oscillations(lambda x: x**4, 0.1, inertia=lambda x: 2 * (1 + x) ** 2)
    exact = (  # half the period, ∫ √(a/2(E − V)) dx with x = A sin t
        quad(lambda t: math.cos(t) * (1 + 0.1 * math.sin(t)) * 0.1 / math.sqrt(1e-4 - (0.1 * math.sin(t)) ** 4),
             -math.pi / 2 + 1e-9, math.pi / 2 - 1e-9, limit=200)[0]
    )  # fmt: skip
    assert abs(theory["degenerate_frequency"][0] - math.pi / exact) <= theory["degenerate_frequency_error"][0]


def test_half_the_nudge_is_half_the_frequency_about_a_quartic_and_nothing_else_has_one():
    theory = oscillations(lambda x: x**4, [1e-3, 5e-4, 1e-6])["degenerate_frequency"]
    assert theory[0] / theory == pytest.approx([1, 2, 1000], rel=1e-13)
    for V in (lambda x: x**3, lambda x: -(x**4), lambda x: x**2 + x**4, lambda x: x**5 + x**6, lambda x: 0 * x):
        none = oscillations(V, 1e-3)
        assert none["degenerate_order"] == [0]
        assert np.isnan(none["degenerate_frequency"]).all()


def test_a_place_that_is_off_by_a_rounding_changes_nothing_it_could_not():
    theory = oscillations(lambda x: x**4, 1e-6, place=1e-12)
    exact = oscillations(lambda x: x**4, 1e-6)
    deviation = np.abs(theory["degenerate_frequency"] - exact["degenerate_frequency"])
    assert (deviation <= theory["degenerate_frequency_error"]).all()
    assert (theory["degenerate_order"] == 4).all()
