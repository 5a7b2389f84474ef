"""The graph of a system's rates and conserved quantities, for coordinates or states.

The accelerations of a q̈ = f are solved for at each order of their series, or multiplied by a's inverse in symbols if
that makes a long code shorter. Far from equilibria the time is a state of rate 1.
"""

from functools import cache

import sympy as sp

from sweeps.mechanics.equations import Equations, expand_short, simplify
from sweeps.mechanics.graph import ABSOLUTE, FIRST, SECOND, Graph
from sweeps.mechanics.taylor import Code

MAX_INVERTED, MAX_INVERTED_OPERATIONS = 3, 1000  # coordinates and operations up to which a's inverse is tried
SHORT_CODE = 50_000  # characters of a code that compiles within a second: no shorter form is searched


def graph(equations: Equations, near: bool = True) -> Graph:
    """Return the graph of a system's equations, of deviations from an equilibrium or from any place."""
    if not equations.v:
        g = Graph(equations, near)
        g.rates = tuple(g.build_zero(e) for e in equations.f)
        quantities = zip(equations.system.conserved_quantities.values(), equations.second, strict=True) if near else ()
        g.drift_terms = tuple((SECOND if is_quadratic else FIRST, (g.build(e),)) for e, is_quadratic in quantities)
        return _append_rate_of_time(g)
    return (_multiply_by_inverse if _is_shorter_by_inverse(equations) else _solve_by_order)(equations, near)


@cache
def _is_shorter_by_inverse(equations):
    """Return True if the code near equilibria is long, and shorter with a's inverse; the same form is used far away."""
    operations = sum(e.count_ops() for e in (*equations.a, *equations.f))
    if equations.m > MAX_INVERTED or operations > MAX_INVERTED_OPERATIONS:
        return False
    length = len(Code(_solve_by_order(equations)).text)
    return length > SHORT_CODE and len(Code(_multiply_by_inverse(equations)).text) < length


def _solve_by_order(equations, near=True):
    """Return the graph of a q̈ = f whose accelerations are solved for at each order of the Taylor series."""
    g = Graph(equations, near)
    return _set_rates_and_energy(g, g.solve_nodes(equations.a, [g.build_zero(e) for e in equations.forces]))


def _multiply_by_inverse(equations, near=True):
    """Return the graph of a q̈ = f whose accelerations are a⁻¹ f, with a's inverse in symbols."""
    g, m = Graph(equations, near), equations.m
    inverse = equations.a.inv().applyfunc(simplify)
    forces = [g.build_zero(gather_terms(e, equations)) for e in equations.forces]
    rates = []
    for i in range(m):
        pairs = [(g.build(e), force) for e, force in zip(inverse.row(i), forces, strict=True) if e != 0]
        rates.append(g.sum([g.product(*pair) for pair in pairs]))
    return _set_rates_and_energy(g, rates)


def _append_rate_of_time(g):
    """Return the graph after appending the rate 1 of the time, a state far from equilibria."""
    if not g.near:
        g.rates = (*g.rates, g.build(1))
    return g


def _set_rates_and_energy(g, accelerations):
    """Set the graph's rates to (q̇, accelerations) and its conserved energy ½ a q̇q̇ + V; return the graph."""
    equations = g.equations
    g.rates = (*(g.build(x) for x in equations.v), *accelerations)
    if equations.conservative and g.near:
        v = sp.Matrix(equations.v)
        terms = tuple(map(g.build, ((v.T * equations.a * v)[0] / 2, *sp.Add.make_args(expand_short(equations.V)))))
        g.drift_terms = tuple((kind, terms) for kind in (SECOND, ABSOLUTE)[: 1 + equations.natural])
    return _append_rate_of_time(g)


def gather_terms(e: sp.Expr, equations: Equations) -> sp.Expr:
    """Return an expression with few products of states: fractions, then common factors of terms, are factorised.

    Numerators are sums over the parameters' monomials, with factorised coefficients.
    """
    states = {*equations.states}
    fractions: list[sp.Expr] = []
    remaining_terms: list[sp.Expr] = []
    for term in sp.Add.make_args(e):
        is_fraction = sp.fraction(term)[1].free_symbols & states and term.is_rational_function(*equations.states)
        (fractions if is_fraction else remaining_terms).append(term)
    short = []
    for factor in sp.Mul.make_args(sp.factor(sp.Add(*fractions))):
        split = factor.is_Add and equations.parameters and factor.is_polynomial(*equations.parameters)
        terms = sp.Poly(factor, *equations.parameters).terms() if split else ()
        monomials = ((sp.prod(map(sp.Pow, equations.parameters, powers)), x) for powers, x in terms)
        short.append(sp.Add(*(monomial * sp.factor(x) for monomial, x in monomials)) if split else factor)
    return sp.Add(sp.Mul(*short), *remaining_terms)
