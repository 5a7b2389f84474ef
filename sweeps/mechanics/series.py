r"""Power series of motions however far from an equilibrium, written out as lines: 20 terms, for 32 lanes.

Each node of the graph has terms :math:`U_n` (coefficient times h^n), which follow from the ones before them,

.. math:: (UV)_n = \sum_{k=0}^n U_kV_{n-k}, \qquad (U/V)_n = \Big(U_n - \sum_{k=1}^n V_kW_{n-k}\Big)\Big/V_0, \qquad
          f(U)_n = \frac1n\sum_{k=1}^n k\,U_k\,f'(U)_{n-k}, \qquad A_0V_n = F_n - \sum_{k=1}^n A_kV_{n-k}

so functions are integrated beside the states. Terms that vanish are not written: a time has two. :class:`Moving` makes
a module that writes the terms, of which :mod:`kernels.paths` makes steps as long as they allow;
:mod:`sweeps.mechanics.perturbed` adds perturbations.

Source: as for :mod:`sweeps.mechanics.taylor`.
"""

import math
import re
from functools import reduce

import numpy as np

from kernels.blocks import W
from kernels.codes import FAR_ORDER as ORDER
from sweeps.mechanics.graph import ADD, CONSTANT, DIV, MUL, SOLVED, Graph, X
from sweeps.mechanics.taylor import HEADER, ONCE, Generated, factors, newest_last, substituted

EXPAND = {"constant": "SERIES", "name": "expand", "words": "Write the terms of every lane's series."}
STEEP, UNSEEN = 4.0, 100.0  # change of an exponential's argument in a step; beyond it nothing of a pulse is seen


def added(terms: list[str]) -> str:
    """Return the sum of terms, some of which begin with a minus."""
    return " + ".join(terms).replace("+ -", "- ")


class Series(Generated):
    """Lines that give the terms of a motion, B of a node; where it is `still`, at an equilibrium at all times.

    The last state of the graph is the time. Rows of the scratch array: X its states, U functions' values and
    constants, h the step.
    """

    def __init__(self, graph: Graph, still: bool = False):
        self.graph, self.still, self.time = graph, still, len(graph.rates) - 1
        self._lines: dict[bool, list[str]] = {True: [], False: []}  # of the motion, of what is beside it
        self._names: dict[tuple, str | None] = {}
        self.base: dict[tuple, int] = {}  #: (kind, number) → row
        self.perturbed: dict[tuple, int] = {}  #: likewise, of what is beside it

    # -- terms of the series: names of locals, None where they vanish

    def _load(self, kind, number):
        """Return a row, in brackets until all rows are known."""
        rows = self.perturbed if kind in "xew" else self.base
        rows.setdefault((kind, number), len(rows))
        return f"S[<{kind} {number}>]"

    def _put(self, key, text):
        """Write a line that gives a term its value, once."""
        if text is not None:
            name = "_".join(map(str, key))
            self._lines[key[0] in "BKR"].append(f"{name} = {text}")
            text = name
        self._names[key] = text
        return text

    def _term(self, kind, number, n):
        """Return the n-th term of a node: B of the motion, or what a subclass has beside it."""
        key = (kind, number, n)
        if key not in self._names:
            if kind in "BH" and self.graph.nodes[number].kind == SOLVED:
                self._solve(kind, number, n)
            else:
                self._put(key, getattr(self, f"_{kind}")(number, n))
        return self._names[key]

    def _solve(self, kind, number, n):
        """Write the n-th terms of all accelerations that are solved for with a node's."""
        first, a, forces = self.graph.coupled(number)
        base, whole, mark = kind == "B", "B" if kind == "B" else "F", f"{kind}{first}_"
        if n == 0:
            entries = {at: self._term(whole, part, 0) or "0.0" for at, part in a.items()}
            self._lines[base] += factors(entries, len(forces), mark)
        right, names = [], [f"{kind}_{first + i}_{n}" for i in range(len(forces))]
        for i, force in enumerate(forces):
            terms = [x for x in (self._term(kind, force, n),) if x]
            for j in range(len(forces)):
                if not (base or self.still):  # an equilibrium has no accelerations
                    terms += self._products(("B", first + j), ("H", a[i, j]), n, 0, "-")
                terms += self._products((whole, a[i, j]), (kind, first + j), n, 1, "-")
            right.append(added(terms) or "0.0")
        self._lines[base] += substituted(right, names, mark)
        self._names |= {(kind, first + i, n): name for i, name in enumerate(names)}

    def _K(self, number, n):
        """Return n times the base's term."""
        base = self._term("B", number, n)
        return base and f"{n}.0 * {base}"

    def _R(self, number, n):
        return f"1.0 / {self._term('B', number, n)}"

    def _products(self, first, second, n, least=0, sign=""):
        """Return the terms of Σ u_k v_(n-k) from k = least on, the newest last; first and second are (kind, node)."""
        terms = [(self._term(*first, k), self._term(*second, n - k)) for k in newest_last(least, n)]
        return [f"{sign}{u} * {v}" for u, v in terms if u and v]

    def _square(self, number, n):
        """Return the text of a square's term, which has each product twice but for that in the middle."""
        u = [self._term("B", number, k) for k in range(n + 1)]
        pairs = [f"{u[k]} * {u[n - k]}" for k in reversed(range((n + 1) // 2)) if u[k] and u[n - k]]
        middle = [f"{u[n // 2]} * {u[n // 2]}"] if n % 2 == 0 and u[n // 2] else []
        return " + ".join([*([f"2.0 * ({' + '.join(pairs)})"] if pairs else []), *middle]) or None

    def _B(self, number, n):
        node = self.graph.nodes[number]
        if node.kind == CONSTANT:
            (e,) = node.weights
            if n or e == 0:
                return None
            return repr(float(e)) if e.is_number else self._load("U", number)
        if node.kind == X:
            (i,) = node.parts
            if n == 0:
                return self._load("X", i)
            if self.still and i != self.time:
                return None
            return self._rate("B", i, n)
        if node.kind == ADD:
            return self._sum("B", node, n)
        if node.kind == MUL:
            a, b = node.parts
            return self._square(a, n) if a == b else added(self._products(("B", a), ("B", b), n)) or None
        if node.kind == DIV:
            a, b = node.parts
            terms = [x for x in (self._term("B", a, n),) if x]
            terms += self._products(("B", b), ("B", number), n, 1, "-")
            return f"({added(terms)}) * {self._term('R', b, 0)}" if terms else None
        if n == 0:
            return self._load("U", number)
        terms = self._products(("K", node.parts[0]), ("B", self.graph.slopes[number]), n, 1)
        return f"{1.0 / n!r} * ({added(terms)})" if terms else None

    def _rate(self, kind, i, n):
        rate = self._term(kind, self.graph.rates[i], n - 1)
        return rate and f"(h * {1.0 / n!r}) * {rate}"

    def _sum(self, kind, node, n):
        text = ""
        for weight, number in zip(node.weights, node.parts, strict=True):
            if part := self._term(kind, number, n):
                text += f" {'-' if weight < 0 else '+'} {part if abs(weight) == 1.0 else f'{abs(weight)!r} * {part}'}"
        return text.removeprefix(" + ").strip() or None

    def _series(self, kind, number):
        """Return the names of a node's terms, None where they vanish."""
        return [self._term(kind, number, n) for n in range(ORDER + 1)]

    def placed(self, lines: list[str], first: int = 0) -> str:
        """Return lines as text, with the rows that are in brackets; what is beside the motion has rows from `first`."""

        def place(match):
            key = match[1], int(match[2])
            return f"{(first + self.perturbed[key] if key[0] in 'xew' else self.base[key]) * W} + lane"

        return re.sub(r"<(\w+) (\d+)>", place, "\n".join(lines))


class Moving(Series):
    """The rows of the scratch array and the text of the module of motions however far from an equilibrium.

    Rows, each W long: the states, the time last; functions' values; how far functions' arguments change in a step over
    what they may; the step; constants. The module's `expand(S)` writes the terms of each series after these, of orders
    1 to ORDER; a row more stands between one and the next.
    """

    order = ORDER

    def __init__(self, graph: Graph):
        super().__init__(graph)
        self.n = len(graph.rates)
        series = [*(("X", i) for i in range(self.n)), *(("U", number) for number in graph.slopes)]
        self.base = {key: row for row, key in enumerate([*series, ("bound", 0), ("h", 0)])}
        self.states, self.step_row = len(series), len(series) + 1
        self.text = self._text()

    @property
    def rows(self) -> int:
        """Number of rows of the scratch array before the series."""
        return len(self.base)

    def table(self, parameters, x, low, step) -> np.ndarray:
        """Return the scratch array's rows of motions, shape (runs, rows).

        Args:
            parameters: a list of arrays (runs,).
            x: states, the time last, shape (runs, states).
            low: what is left of each below its rounding, shape (runs, states).
            step: shape (runs,).
        """
        rows = np.zeros((len(x), self.rows))
        with np.errstate(all="ignore"):
            U, slopes = self.values.bases(parameters, list(x.T))
            hat = self.values.deviations(U, slopes, parameters, 1.0, low.T)[0] if low.any() else [0.0] * len(U)
            rows[:, : self.n], rows[:, self.step_row] = x, step
            for (kind, number), at in self.base.items():
                if kind == "U":  # beyond f's last digit
                    rows[:, at] = U[number] + np.where(np.isfinite(hat[number]), hat[number], 0.0)
        return rows

    def _text(self):
        states = [self.graph.build(x) for x in self.graph.states]
        for n in range(ORDER + 1):
            for number in states:
                self._term("B", number, n)
        written = [self._series("B", number) for number in (*states, *self.graph.slopes)]
        bound = [*self._bound()] if self._bounded else []
        lines = [f"h = {self._load('h', 0)}", *self._lines[True]]
        for row, series in enumerate(written):
            first = self.rows + (ORDER + 1) * row - 1
            lines += [f"S[{(first + n) * W} + lane] = {series[n] or '0.0'}" for n in range(1, ORDER + 1)]
        expand = ONCE.format(lines=self.placed([*lines, *bound]), **EXPAND)
        return "\n\n".join([HEADER.format(title=self.title, order=ORDER, W=W), expand])

    @property
    def _bounded(self):
        """Return argument and steepness of functions whose pulses a step could pass.

        Where exp(-u) or u^n is too small to be seen, so are all its terms, however close its pulse is.
        """
        steep = {(self.graph.nodes[f].parts[0], self.graph.steepness(f)) for f in self.graph.slopes}
        return sorted((k, n) for k, n in steep if n is not None)

    def _bound(self):
        """Yield lines that write how far arguments change in a step over what they may, STEEP or up to ±UNSEEN.

        It is negative where functions cannot follow, and have to be worked out afresh after the step. Of a power u^n
        it is n ln |u| that may change by as much.
        """
        shares, unseen = [], []
        for k, n in self._bounded:
            first, *others = self._series("B", k)
            size = f"abs({first or '0.0'})"
            yield f"t{k} = {' + '.join(f'abs({x})' for x in others if x) or '0.0'}"
            if n:
                shares.append(f"t{k} / max({STEEP / n} * {size}, {math.exp(-UNSEEN / n)} - {size})")
                faint = math.exp(-(UNSEEN + STEEP) / n)
                unseen.append(f"({2.0 * STEEP} if (t{k} > {STEEP / n} * {size}) & ({size} < {faint}) else 0.0)")
            else:
                shares.append(f"t{k} / max({STEEP}, {size} - {UNSEEN})")
                unseen.append(f"min(t{k}, {size} - {UNSEEN})")
        most = "max({}, {})".format
        yield f"t = {reduce(most, shares)}"
        yield f"S[{self.states * W} + lane] = 0.0 - t if {reduce(most, unseen)} > {STEEP} else t"
