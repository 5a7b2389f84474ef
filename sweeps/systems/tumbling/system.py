"""Tumbling bodies: mode and periods of a free body at any energy."""

import math
from collections.abc import Mapping
from itertools import permutations
from typing import Annotated, ClassVar

import numpy as np
from pydantic import model_validator

from kernels.estimator import statuses
from sweeps.schema.parameters import Range, grid_model, key, mapping, spread
from sweeps.schema.refusals import Problem, display, refusals
from sweeps.schema.values import number
from sweeps.schema.variables import Parameter, Quantity, Role, Variable, table
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.bodies.body import BODIES, Body, FollowedDefinition, Once, list_of
from sweeps.systems.bodies.free_body import MeasuredOnce
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.bodies.variables import MOMENTS, Spin
from sweeps.systems.reintegration import ROUNDING_ERROR, euler_coefficients
from sweeps.systems.shared_variables import make_status, parse_rows, with_exact
from sweeps.systems.system import Example, Reference

ARGUMENTS = (*MOMENTS, "energy", "omega0")
MODES = ("impossible", "sam", "lam", "separatrix", "principal")

_MODES = (
    "sam: short-axis mode, the polhode encircles the axis of greatest inertia; lam: long-axis mode, that of least "
    "inertia; principal: rotation about a principal axis; impossible: energy outside the range of this body"
)
PERIODS = {
    "period_psi": "period of the angular velocity in the body, P_psi",
    "period_phi_long_axis": "mean precession period about L of the axis of least inertia, P_phi (long-axis convention)",
    "period_phi_encircled": "mean precession period about L of the axis that the polhode encircles",
}

EXACT = parse_rows(
    Variable("mode_exact", None, "mode of the motion, from its energy", "i1", MODES, _MODES, -1),
    *(Variable(f"{name}_exact", "s", f"{text}, closed form") for name, text in PERIODS.items()),
    """
    period_ratio   1    P_psi over P_phi in the long-axis convention, closed form
    tilt_mean      rad  f4  mean nutation angle: angle between L and the encircled axis, mean over a period, closed form
    tilt_least     rad  f4  least angle between L and the encircled axis, closed form
    tilt_greatest  rad  f4  greatest angle between L and the encircled axis, closed form
    """,
    bodies.TRIANGLE_MARGIN,
)

_MEASURED = (with_exact(name, "s", text, name, bodies.TWO_RUNS) for name, text in PERIODS.items())
_PERIODS, _ERRORS = zip(*_MEASURED, strict=True)
_MODE = Variable(
    "mode", None, "mode of the motion, measured", "i1", MODES, _MODES, -1, exact="mode_exact", role=Role.HEADLINE
)
MEASURED = table(_MODE, *_PERIODS, *_ERRORS, make_status(statuses.NON_FINITE))

VARIABLES = MEASURED | EXACT

Energy = Annotated[float, number(lambda x: x >= 1, "a number from 1 to I_max/I_min of the body")]

PARAMETERS = (
    *bodies.PRINCIPAL,
    Parameter(
        "energy",
        Quantity("energy", "1", "1 to I_max/I_min", Energy),
        "energy over its minimum at this angular momentum: 2T I3/L^2, moments ascending",
    ),
    bodies.spin("L/I3, the spin rate about the axis of greatest inertia with this L"),
)

LAYOUT = bodies.layout(PARAMETERS, VARIABLES, EXACT)


A_POINT = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "energy": 1.2, "omega0": 1.0}

TumblingGrid = grid_model("TumblingGrid", PARAMETERS, __name__, RATIOS)


class Tumbler(Body):
    """A body that tumbles."""

    energy: Energy = key("energy of this body, 2T I3/L2: from 1 to I_max/I_min")
    omega0: Spin = key("L/I3 of this body, rad s-1: 1e-150 ≤ omega0 ≤ 1e150")

    @model_validator(mode="after")
    def _check_energy(self) -> "Tumbler":
        """Check that the energy is at most the maximum of this body, I_max/I_min."""
        max_energy = max(self.moments) / min(self.moments)
        if self.energy is not None and self.energy > max_energy:
            reason = "is above the maximum of this body"
            allowed = f"1 to I_max/I_min = {max_energy:.6g}"
            raise refusals([Problem(("energy",), display(self.energy), reason, allowed)])
        return self


class TumblingDefinition(FollowedDefinition):
    """A sweep of tumbling bodies."""

    shareable: ClassVar = ("energy", "omega0")
    grid: TumblingGrid = mapping("what is varied", TumblingGrid)
    bodies: list_of(Tumbler) = key(BODIES, ())

    @model_validator(mode="after")
    def _check_energy(self) -> "TumblingDefinition":
        """Refuse energies that are impossible for all bodies of the sweep."""
        if self.grid.energy is None:
            return self
        ends = [] if self.bodies else [_ends(getattr(self.grid, name)) for name in MOMENTS]
        ratios = [maximum / minimum for (_, maximum), (minimum, _) in permutations(ends, 2)]
        max_energy = max(ratios or [max(body.moments) / min(body.moments) for body in self.bodies])
        minimum, maximum = _ends(self.grid.energy)
        if maximum <= max_energy:
            return self
        reason = f"reaches {maximum:.6g}, above the maximum of every body of the sweep"
        value = display(self.grid.energy) if isinstance(self.grid.energy, float) else f"{minimum:g} … {maximum:g}"
        raise refusals([Problem(("grid", "energy"), value, reason, f"1 to I_max/I_min, at most {max_energy:.6g} here")])


def _ends(entry) -> tuple[float, float]:
    values = spread(entry)
    ends = (values.start, values.stop) if isinstance(values, Range) else values
    return float(np.min(ends)), float(np.max(ends))


class Tumbling(MeasuredOnce):
    """A free body at any energy: mode, period in the body, periods about the angular momentum."""

    name = "tumbling"
    kernels = ("events.tumbling", "estimator.statuses", "free.triangle")
    compiled = (Example("events.tumbling", "survey", (A_POINT, 1e-9)), Example("events.tumbling", "tilts", (A_POINT,)))
    compile_seconds = 9.0
    model = TumblingDefinition
    closed_quantities = "periods"
    references = "Landau and Lifshitz, Mechanics, section 37; Kaasalainen, Astronomy and Astrophysics 376 (2001) 302"
    caption = "measured mode and periods of tumbling bodies, compared with the closed form"
    samples_per_second = 160_000

    def start(self, point: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Return moments (ascending, kg m2) and ω at time 0 (rad s-1) of a point: L = I3 omega0, w2 = 0."""
        from kernels.events import tumbling

        moments = np.sort([float(point[name]) for name in MOMENTS])
        omega = np.array(tumbling.start(*moments / moments[2], float(point["energy"])))
        return moments, omega * float(point["omega0"])

    def shown_duration(self, moments: np.ndarray, omega: np.ndarray, rotation: float) -> float:
        """Return two periods of ω in the body."""
        from kernels.free import exact
        from sweeps.systems.motion import motion_span

        return motion_span(2 * exact.period(exact.set_up(*moments, *omega)), rotation)

    def survey(self, points: Mapping[str, np.ndarray], integration: Once) -> dict[str, np.ndarray]:
        """Return the closed form and the measured columns; see `kernels.events.tumbling`."""
        from kernels.events import tumbling

        columns = tumbling.survey(points, integration.tolerance, integration.measured)
        columns["period_ratio"] = columns["period_psi_exact"] / columns["period_phi_long_axis_exact"]
        return columns | tumbling.tilts(points)

    def agrees(self, points: Mapping[str, np.ndarray], columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return True for points at which the mode is that of the closed form, and the periods within their errors."""
        differs = columns["mode"] != columns["mode_exact"]
        for name in PERIODS:
            differs |= np.abs(columns[name] - columns[f"{name}_exact"]) > columns[f"{name}_error"]
        return ~differs

    def reference(self) -> Reference:
        """Return the period of the angular velocity by SciPy's DOP853 and by the closed form."""
        ways = {"SciPy DOP853": period_by_scipy, "closed form": period_in_closed_form}
        return Reference("period_psi", ways, allowed_deviation)


ERROR_GROWTH = 100.0  # growth of the steps' errors within a period


def period_by_scipy(point: Mapping[str, float], integration: Once) -> float:
    """Return the period of ω of a tumbling body in s, by DOP853; NaN beyond 100 rotations or if aperiodic."""
    from scipy.integrate import solve_ivp

    from kernels.free import exact

    moments, omega = SYSTEM.start({**point, "omega0": 1.0})
    c, period = euler_coefficients(moments), exact.period(exact.set_up(*moments, *omega))
    if not period < 200.0 * math.pi or moments[2] < float(point["energy"]) * moments[0]:
        return math.nan

    def axis_crossing(t, y):
        return y[1]

    axis_crossing.direction = math.copysign(1.0, c[1] * omega[2] * omega[0])
    rates = lambda t, w: [c[i] * w[i - 2] * w[i - 1] for i in range(3)]  # noqa: E731
    run = solve_ivp(rates, (0, 1.2 * period), omega, "DOP853", events=axis_crossing, rtol=1e-13, atol=1e-15)
    ends = run.t_events[0][run.t_events[0] > 0.5 * period]
    return float(ends[0]) / float(point["omega0"]) if ends.size else math.nan


def period_in_closed_form(point: Mapping[str, float], integration: Once) -> float:
    """Return the period of ω in s, 4 K(m)/p with K the elliptic integral and p the rate of the elliptic functions.

    NaN on the separatrix, and for an energy above the body's maximum, I_max/I_min.
    """
    from kernels.free import exact

    moments, omega = SYSTEM.start(point)
    impossible = moments[2] < float(point["energy"]) * moments[0]
    period = exact.period(exact.set_up(*moments, *omega))
    return period if math.isfinite(period) and not impossible else math.nan


def allowed_deviation(point: Mapping[str, float], integration: Once) -> float:
    """Return the allowed distance of a measured period from a reference, s."""
    moments = np.sort([point["I1"], point["I2"], point["I3"]])
    separatrix_distance = max(abs(1.0 - point["energy"] * moments[1] / moments[2]), ROUNDING_ERROR)
    return (
        ERROR_GROWTH * (integration.tolerance + ROUNDING_ERROR) + ROUNDING_ERROR / separatrix_distance
    ) * period_in_closed_form(point, integration)


SYSTEM = Tumbling()
