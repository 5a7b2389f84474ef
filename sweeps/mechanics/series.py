r"""Power series of motions however far from an equilibrium, written out as lines: 20 terms, for 32 lanes.

Each node of the graph has terms :math:`U_n` (coefficient times h^n), which follow from the terms before them,

.. math:: (UV)_n = \sum_{k=0}^n U_kV_{n-k}, \qquad (U/V)_n = \Big(U_n - \sum_{k=1}^n V_kW_{n-k}\Big)\Big/V_0, \qquad
          f(U)_n = \frac1n\sum_{k=1}^n k\,U_k\,f'(U)_{n-k}, \qquad A_0V_n = F_n - \sum_{k=1}^n A_kV_{n-k}

so functions are integrated together with the states. Terms that vanish are not written: a time has two.
:class:`Moving` generates a module that computes the terms; :mod:`kernels.flow.paths` sums them over steps as long as
they allow; :mod:`sweeps.mechanics.perturbed` adds perturbations.

Source: as for :mod:`sweeps.mechanics.taylor`.
"""

import math
import re
from functools import reduce
from typing import ClassVar

import numpy as np

from kernels.compile.blocks import W
from kernels.flow.codes import FAR_ORDER as ORDER
from sweeps.mechanics.graph import ADD, CONSTANT, DIV, MUL, SOLVED, STATE, Graph
from sweeps.mechanics.taylor import HEADER, WRAPPER_TEXT, Generated, factor_lines, indices_newest_last, solution_lines

EXPAND = {"constant": "SERIES", "name": "expand", "words": "Write the terms of every lane's series."}
MAX_CHANGE, MAX_VISIBLE = (4.0, 100.0)  # largest change of an exponent in a step; exp(-u) is 0 beyond the second


def sum_text(terms: list[str]) -> str:
    """Return the text of a sum of terms, which may begin with a minus."""
    return " + ".join(terms).replace("+ -", "- ")


class Series(Generated):
    """Lines that compute the terms of a motion, B of each node; `still`: it stays at an equilibrium.

    The last state of the graph is the time. In all methods `number` is the index of a node in the graph, n the order of
    a term, and a term's key is (kind, number, n). Rows of the scratch array: X the states, U functions' values and
    constants, h the step.
    """

    order = ORDER  #: highest order of the terms
    #: kind of a term → the method that returns its text: B the motion's term U_n, K n times it, R the reciprocal
    term_methods: ClassVar[dict[str, str]] = {
        "B": "_base_text",
        "K": "_multiple_of_base_text",
        "R": "_reciprocal_of_base_text",
    }

    def __init__(self, graph: Graph, still: bool = False):
        self.graph, self.still, self.time = graph, still, len(graph.rates) - 1
        self._lines: dict[bool, list[str]] = {True: [], False: []}  # lines of the motion, and of perturbed motions
        self._names: dict[tuple, str | None] = {}
        self.base: dict[tuple, int] = {}  #: (kind, number) → row
        self.perturbed: dict[tuple, int] = {}  #: the same of perturbed motions

    # -- terms of the series: local names, None for terms that vanish

    def _row_text(self, kind, number):
        """Return the text of a row of the scratch array, with a placeholder until all rows are known."""
        rows = self.perturbed if kind in "xew" else self.base
        rows.setdefault((kind, number), len(rows))
        return f"S[<{kind} {number}>]"

    def _define(self, key, text):
        """Write the line that assigns a term, and return its name."""
        if text is not None:
            name = "_".join(map(str, key))
            self._lines[key[0] in "BKR"].append(f"{name} = {text}")
            text = name
        self._names[key] = text
        return text

    def _term_name(self, kind, number, n):
        """Return the name of the n-th term of a node: kind B of the motion; subclasses have further kinds."""
        key = (kind, number, n)
        if key not in self._names:
            if kind in "BH" and self.graph.nodes[number].kind == SOLVED:
                self._write_accelerations(kind, number, n)
            else:
                self._define(key, getattr(self, self.term_methods[kind])(number, n))
        return self._names[key]

    def _write_accelerations(self, kind, number, n):
        """Write the lines for the n-th terms of the accelerations in one linear system, which contains the node."""
        first, a, forces = self.graph.coupled(number)
        base, base_kind, mark = kind == "B", "B" if kind == "B" else "F", f"{kind}{first}_"
        if n == 0:
            entries = {at: self._term_name(base_kind, entry, 0) or "0.0" for at, entry in a.items()}
            self._lines[base] += factor_lines(entries, len(forces), mark)
        right, names = [], [f"{kind}_{first + i}_{n}" for i in range(len(forces))]
        for i, force in enumerate(forces):
            terms = [x for x in (self._term_name(kind, force, n),) if x]
            for j in range(len(forces)):
                if not (base or self.still):  # an equilibrium has no accelerations
                    terms += self._product_texts(("B", first + j), ("H", a[i, j]), n, 0, "-")
                terms += self._product_texts((base_kind, a[i, j]), (kind, first + j), n, 1, "-")
            right.append(sum_text(terms) or "0.0")
        self._lines[base] += solution_lines(right, names, mark)
        self._names |= {(kind, first + i, n): name for i, name in enumerate(names)}

    def _multiple_of_base_text(self, number, n):
        """Return the text of n times the motion's n-th term of a node; None if it vanishes."""
        base = self._term_name("B", number, n)
        return base and f"{n}.0 * {base}"

    def _reciprocal_of_base_text(self, number, n):
        """Return the text of 1 over the motion's n-th term of a node."""
        return f"1.0 / {self._term_name('B', number, n)}"

    def _product_texts(self, first, second, n, start=0, sign=""):
        """Return the products of Σ u_k v_(n-k) from k = start, the newest last; first and second are (kind, node)."""
        terms = [(self._term_name(*first, k), self._term_name(*second, n - k)) for k in indices_newest_last(start, n)]
        return [f"{sign}{u} * {v}" for u, v in terms if u and v]

    def _square_text(self, number, n):
        """Return the text of a square's term: each product counts twice, except the middle one."""
        u = [self._term_name("B", number, k) for k in range(n + 1)]
        pairs = [f"{u[k]} * {u[n - k]}" for k in reversed(range((n + 1) // 2)) if u[k] and u[n - k]]
        middle = [f"{u[n // 2]} * {u[n // 2]}"] if n % 2 == 0 and u[n // 2] else []
        return " + ".join([*([f"2.0 * ({' + '.join(pairs)})"] if pairs else []), *middle]) or None

    def _base_text(self, number, n):
        """Return the text of the motion's n-th term U_n of a node, by the node's recurrence; None if it vanishes."""
        node = self.graph.nodes[number]
        if node.kind == CONSTANT:
            (e,) = node.weights
            if n or e == 0:
                return None
            return repr(float(e)) if e.is_number else self._row_text("U", number)
        if node.kind == STATE:
            (i,) = node.operands
            if n == 0:
                return self._row_text("X", i)
            if self.still and i != self.time:
                return None
            return self._rate_text("B", i, n)
        if node.kind == ADD:
            return self._sum_text("B", node, n)
        if node.kind == MUL:
            a, b = node.operands
            return self._square_text(a, n) if a == b else sum_text(self._product_texts(("B", a), ("B", b), n)) or None
        if node.kind == DIV:
            a, b = node.operands
            terms = [x for x in (self._term_name("B", a, n),) if x]
            terms += self._product_texts(("B", b), ("B", number), n, 1, "-")
            return f"({sum_text(terms)}) * {self._term_name('R', b, 0)}" if terms else None
        if n == 0:
            return self._row_text("U", number)
        terms = self._product_texts(("K", node.operands[0]), ("B", self.graph.slopes[number]), n, 1)
        return f"{1.0 / n!r} * ({sum_text(terms)})" if terms else None

    def _rate_text(self, kind, i, n):
        """Return the text of the n-th term of state i: h/n times the term n - 1 of its rate; None if it vanishes."""
        rate = self._term_name(kind, self.graph.rates[i], n - 1)
        return rate and f"(h * {1.0 / n!r}) * {rate}"

    def _sum_text(self, kind, node, n):
        """Return the text of the n-th term, of a kind, of a weighted sum; None if it vanishes."""
        text = ""
        for weight, number in zip(node.weights, node.operands, strict=True):
            if term := self._term_name(kind, number, n):
                text += f" {'-' if weight < 0 else '+'} {term if abs(weight) == 1.0 else f'{abs(weight)!r} * {term}'}"
        return text.removeprefix(" + ").strip() or None

    def _term_names(self, kind, number):
        """Return the names of a node's terms, None for those that vanish."""
        return [self._term_name(kind, number, n) for n in range(self.order + 1)]

    def with_rows(self, lines: list[str], first: int = 0) -> str:
        """Return lines as text, with a row's address in place of each placeholder of :meth:`_row_text`.

        Args:
            lines: lines of code with placeholders <kind number>.
            first: index of the first row of perturbed motions.
        """

        def place(match):
            """Return the index of the row that a placeholder names, times W, plus the lane."""
            key = match[1], int(match[2])
            return f"{(first + self.perturbed[key] if key[0] in 'xew' else self.base[key]) * W} + lane"

        return re.sub(r"<(\w+) (\d+)>", place, "\n".join(lines))


class Moving(Series):
    """The rows of the scratch array and the text of the module of motions however far from an equilibrium.

    Rows, each W long: the states, the time last; functions' values; the change of functions' arguments in a step over
    its bound; the step; constants. The module's `expand(S)` writes the terms of each series after these, orders 1 to
    ORDER, with one free row after each series.
    """

    def __init__(self, graph: Graph):
        super().__init__(graph)
        self.n = len(graph.rates)
        series = [*(("X", i) for i in range(self.n)), *(("U", number) for number in graph.slopes)]
        self.base = {key: row for row, key in enumerate([*series, ("bound", 0), ("h", 0)])}
        self.states, self.step_row = len(series), len(series) + 1
        self.text = self._module_text()

    @property
    def rows(self) -> int:
        """Number of rows of the scratch array before the series."""
        return len(self.base)

    def table(self, parameters, x, low, step) -> np.ndarray:
        """Return the scratch array's rows of motions, shape (runs, rows).

        Args:
            parameters: a list of arrays (runs,).
            x: states, the time last, shape (runs, states).
            low: remainder of each state below its rounding, shape (runs, states).
            step: shape (runs,).
        """
        rows = np.zeros((len(x), self.rows))
        with np.errstate(all="ignore"):
            U, slopes = self.values.bases(parameters, list(x.T))
            hat = self.values.deviations(U, slopes, parameters, 1.0, low.T)[0] if low.any() else [0.0] * len(U)
            rows[:, : self.n], rows[:, self.step_row] = x, step
            for (kind, number), at in self.base.items():
                if kind == "U":  # with digits below f's rounding
                    rows[:, at] = U[number] + np.where(np.isfinite(hat[number]), hat[number], 0.0)
        return rows

    def _module_text(self):
        """Return the source of the module, with the function `expand`, which stores all terms of the series."""
        states = [self.graph.build(x) for x in self.graph.states]
        for n in range(ORDER + 1):
            for number in states:
                self._term_name("B", number, n)
        coefficient_names = [self._term_names("B", number) for number in (*states, *self.graph.slopes)]
        bound = [*self._bound_lines()] if self._bounded_arguments else []
        lines = [f"h = {self._row_text('h', 0)}", *self._lines[True]]
        for row, series in enumerate(coefficient_names):
            first = self.rows + (ORDER + 1) * row - 1
            lines += [f"S[{(first + n) * W} + lane] = {series[n] or '0.0'}" for n in range(1, ORDER + 1)]
        expand = WRAPPER_TEXT.format(lines=self.with_rows([*lines, *bound]), **EXPAND)
        return "\n\n".join([HEADER.format(title=self.title, order=ORDER, W=W), expand])

    @property
    def _bounded_arguments(self):
        """Return (argument, steepness) of functions with pulses that a step could miss.

        If exp(-u) or u^n is negligible, so are all its terms, however close its pulse is.
        """
        steep = {(self.graph.nodes[f].operands[0], self.graph.steepness(f)) for f in self.graph.slopes}
        return sorted((k, n) for k, n in steep if n is not None)

    def _bound_lines(self):
        """Yield lines for the change of arguments in a step over its bound.

        It is negative if the functions' series fail, so that the functions are evaluated again after the step. For a
        power u^n the bound is that of n ln |u|.
        """
        shares, unseen = [], []
        for k, n in self._bounded_arguments:
            first, *higher_terms = self._term_names("B", k)
            size = f"abs({first or '0.0'})"
            yield f"t{k} = {' + '.join(f'abs({x})' for x in higher_terms if x) or '0.0'}"
            if n:
                shares.append(f"t{k} / max({MAX_CHANGE / n} * {size}, {math.exp(-MAX_VISIBLE / n)} - {size})")
                faint = math.exp(-(MAX_VISIBLE + MAX_CHANGE) / n)
                unseen.append(
                    f"({2.0 * MAX_CHANGE} if (t{k} > {MAX_CHANGE / n} * {size}) & ({size} < {faint}) else 0.0)"
                )
            else:
                shares.append(f"t{k} / max({MAX_CHANGE}, {size} - {MAX_VISIBLE})")
                unseen.append(f"min(t{k}, {size} - {MAX_VISIBLE})")
        maximum = "max({}, {})".format
        yield f"t = {reduce(maximum, shares)}"
        yield f"S[{self.states * W} + lane] = 0.0 - t if {reduce(maximum, unseen)} > {MAX_CHANGE} else t"
