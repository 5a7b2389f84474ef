"""Presentation of systems that are periodic in time."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.figure import colors
from sweeps.systems.presentation import Page, Presentation, moving
from sweeps.systems.presentation.look import Compared, Look, Mark, Symbol

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

MARKS = {
    "asymptotically_stable": Mark("stable, decays", "-", colors.SERIES_COLORS[2]),
    "period_doubling": Mark("unstable, sign changes each period", "2", colors.SERIES_COLORS[4]),
    "flutter": Mark("flutter", "~", colors.SERIES_COLORS[3]),
    "perturbation_too_large": Mark("perturbation too large", "n", ""),
    "no_periodic_motion": Mark("no periodic motion", "o", ""),
}
COMPARED = (Compared(("trace",), "trace"), Compared(("growth_rate",), "growth rate"))
LOOK = Look(marks=MARKS, symbols={"epsilon": Symbol(r"$\varepsilon$", "ε")})


class PeriodicPresentation(Presentation):
    """Figures of the regimes."""

    look = LOOK
    least = ("epsilon",)
    compared = COMPARED
    part = Page(
        (*moving.FILES, Path(__file__).parent / "page" / "part.js"),
        "Which periodic motions are stable, and how fast does a perturbation grow?",
    )

    def page(self, ds: "xr.Dataset") -> Page:
        """Return the perturbed motion beside the unperturbed one."""
        facts = moving.facts_of(ds, self.system, "start")
        return replace(self.part, facts=facts) if facts["equations"] else Page(question=self.part.question)

    def figures(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return the regimes over two parameters, for each base motion, with the exact boundary."""
        from sweeps.systems.periodic.presentation import figure_tongues

        curves = {"mathieu": figure_tongues.chart, "kapitza_pendulum": figure_tongues.averaged}.get(self.system.name)
        return {
            f"tongues_{name}": partial(
                figure_tongues.draw, ds, {"equilibrium": name}, f"perturbed motion: {name}", LOOK, curves
            )
            for name in ds["equilibrium"].values.tolist()
        } | self.against_theory(ds)


PRESENTATION = PeriodicPresentation
