"""Which bodies two observed periods allow, and at which energy."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Polygon

from sweeps import colors, style

WORDS = {"sam": "short-axis mode", "lam": "long-axis mode"}


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Energy over the least that L allows, over both ratios of moments, in each mode; excluded bodies hatched."""
    figure = style.canvas(
        9.4, 5.0, "Energy of a tumbler from its two periods", ds.attrs.get("title", ""), footer=0.36, ax=ax
    )
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    x, y = ds["I1_over_I3"].values, ds["I2_over_I3"].values
    excess = np.log10(ds["energy"].transpose("mode", "I2_over_I3", "I1_over_I3").values - 1.0)
    body = (y[:, None] >= x[None, :]) & (x[None, :] + y[:, None] >= 1.0)
    for ax, mode, values in zip(axes, ds["mode"].values.tolist(), excess, strict=True):
        none = np.where(body & ~np.isfinite(values), 1.0, np.nan)
        shape = Polygon([[0.5, 0.5], [0.0, 1.0], [1.0, 1.0]], transform=ax.transData)
        hatched = ax.contourf(x, y, np.nan_to_num(none), [0.5, 1.5], colors="none", hatches=["////"])
        hatched.set(edgecolor=colors.QUIET, clip_path=shape)
        mesh = ax.pcolormesh(style.edges(x), style.edges(y), values, cmap="viridis", vmin=-3, vmax=1, rasterized=True)
        ax.plot([0.5, 0.0, 1.0, 0.5], [0.5, 1.0, 1.0, 0.5], color=colors.INK, linewidth=1.0)
        mesh.set_clip_path(shape)  # a cell ends where bodies do
        share = np.isfinite(values)[body].mean()
        ax.set(
            title=f"{WORDS[mode]}: {100 * share:.0f} % of the bodies", xlabel="$I_1/I_3$", xlim=(0, 1), ylim=(0.5, 1)
        )
    axes[0].set_ylabel("$I_2/I_3$")
    figure.colorbar(mesh, ax=axes, label=r"$\log_{10}(2TI_3/L^2 - 1)$", extend="both")
    look = {"facecolor": "none", "edgecolor": colors.QUIET, "hatch": "////", "linewidth": 0}
    style.legend(figure, [Patch(label="no motion of this body has both periods", **look)])
    return figure
