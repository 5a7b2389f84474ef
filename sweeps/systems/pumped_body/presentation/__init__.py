"""Presentation of pumped bodies."""

from dataclasses import replace
from functools import partial
from pathlib import Path

from sweeps.reading.definitions import definition_of
from sweeps.schema.datasets import Dataset
from sweeps.systems.bodies.presentation import SYMBOLS, on_triangle
from sweeps.systems.periodic.presentation import COMPARED, MARKS
from sweeps.systems.presentation import Animations, Drawings, Page, Presentation
from sweeps.systems.presentation.appearance import Appearance, Symbol
from sweeps.systems.rigid_body.presentation.appearance import is_of_shapes

APPEARANCE = Appearance(
    marks=MARKS,
    symbols=SYMBOLS
    | {
        **{f"depth{i}": Symbol(f"$d_{i}$", f"d{s}") for i, s in zip("123", "₁₂₃", strict=True)},
        "frequency": Symbol(r"$\nu$", "ν"),
    },
)


class PumpedBodyPresentation(Presentation):
    """Figures of the regimes, and a page with the rotating body."""

    appearance = APPEARANCE
    compared = COMPARED
    base_page = on_triangle(
        "Does a spin stay stable while the moments of inertia change?", Path(__file__).parent / "page" / "part.js"
    )

    def page(self, ds: Dataset) -> Page:
        """Return the page, with the information whether the inverses of the moments are modulated."""
        page = super().page(ds)
        return replace(page, facts={**page.facts, "inverse": _is_inverse(ds)})

    def figures(self, ds: Dataset) -> Drawings:
        """Return the regimes over the inertia triangle, or over two parameters for each axis."""
        from sweeps.systems.periodic.presentation import figure_tongues
        from sweeps.systems.pumped_body.presentation import figure_shapes

        if is_of_shapes(ds):
            return {"triangle": partial(figure_shapes.draw, ds, APPEARANCE)}
        tongues = {}
        for axis in ds["axis"].values.tolist():
            title = f"Spin about axis {axis} with moments that change periodically; colours as measured"
            curves = partial(figure_shapes.mathieu, axis) if _is_inverse(ds) else None
            tongues[f"tongues_axis_{axis}"] = partial(
                figure_tongues.draw, ds, {"axis": axis}, title, APPEARANCE, curves
            )
        return tongues | self.agreement_figure(ds)

    def animations(self, ds: Dataset) -> Animations:
        """Return the animation of a stabilised intermediate axis, next to the body that is not shaken."""
        return {"held": self.drawing("figure_kapitza_racket.frames", ds, _is_inverse(ds))}


def _is_inverse(ds: Dataset) -> bool:
    return definition_of(ds.attrs).get("modulation") == "inverse"


PRESENTATION = PumpedBodyPresentation
