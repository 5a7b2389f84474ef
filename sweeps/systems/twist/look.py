"""How the flags and parameters of throws look."""

from sweeps import colors
from sweeps.systems.look import Look, Mark, Symbol

LOOK = Look(
    marks={
        "reversed": Mark("reversed", "#", colors.UNSTABLE),
        "same_side": Mark("same side", "+", colors.STABLE),
    },
    symbols={
        "I1": Symbol("$I_1$", "I₁"),
        "I2": Symbol("$I_2$", "I₂"),
        "I3": Symbol("$I_3$", "I₃"),
        "chi": Symbol(r"$\chi$", "χ"),
        "theta": Symbol(r"$\theta$", "θ"),
        "omega0": Symbol(r"$\omega_0$", "ω₀"),
    },
)
