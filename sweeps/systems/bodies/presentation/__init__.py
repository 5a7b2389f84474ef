"""Common parts of the presentations of systems of bodies."""

from pathlib import Path

from sweeps.figure import colors
from sweeps.systems.bodies.presentation import turning
from sweeps.systems.presentation import Page
from sweeps.systems.presentation.appearance import Mark, Symbol

MODES = {"sam": Mark("short-axis mode", "+", colors.STABLE), "lam": Mark("long-axis mode", "-", colors.LIGHT_BLUE)}

SYMBOLS = {
    "I1": Symbol("$I_1$", "I₁"),
    "I2": Symbol("$I_2$", "I₂"),
    "I3": Symbol("$I_3$", "I₃"),
    "omega0": Symbol(r"$\omega_0$", "ω₀"),
    "epsilon": Symbol(r"$\varepsilon$", "ε"),
    "phase": Symbol(r"$\varphi$", "φ"),
}

TRIANGLE = Path(__file__).parent / "triangle.js"
_NEEDED = frozenset({"I1", "I2", "I3", "omega0"})


def on_triangle(question: str, script: Path) -> Page:
    """Return a page with a question, the inertia triangle, the rotating body and a script of the system."""
    files = (*turning.FILES, TRIANGLE, script)
    return Page(files, question, "Space: play or pause.", facts=turning.FACTS, needs=_NEEDED)
