"""Words, characters, colours and symbols of the rigid body's regimes and parameters."""

from collections.abc import Mapping

from sweeps.figure import colors
from sweeps.systems.bodies.presentation.look import SYMBOLS
from sweeps.systems.presentation.look import Look, Mark, Symbol
from sweeps.systems.rigid_body.variables import COORDINATES

LOOK = Look(
    marks={
        "stable_minor": Mark("stable, least inertia", "-", colors.LIGHT_BLUE),
        "stable_major": Mark("stable, greatest inertia", "+", colors.STABLE),
        "sphere": Mark("sphere", "o", colors.LIGHT_GREY),
    },
    symbols=SYMBOLS
    | {
        "I1_over_I3": Symbol("$I_1/I_3$", "I₁/I₃"),
        "thickness": Symbol("thickness $t$", "thickness t"),
    },
)


def axis_label(name: str) -> str:
    """Return the symbol of a parameter with its unit, for an axis of a plot."""
    from sweeps.figure import style

    return style.with_unit(LOOK.symbol(name), COORDINATES[name].units, "  ({})")


def settings(values: Mapping[str, float]) -> str:
    """Return fixed parameters in one line, with units: "I3 = 0.01748 kg m², ω0 = 10 rad s⁻¹"."""
    from sweeps.figure import style

    return ",  ".join(
        style.with_unit(f"{LOOK.symbol(name)} = {style.number(float(value))}", COORDINATES[name].units)
        for name, value in values.items()
    )
