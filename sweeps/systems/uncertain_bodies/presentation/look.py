"""Words, characters and colours of the stability of uncertain bodies."""

from sweeps.figure import colors
from sweeps.systems.presentation.look import Look, Mark
from sweeps.systems.rigid_body.presentation.look import LOOK as OF_RIGID_BODIES

LOOK = Look(
    marks={
        **OF_RIGID_BODIES.marks,
        "uncertain": Mark("uncertain", "?", colors.GREY),
        "undecided": Mark("many draws undecided", "u", ""),
    },
    symbols=OF_RIGID_BODIES.symbols,
)
