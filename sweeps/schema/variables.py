"""One variable of a map, or one coordinate: name, unit, meaning, type and flags."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Variable:
    """One variable of a map.

    Attributes:
        name: its name in the file, public contract.
        units: UDUNITS text; None for flags.
        long_name: what it means, one line, on axes and in `ncdump -h`.
        dtype: NumPy type in memory and on disk; NaN marks a missing float. What has a unit of time or is compared
            with theory is f8; dimensionless diagnostics are f4.
        flags: meanings of the whole numbers from `first_flag` on, for a flag variable.
        comment: what a reader should know beyond the long name.
        first_flag: number of the first meaning.
        sparse: whether most of its values are zero, missing or repeated, so that deflating them pays.
    """

    name: str
    units: str | None
    long_name: str
    dtype: str = "f8"
    flags: tuple[str, ...] = ()
    comment: str = ""
    first_flag: int = 0
    sparse: bool = False

    @property
    def deflated(self) -> bool:
        """Whether a file holds the variable deflated; the digits of doubles do not compress, and are stored raw."""
        return self.sparse or self.dtype != "f8"

    @property
    def missing_is_nan(self) -> bool:
        """Whether the variable is a floating-point number, so that NaN can mark what is missing."""
        return np.dtype(self.dtype).kind == "f"

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


def table(*variables: Variable) -> dict[str, Variable]:
    """Name → variable, in order."""
    return {variable.name: variable for variable in variables}
