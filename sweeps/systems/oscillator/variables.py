"""What a map of small oscillations holds, beside the parameters of the system described."""

from typing import Annotated

from kernels.statuses import STATUSES
from sweeps.schema import quantities
from sweeps.schema.layout import Layout
from sweeps.schema.quantities import Parameter, Quantity
from sweeps.schema.values import Epsilon, Phase, whole
from sweeps.schema.variables import Role, Variable, table
from sweeps.systems.rates import variables as rates

REGIMES = ("undetermined", "stable", "unstable", "marginal")
CERTIFIED = ("proved", "undecided", "searched")  # the numbers of sweeps.mechanics.equilibria
BRANCHES = ("decided", "undecided")

VARIABLES = rates.columns(
    reduced="extrapolated from half of it and a quarter",
    by="extrapolation",
    size="the mode's size",
    window="of the system's own size",
) | table(
    Variable("e_folds", "1", "e-folds of growth inside the window of the log slope"),
    Variable("regime_theory", None, "regime, linear theory", "i1", REGIMES, first_flag=-1),
    Variable(
        "regime", None, "regime, measured", "i1", REGIMES, first_flag=-1, theory="regime_theory", role=Role.HEADLINE
    ),
    Variable(
        "amplitude",
        "1",
        "amplitude a of a cos(w t + alpha), relative to the system's own size; missing where not stable",
        comment="from the start of the run and the measured frequency",
    ),
    Variable(
        "initial_phase",
        "rad",
        "phase alpha of a cos(w t + alpha); missing where not stable",
        comment="from the start of the run and the measured frequency",
    ),
    Variable(
        "rate_scale",
        "s-1",
        "bound on every possible rate at the equilibrium, which sets the length of the run",
        comment="from the absolute values of the terms of the second derivatives of V: it knows no theory",
    ),
    Variable("samples_used", "1", "number of samples inside the measurement window", "i4"),
    Variable("window_end", "s", "time of the last sample inside the measurement window"),
    Variable("steps_per_sample", "1", "integration steps between two samples", "i4"),
    Variable("status", None, "whether the measurement can be trusted", "i1", STATUSES, role=Role.STATUS),
    Variable(
        "equilibria_certified",
        None,
        "whether the point's equilibria are all that are there",
        "i1",
        CERTIFIED,
        comment="proved by enclosures; undecided where rounding hides whether one is single, several or none; searched "
        "where subdivision did not end",
    ),
    Variable(
        "energy_drift",
        "1",
        "largest change of the energy above the equilibrium, relative to its absolute terms",
        role=Role.CHECK,
    ),
)

DEGENERATE = table(
    Variable(
        "degenerate_frequency",
        "rad s-1",
        "angular frequency at the amplitude of the nudge where V'' vanishes and a higher term of V holds the motion",
        comment="closed form of the leading term (sweeps/mechanics/degenerate.py); goes with the amplitude to the "
        "power of half the order less one; missing elsewhere",
        error="degenerate_frequency_error",
    ),
    Variable(
        "degenerate_frequency_error",
        "rad s-1",
        "error of the frequency at the amplitude of the nudge",
        comment="what the other terms of V, and a changing mass, can add at that amplitude",
    ),
    Variable(
        "degenerate_amplitude",
        "1",
        "turning point of that motion, relative to the system's own size",
    ),
    Variable("degenerate_order", "1", "order of the term of V that holds it; 0 where none does", "i1"),
)

FOLLOWED = table(
    Variable(
        "branches_decided",
        None,
        "whether it is known which equilibrium of the point is which branch",
        "i1",
        BRANCHES,
        comment="decided where each is carried on from the defaults with a proof, or led straight through what it "
        "meets; undecided where two are led to one place nearly as well, or one comes or goes alone",
    ),
)

NUDGE = (
    Parameter(
        "epsilon",
        Quantity("size", "1", "0 < epsilon < 1", Epsilon),
        "size of the nudge relative to the system's own size",
        1e-6,
        "size of the nudge along the mode, relative to the system's own size, 0 < epsilon < 1",
    ),
    Parameter(
        "phase",
        Quantity("direction", "rad", "finite", Phase),
        "direction of the nudge in the plane of place and velocity over the rate scale",
        0.6,
        "direction of the nudge: cos(phase) in place, -sin(phase) in velocity over the rate scale, rad",
    ),
)

COORDINATES = quantities.coordinates(NUDGE) | table(  # beside the parameters
    Variable("equilibrium", None, "equilibrium", "str"),
    Variable("mode", "1", "normal mode, by ascending signed square of its rate", "i1"),
)

LAYOUT = Layout(
    COORDINATES,
    VARIABLES | DEGENERATE | FOLLOWED,
    tuple(VARIABLES),
    {parameter.name: parameter.quantity.item for parameter in NUDGE}
    | {"mode": Annotated[int, whole(1, 100, "whole numbers from 1 to 100")], "equilibrium": str},
    is_open=True,
)
