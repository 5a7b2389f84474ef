"""What a map of uncertain bodies holds: probabilities, quantiles over `quantile`, sensitivities over `input`."""

from dataclasses import replace

from sweeps.schema.variables import Variable, table
from sweeps.systems.rigid_body.variables import LAYOUT as OF_RIGID_BODIES
from sweeps.systems.rigid_body.variables import REGIMES, SHAREABLE, VERDICTS
from sweeps.systems.shared_variables import rows

LEAST_INERTIA = f"about the axis of least inertia: {VERDICTS['stable_minor'].more}"
_OF_PROBABILITY = "; at least one draw; where all draws agree, the far end of the 95 % Wilson interval over 1.96"


def _sampled(text: str) -> dict[str, Variable]:
    """Return name → variable of a table as `rows` reads it; after each name that ends in ±, its sampling error."""
    variables = {}
    for row, one in rows(text).items():
        name = row.removesuffix("±")
        over = ("quantile",) if name.endswith("_quantile") else ("input",) if name.startswith("sensitivity") else ()
        variables[name] = replace(one, name=name, over=over)
        if name != row:
            how = "from independent replicates" + (_OF_PROBABILITY if name.startswith("probability") else "")
            words = f"sampling standard error of {name}"
            variables[f"{name}_error"] = Variable(f"{name}_error", one.units, words, comment=how, over=over)
    return variables


VARIABLES = _sampled(
    """
    probability_unstable±      1  probability that the spin is unstable, from the measured draws [measurement]
    probability_middle±        1  probability that the axis is the intermediate axis
    probability_middle_theory  1  probability that the axis is the intermediate axis, for normally distributed moments;
        missing where the principal axes tilt
    probability_flip±          1  probability that the body flips within `turns` turns of the spin, from the measured
        draws
        comment: `turns` is a key of the definition; over the draws that were followed to their flips
    stability                -  stable or unstable with a probability above 0.99, otherwise uncertain [headline]
        flags: 0 stable uncertain unstable
    status                   -  whether fewer than 1 % of the draws are undecided [status]
        flags: 0 ok undecided
    undecided                1  fraction of the draws whose regime is marginal or undetermined, or whose status is not
        ok
    impossible_naive         1  fraction of Gaussian samples that violate the triangle inequality of moments
    moment_mean_requested    kg m2  mean of the moment about the axis, requested
    moment_mean±             kg m2  mean of the moment about the axis, sampled
    moment_spread_requested  kg m2  standard deviation of the moment about the axis, requested
    moment_spread            kg m2  standard deviation of the moment about the axis, sampled
    draws                    1  i4  number of draws
    draws_followed           1  i4  number of draws that were followed to their flips
    growth_rate_quantile±    s-1  quantile of the measured growth rate
        comment: over all draws: 0 where not unstable
    frequency_quantile±      rad s-1  quantile of the measured angular frequency
        comment: over all draws: 0 where not stable
    flip_period_quantile±    s  quantile of the time between two flips, measured; missing where the spin keeps its sign
        comment: over all draws: a spin that keeps its sign counts as infinitely long
    max_tilt_quantile±       rad  quantile of the largest angle of the angular velocity from the direction of the axis
        near which it starts, measured
        comment: over all draws: from the axis of the drawn body
    sensitivity_first±       1  first-order Sobol index of Ω²
        comment: fraction of the variance of Ω² that this input alone explains
    sensitivity_total±       1  total Sobol index of Ω²
        comment: fraction of the variance of Ω² that is left if all other inputs are known
    """
)

TWISTS = _sampled(
    """
    twist_quantile±  rad  quantile of the absolute twist per revolution of the axis of least inertia about L, measured
        comment: over all draws: near pi, a half turn, for a thrown racket; missing for a spin about that axis
    """
)

KEPT = {
    name: replace(variable, over=("draw",))
    for name, variable in rows(
        """
        I1_draw           kg m2  moment about axis 1 of a draw
        I2_draw           kg m2  moment about axis 2 of a draw
        I3_draw           kg m2  moment about axis 3 of a draw
        growth_rate_draw  s-1  growth rate of a draw, measured
        frequency_draw    rad s-1  angular frequency of a draw, measured
        """,
        Variable("regime_draw", None, "regime of a draw, measured", "i1", REGIMES, first_flag=-1),
        """
        flip_period_draw  s  time between two flips of a draw; missing where the spin keeps its sign
        max_tilt_draw     rad  largest tilt of a draw
        twist_draw        rad  absolute twist of a draw, where `twist` is true
        """,
    ).items()
}

ARGUMENTS = ("body", "axis", *SHAREABLE)
FURTHER = table(
    Variable("quantile", "1", "fraction of the draws that do not exceed the value"),
    Variable("input", None, "uncertain input", "str"),
    Variable("draw", "1", "number of the draw", "i4"),
)
OF_BODIES = {name: one for name, one in OF_RIGID_BODIES.coordinates.items() if name not in OF_RIGID_BODIES.spare}
COORDINATES = OF_BODIES | FURTHER

_HELD = {"coordinates": {"body": OF_BODIES["body"], **COORDINATES}, "variables": VARIABLES | TWISTS | KEPT}
LAYOUT = replace(OF_RIGID_BODIES, needed=tuple(VARIABLES), over={}, **_HELD)
