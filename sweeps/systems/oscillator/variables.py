"""What a map of small oscillations holds, beside the parameters of the system described."""

from sweeps.schema.values import Phase
from sweeps.schema.variables import Parameter, Quantity, Variable
from sweeps.systems import rates
from sweeps.systems.shared_variables import layout, of_runs, perturbation, regime, rows

REGIMES = ("undetermined", "stable", "unstable", "marginal")

VARIABLES = rates.columns(
    reduced="extrapolated from a half and a quarter of it",
    by="extrapolation",
    size="the amplitude of the mode",
    window="of the size of the system",
) | rows(
    "e_folds  1  e-folds of growth within the window of the log slope",
    *regime(REGIMES),
    """
    amplitude      1    amplitude a of a cos(w t + alpha), relative to the size of the system; missing where not stable
        comment: from the start of the run and the measured frequency
    initial_phase  rad  phase alpha of a cos(w t + alpha); missing where not stable
        comment: from the start of the run and the measured frequency
    """,
    *of_runs("the second derivatives of V"),
    """
    energy_drift   1    largest change of the energy above the equilibrium, relative to the sum of its absolute
        terms [check]
    """,
)

DEGENERATE = rows(
    """
    degenerate_frequency        rad s-1  angular frequency at the amplitude of the perturbation where V'' = 0 and a
        higher-order term of V confines
        comment: closed form of the leading term (sweeps/mechanics/degenerate.py), proportional to the amplitude to the
        power order/2 - 1; missing elsewhere
    degenerate_frequency_error  rad s-1  error of the frequency at the amplitude of the perturbation
        comment: bounds the effect of the other terms of V and of a varying mass at that amplitude
    degenerate_amplitude        1  turning point of that motion, relative to the size of the system
    degenerate_order            1  i1  order of the term of V that confines the motion; 0 where none does
    """
)

FOLLOWED = rows(
    """
    branches_decided  -  whether the branches are identified at this point
        flags: 0 decided undecided
        comment: decided: each equilibrium is followed from the default parameters with a proof, or straight through a
        bifurcation; undecided: two branches fit one equilibrium nearly as well, or one appears or ends alone
    """
)

NUDGE = (
    perturbation(1e-6, "the size of the system", "along the mode, relative to the size of the system"),
    Parameter(
        "phase",
        Quantity("direction", "rad", "finite", Phase),
        "direction of the perturbation in the plane of position and velocity over the rate scale",
        0.6,
        "direction of the perturbation: cos(phase) in position, -sin(phase) in velocity over the rate scale, rad",
    ),
)

_MODE = Variable("mode", "1", "normal mode, by ascending Ω²", "i1")
LAYOUT = layout(NUDGE, _MODE, 100, VARIABLES | DEGENERATE | FOLLOWED, VARIABLES)
COORDINATES = LAYOUT.coordinates  # beside the parameters
