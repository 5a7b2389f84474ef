"""The part of a page that shows a free rigid body turning: body, polhode, herpolhode and ω(t), from the closed form.

For the pages of systems whose motion it is. Their own script says, in `part.start`, how each point begins.
"""

from pathlib import Path

from sweeps.systems.bodies import solid
from sweeps.systems.bodies.variables import VERDICTS
from sweeps.systems.presentation import DRAWING

_HERE = Path(__file__).parent
_ARITHMETIC = ("elliptic.js", "rotation.js", "attitude.js")
_BEFORE = ("first.html", "motion.html", "motion.css", *_ARITHMETIC, "shaken.js")  # than the script for drawing
_AFTER = ("solid.js", "polhode.js", "herpolhode.js", "motion.js")
FILES = (*(_HERE / name for name in _BEFORE), DRAWING, *(_HERE / name for name in _AFTER))
FACTS = {  # what the scripts are told
    "solids": solid.for_scripts(),
    "verdicts": {regime: verdict._asdict() for regime, verdict in VERDICTS.items()},
}
