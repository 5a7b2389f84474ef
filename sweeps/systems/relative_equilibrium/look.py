"""How the flags and the nudge of relative equilibria look."""

from sweeps import colors
from sweeps.systems.look import Look, Mark, Symbol

LOOK = Look(
    marks={
        "asymptotically_stable": Mark("stable, decays", "-", colors.SERIES_COLORS[2]),
        "flutter": Mark("flutter", "~", colors.SERIES_COLORS[3]),
        "no_equilibrium": Mark("no equilibrium", " ", ""),
        "not_moved": Mark("a mode not moved", "m", ""),
    },
    symbols={"epsilon": Symbol(r"$\varepsilon$", "ε")},
)
