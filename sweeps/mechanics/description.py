"""The description of a system: coordinates, parameters, masses and their positions, V, and places of equilibria.

A file builds one `System` and calls it `system`:

    from sympy import cos, pi, sin
    from sweeps.mechanics import System

    system = System("Pendulum")
    m = system.parameter("mass", "kg", default=1.0, positive=True)
    l = system.parameter("length", "m", default=1.0, positive=True)
    g = system.parameter("gravity", "m s-2", default=9.80665, positive=True)
    theta = system.coordinate("theta", "rad", bounds=(-pi, pi), periodic=True)
    system.particle(m, (l * sin(theta), -l * cos(theta)))
    system.potential(-m * g * l * cos(theta))
    system.equilibrium("hanging", {theta: 0})
    system.equilibrium("upright", {theta: pi})

All symbols and expressions are SymPy's. Each expression is checked when it is added; the equations are derived in
`sweeps.mechanics.derivation`.
"""

import math
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import sympy as sp

from sweeps.mechanics.linear import add_matrices
from sweeps.mechanics.switches import Rewriting, Switch, deciding_symbols
from sweeps.schema.refusals import DescriptionError

RESERVED = ("equilibrium", "mode", "eigenvalue", "epsilon", "phase", "t", "title", "system", "grid")
MAX_LINEAR_COORDINATES = 30  # coordinates of a linear system that has matrices alone
MAX_COORDINATES, MAX_STATES, MAX_EQUILIBRIA, MAX_BRANCHES = 10, 12, 10_000, 99
MAX_OPERATIONS = 5_000  # operations of one expression: with 2,000 a derivation takes minutes, growing with the square

UNIT = (  # SI units with their prefixes, and those that are used with them
    "(da|[yzafpnuµmcdhkMGTPEZY])?(m|g|s|A|K|mol|cd|rad|sr|Hz|N|Pa|J|W|C|V|F|ohm|S|Wb|T|H|L|l|eV|bar)"
    "|(kilo|centi|milli|micro|mega)?(met(re|er)|gram|second|radian|newton|joule|watt|pascal|hertz|kelvin|ampere|volt)s?"
    "|deg|degrees?|°|min(ute)?|h(our)?|d(ay)?|year|yr|au|AU|rpm|cycles?|revolutions?|turns?|percent|%"
)
_KINK = ("has a kink, about which nothing is linear", "sqrt(u**2 + d**2) in place of |u|, with a small d")
KINKED = {
    **dict.fromkeys((sp.Abs, sp.sign, sp.Max, sp.Min, sp.Heaviside, sp.Piecewise), _KINK),
    **dict.fromkeys((sp.floor, sp.ceiling, sp.Mod, sp.frac), ("jumps", "what has a slope everywhere")),
    sp.atan2: ("has a cut", "2*atan(y/(sqrt(x**2 + y**2) + x)) in place of atan2(y, x)"),
}


@dataclass(frozen=True)
class DescribedParameter:
    """A parameter of a sweep: symbol, unit (UDUNITS), default value, and bounds."""

    name: str  #: the key in a sweep's `grid`
    symbol: sp.Symbol
    unit: str
    default: float
    positive: bool
    least: float | None
    most: float | None
    meaning: str
    step: float | None = None  #: the allowed values are its multiples; None for any value

    @property
    def allowed(self) -> str:
        """The allowed values, in words."""
        bounds = ["> 0"] if self.positive else []
        bounds += [] if self.step is None else [f"a multiple of {self.step:g}"]
        bounds += [] if self.least is None else [f"≥ {self.least:g}"]
        bounds += [] if self.most is None else [f"≤ {self.most:g}"]
        return " and ".join(["a finite number", *bounds]) + f", in {self.unit}"

    def allows(self, value: float) -> bool:
        """Return True if a value lies within the bounds."""
        is_within = (self.least is None or value >= self.least) and (self.most is None or value <= self.most)
        is_multiple = self.step is None or value % self.step == 0
        return math.isfinite(value) and is_within and (value > 0 or not self.positive) and is_multiple


@dataclass(frozen=True)
class State:
    """A state of equations of first order: a quasi-velocity, a component of a unit vector, an angle."""

    name: str
    symbol: sp.Symbol  #: its symbol in the rates
    unit: str  #: UDUNITS text
    bounds: tuple[sp.Expr, sp.Expr]  #: range of the search for equilibria; expressions in the parameters
    #: perturbation of relative size one, in the state's unit; may contain parameters; by default a quarter of the range
    #: between the bounds
    size: sp.Expr | None
    meaning: str  #: one line of text
    periodic: bool = False  #: both bounds are the same place (an angle)
    #: fixed value in the search for equilibria, if V is constant along a line of them; else None
    hold: sp.Expr | None = None


@dataclass(frozen=True)
class Coordinate(State):
    """A generalised coordinate.

    Its size may contain coordinates, with their values at the equilibrium; by default it follows from V and the bounds.
    """

    velocity: sp.Symbol | None = None  #: q̇
    #: the parameter that is the conserved momentum of a cyclic coordinate; else None
    momentum: sp.Symbol | None = None


class PicturePart(NamedTuple):
    """A part of a system's picture.

    Attributes:
        kind: "mass", a dot with a trail; "body", a dot without a trail; "line", or "face", through its points.
        points: (x, y) or (x, y, z) each, z upwards; a dot has one point.
        label: text at the last point.
    """

    kind: str
    points: tuple[tuple[sp.Expr, ...], ...]
    label: str = ""


def is_word(name: object) -> bool:
    """Return True for text of letters, digits and _ that begins with a letter."""
    return isinstance(name, str) and re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,31}", name) is not None


ATTITUDE = sp.symbols("attitude_0:4", real=True)  # the quaternion that turns a body's vectors into space


class System:
    """A described mechanical system.

    Args:
        title: one line of text.
        most: largest number of equilibria of a point; by default the number of names.
        references: sources of the theory, one line.
        follow: equilibria without names are followed from the parameters' defaults to each point and keep their numbers
            through folds and pitchforks (see `sweeps.mechanics.branches`), which takes the time of at least nine
            searches; else they are numbered in the order of their places.
    """

    def __init__(self, title: str, most: int | None = None, references: str = "", follow: bool = False):
        if most is not None and not (type(most) is int and 1 <= most <= MAX_EQUILIBRIA):
            raise DescriptionError(f"most {most!r}: allowed: a whole number from 1 to {MAX_EQUILIBRIA}")
        self.title, self.references = title, references
        self.max_equilibria, self.follow = most, follow
        self.time = sp.Symbol("t", real=True)
        self.given_period: sp.Expr | None = None
        self.switches: list[Switch] = []  #: discontinuous functions of the time
        self.given_jumps: list[sp.Expr] = []
        self.given_plane: tuple[str, str] | None = None
        self.linear_matrices: tuple[sp.Matrix, ...] | None = None  #: M, K + N, C + G of a system of many coordinates
        self.parameters: dict[str, DescribedParameter] = {}
        self.coordinates: dict[str, Coordinate] = {}
        self.particles: list[tuple[sp.Expr, tuple[sp.Expr, ...]]] = []
        self.kinetic_terms: list[sp.Expr] = []
        self.potential_terms: list[sp.Expr] = []
        self.labels: dict[str, dict[sp.Symbol, sp.Expr]] = {}
        self.branches: dict[str, int] = {}
        self.dissipation_terms: list[sp.Expr] = []
        self.forces: dict[sp.Symbol, sp.Expr] = {}
        self.states: dict[str, State] = {}
        self.rates: dict[sp.Symbol, sp.Expr] = {}
        #: the states are smooth functions of canonical ones, and the rates Hamilton's: multipliers come in pairs
        self.is_hamiltonian = False
        #: the mirror image in time of a motion from x = 0, x the first state, is itself, and perturbations of half of
        #: the states, coordinates or momenta, change their sign in it
        self.is_reversible = False
        self.conserved_quantities: dict[str, sp.Expr] = {}
        self.picture_parts: list[PicturePart] = []
        self.attitude_equations: tuple[tuple[sp.Expr, ...], ...] | None = None

    def parameter(
        self, name, unit="1", *, default, positive=False, least=None, most=None, step=None, meaning=""
    ) -> sp.Symbol:
        """Add a parameter and return its symbol; a sweep's `grid` gives its value or values.

        Args:
            name: the key in `grid`.
            unit: the unit of its values.
            default: value if `grid` does not give it.
            positive: True for values > 0 only.
            least: smallest allowed value.
            most: largest allowed value.
            step: number of which all allowed values are multiples, if the equations' period requires it.
            meaning: description of the coordinate of maps.
        """
        self._check_name(name, unit)
        symbol = sp.Symbol(name, positive=True) if positive else sp.Symbol(name, real=True)
        parameter = DescribedParameter(
            name, symbol, unit, float(default), positive, least, most, meaning or name.replace("_", " "), step
        )
        if not parameter.allows(parameter.default):
            fault = f"default {default!r} is out of range"
            raise DescriptionError(f"parameter {name}: {fault}; allowed: {parameter.allowed}")
        self.parameters[name] = parameter
        return symbol

    def coordinate(
        self,
        name,
        unit="1",
        *,
        bounds=None,
        periodic=False,
        positive=False,
        size=None,
        hold=None,
        momentum=None,
        meaning="",
    ) -> sp.Symbol:
        """Add a generalised coordinate and return its symbol; see `Coordinate`.

        Args:
            name: name of the coordinate in maps.
            unit: its unit.
            bounds: two expressions in the parameters between which equilibria are searched; not needed with a
                momentum; (-π, π) by default for a `periodic` coordinate.
            periodic: True for an angle.
            positive: True for a distance.
            size: typical size of a motion, an expression in the parameters.
            hold: value at which the coordinate is fixed while equilibria are searched.
            momentum: conserved momentum of a cyclic coordinate, an expression in the parameters.
            meaning: description in maps.
        """
        self._check_name(name, unit)
        if len(self.coordinates) >= (MAX_COORDINATES if self.linear_matrices is None else MAX_LINEAR_COORDINATES):
            raise DescriptionError(f"coordinate {name}: there are {len(self.coordinates)} already; allowed: no more")
        bounds = (-sp.pi, sp.pi) if bounds is None and periodic else bounds
        if bounds is None and momentum is None:
            raise DescriptionError(f"coordinate {name}: bounds are missing; allowed: two expressions in the parameters")
        symbol = sp.Symbol(name, positive=True) if positive else sp.Symbol(name, real=True)
        ends = tuple(self._expression(f"bounds of {name}", bound) for bound in bounds or (0, 0))
        hold, momentum = (
            None if value is None else self._expression(f"{kind} of {name}", value)
            for kind, value in (("hold", hold), ("momentum", momentum))
        )
        size = self._size_expression(name, size, self._allowed_symbols())
        velocity = sp.Symbol(f"{name}_dot", real=True)
        self.coordinates[name] = Coordinate(
            name, symbol, unit, ends, size, meaning or name, periodic, hold, velocity=velocity, momentum=momentum
        )
        return symbol

    def velocity(self, symbol: sp.Symbol) -> sp.Symbol:
        """Return the symbol q̇ of a coordinate's symbol q, for a kinetic energy that is given directly."""
        return self.coordinates[symbol.name].velocity

    def matrices(self, M, K, *, C=None, G=None, N=None, names=None) -> tuple[sp.Symbol, ...]:
        """Add coordinates with M q″ + (C + G) q′ + (K + N) q = 0, at rest at 0, and return their symbols.

        Each matrix is a list of lists, an array or a SymPy matrix of numbers and functions of parameters, or the path
        of a CSV file; arrays of an NPZ file with these names are `system.matrices(**numpy.load(file))`.

        Args:
            M: masses, symmetric.
            K: stiffness; need not be symmetric.
            C: damping; need not be symmetric.
            G: gyroscopic matrix, added to C.
            N: circulatory matrix, added to K.
            names: names of the coordinates, by default q1, q2, …
        """
        return add_matrices(self, M, (K, N), (C, G), names)

    def plane(self, first: sp.Symbol, second: sp.Symbol) -> None:
        """Set the coordinates of a plane in which modes whirl, forward from the first to the second: `sweeps.modes`."""
        if not {first.name, second.name} <= {*self.coordinates}:
            allowed = ", ".join(self.coordinates) or "there are none"
            raise DescriptionError(f"plane: {first} and {second} are no two coordinates; allowed: {allowed}")
        self.given_plane = first.name, second.name

    def particle(self, mass, position) -> None:
        """Add a mass at a place r(q), Cartesian; r may contain `system.time` (a rotating hoop)."""
        place = tuple(self._expression("position", component, self._allowed_symbols()) for component in position)
        self.particles.append((self._expression("mass", mass), place))

    def kinetic_energy(self, T) -> None:
        """Add a kinetic energy to that of the particles."""
        self.kinetic_terms.append(self._expression("T", T, self._allowed_symbols(velocities=True)))

    def potential(self, V) -> None:
        """Add a potential energy; several add up."""
        self.potential_terms.append(self._expression("V", V, self._allowed_symbols(), may_jump=True))

    def dissipation(self, R) -> None:
        """Add Rayleigh's function R(q, q̇) ≥ 0, of degree two in q̇: forces -∂R/∂q̇; several add up."""
        self.dissipation_terms.append(self._expression("R", R, self._allowed_symbols(velocities=True), may_jump=True))

    def force(self, coordinate: sp.Symbol, Q) -> None:
        """Add a generalised force Q(q, q̇) along a coordinate, without a potential; several add up."""
        if coordinate not in {c.symbol for c in self.coordinates.values()}:
            allowed = ", ".join(self.coordinates) or "there are none"
            raise DescriptionError(f"force: {coordinate} is no coordinate; allowed: {allowed}")
        force = self._expression(f"force on {coordinate}", Q, self._allowed_symbols(velocities=True), may_jump=True)
        self.forces[coordinate] = self.forces.get(coordinate, sp.Integer(0)) + force

    def state(self, name, unit="1", *, bounds, size=None, positive=False, meaning="") -> sp.Symbol:
        """Add a state of equations of first order and return its symbol; see `State`. :meth:`rate` sets its rate.

        Args:
            name: name of the state in maps.
            unit: its unit.
            bounds: two expressions in the parameters between which equilibria are searched.
            size: typical size of a motion, by default a quarter of the bounds.
            positive: True for values > 0 only.
            meaning: description in maps.
        """
        self._check_name(name, unit)
        if len(self.states) >= MAX_STATES:
            raise DescriptionError(f"state {name}: there are {MAX_STATES} already; allowed: no more")
        symbol = sp.Symbol(name, positive=True) if positive else sp.Symbol(name, real=True)
        low, high = (self._expression(f"bounds of {name}", bound) for bound in bounds)
        size = self._size_expression(name, (high - low) / 4 if size is None else size)
        self.states[name] = State(name, symbol, unit, (low, high), size, meaning or name)
        return symbol

    def rate(self, state: sp.Symbol, f) -> None:
        """Set the state's rate of change, an expression in states and parameters."""
        if state not in {s.symbol for s in self.states.values()}:
            allowed = ", ".join(self.states) or "there are none"
            raise DescriptionError(f"rate: {state} is no state; allowed: {allowed}")
        if state in self.rates:
            raise DescriptionError(f"rate of {state}: given twice; allowed: one for each state")
        self.rates[state] = self._expression(f"rate of {state}", f, self._allowed_symbols(), may_jump=True)

    def conserved(self, expression, name: str) -> None:
        """Add a conserved quantity of equations of first order: `<name>_drift` is measured, its zero mode left out.

        An equilibrium at which a combination of conserved quantities is definite is proved to be stable.
        """
        self._check_name(name)
        if name in self.conserved_quantities:
            raise DescriptionError(f"conserved {name}: given twice; allowed: names that all differ")
        self.conserved_quantities[name] = self._expression(f"conserved {name}", expression, self._allowed_symbols())

    def draw(self, kind: str, points, label: str = "") -> None:
        """Add a part of the moving picture in reports (`PicturePart`), which by default shows masses and rods.

        Args:
            kind: "mass", "body", "line" or "face".
            points: places, expressions in coordinates, states, parameters and the time.
            label: text at a mass.
        """
        if kind not in ("mass", "body", "line", "face"):
            raise DescriptionError(f"draw: {kind!r} is no part of a picture; allowed: mass, body, line, face")
        places = tuple(
            tuple(self._expression("draw", x, self._allowed_symbols() | {*ATTITUDE}) for x in p) for p in points
        )
        self.picture_parts.append(PicturePart(kind, places, label))

    def attitude(self, omega, upwards) -> sp.Matrix:
        """Return the rotation matrix from the body's axes to space, for :meth:`draw`.

        Args:
            omega: angular velocity along the body's axes, rad/s.
            upwards: vector along the body's axes that points upwards at the start.
        """
        self.attitude_equations = tuple(
            tuple(self._expression("attitude", x, self._allowed_symbols()) for x in v) for v in (omega, upwards)
        )
        return sp.Matrix(sp.Quaternion(*ATTITUDE).to_rotation_matrix(homogeneous=True))

    def period(self, T) -> None:
        """Set the period of the equations in time, an expression in the parameters, in s."""
        self.given_period = self._expression("period", T)
        if self.given_period.is_positive is False:
            raise DescriptionError(f"period: {T}; allowed: a finite time > 0, in s")

    def jump(self, *times) -> None:
        """Add times from 0 to the period at which functions of the time jump or have a kink; then none are searched.

        Else jumps of `sign`, `floor`, `Piecewise` and the like are found if their arguments cross 0 with a slope.
        """
        self.given_jumps += [self._expression("jump", t) for t in times]

    def equilibrium(self, label: str, place: dict, branch: int = 1) -> None:
        """Define a name for the equilibrium that is found nearest to a place (expressions in the parameters).

        Args:
            label: the name, a word.
            place: coordinate or state → expression in the parameters.
            branch: of a driven motion, its number on the curve that leads from the place as the drive grows: motions
                before the first fold are 1, and each fold adds 1 (a resonance that bends over has 1, 2 and 3).
        """
        if type(branch) is not int or not 1 <= branch <= MAX_BRANCHES:
            raise DescriptionError(f"branch {branch!r} of {label}: allowed: a whole number from 1 to {MAX_BRANCHES}")
        if not is_word(label) or label in self.labels:
            raise DescriptionError(f"equilibrium {label!r}: allowed: words of letters, digits and _, each once")
        if not isinstance(place, Mapping):
            raise DescriptionError(f"equilibrium {label}: {place} is no place; allowed: {{x: place, …}}")
        symbols = {c.symbol for c in (*self.coordinates.values(), *self.states.values())}
        if unknown := sorted(str(x) for x in place if x not in symbols):
            allowed = ", ".join(sorted(map(str, symbols))) or "there are none yet"
            raise DescriptionError(f"equilibrium {label}: {unknown[0]} is no coordinate or state; allowed: {allowed}")
        self.branches[label] = branch
        self.labels[label] = {x: self._expression(f"equilibrium {label}", e) for x, e in place.items()}

    def without_switches(self, e: sp.Expr) -> sp.Expr:
        """Return an expression with its switches replaced by their discontinuous functions of the time."""
        for switch in reversed(self.switches):
            e = e.subs(switch.symbol, switch.value)
        return e

    @property
    def most(self) -> int:
        """The most equilibria a point can have: the length of the dimension `equilibrium`."""
        return self.max_equilibria or max(1, len(self.labels))

    @property
    def names(self) -> tuple[str, ...]:
        """Names along the dimension `equilibrium`: the labels, then numbers."""
        return tuple(self.labels) + tuple(str(k + 1) for k in range(len(self.labels), self.most))

    @property
    def kept(self) -> tuple[Coordinate, ...]:
        """The coordinates that are not cyclic, in their order."""
        return tuple(c for c in self.coordinates.values() if c.momentum is None)

    def _allowed_symbols(self, velocities=False) -> set[sp.Symbol]:
        """Return the symbols that an expression may contain in addition to the parameters."""
        symbols = {
            x for c in self.coordinates.values() for x in ((c.symbol, c.velocity) if velocities else (c.symbol,))
        }
        return symbols | {s.symbol for s in self.states.values()} | {self.time}

    def _size_expression(self, name, size, moving=frozenset()):
        """Return a size as a checked expression, None for None; refuse a number that is not positive."""
        size = None if size is None else self._expression(f"size of {name}", size, moving - {self.time})
        if size is not None and size.is_number and not size.is_positive:
            raise DescriptionError(f"size of {name}: {size}; allowed: a finite number > 0, or an expression")
        return size

    def _expression(self, context, value, moving=frozenset(), may_jump=False) -> sp.Expr:
        """Return a checked expression of parameters and moving symbols: real, finite, smooth in coordinates and states.

        If it `may_jump` in time, discontinuous functions of the time are replaced by switches.
        """
        e = sp.sympify(value)
        is_infinite = not isinstance(e, sp.Expr) or e.has(sp.nan, sp.zoo, sp.oo, -sp.oo, sp.I)
        if is_infinite or any(abs(number) > sys.float_info.max for number in e.atoms(sp.Number)):
            raise DescriptionError(f"{context}: {e} is complex or infinite; allowed: real, finite expressions")
        if (count := e.count_ops()) > MAX_OPERATIONS and e.free_symbols & moving:
            fault = f"an expression of {count:,} operations"
            raise DescriptionError(f"{context}: {fault}; allowed: at most {MAX_OPERATIONS:,}")
        allowed_symbols = {p.symbol for p in self.parameters.values()} | moving
        if unknown := sorted(map(str, e.free_symbols - allowed_symbols)):
            names = ", ".join(sorted(map(str, allowed_symbols))) or "numbers"
            raise DescriptionError(f"{context}: unbound symbol {', '.join(unknown)}; allowed: {names}")
        rewriting = Rewriting(self.time, self.switches, moving)
        for atom in sorted(e.atoms(*KINKED), key=str):
            smooth_in = moving - {self.time} if may_jump and type(atom) in rewriting.rewriters else moving
            if deciding_symbols(atom) & smooth_in:
                fault, allowed = KINKED[type(atom)]
                raise DescriptionError(f"{context}: {atom} {fault}; allowed: {allowed}")
        return rewriting(e)

    def _check_name(self, name, unit="1"):
        """Refuse a name that is taken, reserved or no word, and a unit with words that UDUNITS does not have."""
        is_used = name in (*self.parameters, *self.coordinates, *self.states, *RESERVED)
        if not is_word(name) or is_used:
            raise DescriptionError(
                f"name {name!r} is taken or no word; allowed: letters, digits and _, none twice, none of "
                + ", ".join(RESERVED)
            )
        for word in re.sub(r"[-+^*]*\d+", "", str(unit)).replace("/", " ").replace(".", " ").split():
            if not re.fullmatch(UNIT, word):
                raise DescriptionError(f"unit of {name}: {unit!r} holds {word!r}; allowed: UDUNITS text such as m s-2")
