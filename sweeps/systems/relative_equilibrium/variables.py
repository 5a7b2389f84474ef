"""What a map of relative equilibria holds, beside the parameters and the places of the system described."""

from sweeps.schema.variables import Role, Variable, table
from sweeps.systems.shared_variables import layout, of_runs, perturbation, regime, rows, with_theory

REGIMES = ("undetermined", "asymptotically_stable", "stable", "unstable", "flutter", "marginal")

_BOUND = "bound of scatter, rounding, integration error and the effect of the finite perturbation, each at its worst"
_RATE = {"error": f"{_BOUND}; grows as a root of the noise where eigenvalues meet", "scale": "rate_scale"}
_REAL = "real part of the eigenvalue (positive: growth, negative: decay)"
_IMAG = "imaginary part of the eigenvalue (angular frequency)"
_GROWTH = "largest real part of all eigenvalues (negative: decay)"


def _measured(name: str, units: str, long_name: str, error: str = _BOUND, **more) -> tuple[Variable, ...]:
    return with_theory(name, units, long_name, error, name, **more)


VARIABLES = rows(
    *_measured("eigenvalue_real", "s-1", _REAL, **_RATE),
    *_measured("eigenvalue_imag", "s-1", _IMAG, **_RATE),
    *_measured("growth_rate", "s-1", _GROWTH, role=Role.MEASUREMENT, **_RATE),
    *regime(
        REGIMES,
        "stable, too, where motions end at a family of equilibria, or a conserved quantity or the energy is proved to "
        "be definite; unstable, too, where the kind of growth is open; marginal where errors leave it open",
    ),
    """
    eigenvalue_condition     1  condition number of the eigenvalue, linear theory: sensitivity to changes of the
        equations
        comment: product of the norms of its left and right eigenvectors, in units of the states; infinite where two
        meet
    smallest_singular_value  1  ratio of the smallest singular value of the samples to the largest
        comment: below 1.5e-4 a mode was not excited, and nothing is reported
    """,
    *of_runs("the Jacobian", ", of the shortest run"),
)

INVARIANTS = table(  # of four eigenvalues
    *_measured("sum_of_squares", "s-2", "half the sum of the squared eigenvalues (pairs ±a, ±b: a² + b²)"),
    *_measured("product_of_squares", "s-4", "product of the eigenvalues (pairs ±a, ±b: a² b²)"),
    *_measured("discriminant", "s-4", "sum_of_squares² - 4 product_of_squares (pairs ±a, ±b: (a² - b²)²)"),
)

_UNITS = "; motions are carried in units of it, so that none is too small"
NUDGE = (perturbation(1e-30, "the size of the system", "relative to the size of the system", _UNITS),)

_EIGENVALUE = Variable("eigenvalue", "1", "eigenvalue, by ascending imaginary, then real part", "i1")
LAYOUT = layout(NUDGE, _EIGENVALUE, 12, VARIABLES | INVARIANTS, VARIABLES)
COORDINATES = LAYOUT.coordinates  # beside the parameters
