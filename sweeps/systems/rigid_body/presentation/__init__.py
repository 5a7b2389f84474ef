"""Presentation of free rigid bodies."""

import numpy as np

from sweeps.schema.datasets import Dataset
from sweeps.systems.presentation import Animations, Drawings, Opening, Page, Presentation
from sweeps.systems.presentation.appearance import Compared
from sweeps.systems.rigid_body.presentation.appearance import APPEARANCE, SHAPE, cut_at, is_grid, is_of_shapes

MIN_PERTURBATIONS = 6  # sizes of the perturbation that the fit of a power law needs


def sentence(dataset: Dataset) -> str:
    """Return the wobble of a rigid Earth, or how fast a racket's wobble grows; "" of a map without both."""
    from sweeps.systems.rigid_body.presentation.figure_flip import racket_at

    if "body" in dataset.dims:
        earth = dataset.sel(body="Earth", axis=3).isel(cut_at(dataset), missing_dims="ignore")
        days = 2.0 * np.pi / earth["frequency"].item() / 86400.0
        return f"A rigid Earth would wobble in {days:.0f} days; the Earth takes 433"
    if (place := racket_at(dataset)) is None:
        return ""
    point = dataset[["omega_squared"]].isel(place).squeeze()
    seconds = np.log(10.0) / np.sqrt(-point["omega_squared"].item())
    return f"At {point['omega0'].item():g} rad/s a racket's wobble about axis 2 grows tenfold in {seconds:.3f} s"


SENTENCES = {"rigid_body": sentence}


class RigidBodyPresentation(Presentation):
    """Figures, animation and page of free rigid bodies."""

    appearance = APPEARANCE
    sentences = SENTENCES
    minimum_dims = ("epsilon",)
    compared = (
        Compared(("frequency",), "oscillates in theory", "omega0"),
        Compared(("growth_rate",), "grows in theory", "omega0"),
        Compared(("omega_squared",), "Ω²", is_spare=True),
    )

    def opening(self, ds: Dataset) -> Opening:
        """Return the plane of the stability figures, or for bodies the least ε."""
        if not is_grid(ds):
            return super().opening(ds)
        from sweeps.systems.rigid_body.presentation.figure_flip import racket_at
        from sweeps.systems.rigid_body.presentation.figure_stability import plane_and_cuts

        plane, at = (SHAPE, super().opening(ds).at) if is_of_shapes(ds) else plane_and_cuts(ds)
        return Opening(plane, {**at, **{dim: ds[dim].values[i].item() for dim, i in (racket_at(ds) or {}).items()}})

    def page(self, ds: Dataset) -> Page:
        """Return the table of bodies, the rotating body, and the limit of linear theory."""
        from sweeps.systems.rigid_body.presentation.page import page

        return page(ds)

    def figures(self, ds: Dataset) -> Drawings:
        """Return the stability over moments, over the triangle or for bodies, agreement, breakdown and polhodes."""
        drawings, has_shapes = {}, is_of_shapes(ds)
        if has_shapes:
            drawings["triangle"] = self.drawing("figure_triangle.draw", ds)
        if "body" in ds.dims:
            drawings["bodies"] = self.drawing("figure_bodies.draw", ds)
        else:
            path = "figure_triangle.draw_axis" if has_shapes else "figure_stability.draw"
            drawings |= {f"stability_axis_{axis}": self.drawing(path, ds, axis) for axis in ds["axis"].values.tolist()}
        drawings |= self.agreement_figure(ds)
        if ds.sizes.get("epsilon", 0) >= MIN_PERTURBATIONS:
            drawings["breakdown"] = self.drawing("figure_breakdown.draw", ds)
        return drawings | {"polhodes": self.drawing("figure_polhodes.draw", ds)}

    def needs_compiler(self, ds: Dataset) -> bool:
        """Return False for a grid without the figure of the breakdown."""
        return not is_grid(ds) or ds.sizes.get("epsilon", 0) >= MIN_PERTURBATIONS

    def figures_of_points(self, ds: Dataset) -> Drawings:
        """Return the inertia triangle, the points over two coordinates, and the agreement with theory."""
        drawings = {"triangle": self.drawing("figure_triangle.draw", ds), **super().figures_of_points(ds)}
        return drawings | self.agreement_figure(ds)

    def animations(self, ds: Dataset) -> Animations:
        """Return the animation of one flip of the most unstable possible body."""
        return {"flip": self.drawing("figure_flip.frames", ds)}


PRESENTATION = RigidBodyPresentation
