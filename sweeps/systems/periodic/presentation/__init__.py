"""Presentation of systems that are periodic in time."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.systems.periodic.presentation.look import COMPARED, LOOK
from sweeps.systems.presentation import Page, Presentation, moving

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


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
                figure_tongues.draw,
                ds,
                {"equilibrium": name},
                f"perturbed motion: {name}",
                LOOK,
                curves,
            )
            for name in ds["equilibrium"].values.tolist()
        } | self.against_theory(ds)


PRESENTATION = PeriodicPresentation
