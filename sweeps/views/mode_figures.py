"""Campbell diagram and root locus, mode by mode, and the response to a harmonic force over its frequency."""

from collections.abc import Iterable, Iterator
from itertools import cycle

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweeps.figure import axis_scales, canvas, colors, sheets, wording

SPEED_UNITS = ("rad s-1", "1 s-1", "s-1")  # units of a parameter with order lines: its multiples are frequencies
HEADROOM = 1.12  # upper end of the frequencies, relative to the largest, which leaves room for the crossings' values
CELL = (4.6, 3.4)  # inches, width and height of a panel


def draw_campbell(modes: xr.Dataset, along: str, orders: Iterable[float] = (1, 2), axes: Axes | None = None) -> Figure:
    """Draw frequency and damping ratio of each mode over a parameter, and order lines with their crossings.

    Args:
        modes: of `sweeps.modes`, of one line, followed along the parameter.
        along: the parameter.
        orders: multiples of the parameter that are drawn as lines of frequency, if it is a rate of rotation.
        axes: Axes to draw in; None for a new figure.
    """
    curves = [*_curves(modes, along)]
    figure, (upper, lower) = canvas.make_panels(2, CELL, str(modes.attrs["title"]), "", axes)
    label, speeds = wording.axis_label(modes, along), modes[along].values
    for (values, rates), color in zip(curves, cycle(colors.SERIES_COLORS)):
        upper.plot(values, rates.imag, color=color)
        with np.errstate(all="ignore"):
            lower.plot(values, -rates.real / np.abs(rates), color=color)
    top = HEADROOM * upper.get_ylim()[1]
    shown_orders = orders if modes[along].attrs.get("units") in SPEED_UNITS else ()
    for order, (side, shift) in zip(shown_orders, cycle([("left", 5), ("right", -5)])):
        upper.plot(speeds, order * np.abs(speeds), color=colors.QUIET, linestyle="--", linewidth=0.8)
        for value, frequency in crossings(curves, order):
            upper.plot(value, frequency, "o", color=colors.INK, markersize=4)
            words = f"{order:g}×: {wording.format_number(value, 4)}"
            place = {"textcoords": "offset points", "xytext": (shift, 5), "ha": side}
            upper.annotate(words, (value, frequency), fontsize=8, **place)
    upper.set(xlabel=label, ylabel=wording.with_unit("angular frequency", "rad s-1", "  ({})"), ylim=(0.0, top))
    lower.axhline(0.0, color=colors.QUIET, linewidth=0.8)
    lower.set(xlabel=label, ylabel="damping ratio  (negative: unstable)")
    return figure


def crossings(curves: list[tuple[np.ndarray, np.ndarray]], order: float) -> Iterator[tuple[float, float]]:
    """Yield (value, frequency) at which a curve's frequency is `order` times the parameter, between two points."""
    for values, rates in curves:
        excess = rates.imag - order * np.abs(values)
        for cell in np.flatnonzero((excess[:-1] * excess[1:] < 0.0) | ((excess[:-1] == 0.0) & (rates.imag[:-1] > 0.0))):
            share = excess[cell] / (excess[cell] - excess[cell + 1])
            yield tuple(line[cell] + share * (line[cell + 1] - line[cell]) for line in (values, rates.imag))


def draw_root_locus(modes: xr.Dataset, along: str, axes: Axes | None = None) -> Figure:
    """Draw the path of each eigenvalue in the complex plane as a parameter grows, from a dot; arguments as above."""
    figure, (panel,) = canvas.make_panels(1, CELL, str(modes.attrs["title"]), "", axes)
    values = modes[along].values
    for (_values, rates), color in zip(_curves(modes, along), cycle(colors.SERIES_COLORS)):
        panel.plot(rates.real, rates.imag, color=color, marker=".", markersize=2)
        panel.plot(rates.real[:1], rates.imag[:1], "o", color=color, markersize=4)
    panel.axvline(0.0, color=colors.QUIET, linewidth=0.8)
    low, high = (wording.format_coordinate(modes, along, value) for value in values[[0, -1]])
    panel.set_title(f"{low} (dot) to {high}", loc="left")
    real, imag = (wording.with_unit(f"{axis_name} part", "s-1", "  ({})") for axis_name in ("real", "imaginary"))
    panel.set(xlabel=real, ylabel=imag)
    return figure


def draw_surface(modes: xr.Dataset, along: str, over: str, curve: int, axes: Axes | None = None) -> Figure:
    """Draw the frequency of one mode over two parameters, with cuts at which it is exchanged with another mode.

    Args:
        modes: of `sweeps.modes`, of one plane, followed along a parameter.
        along: that parameter.
        over: the second parameter.
        curve: number of the mode's curve along the first parameter.
        axes: Axes to draw in; None for a new figure.
    """
    words = f"mode {curve}, followed along {along}"
    figure, (panel,) = canvas.make_panels(1, CELL, str(modes.attrs["title"]), words, axes)
    plane = modes.squeeze([str(dim) for dim in modes["curve"].dims[:-1] if dim not in (along, over)])
    plane = plane.transpose(over, along, ...)
    frequency = abs(plane["eigenvalue_imag"]).where(plane["curve"] == curve)
    frequency = frequency.max([str(dim) for dim in frequency.dims[2:]])
    columns, rows = (axis_scales.cell_edges(plane[name].values) for name in (along, over))
    palette = sheets.color_map("size").with_extremes(bad=colors.MISSING)
    mesh = panel.pcolormesh(columns, rows, np.ma.masked_invalid(frequency.values), cmap=palette, rasterized=True)
    row, column = np.nonzero(plane[f"cut_{over}"].values)
    style = {"color": colors.INK, "linewidth": 2.0, "label": "cut: modes are exchanged", "gid": "cut"}
    panel.hlines(rows[row + 1], columns[column], columns[column + 1], **style)
    for axis, name, values in ((panel.xaxis, along, plane[along]), (panel.yaxis, over, plane[over])):
        axis_scales.set_scale(axis, values.values)
        axis.set_label_text(wording.axis_label(modes, name))
    figure.colorbar(mesh, ax=panel, label=wording.with_unit("angular frequency", "rad s-1", "  ({})"))
    canvas.draw_legend(figure)
    return figure


def draw_response(response: xr.Dataset, axes: Axes | None = None) -> Figure:
    """Draw the measured amplitude and phase of each component over the frequency of a force, on theory's lines.

    Args:
        response: of `sweeps.response`.
        axes: Axes to draw in; None for a new figure.
    """
    subtitle = f"force: {response.attrs['force']}"
    figure, (upper, lower) = canvas.make_panels(2, CELL, str(response.attrs["title"]), subtitle, axes)
    frequencies = response["angular_frequency"].values
    for component, color in zip(response["component"].values, cycle(colors.SERIES_COLORS)):
        curve = response.sel(component=component)
        upper.plot(frequencies, curve["response_amplitude_theory"], color=colors.INK, linewidth=0.7)
        upper.plot(frequencies, curve["response_amplitude"], ".", color=color, markersize=3, label=str(component))
        lower.plot(frequencies, np.degrees(np.unwrap(curve["response_phase_theory"])), color=colors.INK, linewidth=0.7)
        turns = np.round((np.unwrap(curve["response_phase_theory"]) - curve["response_phase"]) / (2.0 * np.pi))
        lower.plot(
            frequencies, np.degrees(curve["response_phase"] + 2.0 * np.pi * turns), ".", color=color, markersize=3
        )
    units = {*response["unit"].values.tolist()}
    label = wording.with_unit("angular frequency of the force", "rad s-1", "  ({})")
    unit = units.pop() if len(units) == 1 else "1"
    upper.set(xlabel=label, ylabel=wording.with_unit("amplitude of the response", unit, "  ({})"), yscale="log")
    lower.set(xlabel=label, ylabel="phase from the force  (degrees)")
    canvas.draw_legend(figure)
    return figure


def _curves(modes: xr.Dataset, along: str) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield (values, eigenvalues) of each mode of frequency ≥ 0, by its curve; of conjugate curves one."""
    rates = (modes["eigenvalue_real"] + 1j * modes["eigenvalue_imag"]).values.reshape(modes.sizes[along], -1)
    curves = modes["curve"].values.reshape(rates.shape)
    for number in np.unique(curves[curves > 0]):
        point, mode = np.nonzero((curves == number) & (rates.imag >= 0.0))
        if point.size:
            yield modes[along].values[point], rates[point, mode]
