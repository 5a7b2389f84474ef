"""The tennis racket's twist: its definition, columns, motion and pictures."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from sweeps.systems.bodies.family import MeasuredOnce
from sweeps.systems.bodies.once import Once
from sweeps.systems.kernel import Kernel
from sweeps.systems.system import Reference
from sweeps.systems.twist import variables
from sweeps.systems.twist.definition import TwistDefinition

if TYPE_CHECKING:
    import xarray as xr

A_POINT = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "chi": 0.1, "theta": 1.5, "omega0": 1.0}


class Twist(MeasuredOnce):
    """A body thrown near its middle axis: what it has turned about its handle when that has come round."""

    name = "twist"
    presentation = "sweeps.systems.twist.presentation"
    kernels = ("twist", "statuses", "triangle")
    compiled = (Kernel("twist", "survey", example=(A_POINT, 1e-9), seconds=7.0),)
    model = TwistDefinition
    tables = variables
    closed = "attitude"
    references = "Landau and Lifshitz, Mechanics, section 37; Van Damme, Mardesic and Sugny, Physica D 338 (2017) 17"
    caption = "measured twist of a thrown body per revolution of its handle, compared with the closed form"
    samples_per_second = 400_000

    def reference(self) -> Reference:
        """Return the time of the revolution by SciPy and by the closed form."""
        from sweeps.systems.twist.references import REFERENCE

        return REFERENCE

    def columns(self, points: Mapping[str, np.ndarray], integration: Once) -> dict[str, np.ndarray]:
        """Return the closed form and the measured columns; see `kernels.twist`."""
        from kernels import statuses, triangle, twist

        columns = twist.survey(points, integration.tolerance, integration.measured)
        columns["triangle_margin"] = triangle.triangle_margin(points["I1"], points["I2"], points["I3"])
        if integration.measured:
            nothing_to_measure = np.asarray(points["theta"]) == 0.0  # the handle has no azimuth about L
            within = np.abs(columns["twist"] - columns["twist_exact"]) <= columns["twist_error"]
            certified = nothing_to_measure | within
            columns["status"] = np.where(certified, statuses.OK, statuses.NOT_CONVERGED).astype(np.int8)
        return columns

    def motion(self, point, duration, samples, tolerance) -> "xr.Dataset":
        """Return ω(t) and q(t), in closed form and by direct integration."""
        from sweeps.systems.twist.motion import motion

        return motion(point, duration, samples, tolerance)


SYSTEM = Twist()
