"""The tennis racket's twist: a thrown body's rotation about its handle per revolution of the handle."""

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np

from kernels.estimator import statuses
from sweeps.schema.parameters import grid_model, key, mapping
from sweeps.schema.values import Phase, number
from sweeps.schema.variables import Parameter, Quantity
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.bodies.body import BODIES, Body, FollowedDefinition, Once, list_of
from sweeps.systems.bodies.free_body import MeasuredOnce
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.bodies.variables import MOMENTS, Spin
from sweeps.systems.reintegration import ROUNDING_ERROR, euler_coefficients
from sweeps.systems.shared_variables import make_status, parse_rows, with_exact
from sweeps.systems.system import Example, Reference

ARGUMENTS = (*MOMENTS, "chi", "theta", "omega0")

_MISSING = "missing where L is parallel to the handle"

_TWIST = "twist per revolution of the handle about L (signed change of chi)"
_TURN = "time of one revolution of the handle about L"

EXACT = parse_rows(
    f"""
    twist_exact          rad  {_TWIST}, closed form
    time_of_turn_exact   s    {_TURN}, closed form
    twist_defect_theory  rad  shortfall of the twist from a half turn on the separatrix, symmetric start and end
        comment: 2 eps with artanh(sqrt(a) cos(eps)/sqrt(a + b sin(eps)^2)) = growth (pi + arcsin(cos(eps) sqrt(b/(a +
        b)))), a = I2/I1 - 1, b = 1 - I2/I3; falls with exp(-pi growth)
    growth               1    growth rate about the intermediate axis over the spin rate, linear theory: sqrt(a b)
    """,
    bodies.TRIANGLE_MARGIN,
)

MEASURED = parse_rows(
    *with_exact("twist", "rad", _TWIST, "twist", bodies.TWO_RUNS, _MISSING),
    "twist_defect  rad  shortfall of the twist from a half turn, measured: pi - abs(twist)",
    *with_exact("time_of_turn", "s", _TURN, "time of the revolution", bodies.TWO_RUNS, _MISSING),
    """
    ends_reversed  -  side of the handle on which L lies after the revolution [headline]
        flags: -1 undetermined same_side reversed
    """,
    make_status(statuses.NON_FINITE),
)

VARIABLES = MEASURED | EXACT

Tilt = Annotated[float, number(lambda x: 0 <= x <= math.pi, "a number from 0 to pi, in rad")]

PARAMETERS = (
    *bodies.PRINCIPAL,
    Parameter(
        "chi",
        Quantity("side", "rad", "finite", Phase),
        "initial angle of L about the handle: atan2(L3, L2), moments ascending",
        required=True,
    ),
    Parameter(
        "theta", Quantity("tilt", "rad", "0 to pi", Tilt), "initial angle between L and the handle", 0.5 * math.pi
    ),
    bodies.spin("L/I2, the spin rate about the intermediate axis with this L"),
)

LAYOUT = bodies.layout(PARAMETERS, VARIABLES, EXACT)


A_POINT = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "chi": 0.1, "theta": 1.5, "omega0": 1.0}

TwistGrid = grid_model("TwistGrid", PARAMETERS, __name__, RATIOS)


class Racket(Body):
    """A body that is thrown."""

    omega0: Spin = key("L/I2 of this body, rad s-1: 1e-150 ≤ omega0 ≤ 1e150")


class TwistDefinition(FollowedDefinition):
    """A sweep of throws."""

    shareable: ClassVar = ("omega0",)
    grid: TwistGrid = mapping("what is varied", TwistGrid, required=True)
    bodies: list_of(Racket) = key(BODIES, ())


class Twist(MeasuredOnce):
    """A body thrown near its intermediate axis: its twist about the handle per revolution of the handle about L."""

    name = "twist"
    kernels = ("events.twist", "estimator.statuses", "free.triangle")
    compiled = (Example("events.twist", "survey", (A_POINT, 1e-9)),)
    compile_seconds = 11.0
    model = TwistDefinition
    closed_quantities = "attitude"
    references = "Landau and Lifshitz, Mechanics, section 37; Van Damme, Mardesic and Sugny, Physica D 338 (2017) 17"
    caption = "measured twist of a thrown body per revolution of its handle, compared with the closed form"
    samples_per_second = 400_000

    def start(self, point: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Return moments (ascending, kg m2) and ω at time 0 (rad s-1) of a point: L = I2 omega0."""
        from kernels.events import twist

        moments = np.sort([float(point[name]) for name in MOMENTS])
        omega = np.array(twist.start(*moments / moments[1], float(point["chi"]), float(point["theta"])))
        return moments, omega * float(point["omega0"])

    def survey(self, points: Mapping[str, np.ndarray], integration: Once) -> dict[str, np.ndarray]:
        """Return the closed form and the measured columns; see `kernels.events.twist`."""
        from kernels.events import twist

        return twist.survey(points, integration.tolerance, integration.measured)

    def agrees(self, points: Mapping[str, np.ndarray], columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return True for points with the closed form's twist within its error; a spin about the handle has none."""
        agrees_in_twist = np.abs(columns["twist"] - columns["twist_exact"]) <= columns["twist_error"]
        return (np.asarray(points["theta"]) == 0.0) | agrees_in_twist  # at 0 the handle has no azimuth about L

    def reference(self) -> Reference:
        """Return the time of a revolution by SciPy's DOP853 and by the closed form of the attitude."""
        ways = {"SciPy DOP853": turn_by_scipy, "closed form": turn_in_closed_form}
        return Reference("time_of_turn", ways, allowed_deviation)


ERROR_GROWTH = 100.0  # growth of the steps' errors about the intermediate axis within a revolution


def turn_by_scipy(point: Mapping[str, float], integration: Once) -> float:
    """Return the time of one revolution of the handle about L in s, by DOP853; NaN along the handle."""
    from scipy.integrate import solve_ivp

    moments, omega = SYSTEM.start({**point, "omega0": 1.0})
    c = euler_coefficients(moments)
    L = float(np.linalg.norm(moments * omega))
    duration = 2.1 * math.pi * moments[2] / moments[1]
    if not omega[1:].any():
        return math.nan

    def rates(_, y):
        w, across = y[:3], (moments[1] * y[1]) ** 2 + (moments[2] * y[2]) ** 2
        azimuth_rate = L * (moments[1] * y[1] ** 2 + moments[2] * y[2] ** 2) / across
        return [c[0] * w[1] * w[2], c[1] * w[2] * w[0], c[2] * w[0] * w[1], azimuth_rate]

    def revolution(_, y):
        return y[3] - 2.0 * math.pi

    revolution.terminal = True
    run = solve_ivp(rates, (0, duration), [*omega, 0.0], "DOP853", events=revolution, rtol=1e-13, atol=1e-15)
    return float(run.t_events[0][-1]) / float(point["omega0"])


def turn_in_closed_form(point: Mapping[str, float], integration: Once) -> float:
    """Return the time of a revolution in s, from the closed form of the attitude; NaN along the handle."""
    from kernels.events import twist

    return float(twist.survey(point, integration.tolerance, False)["time_of_turn_exact"][0])


def allowed_deviation(point: Mapping[str, float], integration: Once) -> float:
    """Return the allowed distance of a measured time from a reference, s."""
    return ERROR_GROWTH * (integration.tolerance + ROUNDING_ERROR) * turn_in_closed_form(point, integration)


SYSTEM = Twist()
