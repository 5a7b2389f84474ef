"""The rates of a system's states, and what a run watches, as one graph: of coordinates or of states.

Accelerations are solved for, a q̈ = f, at each order of their series, or given by a's inverse in symbols, where that
makes a long code shorter. Far from equilibria the time is a state whose rate is 1.
"""

from functools import cache

import sympy as sp

from sweeps.mechanics.equations import Equations, expanded, simplify
from sweeps.mechanics.graph import ABSOLUTE, FIRST, SECOND, Graph
from sweeps.mechanics.taylor import Code

MOST_INVERTED, MOST_OPERATIONS = 3, 1000  # coordinates, and operations of their equations, up to which a is inverted
SHORT = 50_000  # characters of a code that is compiled in a second: no shorter one is looked for


def graph(equations: Equations, near: bool = True) -> Graph:
    """Return the graph of a system's equations, of deviations from an equilibrium or from any place."""
    if not equations.v:
        g = Graph(equations, near)
        g.rates = tuple(g.vanishing(e) for e in equations.f)
        quantities = zip(equations.system.conserved_quantities.values(), equations.second, strict=True) if near else ()
        g.watched = tuple((SECOND if curved else FIRST, (g.build(e),)) for e, curved in quantities)
        return _timed(g)
    return (_by_inverse if _is_shorter_by_inverse(equations) else _by_order)(equations, near)


@cache
def _is_shorter_by_inverse(equations):
    """Return whether the code near equilibria is long, and shorter by a's inverse; far from them it is the same."""
    operations = sum(e.count_ops() for e in (*equations.a, *equations.f))
    if equations.m > MOST_INVERTED or operations > MOST_OPERATIONS:
        return False
    length = len(Code(_by_order(equations)).text)
    return length > SHORT and len(Code(_by_inverse(equations)).text) < length


def _by_order(equations, near=True):
    g = Graph(equations, near)
    return _closed(g, g.solved(equations.a, [g.vanishing(e) for e in equations.forces]))


def _by_inverse(equations, near=True):
    g, m = Graph(equations, near), equations.m
    inverse = equations.a.inv().applyfunc(simplify)
    forces = [g.vanishing(gathered(e, equations)) for e in equations.forces]
    rates = []
    for i in range(m):
        parts = [(g.build(e), force) for e, force in zip(inverse.row(i), forces, strict=True) if e != 0]
        rates.append(g.sum([g.product(*part) for part in parts]))
    return _closed(g, rates)


def _timed(g):
    if not g.near:
        g.rates = (*g.rates, g.build(1))
    return g


def _closed(g, accelerations):
    equations = g.equations
    g.rates = (*(g.build(x) for x in equations.v), *accelerations)
    if equations.conservative and g.near:
        v = sp.Matrix(equations.v)
        terms = tuple(map(g.build, ((v.T * equations.a * v)[0] / 2, *sp.Add.make_args(expanded(equations.V)))))
        g.watched = tuple((kind, terms) for kind in (SECOND, ABSOLUTE)[: 1 + equations.natural])
    return _timed(g)


def gathered(e: sp.Expr, equations: Equations) -> sp.Expr:
    """Return an expression with few products of states: fractions, then common factors of terms, are factorised.

    Numerators are sums over the parameters' monomials, whose factors are products of sums again.
    """
    moving = {*equations.states}
    fractions, others = [], []
    for term in sp.Add.make_args(e):
        divided = sp.fraction(term)[1].free_symbols & moving and term.is_rational_function(*equations.states)
        (fractions if divided else others).append(term)
    short = []
    for factor in sp.Mul.make_args(sp.factor(sp.Add(*fractions))):
        split = factor.is_Add and equations.parameters and factor.is_polynomial(*equations.parameters)
        terms = sp.Poly(factor, *equations.parameters).terms() if split else ()
        monomials = ((sp.prod(map(sp.Pow, equations.parameters, powers)), x) for powers, x in terms)
        short.append(sp.Add(*(monomial * sp.factor(x) for monomial, x in monomials)) if split else factor)
    return sp.Add(sp.Mul(*short), *others)
