"""The free symmetric top, spun at any angle to its figure axis."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated

import numpy as np

from kernels.estimator import statuses
from kernels.free.triangle import triangle_margin
from sweeps.schema.datasets import Dataset
from sweeps.schema.definition import Definition, Integration
from sweeps.schema.parameters import grid_model, key, mapping
from sweeps.schema.values import MIN_SPIN_RATE, TOLERANCE, Positive, Tolerance, number, spin_rate
from sweeps.schema.variables import Layout, Parameter, Quantity, coordinates_of
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.reintegration import MAX_STEPPED_SAMPLES, ROUNDING_ERROR, sample_spacing
from sweeps.systems.shared_variables import STEPS, make_status, parse_rows
from sweeps.systems.system import Dynamics, Example, Point, Reference

_MEASURED = """
    {0}         rad s-1  precession rate of the {1} about the figure axis, measured{2}
        comment: {3}0 where it cannot be distinguished from rounding
    {0}_stderr  rad s-1  standard error of the measured precession rate{4}
        comment: scatter of the samples only
    {0}_error   rad s-1  error of the measured precession rate{4}
        comment: bounds the distance from the closed form: scatter, integration error and rounding
"""
_MOMENTUM = "momentum_precession_rate"

VARIABLES = parse_rows(
    """
    precession_rate_theory  rad s-1  precession rate of the angular velocity about the figure axis, closed form
        comment: (I3/I1 - 1) omega3; positive turns from axis 1 towards axis 2
    """,
    _MEASURED.format("precession_rate", "angular velocity", " [measurement]", "", ""),
    _MEASURED.format(_MOMENTUM, "angular momentum", "", "integrated independently; ", " of the angular momentum"),
    """
    period_theory  s  period of the precession, closed form; missing where the rate is 0
    period         s  period of the precession, measured; missing where the rate is 0
    sense          -  sense of the measured precession, relative to the spin about the figure axis [headline]
        flags: -1 undetermined none with_spin against_spin
    """,
    bodies.SHAPE,
    """
    body_cone             degree  angle between the angular velocity and the figure axis, measured
    momentum_cone_theory  degree  angle between the angular momentum and the figure axis, closed form
    momentum_cone         degree  angle between the angular momentum and the figure axis, measured
    space_cone_theory     degree  angle between the angular velocity and the angular momentum, closed form
    space_cone            degree  angle between the angular velocity and the angular momentum, measured
    half_angle_drift      degree  largest change of the angle between the angular velocity and the figure axis [check]
    coplanarity           1  largest distance of the angular momentum from the plane of angular velocity and figure axis
        comment: abs((L x omega) . e3)/(abs(L) abs(omega)), each vector integrated independently
    energy_drift          1  largest relative change of twice the kinetic energy [check]
        comment: L . omega, with L and omega integrated independently
    momentum_drift        1  largest relative change of the squared angular momentum [check]
    propagation_error     1  maximum integration error of the transverse part, relative to its size [certificate]
    """,
    STEPS,
    make_status(statuses.NON_FINITE),
    replace(bodies.TRIANGLE_MARGIN, dtype="f8"),
)
VARIABLES[_MOMENTUM] = replace(VARIABLES[_MOMENTUM], theory="precession_rate_theory")

_RATIO = "> 0 (1e-150 ≤ ratio ≤ 1e150)"
_ANGLE = "a number with 0 < half_angle < 90 (and at least 1e-100), in degrees; at 0 nothing precesses"
Ratio = Annotated[float, number(lambda x: 1e-150 <= x <= 1e150, f"a number {_RATIO}")]
HalfAngle = Annotated[float, number(lambda x: 1e-100 <= x < 90, _ANGLE)]
RATIO = Quantity("ratio", "1", _RATIO, Ratio)
_SPIN = "1e-150 ≤ |omega3| ≤ 1e150"
SPIN = Quantity("spin rate about the figure axis", "rad s-1", _SPIN, spin_rate("omega3"), least=MIN_SPIN_RATE)
HALF_ANGLE = Quantity("half-angle", "degree", "0 < half_angle < 90", HalfAngle)

PARAMETERS = (
    Parameter("ratio", RATIO, "ratio I3/I1: moment about the figure axis over the transverse moment", required=True),
    Parameter("omega3", SPIN, "spin rate about the figure axis", required=True),
    Parameter("half_angle", HALF_ANGLE, "angle between the angular velocity and the figure axis", required=True),
)
ITEMS = {parameter.name: parameter.quantity.item for parameter in PARAMETERS}
ARGUMENTS = tuple(ITEMS)
LAYOUT = Layout(coordinates_of(PARAMETERS), VARIABLES, tuple(VARIABLES), ITEMS)


A_POINT = {"ratio": 1.5, "omega3": 1.0, "half_angle": 30.0}

TopGrid = grid_model("TopGrid", PARAMETERS, __name__)


class TopIntegration(Integration):
    """Length, sampling and accuracy of each run of a symmetric top."""

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
    kernels = ("events.symmetric_top",)
    existence = ("ratio",)
    compiled = (Example("events.symmetric_top", "survey", (A_POINT, 1.0, 16, 1e-9)),)
    compile_seconds = 4.0
    model = SymmetricTopDefinition
    references = "Landau and Lifshitz, Mechanics, sections 33 and 36"
    caption = "measured precession of the free symmetric top about its figure axis, compared with the closed form"
    picture_seconds = 2.5
    samples_per_second = 18_000_000  # including angles and cones of two motions

    def columns(self, points: Mapping[str, np.ndarray], integration: TopIntegration) -> dict[str, np.ndarray]:
        """Return the closed form and the measured columns; see `kernels.events.symmetric_top`."""
        from kernels.events import symmetric_top

        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        return symmetric_top.survey(points, *settings)

    def motion(self, point: Point, duration: float | None, samples: int | None, tolerance: float) -> Dataset:
        """Return ω(t) and q(t) from a point of a map, in closed form; see `Dynamics.motion`.

        The default duration is two periods of the precession, or four rotations if these exceed 10,000 rotations.
        """
        import xarray as xr

        from kernels.events import symmetric_top as top
        from kernels.free import exact
        from sweeps.systems.motion import label_columns, motion_span, sample_times, time_axis

        ratio, spin = float(point["ratio"]), float(point["omega3"])
        rate, rotation = abs(float(top.precession_rate(ratio, spin))), 2 * math.pi / abs(spin)
        times = sample_times(
            duration or motion_span(4 * math.pi / rate if rate > 0 else math.inf, rotation), samples, rotation
        )
        omega = np.array([abs(spin) * math.tan(math.radians(float(point["half_angle"]))), 0.0, spin])
        columns = exact.rotation((1.0, 1.0, ratio), omega, times), exact.attitude((1.0, 1.0, ratio), omega, times)
        return xr.Dataset(label_columns(*columns, "closed form"), {"time": time_axis(times, "the start")})

    def impossible(self, points: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return True for points at which I3 exceeds the sum of I1 and I2."""
        return triangle_margin(1.0, 1.0, points["ratio"]) < 0

    def reference(self) -> Reference:
        """Return the precession rate, measured again by SciPy's DOP853 and by its formula."""
        ways = {"SciPy DOP853": precession_by_scipy, "closed form": precession_in_closed_form}
        return Reference("precession_rate", ways, allowed_deviation)


def precession_by_scipy(point: Mapping[str, float], integration: TopIntegration) -> float:
    """Return the precession rate about the figure axis in rad s-1, by DOP853, from the transverse angle."""
    from scipy.integrate import solve_ivp

    if integration.samples > MAX_STEPPED_SAMPLES:
        return math.nan
    c = point["ratio"] - 1.0
    h = sample_spacing(abs(c), integration.samples_per_rotation)
    times = h * np.arange(integration.samples + 1)
    sense = math.copysign(1.0, point["omega3"])

    def rates(_, w):
        return -c * sense * w[1], c * sense * w[0]

    solution = solve_ivp(rates, (0.0, times[-1]), [1.0, 0.0], "DOP853", times, rtol=1e-13, atol=1e-14)
    angle = np.unwrap(np.arctan2(solution.y[1], solution.y[0]))
    return float(np.polyfit(times, angle, 1)[0]) * abs(point["omega3"])


def precession_in_closed_form(point: Mapping[str, float], integration: TopIntegration) -> float:
    """Return the precession rate about the figure axis in rad s-1: (I3/I1 - 1) ω3."""
    return (point["ratio"] - 1.0) * point["omega3"]


def allowed_deviation(point: Mapping[str, float], integration: TopIntegration) -> float:
    """Return the allowed distance of a measured rate from a reference, rad s-1.

    Errors δ of samples, relative to the largest so far, change the slope of an angle by 2δ/h. Both methods may have
    errors of the tolerance, and the references of `ROUNDING_ERROR`.
    """
    h = sample_spacing(abs(point["ratio"] - 1.0), integration.samples_per_rotation)
    return 4.0 * (integration.tolerance + ROUNDING_ERROR) / h * abs(point["omega3"])


SYSTEM = SymmetricTop()
