"""What a map of tumbling bodies holds: its variables, its coordinates, and the parameters that they vary."""

from typing import Annotated

from kernels import statuses
from sweeps.schema.quantities import Parameter, Quantity
from sweeps.schema.values import MAX_SPIN_RATE, MIN_SPIN_RATE, Moment, number
from sweeps.schema.variables import Role, Variable, table
from sweeps.systems.rigid_body.variables import layout_of_bodies

MOMENTS = ("I1", "I2", "I3")
ARGUMENTS = (*MOMENTS, "energy", "omega0")
STATUSES = statuses.STATUSES[: statuses.NON_FINITE + 1]
MODES = ("impossible", "sam", "lam", "separatrix", "principal")

_MODES = (
    "sam: short-axis mode, the polhode encircles the axis of greatest inertia; lam: long-axis mode, that of least "
    "inertia; principal: rotation about a principal axis; impossible: energy outside the range of this body"
)
_ERROR = "three times the difference of two runs with different steps, and the effect of rounding"
PERIODS = {
    "period_psi": "period of the angular velocity in the body, P_psi",
    "period_phi_long_axis": "mean precession period about L of the axis of least inertia, P_phi (long-axis convention)",
    "period_phi_encircled": "mean precession period about L of the axis that the polhode encircles",
}

EXACT = table(
    Variable("mode_exact", None, "mode of the motion, from its energy", "i1", MODES, _MODES, -1),
    *(Variable(f"{name}_exact", "s", f"{text}, closed form") for name, text in PERIODS.items()),
    Variable("period_ratio", "1", "P_psi over P_phi in the long-axis convention, closed form"),
    Variable(
        "tilt_mean",
        "rad",
        "mean nutation angle: angle between L and the encircled axis, mean over a period, closed form",
        "f4",
    ),
    Variable("tilt_least", "rad", "least angle between L and the encircled axis, closed form", "f4"),
    Variable("tilt_greatest", "rad", "greatest angle between L and the encircled axis, closed form", "f4"),
    Variable(
        "triangle_margin",
        "1",
        "least of (Ib + Ic - Ia)/(I1 + I2 + I3) over the axes; negative where physically impossible",
        "f4",
        role=Role.EXISTENCE,
    ),
)

MEASURED = table(
    Variable(
        "mode", None, "mode of the motion, measured", "i1", MODES, _MODES, -1, exact="mode_exact", role=Role.HEADLINE
    ),
    *(
        Variable(name, "s", f"{text}, measured", exact=f"{name}_exact", error=f"{name}_error")
        for name, text in PERIODS.items()
    ),
    *(Variable(f"{name}_error", "s", f"error of the measured {name}", comment=_ERROR) for name in PERIODS),
    Variable("status", None, "whether the measurement can be trusted", "i1", STATUSES, role=Role.STATUS),
)

VARIABLES = MEASURED | EXACT

Energy = Annotated[float, number(lambda x: x >= 1, "a number from 1 to I_max/I_min of the body")]
Spin = Annotated[
    float, number(lambda x: MIN_SPIN_RATE <= x <= MAX_SPIN_RATE, "a number with 1e-150 ≤ omega0 ≤ 1e150 in rad s-1")
]
MOMENT = Quantity("moment", "kg m2", "finite, > 0", Moment)

PARAMETERS = (
    *(
        Parameter(f"I{i}", MOMENT, f"principal moment of inertia {i}", description=f"moment of inertia {i}, kg m2, > 0")
        for i in (1, 2, 3)
    ),
    Parameter(
        "energy",
        Quantity("energy", "1", "1 to I_max/I_min", Energy),
        "energy over its minimum at this angular momentum: 2T I3/L^2, moments ascending",
    ),
    Parameter(
        "omega0",
        Quantity("spin rate", "rad s-1", "1e-150 ≤ omega0 ≤ 1e150", Spin),
        "L/I3, the spin rate about the axis of greatest inertia with this L",
        1.0,
    ),
)

LAYOUT = layout_of_bodies(PARAMETERS, VARIABLES, tuple(EXACT))
COORDINATES = LAYOUT.coordinates
