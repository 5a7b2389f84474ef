"""The bodies drawn on the triangle of inertia, over the rate at which spins there are lost."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from kernels import linear
from sweeps.figure import colors, style
from sweeps.systems.uncertain_bodies.measuring import UNSTABLE

MOST_SHOWN = 4000  # draws of a panel
STEPS = 220


def draw(name: str, subtitle: str, axes: dict[int, tuple[dict, dict]]) -> Figure:
    """Draw possible bodies over I1/I3 and I2/I3 with linear growth rates and the draws, one panel per axis.

    Args:
        name: the body's.
        subtitle: a line of how it was drawn.
        axes: axis → its summary and its draws, from `sweeps.systems.uncertain_bodies.measuring.measured`.
    """
    figure = style.canvas(1.0 + 3.6 * len(axes), 4.6, f"{name} with inertia uncertainty", subtitle)
    panels = np.atleast_1d(figure.subplots(1, len(axes), sharex=True, sharey=True))
    for ax, (axis, (summary, draws)) in zip(panels, axes.items(), strict=True):
        x, y = draws["I1"] / draws["I3"], draws["I2"] / draws["I3"]
        most = max(1.15, 1.05 * float(np.quantile(x, 0.999)), 1.05 * float(np.quantile(y, 0.999)))
        mesh = _background(ax, axis, most)
        _cloud(ax, x, y, draws["regime"] == UNSTABLE)
        p, error = summary["probability_unstable"], summary["probability_unstable_error"]
        ax.set_title(f"spun about axis {axis}: unstable {100 * p:.2f} ± {100 * error:.2f} %")
        ax.set(xlabel="$I_1/I_3$", xlim=(0, most), ylim=(0, most), aspect="equal")
    panels[0].set_ylabel("$I_2/I_3$")
    figure.colorbar(mesh, ax=list(panels), label=r"growth rate, linear theory, $\sigma/\omega_0$", shrink=0.8)
    handles = [
        Patch(facecolor="none", edgecolor=colors.QUIET, hatch="////", linewidth=0, label="physically impossible"),
        Patch(facecolor=colors.UNSTABLE, label="sampled, unstable"),
        Patch(facecolor=colors.STABLE, label="sampled, not unstable"),
    ]
    style.legend(figure, handles)
    return figure


def _background(ax, axis: int, most: float):
    along = (np.arange(STEPS) + 0.5) * most / STEPS
    x, y = np.meshgrid(along, along)
    rate2 = linear.omega_squared(x, y, np.ones_like(x), 1.0, axis)
    possible = (x + y >= 1) & (np.abs(x - y) <= 1)
    rate = np.where(possible, np.sqrt(np.maximum(-rate2, 0.0)), np.nan)
    mesh = ax.pcolormesh(along, along, rate, cmap="Greys", vmin=0, vmax=1.2, rasterized=True)
    ax.contourf(x, y, np.where(possible, 1.0, -1.0), [-2, 0], colors="none", hatches=["////"])
    for line in ([1, 1], [0, most]), ([0, most], [1, 1]), ([0, most], [0, most]):
        ax.plot(*line, color=colors.QUIET, linewidth=0.6)
    return mesh


def _cloud(ax, x: np.ndarray, y: np.ndarray, unstable: np.ndarray) -> None:
    shown = np.linspace(0, x.size - 1, min(x.size, MOST_SHOWN)).astype(int)
    look = np.where(unstable[shown], colors.UNSTABLE, colors.STABLE)
    ax.scatter(x[shown], y[shown], s=2.5, c=look, linewidths=0, alpha=0.5, gid="cloud", rasterized=True)
