"""Figure of real bodies: measured rates, flip periods, and measured against observed periods."""

import re
import textwrap
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sweeps.figure import axis_scales, canvas, colors, marks, sheets, wording
from sweeps.schema.iteration import spaced_indices
from sweeps.systems.motion import DAY, HOUR
from sweeps.systems.presentation.sentences import head_texts
from sweeps.systems.rigid_body.fits import Period, compare_periods, signed_rate
from sweeps.systems.rigid_body.presentation.appearance import APPEARANCE, LINES, cut_at, settings
from sweeps.systems.rigid_body.system import REGIMES

MAX_BODIES, MAX_PERIODS = 30, 10  # rows that fit a page
PERIOD_INCHES, LINE_INCHES = 1.28, 0.145  # heights of a period's row and of a line of its note
NOTE_WIDTH, NAME_WIDTH = 4.6, 20  # characters of a note per inch of the figure, and of a line of a name
AXIS, GROWS, FLIPS = 0.3, 0.97, 1.87  # inches from the right edge of the panel of rates to these columns of text
HEADING_LENGTH = 40  # characters of a period's heading
MEASURED: dict[str, Any] = {"label": "rigid body, measured", "marker": "o", "ms": 7.5, "color": colors.STABLE}
OBSERVED = MEASURED | {
    "label": "observed",
    "marker": "D",
    "ms": 6.5,
    "color": colors.PAPER,
    "mec": colors.INK,
    "mew": 1.3,
}
HOLLOW = ("sphere", "undetermined")  # regimes with hollow markers
LIGHT = (*HOLLOW, "stable_minor")  # regimes with light markers, on which the numeral is dark
NUMERAL = {"ha": "center", "va": "center", "fontsize": 7.6, "fontweight": "bold", "zorder": 4}
OFFSETS = {1: -0.3, 2: 0.0, 3: 0.3}


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw rates over the spin rate for each body and axis, growth and flip times, and observed periods in days."""
    subset = _select_bodies(ds)
    all_periods = compare_periods(ds.sel(body=subset["body"].values))
    periods = [all_periods[i] for i in spaced_indices(len(all_periods), MAX_PERIODS)]
    rows = subset.sizes["body"]
    row_height = 0.84 if sheets.is_narrow() else 0.46  # inches, for the markers of three axes
    height = 2.0 + max(row_height * rows, PERIOD_INCHES * len(periods), 1.0)
    has_more = ds.sizes["body"] > MAX_BODIES
    panels = 2 if periods or has_more else 1
    panel_rows, columns, size = canvas.arrange_panels(panels, (5.6 if panels > 1 else 6.8, height - 1.6), (1.0, 1.6))
    period_count = f";  periods of {len(periods)} of {len(all_periods)}" if len(periods) < len(all_periods) else ""
    title = head_texts(ds, "Bodies: measured rates")[0]
    figure = canvas.make_figure(*size, title, _subtitle(ds, subset) + period_count, ax=ax)
    axes = np.ravel(figure.subplots(panel_rows, columns))
    _draw_rates(axes[0], subset)
    if not sheets.is_narrow():
        _write_times(axes[0], subset)
    if periods:
        _draw_periods(axes[1], periods, (figure.get_size_inches()[1] / panel_rows - 2.0) / len(periods))
    elif has_more:
        _draw_histogram(axes[1], ds)
    regimes = {REGIMES[int(code) + 1] for code in np.unique(subset["regime"].values)}
    drawn_regimes = [word for word in REGIMES if word in regimes]
    handles = [Line2D([], [], ls="none", label=APPEARANCE.words(word), **_marker_props(word)) for word in drawn_regimes]
    handles.append(Line2D([], [], ls="none", marker="|", ms=9, color=colors.INK, label="linear theory"))
    canvas.draw_legend(figure, handles)
    return figure


def _select_bodies(ds: xr.Dataset) -> xr.Dataset:
    """Return the drawn columns of at most `MAX_BODIES` bodies over (body, axis), with `rate` and `rate_theory` in s-1.

    They are at the least epsilon and the middle omega0 and phase.
    """
    names = ["omega_squared", "omega_squared_theory", "regime", "regime_theory", "triangle_margin", "growth_rate"]
    names += [name for name in ("flip_period",) if name in ds]
    body_index = {"body": spaced_indices(ds.sizes["body"], MAX_BODIES)}
    subset = ds[names].isel(cut_at(ds) | body_index).load().transpose("body", "axis")
    measured, theory = (signed_rate(subset[name], subset["omega0"]) for name in names[:2])
    return subset.assign(rate=abs(measured), rate_theory=abs(theory))


def _subtitle(ds: xr.Dataset, subset: xr.Dataset) -> str:
    """Return title, number of bodies drawn, and the spin that they share."""
    fixed_values = {name: float(subset[name]) for name in ("omega0", "epsilon", "phase") if subset[name].ndim == 0}
    body_symbols = [APPEARANCE.symbol(name) for name in ("omega0", "epsilon", "phase") if subset[name].ndim]
    bodies = wording.format_count(ds.sizes["body"], "body", "bodies")
    if subset.sizes["body"] < ds.sizes["body"]:
        bodies = f"{subset.sizes['body']} of {bodies}"
    text = settings(fixed_values) + (f";  {', '.join(body_symbols)} differ by body" if body_symbols else "")
    return f"{ds.attrs.get('title', '')}:  {bodies};  {text}"


def _draw_rates(ax: Axes, subset: xr.Dataset) -> None:
    """Draw numbered markers at the measured rates over ticks at theory's; zero rates have a column of their own."""
    rates, theory = subset["rate"].values, subset["rate_theory"].values
    is_decided = ~np.isin(subset["regime"].values, (3, 4))
    positive = rates[is_decided & (rates > 0)]
    low = 10.0 ** (np.floor(np.log10(positive.min())) - 0.3) if positive.size else 0.1
    zero = low / 2.2
    ax.set_xscale("log")
    for (i, j), rate in np.ndenumerate(rates):
        axis = int(subset["axis"].values[j])
        y, word = i + OFFSETS[axis], REGIMES[int(subset["regime"].values[i, j]) + 1]
        ax.vlines(theory[i, j] if theory[i, j] else zero, y - 0.21, y + 0.21, color=colors.INK, lw=1.1, zorder=2)
        if np.isfinite(rate):
            x, ink = rate if is_decided[i, j] and rate > 0 else zero, colors.INK if word in LIGHT else colors.PAPER
            ax.plot([x], [y], zorder=3, gid=word, **_marker_props(word) | {"ms": 9.6, "mew": 0.9})
            marks.annotate(ax, str(axis), (x, y), (0, -0.35), color=ink, **NUMERAL)
    rows = subset.sizes["body"]
    ax.set(xlim=(zero / 1.7, max(2.0, 1.6 * np.nanmax(np.append(rates, 1.0)))), ylim=(rows - 0.42, -0.58))
    font_size = 7.2 if sheets.is_narrow() else 9.0
    ax.set_yticks(range(rows), [_row_label(subset.isel(body=i)) for i in range(rows)], fontsize=font_size)
    ax.set_xlabel(r"measured rate relative to the spin, $\sqrt{|\Omega^2|}\,/\,|\omega_0|$")
    ax.set_title("Rates (numerals: spin axis)", loc="left", fontweight="bold", fontsize=9.5)
    exponents = range(int(np.ceil(np.log10(low))), int(np.floor(np.log10(ax.get_xlim()[1]))) + 1)
    axis_scales.set_log_ticks_above_zero(ax.xaxis, zero, exponents[:: max(1, len(exponents) // 8)])
    ax.axvline(np.sqrt(zero * low) * 1.05, color=colors.FAINT, lw=0.8, ls=(0, (2, 2)))
    marks.draw_grid(ax, "x")
    for i in range(1, rows):
        ax.axhline(i - 0.5, color=colors.FAINT, lw=0.5)
    ax.tick_params(axis="y", length=0)


def _draw_histogram(ax: Axes, ds: xr.Dataset) -> None:
    """Draw the distribution of the measured rates of all bodies about each axis."""
    subset = ds[["omega_squared"]].isel(cut_at(ds)).load()
    rate = signed_rate(subset["omega_squared"], subset["omega0"]).transpose("axis", "body")
    finite = rate.values[np.isfinite(rate.values)]
    ends = (float(finite.min()), float(finite.max())) if finite.size else (-1.0, 1.0)
    bins = np.linspace(*ends, 61) if ends[0] < ends[1] else np.linspace(ends[0] - 1, ends[0] + 1, 61)
    for row in rate:
        axis = int(row["axis"])
        props: dict[str, Any] = {
            "histtype": "step",
            "lw": 1.6,
            "color": colors.SERIES_COLORS[axis - 1],
            "ls": LINES[axis],
        }
        ax.hist(row.values[np.isfinite(row.values)], bins, label=f"about axis {axis}", gid="histogram", **props)
    ax.axvline(0.0, color=colors.QUIET, lw=0.8)
    ax.set(xlabel=r"measured rate $/\,|\omega_0|$ (negative: growth)", ylabel="bodies")
    ax.set_title(f"All {ds.sizes['body']:,} bodies", loc="left", fontweight="bold", fontsize=9.5)
    ax.legend(loc="best")


def _write_times(ax: Axes, subset: xr.Dataset) -> None:
    """Write the unstable axis, its e-folding time and the time between flips next to each row."""
    props = {"va": "center", "fontsize": 8.5, "color": APPEARANCE.color("unstable")}
    has_flips = "flip_period" in subset
    perturbation = (
        f"ε = {wording.format_number(float(subset['epsilon']), 2)}" if subset["epsilon"].ndim == 0 else "own ε"
    )
    headings = {AXIS: "spun\nabout", GROWS: "grows\ne-fold in"} | (
        {FLIPS: f"{perturbation},\nflips every"} if has_flips else {}
    )
    for inches, heading in headings.items():
        _write_at_right(ax, None, inches, heading, va="bottom", fontsize=8, color=colors.QUIET)
    for i in range(subset.sizes["body"]):
        unstable = np.flatnonzero(subset["regime"].values[i] == REGIMES.index("unstable") - 1)
        if unstable.size:
            spin = subset.isel(body=i, axis=int(unstable[0]))
            _write_at_right(ax, i, AXIS, f"axis {int(spin['axis'])}", gid="about", **props)
            if rate := float(spin["growth_rate"]):
                _write_at_right(ax, i, GROWS, brief_duration(1.0 / rate), gid="e-fold", **props)
        if unstable.size and has_flips and np.isfinite(spin["flip_period"]):
            _write_at_right(ax, i, FLIPS, brief_duration(float(spin["flip_period"])), gid="flip", **props)


def _write_at_right(ax: Axes, row: int | None, inches: float, text: str, **props) -> None:
    """Write a text at a distance in inches to the right of a panel, in a row, or above all rows (None)."""
    anchor, transform = ((1.0, 1.0), ax.transAxes) if row is None else ((1.0, row), ax.get_yaxis_transform())
    shift = (72 * inches, 4 if row is None else 0)
    marks.annotate(ax, text, anchor, shift, xycoords=transform, ha="center", annotation_clip=False, **props)


def _row_label(body: xr.Dataset) -> str:
    name = textwrap.fill(str(body["body"].values), NAME_WIDTH)
    return name + ("" if float(body["triangle_margin"].min()) >= 0 else "\n(no rigid body)")


def _marker_props(word: str) -> dict:
    color = APPEARANCE.color(word)
    return {"marker": "o", "ms": 7, "mec": color, "mfc": colors.PAPER if word in HOLLOW else color}


def _draw_periods(ax: Axes, periods: list[Period], inches: float) -> None:
    """Draw measured and observed periods as pairs on an axis of days, each with its note in a row of `inches`."""
    all_days = [d for p in periods for d in (p.measured_days, p.observed_days) if np.isfinite(d)]
    width = ax.figure.get_size_inches()[0]
    # for the numbers next to the outermost markers
    margin = max(6.0, (max(all_days) / min(all_days)) ** 0.35) ** (12.0 / width)
    ax.set(xscale="log", xlim=(min(all_days) / margin, max(all_days) * margin), ylim=(len(periods), 0.0), yticks=[])
    for row, period in enumerate(periods):
        y = row + 0.42 / inches
        pair = [period.measured_days, period.observed_days]
        ax.plot(pair, [y, y], color=colors.FAINT, lw=2.5, zorder=1, solid_capstyle="butt")
        for x, props in zip(pair, (MEASURED, OBSERVED), strict=True):
            ax.plot(x, y, ls="none", zorder=3, gid=props["label"], **props)
        _write_period_texts(ax, period, row, y, inches)
        if row:
            ax.axhline(row, color=colors.FAINT, lw=0.5)
    axis_scales.set_plain_log_ticks(ax.xaxis)
    ax.set_xlabel("period in the body's frame  (days of 86,400 s)")
    ax.set_title("" if sheets.is_narrow() else "Periods", loc="left", fontweight="bold", fontsize=9.5)
    handles = [Line2D([], [], ls="none", **props) for props in (MEASURED, OBSERVED)]
    corner: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.1}
    ax.legend(handles=handles, ncols=2, handletextpad=0.3, columnspacing=1.2, **corner)
    marks.draw_grid(ax, "x")


def _write_period_texts(ax: Axes, period: Period, row: int, y: float, inches: float) -> None:
    """Write heading, period values at their marks, and the note of a measured period into its row."""

    def write(text, depth, **props):
        ax.text(0.02, row + depth / inches, text, transform=ax.get_yaxis_transform(), va="top", **props)

    heading = f"{period.body}: {period.what}, axis {period.axis}"
    write(textwrap.shorten(heading, HEADING_LENGTH, placeholder=" …"), 0.08, fontsize=9, fontweight="bold")
    values = sorted(d for d in (period.measured_days, period.observed_days) if np.isfinite(d))
    props = {"va": "center", "fontsize": 8.5, "path_effects": marks.halo(2.0)}
    if len(values) > 1:
        marks.annotate(ax, _format_days(values[0]), (values[0], y), (-8, 0), ha="right", **props)
    marks.annotate(ax, _format_days(values[-1]), (values[-1], y), (8, 0), ha="left", **props)
    if sheets.is_narrow():
        return
    line_length = int(NOTE_WIDTH * ax.figure.get_size_inches()[0])
    note = textwrap.wrap(" ".join(period.note.split()), line_length)
    if len(note) * LINE_INCHES > inches - 0.64:
        note = textwrap.wrap(conclusion(period.note), line_length)
    write("\n".join(note), 0.58, fontsize=7.8, color=colors.QUIET, linespacing=1.25)


def _format_days(value: float) -> str:
    """Return a time in days with two decimals, or three digits below 0.01 d, without trailing zeros."""
    if value < 0.01:
        return f"{wording.format_number(value, 3)} d"
    text = f"{value:,.2f}" if value < 10_000 else f"{value:,.0f}"
    return (text.rstrip("0").rstrip(".") if "." in text else text) + " d"


def conclusion(note: str) -> str:
    """Return the last sentence of a note, its conclusion."""
    return re.split(r"(?<=[.!?])\s+(?=[A-Z])", " ".join(note.split()))[-1]


def brief_duration(seconds: float) -> str:
    """Return a time span in three digits and an abbreviated unit: "0.853 s", "7.29 h", "304 d"."""
    unit, name = (1.0, "s") if seconds < 2 * HOUR else (HOUR, "h") if seconds < 2 * DAY else (DAY, "d")
    value = seconds / unit
    return f"{value:,.0f} {name}" if 100 <= value < 1e6 else f"{wording.format_number(value, 3)} {name}"
