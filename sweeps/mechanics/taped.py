"""Code of a large system: its graph as a tape that `kernels.taylor_tapes` reads.

Written out it would be compiled for minutes. The tape grows with the graph alone, and the module that holds it is
compiled in two seconds, whatever its size.
"""

from kernels import taylor_tapes as kernel
from sweeps.mechanics.graph import ADD, CONSTANT, DIV, FUNCTION, MUL, X
from sweeps.mechanics.taylor import Code

MODULE_SECONDS = 2.0
SAMPLES_TIMES_NODES = 5_000_000

TEXT = '''"""{title}: a tape of Taylor steps, and of what is conserved."""

import numpy as np

from kernels import taylor_tapes
from kernels.jit import PASSED, njit

STATES, ROWS = {states}, {rows}
TABLES

@njit("void(float64[::1], int64)", **PASSED)
def advance(S, steps):
    """Advance every lane by so many steps."""
    taylor_tapes.advance(STEP, STEP_PARTS, STEP_WEIGHTS, RATES, STATES, S, steps)


@njit("void(float64[::1])", **PASSED)
def check(S):
    """Write the conserved quantities' deviations."""
    taylor_tapes.check(CHECK, CHECK_PARTS, CHECK_WEIGHTS, WATCHED, STATES, S)
'''
FAR_TEXT = '''"""{title}: a tape of Taylor series."""

import numpy as np

from kernels import taylor_tapes
from kernels.jit import PASSED, njit

STATES, ROWS = {states}, {rows}
TABLES

@njit("void(float64[::1])", **PASSED)
def expand(S):
    """Write the terms of every lane's series."""
    taylor_tapes.expand(STEP, STEP_PARTS, STEP_WEIGHTS, RATES, (STATES, ROWS, {order}), S)
'''
CODES = {CONSTANT: kernel.CONSTANT, X: kernel.STATE, ADD: kernel.SUM, MUL: kernel.PRODUCT, DIV: kernel.QUOTIENT}


class TapedCode(Code):
    """Rows of the scratch array as of `Code`, and a module that holds the tape."""

    kernels = ("taylor_tapes",)

    @property
    def compile_seconds(self) -> float:
        """Return about how long its module takes to compile, s."""
        return MODULE_SECONDS

    @property
    def samples_per_second(self) -> int:
        """Samples of runs, of six motions each, that one core makes in a second, about."""
        return SAMPLES_TIMES_NODES // len(self.graph.nodes)

    def _text(self):
        functions, g = self.graph.functions, self.graph
        last = set(self._needed([g.nodes[f].parts[0] for f in functions], slopes=False))
        slots, tables = self._tables("STEP", self._needed([*g.rates, *functions]), last)
        rates = [[slots[k] if g.moves(k) else -1, -1 if g.near else self._base_row(k)] for k in g.rates]
        tables += [_table("RATES", rates, 2)]
        if not g.near:
            return self._header(FAR_TEXT).replace("TABLES", "\n".join(tables))
        checked = self._needed([k for _, terms in g.watched for k in terms], slopes=False)
        slots, more = self._tables("CHECK", checked, set())
        watched = [[row, kind, slots.get(k, -1)] for row, (kind, terms) in enumerate(g.watched) for k in terms]
        tables = "\n".join([*tables, *more, _table("WATCHED", watched, 3)])
        return self._header(TEXT).replace("TABLES", tables)

    def _tables(self, name, nodes, last):
        """Return row of the tape of each node, and the text of the tape."""
        nodes = sorted({*nodes, *(k for number in nodes for k in self._added(self.graph.nodes[number]))})
        slots, parts, weights, rows = {k: row for row, k in enumerate(nodes)}, [], [], []
        for number in nodes:
            node, row = self.graph.nodes[number], [-1] * kernel.COLUMNS
            row[kernel.CODE] = CODES.get(node.kind, kernel.FUNCTION)
            row[kernel.LAST] = int(number in last or node.kind == CONSTANT)
            if node.kind == ADD:
                pairs = [(slots[k], w) for w, k in zip(node.weights, node.parts, strict=True) if k in slots]
                row[kernel.FIRST], row[kernel.SECOND] = len(parts), len(parts) + len(pairs)
                parts, weights = parts + [k for k, _ in pairs], weights + [w for _, w in pairs]
            elif node.kind == X:
                (row[kernel.FIRST],) = node.parts
            elif node.kind == CONSTANT:
                row[kernel.OWN] = self._base_row(number)
            elif node.kind == FUNCTION:
                self._function_row(number, node, row, slots)
            else:
                self._pair_row(number, node, row, slots)
            rows.append(row)
        tables = [_table(name, rows, kernel.COLUMNS), _table(f"{name}_PARTS", parts)]
        return slots, [*tables, _table(f"{name}_WEIGHTS", weights, dtype="float64")]

    def _added(self, node):
        """Return the constants that a node adds or divides: far from equilibria they have rows of their own."""
        parts = {ADD: node.parts, DIV: node.parts[:1]}.get(node.kind, ())
        return [k for k in parts if not (self.graph.near or self.graph.moves(k))]

    def _function_row(self, number, node, row, slots):
        row[kernel.FIRST], row[kernel.SLOPE] = slots[node.parts[0]], slots.get(self.graph.slopes[number], -1)
        row[kernel.REMAINDER] = self.remainders[number]
        row[kernel.OWN] = self._row_of("F", number) if self.graph.near else -1

    def _pair_row(self, number, node, row, slots):
        first, second = node.parts
        added = self._added(node)
        for at, k in ((kernel.FIRST, first), (kernel.SECOND, second)):
            row[at] = slots[k] if self.graph.moves(k) or k in added else -1
        row[kernel.BASE1], row[kernel.BASE2] = self._base_row(first), self._base_row(second)
        row[kernel.OWN] = self._base_row(number) if node.kind == DIV else -1

    def _base_row(self, number):
        """Return row of a node's value where deviations are from; -1 where that is 0."""
        return -1 if self._is_unbased(number) else self._row_of("U", number)

    def _row_of(self, kind, number):
        self._constant(kind, number)
        return self.constants[kind, number]


def _table(name, values, columns=0, dtype="int64"):
    shape = f".reshape(-1, {columns})" if columns else ""
    return f"{name} = np.array({values!r}, dtype=np.{dtype}){shape}"
