"""Presentation of pumped bodies."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.reading.definitions import definition_of
from sweeps.systems.bodies.presentation import SYMBOLS, on_triangle
from sweeps.systems.periodic.presentation import COMPARED, MARKS
from sweeps.systems.presentation import Page, Presentation
from sweeps.systems.presentation.look import Look, Symbol
from sweeps.systems.rigid_body.presentation.look import is_of_shapes

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from matplotlib.figure import Figure

LOOK = Look(
    marks=MARKS,
    symbols=SYMBOLS
    | {
        **{f"depth{i}": Symbol(f"$d_{i}$", f"d{s}") for i, s in zip("123", "₁₂₃", strict=True)},
        "frequency": Symbol(r"$\nu$", "ν"),
    },
)


class PumpedBodyPresentation(Presentation):
    """Figures of the regimes, and a page with the body turning."""

    look = LOOK
    compared = COMPARED
    part = on_triangle(
        "Does a spin stay stable while the moments of inertia change?", Path(__file__).parent / "page" / "part.js"
    )

    def page(self, ds: "xr.Dataset") -> Page:
        """Return the page, which knows whether the inverses of the moments are modulated."""
        page = super().page(ds)
        return replace(page, facts={**page.facts, "inverse": _is_inverse(ds)})

    def figures(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return the regimes over the inertia triangle, or over two parameters for each axis, and the breakdown."""
        from sweeps.systems.periodic.presentation import figure_breakdown, figure_tongues
        from sweeps.systems.pumped_body.presentation import figure_shapes

        if is_of_shapes(ds):
            return {"triangle": partial(figure_shapes.draw, ds, LOOK)}
        if ds.sizes["epsilon"] >= figure_breakdown.LEAST_SIZES:
            return {"breakdown": partial(figure_breakdown.draw, ds, LOOK)}

        def about(axis: int):
            title = f"Spin about axis {axis} with moments that change periodically; colours as measured"
            curves = lambda one, x, y: figure_shapes.mathieu(one, axis, y) if x == "frequency" else None  # noqa: E731
            return partial(figure_tongues.draw, ds, {"axis": axis}, title, LOOK, curves if _is_inverse(ds) else None)

        tongues = {f"tongues_axis_{axis}": about(axis) for axis in ds["axis"].values.tolist()}
        return tongues | self.against_theory(ds)

    def animations(self, ds: "xr.Dataset") -> "dict[str, Callable[[], Iterator[np.ndarray]]]":
        """Return the animation of an intermediate axis that is held, beside the body that is not shaken."""
        from sweeps.systems.pumped_body.presentation import figure_held

        return {"held": partial(figure_held.frames, ds, _is_inverse(ds))}


def _is_inverse(ds: "xr.Dataset") -> bool:
    return definition_of(ds.attrs).get("modulation") == "inverse"


PRESENTATION = PumpedBodyPresentation
