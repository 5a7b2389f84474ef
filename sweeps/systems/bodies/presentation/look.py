"""How the parameters and modes that systems of bodies share look."""

from sweeps.figure import colors
from sweeps.systems.presentation.look import Mark, Symbol

MODES = {"sam": Mark("short-axis mode", "+", colors.STABLE), "lam": Mark("long-axis mode", "-", colors.LIGHT_BLUE)}

SYMBOLS = {
    "I1": Symbol("$I_1$", "I₁"),
    "I2": Symbol("$I_2$", "I₂"),
    "I3": Symbol("$I_3$", "I₃"),
    "omega0": Symbol(r"$\omega_0$", "ω₀"),
    "epsilon": Symbol(r"$\varepsilon$", "ε"),
    "phase": Symbol(r"$\varphi$", "φ"),
}
