"""The part of the page for small oscillations: the motion itself, where equilibria are, where linear theory ends.

The full equations of motion are trees that the page's script works out without compiling text. A tree is a number, the
name of a symbol, or a list: "+", "*", "^" or the name of a function, and its arguments.
"""

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.systems import rates
from sweeps.systems.presentation import Page, turning

if TYPE_CHECKING:
    import sympy as sp
    import xarray as xr

    from sweeps.mechanics import System

_HERE = Path(__file__).parent
_OWN = tuple(
    _HERE / name
    for name in ("first.html", "places.html", "mechanism.css", "followed.js", "mode.js", "mechanism.js", "places.js")
)
FILES = (turning.DRAWING, *_OWN, *rates.FILES, _HERE / "part.js")
QUESTION = "Where are the equilibria, are they stable, and how accurate are the rates?"
FUNCTIONS = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log")


class UnwrittenError(Exception):
    """An expression that a page does not know."""


def page(ds: "xr.Dataset", system: "System | None") -> Page:
    """Return the system's part of the page of a map; `system` is None for a file's, which no map makes run."""
    return Page(FILES, QUESTION, facts={"equations": _equations(ds, system)})


def _equations(ds, system) -> dict | None:
    """The equations, where the map has all that stands in them."""
    if system is None:
        return None
    needed = {*system.parameters, *(f"{c.name}_equilibrium" for c in system.kept)}
    return facts(system) if needed <= set(ds.variables) else None


@cache
def facts(system: "System") -> dict | None:
    """Return the equations a_ij q̈_j + f_i = 0 of a system for the page; None where it cannot evaluate them.

    Args:
        system: the description.

    Returns:
        `coordinates` (name, `velocity`, `unit`, and `size`, the tree of what is drawn as a perturbation of one),
        `shared` (name and tree of what stands in several), `a` (rows of trees), `forces` (trees of f_i), `particles`
        (trees of x and y of each mass in a plane) and `rods` (pairs of particles that stay apart; -1 is the origin).
    """
    import sympy as sp

    from sweeps.mechanics.derivation import derive

    equations = derive(system)
    n, forces = equations.m, [-e for e in equations.forces]
    shared, found = sp.cse([*equations.a, *forces], symbols=sp.numbered_symbols("shared "))
    try:
        trees = [tree(e) for e in found]
        coordinates = [
            {"name": c.name, "velocity": c.velocity.name, "unit": c.unit, "size": tree(_size(c))} for c in system.kept
        ]
        named = [[symbol.name, tree(e)] for symbol, e in shared]
        places = _places(system)
        particles = [[tree(e) for e in place] for place in places]
    except UnwrittenError:
        return None
    rows = [trees[i * n : (i + 1) * n] for i in range(n)]
    told = {"coordinates": coordinates, "shared": named, "a": rows, "forces": trees[n * n :]}
    return told | {"particles": particles, "rods": _rods(system, places)}


def _places(system: "System") -> list[tuple["sp.Expr", "sp.Expr"]]:
    """Places of the masses in a plane: upright through a vertical axis, turning with what turns."""
    import sympy as sp

    still = {c.symbol: 0 for c in system.coordinates.values() if c.momentum is not None} | {system.time: 0}
    flat = [[sp.sympify(e).subs(still) for e in place] for _, place in system.particles]
    return [(place[0], place[-1] if len(place) > 1 else sp.Integer(0)) for place in flat]


def _rods(system: "System", places: list) -> list[tuple[int, int]]:
    """Pairs (particle, the one before it or the origin, -1) whose distance no coordinate changes."""
    import sympy as sp

    moving = {c.symbol for c in system.coordinates.values()}
    found = []
    for k, (x, y) in enumerate(places):
        for j in dict.fromkeys((k - 1, -1)):
            u, v = places[j] if j >= 0 else (0, 0)
            if not sp.simplify((x - u) ** 2 + (y - v) ** 2).free_symbols & moving:
                found.append((k, j))
                break
    return found


def _size(coordinate) -> "sp.Expr":
    """Size of a perturbation of 1 in a picture: as described, a radian, or an eighth of the bounds."""
    import sympy as sp

    if coordinate.size is not None:
        return coordinate.size
    low, high = coordinate.bounds
    return sp.Integer(1) if coordinate.unit == "rad" else (high - low) / 8


def tree(expression: "sp.Expr") -> float | str | list:
    """Return an expression as a tree; refuse a function that is none of `FUNCTIONS`, and what is not real."""
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
        return [e.func.__name__, tree(e.args[0])]
    raise UnwrittenError(str(e))
