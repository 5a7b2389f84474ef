"""How the modes and parameters of tumbling bodies look."""

from sweeps.figure import colors
from sweeps.systems.bodies.presentation.look import MODES, SYMBOLS
from sweeps.systems.presentation.look import Look, Mark, Symbol

LOOK = Look(
    marks=MODES
    | {
        "separatrix": Mark("separatrix", "#", colors.UNSTABLE),
        "principal": Mark("principal spin", "o", colors.LIGHT_GREY),
        "impossible": Mark("energy out of range", "x", colors.GREY),
    },
    symbols=SYMBOLS
    | {
        "energy": Symbol("$2TI_3/L^2$", "2T I₃/L²"),
    },
)
