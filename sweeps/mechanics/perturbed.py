r"""The integrator of perturbations of a motion that itself changes with time: Taylor steps for 32 lanes.

A lane holds a base motion, and beside it perturbed ones: what each deviates from it, over epsilon. Each node of the
graph is :math:`u = U(t) + \varepsilon\hat u(t)`, both with a power series within the step, and

.. math:: \widehat{uv}_n = \sum_k U_k\hat v_{n-k} + \hat u_k (V + \varepsilon\hat v)_{n-k}, \qquad
          \widehat{u/v}_n = \Big(\hat u_n - \sum_k W_k\hat v_{n-k} - \sum_{k>0}(V + \varepsilon\hat v)_k \hat w_{n-k}
          \Big)\Big/(V + \varepsilon\hat v)_0

so no perturbation is too small, wherever the base motion is. A function :math:`w = f(u)` is carried along with its
deviation: :math:`\dot W = f'(U)\dot U` and
:math:`\dot{\hat w} = \widehat{f'(u)}\,\dot U + (f'(U) + \varepsilon\widehat{f'(u)})\,\dot{\hat u}`.

The base motion's terms are found once a step, and all perturbed ones read them. Terms that vanish are not written:
where the base motion is an equilibrium at all times only the time moves in U, and where equations are linear, epsilon
does not occur: that proves it.

*What a step leaves out* is taken from its last four terms, as of a geometric series: with
:math:`a = |x_{N-1}| + |x_N|` and :math:`b = |x_{N-3}| + |x_{N-2}|` it is :math:`a^2/b`. The base motion's states
and functions are carried from step to step, too, and may be rougher than the perturbations: what is left out of each
counts relative to its first terms.

Source: as for :mod:`sweeps.mechanics.taylor`; derived here.
"""

import re
from functools import cached_property

import numpy as np
import sympy as sp

from kernels.blocks import W
from kernels.codes import FAR_ORDER as ORDER
from kernels.matrices import joined
from sweeps.mechanics.graph import ADD, DIV, FUNCTION, MUL, Graph, X
from sweeps.mechanics.series import Series, added

TEXT = '''"""{title}: one Taylor step of order {order} of a motion and of perturbed ones, for {W} lanes."""

from kernels.jit import PASSED, njit
from kernels.straight import lines

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
TINY = 1e-300


class PerturbedCode(Series):
    """The rows of the scratch array and the text of the module.

    Rows, each W long: of the base motion (those of :class:`Series`, and epsilon), of a perturbed one (x deviations of
    the states; e what its steps left out of each; w functions' deviations), and the terms of the base motion. H are the
    terms of a node's deviation, F of both, T of both and the base motion.
    """

    nodes = 3  #: of a start's remainders: ε û = 0.1 leaves 1e-11 of one, and its amplitude changes far more

    def __init__(self, graph: Graph, still: bool):
        super().__init__(graph, still)
        self.linear = True
        self.perturbed = {(kind, i): i + self.time * (kind == "e") for kind in "xe" for i in range(self.time)}
        self.text = self._text()

    @property
    def is_mixed(self) -> bool:
        """Return whether each segment begins with functions' values anew: one segment's error is not the next one's.

        That is needed where functions depend on states and time at once, or the base motion moves; and of exponentials
        of the time, which may be 0 where a period begins and are not on their way; and where switches differ.
        """
        if self.graph.equations.switches:
            return True
        timed = [k for k in self.graph.slopes if self.time in self._states_of(k)]
        return not self.still or any(self._deviates(k) or self.graph.nodes[k].weights[0].has(sp.exp) for k in timed)

    @cached_property
    def directions(self) -> tuple[np.ndarray, np.ndarray]:
        """Return where motions begin, (motions, states), and of each entry of a matrix the motion that has it, or -1.

        Where equations are linear, a motion begins in a direction of each block at once: no rate depends on a state of
        another block. Else there is one motion a direction, and one more from twice their sum.
        """
        n = self.time
        if not self.linear:
            return np.vstack([np.eye(n), np.full(n, 2.0)]), np.tile(np.arange(n), (n, 1))
        same = joined(n, [[i, *(self._states_of(rate) - {n})] for i, rate in enumerate(self.graph.rates[:n])])
        within = np.tril(same, -1).sum(axis=1)
        return np.eye(n)[: within.max() + 1, within], np.where(same, within, -1)

    def starts(self, parameters, place, epsilon, step, x) -> tuple[np.ndarray, np.ndarray]:
        """Return the rows of base motions (segments, rows, points) and of perturbed ones (motions, segments, …).

        Args:
            parameters: a list of arrays (points,).
            place: the base motion's states and the time, a list of arrays (segments, points).
            epsilon: size of the perturbation, shape (points,).
            step: length of a step, shape (points,).
            x: deviations of the states over epsilon, shape (motions, states, points).
        """
        shape = np.broadcast_shapes(*(np.shape(y) for y in place))
        columns = np.zeros((len(x), shape[0], len(self.perturbed), shape[1]))
        columns[:, :, : self.time] = x[:, None]
        with np.errstate(all="ignore"):
            U, slopes = self.values.bases(parameters, [np.broadcast_to(y, shape) for y in place])
            functions = [*self.perturbed.items()][2 * self.time :]
            for column in np.swapaxes(columns, 1, 2) if functions else []:
                deviation = [*column[: self.time], np.zeros(shape)]
                hat, _ = self.values.deviations(U, slopes, parameters, epsilon, deviation)
                for (_, number), row in functions:
                    column[row] = hat[number]
        base = np.empty((shape[0], len(self.base), shape[1]))
        for (kind, number), row in self.base.items():
            base[:, row] = {"X": place, "U": U, "epsilon": [epsilon], "h": [step], "E": [0.0]}[kind][number]
        return base, columns

    # -- terms of the series: names of locals, None where they vanish

    def _F(self, number, n):
        base, hat = self._term("B", number, n), self._term("H", number, n)
        if hat is None:
            return base
        self.linear = False
        return added([*([base] if base else []), f"epsilon * {hat}"])

    def _T(self, number, n):
        return added([x for x in (self._term("F", number, n), self._term("B", number, n)) if x]) or None

    def _k(self, number, n):
        """Return n times the deviation's term."""
        hat = self._term("H", number, n)
        return hat and f"{n}.0 * {hat}"

    def _r(self, number, n):
        return f"1.0 / {self._term('F', number, n)}"

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
                return added(self._products(("T", a), ("H", a), n)) or None
            a, b = (a, b) if self._deviates(a) else (b, a)
            terms = self._products(("H", a), ("F" if self._deviates(b) else "B", b), n)
            return added([*terms, *self._products(("B", a), ("H", b), n)]) or None
        if node.kind == DIV:
            a, b = node.parts
            terms = [x for x in (self._term("H", a, n),) if x] + self._products(("B", number), ("H", b), n, 0, "-")
            terms += self._products(("F", b), ("H", number), n, 1, "-")
            return f"({added(terms)}) * {self._term('r', b, 0)}" if terms else None
        if n == 0:
            return self._load("w", number)
        inner, slope = node.parts[0], self.graph.slopes[number]
        terms = self._products(("K", inner), ("H", slope), n, 1) + self._products(("k", inner), ("F", slope), n, 1)
        return f"{1.0 / n!r} * ({added(terms)})" if terms else None

    def _deviates(self, number):
        """Return whether a node depends on the states, and not on the time alone."""
        return bool(self._states_of(number) - {self.time})

    def _states_of(self, number):
        """Return the numbers of the states that a node depends on; the last one is the time."""
        key = ("states", number)
        if key not in self._names:
            node = self.graph.nodes[number]
            self._names[key] = {*node.parts} if node.kind == X else set().union(*map(self._states_of, node.parts))
        return self._names[key]

    # -- the module

    def _text(self):
        step = f"h = {self._load('h', 0)}"
        states = [self.graph.build(x) for x in self.graph.states]
        sums = [(kind, i, number, "X" if kind == "B" else "x") for i, number in enumerate(states) for kind in "BH"]
        done, ends = set(), {True: [], False: []}
        for n in range(ORDER + 1):
            for kind, _, number, _ in sums:
                self._term(kind, number, n)
        for i in range(self.time):
            ends[False] += self._left_out(self._load("e", i), self._series("H", states[i]))
        lost = self._load("E", 0)
        while sums:  # functions that the others stand on are found on the way
            for kind, at, number, row in sums:
                done.add((row, at))
                series = self._series(kind, number)
                if kind == "B":
                    size = " + ".join(f"abs({x})" for x in [*filter(None, series[:4]), repr(TINY)])
                    ends[True] += self._left_out(lost, series, f" / ({size})")
                terms = [x for x in reversed(series) if x]
                if len(terms) > 1:
                    ends[kind == "B"].append(f"{self._load(row, at)} = {' + '.join(terms)}")
            sums = [
                ("B" if row == "U" else "H", number, number, row)
                for row, number in [*self.base, *self.perturbed]
                if row in "Uw" and (row, number) not in done and self.graph.nodes[number].kind == FUNCTION
            ]
        base, perturbed = ([step, *self._lines[of], *ends[of]] for of in (True, False))
        if not self.linear:
            perturbed.insert(0, f"epsilon = {self._load('epsilon', 0)}")
        first = len(self.base)
        made = dict.fromkeys(line.split(" = ")[0] for line in base if not line.startswith("S["))
        read = {name for line in perturbed for name in re.findall(r"\b[BKR]_\d+_\d+\b", line)}
        shared = (name for name in made if name in read)  # the base motion's terms that perturbed motions read
        series = {name: first + len(self.perturbed) + k for k, name in enumerate(shared)}
        base = [*base, *(f"S[{row * W} + lane] = {name}" for name, row in series.items())]
        perturbed = [*(f"{name} = S[{row * W} + lane]" for name, row in series.items()), *perturbed]
        #: number of rows of the scratch array
        self.scratch = first + len(self.perturbed) + len(series)

        base, perturbed = (self.placed(some, first) for some in (base, perturbed))
        size = W * len(self.perturbed)
        return TEXT.format(
            title=self.title, order=ORDER, W=W, base=base, perturbed=perturbed, size=size, first=first * W
        )

    def _left_out(self, row, series, size=""):
        """Yield lines that add what a step leaves out of a series, over a size, to a row."""
        early, late = ([f"abs({x})" for x in pair if x] for pair in (series[-4:-2], series[-2:]))
        if late:
            yield f"late = {' + '.join(late)}"
            yield f"{row} = {row} + late * (late / ({' + '.join([*early, repr(TINY)])})){size}"
