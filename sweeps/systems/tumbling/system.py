"""Tumbling bodies: their definition, columns, motion and pictures."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from sweeps.systems.bodies.family import MeasuredOnce
from sweeps.systems.bodies.once import Once
from sweeps.systems.kernel import Kernel
from sweeps.systems.system import Reference
from sweeps.systems.tumbling import variables
from sweeps.systems.tumbling.definition import TumblingDefinition

if TYPE_CHECKING:
    import xarray as xr

A_POINT = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "energy": 1.2, "omega0": 1.0}


class Tumbling(MeasuredOnce):
    """A free body at any energy: mode, period in the body, periods about the angular momentum."""

    name = "tumbling"
    presentation = "sweeps.systems.tumbling.presentation"
    kernels = ("tumbling", "statuses", "triangle")
    compiled = (
        Kernel("tumbling", "survey", example=(A_POINT, 1e-9), seconds=4.0),
        Kernel("tumbling", "tilts", example=(A_POINT,)),
    )
    model = TumblingDefinition
    tables = variables
    closed = "periods"
    references = "Landau and Lifshitz, Mechanics, section 37; Kaasalainen, Astronomy and Astrophysics 376 (2001) 302"
    caption = "measured mode and periods of tumbling bodies, compared with the closed form"
    samples_per_second = 160_000

    def reference(self) -> Reference:
        """Return the period in the body by SciPy and by the closed form."""
        from sweeps.systems.tumbling.references import REFERENCE

        return REFERENCE

    def columns(self, points: Mapping[str, np.ndarray], integration: Once) -> dict[str, np.ndarray]:
        """Return the closed form and the measured columns; see `kernels.tumbling`."""
        from kernels import statuses, triangle, tumbling

        columns = tumbling.survey(points, integration.tolerance, integration.measured)
        columns["period_ratio"] = columns["period_psi_exact"] / columns["period_phi_long_axis_exact"]
        columns |= tumbling.tilts(points)
        columns["triangle_margin"] = triangle.triangle_margin(points["I1"], points["I2"], points["I3"])
        if integration.measured:
            apart = columns["mode"] != columns["mode_exact"]
            for name in variables.PERIODS:
                apart |= np.abs(columns[name] - columns[f"{name}_exact"]) > columns[f"{name}_error"]
            columns["status"] = np.where(apart, statuses.NOT_CONVERGED, statuses.OK).astype(np.int8)
        return columns

    def motion(self, point, duration, samples, tolerance) -> "xr.Dataset":
        """Return ω(t) and q(t), in closed form and by direct integration."""
        from sweeps.systems.tumbling.motion import motion

        return motion(point, duration, samples, tolerance)


SYSTEM = Tumbling()
