"""Definitions of periodic systems; each system's own model has its parameters in `grid`."""

from pydantic import Field

from sweeps.schema.definition import Definition
from sweeps.schema.values import Strict, Tolerance, mapping


class OnePeriod(Strict):
    """How each period is followed."""

    tolerance: Tolerance = Field(
        1e-12, description="truncation that the steps of one period may make, relative to the motion: 1e-13 to 1e-3"
    )

    @property
    def samples(self) -> int:
        """Return what stands for a run's length where time is estimated."""
        return 1


class PeriodicDefinition(Definition):
    """A sweep of systems that are periodic in time."""

    integration: OnePeriod = mapping("how each period is followed", OnePeriod)
