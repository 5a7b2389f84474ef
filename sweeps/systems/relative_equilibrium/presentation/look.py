"""Words, characters, colours and symbols of relative equilibria."""

from sweeps.figure import colors
from sweeps.systems.presentation.look import Look, Mark, Symbol

LOOK = Look(
    marks={
        "asymptotically_stable": Mark("stable, decays", "-", colors.SERIES_COLORS[2]),
        "flutter": Mark("flutter", "~", colors.SERIES_COLORS[3]),
        "no_equilibrium": Mark("no equilibrium", " ", ""),
        "equilibrium_undecided": Mark("equilibrium undecided", "?", ""),
        "not_excited": Mark("a mode not excited", "m", ""),
    },
    symbols={"epsilon": Symbol(r"$\varepsilon$", "ε")},
)
