r"""The integrator of equations of first order: the Taylor steps of :mod:`sweeps.mechanics.taylor` for any states.

With x the states' deviations, :math:`x_{n+1} = h f_n/(n+1)`, f_n the n-th term of the rate's node. Rates vanish at the
equilibrium for a reason, so their bases are 0 and not what rounding leaves. Beside `advance` stands `check`, which
writes what each conserved quantity has changed by: :math:`(C - C_0)/\varepsilon`, and of one whose gradient vanishes
at the equilibria, as an energy's, :math:`(C - C_0)/\varepsilon^2`.
"""

import sympy as sp

from kernels.oscillations import ORDER, W
from sweeps.mechanics.flow import Flow
from sweeps.mechanics.graph import Graph, Node, X, solved
from sweeps.mechanics.taylor import Code

HEADER = '''"""{title}: one Taylor step of order {order}, and what is conserved, for {W} lanes."""

from numba import njit

OPTIONS = {{"cache": True, "error_model": "numpy", "fastmath": {{"contract"}}}}
STATES, ROWS = {states}, {rows}
'''


class FlowGraph(Graph):
    """The graph of a flow: `rates`, nodes of ẋ_i, and `quantities`, nodes of what is conserved."""

    rates: tuple[int, ...] = ()
    quantities: tuple[int, ...] = ()

    def _build(self, e):
        if e.is_Symbol and e in self.equations.still:
            return self.add(Node(X, (self.equations.q.index(e),), (), True))
        return super()._build(e)


def graph(flow: Flow) -> FlowGraph:
    """The graph of a flow; accelerations by elimination in a."""
    g = FlowGraph(flow)
    m = flow.rest
    if m:
        masses = {(i, j): g.build(flow.a[i, j]) for i in range(m) for j in range(i, m)}
        forces = [g.sum((g.build(e),), (1.0,), zero=True) for e in flow.f[m:]]
        g.rates = (*(g.build(e) for e in flow.f[:m]), *solved(g, masses, forces))
        g.quantities = (g.build(flow.energy),) if flow.conservative else ()
    else:
        g.rates = tuple(g.sum((g.build(e),), (1.0,), zero=True) for e in flow.f)
        g.quantities = tuple(g.build(e) for e in flow.system.conserved_quantities.values())
    return g


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

    def _function_text(self, head, body, depth):
        used = sorted(self._used, key=lambda key: self.constants[key])
        loads = [f"x{i} = S[{i * W} + lane]" for i in range(self.n)]
        loads += [f"w{k} = S[{row * W} + lane]" for k, row in self.remainders.items()]
        loads += [f"epsilon = S[{self.epsilon_row * W} + lane]", f"h = S[{self.step_row * W} + lane]", "h1 = h"]
        loads += [f"{kind}{k} = S[{self.constants[kind, k] * W} + lane]" for kind, k in used]
        return "\n".join([*head, *("    " * depth + line for line in [*loads, *body])])

    def _text(self):
        step = [*self._step_lines(), *self._sums()]
        head = [
            '@njit("void(float64[::1], int64)", **OPTIONS)',
            "def advance(S, steps):",
            '    """Advance every lane by so many steps."""',
            "    for _ in range(steps):",
            f"        for lane in range({W}):",
        ]
        advance = self._function_text(head, step, 3)
        self._used = set()
        quantities = self._quantity_lines()
        head = [
            '@njit("void(float64[::1])", **OPTIONS)',
            "def check(S):",
            '    """Write the conserved quantities\' deviations."""',
            f"    for lane in range({W}):",
        ]
        check = self._function_text(head, quantities or ["pass"], 2)
        title = self.graph.equations.system.title
        header = HEADER.format(title=title, order=ORDER, W=W, states=self.states, rows=self.rows)
        return "\n\n".join([header, advance + "\n", check + "\n"])


def magnitude(e: sp.Expr) -> sp.Expr:
    """A bound on |e| in which nothing cancels: sums of the absolute values of terms, whatever they are made of."""
    if e.is_Add:
        return sp.Add(*map(magnitude, e.args))
    if e.is_Mul:
        return sp.Mul(*map(magnitude, e.args))
    if e.is_Pow and e.exp.is_Integer and e.exp > 0:
        return magnitude(e.base) ** e.exp
    return sp.Abs(e)
