"""A free body with periodically modulated moments of inertia."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from sweeps.schema.iteration import tiles
from sweeps.schema.parameters import Range, grid_model, mapping, spread
from sweeps.schema.values import Phase, choice, integer, number
from sweeps.schema.variables import Parameter, Quantity, table
from sweeps.systems import described
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.bodies.body import AXES
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.bodies.variables import MOMENTS, Axes
from sweeps.systems.periodic import system as periodic
from sweeps.systems.reintegration import integrate_monodromy
from sweeps.systems.system import Example, Points, Reference

if TYPE_CHECKING:
    from sweeps.mechanics.model import Model


MODULATION = (*MOMENTS, *(f"{name}{i}" for name in ("depth", "lag") for i in (1, 2, 3)))

VARIABLES = periodic.MULTIPLIERS | table(
    replace(
        bodies.TRIANGLE_MARGIN,
        long_name="least of (Ib + Ic - Ia)/(I1 + I2 + I3) over the axes and the period; negative where no body can do "
        "that",
    )
)

Depth = Annotated[float, number(lambda x: -0.99 <= x <= 0.99, "a number from -0.99 to 0.99: no moment reaches 0")]
Frequency = Annotated[
    float, number(lambda x: 1e-150 <= x <= 1e150, "a number with 1e-150 ≤ frequency ≤ 1e150 in rad s-1")
]
DEPTH = Quantity("depth", "1", "-0.99 to 0.99", Depth)

PARAMETERS = (
    *(
        replace(moment, long_name=f"{moment.long_name}, mean", description="", required=True)
        for moment in bodies.PRINCIPAL
    ),
    *(Parameter(f"depth{i}", DEPTH, f"depth of the modulation of moment {i}, relative", 0.0) for i in (1, 2, 3)),
    *(
        Parameter(f"lag{i}", Quantity("angle", "rad", "finite", Phase), f"phase of the modulation of moment {i}", 0.0)
        for i in (1, 2, 3)
    ),
    Parameter(
        "frequency",
        Quantity("frequency", "rad s-1", "1e-150 ≤ frequency ≤ 1e150", Frequency),
        "angular frequency of the modulation",
        required=True,
    ),
    Parameter(
        "omega0", bodies.SIGNED_SPIN, "spin rate: angular momentum over the mean moment of the spin axis", required=True
    ),
    bodies.EPSILON,
    bodies.PHASE,
)
ARGUMENTS = ("axis", *(parameter.name for parameter in PARAMETERS))
_BODY_LAYOUT = bodies.layout(
    PARAMETERS, VARIABLES, [n for n, v in VARIABLES.items() if not v.over], has_axis=True, has_bodies=False
)
LAYOUT = replace(
    _BODY_LAYOUT,
    coordinates=_BODY_LAYOUT.coordinates | table(periodic.MULTIPLIER),
    spare=(*_BODY_LAYOUT.spare, periodic.MULTIPLIER.name),
    values=_BODY_LAYOUT.values | {"multiplier": Annotated[int, integer(1, 2, "1 or 2")]},
)
COORDINATES = LAYOUT.coordinates


PHASES = 64  # phases of a period between which no moment's share has two maxima, for depths up to 0.99
TILE_POINTS = 2**10  # points whose moments are sampled at once; an array over phases and axes takes 1.6 MB
REFINEMENTS = 5  # parabolas through three phases, at an eighth of the previous distance

PumpedGrid = grid_model("PumpedGrid", PARAMETERS, __name__, RATIOS)


class PumpedDefinition(periodic.PeriodicDefinition):
    """A sweep of free bodies with periodically modulated moments of inertia."""

    axes: Axes = Field((1, 2, 3), description=AXES)
    modulation: Annotated[str, choice(("moment", "inverse"))] = Field(
        "moment", description="what is I (1 + depth cos(frequency t + lag)): each moment, or its inverse"
    )
    grid: PumpedGrid = mapping("what is varied", PumpedGrid, required=True)


class PumpedBody(periodic.FloquetSystem):
    """A free body with modulated moments, by its Floquet multipliers.

    Args:
        inverse: True if the inverses of the moments are modulated.
    """

    name = "pumped_body"
    method_text = "direct integration of the angular momentum over one period, certified by the variational flow"
    kernels = (*periodic.FloquetSystem.kernels, "free.triangle")
    existence = MODULATION
    compile_seconds = 14.0
    model = PumpedDefinition
    references = "Yakubovich and Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975)"
    caption = "measured multipliers of a spin whose moments of inertia change periodically, beside linear theory"
    samples_per_second = 8_000

    def __init__(self, inverse: bool = False):
        self.inverse = inverse

    def bound(self, definition: PumpedDefinition) -> "PumpedBody":
        """Return the system with the definition's kind of modulation."""
        return PumpedBody(definition.modulation == "inverse")

    def dimensions(self, definition: PumpedDefinition) -> dict[str, Range | np.ndarray]:
        """Return (axis, I1, I2, I3, depths, lags, frequency, omega0, epsilon, phase)."""
        names = (parameter.name for parameter in PARAMETERS)
        return {"axis": np.array(definition.axes, np.int8)} | {n: spread(getattr(definition.grid, n)) for n in names}

    def extra_dimensions(self, definition: PumpedDefinition) -> dict[str, np.ndarray]:
        """Return the two multipliers of a point."""
        return {"multiplier": np.array([1, 2], np.int8)}

    def columns(self, points: Mapping[str, np.ndarray], integration: periodic.OnePeriod) -> dict[str, np.ndarray]:
        """Return the columns of the variational flow and of the measurement; see `equations`."""
        from sweeps.systems.pumped_body import equations

        columns = equations.survey(points, self.inverse, integration.tolerance)
        columns["triangle_margin"] = least_margin(points, self.inverse)
        return {name: columns[name] for name in VARIABLES}

    def impossible(self, points: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return True for points at which one moment exceeds the sum of the two remaining moments during the period."""
        return least_margin(points, self.inverse) < 0

    @property
    def mechanism(self) -> "Model":
        """The derived equations and the code that integrates them."""
        from sweeps.systems.pumped_body import equations

        return equations.tilt_model(self.inverse)

    def examples(self, definition: PumpedDefinition | None = None) -> tuple[Example, ...]:
        """Return the calls of all periodic systems, and the import of the code of the definition's modulation."""
        if definition is None:
            return self.compiled
        mechanism = self.bound(definition).mechanism
        enclosures = [described.ENCLOSURES] if mechanism.steepness.functions else []
        return Example(str(mechanism.perturbed_code(True).path)), *self.compiled, *enclosures

    def proofs(self, grid: Points) -> tuple[str, ...]:
        """Return the symmetries that are used, which do not depend on parameters."""
        parameters = self.mechanism.system.parameters.values()
        return self.mechanism.proofs([np.array([p.default]) for p in parameters])

    def fingerprint(self) -> str:
        """Return a hash of the kernels, the generated code, its generator and the equations."""
        source = Path(__file__).with_name("equations.py").read_bytes()
        return described.hash_sources(self.kernels, self.mechanism.perturbed_code(True), source)

    def reference(self) -> Reference:
        """Return the trace of the monodromy matrix, found again by SciPy."""
        return periodic.trace_reference(lambda point: trace_by_scipy(point, self.inverse))


def moments_at(points: Mapping[str, np.ndarray], phase: np.ndarray | float, inverse: bool) -> list[np.ndarray]:
    """Return the three moments at a phase of the period, rad; with `inverse`, 1/I_i is modulated, and not I_i."""
    factors = [1.0 + points[f"depth{i}"] * np.cos(phase + points[f"lag{i}"]) for i in (1, 2, 3)]
    return [points[f"I{i}"] * (1.0 / f if inverse else f) for i, f in enumerate(factors, 1)]


def least_margin(points: Mapping[str, np.ndarray], inverse: bool) -> np.ndarray:
    """Return the least triangle margin over the period, of points with arrays that broadcast together."""
    arrays = np.broadcast_arrays(*points.values())
    columns, margin = dict(zip(points, map(np.ravel, arrays), strict=True)), np.empty(arrays[0].size)
    for (tile,) in tiles(margin.shape, (TILE_POINTS,)):
        margin[tile] = _least_margin_of_tile({name: values[tile] for name, values in columns.items()}, inverse)
    return margin.reshape(arrays[0].shape)


def _least_margin_of_tile(points: Mapping[str, np.ndarray], inverse: bool) -> np.ndarray:
    """Return the least triangle margin over the period, of points with arrays of one length.

    It is least where the share I_i/(I1 + I2 + I3) of one axis is largest. Each share is smooth in the phase: all its
    maxima are refined that may be the largest, as two may be nearly equal. A maximum exceeds the largest sample beside
    it by less than this sample exceeds its neighbours, for a parabola by a quarter at most.
    """
    from kernels.free.triangle import triangle_margin

    def shares(points, phase):
        moments = np.array(np.broadcast_arrays(*moments_at(points, phase, inverse)))
        return moments / moments.sum(axis=0)

    step = 2.0 * np.pi / PHASES
    # a value that all points share is sampled once
    compact = {name: values[:1] if (values == values[0]).all() else values for name, values in points.items()}
    samples = np.array([shares(compact, phase) for phase in step * np.arange(PHASES)])
    samples = np.broadcast_to(samples, (PHASES, 3, points["I1"].size))
    before, after = np.roll(samples, 1, axis=0), np.roll(samples, -1, axis=0)
    bound = 2.0 * samples - np.minimum(before, after)
    number, axis, index = np.nonzero((samples > before) & (samples >= after) & (bound >= samples.max(axis=(0, 1))))
    maxima, phases = {name: values[index] for name, values in points.items()}, step * number
    for _ in range(REFINEMENTS):
        low, middle, high = (shares(maxima, phases + k * step)[axis, np.arange(index.size)] for k in (-1, 0, 1))
        curvature = low - 2.0 * middle + high
        phases += np.divide(0.5 * step * (low - high), curvature, out=np.zeros(index.size), where=curvature < 0.0)
        step /= 8.0
    minimum = triangle_margin(*moments_at(points, 0.0, inverse))
    np.minimum.at(minimum, index, triangle_margin(*moments_at(maxima, phases, inverse)))
    return minimum


def trace_by_scipy(point: Mapping[str, float], inverse: bool) -> float:
    """Return the trace of the 2 × 2 monodromy matrix, by SciPy's DOP853; NaN if the period is too long.

    With `inverse`, 1/I_i is modulated instead of I_i.
    """
    axis, nu = int(point["axis"]), point["frequency"]
    L, period = point["omega0"] * point[f"I{axis}"], 2.0 * math.pi / nu

    def rates_about_axes(time):
        moments = moments_at(point, nu * time, inverse)
        return [L / moments[(axis + k - 1) % 3] for k in range(3)]

    def slopes(time, state):
        along, first, second = rates_about_axes(time)
        return np.array([[0.0, along - second], [first - along, 0.0]])

    largest = np.abs([rates_about_axes(time) for time in np.linspace(0.0, period, 9)]).max()
    if largest * period > periodic.MAX_PERIOD_ANGLE:
        return math.nan
    nothing = np.empty(0)
    matrix = integrate_monodromy(lambda *arguments: nothing, slopes, nothing, np.eye(2), (0.0, period))[1]
    return float(np.trace(matrix))


SYSTEM = PumpedBody()
