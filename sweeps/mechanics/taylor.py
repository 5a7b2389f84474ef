r"""The integrator of a system near its equilibria: its Taylor series of order 12, written out for 32 lanes.

It is the integrator of :mod:`kernels.free.direct` for any right-hand side: with terms :math:`u_n` (coefficient times
h^n) each node of the graph gives its n-th term from the terms before it,

.. math:: (uv)_n = (U + u_0) v_n + (V + v_0) u_n + \sum_{k=1}^{n-1} u_k v_{n-k}, \qquad
          (u/v)_n = \Big(u_n - (W + w_0) v_n - \sum_{k=1}^{n-1} v_k w_{n-k}\Big)\Big/(V + v_0), \qquad
          \tilde w_n = \frac1n\sum_{k=1}^n k\,u_k\,g_{n-k}, \qquad
          (A + a_0)\,v_n = f_n - \sum_{k=1}^n a_k v_{n-k}

for n > 0 (all in deviations; g = f'(u), and :math:`w_n = f'(U)u_n + \tilde w_n`; v the accelerations that a matrix
A + a couples, which is factorised once a step), and :math:`x_{n+1} = h f_n/(n+1)`, f_n the n-th term of the rate's
node. A Taylor step was preferred to a Runge-Kutta step of order 8: it needs no sine or power in the loop over lanes,
its terms are relative to the perturbation, and for Euler's equations it is the step of the rigid body.

The module also has a function `check`, which writes the deviations of conserved quantities over ε, or over ε² if the
gradient vanishes at the equilibria, as that of an energy does.

The code is a Python module, and :mod:`kernels.compile.llvm_formulas` passes its straight lines to LLVM. Its file, in
the cache folder of the kernels, is named by the hash of its text, so that Numba's disk cache is valid for later
processes; the hash is part of a map's `kernel_fingerprint`.
"""

import hashlib
import json
import sys
import threading
from functools import cached_property
from pathlib import Path

import numpy as np

from kernels.compile.blocks import W
from kernels.compile.cache import cache_folder, load
from kernels.flow.codes import ORDER
from sweeps.mechanics.graph import ABSOLUTE, ADD, CONSTANT, DIV, FIRST, FUNCTION, MUL, SOLVED, STATE, Graph, Values
from sweeps.process.files import replace_output

HEADER = '''"""{title}: one Taylor step of order {order}, and what is conserved, for {W} lanes."""

from kernels.compile.jit import PASSED, njit
from kernels.compile.llvm_formulas import lines
'''

ADVANCE = '''STEP = lines("""
{lines}
""")


@njit("void(float64[::1], int64)", **PASSED)
def advance(S, steps):
    """Advance every lane by so many steps."""
    for _ in range(steps):
        STEP(S)
'''
WRAPPER_TEXT = '''{constant} = lines("""
{lines}
""")


@njit("void(float64[::1])", **PASSED)
def {name}(S):
    """{words}"""
    {constant}(S)
'''
CHECK = {"constant": "TOLD", "name": "check", "words": "Write the conserved quantities' deviations."}

# LLVM's time grows faster than the text: within a factor of two from 6,000 to 750,000 characters
COMPILE_SECONDS = (0.1, 1e-5, 2.2e-11)  # s, constant, for each character, and for the square of their number
SAMPLES_TIMES_CHARACTERS = 4e10  # samples a second and core, times the characters of the module
IMPORT_LOCK = threading.RLock()  # held while a module is imported, as `sys.modules` has it from the start
MIN_PERTURBATION = 1e-60  # smaller perturbations are replaced by this, since their squares might underflow


def in_quotes(text: str) -> str:
    """Return text escaped for a Python string between double quotes."""
    return json.dumps(text, ensure_ascii=False)[1:-1].encode("utf-8", "replace").decode()


class Generated:
    """A Python module that is generated for a graph; `text` is its source."""

    graph: Graph
    text: str
    nodes = 8  #: quadrature nodes of the remainders at a start: exact up to half the distance to the nearest pole of f

    @property
    def compile_seconds(self) -> float:
        """Estimated time to compile the module on a core of 2024, s."""
        constant, linear, square = COMPILE_SECONDS
        return constant + (linear + square * len(self.text)) * len(self.text)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the text, 64 hexadecimal digits."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def name(self) -> str:
        """Name of the module."""
        return f"system_{self.digest[:24]}"

    @cached_property
    def values(self) -> Values:
        """The graph in NumPy."""
        return Values(self.graph, self.nodes)

    @property
    def title(self) -> str:
        """The system's title, escaped for the text."""
        return in_quotes(self.graph.equations.system.title)

    @property
    def path(self) -> Path:
        """The module's file, which is written if it does not exist."""
        return _write_module(cache_folder() / "generated", self.name, self.text)

    def module(self):
        """Return the compiled module; threads that ask while it is imported wait for it."""
        with IMPORT_LOCK:
            return sys.modules.get(self.name) or load(self.path)


class Code(Generated):
    """The rows of the scratch array and the text of the module of motions near equilibria.

    Rows, each W long: the states, the functions' remainders, 1/ε, the step, the watched quantities, and constants of a
    run. The module has functions `advance(S, steps)` and `check(S)`.
    """

    def __init__(self, graph: Graph):
        self.graph = graph
        self.n = len(graph.rates)
        self.remainders = {number: self.n + k for k, number in enumerate(graph.slopes)}
        self.states = self.n + len(self.remainders)
        self.inverse_row, self.step_row, self.drift_row = self.states, self.states + 1, self.states + 2
        self.constants: dict[tuple[str, int], int] = {}
        self._used_constants: set = set()
        self._whole_texts: dict[int, str] = {}
        self.text = self._module_text()

    @property
    def rows(self) -> int:
        """Number of rows of the scratch array."""
        return self.drift_row + len(self.graph.drift_terms) + len(self.constants)

    @property
    def samples_per_second(self) -> int:
        """Estimated number of samples, of six motions each, that one core computes in a second."""
        return int(SAMPLES_TIMES_CHARACTERS / len(self.text))

    def starts(self, parameters, place, motions) -> np.ndarray:
        """Return the scratch array's rows at the start of motions, shape (points, motions, rows), without the step.

        Args:
            parameters: a list of arrays (points,).
            place: the equilibria, shape (points, places); velocities vanish there.
            motions: of each motion (epsilon (points,), deviations of the states over epsilon (states, points)).
        """
        still = [np.zeros(len(place))] * (self.n - place.shape[1])
        rows = np.zeros((len(place), len(motions), self.rows))
        with np.errstate(all="ignore"):
            U, slopes = self.values.bases(parameters, [*place.T, *still])
            for k, (epsilon, x) in enumerate(motions):
                row, size = rows[:, k], np.maximum(epsilon, MIN_PERTURBATION)
                _, remainders = self.values.deviations(U, slopes, parameters, 1.0, size * x)
                row[:, : self.n] = np.transpose(size * x)
                for number, at in self.remainders.items():
                    row[:, at] = remainders[number]
                row[:, self.inverse_row] = 1.0 / size
                for (kind, number), at in self.constants.items():
                    row[:, at] = (U if kind == "U" else slopes)[number]
        return rows

    # -- names in the generated text

    def _base_text(self, number):
        """Return the text of U of a node: a literal, or its local name; None if it is 0."""
        node = self.graph.nodes[number]
        if node.zero:
            return None
        if node.kind == CONSTANT and node.weights[0].is_number:
            return repr(float(node.weights[0]))
        return self._constant_name("U", number)

    def _constant_name(self, kind, number):
        """Return the local name of a constant of a run, kind U (value) or F (slope f′(U)), and give it a row."""
        self.constants.setdefault((kind, number), self.rows)
        self._used_constants.add((kind, number))
        return f"{kind}{number}"

    def _whole_name(self, number):
        """Return the local name of a node's value U + û_0 at the start of a step; None if it is 0."""
        if not self.graph.depends_on_states(number):
            return self._base_text(number)
        self._whole_texts[number] = self._start_text(number)
        return f"v{number}"

    def _deviation_name(self, number, order):
        """Return the local name of û_n of a node; None if it is 0."""
        return f"u{number}_{order}" if self.graph.depends_on_states(number) else None

    # -- the step

    def _term_lines(self, number, n):
        """Return the lines that compute û_n of a node."""
        node = self.graph.nodes[number]
        name = f"u{number}_{n}"
        if node.kind == STATE:
            (i,) = node.operands
            return [f"{name} = {f'x{i}' if n == 0 else self._rate_text(i, n)}"]
        if node.kind == ADD:
            return [f"{name} = {self._sum_text(node, n)}"]
        if node.kind == MUL:
            return [f"{name} = {self._product_text(*node.operands, n)}"]
        if node.kind == DIV:
            return self._quotient_lines(number, node, n, name)
        if node.kind == SOLVED:
            return self._solution_lines(number, n)
        return self._function_lines(number, node, n, name)

    def _rate_text(self, i, n):
        """Return the text of x_i's term of order n: h/n times the term n - 1 of its rate."""
        rate = self._deviation_name(self.graph.rates[i], n - 1)
        base = self._base_text(self.graph.rates[i]) if n == 1 else None
        sum_text = f"({rate} + {base})" if rate and base else rate or base
        return f"h{n} * {sum_text}" if sum_text else "0.0"

    def _sum_text(self, node, n):
        """Return the text of û_n of a weighted sum; "0.0" if no part depends on the states."""
        text = ""
        for weight, number in zip(node.weights, node.operands, strict=True):
            hat = self._deviation_name(number, n)
            if hat is None:
                continue
            sign = "-" if weight < 0 else "+"
            term = hat if abs(weight) == 1.0 else f"{abs(weight)!r} * {hat}"
            text = f"{text} {sign} {term}" if text else (f"-{term}" if sign == "-" else term)
        return text or "0.0"

    def _product_text(self, a, b, n):
        """Return the text of û_n of the product of nodes a and b (see (uv)_n in the module docstring)."""
        moves, of = self.graph.depends_on_states, self._base_text if n == 0 else self._whole_name
        if a == b:
            terms = [self._square_text(a, n), f"2.0 * {of(a)} * {self._deviation_name(a, n)}" if of(a) else ""]
        else:
            text = f"u{a}_0 * u{b}_0" if n == 0 else self._convolution_text(a, b, n, n - 1)
            terms = [text] if moves(a) and moves(b) else []
            terms += [f"{of(x)} * {self._deviation_name(y, n)}" for x, y in ((a, b), (b, a)) if moves(y) and of(x)]
        return " + ".join(filter(None, terms)) or "0.0"

    def _convolution_text(self, a, b, n, last):
        """Return the text of the sum of u_k v_(n-k) over k = 1 … last."""
        return " + ".join(f"u{a}_{k} * u{b}_{n - k}" for k in indices_newest_last(1, last))

    def _square_text(self, a, n):
        """Return the text of Σ u_k u_(n-k) over k = 1 … n - 1 of a node, each pair computed once."""
        pairs = " + ".join(f"u{a}_{k} * u{a}_{n - k}" for k in reversed(range(1, (n + 1) // 2)))
        middle = f"u{a}_{n // 2} * u{a}_{n // 2}" if n % 2 == 0 else ""
        return " + ".join(filter(None, (f"2.0 * ({pairs})" if pairs else "", middle)))

    def _quotient_lines(self, number, node, n, name):
        """Return the lines that assign û_n of a quotient; at n = 0 also the reciprocal of the divisor."""
        above, below = node.operands
        lines, terms = [], [self._deviation_name(above, n) or "0.0"]
        if n == 0:
            lines.append(f"r{number} = 1.0 / ({self._start_text(below)})")
        if text := self._convolution_text(below, number, n, n - 1):
            terms.append(f"({text})")
        if quotient := (self._base_text if n == 0 else self._whole_name)(number):
            terms.append(f"{quotient} * u{below}_{n}")
        return [*lines, f"{name} = ({' - '.join(terms)}) * r{number}"]

    def _solution_lines(self, number, n):
        """Return the lines for the n-th terms of coupled accelerations: a_0 v_n = f_n − Σ a_k v_(n−k), k > 0; once."""
        first, a, forces = self.graph.coupled(number)
        if number > first:
            return []
        lines = (
            [] if n else factor_lines({at: self._start_text(node) for at, node in a.items()}, len(forces), f"{first}_")
        )
        right = []
        for i, force in enumerate(forces):
            factors = [(a[i, j], first + j) for j in range(len(forces)) if n and self.graph.depends_on_states(a[i, j])]
            product_text = " + ".join(self._convolution_text(*pair, n, n) for pair in factors)
            right.append((self._deviation_name(force, n) or "0.0") + (f" - ({product_text})" if product_text else ""))
        names = [f"u{first + i}_{n}" for i in range(len(forces))]
        return [*lines, *solution_lines(right, names, f"{first}_")]

    def _start_text(self, number):
        """Return the text of a node's value at the start of a step."""
        terms = self._base_text(number), f"u{number}_0" if self.graph.depends_on_states(number) else None
        return " + ".join(filter(None, terms)) or "0.0"

    def _function_lines(self, number, node, n, name):
        """Return the lines that assign a function's remainder w̃_n and û_n = f′(U) û_n of its argument + w̃_n."""
        (inner,) = node.operands
        lines = [f"w{number}_{n} = {self._remainder_text(number, inner, n)}"]
        if self.graph.depends_on_states(inner):
            lines.append(f"{name} = {self._constant_name('F', number)} * u{inner}_{n} + w{number}_{n}")
        return lines

    def _remainder_text(self, number, inner, n):
        """Return the text of w̃_n of a function: its integrated value at n = 0, else a sum (module docstring)."""
        if n == 0:
            return f"w{number}"
        slope = self.graph.slopes[number]
        if not self.graph.depends_on_states(slope):
            return "0.0"
        terms = [f"{f'{k}.0 * ' if k > 1 else ''}u{inner}_{k} * u{slope}_{n - k}" for k in indices_newest_last(1, n)]
        return f"{1.0 / n!r} * ({' + '.join(terms)})" if n > 1 else terms[0]

    def _step_lines(self):
        """Return the lines that compute all terms of a step: order 0, values at the start, then orders 1 to ORDER."""
        functions = self.graph.slopes
        nodes = self.graph.dependencies([*self.graph.rates, *functions])
        last = self.graph.dependencies([self.graph.nodes[f].operands[0] for f in functions], slopes=False)
        first, lines = [], [f"h{n} = h * {1.0 / n!r}" for n in range(2, ORDER + 1)]
        for number in nodes:
            first += self._term_lines(number, 0)
        for n in range(1, ORDER + 1):
            lines += [f"x{i}_{n} = {self._rate_text(i, n)}" for i in range(self.n)]
            for number in last if n == ORDER else nodes:
                node = self.graph.nodes[number]
                if node.kind == STATE:
                    lines.append(f"u{number}_{n} = x{node.operands[0]}_{n}")
                else:
                    lines += self._term_lines(number, n)
        for number in functions:
            if number not in last:
                (inner,) = self.graph.nodes[number].operands
                lines.append(f"w{number}_{ORDER} = {self._remainder_text(number, inner, ORDER)}")
        return [*first, *(f"v{number} = {text}" for number, text in self._whole_texts.items()), *lines]

    def _sum_lines(self):
        """Yield the lines that store each state and remainder after the step: the sums of their terms."""
        names = [f"x{i}" for i in range(self.n)] + [f"w{k}" for k in self.remainders]
        for name, row in zip(names, [*range(self.n), *self.remainders.values()], strict=True):
            text = f"{name}_{ORDER}"
            for n in reversed(range(1, ORDER)):
                text = f"({text} + {name}_{n})"
            yield f"S[{row * W} + lane] = {text} + {name + '_0' if name[0] == 'w' else name}"

    # -- watched quantities

    def _check_lines(self):
        """Return the lines that store the deviations of the conserved quantities, over ε or ε²."""
        watched, moves = self.graph.drift_terms, self.graph.depends_on_states
        lines = [f"inverse = S[{self.inverse_row * W} + lane]"] if watched else []
        for number in self.graph.dependencies([k for _, terms in watched for k in terms], slopes=False):
            lines += self._term_lines(number, 0)
        for number in self.graph.dependencies(
            [k for kind, terms in watched if kind != FIRST for k in terms], slopes=False
        ):
            lines.append(f"t{number} = {self._second_order_text(number)}")
        for row, (kind, terms) in enumerate(watched, self.drift_row):
            names = [f"{'u' if kind == FIRST else 't'}{k}{'_0' if kind == FIRST else ''}" for k in terms if moves(k)]
            text = " + ".join(f"abs({name})" if kind == ABSOLUTE else name for name in names)
            per = "inverse" if kind == FIRST else "inverse * inverse"
            lines.append(f"S[{row * W} + lane] = ({text or '0.0'}) * ({per})")
        return lines

    def _second_order_text(self, number):
        """Return the text of a node's second-order remainder ũ (see the module docstring of `graph`, Energy)."""
        node = self.graph.nodes[number]
        moves, factors = self.graph.depends_on_states, node.operands
        if node.kind == STATE:
            return "0.0"
        if node.kind == ADD:
            pairs = zip(node.weights, factors, strict=True)
            return " + ".join(f"{w!r} * t{k}" for w, k in pairs if moves(k)) or "0.0"
        if node.kind == FUNCTION:
            return f"{self._constant_name('F', number)} * t{factors[0]} + w{number}_0"
        a, b = factors
        if node.kind == MUL:
            terms = [f"{self._base_text(f)} * t{s}" for f, s in ((a, b), (b, a)) if self._base_text(f) and moves(s)]
            terms += [f"u{a}_0 * u{b}_0"] if moves(a) and moves(b) else []
            return " + ".join(terms) or "0.0"
        above = f"t{a}" if moves(a) else "0.0"
        value = f" - {self._constant_name('U', number)} * t{b}" if not node.zero else ""
        return f"({above}{value} - u{number}_0 * u{b}_0) / {self._base_text(b) or '0.0'}"

    # -- the module

    def _with_loads(self, body):
        """Return the text of a body after the lines that load its variables."""
        return "\n".join([*self._load_lines(), *body])

    def _load_lines(self):
        """Return the lines that load states, remainders, the step and the used constants from the scratch array."""
        constant_keys = sorted(self._used_constants, key=lambda key: self.constants[key])
        loads = [f"x{i} = S[{i * W} + lane]" for i in range(self.n)]
        loads += [f"w{k} = S[{row * W} + lane]" for k, row in self.remainders.items()]
        loads += [f"h = S[{self.step_row * W} + lane]", "h1 = h"]
        return loads + [f"{kind}{k} = S[{self.constants[kind, k] * W} + lane]" for kind, k in constant_keys]

    def _module_text(self):
        """Return the source of the module, with the functions `advance` and `check`."""
        check = WRAPPER_TEXT.format(lines=self._with_loads(self._check_lines()), **CHECK)
        self._used_constants = set()
        advance = ADVANCE.format(lines=self._with_loads([*self._step_lines(), *self._sum_lines()]))
        return "\n\n".join([HEADER.format(title=self.title, order=ORDER, W=W), advance, check])

    def integrator(self):
        """Return the compiled functions and the number of states, a `kernels.flow.runs.Integrator`."""
        from kernels.flow.runs import Integrator  # compiled by its import

        module = self.module()
        return Integrator(module.advance, module.check, self.states)


def factor_lines(a: dict, m: int, mark: str) -> list[str]:
    """Return the lines that factorise `a` = L D Lᵀ (l, and r = 1/D), `m` × `m`; `mark` distinguishes their names."""
    places = [(i, j) for i in range(m) for j in range(i, m)]
    lines = [f"a{mark}{i}_{j} = {a[i, j]}" for i, j in places]
    for k in range(m):
        lines.append(f"r{mark}{k} = 1.0 / a{mark}{k}_{k}")
        lines += [f"l{mark}{i}_{k} = a{mark}{k}_{i} * r{mark}{k}" for i in range(k + 1, m)]
        lines += [f"a{mark}{i}_{j} = a{mark}{i}_{j} - l{mark}{i}_{k} * a{mark}{k}_{j}" for i, j in places if i > k]
    return lines


def solution_lines(right: list[str], names: list[str], mark: str) -> list[str]:
    """Return the lines that assign the solution of L D Lᵀ x = right to names, with the factors of this mark."""
    m, lines = len(names), []
    for i, text in enumerate(right):
        lines.append(f"y{mark}{i} = {' - '.join([text, *(f'l{mark}{i}_{k} * y{mark}{k}' for k in range(i))])}")
    for i in reversed(range(m)):
        products = [f"l{mark}{j}_{i} * {names[j]}" for j in reversed(range(i + 1, m))]
        lines.append(f"{names[i]} = {' - '.join([f'r{mark}{i} * y{mark}{i}', *products])}")
    return lines


def indices_newest_last(first: int, n: int) -> list[int]:
    """Return k = first … n in the order in which the products u_k v_(n-k) can be computed."""
    return sorted(range(first, n + 1), key=lambda k: max(k, n - k))


def _write_module(folder: Path, name: str, text: str) -> Path:
    """Write a file that only the user can read, atomically, and return its path."""
    path = folder / f"{name}.py"
    if not path.is_file() or path.read_text() != text:
        with replace_output(path, flush=False) as temporary:
            temporary.chmod(0o600)
            temporary.write_text(text)
    return path
