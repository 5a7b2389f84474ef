"""How the regimes and parameters of pumped bodies look."""

from sweeps.figure import colors
from sweeps.systems.bodies.presentation.look import SYMBOLS
from sweeps.systems.presentation.look import Look, Mark, Symbol

LOOK = Look(
    marks={
        "asymptotically_stable": Mark("stable, decays", "-", colors.SERIES_COLORS[2]),
        "period_doubling": Mark("unstable, sign changes each period", "2", colors.SERIES_COLORS[4]),
        "flutter": Mark("flutter", "~", colors.SERIES_COLORS[3]),
        "perturbation_too_large": Mark("perturbation too large", "n", ""),
    },
    symbols=SYMBOLS
    | {
        **{f"depth{i}": Symbol(f"$d_{i}$", f"d{s}") for i, s in zip("123", "₁₂₃", strict=True)},
        "frequency": Symbol(r"$\nu$", "ν"),
    },
)
