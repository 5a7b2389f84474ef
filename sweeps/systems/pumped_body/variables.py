"""What a map of pumped bodies holds: its variables, its coordinates, and the parameters that they vary."""

from dataclasses import replace
from typing import Annotated

from kernels.floquet import REGIMES
from sweeps.schema.quantities import Parameter, Quantity
from sweeps.schema.values import Phase, number, whole
from sweeps.schema.variables import Role, Variable, table
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.shared_variables import regime, status, with_theory

CHANGING = (*MOMENTS, *(f"{name}{i}" for name in ("depth", "lag") for i in (1, 2, 3)))

_ERROR = "a bound: motions forward and backward, of two sizes and with different steps, and rounding"
_BRANCH = "continuous from small modulation; multiples of 2 pi/T lie between the branches"


def _measured(*names: str, comment: str = "", **more) -> tuple[Variable, ...]:
    return with_theory(*names, _ERROR, comment, **more)


_EACH = ("multiplier",)
VARIABLES = table(
    *_measured("multiplier_real", "1", "real part of the multiplier over one period", over=_EACH),
    *_measured("multiplier_imag", "1", "imaginary part of the multiplier over one period", over=_EACH),
    *_measured("exponent_real", "s-1", "real part of the exponent: growth, or decay below 0", over=_EACH),
    *_measured("exponent_imag", "s-1", "imaginary part of the exponent: turning", comment=_BRANCH, over=_EACH),
    *_measured("growth_rate", "s-1", "largest real part of the exponents", role=Role.MEASUREMENT),
    *_measured("growth_per_period", "1", "growth rate times the period"),
    *_measured("trace", "1", "trace of the monodromy matrix"),
    *regime(
        REGIMES,
        "by the trace and its error: unstable above 2, period_doubling below -2, stable between; marginal where the "
        "error does not tell",
    ),
    Variable("determinant_residual", "1", "distance of the measured determinant from 1, relative to its terms", "f4"),
    Variable("reciprocity_residual", "1", "distance of the measured multipliers' product from 1, likewise", "f4"),
    Variable(
        "phase_residual",
        "1",
        "distance of the traces of the variational flow from two phases of the period, relative to the matrix",
        "f4",
        role=Role.CHECK,
    ),
    Variable(
        "propagation_error",
        "1",
        "largest distance of the measured monodromy matrix from the variational flow's, relative to the matrix",
        "f4",
        comment="the certificate: the variational flow over one period shares no code with the measurement",
        role=Role.CERTIFICATE,
    ),
    Variable("steps", "1", "integration steps in a period", "i4"),
    status(),
    replace(
        bodies.TRIANGLE_MARGIN,
        long_name="least of (Ib + Ic - Ia)/(I1 + I2 + I3) over the axes and the period; negative where no body can do "
        "that",
    ),
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
        "omega0",
        bodies.SIGNED_SPIN,
        "spin rate: angular momentum over the mean moment of the spin axis",
        required=True,
    ),
    bodies.EPSILON,
    bodies.PHASE,
)
ARGUMENTS = ("axis", *(parameter.name for parameter in PARAMETERS))
_FREE = bodies.layout(PARAMETERS, VARIABLES, VARIABLES, spun=True, listed=False)
MULTIPLIER = Variable("multiplier", "1", "multiplier, by falling modulus, then argument", "i1")
LAYOUT = replace(
    _FREE,
    coordinates=_FREE.coordinates | table(MULTIPLIER),
    values=_FREE.values | {"multiplier": Annotated[int, whole(1, 2, "1 or 2")]},
)
COORDINATES = LAYOUT.coordinates
