"""Figure of observed periods: the possible bodies and their energies over the inertia triangle."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sweeps.figure import axis_scales, canvas, colors, marks, sheets
from sweeps.systems.bodies.presentation import triangle
from sweeps.systems.bodies.presentation.triangle import SHAPE
from sweeps.systems.observed_periods.system import MAX_EXCLUSION, WORDS


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw the energy above the least that L allows over the inertia triangle, in each mode; excluded bodies hatched.

    Return None unless the map is a grid of shapes. All further dimensions are cut at their first value.
    """
    if min(ds.sizes.get(name, 1) for name in SHAPE) < 2:
        return None
    cut = {dim: 0 for dim in ds.dims if dim not in SHAPE}
    title = "Energy of a tumbling body from its two periods"
    figure, axes = canvas.make_panels(2, (4.2, 3.8), title, ds.attrs.get("title", ""), ax, sharex=True, sharey=True)
    props: dict[str, Any] = {
        "cmap": sheets.color_map("size"),
        "vmin": -3,
        "vmax": 1,
        "rasterized": True,
        "gid": "energy",
    }
    for ax, mode in zip(axes, WORDS, strict=True):
        with np.errstate(divide="ignore"):
            excess = np.log10(triangle.values(ds, f"energy_{mode}", cut) - 1.0)
        is_excluded = 1.0 * (triangle.values(ds, f"exclusion_{mode}", cut) > MAX_EXCLUSION)
        mesh = ax.pcolormesh(*triangle.places(ds, axis_scales.cell_edges), excess, **props)
        hatched_area = ax.contourf(*triangle.places(ds), is_excluded, [0.5, 1.5], colors="none", hatches=["////"])
        hatched_area.set(edgecolor=colors.QUIET, lw=0.0, gid="excluded")
        triangle.frame(ax, 3, False)
        ax.set_title(WORDS[mode])
    figure.colorbar(mesh, ax=axes, label=r"$\log_{10}(2TI_3/L^2 - 1)$", extend="both", shrink=0.8)
    possible_entry = Patch(label="possible within the errors", facecolor=colors.PAPER, edgecolor=colors.QUIET)
    canvas.draw_legend(
        figure, [marks.hatched_patch(f"excluded by more than {MAX_EXCLUSION:g} standard errors"), possible_entry]
    )
    return figure
