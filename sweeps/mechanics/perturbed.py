r"""The integrator of perturbations of a motion that itself changes with time: Taylor steps for 32 lanes.

A lane contains a base motion and perturbed motions, as deviations from it over epsilon. Each node of the graph
is :math:`u = U(t) + \varepsilon\hat u(t)`, both with a power series within the step, and

.. math:: \widehat{uv}_n = \sum_k U_k\hat v_{n-k} + \hat u_k (V + \varepsilon\hat v)_{n-k}, \qquad
          \widehat{u/v}_n = \Big(\hat u_n - \sum_k W_k\hat v_{n-k} - \sum_{k>0}(V + \varepsilon\hat v)_k \hat w_{n-k}
          \Big)\Big/(V + \varepsilon\hat v)_0

so no perturbation is too small, wherever the base motion is. A function :math:`w = f(u)` is carried along with its
deviation: :math:`\dot W = f'(U)\dot U` and
:math:`\dot{\hat w} = \widehat{f'(u)}\,\dot U + (f'(U) + \varepsilon\widehat{f'(u)})\,\dot{\hat u}`.

The base motion's terms are computed once a step, for all perturbed motions. Terms that vanish are not written: if the
base motion is an equilibrium at all times, only the time moves in U; if the equations are linear, epsilon does not
occur, which proves it.

*Truncation.* It is estimated from the last four terms of a step as for a geometric series: :math:`a^2/b` with
:math:`a = |x_{N-1}| + |x_N|` and :math:`b = |x_{N-3}| + |x_{N-2}|`. The base motion's states and functions may be less
smooth than the perturbations; the truncation of each counts relative to its first terms.

Source: as for :mod:`sweeps.mechanics.taylor`; derived here.
"""

import re
from functools import cached_property
from typing import ClassVar

import numpy as np
import sympy as sp

from kernels.compile.blocks import W
from kernels.flow.matrices import find_coupled
from sweeps.mechanics.graph import ADD, DIV, FUNCTION, MUL, STATE, Graph
from sweeps.mechanics.series import Series, sum_text

TEXT = '''"""{title}: one Taylor step of order {order} of a motion and of perturbed ones, for {W} lanes."""

from kernels.compile.jit import PASSED, njit
from kernels.compile.llvm_formulas import lines

BASE = lines("""
{base}
""")
PERTURBED = lines("""
{perturbed}
""")


@njit("void(float64[::1], float64[:, ::1], int64)", **PASSED)
def advance(S, columns, steps):
    """Advance every lane by so many steps."""
    for _ in range(steps):
        BASE(S)
        for c in range(len(columns)):
            for i in range({size}):
                S[{first} + i] = columns[c, i]
            PERTURBED(S)
            for i in range({size}):
                columns[c, i] = S[{first} + i]
'''
MAX_PRODUCTS = 30  # products and quotients up to which the order is full; compiling takes the order's square
LOWER_ORDER = 16  # order with more products: 40 of them take 8 s to compile, and 14 s in the full order
MIN_DENOMINATOR = 1e-300  # is added to denominators that may be 0


class PerturbedCode(Series):
    """The rows of the scratch array and the text of the module.

    Rows, each W long: of the base motion (those of :class:`Series`, and epsilon), of a perturbed motion (x
    deviations of the states; e their truncation so far; w deviations of functions), and the terms of the base motion.
    Kinds of terms: B the base motion's U, H deviation û, F = U + εû, T = F + U. Local variables `hat` contain û.
    """

    #: quadrature nodes of remainders: their error is 1e-11 for ε û = 0.1, far less than the amplitude's effect
    nodes = 3
    #: kinds of terms in addition to the base motion's; k is n H, r is 1/F
    term_methods: ClassVar[dict[str, str]] = Series.term_methods | {
        "H": "_deviation_text",
        "F": "_perturbed_text",
        "T": "_perturbed_plus_base_text",
        "k": "_multiple_of_deviation_text",
        "r": "_reciprocal_of_perturbed_text",
    }

    def __init__(self, graph: Graph, still: bool):
        super().__init__(graph, still)
        if sum(node.kind in (MUL, DIV) for node in graph.nodes) > MAX_PRODUCTS:
            self.order = LOWER_ORDER
        self.linear = True
        keys = [(kind, i) for kind in "xe" for i in self.perturbed_states]
        self.perturbed = {key: row for row, key in enumerate(keys)}
        self.text = self._module_text()

    @property
    def perturbed_states(self) -> tuple[int, ...]:
        """Indices of the perturbed states: all but the time."""
        return (*range(self.time),)

    @property
    def is_mixed(self) -> bool:
        """True if functions are evaluated at the start of each segment, so that errors are not carried to the next.

        It is needed if functions depend on states and time together, if the base motion moves, for exponentials of the
        time, which may underflow at the start of a period, and if there are switches.
        """
        if self.graph.equations.switches:
            return True
        time_nodes = [k for k in self.graph.slopes if self.time in self._state_numbers(k)]
        return not self.still or any(
            self._has_deviation(k) or self.graph.nodes[k].weights[0].has(sp.exp) for k in time_nodes
        )

    @cached_property
    def directions(self) -> tuple[np.ndarray, np.ndarray]:
        """Directions of the perturbed motions, (motions, states), and each matrix entry's motion, or -1.

        If the equations are linear, a motion is perturbed in one direction of each block: no rate depends on a state of
        another block. Else there is one motion for each direction, and one more for twice their sum.
        """
        n = len(self.perturbed_states)
        if not self.linear:
            return np.vstack([np.eye(n), np.full(n, 2.0)]), np.tile(np.arange(n), (n, 1))
        index = {state: k for k, state in enumerate(self.perturbed_states)}
        states_of_rates = ([i, *self._state_numbers(self.graph.rates[i])] for i in index)
        same_block = find_coupled(n, [[index[i] for i in states if i in index] for states in states_of_rates])
        index_in_block = np.tril(same_block, -1).sum(axis=1)
        return np.eye(n)[: index_in_block.max() + 1, index_in_block], np.where(same_block, index_in_block, -1)

    def starts(self, parameters, place, epsilon, step, x) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows of base motions (segments, rows, points) and perturbed motions (motions, segments, …).

        Args:
            parameters: a list of arrays (points,).
            place: the base motion's states and the time, a list of arrays (segments, points).
            epsilon: size of the perturbation, shape (points,).
            step: length of a step, shape (points,).
            x: deviations of the states over epsilon, shape (motions, states, points).
        """
        shape = np.broadcast_shapes(*(np.shape(y) for y in place))
        columns = np.zeros((len(x), shape[0], len(self.perturbed), shape[1]))
        count = x.shape[1]
        columns[:, :, :count] = x[:, None]
        with np.errstate(all="ignore"):
            U, slopes = self.values.bases(parameters, [np.broadcast_to(y, shape) for y in place])
            functions = [*self.perturbed.items()][2 * count :]
            for column in np.swapaxes(columns, 1, 2) if functions else []:
                deviation = [*column[:count], np.zeros(shape)]
                hat, _ = self.values.deviations(U, slopes, parameters, epsilon, deviation)
                for (_, number), row in functions:
                    column[row] = hat[number]
        base = np.empty((shape[0], len(self.base), shape[1]))
        for (kind, number), row in self.base.items():
            base[:, row] = {"X": place, "U": U, "epsilon": [epsilon], "h": [step], "E": [0.0]}[kind][number]
        return base, columns

    # -- terms of the series: local names, None for terms that vanish

    def _perturbed_text(self, number, n):
        """Return the text of U_n + ε û_n of a node, a term of the perturbed motion; set `linear` False if ε occurs."""
        base, hat = self._term_name("B", number, n), self._term_name("H", number, n)
        if hat is None:
            return base
        self.linear = False
        return sum_text([*([base] if base else []), f"epsilon * {hat}"])

    def _perturbed_plus_base_text(self, number, n):
        """Return the text of 2 U_n + ε û_n of a node, which a square's deviation needs; None if it vanishes."""
        return sum_text([x for x in (self._term_name("F", number, n), self._term_name("B", number, n)) if x]) or None

    def _multiple_of_deviation_text(self, number, n):
        """Return the text of n û_n of a node; None if it vanishes."""
        hat = self._term_name("H", number, n)
        return hat and f"{n}.0 * {hat}"

    def _reciprocal_of_perturbed_text(self, number, n):
        """Return the text of 1 over U_n + ε û_n of a node."""
        return f"1.0 / {self._term_name('F', number, n)}"

    def _deviation_text(self, number, n):
        """Return the text of the deviation's n-th term û_n of a node (module docstring); None if it vanishes."""
        node = self.graph.nodes[number]
        if not self._has_deviation(number):
            return None
        if node.kind == STATE:
            (i,) = node.operands
            return self._row_text("x", i) if n == 0 else self._rate_text("H", i, n)
        if node.kind == ADD:
            return self._sum_text("H", node, n)
        if node.kind == MUL:
            a, b = node.operands
            if a == b:
                return sum_text(self._product_texts(("T", a), ("H", a), n)) or None
            a, b = (a, b) if self._has_deviation(a) else (b, a)
            terms = self._product_texts(("H", a), ("F" if self._has_deviation(b) else "B", b), n)
            return sum_text([*terms, *self._product_texts(("B", a), ("H", b), n)]) or None
        if node.kind == DIV:
            a, b = node.operands
            terms = [x for x in (self._term_name("H", a, n),) if x] + self._product_texts(
                ("B", number), ("H", b), n, 0, "-"
            )
            terms += self._product_texts(("F", b), ("H", number), n, 1, "-")
            return f"({sum_text(terms)}) * {self._term_name('r', b, 0)}" if terms else None
        if n == 0:
            return self._row_text("w", number)
        inner, slope = node.operands[0], self.graph.slopes[number]
        terms = self._product_texts(("K", inner), ("H", slope), n, 1) + self._product_texts(
            ("k", inner), ("F", slope), n, 1
        )
        return f"{1.0 / n!r} * ({sum_text(terms)})" if terms else None

    def _has_deviation(self, number):
        """Return True if a node depends on a state, not on the time alone."""
        return not self._state_numbers(number).isdisjoint(self.perturbed_states)

    def _state_numbers(self, number):
        """Return the indices of the states on which a node depends; the last state is the time."""
        key = ("states", number)
        if key not in self._names:
            node = self.graph.nodes[number]
            self._names[key] = (
                {*node.operands} if node.kind == STATE else set().union(*map(self._state_numbers, node.operands))
            )
        return self._names[key]

    # -- the module

    def _module_text(self):
        """Return the source of the module, with the function `advance`, and set `scratch`.

        Write all terms of the states and of the functions on which these depend; sum them at the end of a step, with
        their truncation. Terms of the base motion that perturbed motions read are stored in rows in between.
        """
        step = f"h = {self._row_text('h', 0)}"
        states = [self.graph.build(x) for x in self.graph.states]
        sums = [(kind, i, number, "X" if kind == "B" else "x") for i, number in enumerate(states) for kind in "BH"]
        summed_rows, ends = set(), {True: [], False: []}
        for n in range(self.order + 1):
            for kind, _, number, _ in sums:
                self._term_name(kind, number, n)
        for i in self.perturbed_states:
            ends[False] += self._truncation_lines(self._row_text("e", i), self._term_names("H", states[i]))
        truncation_row = self._row_text("E", 0)
        while sums:  # functions on which further rows depend are added
            for kind, at, number, row in sums:
                summed_rows.add((row, at))
                series = self._term_names(kind, number)
                if kind == "B":
                    size = " + ".join(f"abs({x})" for x in [*filter(None, series[:4]), repr(MIN_DENOMINATOR)])
                    ends[True] += self._truncation_lines(truncation_row, series, f" / ({size})")
                terms = [x for x in reversed(series) if x]
                if len(terms) > 1:
                    ends[kind == "B"].append(f"{self._row_text(row, at)} = {' + '.join(terms)}")
            sums = [
                ("B" if row == "U" else "H", number, number, row)
                for row, number in [*self.base, *self.perturbed]
                if row in "Uw" and (row, number) not in summed_rows and self.graph.nodes[number].kind == FUNCTION
            ]
        base, perturbed = ([step, *self._lines[of], *ends[of]] for of in (True, False))
        if not self.linear:
            perturbed.insert(0, f"epsilon = {self._row_text('epsilon', 0)}")
        first = len(self.base)
        base_terms = dict.fromkeys(line.split(" = ")[0] for line in base if not line.startswith("S["))
        read = {name for line in perturbed for name in re.findall(r"\b[BKR]_\d+_\d+\b", line)}
        shared = (name for name in base_terms if name in read)  # the base motion's terms that perturbed motions read
        series = {name: first + len(self.perturbed) + k for k, name in enumerate(shared)}
        base = [*base, *(f"S[{row * W} + lane] = {name}" for name, row in series.items())]
        perturbed = [*(f"{name} = S[{row * W} + lane]" for name, row in series.items()), *perturbed]
        #: number of rows of the scratch array
        self.scratch = first + len(self.perturbed) + len(series)

        base, perturbed = (self.with_rows(code_lines, first) for code_lines in (base, perturbed))
        size = W * len(self.perturbed)
        return TEXT.format(
            title=self.title, order=self.order, W=W, base=base, perturbed=perturbed, size=size, first=first * W
        )

    def _truncation_lines(self, row, series, size=""):
        """Yield lines that add the truncation of a series, over a size, to a row."""
        early, late = ([f"abs({x})" for x in pair if x] for pair in (series[-4:-2], series[-2:]))
        if late:
            yield f"late = {' + '.join(late)}"
            yield f"{row} = {row} + late * (late / ({' + '.join([*early, repr(MIN_DENOMINATOR)])})){size}"


class TangentCode(PerturbedCode):
    """Code of infinitesimal perturbations: their variational flow, integrated together with the base motion.

    Perturbed are the states `block`, which are independent of all others to first order. If others exist, the block
    vanishes in the base motion. Functions are carried along over the period: nothing is evaluated in between.
    """

    is_mixed = False

    def __init__(self, graph: Graph, block: tuple[int, ...]):
        self.block, self.vanishes = block, len(block) < len(graph.rates) - 1
        super().__init__(graph, False)

    @property
    def perturbed_states(self) -> tuple[int, ...]:
        """Indices of the perturbed states."""
        return self.block

    def _base_text(self, number, n):
        """Return the text of the motion's n-th term of a node; None of states that vanish in it."""
        node = self.graph.nodes[number]
        if node.kind == STATE and self.vanishes and node.operands[0] in self.block:
            return None
        return super()._base_text(number, n)

    def _perturbed_text(self, number, n):
        """Return the text of U_n, the limit of U_n + ε û_n."""
        return self._term_name("B", number, n)

    def _deviation_text(self, number, n):
        """Return the text of the deviation's n-th term û_n of a node; of functions f'(U) û, None if it vanishes."""
        node = self.graph.nodes[number]
        if node.kind != FUNCTION:
            return super()._deviation_text(number, n)
        slope, inner = self.graph.slopes[number], node.operands[0]
        return sum_text(self._product_texts(("B", slope), ("H", inner), n)) or None
