"""How the modes and parameters of tumbling bodies look."""

from sweeps import colors
from sweeps.systems.look import Look, Mark, Symbol

LOOK = Look(
    marks={
        "sam": Mark("short-axis mode", "+", colors.STABLE),
        "lam": Mark("long-axis mode", "-", colors.LIGHT_BLUE),
        "separatrix": Mark("separatrix", "#", colors.UNSTABLE),
        "principal": Mark("principal spin", "o", colors.LIGHT_GREY),
        "impossible": Mark("energy out of range", "x", colors.GREY),
    },
    symbols={
        "I1": Symbol("$I_1$", "I₁"),
        "I2": Symbol("$I_2$", "I₂"),
        "I3": Symbol("$I_3$", "I₃"),
        "energy": Symbol("$2TI_3/L^2$", "2T I₃/L²"),
        "omega0": Symbol(r"$\omega_0$", "ω₀"),
    },
)
