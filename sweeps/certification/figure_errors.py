"""Figure of a judged trajectory: its errors over time, and the exact motion on the ellipsoid of its energy."""

import numpy as np
from matplotlib.figure import Figure

from sweeps.figure import canvas, colors
from sweeps.schema.datasets import Dataset

MIN_ERROR = 1e-17  # error that is drawn where there is none
MAX_POINTS = 5000


def draw(ds: Dataset) -> Figure:
    """Draw the Dataset of `sweeps.certify`."""
    facts = ds.attrs
    subtitle = f"{facts['verdict'].replace('_', '-')}:  {', '.join(facts['diagnosis'])}\n{facts['evidence'][0]}"
    figure = canvas.make_figure(10.0, 5.2, "Errors against the exact motion", subtitle)
    grid = figure.add_gridspec(1, 2, width_ratios=(3, 2))
    ax, curve = figure.add_subplot(grid[0]), figure.add_subplot(grid[1], projection="3d")
    rows = np.unique(np.linspace(0, ds.sizes["time"] - 1, MAX_POINTS).astype(int))
    lines = (("attitude_error", "attitude, rad", colors.STABLE), ("rates_error", "rates, relative", colors.UNSTABLE))
    for name, label, color in lines:
        if name in ds:
            ax.plot(ds["time"][rows], np.maximum(ds[name][rows], MIN_ERROR), color=color, label=label)
    ax.axhline(facts["tolerance"], color=colors.INK, ls="--", lw=1, label="tolerance")
    bound = facts.get("conditioning_rad", facts["conditioning_rates_relative"])
    ax.axhline(bound, color=colors.QUIET, ls=":", lw=1, label="conditioning")
    ax.set(yscale="log", xlabel="time (s)", ylabel="error")
    ax.legend(loc="lower right")
    omega = np.column_stack([ds[f"omega{axis}"][rows] for axis in (1, 2, 3)])
    semi_axes = np.sqrt(omega[0] ** 2 @ facts["moments"] / np.array(facts["moments"]))
    around, up = np.meshgrid(np.linspace(0, 2 * np.pi, 41), np.linspace(0, np.pi, 21))
    sphere = np.stack([np.cos(around) * np.sin(up), np.sin(around) * np.sin(up), np.cos(up)])
    curve.plot_wireframe(*sphere * semi_axes[:, None, None], color=colors.FAINT, lw=0.4)
    curve.plot(*omega.T, color=colors.STABLE)
    curve.plot(*omega[:1].T, "o", color=colors.INK, ms=4)
    curve.set(xlabel="$\\omega_1$ (rad/s)", ylabel="$\\omega_2$", zlabel="$\\omega_3$")
    curve.xaxis.labelpad = 8
    curve.set_box_aspect(semi_axes / semi_axes.max(), zoom=0.7)
    curve.locator_params(nbins=3)
    return figure
