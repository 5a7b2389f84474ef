"""Tumbling bodies: their definition, columns, motion and pictures."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from sweeps.schema.layout import Layout
from sweeps.schema.parameters import Range
from sweeps.schema.variables import Variable
from sweeps.systems import listed
from sweeps.systems.once import Once
from sweeps.systems.system import Dynamics, Reference
from sweeps.systems.tumbling.definition import SHAREABLE, TumblingDefinition
from sweeps.systems.tumbling.look import LOOK
from sweeps.systems.tumbling.variables import ARGUMENTS, COORDINATES, EXACT, LAYOUT, PERIODS, VARIABLES

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class Tumbling(Dynamics):
    """A free body at any energy: mode, period in the body, periods about the angular momentum."""

    name = "tumbling"
    look = LOOK
    kernels = ("tumbling", "statuses", "rigid_body")
    model = TumblingDefinition
    references = "Landau and Lifshitz, Mechanics, section 37; Kaasalainen, Astronomy and Astrophysics 376 (2001) 302"
    caption = "measured mode and periods of tumbling bodies, beside the closed form"
    samples_per_second = 80_000

    def dimensions(self, definition: TumblingDefinition) -> dict[str, Range | np.ndarray]:
        """(I1, I2, I3, energy, omega0), or (body, …) and what no body gives itself."""
        return listed.dimensions_of(definition, ARGUMENTS, SHAREABLE)

    def auxiliary(self, definition: TumblingDefinition) -> dict[str, tuple[str, np.ndarray]]:
        """Along `body`: what bodies give themselves."""
        return listed.auxiliary(definition, SHAREABLE)

    def arguments(self, definition: TumblingDefinition) -> tuple[str, ...]:
        """Names of what a point consists of."""
        return ARGUMENTS

    def coordinates(self, definition: TumblingDefinition) -> dict[str, Variable]:
        """Name → coordinate."""
        return COORDINATES

    def variables(self, definition: TumblingDefinition | None = None) -> dict[str, Variable]:
        """Name → variable: the closed form alone where nothing is followed."""
        if definition is None:
            return EXACT
        return VARIABLES if definition.integration.measured else EXACT

    def layout(self) -> Layout:
        """What any of its maps may hold."""
        return LAYOUT

    def reference(self) -> Reference:
        """The period in the body by SciPy and by the closed form."""
        from sweeps.systems.tumbling.references import REFERENCE

        return REFERENCE

    def columns(self, points: Mapping[str, np.ndarray], integration: Once) -> dict[str, np.ndarray]:
        """The closed form beside what is measured; see `kernels.tumbling`."""
        from kernels import rigid_body, statuses, tumbling

        columns = tumbling.survey(points, integration.tolerance, integration.measured)
        columns["period_ratio"] = columns["period_psi_exact"] / columns["period_phi_long_axis_exact"]
        columns |= tumbling.tilts(points)
        columns["triangle_margin"] = rigid_body.triangle_margin(points["I1"], points["I2"], points["I3"])
        if integration.measured:
            apart = np.zeros(columns["mode"].shape, dtype=bool)
            for name in PERIODS:
                apart |= np.abs(columns[name] - columns[f"{name}_exact"]) > columns[f"{name}_error"]
            columns["status"] = np.where(apart, statuses.NOT_CONVERGED, statuses.OK).astype(np.int8)
        return columns

    def method(self, definition: TumblingDefinition) -> str:
        """How the motion was computed."""
        if definition.integration.measured:
            return "direct integration of angular velocity and attitude, certified by the closed form"
        return "closed form of the periods"

    def compile(self) -> None:
        """Compiles the kernels of the periods."""
        point = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "energy": 1.2, "omega0": 1.0}
        self.columns({name: np.array([value]) for name, value in point.items()}, Once())

    def motion(self, point, duration, samples, tolerance) -> "xr.Dataset":
        """ω(t) and q(t), from the closed form and step by step."""
        from sweeps.systems.tumbling.motion import motion

        return motion(point, duration, samples, tolerance)

    def pictures(self, ds: "xr.Dataset") -> "dict[str, Callable[[], Figure | None]]":
        """The map of period ratios, and the herpolhode of one body."""
        from sweeps.systems.tumbling import figure_herpolhode, figure_periods

        return {"periods": lambda: figure_periods.draw(ds), "herpolhode": lambda: figure_herpolhode.draw(ds)}


SYSTEM = Tumbling()
