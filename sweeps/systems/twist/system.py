"""The tennis racket's twist: its definition, columns, motion and pictures."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from sweeps.schema.layout import Layout
from sweeps.schema.parameters import Range
from sweeps.schema.variables import Variable
from sweeps.systems import listed
from sweeps.systems.once import Once
from sweeps.systems.system import Dynamics, Reference
from sweeps.systems.twist.definition import SHAREABLE, TwistDefinition
from sweeps.systems.twist.look import LOOK
from sweeps.systems.twist.variables import ARGUMENTS, COORDINATES, EXACT, LAYOUT, VARIABLES

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class Twist(Dynamics):
    """A body thrown near its middle axis: what it has turned about its handle when that has come round."""

    name = "twist"
    look = LOOK
    kernels = ("twist", "statuses", "rigid_body")
    model = TwistDefinition
    references = "Landau and Lifshitz, Mechanics, section 37; Van Damme, Mardesic and Sugny, Physica D 338 (2017) 17"
    caption = "measured twist of a thrown body in one turn of its handle, beside the closed form"
    samples_per_second = 400_000

    def dimensions(self, definition: TwistDefinition) -> dict[str, Range | np.ndarray]:
        """(I1, I2, I3, chi, theta, omega0), or (body, chi, theta, omega0)."""
        return listed.dimensions_of(definition, ARGUMENTS, SHAREABLE)

    def auxiliary(self, definition: TwistDefinition) -> dict[str, tuple[str, np.ndarray]]:
        """Along `body`: what bodies give themselves."""
        return listed.auxiliary(definition, SHAREABLE)

    def arguments(self, definition: TwistDefinition) -> tuple[str, ...]:
        """Names of what a point consists of."""
        return ARGUMENTS

    def coordinates(self, definition: TwistDefinition) -> dict[str, Variable]:
        """Name → coordinate."""
        return COORDINATES

    def variables(self, definition: TwistDefinition | None = None) -> dict[str, Variable]:
        """Name → variable: the closed form alone where nothing is followed."""
        if definition is None:
            return EXACT
        return VARIABLES if definition.integration.measured else EXACT

    def layout(self) -> Layout:
        """What any of its maps may hold."""
        return LAYOUT

    def reference(self) -> Reference:
        """The time of the turn by SciPy and by the closed form."""
        from sweeps.systems.twist.references import REFERENCE

        return REFERENCE

    def columns(self, points: Mapping[str, np.ndarray], integration: Once) -> dict[str, np.ndarray]:
        """The closed form beside what is measured; see `kernels.twist`."""
        from kernels import rigid_body, statuses, twist

        columns = twist.survey(points, integration.tolerance, integration.measured)
        columns["triangle_margin"] = rigid_body.triangle_margin(points["I1"], points["I2"], points["I3"])
        if integration.measured:
            apart = np.abs(columns["twist"] - columns["twist_exact"]) > columns["twist_error"]
            columns["status"] = np.where(apart, statuses.NOT_CONVERGED, statuses.OK).astype(np.int8)
        return columns

    def method(self, definition: TwistDefinition) -> str:
        """How the motion was computed."""
        if definition.integration.measured:
            return "direct integration of angular velocity and attitude, certified by the closed form"
        return "closed form of the attitude"

    def compile(self) -> None:
        """Compiles the kernels of the twist."""
        point = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "chi": 0.1, "theta": 1.5, "omega0": 1.0}
        self.columns({name: np.array([value]) for name, value in point.items()}, Once())

    def motion(self, point, duration, samples, tolerance) -> "xr.Dataset":
        """ω(t) and q(t), from the closed form and step by step."""
        from sweeps.systems.twist.motion import motion

        return motion(point, duration, samples, tolerance)

    def pictures(self, ds: "xr.Dataset") -> "dict[str, Callable[[], Figure | None]]":
        """The map of twists, and the defect against the growth rate with the law."""
        from sweeps.systems.twist import figure_twist

        return {"twist": lambda: figure_twist.draw_map(ds), "defect": lambda: figure_twist.draw_defect(ds)}


SYSTEM = Twist()
