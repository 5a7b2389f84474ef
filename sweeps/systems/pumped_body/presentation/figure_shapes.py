"""The inertia triangle while the moments change: measured regimes under the exact boundary; and Mathieu's curves."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from scipy.interpolate import CubicSpline

from kernels.flow.codes import REGIMES
from sweeps.figure import axis_scales, canvas, colors, wording
from sweeps.systems.bodies.presentation import triangle
from sweeps.systems.periodic.presentation.figure_tongues import DEEPEST, EXACT, THEORY, Curves, characteristic, ends
from sweeps.systems.presentation import planes
from sweeps.systems.presentation.appearance import Appearance
from sweeps.systems.presentation.regimes import Regimes
from sweeps.systems.rigid_body.presentation.figure_triangle import fixed_at, values_about

NAMES = ("regime", "growth_per_period", "status", "triangle_margin", "trace_theory")


def draw(ds: xr.Dataset, appearance: Appearance, ax: Axes | None = None) -> Figure:
    """Draw a panel for each axis of a map over a grid of shapes."""
    aside = ("epsilon", "phase", "multiplier")
    fixed = {name: ds[name].values[i] for name, i in fixed_at(ds).items() if name not in aside}
    words = ", ".join(
        wording.format_coordinate(ds, name, value, appearance.symbols) for name, value in fixed.items() if value
    )
    figure, places = canvas.make_panels(ds.sizes["axis"], (4.2, 4.2), ds.attrs.get("title", ""), words, ax)
    regimes = Regimes(REGIMES, appearance, DEEPEST)
    for place, axis in zip(places, ds["axis"].values.tolist(), strict=True):
        regime, growth, status, margin, trace = (values_about(ds, name, axis) for name in NAMES)
        regimes.paint(place, *triangle.places(ds, axis_scales.cell_edges), regime, growth, status)
        planes.boundary(place, *triangle.places(ds), 2.0 - np.abs(trace), 0.0, THEORY, 0.8, halo=0.0)
        place.contourf(*triangle.places(ds), margin, [-1.0, 0.0], colors=[colors.MISSING])
        triangle.frame(place, axis, True)
        place.set_title(f"spun about axis {axis}", loc="left", fontweight="bold", pad=18)
    more = [Patch(facecolor=colors.MISSING, label="physically impossible for a part of the period")]
    regimes.explain(figure, places, "growth per period", more)
    return figure


def mathieu(axis: int, one: xr.Dataset, x: str, depth: str) -> tuple[str, Curves] | None:
    """Return a label and (frequency, depth) along Mathieu's characteristic curves; None where the equation is another.

    With the inverse of one transverse moment I_j modulated, ``y'' + (a - 2 q cos 2 tau) y = 0`` in tau = nu t/2, where
    ``a = 4 L^2 c (1/I_j - 1/I_k)/nu^2``, ``q = 2 L^2 c d_j/(I_j nu^2)`` and ``c = 1/I_i - 1/I_k``.
    """
    modulated = {f"depth{i}" for i in (1, 2, 3) if one[f"depth{i}"].values.any()}
    if x != "frequency" or modulated != {depth} or depth == f"depth{axis}":
        return None
    j = int(depth[-1])
    (i,) = {1, 2, 3} - {axis, j}
    if any(one[name].size > 1 for name in ("I1", "I2", "I3", "omega0")):
        return None
    Ii, Ij, Ik, spin = (float(one[name]) for name in (f"I{i}", f"I{j}", f"I{axis}", "omega0"))
    scale, mean = 4.0 * (spin * Ik) ** 2 * (1.0 / Ii - 1.0 / Ik), 1.0 / Ij - 1.0 / Ik
    few, many, (low, high) = np.geomspace(1e-3, 1e3, 300), np.geomspace(1e-3, 1e3, 20_000), ends(one, depth)
    values, curves = CubicSpline(np.log(few), characteristic(few), axis=1)(np.log(many)), []
    for q, a in ((q, a) for q in (many, -many) for a in values):
        with np.errstate(invalid="ignore", divide="ignore"):
            square = scale * mean / a
            frequency, at = np.sqrt(square), 2.0 * q * square * Ij / scale
        inside = (at >= low) & (at <= high) & (square > 0.0)
        if inside.any():
            curves.append((frequency, np.where(inside, at, np.nan)))
    return EXACT, curves
