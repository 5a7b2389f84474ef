"""One variable of a map, or one coordinate: name, unit, meaning, type and flags."""

from collections.abc import Container, Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

# How a file holds a variable that is deflated. Its bytes stay as they lie: values are mostly those of a neighbour,
# whole, and shuffled they would take a third more room and twice the time.
DEFLATED = {"zlib": True, "complevel": 1, "shuffle": False}


class Role(StrEnum):
    """What readers of a map take a variable for."""

    NONE = ""
    HEADLINE = "headline"  # the flag that says most of a point
    MEASUREMENT = "measurement"  # a number at every point whose status is ok
    STATUS = "status"  # whether the measurement can be trusted; its meaning `ok` says yes
    EXISTENCE = "existence"  # negative where no such thing can exist
    CHECK = "check"  # should be zero
    CERTIFICATE = "certificate"  # should be zero, and comes from another way of computing


@dataclass(frozen=True)
class Variable:
    """One variable of a map."""

    name: str  #: its name in the file, public contract
    units: str | None  #: UDUNITS text; None for flags
    long_name: str  #: what it means, one line, on axes and in `ncdump -h`
    #: NumPy type in memory and on disk; NaN marks a missing float. What has a unit of time or is compared with theory
    #: is f8; dimensionless diagnostics are f4.
    dtype: str = "f8"
    flags: tuple[str, ...] = ()  #: meanings of the whole numbers from `first_flag` on, for a flag variable
    comment: str = ""  #: what a reader should know beyond the long name
    first_flag: int = 0  #: number of the first meaning
    sparse: bool = False  #: whether most of its values are zero, missing or repeated, so that deflating them pays
    theory: str = ""  #: name of the variable that says what theory predicts of it; "" for none
    exact: str = ""  #: name of the variable that says what the exact solution has; "" for none
    error: str = ""  #: name of the variable that says how far it may be off; "" for none
    #: name of the variable over which it is off from theory, where its own size may be nothing but rounding; "" for
    #: theory's value.
    scale: str = ""
    role: Role = Role.NONE  #: what readers take it for, see `Role`
    over: tuple[str, ...] = ()  #: names of further dimensions, after those of the points, that it has at every point
    zero_is_none: bool = False  #: whether 0 stands for "no such rate": there it is compared with nothing
    #: whether it is left out of printed comparisons: a second estimate, biased where the first is not.
    aside: bool = False

    @property
    def deflated(self) -> bool:
        """Whether a file holds the variable deflated; the digits of doubles do not compress, and are stored raw."""
        return self.sparse or self.dtype != "f8"

    @property
    def missing_is_nan(self) -> bool:
        """Whether the variable is a floating-point number, so that NaN can mark what is missing."""
        return np.dtype(self.dtype).kind == "f"

    @property
    def references(self) -> tuple[str, ...]:
        """Names of the variables that it is compared with."""
        return () if self.aside else tuple(name for name in (self.theory, self.exact) if name)

    @property
    def truth(self) -> str:
        """Name of the variable whose distance its error bounds: theory where it has one, else the exact solution."""
        return self.theory or self.exact

    @property
    def attributes(self) -> dict:
        """CF attributes of the variable."""
        attributes = {"long_name": self.long_name}
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
        beside = [name for name in (self.error, "status") if name in names] if self.error else []
        return self.attributes | ({"ancillary_variables": " ".join(beside)} if beside else {})


def table(*variables: Variable) -> dict[str, Variable]:
    """Return name → variable, in order."""
    return {variable.name: variable for variable in variables}


def of_role(variables: Mapping[str, Variable], role: Role) -> str:
    """Return the name of the first variable that readers take for something; "" without one."""
    return next((name for name, variable in variables.items() if variable.role == role), "")


POINT = Variable("point", "1", "number of the point, from 1; of a table, its row", "i8")  # of what is no grid
