"""Frequencies of small oscillations about a circular orbit, over the orbital rate, for the exponents of potentials."""

from itertools import cycle

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweeps.figure import canvas, colors, marks, wording
from sweeps.systems import mode_curves
from sweeps.systems.presentation import planes
from sweeps.systems.presentation.appearance import Appearance

CELL = (7.0, 4.0)  # inches, width and height of the panel
CLOSED_ORBITS = {-1.0: "Kepler", 2.0: "Hooke"}  # exponents with which all bounded orbits close (Bertrand, 1873)
MODES = {"r": "radial oscillation, theory $\\sqrt{s + 2}$", "theta": "tilt of the orbit, theory 1"}


def draw(ds: xr.Dataset, system, ax: Axes | None = None) -> Figure:
    """Draw each mode's measured frequency over the orbital rate, mode by mode through their crossing, and theory's.

    Args:
        ds: a map of the system `central_potential` over the exponent.
        system: the system.
        ax: Axes to draw in; None for a new figure.
    """
    plane = ds.isel(planes.cut_indices(ds["omega_squared"], ("exponent",), ("equilibrium", "mode"))).load()
    subset = plane.squeeze("equilibrium")
    orbital_rate = subset["angular_momentum"] / (subset["mass"] * subset["r_equilibrium"] ** 2)
    ratios = {kind: np.sqrt(subset[f"omega_squared{kind}"]) / orbital_rate for kind in ("", "_theory")}
    measured, theory = (ratio.transpose("exponent", "mode").values for ratio in ratios.values())
    exponents = subset["exponent"].values
    fixed = [name for name in (*system.description.parameters, "equilibrium") if name != "exponent"]
    arguments = {name: np.full(exponents.size, subset[name].item()) for name in fixed} | {"exponent": exponents}
    curves = mode_curves.follow_modes(system, arguments)
    shares = np.nan_to_num(system.mode_shapes(arguments)[0].participation)
    subtitle = planes.subtitle(ds, plane, ds["omega_squared"], Appearance())
    figure, (panel,) = canvas.make_panels(1, CELL, ds.attrs.get("title", ""), subtitle, ax)
    places = [place.name for place in system.mechanism.equations.places]
    for number, color in zip(range(1, curves.max() + 1), cycle(colors.SERIES_COLORS)):
        point, mode = np.nonzero(curves == number)
        label = MODES[places[shares[point, mode].sum(axis=0).argmax()]]
        panel.plot(exponents[point], theory[point, mode], color=colors.INK, lw=0.9, gid="theory")
        panel.plot(exponents[point], measured[point, mode], "o", ms=3.0, mew=0.0, color=color, label=label, gid="mode")
    point, mode = np.nonzero(curves == 0)
    props = {"color": colors.INK, "label": "equal modes", "gid": "equal"}
    panel.plot(exponents[point], measured[point, mode], "o", ms=4.0, mew=0.0, **props)
    for exponent, name in CLOSED_ORBITS.items():
        if exponents[0] <= exponent <= exponents[-1]:
            panel.axvline(exponent, color=colors.QUIET, lw=0.9, ls=(0, (4, 2)))
            marks.annotate(
                panel,
                f"{name}: {np.sqrt(exponent + 2.0):g}, closed orbits",
                (exponent, np.sqrt(exponent + 2.0)),
                (5, -12),
            )
    panel.set(
        xlabel=wording.axis_label(subset, "exponent"), ylabel="angular frequency / orbital rate", ylim=(0.0, None)
    )
    canvas.draw_legend(figure, [])
    return figure
