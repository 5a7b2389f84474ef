"""Which bodies two observed periods allow, and at which energy."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Polygon

from sweeps.figure import colors, style
from sweeps.systems.observed_periods.variables import EXCLUDED, WORDS

SHAPE = ("I1_over_I3", "thickness")


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw the energy above the least that L allows over the inertia triangle, in each mode; excluded bodies hatched.

    None of a map that is no grid of shapes. Along other dimensions the first value is drawn.
    """
    if min(ds.sizes.get(name, 1) for name in SHAPE) < 2:
        return None
    part = ds.isel({dim: 0 for dim in ds.dims if dim not in SHAPE})
    rows, columns, size = style.arranged(2, (4.2, 3.8))
    figure = style.canvas(*size, "Energy of a tumbling body from its two periods", ds.attrs.get("title", ""), ax=ax)
    axes = figure.subplots(rows, columns, sharex=True, sharey=True)
    ends = [np.clip(style.edges(part[name].values), 0.0, 1.0) for name in SHAPE]
    x, t = np.meshgrid(*ends, indexing="ij")
    points = np.meshgrid(*(part[name].values for name in SHAPE), indexing="ij")
    at = points[0], 1 - points[0] * (1 - points[1])
    for ax, mode in zip(axes, WORDS, strict=True):
        with np.errstate(divide="ignore"):
            excess = np.log10(part[f"energy_{mode}"].transpose(*SHAPE).values - 1.0)
        excluded = 1.0 * (part[f"exclusion_{mode}"].transpose(*SHAPE).values > EXCLUDED)
        mesh = ax.pcolormesh(x, 1 - x * (1 - t), excess, cmap="cividis", vmin=-3, vmax=1, rasterized=True, gid="energy")
        none = ax.contourf(*at, excluded, [0.5, 1.5], colors="none", hatches=["////"])
        none.set(edgecolor=colors.QUIET, lw=0.0, gid="excluded")
        ax.add_patch(Polygon([[0, 1], [1, 0], [1, 1]], fill=False, edgecolor=colors.INK, lw=1.0))
        ax.set(title=WORDS[mode], xlabel="$I_1/I_3$", xlim=(0, 1), ylim=(0, 1), aspect="equal")
    axes[0].set_ylabel("$I_2/I_3$")
    figure.colorbar(mesh, ax=axes, label=r"$\log_{10}(2TI_3/L^2 - 1)$", extend="both", shrink=0.8)
    handles = [
        style.hatched(f"excluded by more than {EXCLUDED:g} standard errors"),
        Patch(label="possible within the errors", facecolor="white", edgecolor=colors.QUIET),
    ]
    style.legend(figure, handles)
    return figure
