"""Full equations of motion of a described system, as trees that a page's script evaluates without compiling text.

A tree is a number, the name of a symbol, or a list: "+", "*", "^" or the name of a function, and its arguments.
"""

from collections.abc import Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import sympy as sp

    from sweeps.mechanics import System
    from sweeps.mechanics.equations import Equations

FUNCTIONS = {name: name for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log")}
FUNCTIONS["Abs"] = "abs"


class UnsupportedExpressionError(Exception):
    """An expression that a page's script cannot evaluate."""


@cache
def page_equations(system: "System") -> dict | None:
    """Return the equations a_ij q̈_j = f_i, or x' = f, of a system for the page; None if the page cannot evaluate them.

    Returns:
        `coordinates` (name, `velocity`, None of a state, `unit`, and `size`, the tree of the size that is drawn as a
        perturbation of 1), `shared` (name and tree of each common subexpression), `a` (rows of trees; none of states),
        `forces` (trees of f), `period` (a tree, or None), `drawn` (kind, label and trees of the points of each part of
        the picture) with its common subexpressions `seen`, and `attitude` (trees of the body's angular velocity, and
        of the upward vector).
    """
    from sweeps.mechanics.derivation import derive

    equations = derive(system)
    picture_parts = picture(system, equations)
    try:
        shared, trees = _trees([*(equations.a or ()), *equations.forces], "shared")
        picture_shared, points = _trees(
            [x for element in picture_parts for point in element.points for x in point], "seen"
        )
        period = None if system.given_period is None else tree(system.given_period)
        attitude = system.attitude_equations and [[tree(x) for x in vector] for vector in system.attitude_equations]
        coordinates = []
        for c in equations.places:  # 1 is drawn as described, as a radian, or as an eighth of the bounds
            default_size = 1 if c.unit == "rad" else (c.bounds[1] - c.bounds[0]) / 8
            words = {"name": c.name, "velocity": c.velocity.name if equations.v else None, "unit": c.unit}
            coordinates.append(words | {"size": tree(default_size if c.size is None else c.size)})
    except UnsupportedExpressionError:
        return None
    n = len(equations.v)
    remaining_points = iter(points)
    drawn = [
        [element.kind, element.label, [[next(remaining_points) for _ in point] for point in element.points]]
        for element in picture_parts
    ]
    page = {"coordinates": coordinates, "shared": shared, "a": [trees[i * n : (i + 1) * n] for i in range(n)]}
    page |= {"forces": trees[n * n :], "period": period, "attitude": attitude}
    return page | {"seen": picture_shared, "drawn": drawn}


def _trees(expressions: list, word: str) -> tuple[list, list]:
    """Return name and tree of each common subexpression, and trees of the expressions."""
    import sympy as sp

    shared, reduced = sp.cse(expressions, symbols=sp.numbered_symbols(f"{word} "))
    return [[symbol.name, tree(e)] for symbol, e in shared], [tree(e) for e in reduced]


def picture(system: "System", equations: "Equations") -> list:
    """Return the parts of the picture: as described, else masses and rods in a plane, else two states."""
    from sweeps.mechanics.description import PicturePart

    if system.picture_parts:
        return system.picture_parts
    places = _mass_places(system)
    if not places:
        return [PicturePart("mass", (equations.states[:2],))] if equations.n > 1 else []
    return [
        *(PicturePart("line", ((0, 0) if j < 0 else places[j], places[k])) for k, j in _rods(system, places)),
        PicturePart("body", ((0, 0),)),
        *(PicturePart("mass", (place,)) for place in places),
    ]


def picture_points(equations: "Equations", values: Mapping) -> Iterator[tuple[str, np.ndarray]]:
    """Yield kind and points, shape (…, points, 2 or 3), of each part of the picture.

    Args:
        equations: the system's equations.
        values: values of each state, parameter and `time`, by name: arrays that broadcast together.
    """
    import sympy as sp

    system = equations.system
    symbols = [*equations.states, *(p.symbol for p in system.parameters.values())]
    arrays = np.broadcast_arrays(*(values[name] for name in (*map(str, symbols), "time")))
    for kind, points, _ in picture(system, equations):
        at = sp.lambdify([*symbols, system.time], [x for point in points for x in point], "numpy")
        numbers = np.stack(np.broadcast_arrays(arrays[-1], *at(*arrays))[1:], axis=-1)
        yield kind, numbers.reshape(*arrays[-1].shape, len(points), -1)


def _mass_places(system: "System") -> list[tuple["sp.Expr", "sp.Expr"]]:
    """Return the masses' (x, z) in a plane: vertical, through the vertical axis, co-rotating with a rotating system."""
    import sympy as sp

    at_start = {c.symbol: 0 for c in system.coordinates.values() if c.momentum is not None} | {system.time: 0}
    planar = [[sp.sympify(e).subs(at_start) for e in place] for _, place in system.particles]
    return [(place[0], place[-1] if len(place) > 1 else sp.Integer(0)) for place in planar]


def _rods(system: "System", places: list) -> list[tuple[int, int]]:
    """Return pairs (particle, the previous one, or -1, the origin) at a constant distance."""
    import sympy as sp

    coordinates = {c.symbol for c in system.coordinates.values()}
    pairs = []
    for k, (x, y) in enumerate(places):
        for j in dict.fromkeys((k - 1, -1)):
            u, v = places[j] if j >= 0 else (0, 0)
            if not sp.simplify((x - u) ** 2 + (y - v) ** 2).free_symbols & coordinates:
                pairs.append((k, j))
                break
    return pairs


def tree(expression: "sp.Expr") -> float | str | list:
    """Return an expression as a tree.

    Raises:
        UnsupportedExpressionError: for a function that is not in `FUNCTIONS`, or a number that is not real.
    """
    import sympy as sp

    e = sp.sympify(expression)
    if e.is_Symbol:
        return e.name
    if e.is_number and e.is_real and e.is_finite:
        return float(e)
    if e.is_Add or e.is_Mul:
        return ["+" if e.is_Add else "*", *map(tree, e.args)]
    if isinstance(e, sp.exp):
        return ["exp", tree(e.args[0])]
    if e.is_Pow:
        return ["^", *map(tree, e.args)]
    if e.is_Function and e.func.__name__ in FUNCTIONS and len(e.args) == 1:
        return [FUNCTIONS[e.func.__name__], tree(e.args[0])]
    raise UnsupportedExpressionError(str(e))
