"""Figures, page, words and colours of damped tops."""

from pathlib import Path

from sweeps.figure import colors
from sweeps.systems.presentation import Page, Presentation
from sweeps.systems.presentation.appearance import Appearance, Mark, Symbol


class DampedTopPresentation(Presentation):
    """The decay over the time constant; a page with the drag."""

    appearance = Appearance(
        marks={"slows": Mark("slows down", "v", colors.UNSTABLE), "lasts": Mark("lasts", "^", colors.STABLE)},
        symbols={"spin": Symbol(r"$\omega$", "ω"), "tau": Symbol(r"$\tau$", "τ")},
    )
    base_page = Page((Path(__file__).parent / "page" / "part.js",), "When does it stop?", facts={"drag": "viscous"})

    def figures(self, ds):
        from sweeps.figure import canvas

        def draw():
            figure = canvas.make_figure(4.0, 3.0, "Damped top", ds.attrs.get("title", ""))
            figure.subplots().plot(ds["tau"].values, ds["decay"].isel(spin=0).values)
            return figure

        return {"decay": draw}


PRESENTATION = DampedTopPresentation
