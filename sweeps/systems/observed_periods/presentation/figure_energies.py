"""Figure of observed periods: the possible bodies and how far they wobble, over the inertia triangle."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kernels.events import tumbling
from sweeps.figure import axis_scales, canvas, colors, marks, sheets
from sweeps.systems.bodies.presentation import triangle
from sweeps.systems.bodies.presentation.triangle import SHAPE
from sweeps.systems.observed_periods.system import MAX_EXCLUSION, WORDS
from sweeps.systems.presentation.sentences import head_texts
from sweeps.systems.rigid_body.presentation.figure_stability import real_bodies

HALF = {"xlim": (-0.02, 1.02), "ylim": (0.48, 1.02)}  # the half of the triangle with I1 ≤ I2; the other repeats it


def draw(dataset: xr.Dataset, target: Axes | None = None) -> Figure | None:
    """Draw the mean angle of the wobble that both periods need, in each mode; excluded bodies hatched.

    It is the angle between L and the axis that the polhode encircles. Return None unless the map is a grid of shapes.
    All further dimensions are cut at their first value.
    """
    if min(dataset.sizes.get(name, 1) for name in SHAPE) < 2:
        return None
    cut = {dim: 0 for dim in dataset.dims if dim not in SHAPE}
    texts = head_texts(dataset, "Tumbling bodies with both periods", "colours: how far the spin axis is from L")
    figure, axes = canvas.make_panels(2, (4.6, 3.2), *texts, target, sharex=True, sharey=True)
    ratios = triangle.places(dataset)
    is_half = ratios[0] <= ratios[1]
    for panel, mode in zip(axes, WORDS, strict=True):
        energy = triangle.values(dataset, f"energy_{mode}", cut)
        shapes = dict(zip(("I1", "I2", "I3"), (*map(np.ravel, ratios), np.ones(energy.size)), strict=True))
        tilt = np.degrees(tumbling.tilts(shapes | {"energy": energy.ravel()})["tilt_mean"]).reshape(energy.shape)
        is_excluded = 1.0 * (is_half & (triangle.values(dataset, f"exclusion_{mode}", cut) > MAX_EXCLUSION))
        corners = triangle.places(dataset, axis_scales.cell_edges)
        props = {"cmap": sheets.color_map("size"), "vmin": 0.0, "vmax": 90.0, "rasterized": True, "gid": "tilt"}
        mesh = panel.pcolormesh(*corners, np.where(is_half, tilt, np.nan), **props)
        hatched_area = panel.contourf(*ratios, is_excluded, [0.5, 1.5], colors="none", hatches=["////"])
        hatched_area.set(edgecolor=colors.QUIET, lw=0.0, gid="excluded")
        triangle.frame(panel, 2, False)
        for side in panel.lines:
            side.set_clip_on(True)
        panel.set(**HALF, title=WORDS[mode])
        for name, (low, middle, _), offset, side in real_bodies("tumblers.yaml"):
            panel.plot(low, middle, "o", ms=5, color=colors.PAPER, mec=colors.INK, zorder=6, gid="body")
            marks.annotate(panel, name, (low, middle), offset, ha=side, fontsize=8, path_effects=marks.halo(), zorder=7)
    figure.colorbar(mesh, ax=axes, label="mean angle of the wobble (degrees)", shrink=0.8)
    canvas.draw_legend(figure, [marks.hatched_patch(f"excluded by more than {MAX_EXCLUSION:g} standard errors")])
    return figure
