"""The free symmetric top, spun at any angle to its figure axis: its definition, its columns and its references."""

import math
from collections.abc import Mapping

import numpy as np

from kernels.triangle import triangle_margin
from sweeps.schema.boxes import Dataset
from sweeps.schema.definition import Definition, Integration
from sweeps.schema.parameters import grid_model, key, mapping
from sweeps.schema.values import TOLERANCE, Positive, Tolerance
from sweeps.systems.symmetric_top import variables
from sweeps.systems.system import Dynamics, Kernel, Point

A_POINT = {"ratio": 1.5, "omega3": 1.0, "half_angle": 30.0}

TopGrid = grid_model("TopGrid", variables.PARAMETERS, __name__)


class TopIntegration(Integration):
    """How each run of a symmetric top is made."""

    rotations: Positive = key("length of a run in rotations, 2π/|omega3|: > 0", 4.0)
    tolerance: Tolerance = key(f"relative error allowed on the transverse part, {TOLERANCE}", 1e-12)


class SymmetricTopDefinition(Definition):
    """A sweep of symmetric tops."""

    grid: TopGrid = mapping("what is varied", TopGrid, required=True)
    integration: TopIntegration = mapping("how each run is made", TopIntegration)


class SymmetricTop(Dynamics):
    """Euler's equations without torque for I1 = I2, at any angle to the figure axis."""

    name = "symmetric_top"
    method_text = "direct integration of Euler's equations"
    kernels = ("symmetric_top",)
    existence = ("ratio",)
    compiled = (Kernel("symmetric_top", "survey", example=(A_POINT, 1.0, 16, 1e-9), seconds=4.0),)
    model = SymmetricTopDefinition
    tables = variables
    references = "Landau and Lifshitz, Mechanics, sections 33 and 36"
    caption = "measured precession of the free symmetric top about its figure axis, compared with the closed form"
    picture_seconds = 2.5
    samples_per_second = 18_000_000  # two motions each, angles and cones

    def columns(self, points: Mapping[str, np.ndarray], integration: TopIntegration) -> dict[str, np.ndarray]:
        """Return the closed form and the measured columns; see `kernels.symmetric_top`."""
        from kernels import symmetric_top

        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        return symmetric_top.survey(points, *settings)

    def motion(self, point: Point, duration: float | None, samples: int | None, tolerance: float) -> Dataset:
        """Return ω(t) and q(t) from a point of a map, in closed form; see `Dynamics.motion`.

        The default duration is two turns of the precession, or four rotations where that takes over 10,000.
        """
        import xarray as xr

        from kernels import exact
        from kernels import symmetric_top as top
        from sweeps.systems.motion import as_columns, instants, span, time

        ratio, spin = float(point["ratio"]), float(point["omega3"])
        rate, rotation = abs(float(top.precession_rate(ratio, spin))), 2 * math.pi / abs(spin)
        times = instants(duration or span(4 * math.pi / rate if rate > 0 else math.inf, rotation), samples, rotation)
        omega = np.array([abs(spin) * math.tan(math.radians(float(point["half_angle"]))), 0.0, spin])
        followed = exact.rotation((1.0, 1.0, ratio), omega, times), exact.attitude((1.0, 1.0, ratio), omega, times)
        return xr.Dataset(as_columns(*followed, "closed form"), {"time": time(times, "the start")})

    def impossible(self, points: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return where I3 exceeds the sum of the two other moments."""
        return triangle_margin(1.0, 1.0, points["ratio"]) < 0


SYSTEM = SymmetricTop()
