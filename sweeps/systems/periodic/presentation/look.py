"""How the regimes of multipliers look."""

from sweeps.figure import colors
from sweeps.systems.presentation.look import Compared, Look, Mark, Symbol

MARKS = {
    "asymptotically_stable": Mark("stable, decays", "-", colors.SERIES_COLORS[2]),
    "period_doubling": Mark("unstable, sign changes each period", "2", colors.SERIES_COLORS[4]),
    "flutter": Mark("flutter", "~", colors.SERIES_COLORS[3]),
    "perturbation_too_large": Mark("perturbation too large", "n", ""),
    "no_periodic_motion": Mark("no periodic motion", "o", ""),
}
COMPARED = (Compared(("trace",), "trace"), Compared(("growth_rate",), "growth rate"))
LOOK = Look(marks=MARKS, symbols={"epsilon": Symbol(r"$\varepsilon$", "ε")})
