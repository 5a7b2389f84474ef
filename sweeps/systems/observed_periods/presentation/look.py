"""How the flags and parameters of observed periods look."""

from sweeps.figure import colors
from sweeps.systems.bodies.presentation.look import MODES, SYMBOLS
from sweeps.systems.presentation.look import Look, Mark, Symbol

LOOK = Look(
    marks=MODES
    | {
        "none": Mark("excluded in both modes", "x", colors.GREY),
        "both": Mark("either mode", "*", colors.UNSTABLE),
    },
    symbols=SYMBOLS
    | {
        "P_psi": Symbol(r"$P_\psi$", "P_ψ"),
        "P_phi": Symbol(r"$P_\phi$", "P_φ"),
        "sigma_psi": Symbol(r"$\sigma_\psi$", "σ_ψ"),
        "sigma_phi": Symbol(r"$\sigma_\phi$", "σ_φ"),
    },
)
