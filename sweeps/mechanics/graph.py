r"""The equations of motion as a graph of additions, products, quotients and known functions, about an equilibrium.

*Deviations.* With :math:`q = q_0 + x` every node is :math:`u = U + \hat u`, U its value at the equilibrium, and the
graph is worked in :math:`\hat u` alone,

.. math:: \widehat{uv} = U\hat v + v\hat u, \qquad \widehat{u/v} = (\hat u - W\hat v)/v, \qquad W = U/V

so that no perturbation is too small: no numbers of the size of q0 are subtracted. If U vanishes by definition (a
velocity, a force at its equilibrium), it is exactly 0, without a rounding.

*Functions.* A function :math:`w = f(u)` keeps its remainder :math:`\tilde w`,
:math:`\hat w = f'(U)\,\hat u + \tilde w`, which obeys
:math:`\dot{\tilde w} = \widehat{f'(u)}\;\dot{\hat u}` and is integrated with the states. So the integrator needs no
sine and no power: sums, products and quotients are all that is left, whatever the system.

*Energy.* One order further, :math:`u = U + \nabla u\cdot x + \tilde u`, with
:math:`\widetilde{uv} = U\tilde v + V\tilde u + \hat u\hat v` and so on. For V the gradient vanishes at the equilibrium,
so :math:`\tilde V` is its rise above the equilibrium, to all digits.

*Few products of series.* If :math:`d = B^{-1/2}` occurs, every inverse power of B is a power of d, with the slope
-d³/2; in products tan u is sin u / cos u if these occur; a product is divided factor by factor, the longest one first,
so that terms with the same divisor are divided once; and the state that most terms of a sum share is factored out.

Source: the recurrences are those of automatic differentiation (Griewank and Walther, Evaluating Derivatives, chapter
13); working them in deviations was derived here.
"""

from dataclasses import dataclass

import numpy as np
import sympy as sp
from scipy import special
from scipy.sparse.csgraph import connected_components

from sweeps.schema.refusals import DescriptionError

CONSTANT, STATE, ADD, MUL, DIV, FUNCTION, SOLVED = "constant", "x", "add", "mul", "div", "function", "solved"
FIRST, SECOND, ABSOLUTE = range(3)
MAX_PRODUCT_POWER = 16  # whole powers up to this one are written as products
# modules that evaluate SymPy's functions; the first that knows a function is used
MODULES = [{"erf": special.erf}, "scipy", "numpy"]
TINY = sp.Float(1e-290)  # changes no number but 0, to sixteen digits


@dataclass(frozen=True)
class Node:
    """One node."""

    kind: str  #: CONSTANT (of parameters), STATE, ADD, MUL, DIV, FUNCTION or SOLVED
    #: numbers of the nodes it is made of; the state's index for STATE; for SOLVED a's upper triangle by rows, then f
    operands: tuple = ()
    #: for ADD one number a part; the expression of a CONSTANT; the FUNCTION; of SOLVED the row, and how many there are
    weights: tuple = ()
    zero: bool = False  #: its value at the equilibrium is exactly 0


class Graph:
    """Nodes in topological order, the functions' derivatives, and the outputs.

    `near`: deviations are from an equilibrium, at which velocities and forces vanish; else the states themselves are
    the deviations (U = 0), and the time is the last state.
    """

    def __init__(self, equations, near: bool = True):
        self.equations, self.near = equations, near
        #: symbols of the states, in the order of the rates
        self.states = equations.states if near else (*equations.states, equations.system.time)
        self.nodes: list[Node] = []
        #: FUNCTION node → the node of f′(u), which may have a larger number: only earlier orders of it are needed
        self.slopes: dict[int, int] = {}
        self.rates: tuple[int, ...] = ()  #: nodes of ẋ_i
        #: (FIRST, SECOND or ABSOLUTE, nodes) of each quantity that a run watches: the deviation of their sum in units
        #: of ε, or of ε², or the sum of the absolute values of the latter
        self.drift_terms: tuple[tuple[int, tuple[int, ...]], ...] = ()
        self._numbers: dict[Node, int] = {}
        self._expressions: dict[sp.Expr, int] = {}
        self._state_symbols, quantities = {*self.states}, equations.system.conserved_quantities.values()
        all_terms = sp.Tuple(*equations.f, equations.V, *quantities)
        self._roots = {p.base for p in all_terms.atoms(sp.Pow) if p.exp.is_Rational and p.exp.q == 2 and p.exp < 0}
        self._turns = {e.args[0] for e in all_terms.atoms(sp.sin, sp.cos)}

    def add(self, node: Node) -> int:
        """Add a node unless it is there already, and return its number."""
        if node not in self._numbers:
            self._numbers[node] = len(self.nodes)
            self.nodes.append(node)
        return self._numbers[node]

    def steepness(self, number: int) -> float | None:
        """Return n of a FUNCTION node u^n with a large n, 0 for exponentials, None for functions without pulses."""
        function = self.nodes[number].weights[0].expr
        if function.is_Pow and function.exp.is_number and function.exp > MAX_PRODUCT_POWER:
            return float(function.exp)
        return 0.0 if function.has(sp.exp, sp.sinh, sp.cosh, sp.tanh) else None

    def depends_on_states(self, number: int) -> bool:
        """Return True if a node depends on the states (or, far from equilibria, on the time)."""
        return self.nodes[number].kind != CONSTANT

    def dependencies(self, roots, slopes: bool = True) -> list[int]:
        """Return in ascending order the nodes on which `roots` depend, with these, except constants.

        With `slopes` also those on which the slopes f′ of functions depend, which orders above 0 need.
        """
        nodes, stack = set(), list(roots)
        while stack:
            number = stack.pop()
            if number not in nodes and self.depends_on_states(number):
                nodes.add(number)
                node = self.nodes[number]
                stack += node.operands if node.kind != STATE else ()
                stack += [self.slopes[number]] if slopes and node.kind == FUNCTION else []
        return sorted(nodes)

    # -- building

    def build(self, expression: sp.Expr) -> int:
        """Return the node of an expression in states and parameters."""
        expression = sp.sympify(expression)
        if expression not in self._expressions:
            self._expressions[expression] = self._build_node(expression)
        return self._expressions[expression]

    def _build_node(self, e):
        """Return the node of an expression that has none yet; refuse functions without a recurrence."""
        if not e.free_symbols & self._state_symbols:
            return self.add(Node(CONSTANT, (), (e,), e == 0))
        if e.is_Symbol:
            return self.add(Node(STATE, (self.states.index(e),), (), self.near and e in self.equations.still))
        if e.is_Add:
            return self._build_sum(e)
        if e.is_Mul:
            return self._build_product(e)
        if e.is_Pow:
            return self._build_power(*e.as_base_exp()) if e.base != sp.E else self._build_function(e, e.exp)
        if e.func is sp.cosh and not self.near:  # beside sinh, a rounding where it is large would grow on its way back
            return self.build((sp.exp(e.args[0]) + sp.exp(-e.args[0])) / 2)
        if e.is_Function and len(e.args) == 1:
            return self._build_function(e, e.args[0])
        raise DescriptionError(
            f"{type(e).__name__}: {e} cannot be integrated; allowed: +, ×, /, powers and {_ALLOWED_FUNCTIONS}"
        )

    def sum(self, numbers, weights=None, zero=False) -> int:
        """Return the node of Σ `weights` `numbers`; with `zero` its value at the equilibrium vanishes."""
        weights = tuple(weights) if weights else (1.0,) * len(numbers)
        if not any(map(self.depends_on_states, numbers)):
            terms = (w * self.nodes[k].weights[0] for k, w in zip(numbers, weights, strict=True))
            return self.build(sum(terms))
        is_zero = all(self.nodes[k].zero for k in numbers)
        if weights == (1.0,) and is_zero >= zero:
            return numbers[0]
        return self.add(Node(ADD, tuple(numbers), weights, zero or is_zero))

    def product(self, first: int, second: int) -> int:
        """Return the node of the product of two nodes."""
        if not (self.depends_on_states(first) or self.depends_on_states(second)):
            return self.build(self.nodes[first].weights[0] * self.nodes[second].weights[0])
        zero = self.nodes[first].zero or self.nodes[second].zero
        for factor, cofactor in ((first, second), (second, first)):
            if not self.depends_on_states(factor) and self.nodes[factor].weights[0].is_number:
                return self.sum((cofactor,), (float(self.nodes[factor].weights[0]),), zero)
        return self.add(Node(MUL, tuple(sorted((first, second))), (), zero))

    def quotient(self, first: int, second: int) -> int:
        """Return the node of the quotient of two nodes."""
        if not self.depends_on_states(second):
            return self.product(first, self.build(1 / self.nodes[second].weights[0]))
        return self.add(Node(DIV, (first, second), (), self.nodes[first].zero))

    def solve_nodes(self, a: sp.Matrix, forces: list[int]) -> list[int]:
        """Return the nodes of a⁻¹ f, a symmetric and positive definite; coupled rows are solved together."""
        solution = {}
        count, block = connected_components(np.array(a.tolist()) != 0, directed=False)
        for rows in (np.flatnonzero(block == k).tolist() for k in range(count)):
            masses = [self.build(a[i, j]) for at, i in enumerate(rows) for j in rows[at:]]
            right = [forces[i] for i in rows]
            if len(rows) == 1:
                solution[rows[0]] = self.quotient(*right, *masses)
                continue
            for at, i in enumerate(rows):
                solution[i] = self.add(Node(SOLVED, (*masses, *right), (at, len(rows)), self.near))
        return [solution[i] for i in range(len(forces))]

    def coupled(self, number: int) -> tuple[int, dict, tuple]:
        """Return (first node, a's entries by (i, j), f) of the linear system a x = f with a SOLVED node as one x_i."""
        node = self.nodes[number]
        row, m = node.weights
        a = dict(zip(((i, j) for i in range(m) for j in range(i, m)), node.operands, strict=False))
        return number - row, a | {(j, i): entry for (i, j), entry in a.items()}, node.operands[-m:]

    def build_zero(self, expression) -> int:
        """Return the node of a value that vanishes at an equilibrium: its base is exactly 0 there, without rounding."""
        number = self.build(expression)
        return self.sum((number,), zero=True) if self.near else number

    def _build_sum(self, e):
        """Return the node of a sum: common states factored out, terms that differ by a number joined."""
        shared = _factor_out(e, self._state_symbols)
        if shared is not e:
            return self.build(shared)
        factors = {}
        for term in e.args:
            factor, moving_term = term.as_independent(*self._state_symbols, as_Add=False)
            factors[moving_term] = factors.get(moving_term, 0) + factor
        weighted_terms = [(factor * moving_term).as_coeff_Mul() for moving_term, factor in factors.items()]
        weights = [float(weight) for weight, _ in weighted_terms]
        return self.sum([self.build(term) for _, term in weighted_terms], weights)

    def _build_product(self, e):
        """Return the node of a product: factors with negative whole powers divide, the longest factors first."""
        tangents = {sp.tan(u): sp.sin(u) / sp.cos(u) for u in self._turns}
        factors = [subfactor for f in e.args for subfactor in sp.Mul.make_args(tangents.get(f, f))]
        constants = [f for f in factors if not f.free_symbols & self._state_symbols]
        moving_factors = [f for f in factors if f.free_symbols & self._state_symbols]
        above, below = [], []
        for factor in sorted(moving_factors, key=lambda f: (-f.count_ops(), str(f))):
            base, exponent = factor.as_base_exp()
            divides = exponent.is_Integer and exponent < 0 and self._inverse_root(base) is None
            (below if divides else above).append(1 / factor if divides else factor)
        result = self.build(above[0]) if above else self.build(sp.Integer(1))
        for factor in below:
            result = self.quotient(result, self.build(factor))
        for factor in above[1:]:
            result = self.product(result, self.build(factor))
        return self.product(self.build(sp.Mul(*constants)), result) if constants else result

    def _inverse_root(self, base):
        """Return (B, sign) if a base is ±B and B^(-1/2) occurs; else None."""
        for root in self._roots if base.free_symbols & self._state_symbols else ():
            for sign in (1, -1):
                if sp.expand(root - sign * base) == 0:
                    return root, sign
        return None

    def _build_power(self, base, exponent):
        """Return the node of base^exponent; a product of d = B^(-1/2) if the base is ±B and d occurs."""
        root = self._inverse_root(base) if exponent.is_Rational and (exponent.q == 2 or exponent < 0) else None
        if root is None or exponent.q > 2 or abs(exponent) > MAX_PRODUCT_POWER:
            return self._build_plain_power(base, exponent)
        (B, sign), is_whole = root, exponent.q == 1
        e = B ** sp.Rational(-1, 2)
        d = self._expressions[e] if e in self._expressions else self._build_function(e, B)
        if exponent == e.exp:
            return d
        if exponent > 0:
            return self.product(d, self._build_power_by_squaring(self.build(B), int(exponent + sp.Rational(1, 2))))
        power = self._build_power_by_squaring(self.product(d, d), int(-exponent))
        if is_whole:
            return power if sign ** int(exponent) == 1 else self.sum((power,), (-1.0,))
        return self.product(d, power)

    def _build_plain_power(self, base, exponent):
        """Return the node of base^exponent: products of the base for small whole exponents, else a FUNCTION node."""
        if exponent.is_Integer and abs(exponent) <= MAX_PRODUCT_POWER:
            if exponent < 0:
                return self.quotient(self.build(sp.Integer(1)), self._build_power(base, -exponent))
            half = self.build(base) if exponent == 1 else self.build(base ** (exponent // 2))
            if exponent == 1:
                return half
            square = self.product(half, half)
            return square if exponent % 2 == 0 else self.product(square, self.build(base))
        if exponent.free_symbols & self._state_symbols:
            fault = f"{base**exponent} has a coordinate in its exponent"
            raise DescriptionError(f"power: {fault}; allowed: exp(…) in its place")
        return self._build_function(base**exponent, base)

    def _build_power_by_squaring(self, number, exponent):
        """Return the node of a node's whole power, by repeated squaring."""
        if exponent == 1:
            return number
        half = self._build_power_by_squaring(number, exponent // 2)
        square = self.product(half, half)
        return self.product(square, number) if exponent % 2 else square

    def _build_function(self, e, argument):
        """Return the FUNCTION node of f(argument), f the function of `e`, and add the node of its slope f′."""
        u = sp.Dummy("u", positive=True)
        f = (u**e.exp) if e.is_Pow and e.base != sp.E else e.func(u) if not e.is_Pow else sp.exp(u)
        inner = self.build(argument)
        number = self.add(Node(FUNCTION, (inner,), (sp.Lambda(u, f),)))
        self._expressions[e] = number
        if number not in self.slopes:
            self.slopes[number] = -1
            self.slopes[number] = self._build_slope(e, sp.Lambda(u, f), argument, number, inner)
        return number

    def _build_slope(self, e, of_u, argument, number, inner):
        """Return the node of f′(u), written with the node of f where that is shorter.

        Args:
            e: the expression f(argument).
            of_u: f as a `sympy.Lambda`.
            argument: the expression u.
            number: node of f.
            inner: node of u.
        """
        if e.is_Pow and e.base in self._roots:
            return self.product(self.build(sp.Rational(-1, 2)), self.product(number, self.product(number, number)))
        if e.is_Pow and e.base != sp.E:
            # of a high whole power the slope at 0 is 0, not 0/0
            below = self.sum((inner, self.build(TINY))) if e.exp.is_Integer and e.exp > 0 else inner
            return self.quotient(self.product(self.build(e.exp), number), below)
        f = of_u.expr
        if f.func is sp.tan:
            return self.sum((self.build(sp.Integer(1)), self.product(number, number)))
        if f.func is sp.tanh:  # 1 - tanh^2 would lose its digits where tanh is near 1, and multiply the loss on return
            u = of_u.variables[0]
            slope = self.add(Node(FUNCTION, (inner,), (sp.Lambda(u, sp.cosh(u) ** -2),)))
            self.slopes[slope] = self.product(self.build(sp.Integer(-2)), self.product(number, slope))
            return slope
        if f.func not in _INTEGRATED:
            raise DescriptionError(
                f"function: {e} cannot be integrated; allowed: +, ×, /, powers and {_ALLOWED_FUNCTIONS}"
            )
        return self.build(f.diff(*of_u.variables).subs(of_u.variables[0], argument))


def _factor_out(e, moving):
    """Return a sum with the most frequent factor of its terms factored out, recursively."""
    terms = sp.Add.make_args(e)
    powers = [term.as_powers_dict().items() for term in terms]
    factors = [{x for x, k in factors_of_term if x in moving and k.is_Integer and k > 0} for factors_of_term in powers]
    counts = {x: sum(x in f for f in factors) for x in sorted(moving, key=str)}
    factor = max(counts, key=counts.get, default=None)
    if factor is None or counts[factor] < 2:
        return e
    inside = sp.Add(*(term / factor for term, f in zip(terms, factors, strict=True) if factor in f))
    outside = sp.Add(*(term for term, f in zip(terms, factors, strict=True) if factor not in f))
    return sp.Mul(factor, _factor_out(inside, moving), evaluate=False) + _factor_out(outside, moving)


_ALLOWED_FUNCTIONS = "sin, cos, tan, exp, log, sinh, cosh, tanh, asin, acos, atan, asinh, acosh, atanh, erf, sqrt"
_INTEGRATED = (
    *(sp.sin, sp.cos, sp.exp, sp.log, sp.sinh, sp.cosh, sp.atan, sp.asin, sp.acos),
    *(sp.asinh, sp.acosh, sp.atanh, sp.erf),
)


# -- values in NumPy: one array element a point


def compile_expression(arguments, expressions, broadcast=True):
    """Return a NumPy function of arrays for the arguments that returns each expression as a float64 array.

    Args:
        arguments: symbols.
        expressions: of these symbols.
        broadcast: each result has the shape of all arguments together; else that of the arguments which it contains.
    """
    function = sp.lambdify(arguments, list(expressions), modules=MODULES, cse=True)

    def evaluate(*arrays):
        """Return the values of the expressions; refuse functions that neither NumPy nor SciPy has."""
        with np.errstate(all="ignore"):
            try:
                values = [np.real_if_close(v) if np.iscomplexobj(v) else np.asarray(v) for v in function(*arrays)]
            except NameError as error:
                fault = f"{error.name} has no values in NumPy or SciPy"
                raise DescriptionError(f"function: {fault}; allowed: functions that SymPy writes for them") from None
        if not broadcast:
            return [value.astype(np.float64, copy=False) for value in values]
        shape = np.broadcast_shapes(*(np.shape(x) for x in arrays)) if arrays else ()
        return [np.broadcast_to(value, shape).astype(np.float64) for value in values]

    return evaluate


def compile_table(arguments, expressions, shape):
    """Return a NumPy function (parameters, places) → array (points, *shape) of the values of expressions.

    Args:
        arguments: symbols of the parameters, then of the places; both are lists of arrays (points,).
        expressions: as many as `shape` has entries, in their order.
        shape: of the table of one point.
    """
    evaluate = compile_expression(arguments, expressions, broadcast=False)

    def table(parameters, places=()):
        """Return the table of each point."""
        values = evaluate(*parameters, *places)
        rows = np.empty((parameters[0].size, len(values)))
        for k, value in enumerate(values):
            rows[:, k] = value
        return rows.reshape(len(rows), *shape)

    return table


class Values:
    """Values at equilibria and deviations from them, by the same rules as the kernel's, in NumPy.

    Local variables `hat` contain deviations û. Functions' remainders are integrals, by a quadrature with so many nodes.
    Arguments of no function have no deviation here, and far from equilibria no value.
    """

    def __init__(self, graph: Graph, nodes: int):
        self.graph = graph
        self._parameters = graph.equations.parameters
        constants = [node.weights[0] if node.kind == CONSTANT else sp.Integer(0) for node in graph.nodes]
        self._constants = compile_expression(self._parameters, constants, broadcast=False)
        self._functions, self._second = {}, {}
        self._function_dependencies = graph.dependencies(graph.slopes, slopes=False)
        self._base_nodes = graph.dependencies(range(len(graph.nodes)) if graph.near else graph.slopes)
        nodes, weights = special.roots_jacobi(nodes, 1, 0)  # for the weight 1 − s
        self._quadrature = 0.5 * (nodes + 1.0), 0.25 * weights
        for number in graph.slopes:
            lam = graph.nodes[number].weights[0]
            (u,) = lam.variables
            self._functions[number] = compile_expression((u, *self._parameters), [lam.expr], broadcast=False)
            self._second[number] = compile_expression((u, *self._parameters), [lam.expr.diff(u, 2)], broadcast=False)

    def bases(self, parameters, q0):
        """Return U of nodes, arrays of up to (n,), from tuples of parameters and places; slopes f′(U) by function."""
        U, nothing = self._constants(*parameters), np.zeros(np.shape(q0[0]))
        for number in self._base_nodes:
            node = self.graph.nodes[number]
            if node.zero:
                U[number] = nothing
            elif node.kind == STATE:
                U[number] = q0[node.operands[0]]
            elif node.kind == ADD:
                U[number] = sum(w * U[k] for w, k in zip(node.weights, node.operands, strict=True))
            elif node.kind in (MUL, DIV):
                a, b = (U[k] for k in node.operands)
                U[number] = a * b if node.kind == MUL else a / b
            elif node.kind == FUNCTION:
                (U[number],) = self._functions[number](U[node.operands[0]], *parameters)
        return U, {number: U[slope] for number, slope in self.graph.slopes.items()}

    def deviations(self, U, slopes, parameters, epsilon, x):
        """Return û of nodes and the remainders of the functions, for deviations of the states.

        Args:
            U: values of the nodes at the place.
            slopes: slopes of the functions there.
            parameters: one array (points,) for each.
            epsilon: size of the perturbation, (points,).
            x: deviations of the states over epsilon, (states, points).
        """
        hat, remainders = [np.zeros_like(x[0])] * len(self.graph.nodes), {}
        for number in self._function_dependencies:
            node = self.graph.nodes[number]
            if node.kind == STATE:
                hat[number] = x[node.operands[0]]
            elif node.kind == ADD:
                hat[number] = sum(w * hat[k] for w, k in zip(node.weights, node.operands, strict=True))
            elif node.kind == MUL:
                a, b = node.operands
                hat[number] = U[a] * hat[b] + (U[b] + epsilon * hat[b]) * hat[a]
            elif node.kind == DIV:
                a, b = node.operands
                hat[number] = (hat[a] - U[number] * hat[b]) / (U[b] + epsilon * hat[b])
            elif node.kind == FUNCTION:
                u = node.operands[0]
                remainders[number] = self._remainder(number, U[u], epsilon, hat[u], parameters)
                hat[number] = slopes[number] * hat[u] + epsilon * remainders[number]
        return hat, remainders

    def _remainder(self, number, U, epsilon, hat, parameters):
        """Return û² ∫ (1 − s) f″(U + s ε û) ds over 0 … 1: the remainder of f, with no difference taken."""
        if not hat.any():  # a motion that starts at the place itself
            return np.zeros_like(hat)
        total = 0.0
        for z, weight in zip(*self._quadrature, strict=True):
            total = total + weight * self._second[number](U + z * epsilon * hat, *parameters)[0]
        return hat * hat * total
