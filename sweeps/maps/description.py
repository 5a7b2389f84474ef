"""Description of a map: its dimensions, coordinates and variables, and how its system presents them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sweeps import systems
from sweeps.schema.datasets import dimensions, flags, own_of_points
from sweeps.schema.variables import POINT, POINT_NAME, Role, Variable, of_role

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.systems.presentation import Presentation


@dataclass(frozen=True)
class ColumnDescription:
    """A variable or a coordinate of a map in words."""

    dims: tuple[str, ...]  #: dimensions of the points that it has
    kind: str  #: kind of its NumPy type: f, i, u, b, O or U
    units: str  #: UDUNITS text; "" for none
    long_name: str  #: one line
    comment: str  #: "" for none
    flags: Mapping[int, str]  #: value → meaning of a flag variable; {} without flags
    array: "xr.DataArray" = field(repr=False)  #: its values, read when they are used

    @property
    def values(self) -> np.ndarray:
        """Return the values of a coordinate."""
        return self.array.values

    @property
    def is_number(self) -> bool:
        """Return True for a column of real numbers, flags or booleans."""
        return self.kind in "fiub"


@dataclass(frozen=True)
class MapDescription:
    """Dimensions, coordinates and variables of a map without their values, for summary, terminal and page."""

    attributes: Mapping  #: of the file
    sizes: Mapping[str, int]  #: dimension of the points → its length, in storage order
    coordinates: Mapping[str, ColumnDescription]
    variables: Mapping[str, ColumnDescription]  #: those of the points alone, without further dimensions
    specs: Mapping[str, Variable]  #: the system's table of those variables that it contains
    own_of_points: list[str]  #: names of the real coordinates that vary from point to point; [] for a grid
    named_along: str  #: dimension of names that the author of the definition has chosen; "" for none
    presentation: "Presentation"  #: of the map's system

    @property
    def title(self) -> str:
        """Return the title, "" without one."""
        return str(self.attributes.get("title", ""))

    @property
    def definition(self) -> str:
        """Return the text of the definition."""
        return str(self.attributes.get("definition", ""))

    @cached_property
    def leading_flag(self) -> str:
        """Return the flag variable that describes the motion, else any flag; "" without one."""
        lead = of_role(self.specs, Role.HEADLINE)
        return lead or next((name for name, variable in self.variables.items() if variable.flags), "")

    @property
    def real_dimensions(self) -> set[str]:
        """Return the dimensions along which a real parameter varies."""
        return {dim for dim in self.sizes if dim in self.coordinates and self.coordinates[dim].kind == "f"}

    @property
    def columns(self) -> dict[str, ColumnDescription]:
        """Return name → variable, and each coordinate of numbers that has several dimensions."""
        tables = {name: column for name, column in self.coordinates.items() if len(column.dims) > 1}
        return {name: column for name, column in {**self.variables, **tables}.items() if column.is_number}

    def long_name(self, name: str) -> str:
        """Return the long name of a variable or a coordinate."""
        return {**self.variables, **self.coordinates}[name].long_name

    def place(self, at: Mapping[str, int]) -> dict[str, float | int | str]:
        """Return dimension → coordinate of a point given by its indices, and the name of a named point."""
        at = dict(at)
        if POINT.name in at and POINT_NAME.name in self.coordinates:
            at[POINT_NAME.name] = at[POINT.name]
        values = {name: self.coordinates[name].values[i] if name in self.coordinates else i for name, i in at.items()}
        return {name: _python_value(value) for name, value in values.items()}


def _python_value(value) -> float | int | str:
    """Return a NumPy value as a Python number, or as text if it is not a number."""
    return value.item() if hasattr(value, "item") else value if isinstance(value, int) else str(value)


def describe_map(ds: "xr.Dataset") -> MapDescription:
    """Return the description of a map."""
    ds, system = without_extra_dimensions(ds), systems.of_map(ds)
    layout = system.layout()
    coordinates = {str(name): _describe_column(coordinate) for name, coordinate in ds.coords.items()}
    variables = {str(name): _describe_column(variable) for name, variable in ds.data_vars.items()}
    specs = {name: layout.variables[name] for name in variables if name in layout.variables}
    return MapDescription(
        attributes=ds.attrs,
        sizes=dimensions(ds),
        coordinates=coordinates,
        variables=variables,
        specs=specs,
        own_of_points=own_of_points(ds),
        named_along=layout.along,
        presentation=systems.make_presentation(system),
    )


def without_extra_dimensions(ds: "xr.Dataset") -> "xr.Dataset":
    """Return a map without the variables that have further dimensions at each point, and without those dimensions."""
    return ds.drop_dims(extra_dimensions(ds))


def extra_dimensions(ds: "xr.Dataset") -> set[str]:
    """Return the dimensions that some variables have at each point, such as the multipliers of a periodic motion."""
    table = systems.of_map(ds).layout().variables
    return {dim for name in map(str, ds.data_vars) if name in table for dim in table[name].over} & {*map(str, ds.dims)}


def _describe_column(variable: "xr.DataArray") -> ColumnDescription:
    """Return dimensions, type, units, meaning and flags of a variable of a map."""
    attributes, units = variable.attrs, str(variable.attrs.get("units", "1"))
    return ColumnDescription(
        tuple(map(str, variable.dims)),
        variable.dtype.kind,
        "" if units == "1" else units,
        str(attributes.get("long_name", variable.name)),
        str(attributes.get("comment", "")),
        flags(variable),
        variable,
    )
