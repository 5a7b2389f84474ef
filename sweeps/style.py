"""One look for all pictures: size, type, colours, and how names, numbers and units are written."""

import math
import re
import textwrap

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from sweeps.colors import INK, QUIET

DPI = 200
SUBTITLE_LETTERS = 15.0  # an inch, about, at the subtitle's size
SERIES_MARKERS = ("o", "s", "^", "D", "v", "P")

STYLE = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: the same everywhere
    "mathtext.fontset": "dejavusans",
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": 9.5,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.fontsize": 8.5,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": QUIET,
    "axes.linewidth": 0.8,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.limits": (-3, 4),
    "legend.frameon": False,
    "hatch.linewidth": 0.6,
    "savefig.dpi": DPI,
    "figure.dpi": DPI,
    "svg.fonttype": "none",
    "pdf.fonttype": 42,  # the font goes with the file
}

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def canvas(width: float, height: float, title: str, subtitle: str, footer: float = 0.0) -> Figure:
    """A figure drawn by Agg, with title and subtitle in its upper left corner.

    Args:
        width: in inches.
        height: in inches.
        title: one line.
        subtitle: one line or several.
        footer: height in inches that is kept free at the bottom.
    """
    figure = Figure(figsize=(width, height), dpi=DPI, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    head = 0.42 + 0.17 * (1 + subtitle.count("\n"))
    rect = (0.0, footer / height, 1.0, 1.0 - (head + footer) / height)
    figure.get_layout_engine().set(w_pad=0.08, h_pad=0.06, rect=rect)
    place = {"ha": "left", "va": "top", "in_layout": False}
    figure.text(0.12 / width, 1 - 0.12 / height, title, fontsize=12, fontweight="bold", **place)
    figure.text(0.12 / width, 1 - 0.37 / height, subtitle, fontsize=8.5, color=QUIET, linespacing=1.4, **place)
    return figure


def wrapped(text: str, width: float) -> str:
    """A subtitle in lines that a canvas of so many inches holds, each broken between words."""
    most = int((width - 0.24) * SUBTITLE_LETTERS)
    return "\n".join(part for line in text.split("\n") for part in textwrap.wrap(line, most) or [""])


def units(text: str) -> str:
    """UDUNITS text as people write it: "rad s-1" becomes "rad s⁻¹", and "1" nothing."""
    return "" if text == "1" else re.sub(r"(?<=[A-Za-z])-?\d+", lambda m: m[0].translate(_SUPERSCRIPTS), text)


def with_unit(text: str, unit: str, form: str = " {}") -> str:
    """Text and a unit (UDUNITS) behind it, in some form; the text alone where the unit is "1"."""
    unit = units(unit)
    return text + form.format(unit) if unit else text


def number(value: float, digits: int = 6) -> str:
    """A number as people write it: 1e-06 becomes 10⁻⁶, 0.0174799999 becomes 0.01748."""
    text = f"{value:.{digits}g}".replace("-", "−", 1) if value < 0 else f"{value:.{digits}g}"
    if "e" not in text:
        return text
    mantissa, exponent = text.split("e")
    power = "10" + str(int(exponent)).translate(_SUPERSCRIPTS)
    return power if mantissa == "1" else f"{mantissa}×{power}"


def count(n: int, noun: str, plural: str) -> str:
    """How many of something: "1 body", "1,200 bodies"."""
    return f"{n:,} {noun if n == 1 else plural}"


def halo(width: float = 2.5, color: str = "white"):
    """Outline that keeps text and lines readable on any colour."""
    return [withStroke(linewidth=width, foreground=color)]


def is_logarithmic(values) -> bool:
    """Whether values spread more evenly by ratio than by difference, over a factor of ten or more."""
    values = np.sort(np.asarray(values, float))
    if values.size < 3 or values[0] <= 0 or values[-1] < 10 * values[0]:
        return False
    steps = np.diff(values) / np.ptp(values), np.diff(np.log(values)) / np.log(values[-1] / values[0])
    return bool(np.std(steps[1]) < np.std(steps[0]))


def edges(values) -> np.ndarray:
    """Cell edges halfway between ascending values (by ratio where they are logarithmic), shape (n + 1,)."""
    values = np.asarray(values, float)
    if values.size == 1:
        return values[0] * np.array([0.95, 1.05])
    if is_logarithmic(values):
        return np.exp(_halfway(np.log(values)))
    return _halfway(values)


def _halfway(values: np.ndarray) -> np.ndarray:
    inner = values[:-1] + 0.5 * np.diff(values)
    first, last = values[0] - 0.5 * (values[1] - values[0]), values[-1] + 0.5 * (values[-1] - values[-2])
    return np.concatenate([[first], inner, [last]])


def plain_log_ticks(axis) -> None:
    """Ticks at 1, 2 and 5 in plain numbers where a logarithmic axis spans under two decades; else powers of ten."""
    low, high = axis.get_view_interval()
    if high < 100 * low:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)) if high > 10 * low else MaxNLocator(5))
        axis.set_major_formatter(lambda value, _: number(value, 3))
    axis.set_minor_formatter(NullFormatter())


def power(exponent: int) -> str:
    """A power of ten, as mathtext."""
    return f"$10^{{{exponent}}}$"


def legend(figure: Figure, handles: list, columns: int = 9) -> None:
    """A legend in the footer of a figure."""
    if handles:
        look = {"handlelength": 1.8, "columnspacing": 1.5, "handletextpad": 0.6, "borderaxespad": 0.0}
        width, height = figure.get_size_inches()
        place = {"loc": "lower left", "bbox_to_anchor": (0.12 / width, 0.09 / height)}
        figure.legend(handles=handles, ncols=min(columns, len(handles)), **place, **look).set_in_layout(False)


def few(length: int, most: int) -> list[int]:
    """At most `most` indices of a dimension, evenly strided."""
    return list(range(0, length, max(1, math.ceil(length / most))))
