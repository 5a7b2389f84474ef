"""The inertia triangle in figures: the shapes of a grid over I1/I3 and I2/I3, with sides and labels."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from sweeps.figure import colors, marks
from sweeps.schema.datasets import Dataset, along
from sweeps.systems.bodies.variables import SHAPE_COORDINATES

SHAPE = tuple(SHAPE_COORDINATES)


def places(ds: Dataset, transform: Callable = np.asarray) -> tuple[np.ndarray, np.ndarray]:
    """Return I1/I3 and I2/I3 of the shapes of a grid, ascending; at corners of cells with `axis_scales.cell_edges`."""
    x, t = np.meshgrid(*(np.clip(transform(np.sort(ds[name].values)), 0.0, 1.0) for name in SHAPE), indexing="ij")
    return x, 1.0 - x * (1.0 - t)


def values(ds: Dataset, name: str, at: Mapping[str, int]) -> np.ndarray:
    """Return the variable `name` of `ds` in the order of `places`, with all further dimensions at the indices `at`."""
    column = along(ds[name].isel({dim: i for dim, i in at.items() if dim in ds[name].dims}), SHAPE)
    return column[np.ix_(*(np.argsort(ds[side].values, kind="stable") for side in SHAPE))]


def frame(ax: Axes, axis: int, is_large: bool) -> None:
    """Draw on `ax` the triangle's sides, the line I1 = I2 for spin `axis` 1 or 2, and, if `is_large`, labels."""
    ax.plot([0, 1, 1, 0], [1, 0, 1, 1], color=colors.INK, lw=1.2, clip_on=False, zorder=4)
    if axis != 3:
        ax.plot([0.5, 1], [0.5, 1], color=colors.INK, lw=1.4, zorder=3, gid="I1 = I2", path_effects=marks.halo(2.6))
    ax.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal", xlabel=r"$I_1 / I_3$", ylabel=r"$I_2 / I_3$")
    ax.spines[["top", "right"]].set_visible(False)
    ticks = [0, 0.25, 0.5, 0.75, 1] if is_large else [0, 0.5, 1]
    ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
    ax.set_yticks(ticks, [f"{t:g}" for t in ticks])
    if not is_large:
        return
    label_props: dict[str, Any] = {"color": colors.QUIET, "fontsize": 8.5, "ha": "center", "va": "center"}
    ax.text(0.70, 0.25, r"flat:  $I_1 + I_2 = I_3$", rotation=-45, rotation_mode="anchor", **label_props)
    ax.text(0.25, 0.30, "physically\nimpossible", **label_props)
    if axis != 3:
        marks.annotate(ax, "$I_1 = I_2$", (0.6, 0.6), (7, -7), va="center", zorder=5, path_effects=marks.halo(2.4))
    marks.annotate(ax, "sphere", (1, 1), (0, 6), **(label_props | {"ha": "right", "va": "bottom"}))
