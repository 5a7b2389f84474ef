"""What systems share whose points are a body, listed or in the grid, and whose motions are measured once round."""

from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from sweeps.schema.layout import Layout
from sweeps.schema.parameters import Range
from sweeps.schema.variables import Variable
from sweeps.systems import listed
from sweeps.systems.shapes import RATIOS
from sweeps.systems.system import Dynamics, Page

if TYPE_CHECKING:
    import xarray as xr

TRIANGLE = Path(__file__).parent / "rigid_body" / "page" / "triangle.js"


class MeasuredOnce(Dynamics):
    """A free body that is followed once round, or told by the closed form alone.

    Attributes:
        tables: its module of variables: ARGUMENTS, COORDINATES, VARIABLES, EXACT (the closed form's) and LAYOUT.
        shareable: names of what a body may give itself besides its moments.
        closed: what the closed form is of, for a map's `source`.
        question: what its page asks.
    """

    tables: ModuleType
    shareable: tuple[str, ...]
    closed: str
    question: str
    existence = listed.MOMENTS

    def dimensions(self, definition) -> dict[str, Range | np.ndarray]:
        """Return the arguments, or (body, …) and the values that bodies do not have individually."""
        return listed.dimensions_of(definition, self.tables.ARGUMENTS, self.shareable)

    def auxiliary(self, definition) -> dict[str, tuple[str, np.ndarray]]:
        """Return the coordinates along `body`."""
        return listed.auxiliary(definition, self.shareable)

    def arguments(self, definition) -> tuple[str, ...]:
        """Return the names of the arguments of a point."""
        return self.tables.ARGUMENTS

    def coordinates(self, definition) -> dict[str, Variable]:
        """Return name → coordinate."""
        return self.tables.COORDINATES

    def variables(self, definition=None) -> dict[str, Variable]:
        """Return name → variable: the closed form alone where nothing is integrated."""
        followed = definition is not None and definition.integration.measured
        return self.tables.VARIABLES if followed else self.tables.EXACT

    def impossible(self, points: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return where one moment exceeds the sum of the others."""
        return RATIOS.impossible(points)

    def layout(self) -> Layout:
        """Return the layout of its maps."""
        return self.tables.LAYOUT

    def follows_attitude(self, definition) -> bool:
        """Return True where the motion is integrated."""
        return definition.integration.measured

    def page(self, ds: "xr.Dataset") -> Page:
        """Return the page: the motion in one sentence, over the inertia triangle."""
        return Page((TRIANGLE, Path(str(self.tables.__file__)).parent / "part.js"), self.question)

    def method(self, definition) -> str:
        """Return the method of computation."""
        if definition.integration.measured:
            return "direct integration of angular velocity and attitude, certified by the closed form"
        return f"closed form of the {self.closed}"
