"""Observed periods of tumbling bodies: their definition and columns."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from sweeps.schema.parameters import Strict, grid_model, key, mapping
from sweeps.systems.bodies.body import BodiesDefinition
from sweeps.systems.bodies.family import FreeBody
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.observed_periods import variables
from sweeps.systems.system import Kernel
from sweeps.systems.tumbling.system import A_POINT

PeriodsGrid = grid_model("PeriodsGrid", variables.PARAMETERS, __name__, RATIOS)


class Nothing(Strict):
    """How each motion is followed: not at all."""

    samples: ClassVar = 1  # closed forms, which time is estimated by


class ObservedPeriodsDefinition(BodiesDefinition):
    """A sweep of bodies of which two periods were observed."""

    grid: PeriodsGrid = mapping("what is varied", PeriodsGrid, required=True)
    integration: Nothing = key("an empty mapping: energies are computed in closed form", Nothing())


class ObservedPeriods(FreeBody):
    """The way back from two periods: in each mode the energy that gives a body both, or by how much it is excluded."""

    name = "observed_periods"
    samples_per_second = 5_000
    model = ObservedPeriodsDefinition
    kernels = ("tumbling", "statuses", "triangle")
    compiled = (
        Kernel("tumbling", "inverse", example=(1.0, 2.0, 3.0, 3.0), seconds=3.0),
        Kernel("tumbling", "survey", example=(A_POINT, 1e-10, False)),
    )
    tables = variables
    method_text = "closed form of the energies from tumbling periods"
    references = "Kaasalainen, Astronomy and Astrophysics 376 (2001) 302; Landau and Lifshitz, Mechanics, section 37"
    caption = "energies of tumbling bodies that give two observed periods"

    def columns(self, points: Mapping[str, np.ndarray], integration: Nothing) -> dict[str, np.ndarray]:
        """Return what the periods say of each body."""
        from sweeps.systems.observed_periods.answers import columns

        return columns(points)


SYSTEM = ObservedPeriods()
