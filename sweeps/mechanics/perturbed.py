r"""The integrator of perturbations of a motion that itself changes with time: Taylor steps for 32 lanes.

A lane holds one perturbed motion: the base motion and what the perturbed one deviates from it, over epsilon. Each node
of the graph is :math:`u = U(t) + \varepsilon\hat u(t)`, both with a power series within the step, and

.. math:: \widehat{uv}_n = \sum_k U_k\hat v_{n-k} + \hat u_k (V + \varepsilon\hat v)_{n-k}, \qquad
          \widehat{u/v}_n = \Big(\hat u_n - \sum_k W_k\hat v_{n-k} - \sum_{k>0}(V + \varepsilon\hat v)_k \hat w_{n-k}
          \Big)\Big/(V + \varepsilon\hat v)_0

so no perturbation is too small, wherever the base motion is. A function :math:`w = f(u)` is carried along with its
deviation: :math:`\dot W = f'(U)\dot U` and
:math:`\dot{\hat w} = \widehat{f'(u)}\,\dot U + (f'(U) + \varepsilon\widehat{f'(u)})\,\dot{\hat u}`.

Terms that vanish are not written: where the base motion is an equilibrium at all times only the time moves in U, and
where equations are linear, epsilon does not occur.

Source: as for :mod:`sweeps.mechanics.taylor`; derived here.
"""

from functools import cached_property

import numpy as np

from kernels.blocks import W
from sweeps.mechanics.graph import ADD, CONSTANT, DIV, FUNCTION, MUL, Graph, Values, X
from sweeps.mechanics.taylor import ADVANCE, Code, in_quotes

ORDER = 16

TEXT = (
    '''"""{title}: one Taylor step of order {order} of a perturbed motion, for {W} lanes."""

from kernels.jit import PASSED, njit
from kernels.straight import lines

'''
    + ADVANCE
)


def _joined(terms: list[str]) -> str:
    """Return the sum of terms, some of which begin with a minus."""
    return " + ".join(terms).replace("+ -", "- ")


class PerturbedCode(Code):
    """The rows of the scratch array and the text of the module.

    Rows, each W long, in the order of `rows_of`: the base motion's states, the time last; the deviations of the states;
    functions' values and deviations; epsilon; the step; constants.

    Args:
        graph: of any motion: its last state is the time.
        still: whether the base motion is an equilibrium at all times.
    """

    def __init__(self, graph: Graph, still: bool):
        self.graph, self.still = graph, still
        self.time, self.linear = len(graph.rates) - 1, True
        self._lines: list[str] = []
        self._names: dict[tuple, str | None] = {}
        self._rows: dict[tuple, int] = {}
        self.text = self._text()

    @cached_property
    def values(self) -> Values:
        """The graph in NumPy."""
        return Values(self.graph)

    @property
    def rows(self) -> int:
        """Number of rows of the scratch array."""
        return len(self._rows)

    def starts(self, shape, parameters, place, epsilon, x, step) -> np.ndarray:
        """Return the scratch array's rows of motions, shape (rows, motions).

        Args:
            shape: of the motions; all other arrays broadcast to it.
            parameters: a list of arrays.
            place: the base motion's states and the time, a list of arrays.
            epsilon: size of the perturbation.
            x: deviations of the states over epsilon, and 0 of the time, a list of arrays.
            step: length of a step.
        """
        with np.errstate(all="ignore"):
            U, slopes = self.values.bases(parameters, place)
            hat, _ = self.values.deviations(U, slopes, parameters, epsilon, x)
        rows = np.empty((self.rows, *shape))
        for (kind, number), row in self._rows.items():
            source = {"X": place, "x": x, "U": U, "w": hat, "epsilon": [epsilon], "h": [step]}[kind]
            rows[row] = source[number]
        return rows.reshape(self.rows, -1)

    def row_of(self, kind: str, number: int) -> int:
        """Return the row of a quantity: X and x of a state, U and w of a node, epsilon, h; a new one for a new one."""
        return self._rows.setdefault((kind, number), len(self._rows))

    # -- terms of the series: names of locals, None where they vanish

    def _load(self, kind, number):
        return f"S[{self.row_of(kind, number) * W} + lane]"

    def _put(self, key, text):
        """Write a line that gives a term its value, once."""
        if text is not None:
            name = "_".join(map(str, key))
            self._lines.append(f"{name} = {text}")
            text = name
        self._names[key] = text
        return text

    def _term(self, kind, number, n):
        """Return the n-th term of a node: B of its base, H of its deviation, F of both; others of these."""
        key = (kind, number, n)
        if key not in self._names:
            self._put(key, getattr(self, f"_{kind}")(number, n))
        return self._names[key]

    def _F(self, number, n):
        base, hat = self._term("B", number, n), self._term("H", number, n)
        if hat is None:
            return base
        self.linear = False
        return _joined([*([base] if base else []), f"epsilon * {hat}"])

    def _T(self, number, n):
        return _joined([x for x in (self._term("F", number, n), self._term("B", number, n)) if x]) or None

    def _K(self, number, n):
        """Return n times the base's term."""
        base = self._term("B", number, n)
        return base and f"{n}.0 * {base}"

    def _k(self, number, n):
        """Return n times the deviation's term."""
        hat = self._term("H", number, n)
        return hat and f"{n}.0 * {hat}"

    def _R(self, number, n):
        return f"1.0 / {self._term('B', number, n)}"

    def _r(self, number, n):
        return f"1.0 / {self._term('F', number, n)}"

    def _products(self, first, second, n, least=0, sign=""):
        """Return the terms of Σ u_k v_(n-k) from k = least on, the newest last; first and second are (kind, node)."""
        pairs = sorted(range(least, n + 1), key=lambda k: max(k, n - k))
        found = [(self._term(*first, k), self._term(*second, n - k)) for k in pairs]
        return [f"{sign}{u} * {v}" for u, v in found if u and v]

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
            return _joined(self._products(("B", a), ("B", b), n)) or None
        if node.kind == DIV:
            a, b = node.parts
            terms = [x for x in (self._term("B", a, n),) if x]
            terms += self._products(("B", b), ("B", number), n, 1, "-")
            return f"({_joined(terms)}) * {self._term('R', b, 0)}" if terms else None
        if n == 0:
            return self._load("U", number)
        terms = self._products(("K", node.parts[0]), ("B", self.graph.slopes[number]), n, 1)
        return f"{1.0 / n!r} * ({_joined(terms)})" if terms else None

    def _H(self, number, n):
        node = self.graph.nodes[number]
        if not self._deviates(number):
            return None
        if node.kind == X:
            (i,) = node.parts
            return self._load("x", i) if n == 0 else self._rate("H", i, n)
        if node.kind == ADD:
            return self._sum("H", node, n)
        if node.kind == MUL:
            a, b = node.parts
            if a == b:
                return _joined(self._products(("T", a), ("H", a), n)) or None
            a, b = (a, b) if self._deviates(a) else (b, a)
            terms = self._products(("H", a), ("F" if self._deviates(b) else "B", b), n)
            return _joined([*terms, *self._products(("B", a), ("H", b), n)]) or None
        if node.kind == DIV:
            a, b = node.parts
            terms = [x for x in (self._term("H", a, n),) if x] + self._products(("B", number), ("H", b), n, 0, "-")
            terms += self._products(("F", b), ("H", number), n, 1, "-")
            return f"({_joined(terms)}) * {self._term('r', b, 0)}" if terms else None
        if n == 0:
            return self._load("w", number)
        inner, slope = node.parts[0], self.graph.slopes[number]
        terms = self._products(("K", inner), ("H", slope), n, 1) + self._products(("k", inner), ("F", slope), n, 1)
        return f"{1.0 / n!r} * ({_joined(terms)})" if terms else None

    def _deviates(self, number):
        """Return whether a node depends on the states, and not on the time alone."""
        key = ("deviates", number)
        if key not in self._names:
            node = self.graph.nodes[number]
            parts = node.parts if node.kind not in (X, CONSTANT) else ()
            self._names[key] = (node.kind == X and node.parts[0] != self.time) or any(map(self._deviates, parts))
        return self._names[key]

    def _rate(self, kind, i, n):
        rate = self._term(kind, self.graph.rates[i], n - 1)
        return rate and f"(h * {1.0 / n!r}) * {rate}"

    def _sum(self, kind, node, n):
        text = ""
        for weight, number in zip(node.weights, node.parts, strict=True):
            if part := self._term(kind, number, n):
                text += f" {'-' if weight < 0 else '+'} {part if abs(weight) == 1.0 else f'{abs(weight)!r} * {part}'}"
        return text.removeprefix(" + ").strip() or None

    # -- the module

    def _text(self):
        self._lines += [f"h = {self._load('h', 0)}", f"epsilon = {self._load('epsilon', 0)}"]
        states = [self.graph.build(x) for x in self.graph.states]
        sums = [(kind, i, number, "X" if kind == "B" else "x") for i, number in enumerate(states) for kind in "BH"]
        done, ends = set(), []
        for n in range(ORDER + 1):
            for kind, _, number, _ in sums:
                self._term(kind, number, n)
        while sums:  # functions that the others stand on are found on the way
            for kind, at, number, row in sums:
                done.add((row, at))
                terms = [x for x in (self._term(kind, number, n) for n in range(ORDER, -1, -1)) if x]
                if len(terms) > 1:
                    ends.append(f"{self._load(row, at)} = {' + '.join(terms)}")
            sums = [
                ("B" if row == "U" else "H", number, number, row)
                for row, number in self._rows
                if row in "Uw" and (row, number) not in done and self.graph.nodes[number].kind == FUNCTION
            ]
        title = self.graph.equations.system.title
        return TEXT.format(title=in_quotes(title), order=ORDER, W=W, lines="\n".join([*self._lines, *ends]))
