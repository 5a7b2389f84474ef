"""How the regimes and parameters of pumped bodies look."""

from sweeps.systems.bodies.presentation import SYMBOLS
from sweeps.systems.periodic.presentation.look import MARKS
from sweeps.systems.presentation.look import Look, Symbol

LOOK = Look(
    marks=MARKS,
    symbols=SYMBOLS
    | {
        **{f"depth{i}": Symbol(f"$d_{i}$", f"d{s}") for i, s in zip("123", "₁₂₃", strict=True)},
        "frequency": Symbol(r"$\nu$", "ν"),
    },
)
