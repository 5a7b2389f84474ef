"""Variables of maps of Floquet multipliers: those of any system, and those of described systems."""

from dataclasses import replace

from kernels.codes import INVARIANTS as NAMES
from kernels.codes import REGIMES
from sweeps.schema.variables import Role, Variable, table
from sweeps.systems.shared_variables import layout, perturbation, regime, rows, status, with_theory

_BRANCH = "continuous from small modulation; multiples of 2 pi/T lie between the branches"
_EACH = ("multiplier",)
MULTIPLIER = Variable("multiplier", "1", "multiplier, by falling modulus, then argument", "i1")
LONG_NAMES = ("trace a of the monodromy matrix M", "(a² - tr M²)/2", "a² - 4b + 8", "det(M - 1)", "det(M + 1)")


_ERROR = "a bound: what the steps leave out, what the size changes, and rounding"


def _measured(*names: str, comment: str = "", **more) -> tuple[Variable, ...]:
    return with_theory(*names, _ERROR, comment=comment, **more)


MULTIPLIERS = rows(
    *_measured("multiplier_real", "1", "real part of the multiplier over one period", over=_EACH),
    *_measured("multiplier_imag", "1", "imaginary part of the multiplier over one period", over=_EACH),
    *_measured("exponent_real", "s-1", "real part of the exponent: growth, or decay below 0", over=_EACH),
    *_measured("exponent_imag", "s-1", "imaginary part of the exponent: turning", comment=_BRANCH, over=_EACH),
    *_measured("growth_rate", "s-1", "largest real part of the exponents", role=Role.MEASUREMENT),
    *_measured("growth_per_period", "1", "growth rate times the period"),
    *_measured("trace", "1", "trace of the monodromy matrix", scale="trace_error"),
    *regime(
        REGIMES,
        "by the smooth invariants of the monodromy matrix, or of its independent blocks, and their errors; unstable, "
        "too, where the kind of growth is open; marginal where the errors leave it open",
    ),
    """
    determinant_residual  1  f4  distance of the measured determinant from that of Liouville's formula, relative to its
        terms
    reciprocity_residual  1  f4  distance of the measured multipliers from pairs of product 1, likewise; of the
        determinant without pairs
    phase_residual        1  f4  distance of the traces of the variational flow from two phases of the period, relative
        to the matrix [check]
    propagation_error     1  f4  largest distance of the measured monodromy matrix from the variational flow's, relative
        to the matrix [certificate]
        comment: the certificate: the variational flow over one period shares no code with the measurement
    steps                 1  i4  number of segments of a period from whose ends perturbed motions start
    """,
    status(),
)
VARIABLES = MULTIPLIERS | rows(
    """
    base_residual  1  distance of the base motion from where it began a period before, relative to the states' sizes
        comment: 0 for an equilibrium at all times
    """
)
INVARIANTS = table(  # of two degrees of freedom, by Hamilton's equations
    *(v for name, words in zip(NAMES, LONG_NAMES, strict=True) for v in with_theory(name, "1", words, _ERROR))
)
BRANCH = rows(  # of descriptions that request others than the first
    """
    branch  1  i1  number of the motion on the curve that leads from the named place as the drive grows; 0 if missing
        comment: 1 before the first fold; each fold adds 1
    """
)

_WHERE = "where a segment of the period begins, relative to the states' sizes"
NUDGE = (perturbation(1e-8, "the size of the system", _WHERE),)
NEEDED = [name for name, variable in VARIABLES.items() if not variable.over]  # slices have no multipliers
LAYOUT = replace(layout(NUDGE, MULTIPLIER, 24, VARIABLES | INVARIANTS | BRANCH, NEEDED), spare=(MULTIPLIER.name,))
COORDINATES = LAYOUT.coordinates
