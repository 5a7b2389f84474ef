"""Properties that all systems of free bodies share: bodies in a list or in the grid, and motions measured once."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kernels.estimator import statuses
from kernels.free.triangle import triangle_margin
from sweeps.schema.datasets import Dataset
from sweeps.schema.parameters import Range, spread
from sweeps.schema.variables import Variable
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.system import Dynamics, Point


class FreeBody(Dynamics):
    """A free body, from a grid of moments or from a list of bodies."""

    existence: tuple[str, ...] = MOMENTS

    def dimensions(self, definition: Any) -> dict[str, Range | np.ndarray]:
        """Return (body, axis, …): listed bodies, spin axes, and the parameters that the grid has."""
        bodies = {"body": np.array([body.name for body in definition.bodies])} if definition.bodies else {}
        arguments = self.arguments(definition)
        axes = {"axis": np.array(definition.axes, np.int8)} if "axis" in arguments else {}
        grid_names = [name for name in arguments if name not in ("body", "axis") and not definition.is_per_body(name)]
        return bodies | axes | {name: spread(getattr(definition.grid, name)) for name in grid_names}

    def auxiliary(self, definition: Any) -> dict[str, tuple[str, np.ndarray]]:
        """Return the coordinates along `body`: I1 … I3, other values of bodies, `moments_are_ratios`."""
        bodies = definition.bodies
        if not bodies:
            return {}
        columns: dict[str, Sequence] = dict(
            zip(MOMENTS, zip(*(body.moments for body in bodies), strict=True), strict=True)
        )
        for name in filter(definition.is_per_body, definition.shareable):
            grid_value, body_values = getattr(definition.grid, name), [getattr(body, name) for body in bodies]
            columns[name] = [grid_value if value is None else value for value in body_values]
        columns["moments_are_ratios"] = [body.ratios is not None for body in bodies]
        return {name: ("body", np.array(values)) for name, values in columns.items()}

    def impossible(self, points: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return True for points at which one moment exceeds the sum of the two remaining ones."""
        return triangle_margin(*(points[name] for name in MOMENTS)) < 0


class MeasuredOnce(FreeBody):
    """A free body that is integrated through one revolution, or only computed in closed form (EXACT of its `tables`).

    A subclass has three methods: `survey(points, integration)` returns the columns of the closed form and, if the
    motion is integrated, the measured ones; `agrees(points, columns)`, True for points at which these agree within
    their errors; `start(point)`, moments (ascending, kg m2) and initial angular velocity (rad s-1), shape (3,) each.
    """

    closed_quantities: str  #: the quantities in closed form, for a map's `source`

    def variables(self, definition: Any = None) -> dict[str, Variable]:
        """Return name → variable: only those of the closed form if nothing is integrated."""
        is_integrated = definition is not None and definition.integration.measured
        return self.tables.VARIABLES if is_integrated else self.tables.EXACT

    def shown_duration(self, moments: np.ndarray, omega: np.ndarray, rotation: float) -> float:
        """Return the duration, s, that shows a motion best.

        Args:
            moments: principal moments, kg m2, shape (3,).
            omega: initial angular velocity, rad s-1, shape (3,).
            rotation: time of one rotation, s.
        """
        return 2 * rotation

    def motion(self, point: Point, duration: float | None, samples: int | None, tolerance: float) -> Dataset:
        """Return ω(t) and q(t) of a point, in closed form and by direct integration; see `Dynamics.motion`."""
        import xarray as xr

        from sweeps.systems.motion import attitude_columns, sample_times, time_axis

        moments, omega = self.start(point)
        rotation = 2 * math.pi / float(point["omega0"])
        times = sample_times(duration or self.shown_duration(moments, omega, rotation), samples, rotation)
        return xr.Dataset(attitude_columns(moments, omega, times, tolerance), {"time": time_axis(times, "the start")})

    def columns(self, points: Mapping[str, np.ndarray], integration: Any) -> dict[str, np.ndarray]:
        """Return the closed form and the measured columns, with the status by their agreement."""
        columns = self.survey(points, integration)
        columns["triangle_margin"] = triangle_margin(*(points[name] for name in MOMENTS))
        if integration.measured:
            agrees = self.agrees(points, columns)
            columns["status"] = np.where(agrees, statuses.OK, statuses.NOT_CONVERGED).astype(np.int8)
        return columns

    def method(self, definition: Any) -> str:
        """Return the method of computation."""
        if definition.integration.measured:
            return "direct integration of angular velocity and attitude, certified by the closed form"
        return f"closed form of the {self.closed_quantities}"
