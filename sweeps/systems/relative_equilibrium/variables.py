"""What a map of relative equilibria holds, beside the parameters and the places of the system described."""

from typing import Annotated

from kernels.statuses import STATUSES
from sweeps.schema import quantities
from sweeps.schema.layout import Layout
from sweeps.schema.quantities import Parameter, Quantity
from sweeps.schema.values import Epsilon, whole
from sweeps.schema.variables import Role, Variable, table

REGIMES = ("undetermined", "asymptotically_stable", "stable", "unstable", "flutter", "marginal")

_BOUND = (
    "a bound: scatter of the samples, rounding, the integrator's error and that of a finite nudge, each at its worst"
)
_ROOTS = "grows like a root of the noise where eigenvalues meet"
_PAIRS = "half the sum of the squares of four eigenvalues; of pairs ±a, ±b it is a² + b²"


def _measured(name, units, long_name, comment=_BOUND, role=Role.NONE, scale="") -> tuple[Variable, ...]:
    """A quantity by theory, as measured, and its error."""
    theory, error = f"{name}_theory", f"{name}_error"
    return (
        Variable(theory, units, f"{long_name}, linear theory"),
        Variable(name, units, f"{long_name}, measured", theory=theory, error=error, scale=scale, role=role),
        Variable(error, units, f"error of the measured {long_name}", comment=comment),
    )


VARIABLES = table(
    *_measured(
        "eigenvalue_real",
        "s-1",
        "real part of the eigenvalue: growth, or decay below 0",
        f"{_BOUND}; {_ROOTS}",
        scale="rate_scale",
    ),
    *_measured(
        "eigenvalue_imag",
        "s-1",
        "imaginary part of the eigenvalue: turning",
        f"{_BOUND}; {_ROOTS}",
        scale="rate_scale",
    ),
    *_measured(
        "growth_rate",
        "s-1",
        "largest real part of all eigenvalues; decay is negative",
        f"{_BOUND}; {_ROOTS}",
        Role.MEASUREMENT,
        "rate_scale",
    ),
    Variable("regime_theory", None, "regime, linear theory", "i1", REGIMES, first_flag=-1),
    Variable(
        "regime",
        None,
        "regime, measured",
        "i1",
        REGIMES,
        "as far as the errors tell; marginal where they do not",
        first_flag=-1,
        theory="regime_theory",
        role=Role.HEADLINE,
    ),
    Variable(
        "eigenvalue_condition",
        "1",
        "condition number of the eigenvalue, linear theory: how many times a disturbance of the equations moves it",
        comment="product of the sizes of its left and right vectors, in units of the states; infinite where two meet",
    ),
    Variable(
        "smallest_singular_value",
        "1",
        "smallest singular value of the samples over the largest",
        comment="below 1e-4 a mode was not moved, and nothing is told",
    ),
    Variable(
        "rate_scale",
        "s-1",
        "bound on every possible rate at the equilibrium, which sets the length of the run",
        comment="from the absolute values of the terms of the Jacobian: it knows no theory",
    ),
    Variable("samples_used", "1", "number of samples inside the measurement window, of the shortest run", "i4"),
    Variable("window_end", "s", "time of the last sample inside the measurement window"),
    Variable("steps_per_sample", "1", "integration steps between two samples", "i4"),
    Variable("status", None, "whether the measurement can be trusted", "i1", STATUSES, role=Role.STATUS),
)

INVARIANTS = table(  # of four eigenvalues
    *_measured("sum_of_squares", "s-2", "half the sum of the squares of the eigenvalues", f"{_BOUND}; {_PAIRS}"),
    *_measured("product_of_squares", "s-4", "product of the eigenvalues: of pairs ±a, ±b it is a² b²"),
    *_measured("discriminant", "s-4", "sum_of_squares² - 4 product_of_squares: of pairs it is (a² - b²)²"),
)

NUDGE = (
    Parameter(
        "epsilon",
        Quantity("size", "1", "0 < epsilon < 1", Epsilon),
        "size of the nudges relative to the system's own size",
        1e-30,
        "size of the nudges relative to the system's own size, 0 < epsilon < 1; motions are carried in units of it, so "
        "that none is too small",
    ),
)

COORDINATES = quantities.coordinates(NUDGE) | table(  # beside the parameters
    Variable("equilibrium", None, "equilibrium", "str"),
    Variable("eigenvalue", "1", "eigenvalue, by ascending imaginary, then real part", "i1"),
)

LAYOUT = Layout(
    COORDINATES,
    VARIABLES | INVARIANTS,
    tuple(VARIABLES),
    {parameter.name: parameter.quantity.item for parameter in NUDGE}
    | {"eigenvalue": Annotated[int, whole(1, 12, "whole numbers from 1 to 12")], "equilibrium": str},
    is_open=True,
)
