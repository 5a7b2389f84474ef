"""What a map of symmetric tops holds: its variables, its coordinates, and the parameters that they vary."""

from dataclasses import replace
from typing import Annotated

from kernels import statuses
from sweeps.schema.values import MIN_SPIN_RATE, number, spin_rate
from sweeps.schema.variables import Layout, Parameter, Quantity, coordinates_of
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.shared_variables import STEPS, rows, status

_MEASURED = """
    {0}         rad s-1  precession rate of the {1} about the figure axis, measured{2}
        comment: {3}0 where it cannot be distinguished from rounding
    {0}_stderr  rad s-1  standard error of the measured precession rate{4}
        comment: scatter of the samples only
    {0}_error   rad s-1  error of the measured precession rate{4}
        comment: bounds the distance from the closed form: scatter, integration error and rounding
"""
_MOMENTUM = "momentum_precession_rate"

VARIABLES = rows(
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
    status(statuses.NON_FINITE),
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
