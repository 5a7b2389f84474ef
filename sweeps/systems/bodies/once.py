"""How motions are followed that are measured once round: nothing to sample, and so no length of a run."""

from typing import Annotated

from pydantic import Field

from sweeps.schema.strict import Strict
from sweeps.schema.values import TOLERANCE, Tolerance, choice

PROPAGATORS = ("direct", "exact")


class Once(Strict):
    """How each motion is followed."""

    propagator: Annotated[str, choice(PROPAGATORS)] = Field(
        "direct",
        description="direct (integrated and measured, with the closed form beside it) or exact (the closed form alone)",
    )
    tolerance: Tolerance = Field(1e-10, description=f"integration error allowed in the measurement, {TOLERANCE}")

    @property
    def measured(self) -> bool:
        """Whether the motion is followed."""
        return self.propagator == "direct"

    @property
    def samples(self) -> int:
        """What stands for a run's length where time is estimated: what is followed counts tenfold."""
        return 10 if self.measured else 1
