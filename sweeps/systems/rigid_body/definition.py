"""What a definition of rigid bodies may say: which axes, which moments or bodies, and how each run is made."""

from typing import Annotated, ClassVar

from pydantic import model_validator

from sweeps.schema.definition import Integration
from sweeps.schema.parameters import Strict, grid_model, key, mapping, switch
from sweeps.schema.refusals import Problem, display, hint, refusals
from sweeps.schema.values import Axis, Epsilon, Phase, Positive, choice, in_unit, line_of_text, list_of_different
from sweeps.schema.variables import Variable
from sweeps.systems.bodies.body import AXES, BODIES, PROPAGATORS, BodiesDefinition, Body, list_of
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.bodies.variables import Axes, SignedSpin
from sweeps.systems.rigid_body.variables import CERTIFICATE, FLIPS, IN_SPACE, PARAMETERS, SHAREABLE, TERMS, VARIABLES

GridEntries = grid_model("GridEntries", PARAMETERS, __name__, RATIOS)


class Observed(Strict):
    """What people measured of a body's motion: for comparison only, nothing is computed from it."""

    period_days: Positive = key("observed period, days of 86,400 s: > 0", ...)
    what: Annotated[str, line_of_text(100)] = key("the motion that has this period: one line of text", ...)


class SpunBody(Body):
    """One real body, and how it spins."""

    omega0: in_unit("rad s-1", SignedSpin) = key("spin rate of this body, rad s-1: 1e-150 ≤ |omega0| ≤ 1e150")
    epsilon: in_unit("1", Epsilon) = key("size of the perturbation of this body, relative: 0 < epsilon < 1")
    phase: in_unit("rad", Phase) = key("direction of the perturbation of this body, rad: finite")
    axis: Axis = key("the axis it spins about in nature: 1, 2 or 3")
    observed: Observed = key("observed motion: {period_days, what}")


class RigidBodyIntegration(Integration):
    """How each run of a rigid body is made."""

    propagator: Annotated[str, choice(PROPAGATORS)] = key(
        "integration method: direct (Taylor steps, each point certified by the closed form) or exact "
        "(steps of the closed form)",
        "direct",
    )
    collapse: bool = switch("points that differ by units alone are integrated once and expanded")
    variables: list_of_different(str) = key(
        "which variables to make: a list of names of a map's variables; left out, all but the terms of "
        "omega_squared_error"
    )
    flips: bool = switch("to follow the motion on to its flips and its largest tilt, up to 20,000 rotations each way")
    attitude: bool = switch("to follow the attitude too, and measure how the spin axis moves in space")

    @property
    def table(self) -> dict[str, Variable]:
        """Name → variable of a map that is made so."""
        left_out = set(TERMS) if self.variables is None else set(self._possible) - set(self.variables)
        return {name: variable for name, variable in self._possible.items() if name not in left_out}

    @property
    def _possible(self) -> dict[str, Variable]:
        certificate = CERTIFICATE if self.propagator == "direct" else {}
        seen = IN_SPACE if self.attitude else {}
        return VARIABLES | certificate | (FLIPS if self.flips else {}) | seen | TERMS

    @model_validator(mode="after")
    def _check_variables(self) -> "RigidBodyIntegration":
        names, problems = self._possible, []
        for i, name in enumerate(self.variables or ()):
            if name not in names:
                wrong = "is not a variable of this sweep" + hint(name, names)
                problems.append(Problem(("variables", i), display(name), wrong, ", ".join(names)))
        if problems:
            raise refusals(problems)
        return self


class NearAxisDefinition(BodiesDefinition):
    """A sweep of bodies that spin near their principal axes: about which axes, over which moments or bodies."""

    shareable: ClassVar = SHAREABLE
    axes: Axes = key(AXES, (1, 2, 3))
    grid: GridEntries = mapping("what is varied", GridEntries)
    bodies: list_of(SpunBody) = key(BODIES, ())


class RigidBodyDefinition(NearAxisDefinition):
    """A sweep of free rigid bodies, each integrated and measured."""

    integration: RigidBodyIntegration = mapping("how each run is made", RigidBodyIntegration)

    @property
    def follows_attitude(self) -> bool:
        """Return True if the attitude is requested."""
        return self.integration.attitude

    @property
    def differing_bits(self) -> str:
        """Why single points have other bits: `collapse` integrates equivalent points once."""
        return "a collapsed map holds other points' motions in its own units" if self.integration.collapse else ""
