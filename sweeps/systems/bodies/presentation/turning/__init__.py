"""Section of a page with a rotating free body: body, polhode, herpolhode and ω(t), from the closed form.

The system's own script defines, in `part.start`, the initial state at each point.
"""

from pathlib import Path

from sweeps.systems.bodies import solid
from sweeps.systems.bodies.variables import VERDICTS
from sweeps.systems.presentation import DRAWING

_FOLDER = Path(__file__).parent
_ARITHMETIC = ("elliptic.js", "rotation.js", "attitude.js")
_BEFORE = ("first.html", "motion.html", "motion.css", *_ARITHMETIC, "shaken.js")  # files before the drawing script
_AFTER = ("solid.js", "polhode.js", "herpolhode.js", "motion.js")
FILES = (*(_FOLDER / name for name in _BEFORE), DRAWING, *(_FOLDER / name for name in _AFTER))
SOLID_FILES = (_FOLDER / "motion.css", DRAWING, _FOLDER / "solid.js")  # style and scripts that draw a body
FACTS = {  # values for the scripts
    "solids": solid.for_scripts(),
    "verdicts": {regime: verdict._asdict() for regime, verdict in VERDICTS.items()},
}
