"""How the flags and parameters of observed periods look."""

from sweeps import colors
from sweeps.systems.look import Look, Mark, Symbol

LOOK = Look(
    marks={
        "none": Mark("excluded in both modes", "x", colors.GREY),
        "sam": Mark("short-axis mode", "+", colors.STABLE),
        "lam": Mark("long-axis mode", "-", colors.LIGHT_BLUE),
        "both": Mark("either mode", "*", colors.UNSTABLE),
    },
    symbols={
        "I1": Symbol("$I_1$", "I₁"),
        "I2": Symbol("$I_2$", "I₂"),
        "I3": Symbol("$I_3$", "I₃"),
        "P_psi": Symbol(r"$P_\psi$", "P_ψ"),
        "P_phi": Symbol(r"$P_\phi$", "P_φ"),
        "sigma_psi": Symbol(r"$\sigma_\psi$", "σ_ψ"),
        "sigma_phi": Symbol(r"$\sigma_\phi$", "σ_φ"),
    },
)
