"""Tumbling bodies: their definition, columns, motion and references."""

from collections.abc import Mapping

import numpy as np

from sweeps.systems.bodies.family import MeasuredOnce
from sweeps.systems.bodies.once import Once
from sweeps.systems.kernel import Kernel
from sweeps.systems.tumbling import variables
from sweeps.systems.tumbling.definition import TumblingDefinition

A_POINT = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "energy": 1.2, "omega0": 1.0}


class Tumbling(MeasuredOnce):
    """A free body at any energy: mode, period in the body, periods about the angular momentum."""

    name = "tumbling"
    presentation = "sweeps.systems.tumbling.presentation"
    references_in = "sweeps.systems.tumbling.references"
    motion_in = "sweeps.systems.tumbling.motion"
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

    def survey(self, points: Mapping[str, np.ndarray], integration: Once) -> dict[str, np.ndarray]:
        """Return the closed form and the measured columns; see `kernels.tumbling`."""
        from kernels import tumbling

        columns = tumbling.survey(points, integration.tolerance, integration.measured)
        columns["period_ratio"] = columns["period_psi_exact"] / columns["period_phi_long_axis_exact"]
        return columns | tumbling.tilts(points)

    def agrees(self, points: Mapping[str, np.ndarray], columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return where mode and periods are the closed form's, the periods within their errors."""
        apart = columns["mode"] != columns["mode_exact"]
        for name in variables.PERIODS:
            apart |= np.abs(columns[name] - columns[f"{name}_exact"]) > columns[f"{name}_error"]
        return ~apart


SYSTEM = Tumbling()
