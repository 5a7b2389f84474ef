"""Description of a map: its dimensions, coordinates and variables, and how its system presents them."""

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

from sweeps import systems
from sweeps.schema.datasets import dimensions, flags, own_of_points
from sweeps.schema.variables import POINT, POINT_NAME, Role, of_role

if TYPE_CHECKING:
    import xarray as xr

NUMBERS = "fiub"  # kinds of NumPy types of real numbers, flags and booleans


class MapDescription:
    """Dimensions, coordinates and variables of a map, for summary, terminal and page; values are read when used."""

    def __init__(self, ds: "xr.Dataset"):
        ds, system = without_extra_dimensions(ds), systems.of_map(ds)
        layout = system.layout()
        self.attributes = ds.attrs  #: of the file
        self.sizes = dimensions(ds)  #: dimension of the points → its length, in storage order
        self.coordinates = {str(name): coordinate for name, coordinate in ds.coords.items()}
        #: those of the points alone, without further dimensions
        self.variables = {str(name): variable for name, variable in ds.data_vars.items()}
        #: the system's table of those variables that it contains
        self.specs = {name: layout.variables[name] for name in self.variables if name in layout.variables}
        self.own_of_points = own_of_points(ds)  #: names of the real coordinates that vary from point to point
        self.named_along = layout.along  #: dimension of names that the author of the definition has chosen; "" for none
        self.presentation = systems.make_presentation(system)  #: of the map's system

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
        return lead or next((name for name, variable in self.variables.items() if flags(variable)), "")

    @property
    def real_dimensions(self) -> set[str]:
        """Return the dimensions along which a real parameter varies."""
        return {dim for dim in self.sizes if dim in self.coordinates and self.coordinates[dim].dtype.kind == "f"}

    @property
    def columns(self) -> "dict[str, xr.DataArray]":
        """Return name → variable, and each coordinate of numbers that has several dimensions."""
        tables = {name: column for name, column in self.coordinates.items() if column.ndim > 1}
        return {name: column for name, column in {**self.variables, **tables}.items() if column.dtype.kind in NUMBERS}

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


def without_extra_dimensions(ds: "xr.Dataset") -> "xr.Dataset":
    """Return a map without the variables that have further dimensions at each point, and without those dimensions."""
    return ds.drop_dims(extra_dimensions(ds))


def extra_dimensions(ds: "xr.Dataset") -> set[str]:
    """Return the dimensions that some variables have at each point, such as the multipliers of a periodic motion."""
    table = systems.of_map(ds).layout().variables
    return {dim for name in map(str, ds.data_vars) if name in table for dim in table[name].over} & {*map(str, ds.dims)}
