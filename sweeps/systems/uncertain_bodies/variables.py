"""What a map of uncertain bodies holds: probabilities, quantiles over `quantile`, sensitivities over `input`."""

from sweeps.schema.layout import Layout
from sweeps.schema.variables import Role, Variable, table
from sweeps.systems.rigid_body.variables import COORDINATES as OF_ANY
from sweeps.systems.rigid_body.variables import LAYOUT as OF_RIGID_BODIES
from sweeps.systems.rigid_body.variables import REGIMES

OUTLOOKS = ("stable", "doubtful", "unstable")
STATUSES = ("ok", "undecided")
_ERROR = "standard error of the sampling, from independent replicates"
_OF_PROBABILITY = "; at least one draw, and where all draws agree the far end of Wilson's interval of 95 % over 1.96"
_ALL = "over all draws: {}"
_FIRST = "share of the variance of the signed square of the rate that goes with this input alone"
_TOTAL = "share of that variance that would be left if all other inputs were known"


def _with_error(name: str, units: str, long_name: str, comment: str = "", **more) -> tuple[Variable, Variable]:
    value = Variable(name, units, long_name, comment=comment, **more)
    how = _ERROR + (_OF_PROBABILITY if name.startswith("probability") else "")
    error = Variable(f"{name}_error", units, f"standard error of: {long_name}", comment=how, over=value.over)
    return value, error


def _quantile(name: str, units: str, long_name: str, comment: str) -> tuple[Variable, Variable]:
    return _with_error(f"{name}_quantile", units, long_name, _ALL.format(comment), over=("quantile",))


VARIABLES = table(
    *_with_error(
        "probability_unstable",
        "1",
        "probability that the spin is unstable, measured draw by draw",
        role=Role.MEASUREMENT,
    ),
    *_with_error(
        "probability_middle",
        "1",
        "probability that the moment about the axis is the middle one",
    ),
    Variable(
        "probability_middle_theory",
        "1",
        "the same by the normal distribution of the moments; missing where principal axes tilt",
    ),
    *_with_error(
        "probability_flip",
        "1",
        "probability that the spin turns over in every so many turns, measured",
        "how many is the definition's `turns`; of the draws that were followed that far",
    ),
    Variable(
        "outlook",
        None,
        "stable or unstable with a probability above 0.99, else doubtful",
        "i1",
        OUTLOOKS,
        role=Role.HEADLINE,
    ),
    Variable(
        "status", None, "whether fewer than 1 % of the draws were left undecided", "i1", STATUSES, role=Role.STATUS
    ),
    Variable("undecided", "1", "share of the draws whose regime was marginal, undetermined or not measured well"),
    Variable("impossible_naive", "1", "share of plain Gaussian draws that would have been no body"),
    Variable("moment_mean_asked", "kg m2", "mean of the moment about the axis, as asked for"),
    *_with_error("moment_mean", "kg m2", "mean of the moment about the axis, of the bodies drawn"),
    Variable("moment_spread_asked", "kg m2", "standard deviation of that moment, as asked for"),
    Variable("moment_spread", "kg m2", "standard deviation of that moment, of the bodies drawn"),
    Variable("draws", "1", "number of bodies drawn", "i4"),
    Variable("draws_followed", "1", "number of these that were followed on to their flips", "i4"),
    *_quantile("growth_rate", "s-1", "quantile of the measured growth rate", "0 where not unstable"),
    *_quantile("frequency", "rad s-1", "quantile of the measured angular frequency", "0 where not stable"),
    *_quantile(
        "flip_period",
        "s",
        "quantile of the time between two flips, measured; missing for never",
        "a spin that keeps its sign counts as later than any",
    ),
    *_quantile(
        "max_tilt",
        "rad",
        "quantile of the largest angle of the angular velocity from the end of the axis it starts near, measured",
        "from the axis of the body drawn",
    ),
    *_with_error("sensitivity_first", "1", "first-order Sobol index of the rate squared", _FIRST, over=("input",)),
    *_with_error("sensitivity_total", "1", "total Sobol index of the rate squared", _TOTAL, over=("input",)),
)

TWISTS = table(
    *_quantile(
        "twist",
        "rad",
        "quantile of the size of the twist about the axis of least moment while that comes round once, measured",
        "half a turn, near pi, is a thrown racket's; missing for a spin along that axis",
    ),
)

KEPT = table(
    *(Variable(f"I{i}_draw", "kg m2", f"moment about axis {i} of a body drawn", over=("draw",)) for i in (1, 2, 3)),
    Variable("growth_rate_draw", "s-1", "growth rate of a body drawn, measured", over=("draw",)),
    Variable("frequency_draw", "rad s-1", "angular frequency of a body drawn, measured", over=("draw",)),
    Variable("regime_draw", None, "regime of a body drawn, measured", "i1", REGIMES, first_flag=-1, over=("draw",)),
    Variable("flip_period_draw", "s", "time between two flips of a body drawn; missing for never", over=("draw",)),
    Variable("max_tilt_draw", "rad", "largest tilt of a body drawn", over=("draw",)),
    Variable("twist_draw", "rad", "size of the twist of a body drawn, where `twist` is true", over=("draw",)),
)

FURTHER = table(
    Variable("quantile", "1", "share of the draws that do not exceed the value"),
    Variable("input", None, "what is uncertain", "str"),
    Variable("draw", "1", "number of the draw", "i4"),
)
OF_BODIES = {name: one for name, one in OF_ANY.items() if name not in OF_RIGID_BODIES.spare}
COORDINATES = OF_BODIES | FURTHER

LAYOUT = Layout(
    {"body": OF_BODIES["body"], **COORDINATES},
    VARIABLES | TWISTS | KEPT,
    tuple(VARIABLES),
    OF_RIGID_BODIES.values,
    along="body",
    beside=OF_RIGID_BODIES.beside,
    spare=OF_RIGID_BODIES.spare,
)
