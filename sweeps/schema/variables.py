"""Contents of a map and of a grid: variables, coordinates, parameters, and the layout of a file."""

import math
import re
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, get_args

import numpy as np

from sweeps.schema import units
from sweeps.schema.refusals import DefinitionError, display

CONTRACT_VERSION = "3.0"

# Encoding of deflated variables in a file. Their bytes are not shuffled: most values equal a neighbour's, and shuffled
# they would take a third more space and twice the time.
DEFLATED = {"zlib": True, "complevel": 1, "shuffle": False}


class Role(StrEnum):
    """Roles of variables for readers of a map."""

    NONE = ""
    HEADLINE = "headline"  # the main flag of a point
    MEASUREMENT = "measurement"  # a number at every point of status ok
    STATUS = "status"  # the flag of reliable measurements, `ok`, and of reasons against all further points
    EXISTENCE = "existence"  # negative where no such thing can exist
    CHECK = "check"  # should be zero
    CERTIFICATE = "certificate"  # should be zero, and comes from another way of computing


@dataclass(frozen=True)
class Variable:
    """One variable of a map."""

    name: str  #: its name in the file, public contract
    units: str | None  #: UDUNITS text; None for flags
    long_name: str  #: its meaning, one line, on axes and in `ncdump -h`
    #: NumPy type in memory and on disk; NaN marks a missing float. Variables with a unit of time, or compared with
    #: theory, are f8; dimensionless diagnostics are f4.
    dtype: str = "f8"
    flags: tuple[str, ...] = ()  #: meanings of the whole numbers from `first_flag` on, for a flag variable
    comment: str = ""  #: further information for readers
    first_flag: int = 0  #: number of the first meaning
    sparse: bool = False  #: whether most of its values are zero, missing or repeated, so that deflating them pays
    theory: str = ""  #: name of the variable predicted by theory; "" for none
    exact: str = ""  #: name of the variable of the exact solution; "" for none
    error: str = ""  #: name of the variable of its error bound; "" for none
    #: name of the variable by which its deviation from theory is divided, if its own size may be rounding alone; "" for
    #: theory's value.
    scale: str = ""
    role: Role = Role.NONE  #: its role for readers of a map
    over: tuple[str, ...] = ()  #: names of further dimensions, after those of the points, that it has at every point
    zero_is_none: bool = False  #: whether 0 means "no such rate", which is compared with nothing
    #: whether it is left out of printed comparisons: a second estimate, biased where the first is not.
    aside: bool = False

    @property
    def deflated(self) -> bool:
        """True if the variable is deflated in a file; the digits of doubles do not compress, and are stored raw."""
        return self.sparse or self.dtype != "f8"

    @property
    def missing_is_nan(self) -> bool:
        """True if the variable is a floating-point number, so that NaN can mark a missing value."""
        return np.dtype(self.dtype).kind == "f"

    @property
    def references(self) -> tuple[str, ...]:
        """Names of the variables that it is compared with."""
        return () if self.aside else tuple(name for name in (self.theory, self.exact) if name)

    @property
    def truth(self) -> str:
        """Name of the variable from which its error bounds the distance: that of theory, else the exact solution."""
        return self.theory or self.exact

    @property
    def attributes(self) -> dict:
        """CF attributes of the variable."""
        attributes: dict[str, Any] = {"long_name": self.long_name}
        if self.units is not None:
            attributes["units"] = self.units
        if self.flags:
            values = np.arange(self.first_flag, self.first_flag + len(self.flags), dtype=self.dtype)
            attributes |= {"flag_values": values, "flag_meanings": " ".join(self.flags)}
        if self.comment:
            attributes["comment"] = self.comment
        return attributes

    def attributes_among(self, names: Container[str]) -> dict:
        """Return the CF attributes in a file of variables of these names: its error and status are ancillary."""
        ancillary = [name for name in (self.error, "status") if name in names] if self.error else []
        return self.attributes | ({"ancillary_variables": " ".join(ancillary)} if ancillary else {})


def table(*variables: Variable) -> dict[str, Variable]:
    """Return name → variable, in order."""
    return {variable.name: variable for variable in variables}


def of_role(variables: Mapping[str, Variable], role: Role) -> str:
    """Return the name of the first variable of a role; "" without any."""
    return next((name for name, variable in variables.items() if variable.role == role), "")


# dimension of points in no grid
POINT = Variable("point", "1", "number of the point, from 1; of a table, its row", "i8")
POINT_NAME = Variable("name", None, "name of the point, from the column `name` of its table", "str")


# -- parameters


@dataclass(frozen=True)
class Quantity:
    """A kind of number, of one parameter or several."""

    noun: str  #: name of one value: "moment"
    units: str  #: UDUNITS text, "1" for none
    bounds: str  #: the allowed values, in few words
    item: Any  #: the checked type of one value (see `sweeps.schema.values`)
    least: float | None = None  #: least absolute value, if the allowed values surround 0; else None


@dataclass(frozen=True)
class Parameter:
    """One key of a grid."""

    name: str  #: the key, and the coordinate of that name
    quantity: Quantity  #: the kind of its values
    long_name: str  #: meaning of the coordinate, one line (CF)
    default: float | None = None  #: its value if the key is left out; None for no default
    description: str = ""  #: its description in refusals; left out, the long name with unit and bounds
    required: bool = False  #: whether a definition without it is refused at once; False if the system checks that


def parse_amount(where: str, value: Any, unit: str) -> float:
    """Return a finite `value` in `unit`, from a number or text with a unit; a refusal names `where` it was given."""
    try:
        number = float(units.number(value, unit))
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise DefinitionError(f"{where}: {display(value)}; allowed: a finite number, in one of {units.unit_list(unit)}")
    return number


def coordinates_of(parameters: Iterable[Parameter]) -> dict[str, Variable]:
    """Return name → coordinate of each parameter."""
    return {p.name: Variable(p.name, p.quantity.units, p.long_name) for p in parameters}


# -- files


def is_readable(version: str) -> bool:
    """Return True if a map of this version of the contract can be read: its major version is ours."""
    return bool(re.fullmatch(rf"{CONTRACT_VERSION.split('.')[0]}\.\d+", version))


@dataclass(frozen=True)
class Layout:
    """Description of a system's maps, with which a file is compared."""

    #: name → each coordinate that a map may have; those that may be dimensions in storage order.
    coordinates: dict[str, Variable]
    variables: Mapping[str, Variable]  #: name → each variable that a map may have
    needed: tuple[str, ...]  #: names of the variables that a map has unless its own definition selects variables
    #: coordinate that every map has, but for the spare attributes → the checked type of its values (see
    #: `sweeps.schema.values`).
    values: dict[str, Any] = field(default_factory=dict)
    #: whether a map may have further coordinates and variables, all doubles: parameters named in the description of
    #: its system.
    is_open: bool = False
    along: str = ""  #: dimension of coordinates that are no dimensions; "" for none
    beside: tuple[str, ...] = ()  #: names of further coordinates of a map with that dimension
    spare: tuple[str, ...] = ()  #: names of the coordinates that only some maps have
    #: coordinate → its possible dimensions, in storage order, if it is none itself.
    over: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def required(self, names: Container) -> set[str]:
        """Return the names of the coordinates that a map must have, from those that it has."""
        extra_names = self.beside if self.along in names else ()
        return {*self.values, *extra_names} & {*self.coordinates} - {*self.spare}


def allowed_values(item: Any, value: float | str) -> str:
    """Return the allowed values of a checked type (see `sweeps.schema.values`) as text, "" for a valid value."""
    try:
        for check in get_args(item)[1:]:
            check.func(value)
    except ValueError as refused:  # pydantic's own, which is loaded where something is refused
        return refused.context["allowed"]
    return ""


def extremes(values: np.ndarray) -> list[float | int]:
    """Return the ends of values, and the nearest to zero on both sides: a bound that these obey is obeyed by all."""
    ends = [values.min().item(), values.max().item()] if values.size else []
    if not ends or ends[0] > 0 or ends[1] < 0:
        return ends
    sign_groups = values[values > 0], values[values < 0], values[values == 0]
    return ends + [end.item() for group in sign_groups if group.size for end in (group.min(), group.max())]
