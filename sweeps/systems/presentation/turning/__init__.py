"""The part of a page that shows a free rigid body turning: body, polhode, herpolhode and ω(t), from the closed form.

For the pages of systems whose motion it is. Their own script says, in `part.start`, how each point begins.
"""

from pathlib import Path

from sweeps.systems.bodies import solid
from sweeps.systems.rigid_body.variables import VERDICTS

_HERE = Path(__file__).parent
DRAWING = _HERE / "drawing.js"
_ARITHMETIC = ("elliptic.js", "rotation.js", "attitude.js")
_SCRIPTS = (*_ARITHMETIC, "shaken.js", "drawing.js", "solid.js", "polhode.js", "herpolhode.js", "motion.js")
FILES = tuple(_HERE / name for name in ("first.html", "motion.html", "motion.css", *_SCRIPTS))
FACTS = {  # what the scripts are told
    "solids": solid.for_scripts(),
    "verdicts": {regime: verdict._asdict() for regime, verdict in VERDICTS.items()},
}
