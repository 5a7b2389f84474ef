"""What a map of tumbling bodies holds: its variables, its coordinates, and the parameters that they vary."""

from typing import Annotated

from kernels import statuses
from sweeps.schema.values import number
from sweeps.schema.variables import Parameter, Quantity, Role, Variable, table
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.shared_variables import rows, status, with_exact

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

EXACT = rows(
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
_LEADING = {"exact": "mode_exact", "role": Role.HEADLINE}
_MODE = Variable("mode", None, "mode of the motion, measured", "i1", MODES, _MODES, -1, **_LEADING)
MEASURED = table(_MODE, *_PERIODS, *_ERRORS, status(statuses.NON_FINITE))

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
