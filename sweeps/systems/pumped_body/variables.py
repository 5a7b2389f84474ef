"""What a map of pumped bodies holds: its variables, its coordinates, and the parameters that they vary."""

from typing import Annotated

from kernels.floquet import REGIMES
from kernels.statuses import STATUSES
from sweeps.schema import quantities
from sweeps.schema.layout import Layout
from sweeps.schema.quantities import Parameter, Quantity
from sweeps.schema.values import Axis, Phase, number, whole
from sweeps.schema.variables import Role, Variable, table
from sweeps.systems import shape_coordinates
from sweeps.systems.rigid_body import variables as rigid_body

MOMENTS = ("I1", "I2", "I3")
CHANGING = (*MOMENTS, *(f"{name}{i}" for name in ("depth", "lag") for i in (1, 2, 3)))

_ERROR = "a bound: motions forward and backward, of two sizes and with different steps, and rounding"
_BRANCH = "continuous from small modulation; multiples of 2 pi/T lie between the branches"


def _measured(name, units, long_name, comment="", over=(), role=Role.NONE, scale="") -> tuple[Variable, ...]:
    """Return a quantity by linear theory, as measured, and its error."""
    theory, error = f"{name}_theory", f"{name}_error"
    return (
        Variable(theory, units, f"{long_name}, linear theory", over=over),
        Variable(
            name, units, f"{long_name}, measured", "f8", (), comment, 0, False, theory, "", error, scale, role, over
        ),
        Variable(error, units, f"error of the measured {long_name}", comment=_ERROR, over=over),
    )


_EACH = ("multiplier",)
VARIABLES = table(
    *_measured("multiplier_real", "1", "real part of the multiplier over one period", over=_EACH),
    *_measured("multiplier_imag", "1", "imaginary part of the multiplier over one period", over=_EACH),
    *_measured("exponent_real", "s-1", "real part of the exponent: growth, or decay below 0", over=_EACH),
    *_measured("exponent_imag", "s-1", "imaginary part of the exponent: turning", _BRANCH, over=_EACH),
    *_measured("growth_rate", "s-1", "largest real part of the exponents", role=Role.MEASUREMENT),
    *_measured("growth_per_period", "1", "growth rate times the period"),
    *_measured("trace", "1", "trace of the monodromy matrix"),
    Variable("regime_theory", None, "regime, linear theory", "i1", REGIMES, first_flag=-1),
    Variable(
        "regime",
        None,
        "regime, measured",
        "i1",
        REGIMES,
        "by the trace and its error: unstable above 2, period_doubling below -2, stable between; marginal where the "
        "error does not tell",
        first_flag=-1,
        theory="regime_theory",
        role=Role.HEADLINE,
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
    Variable("status", None, "whether the measurement can be trusted", "i1", STATUSES, role=Role.STATUS),
    Variable(
        "triangle_margin",
        "1",
        "least of (Ib + Ic - Ia)/(I1 + I2 + I3) over the axes and the period; negative where no body can do that",
        "f4",
        role=Role.EXISTENCE,
    ),
)

Depth = Annotated[float, number(lambda x: -0.99 <= x <= 0.99, "a number from -0.99 to 0.99: no moment reaches 0")]
Frequency = Annotated[
    float, number(lambda x: 1e-150 <= x <= 1e150, "a number with 1e-150 ≤ frequency ≤ 1e150 in rad s-1")
]
DEPTH = Quantity("depth", "1", "-0.99 to 0.99", Depth)
_FREE = {parameter.name: parameter for parameter in rigid_body.PARAMETERS}

PARAMETERS = (
    *(Parameter(name, rigid_body.MOMENT, f"{_FREE[name].long_name}, mean", required=True) for name in MOMENTS),
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
        rigid_body.SPIN,
        "spin rate: angular momentum over the mean moment of the spin axis",
        required=True,
    ),
    _FREE["epsilon"],
    _FREE["phase"],
)
ARGUMENTS = ("axis", *(parameter.name for parameter in PARAMETERS))
COORDINATES = (
    table(Variable("axis", "1", "spin axis (1, 2 or 3)", "i1"))
    | shape_coordinates.COORDINATES
    | quantities.coordinates(PARAMETERS)
    | table(Variable("multiplier", "1", "multiplier, by falling modulus, then argument", "i1"))
)
LAYOUT = Layout(
    COORDINATES,
    VARIABLES,
    tuple(VARIABLES),
    {"axis": Axis, "multiplier": Annotated[int, whole(1, 2, "1 or 2")]}
    | shape_coordinates.VALUES
    | {parameter.name: parameter.quantity.item for parameter in PARAMETERS},
    spare=tuple(shape_coordinates.COORDINATES),
    over=shape_coordinates.OVER,
)
