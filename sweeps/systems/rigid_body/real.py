"""Real bodies that pictures name, with their moments as the definitions that ship have them."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

from sweeps.reading.definitions import file_text, plain, read_text

DEFINITIONS = Path(__file__).parents[2] / "definitions"
# Body in the definitions that ship → its name here, and where that stands: offset in points, alignment.
NAMED = {
    "bodies.yaml": {
        "Earth": ("Earth, Moon, Mars", (0, -15), "right"),
        "Moon": ("", (0, 0), "left"),
        "Mars": ("", (0, 0), "left"),
        "Tennis racket (Wilson T-2000)": ("tennis racket", (6, -3), "left"),
        "Telephone as a uniform box": ("telephone", (6, -3), "left"),
        "Thin plate": ("thin plate", (-6, -9), "right"),
        "Water molecule": ("water molecule", (-7, -8), "right"),
    },
    "tumblers.yaml": {
        "(5247) Krylov": ("asteroid Krylov", (6, -3), "left"),
        "2008 TC3 (illustration)": ("asteroid 2008 TC₃", (7, -9), "left"),
        "1I/'Oumuamua as an ellipsoid 6 to 1 to 1 (illustration)": ("'Oumuamua", (3, 6), "left"),
    },
}


@cache
def _listed(file: str) -> tuple[dict, ...]:
    return tuple(plain(read_text(file_text(DEFINITIONS / file)))["bodies"])


def real_bodies(*files: str) -> Iterator[tuple[str, tuple[float, float, float], tuple, str]]:
    """Yield name, moments in units of the third, offset and alignment of real bodies, of some or all definitions."""
    for file, named in NAMED.items():
        if files and file not in files:
            continue
        for body in _listed(file):
            if body["name"] in named:
                given = body.get("ratios", body)
                moments = [float(given[name]) for name in ("I1", "I2", "I3")]
                name, offset, side = named[body["name"]]
                yield name, tuple(moment / moments[2] for moment in moments), offset, side
