"""Flows that are spelled with few products."""

import numpy as np
import pytest
import sympy as sp
from described import flow, model_of

from sweeps.mechanics.derivation import derive
from sweeps.mechanics.first_order import graph
from sweeps.mechanics.graph import Values


def value(g, e, numbers, place):
    """Of an expression's node, at a place."""
    number = g.build(e)
    U, _ = Values(g, 8).bases([np.array([numbers[p]]) for p in g.equations.parameters], [np.array([x]) for x in place])
    return U[number][0]


@pytest.mark.slow
def test_a_base_and_its_negative_share_one_inverse_root():
    flow = model_of("foucault").equations
    x, y = flow.states[:2]
    length = next(p for p in flow.parameters if p.name == "length")
    B, g = length**2 - x**2 - y**2, graph(flow)
    numbers = {p: 1.5 for p in flow.parameters}
    place = (0.3, -0.4, 0.0, 0.0)
    for e in (B**-3, (-B) ** -3, (-B) ** -2, B ** sp.Rational(-5, 2), sp.sqrt(B), y / B, x * sp.sqrt(B) ** 3):
        exact = float(e.subs(numbers).subs(dict(zip(flow.states, place, strict=True))))
        assert value(g, e, numbers, place) == pytest.approx(exact, rel=1e-14)
    assert len([k for k in g.nodes if k.kind == "function"]) == 1


def test_a_tangent_beside_its_sine_or_cosine_keeps_every_factor():
    rates = lambda u, v, k: (k * sp.tan(u) * sp.sin(u) + sp.cos(u) * v, sp.tan(u) / sp.cos(u) - v)  # noqa: E731
    system, place = flow(rates, "uv", (-1, 1), k=2.0), (0.3, -0.2)
    g, (k,), (u, v) = graph(derive(system)), (p.symbol for p in system.parameters.values()), system.rates
    for rate in system.rates.values():
        exact = float(rate.subs({k: 2.0, u: place[0], v: place[1]}))
        assert value(g, rate, {k: 2.0}, place) == pytest.approx(exact, rel=1e-14)


def test_terms_of_one_motion_and_of_one_factor_are_multiplied_once():
    system = flow(lambda u, v, w, k, n: [k * u * v + n * u * w + n * u * v - w] * 3, "uvw", (-1, 1), k=2.0, n=2.0)
    (u, v, w), (k, n) = system.rates, (p.symbol for p in system.parameters.values())
    rate = system.rates[u]
    g = graph(derive(system))
    products = [node for node in g.nodes if node.kind == "mul" and all(map(g.depends_on_states, node.operands))]
    assert len(products) == 1  # u (k v + n v + n w) - w
    exact = float(rate.subs({k: 2.0, n: 3.0, u: 0.3, v: -0.2, w: 0.7}))
    assert value(g, rate, {k: 2.0, n: 3.0}, (0.3, -0.2, 0.7)) == pytest.approx(exact, rel=1e-14)
