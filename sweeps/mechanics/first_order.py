"""The rates of a system's states, and what a run watches, as one graph: of coordinates or of states.

Accelerations are solved for by elimination in a_ij, whose pivots are positive, or by its inverse in symbols, where that
makes a long code shorter. Far from equilibria the time is a state whose rate is 1.
"""

import sympy as sp

from sweeps.mechanics.equations import Equations, expanded
from sweeps.mechanics.graph import ABSOLUTE, FIRST, SECOND, Graph
from sweeps.mechanics.taylor import Code

MOST_INVERTED, MOST_OPERATIONS = 3, 1000  # coordinates, and operations of their equations, up to which a is inverted
SHORT = 50_000  # characters of a code that is compiled in a second: no shorter one is looked for


def graph(equations: Equations, near: bool = True) -> Graph:
    """Return the graph of a system's equations, of deviations from an equilibrium or from any place."""
    if not equations.v:
        g = Graph(equations, near)
        g.rates = tuple(g.vanishing(e) for e in equations.f)
        if not near:
            return _timed(g)
        quantities = zip(equations.system.conserved_quantities.values(), equations.second, strict=True)
        g.watched = tuple((SECOND if curved else FIRST, (g.build(e),)) for e, curved in quantities)
        return g
    elimination = _by_elimination(equations, near)
    if not near:
        return _timed(elimination)
    length = len(Code(elimination).text)
    operations = sum(e.count_ops() for e in (*equations.a, *equations.f))
    if length <= SHORT or equations.a.shape[0] > MOST_INVERTED or operations > MOST_OPERATIONS:
        return elimination
    other = _by_inverse(equations)
    return other if len(Code(other).text) < length else elimination


def _by_elimination(equations, near=True):
    g, m = Graph(equations, near), equations.m
    masses = {(i, j): g.build(equations.a[i, j]) for i in range(m) for j in range(i, m)}
    forces = [g.vanishing(e) for e in equations.forces]
    return _closed(g, solved(g, masses, forces))


def _by_inverse(equations):
    g, m = Graph(equations), equations.m
    inverse = equations.a.inv().applyfunc(sp.simplify)
    forces = [g.vanishing(gathered(e, equations)) for e in equations.forces]
    rates = []
    for i in range(m):
        parts = [(g.build(e), force) for e, force in zip(inverse.row(i), forces, strict=True) if e != 0]
        rates.append(g.sum([g.product(*part) for part in parts]))
    return _closed(g, rates)


def _timed(g):
    g.rates, g.watched = (*g.rates, g.build(1)), ()
    return g


def _closed(g, accelerations):
    equations = g.equations
    g.rates = (*(g.build(x) for x in equations.v), *accelerations)
    if equations.conservative:
        v = sp.Matrix(equations.v)
        terms = tuple(map(g.build, ((v.T * equations.a * v)[0] / 2, *sp.Add.make_args(expanded(equations.V)))))
        g.watched = tuple((kind, terms) for kind in (SECOND, ABSOLUTE)[: 1 + equations.natural])
    return g


def solved(g: Graph, a: dict, right: list[int]) -> list[int]:
    """Return the nodes of a⁻¹ right, by elimination without pivoting: a is symmetric and positive definite."""
    n = len(right)
    for k in range(n):
        for i in range(k + 1, n):
            if g.nodes[a[k, i]].zero:
                continue
            factor = g.quotient(a[k, i], a[k, k])
            for j in range(i, n):
                if not g.nodes[a[k, j]].zero:
                    a[i, j] = g.sum((a[i, j], g.product(factor, a[k, j])), (1.0, -1.0))
            right[i] = g.sum((right[i], g.product(factor, right[k])), (1.0, -1.0))
    solution = [0] * n
    for i in reversed(range(n)):
        rest = right[i]
        for j in range(i + 1, n):
            if not g.nodes[a[i, j]].zero:
                rest = g.sum((rest, g.product(a[i, j], solution[j])), (1.0, -1.0))
        solution[i] = g.quotient(rest, a[i, i])
    return solution


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
    return _in_common(sp.Add(sp.Mul(*short), *others), moving)


def _in_common(e, moving):
    """Return a sum in which the factor that most terms share stands outside, and so on."""
    terms = sp.Add.make_args(e)
    powers = [term.as_powers_dict().items() for term in terms]
    factors = [{x for x, k in factors_of_term if x in moving and k.is_Integer and k > 0} for factors_of_term in powers]
    counts = {x: sum(x in f for f in factors) for x in sorted(moving, key=str)}
    most = max(counts, key=counts.get, default=None)
    if most is None or counts[most] < 2:
        return e
    inside = sp.Add(*(term / most for term, f in zip(terms, factors, strict=True) if most in f))
    outside = sp.Add(*(term for term, f in zip(terms, factors, strict=True) if most not in f))
    return sp.Mul(most, _in_common(inside, moving), evaluate=False) + _in_common(outside, moving)
