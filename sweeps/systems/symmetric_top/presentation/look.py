"""How the symmetric top's flags and parameters look."""

from sweeps.figure import colors
from sweeps.systems.presentation.look import Look, Mark, Symbol

LOOK = Look(
    marks={
        "with_spin": Mark("with spin", "+", colors.STABLE),
        "against_spin": Mark("against spin", "-", colors.UNSTABLE),
        "none": Mark("none", "0", colors.GREY),
        "sphere": Mark("sphere", "o", colors.LIGHT_GREY),
    },
    symbols={"omega3": Symbol(r"$\omega_3$", "ω₃")},
)
