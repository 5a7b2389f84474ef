"""Presentation of systems that are periodic in time."""

from dataclasses import replace
from pathlib import Path

from sweeps.figure import colors
from sweeps.schema.datasets import Dataset
from sweeps.systems.periodic.presentation.sentences import SENTENCES
from sweeps.systems.presentation import Drawings, Page, Presentation, moving
from sweeps.systems.presentation.appearance import Appearance, Compared, Mark, Symbol

MARKS = {
    "asymptotically_stable": Mark("stable, decays", "-", colors.SERIES_COLORS[2]),
    "period_doubling": Mark("unstable, period doubles", "2", colors.SERIES_COLORS[4]),
    "flutter": Mark("flutter", "~", colors.SERIES_COLORS[3]),
    "perturbation_too_large": Mark("perturbation too large", "n", ""),
    "no_periodic_motion": Mark("no periodic motion", "o", ""),
    "not_found": Mark("not found", "x", ""),
}
COMPARED = (Compared(("trace",), "trace"), Compared(("growth_rate",), "growth rate"))
APPEARANCE = Appearance(marks=MARKS, symbols={"epsilon": Symbol(r"$\varepsilon$", "ε")})


class PeriodicPresentation(Presentation):
    """Figures of the regimes."""

    appearance = APPEARANCE
    minimum_dims = ("epsilon",)
    plane_variable = ("regime", ())
    sentences = SENTENCES
    compared = COMPARED
    base_page = Page(
        (*moving.FILES, Path(__file__).parent / "page" / "part.js"),
        "Which periodic motions are stable, and how fast does a perturbation grow?",
    )

    def page(self, ds: Dataset) -> Page:
        """Return the page with the perturbed and the unperturbed motion."""
        facts = moving.page_facts(ds, self.system, "start")
        return replace(self.base_page, facts=facts) if facts["equations"] else Page(question=self.base_page.question)

    def figures(self, ds: Dataset) -> Drawings:
        """Return the regimes over two parameters, for each base motion, with the exact boundary."""
        from sweeps.systems.periodic.presentation import figure_tongues

        curves = {"mathieu": figure_tongues.mathieu_curves, "kapitza_pendulum": figure_tongues.kapitza_law}.get(
            self.system.name
        )
        tongues = {}
        for name in ds["equilibrium"].values.tolist():
            words = "" if ds.sizes["equilibrium"] == 1 else f"about: {name.replace('_', ' ')}"
            arguments = {"equilibrium": name}, words, APPEARANCE, curves
            tongues[f"tongues_{name}"] = self.drawing("figure_tongues.draw", ds, *arguments)
        return tongues | self.agreement_figure(ds)


PRESENTATION = PeriodicPresentation
