"""Figure of the inertia triangle for modulated moments: measured regimes and the exact boundary; Mathieu's curves."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from scipy.interpolate import CubicSpline

from kernels.flow.codes import REGIMES
from sweeps.figure import axis_scales, canvas, colors, wording
from sweeps.systems.bodies.presentation import triangle
from sweeps.systems.periodic.presentation.figure_tongues import (
    EXACT,
    FULL_COLOR_GROWTH,
    THEORY,
    Curves,
    characteristic_values,
    side_ends,
)
from sweeps.systems.presentation import planes
from sweeps.systems.presentation.appearance import Appearance
from sweeps.systems.presentation.regimes import Regimes
from sweeps.systems.presentation.sentences import head_texts
from sweeps.systems.rigid_body.presentation.figure_triangle import fixed_at, values_about

NAMES = ("regime", "growth_per_period", "status", "triangle_margin", "trace_theory")


def draw(ds: xr.Dataset, appearance: Appearance, ax: Axes | None = None) -> Figure:
    """Draw on `ax` a panel for each axis of `ds`, a map over a grid of shapes, in the colours of `appearance`."""
    hidden_dims = ("epsilon", "phase", "multiplier")
    cut_values = {name: ds[name].values[i] for name, i in fixed_at(ds).items() if name not in hidden_dims}
    words = ", ".join(
        wording.format_coordinate(ds, name, value, appearance.symbols) for name, value in cut_values.items() if value
    )
    figure, axes = canvas.make_panels(ds.sizes["axis"], (4.2, 4.2), *head_texts(ds, words=words), ax)
    impossible = Patch(facecolor=colors.MISSING, label="physically impossible for a part of the period")
    regimes = Regimes(REGIMES, appearance, FULL_COLOR_GROWTH)
    for panel, axis in zip(axes, ds["axis"].values.tolist(), strict=True):
        regime, growth, status, margin, trace = (values_about(ds, name, axis) for name in NAMES)
        regimes.paint(panel, *triangle.places(ds, axis_scales.cell_edges), regime, growth, status)
        planes.boundary(panel, *triangle.places(ds), 2.0 - np.abs(trace), 0.0, THEORY, 0.8, halo=0.0)
        panel.contourf(*triangle.places(ds), margin, [-1.0, 0.0], colors=[colors.MISSING])
        triangle.frame(panel, axis, True)
        panel.set_title(f"spun about axis {axis}", loc="left", fontweight="bold", pad=18)
    regimes.explain(figure, axes, "growth per period", [impossible] * bool((ds["triangle_margin"] < 0.0).any()))
    return figure


def mathieu(axis: int, panel: xr.Dataset, x: str, depth: str) -> tuple[str, Curves] | None:
    """Return a label and (frequency, depth) along Mathieu's characteristic curves; None for another equation.

    With the inverse of one transverse moment I_j modulated, ``y'' + (a - 2 q cos 2 tau) y = 0`` in tau = nu t/2, where
    ``a = 4 L^2 c (1/I_j - 1/I_k)/nu^2``, ``q = 2 L^2 c d_j/(I_j nu^2)`` and ``c = 1/I_i - 1/I_k``.

    Args:
        axis: spin axis k.
        panel: the map of a panel.
        x: name along its x axis.
        depth: name along its y axis.
    """
    depth_names = {f"depth{i}" for i in (1, 2, 3) if panel[f"depth{i}"].values.any()}
    if x != "frequency" or depth_names != {depth} or depth == f"depth{axis}":
        return None
    j = int(depth[-1])
    (i,) = {1, 2, 3} - {axis, j}
    if any(panel[name].size > 1 for name in ("I1", "I2", "I3", "omega0")):
        return None
    Ii, Ij, Ik, spin = (float(panel[name]) for name in (f"I{i}", f"I{j}", f"I{axis}", "omega0"))
    scale, mean = 4.0 * (spin * Ik) ** 2 * (1.0 / Ii - 1.0 / Ik), 1.0 / Ij - 1.0 / Ik
    sparse_q = np.geomspace(1e-3, 1e3, 300)
    dense_q = np.geomspace(1e-3, 1e3, 20_000)
    low, high = side_ends(panel, depth)
    values, curves = CubicSpline(np.log(sparse_q), characteristic_values(sparse_q), axis=1)(np.log(dense_q)), []
    for q, a in ((q, a) for q in (dense_q, -dense_q) for a in values):
        with np.errstate(invalid="ignore", divide="ignore"):
            square = scale * mean / a
            frequency, depths = np.sqrt(square), 2.0 * q * square * Ij / scale
        in_panel = (depths >= low) & (depths <= high) & (square > 0.0)
        if in_panel.any():
            curves.append((frequency, np.where(in_panel, depths, np.nan)))
    return EXACT, curves
