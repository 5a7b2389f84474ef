"""How the flags and parameters of throws look."""

from sweeps.figure import colors
from sweeps.systems.bodies.presentation.look import SYMBOLS
from sweeps.systems.presentation.look import Look, Mark, Symbol

LOOK = Look(
    marks={
        "reversed": Mark("reversed", "#", colors.UNSTABLE),
        "same_side": Mark("same side", "+", colors.STABLE),
    },
    symbols=SYMBOLS
    | {
        "chi": Symbol(r"$\chi$", "χ"),
        "theta": Symbol(r"$\theta$", "θ"),
    },
)
