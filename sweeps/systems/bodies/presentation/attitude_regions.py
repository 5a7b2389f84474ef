"""Regions of stable attitude in the gravity gradient on a circular orbit, over k1 and k3, with real bodies."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from sweeps.figure import colors, marks
from sweeps.systems.bodies.satellites import inertia_ratios

MEETING = np.sqrt((7.0 - np.sqrt(45.0)) / 2.0)  # √-k1 = √-k3 at the end of DeBra and Delp's region: 1 - 7 u² + u⁴ = 0
BODIES = {  # moments about roll, pitch and yaw, in any unit
    "Moon": (0.99959696, 1.0, 0.99936923),  # Williams et al., J. Geophys. Res. Planets 119 (2014) 1546
    "6U CubeSat on end": (0.0629701, 0.0835760, 0.0306058),  # uniform box, as in the sweep `cubesats`
    "Space Station (1989 design)": (50.28, 10.80, 58.57),  # Wie et al., J. Guidance 12 (1989) 714
}


def outlines() -> dict[str, np.ndarray]:
    """Return name → corners (k1, k3) of Lagrange's region and of DeBra and Delp's, shape (n, 2).

    Pitch is stable if k1 > k3; roll and yaw if k1 k3 > 0 and 1 + 3 k1 + k1 k3 > 4 √(k1 k3). Source: Hughes, Spacecraft
    Attitude Dynamics, section 9.2.
    """
    root3 = np.linspace(MEETING, 1.0, 100)  # √-k3
    root1 = (2.0 * root3 - np.sqrt(3.0 * root3**2 + 3.0)) / (root3**2 - 3.0)  # √-k1 on the curve
    curve = np.column_stack([-(root1**2), -(root3**2)])
    return {
        "Lagrange": np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 0.0)]),
        "DeBra–Delp": np.concatenate([[(0.0, 0.0)], curve, [(0.0, -1.0), (0.0, 0.0)]]),
    }


def draw(panel: Axes, abscissa: str, is_damped: bool) -> None:
    """Draw outlines and names of both regions, and real bodies by name.

    Args:
        panel: the panel.
        abscissa: parameter of the abscissa, k1 or k3.
        is_damped: whether DeBra and Delp's region is that of the same satellites without dissipation.
    """
    order, limits = 1 if abscissa == "k1" else -1, (panel.get_xlim(), panel.get_ylim())
    text: dict[str, Any] = {"fontsize": 8.5, "path_effects": marks.halo(2.4), "zorder": 6}
    for name, corners in outlines().items():
        is_lost = is_damped and name != "Lagrange"
        style: dict[str, Any] = {"lw": 1.3, "ls": "--" if is_lost else "-", "gid": "theory", "color": colors.INK}
        panel.plot(*corners[:, ::order].T, label="without dissipation" if is_lost else "boundary by theory", **style)
        middle = ((0.75, 0.3) if name == "Lagrange" else (0.07, -0.6))[::order]
        panel.text(middle[0], middle[1], name + ", lost" * is_lost, fontweight="bold", ha="center", va="center", **text)
    for name, moments in BODIES.items():
        ratios, offset = inertia_ratios(*moments)[::order], (6, -11) if name == "Moon" else (-2, 7)
        panel.plot(*ratios, "o", ms=5.5, color=colors.INK, mec=colors.PAPER, mew=1.0, zorder=6, gid="body")
        marks.annotate(panel, name, ratios, offset, ha="left" if ratios[0] < 0.3 else "right", **text)
    panel.set(xlim=limits[0], ylim=limits[1])
