"""The part of the page for small oscillations: the motion itself, where equilibria are, where linear theory ends."""

from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.systems import rates
from sweeps.systems.oscillator.presentation.page.equations import facts
from sweeps.systems.presentation import Page, turning

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.mechanics import System

_HERE = Path(__file__).parent
_OWN = tuple(
    _HERE / name
    for name in ("first.html", "places.html", "mechanism.css", "followed.js", "mode.js", "mechanism.js", "places.js")
)
FILES = (turning.DRAWING, *_OWN, *rates.FILES, _HERE / "part.js")
QUESTION = "Where are the equilibria, are they stable, and how accurate are the rates?"


def page(ds: "xr.Dataset", system: "System | None") -> Page:
    """Return the system's part of the page of a map.

    Args:
        ds: the map.
        system: its description; None where it is a file's, which is not run for a map that names it.
    """
    return Page(FILES, QUESTION, facts={"equations": _equations(ds, system)})


def _equations(ds, system) -> dict | None:
    """The equations, where the map has all that stands in them."""
    if system is None:
        return None
    needed = {*system.parameters, *(f"{c.name}_equilibrium" for c in system.kept)}
    return facts(system) if needed <= set(ds.variables) else None
