r"""Taylor steps of quadratic equations of motion, from a table of their products.

Each component obeys :math:`\dot x = s\sum\pm u v`, so with :math:`x_n` the n-th term of its power series within a step
(the coefficient times :math:`h^n`) and the scale s times h in the place of s,

.. math:: x_{n+1} = \frac{s}{n+1}\sum_{i=0}^{n}\sum\pm u_i\,v_{n-i}

and the new state is the sum of the terms. A table names each component's scale and products; :func:`compile_step` makes
a straight-line function of it (:mod:`kernels.compile.llvm_formulas`). The order of every sum decides the speed and the
bits: in a convolution the newest terms are last, so that products that do not need them start earlier; in the result
the largest terms are last.

Tables, with omega = (a, b, c) the angular velocity, q the unit quaternion from body to space, scalar first, and n a
vector fixed in space, in body axes:

.. math:: \dot\omega_a = c_a\,\omega_b\omega_c, \qquad \dot q = \tfrac12\,q\,(0, \omega), \qquad \dot n = n\times\omega

Truncation of the quaternion at order N is about :math:`(|\omega|h/2)^{N+1}/(N+1)!`; of omega, and near its axis, see
:mod:`kernels.free.direct`.

Source: Jorba and Zou, Experimental Mathematics 14 (2005) 99, for the method.
"""

from collections.abc import Callable, Mapping, Sequence

from kernels.compile.llvm_formulas import parse_formula

Equations = Mapping[str, tuple[str, tuple[tuple[str, str, str], ...]]]

# component → its scale, and the products of its right-hand side: sign, u, v
EULER: Equations = {"a": ("ka", (("+", "b", "c"),)), "b": ("kb", (("+", "c", "a"),)), "c": ("kc", (("+", "a", "b"),))}
QUATERNION: Equations = {
    "w": ("half", (("-", "x", "a"), ("-", "y", "b"), ("-", "z", "c"))),
    "x": ("half", (("+", "w", "a"), ("+", "y", "c"), ("-", "z", "b"))),
    "y": ("half", (("+", "w", "b"), ("+", "z", "a"), ("-", "x", "c"))),
    "z": ("half", (("+", "w", "c"), ("+", "x", "b"), ("-", "y", "a"))),
}
VECTOR: Equations = {
    "x": ("h", (("+", "y", "c"), ("-", "z", "b"))),
    "y": ("h", (("+", "z", "a"), ("-", "x", "c"))),
    "z": ("h", (("+", "x", "b"), ("-", "y", "a"))),
}
ORDERS = (8, 10, 12)
# Component a is the spin: its last term that is summed, and the last that enters the transverse components.
ALL_TERMS, NEAR, NEAREST = None, (7, 4), (5, 2)


def step_lines(equations: Equations, order: int, spin: tuple[int, int] | None = ALL_TERMS) -> str:
    """Return the text of one step: assignments of the terms, then the return of the new state.

    Args:
        equations (mapping): Component → scale and products, as EULER.
        order (int): The last term of each component.
        spin (pair of int, optional): The last term of component a that is summed, and the last that enters the
            transverse components; by default all do.
    """
    last = {x: spin[0] if spin and x == "a" else order for x in equations}
    last_used = {x: spin[1] if spin and x == "a" else order - 1 for x in equations}  # the last term that products need
    terms, sums = [], {x: [f"{x}0"] for x in equations}
    for n in range(1, order + 1):
        for x in (x for x in equations if n <= last[x]):
            term = _term(n, *equations[x], spin if x != "a" else ALL_TERMS)
            terms += [f"{x}{n} = {term}"] if n <= last_used[x] else []
            sums[x].append(f"{x}{n}" if n <= last_used[x] else term)
    return "\n".join([*terms, f"return {', '.join(map(sum_terms, sums.values()))}"])


def _term(n: int, scale: str, products: tuple, spin: tuple[int, int] | None) -> str:
    """Return the n-th term of a component."""
    if spin and n > spin[1]:
        ((_, u, v),) = products
        transverse = u if v == "a" else v
        text = "".join(f" + {transverse}{n - 1 - i} * a{i}" for i in range(spin[1], -1, -1))
    else:
        text = convolution(products, n - 1)
    text = text.removeprefix(" + ").replace(" - ", "-", 1) if text.startswith(" - ") else text.removeprefix(" + ")
    return f"{f'({scale} * R{n})' if n > 1 else scale} * ({text})"


def convolution(products: tuple, n: int) -> str:
    """Return the n-th term of a sum of products, the newest factors last, with a sign before each."""
    pairs = sorted(((i, n - i) for i in range(n + 1)), key=max)
    return "".join(f" {sign} {u}{i} * {v}{j}" for i, j in pairs for sign, u, v in products)


def sum_terms(terms: Sequence[str]) -> str:
    """Return the sum of the terms 0, 1, 2, … of a component."""
    first, *later = (terms[n] for n in (3, 2, *range(4, len(terms)), 1, 0))
    return "(" * (len(later) - 1) + first + ")".join(f" + {term}" for term in later)


def compile_step(name: str, equations: Equations, order: int, spin: tuple[int, int] | None = ALL_TERMS) -> Callable:
    """Return one step as a function of the components and of the scales times h, for compiled code as for Python.

    Args:
        name (str): The function's name.
        equations, order, spin: As for :func:`step_lines`.
    """
    scales = dict.fromkeys(scale for scale, _ in equations.values())
    numbers = {f"R{n}": 1.0 / n for n in range(2, order + 1)}
    return parse_formula(name, [*(f"{x}0" for x in equations), *scales], step_lines(equations, order, spin), numbers)


# number → step of Euler's equations: 3 i + k has order ORDERS[i] and is whole (k = 0), near (1) or nearest (2)
STEPS = tuple(
    compile_step(f"{kind}step_{order}", EULER, order, spin)
    for order in ORDERS
    for kind, spin in (("", ALL_TERMS), ("near_", NEAR), ("nearest_", NEAREST))
)
step_10, step_12 = STEPS[3], STEPS[6]
turn_12 = compile_step("turn_12", EULER | QUATERNION, 12)  # (a, b, c, w, x, y, z, ka, kb, kc, half), half = h/2
carry_12 = compile_step("carry_12", EULER | VECTOR, 12)  # (a, b, c, x, y, z, ka, kb, kc, h)
