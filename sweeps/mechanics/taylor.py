r"""The integrator of a system: its Taylor series of order 12, written out as one straight line for 32 lanes.

It is the integrator of :mod:`kernels.direct` for any right-hand side: with terms :math:`u_n` (coefficient times h^n)
each node of the graph gives its n-th term from the ones before it,

.. math:: (uv)_n = U v_n + V u_n + \varepsilon\sum_{k=0}^n u_k v_{n-k}, \qquad
          (u/v)_n = \Big(u_n - W v_n - \varepsilon\sum_{k=1}^n v_k w_{n-k}\Big)\Big/(V + \varepsilon v_0), \qquad
          \tilde w_n = \frac1n\sum_{k=1}^n k\,u_k\,g_{n-k}

(all in deviations; g = f'(u), and :math:`w_n = f'(U)u_n + \varepsilon\tilde w_n`), and
:math:`x_{n+1} = h v_n/(n+1)`, :math:`v_{n+1} = h a_n/(n+1)`. A Taylor step was preferred to a Runge-Kutta one of
order 8: it needs no sine or power inside the loop over lanes, its terms are relative to the nudge, and for Euler's
equations it is the very step that the rigid body takes.

The code is a Python module of its own, whose straight lines :mod:`kernels.straight` hands to LLVM: a file that
is named by the hash of its text, in the cache folder of the kernels, so that Numba's disk cache holds from one process
to the next, and the hash is part of a map's `kernel_fingerprint`.
"""

import hashlib
import importlib.util
import sys
from functools import cached_property
from pathlib import Path

from kernels.blocks import W
from kernels.cache import cache_folder
from kernels.oscillations import ORDER
from sweeps.files import replaced
from sweeps.mechanics.graph import ADD, CONSTANT, DIV, FUNCTION, MUL, Graph, V, X

HEADER = '''"""{title}: one Taylor step of order {order}, and the energy above the equilibrium, for {W} lanes."""

from kernels.jit import PASSED, njit
from kernels.straight import lines

COORDINATES, STATES, ROWS = {n}, {states}, {rows}
'''

ADVANCE = '''STEP = lines("""
{lines}
""")


@njit("void(float64[::1], int64)", **PASSED)
def advance(S, steps):
    """Advance every lane by so many steps."""
    for _ in range(steps):
        for lane in range({W}):
            STEP(S, lane)
'''
TOLD = '''TOLD = lines("""
{lines}
""")


@njit("void(float64[::1])", **PASSED)
def {name}(S):
    """Write {what}."""
    for lane in range({W}):
        TOLD(S, lane)
'''

COMPILE_SECONDS, COMPILE_SECONDS_PER_CHARACTER = 0.3, 4e-5
SAMPLES_TIMES_CHARACTERS = 4e10


class Code:
    """The rows of the scratch array and the text of the module.

    Rows, each W long: x and v of every coordinate, energy and its absolute terms, the functions' remainders, epsilon,
    the step, and what is constant along a run.

    Args:
        graph: the system's graph.
    """

    kernels: tuple[str, ...] = ("straight",)  # modules that the generated one imports beside what every system needs

    def __init__(self, graph: Graph):
        self.graph = graph
        self.n = graph.equations.n
        self.energy_row = 2 * self.n
        self.remainders = {number: 2 * self.n + 2 + k for k, number in enumerate(graph.functions)}
        self.states = 2 * self.n + 2 + len(self.remainders)
        self.epsilon_row, self.step_row = self.states, self.states + 1
        self.constants: dict[tuple[str, int], int] = {}
        self._used: set = set()
        self.text = self._text()

    @property
    def rows(self) -> int:
        """Number of rows of the scratch array."""
        return self.states + 2 + len(self.constants)

    @property
    def compile_seconds(self) -> float:
        """What its module takes to be compiled on a core of 2024, s, about."""
        return COMPILE_SECONDS + COMPILE_SECONDS_PER_CHARACTER * len(self.text)

    @property
    def samples_per_second(self) -> int:
        """Samples of runs, of six motions each, that one core makes in a second, about."""
        return int(SAMPLES_TIMES_CHARACTERS / len(self.text))

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the text, 64 hexadecimal digits."""
        return hashlib.sha256(self.text.encode()).hexdigest()

    @property
    def name(self) -> str:
        """Name of the module."""
        return f"oscillator_{self.digest[:24]}"

    # -- names in the text

    def _base(self, number):
        """Text of U of a node: a literal, or the local of its row; None where it is 0 for a reason."""
        node = self.graph.nodes[number]
        if node.zero:
            return None
        if node.kind == CONSTANT and node.weights[0].is_number:
            return repr(float(node.weights[0]))
        return self._constant("U", number)

    def _constant(self, kind, number):
        self.constants.setdefault((kind, number), self.states + 2 + len(self.constants))
        self._used.add((kind, number))
        return f"{kind}{number}"

    def _hat(self, number, order):
        return f"u{number}_{order}" if self.graph.moves(number) else None

    # -- the step

    def _needed(self, roots):
        """The nodes that some nodes stand on, functions' slopes with them, in order."""
        found, stack = set(), list(roots)
        while stack:
            number = stack.pop()
            if number in found or not self.graph.moves(number):
                continue
            found.add(number)
            node = self.graph.nodes[number]
            if node.kind in (ADD, MUL, DIV, FUNCTION):
                stack += node.parts
            if node.kind == FUNCTION:
                stack.append(self.graph.slopes[number])
        return sorted(found)

    def _inner(self, roots):
        """The nodes that some nodes stand on at one order."""
        found, stack = set(), list(roots)
        while stack:
            number = stack.pop()
            if number not in found and self.graph.moves(number):
                found.add(number)
                node = self.graph.nodes[number]
                stack += node.parts if node.kind in (ADD, MUL, DIV, FUNCTION) else ()
        return sorted(found)

    def _term(self, number, n):
        """Lines that give the n-th term of a node."""
        node = self.graph.nodes[number]
        name = f"u{number}_{n}"
        if node.kind in (X, V):
            return [f"{name} = {self._state_term(node, n)}"]
        if node.kind == ADD:
            return [f"{name} = {self._sum(node, n)}"]
        if node.kind == MUL:
            return [f"{name} = {self._product(*node.parts, n)}"]
        if node.kind == DIV:
            return self._quotient(number, node, n, name)
        return self._function(number, node, n, name)

    def _state_term(self, node, n):
        (i,) = node.parts
        if n == 0:
            return ("x" if node.kind == X else "v") + str(i)
        return self._rate(node.kind, i, n)

    def _rate(self, kind, i, n):
        if kind == X:
            return f"h{n} * v{i}_{n - 1}" if n > 1 else f"h1 * v{i}"
        acceleration = self._hat(self.graph.accelerations[i], n - 1)
        return f"h{n} * {acceleration}" if acceleration else "0.0"

    def _sum(self, node, n):
        text = ""
        for weight, number in zip(node.weights, node.parts, strict=True):
            hat = self._hat(number, n)
            if hat is None:
                continue
            sign = "-" if weight < 0 else "+"
            term = hat if abs(weight) == 1.0 else f"{abs(weight)!r} * {hat}"
            text = f"{text} {sign} {term}" if text else (f"-{term}" if sign == "-" else term)
        return text or "0.0"

    def _product(self, a, b, n):
        terms = []
        for first, second in ((a, b), (b, a)):
            base, hat = self._base(first), self._hat(second, n)
            if base is not None and hat is not None:
                terms.append(f"{base} * {hat}")
        if a == b and len(terms) == 2:
            terms = [f"2.0 * {terms[0]}"]
        if self.graph.moves(a) and self.graph.moves(b):
            terms.append(f"epsilon * ({self._square(a, n) if a == b else self._convolution(a, b, 0, n)})")
        return " + ".join(terms) or "0.0"

    def _convolution(self, a, b, first, n):
        return " + ".join(f"u{a}_{k} * u{b}_{n - k}" for k in range(first, n + 1))

    def _square(self, a, n):
        pairs = " + ".join(f"u{a}_{k} * u{a}_{n - k}" for k in range((n + 1) // 2))
        middle = f"u{a}_{n // 2} * u{a}_{n // 2}" if n % 2 == 0 else ""
        return " + ".join(filter(None, (f"2.0 * ({pairs})" if pairs else "", middle)))

    def _quotient(self, number, node, n, name):
        above, below = node.parts
        lines, terms = [], [self._hat(above, n) or "0.0"]
        if n == 0:
            base = self._base(below)
            lines.append(f"r{number} = 1.0 / ({base + ' + ' if base else ''}epsilon * u{below}_0)")
        if not node.zero:
            terms.append(f"{self._constant('U', number)} * u{below}_{n}")
        if n > 0:
            convolution = " + ".join(f"u{below}_{k} * u{number}_{n - k}" for k in range(1, n + 1))
            terms.append(f"epsilon * ({convolution})")
        return [*lines, f"{name} = ({' - '.join(terms)}) * r{number}"]

    def _function(self, number, node, n, name):
        (inner,) = node.parts
        lines = [f"w{number}_{n} = {self._remainder(number, inner, n)}"]
        if self.graph.moves(inner):
            lines.append(f"{name} = {self._constant('F', number)} * u{inner}_{n} + epsilon * w{number}_{n}")
        return lines

    def _remainder(self, number, inner, n):
        if n == 0:
            return f"w{number}"
        slope = self.graph.slopes[number]
        if not self.graph.moves(slope):
            return "0.0"
        terms = [f"{f'{k}.0 * ' if k > 1 else ''}u{inner}_{k} * u{slope}_{n - k}" for k in range(1, n + 1)]
        return f"{1.0 / n!r} * ({' + '.join(terms)})" if n > 1 else terms[0]

    def _step_lines(self):
        functions, accelerations = self.graph.functions, self.graph.accelerations
        nodes = self._needed([*accelerations, *functions])
        last = self._inner([self.graph.nodes[f].parts[0] for f in functions])
        lines = [f"h{n} = h * {1.0 / n!r}" for n in range(2, ORDER + 1)]
        for n in range(ORDER + 1):
            for i in range(self.n):
                if n:
                    lines += [f"x{i}_{n} = {self._rate(X, i, n)}", f"v{i}_{n} = {self._rate(V, i, n)}"]
            for number in last if n == ORDER else nodes:
                node = self.graph.nodes[number]
                if node.kind in (X, V) and n:
                    lines.append(f"u{number}_{n} = {'x' if node.kind == X else 'v'}{node.parts[0]}_{n}")
                else:
                    lines += self._term(number, n)
        for number in functions:
            if number not in last:
                inner = self.graph.nodes[number].parts[0]
                lines.append(f"w{number}_{ORDER} = {self._remainder(number, inner, ORDER)}")
        return lines

    def _sums(self):
        names = [f"{kind}{i}" for kind in "xv" for i in range(self.n)] + [f"w{k}" for k in self.remainders]
        rows = [*range(2 * self.n), *self.remainders.values()]
        for name, row in zip(names, rows, strict=True):
            text = f"{name}_{ORDER}"
            for n in reversed(range(1, ORDER)):
                text = f"({text} + {name}_{n})"
            start = f"{name}_0" if name[0] == "w" else name
            yield f"S[{row * W} + lane] = {text} + {start}"

    # -- the energy

    def _energy_lines(self):
        """K + Ṽ and K + Σ|terms of Ṽ|, both over ε²."""
        terms, masses = self.graph.energy_terms, self.graph.masses
        lines = []
        for number in self._inner([*terms, *masses.values()]):
            lines += self._term(number, 0)
        for number in self._inner(terms):
            lines.append(f"t{number} = {self._second(number)}")
        kinetic = []
        for (i, j), number in masses.items():
            base, hat = self._base(number), self._hat(number, 0)
            full = " + ".join(filter(None, (base, f"epsilon * {hat}" if hat else None)))
            if full:
                kinetic.append(f"{'0.5 * ' if i == j else ''}({full}) * v{i} * v{j}")
        lines.append(f"kinetic = {' + '.join(kinetic)}")
        moving = [f"t{k}" for k in terms if self.graph.moves(k)]
        lines.append(f"S[{self.energy_row * W} + lane] = {' + '.join(['kinetic', *moving])}")
        absolute = " + ".join(["abs(kinetic)", *(f"abs({t})" for t in moving)])
        lines.append(f"S[{(self.energy_row + 1) * W} + lane] = {absolute}")
        return lines

    def _second(self, number):
        node = self.graph.nodes[number]
        moves, parts = self.graph.moves, node.parts
        if node.kind in (X, V):
            return "0.0"
        if node.kind == ADD:
            pairs = zip(node.weights, parts, strict=True)
            return " + ".join(f"{w!r} * t{k}" for w, k in pairs if moves(k)) or "0.0"
        if node.kind == FUNCTION:
            return f"{self._constant('F', number)} * t{parts[0]} + w{number}_0"
        a, b = parts
        if node.kind == MUL:
            terms = [f"{self._base(f)} * t{s}" for f, s in ((a, b), (b, a)) if self._base(f) and moves(s)]
            terms += [f"u{a}_0 * u{b}_0"] if moves(a) and moves(b) else []
            return " + ".join(terms) or "0.0"
        above = f"t{a}" if moves(a) else "0.0"
        value = f" - {self._constant('U', number)} * t{b}" if not node.zero else ""
        return f"({above}{value} - u{number}_0 * u{b}_0) / {self._base(b) or '0.0'}"

    # -- the module

    def _straight(self, body):
        """Lines of text: the loads of what a body uses, and the body."""
        return "\n".join([*self._loads(), *body])

    def _loads(self):
        used = sorted(self._used, key=lambda key: self.constants[key])
        loads = [f"x{i} = S[{i * W} + lane]" for i in range(self.n)]
        loads += [f"v{i} = S[{(self.n + i) * W} + lane]" for i in range(self.n)]
        loads += [f"w{k} = S[{row * W} + lane]" for k, row in self.remainders.items()]
        loads += [f"epsilon = S[{self.epsilon_row * W} + lane]", f"h = S[{self.step_row * W} + lane]", "h1 = h"]
        return loads + [f"{kind}{k} = S[{self.constants[kind, k] * W} + lane]" for kind, k in used]

    def _text(self):
        advance = ADVANCE.format(lines=self._straight([*self._step_lines(), *self._sums()]), W=W)
        self._used = set()
        what = "energy above the equilibrium and the sum of its absolute terms, over epsilon²"
        energy = TOLD.format(lines=self._straight(self._energy_lines()), name="energy", what=what, W=W)
        numbers = {"n": self.n, "states": self.states, "rows": self.rows}
        header = HEADER.format(title=self.graph.equations.system.title, order=ORDER, W=W, **numbers)
        return "\n\n".join([header, advance, energy])

    @property
    def path(self) -> Path:
        """The module's file, written where it is not there."""
        return _written(cache_folder() / "generated", self.name, self.text)

    def module(self):
        """Return the compiled module: functions `advance(S, steps)` and `energy(S)`."""
        return sys.modules.get(self.name) or load(self.path)


def load(path: Path):
    """Import a generated file, which compiles it or finds it in the cache of kernels."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[path.stem]
        raise
    return module


def _written(folder: Path, name: str, text: str) -> Path:
    """The path of a file with this text, which is the user's alone; no process sees half of it."""
    path = folder / f"{name}.py"
    if not path.is_file() or path.read_text() != text:
        with replaced(path, flush=False) as temporary:
            temporary.chmod(0o600)
            temporary.write_text(text)
    return path
