r"""The integrator of equations of first order: the Taylor steps of :mod:`sweeps.mechanics.taylor` for any states.

With x the states' deviations, :math:`x_{n+1} = h f_n/(n+1)`, f_n the n-th term of the rate's node. Rates vanish at the
equilibrium for a reason, so their bases are 0 and not what rounding leaves. Beside `advance` stands `check`, which
writes what each conserved quantity has changed by: :math:`(C - C_0)/\varepsilon`, and of one whose gradient vanishes
at the equilibria, as an energy's, :math:`(C - C_0)/\varepsilon^2`.
"""

import sympy as sp

from kernels.oscillations import ORDER, W
from sweeps.mechanics.flow import Flow
from sweeps.mechanics.graph import MOST_POWER, Graph, Node, X, solved
from sweeps.mechanics.taylor import ADVANCE, TOLD, Code

HEADER = '''"""{title}: one Taylor step of order {order}, and what is conserved, for {W} lanes."""

from kernels.jit import PASSED, njit
from kernels.straight import lines

STATES, ROWS = {states}, {rows}
'''

MOST_INVERTED, MOST_WRITTEN = 3, 1000  # coordinates, and operations of their equations, up to which a is inverted


class FlowGraph(Graph):
    """The graph of a flow: `rates`, nodes of ẋ_i, and `quantities`, nodes of what is conserved.

    It spells with few products of series: with :math:`d = B^{-1/2}`, where that occurs, every inverse power of B is one
    of d, whose slope is -d³/2; in products tan u is sin u / cos u where these occur; and a product is divided factor by
    factor, the longest one first, so that what has the same divisor is divided once.
    """

    rates: tuple[int, ...] = ()
    quantities: tuple[int, ...] = ()

    def __post_init__(self):
        super().__post_init__()
        spelled = sp.Tuple(*self.equations.f, self.equations.V, *self.equations.system.conserved_quantities.values())
        self._roots = {p.base for p in spelled.atoms(sp.Pow) if p.exp.is_Rational and p.exp.q == 2 and p.exp < 0}
        self._turns = {e.args[0] for e in spelled.atoms(sp.sin, sp.cos)}

    def _build(self, e):
        if e.is_Symbol and e in self.equations.still:
            return self.add(Node(X, (self.equations.q.index(e),), (), True))
        return super()._build(e)

    def _product(self, e):
        moving = {*self.equations.q}
        turned = {sp.tan(u): sp.sin(u) / sp.cos(u) for u in self._turns}
        factors = [part for f in e.args for part in sp.Mul.make_args(turned.get(f, f))]
        fixed = [f for f in factors if not f.free_symbols & moving]
        moved = [f for f in factors if f.free_symbols & moving]  # of which tan u may leave one twice
        above, below = [], []
        for factor in sorted(moved, key=lambda f: (-f.count_ops(), str(f))):
            base, exponent = factor.as_base_exp()
            divides = exponent.is_Integer and exponent < 0 and self._root(base) is None
            (below if divides else above).append(1 / factor if divides else factor)
        result = self.build(above[0]) if above else self.constant(sp.Integer(1))
        for factor in below:
            result = self.quotient(result, self.build(factor))
        for factor in above[1:]:
            result = self.product(result, self.build(factor))
        return self.product(self.build(sp.Mul(*fixed)), result) if fixed else result

    def _root(self, base):
        """(B, sign) of a base that is ±B, B one whose inverse root occurs; None of another."""
        for root in self._roots if base.free_symbols & {*self.equations.q} else ():
            for sign in (1, -1):
                if sp.expand(root - sign * base) == 0:
                    return root, sign
        return None

    def _power(self, base, exponent):
        found = self._root(base) if exponent.is_Rational and (exponent.q == 2 or exponent < 0) else None
        if found is None or exponent.q > 2 or abs(exponent) > MOST_POWER:
            return super()._power(base, exponent)
        (B, sign), whole = found, exponent.q == 1
        e = B ** sp.Rational(-1, 2)
        d = self._expressions[e] if e in self._expressions else self._function(e, B)
        if exponent == e.exp:
            return d
        if exponent > 0:
            return self.product(d, self._whole(self.build(B), int(exponent + sp.Rational(1, 2))))
        power = self._whole(self.product(d, d), int(-exponent))
        if whole:
            return power if sign ** int(exponent) == 1 else self.sum((power,), (-1.0,))
        return self.product(d, power)

    def _whole(self, number, exponent):
        """A node's power."""
        if exponent == 1:
            return number
        half = self._whole(number, exponent // 2)
        square = self.product(half, half)
        return self.product(square, number) if exponent % 2 else square

    def _slope(self, e, f, u, argument, number, inner):
        if e.is_Pow and e.base in self._roots:
            return self.product(self.constant(sp.Rational(-1, 2)), self.product(number, self.product(number, number)))
        return super()._slope(e, f, u, argument, number, inner)


def graph(flow: Flow) -> FlowGraph:
    """The graph of a flow; accelerations by elimination in a or, where that is shorter, by a's inverse in symbols."""
    if not flow.rest:
        g = FlowGraph(flow)
        g.rates = tuple(g.sum((g.build(e),), (1.0,), zero=True) for e in flow.f)
        g.quantities = tuple(g.build(e) for e in flow.system.conserved_quantities.values())
        return g
    found = [_by_elimination(flow)]
    if flow.a.shape[0] <= MOST_INVERTED and sum(e.count_ops() for e in (*flow.a, *flow.f)) <= MOST_WRITTEN:
        found.append(_by_inverse(flow))
    return min(found, key=lambda g: len(FlowCode(g).text))


def _by_elimination(flow):
    g, m = FlowGraph(flow), flow.rest
    masses = {(i, j): g.build(flow.a[i, j]) for i in range(m) for j in range(i, m)}
    forces = [g.sum((g.build(e),), (1.0,), zero=True) for e in flow.f[m:]]
    return _closed(g, solved(g, masses, forces))


def _by_inverse(flow):
    g, m = FlowGraph(flow), flow.rest
    inverse = flow.a.inv().applyfunc(sp.simplify)
    forces = [g.sum((g.build(gathered(e, flow)),), (1.0,), zero=True) for e in flow.f[m:]]
    rates = []
    for i in range(m):
        parts = [(g.build(e), force) for e, force in zip(inverse.row(i), forces, strict=True) if e != 0]
        rates.append(g.sum([g.product(*part) for part in parts]))
    return _closed(g, rates)


def _closed(g, accelerations):
    flow = g.equations
    g.rates = (*(g.build(e) for e in flow.f[: flow.rest]), *accelerations)
    g.quantities = (g.build(flow.energy),) if flow.conservative else ()
    return g


def gathered(e: sp.Expr, flow: Flow) -> sp.Expr:
    """An expression with few products of what moves: fractions factorised together, then what terms have in common.

    Numerators are sums over the parameters' monomials, whose factors are products of sums again.
    """
    moving = {*flow.q}
    fractions, others = [], []
    for term in sp.Add.make_args(e):
        divided = sp.fraction(term)[1].free_symbols & moving and term.is_rational_function(*flow.q)
        (fractions if divided else others).append(term)
    short = []
    for factor in sp.Mul.make_args(sp.factor(sp.Add(*fractions))):
        split = factor.is_Add and flow.parameters and factor.is_polynomial(*flow.parameters)
        terms = sp.Poly(factor, *flow.parameters).terms() if split else ()
        monomials = ((sp.prod(map(sp.Pow, flow.parameters, powers)), x) for powers, x in terms)
        short.append(sp.Add(*(monomial * sp.factor(x) for monomial, x in monomials)) if split else factor)
    return _in_common(sp.Add(sp.Mul(*short), *others), moving)


def _in_common(e, moving):
    """A sum in which the factor that most terms share stands outside, and so on."""
    terms = sp.Add.make_args(e)
    factors = [{x for x in term.as_powers_dict() if x in moving} for term in terms]
    counts = {x: sum(x in f for f in factors) for x in sorted(moving, key=str)}
    most = max(counts, key=counts.get, default=None)
    if most is None or counts[most] < 2:
        return e
    inside = sp.Add(*(term / most for term, f in zip(terms, factors, strict=True) if most in f))
    outside = sp.Add(*(term for term, f in zip(terms, factors, strict=True) if most not in f))
    return sp.Mul(most, _in_common(inside, moving), evaluate=False) + _in_common(outside, moving)


class FlowCode(Code):
    """Rows and text of a flow's module.

    Rows, each W long: states, functions' remainders, epsilon, the step, the quantities, and what is constant.

    Args:
        graph: the flow's graph.
    """

    def __init__(self, graph: FlowGraph):
        self.graph = graph
        self.n = graph.equations.n
        self.remainders = {number: self.n + k for k, number in enumerate(graph.functions)}
        self.states = self.n + len(self.remainders)
        self.epsilon_row, self.step_row = self.states, self.states + 1
        self.quantities = len(graph.quantities)
        self.constants: dict[tuple[str, int], int] = {}
        self._used: set = set()
        self.text = self._text()

    @property
    def rows(self) -> int:
        """Number of rows of the scratch array."""
        return self.states + 2 + self.quantities + len(self.constants)

    @property
    def name(self) -> str:
        """Name of the module."""
        return f"flow_{self.digest[:24]}"

    def _constant(self, kind, number):
        self.constants.setdefault((kind, number), self.states + 2 + self.quantities + len(self.constants))
        self._used.add((kind, number))
        return f"{kind}{number}"

    def _state_term(self, node, n):
        (i,) = node.parts
        return f"x{i}" if n == 0 else self._rate(X, i, n)

    def _rate(self, kind, i, n):
        rate = self._hat(self.graph.rates[i], n - 1)
        return f"h{n} * {rate}" if rate else "0.0"

    def _step_lines(self):
        functions = self.graph.functions
        nodes = self._needed([*self.graph.rates, *functions])
        last = self._inner([self.graph.nodes[f].parts[0] for f in functions])
        lines = [f"h{n} = h * {1.0 / n!r}" for n in range(2, ORDER + 1)]
        for n in range(ORDER + 1):
            if n:
                lines += [f"x{i}_{n} = {self._rate(X, i, n)}" for i in range(self.n)]
            for number in last if n == ORDER else nodes:
                node = self.graph.nodes[number]
                if node.kind == X and n:
                    lines.append(f"u{number}_{n} = x{node.parts[0]}_{n}")
                else:
                    lines += self._term(number, n)
        for number in functions:
            if number not in last:
                lines.append(f"w{number}_{ORDER} = {self._remainder(number, self.graph.nodes[number].parts[0], ORDER)}")
        return lines

    def _sums(self):
        names = [f"x{i}" for i in range(self.n)] + [f"w{k}" for k in self.remainders]
        for name, row in zip(names, [*range(self.n), *self.remainders.values()], strict=True):
            text = f"{name}_{ORDER}"
            for n in reversed(range(1, ORDER)):
                text = f"({text} + {name}_{n})"
            yield f"S[{row * W} + lane] = {text} + {name + '_0' if name[0] == 'w' else name}"

    def _quantity_lines(self):
        """The conserved quantities' deviations: of first order, of an energy of second."""
        flow, quantities = self.graph.equations, self.graph.quantities
        second = (True,) * len(quantities) if flow.rest else flow.second
        lines = []
        for number in self._inner(quantities):
            lines += self._term(number, 0)
        for number in self._inner([k for k, curved in zip(quantities, second, strict=True) if curved]):
            lines.append(f"t{number} = {self._second(number)}")
        for k, (number, curved) in enumerate(zip(quantities, second, strict=True)):
            told = (f"t{number}" if curved else self._hat(number, 0)) if self.graph.moves(number) else "0.0"
            lines.append(f"S[{(self.states + 2 + k) * W} + lane] = {told}")
        return lines

    def _loads(self):
        used = sorted(self._used, key=lambda key: self.constants[key])
        loads = [f"x{i} = S[{i * W} + lane]" for i in range(self.n)]
        loads += [f"w{k} = S[{row * W} + lane]" for k, row in self.remainders.items()]
        loads += [f"epsilon = S[{self.epsilon_row * W} + lane]", f"h = S[{self.step_row * W} + lane]", "h1 = h"]
        return loads + [f"{kind}{k} = S[{self.constants[kind, k] * W} + lane]" for kind, k in used]

    def _text(self):
        advance = ADVANCE.format(lines=self._straight([*self._step_lines(), *self._sums()]), W=W)
        self._used = set()
        what = "the conserved quantities' deviations"
        check = TOLD.format(lines=self._straight(self._quantity_lines()), name="check", what=what, W=W)
        title = self.graph.equations.system.title
        header = HEADER.format(title=title, order=ORDER, W=W, states=self.states, rows=self.rows)
        return "\n\n".join([header, advance, check])


def magnitude(e: sp.Expr) -> sp.Expr:
    """A bound on |e| in which nothing cancels: sums of the absolute values of terms, whatever they are made of."""
    if e.is_Add:
        return sp.Add(*map(magnitude, e.args))
    if e.is_Mul:
        return sp.Mul(*map(magnitude, e.args))
    if e.is_Pow and e.exp.is_Integer and e.exp > 0:
        return magnitude(e.base) ** e.exp
    return sp.Abs(e)
