"""Style of all figures: size, type, colours, and how names, numbers and units are written."""

import math
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from copy import copy
from typing import NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import (
    Colormap,
    LinearSegmentedColormap,
    ListedColormap,
    get_named_colors_mapping,
    to_rgb,
)
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from matplotlib.textpath import TextPath
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from sweeps.figure.colors import BLACK, FAINT, INK, PAPER, QUIET, THEMES

DPI = 200
SUBTITLE_LETTERS, TITLE_LETTERS = 15.0, 10.5  # an inch, about, at their sizes
VALUE = re.compile(r"[^\s,][^,\n=]{0,18} = [^,\n=]{0,18}[^\s,]")  # a name and its value, with its unit
TOGETHER = re.compile(r"\$[^$]*\$|\([^)]*\)|\w+ \d+$")  # in one line of a label: a formula, a unit, a number
LEAST_LETTERS = 12  # of a line of a label
LEGEND_POINTS = 8.5  # of a legend's letters
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
    "figure.facecolor": PAPER,
    "axes.facecolor": PAPER,
    "patch.edgecolor": BLACK,
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
    "svg.fonttype": "path",  # letters as curves: a viewer needs no font
    "pdf.fonttype": 42,  # the font goes with the file
}

_SUPERSCRIPTS = str.maketrans("-−0123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Sheet(NamedTuple):
    """The paper or slide that pictures are made for."""

    width: float | None = None  #: of the paper or the slide, mm; None for the size that a picture takes by itself
    height: float | None = None  #: likewise; None keeps the picture's own shape
    dots: float | None = None  #: per inch of the paper, of PNG; None for `DPI`
    #: what makes an empty figure: matplotlib's class, or pyplot's function where a person looks on.
    make: object = Figure

    @property
    def scale(self) -> float:
        """How large letters are, beside those of a picture that has no sheet."""
        if self.width is None:
            return 1.0
        return max(LEAST_SCALE, min(self.width / SLIDE[0], (self.height or PAGE_MM) / SLIDE[1]) * LETTERS)

    def inches(self) -> tuple[float, float]:
        """Return the room in which a picture is laid out, in inches of letters of a picture that has no sheet."""
        if self.width is None:
            return ROOM
        return self.width * MM / self.scale, (self.height or PAGE_MM) * MM / self.scale


class Film(NamedTuple):
    """How an animation is drawn."""

    rate: float  #: frames a second
    finer: int  #: how many times as many frames it has as a GIF
    across: int | None  #: width in pixels of the sheet of 16:9 that it fills; None for the animation's own size

    def dots(self, inches: tuple[float, float], usual: int) -> float:
        """Return the pixels per inch of a picture of this size, whose own are `usual`."""
        return min(self.across / inches[0], self.across * 9 / 16 / inches[1]) if self.across else usual


GIF, HD = Film(1000 / 60, 1, None), Film(30.0, 2, 1920)
film: ContextVar[Film] = ContextVar("film", default=GIF)

SLIDE = (338.7, 190.5)  # mm: 16:9
SHEETS = {"slide": Sheet(*SLIDE, dots=144.0), "page": Sheet(178.0), "column": Sheet(86.0)}  # a slide: 1920 x 1080
MM = 1.0 / 25.4  # inches
LETTERS, LEAST_SCALE = 4.0 / 3.0, 0.8  # of letters on a slide: 24 pixels; and at least, 7.2 points
PAGE_MM = 240.0  # height of a picture on a page
HEAD = 1.4  # inches, about, of title, subtitle and legend
NARROW = 6.0  # inches of a sheet, on which little stands beside panels
ROOM = (10.0, 8.0)  # inches, of a picture that has no sheet
LEAST_SHARE = 0.72  # of a panel's size: narrower ones stand below each other
BESIDE = (1.2, 1.6)  # inches, beside and above panels
ITS_OWN = Sheet()
_sheet: ContextVar[Sheet] = ContextVar("sheet", default=ITS_OWN)


_theme: ContextVar[str] = ContextVar("theme", default="light")

# kind of values → colour map of Matplotlib
COLOR_MAPS = {"signed": "RdBu", "logarithm": "coolwarm", "size": "cividis", "backdrop": "Greys"}
# In print, signed values from growth, dark, by zero to oscillation, light: a copy in grey still orders them.
ONE_WAY = LinearSegmentedColormap.from_list(
    "print", ["#4d0011", "#a3192b", "#d6604d", "#eb9a7c", "#f4c3a2", "#d3dde3", "#cfe8f5", "#e4f3fa", "#f7fcff"]
)
PRINT_COLOR_MAPS = {"signed": ONE_WAY, "logarithm": ONE_WAY.reversed()}
DARK_SURFACE = 0.3  # brightness of shaded surfaces in the dark theme, on which curves are pale


def _name_colors(theme: str) -> None:
    """Give the names of Polhode's colours the values of a theme, in figures that are drawn or written from now on."""
    names = get_named_colors_mapping()
    for name, color in THEMES[theme].items():
        names[name] = color


_name_colors("light")


@contextmanager
def drawn_for(sheet: Sheet, theme: str = "light") -> Iterator[None]:
    """Draw and write figures of this block for one sheet, in Polhode's style, whatever the user's settings are."""
    of_sheet, of_theme = _sheet.set(sheet), _theme.set(theme)
    try:
        with matplotlib.rc_context():
            matplotlib.rcdefaults()
            matplotlib.rcParams.update(STYLE | ({"savefig.dpi": sheet.dots} if sheet.dots else {}))
            _name_colors(theme)
            yield
    finally:
        _sheet.reset(of_sheet)
        _theme.reset(of_theme)
        _name_colors(_theme.get())


def is_print() -> bool:
    """Return True if figures are drawn for a printer without colours."""
    return _theme.get() == "print"


def brightness() -> float:
    """Return the brightness of shaded surfaces in the theme, from 0 to 1."""
    return DARK_SURFACE if _theme.get() == "dark" else 1.0


def color_map(kind: str) -> Colormap:
    """Return the colours of a kind of values (`COLOR_MAPS`) in the theme."""
    in_print = PRINT_COLOR_MAPS.get(kind) if is_print() else None
    return in_print or matplotlib.colormaps[COLOR_MAPS[kind]]


def is_narrow() -> bool:
    """Return True if the sheet is as narrow as a column of a journal."""
    return _sheet.get().inches()[0] < NARROW


def arranged(panels: int, cell: tuple[float, float], beside=BESIDE) -> tuple[int, int, tuple[float, float]]:
    """Return rows and columns of panels, and the inches of their picture, as they fit the sheet best.

    A panel has the inches of `cell`; what is beside and above all of them, those of `beside`.
    """
    room = _sheet.get().inches()

    def size(columns: int) -> tuple[float, float]:
        return beside[0] + columns * cell[0], beside[1] + math.ceil(panels / columns) * cell[1]

    def share(columns: int) -> float:
        scale = min(most / need for most, need in zip(room, size(columns), strict=True))
        return scale * panels / (columns * math.ceil(panels / columns))

    good = [columns for columns in range(panels, 0, -1) if share(columns) >= LEAST_SHARE]
    columns = good[0] if good else max(range(1, panels + 1), key=share)
    return math.ceil(panels / columns), columns, size(columns)


class Borrowed:
    """The place of one Axes in somebody's figure: a picture's panels stand there as in a figure of their own."""

    def __init__(self, ax: Axes):
        self.ax, self.axes, self.figure = ax, [], ax.figure

    def __getattr__(self, name: str):
        """Return any other attribute from the figure."""
        return getattr(self.figure, name)

    def add_gridspec(self, *shape: int, **options):
        """Return a grid specification within the given Axes, which are removed."""
        self.ax.set_axis_off()
        return self.ax.get_subplotspec().subgridspec(*shape, **options)

    def add_subplot(self, at=None, **options) -> Axes:
        """Return the given Axes, or a part of their grid."""
        self.axes.append(self.ax if at is None else self.figure.add_subplot(at, **options))
        return self.axes[-1]

    def subplots(self, rows: int = 1, columns: int = 1, *, sharex=False, sharey=False, squeeze=True, **options):
        """Return panels in rows and columns; the given Axes for one panel."""
        if rows == columns == 1:
            made = np.array([[self.add_subplot()]])
        else:
            made = self.add_gridspec(rows, columns, **options).subplots(sharex=sharex, sharey=sharey, squeeze=False)
            self.axes += made.ravel().tolist()
        return (made.item() if made.size == 1 else made.squeeze()) if squeeze else made


class FoldedLayout(ConstrainedLayoutEngine):
    """Matplotlib's compressed layout, in which a label or title longer than its panel takes several lines."""

    def execute(self, fig: Figure) -> None:
        """Fit panels and texts to the figure, a second time if a panel was smaller than its label or title."""
        super().execute(fig)
        if any([_folded(text, side, room) for ax in fig.axes for text, side, room in _beside(ax)]):
            super().execute(fig)


def _beside(ax: Axes) -> list[tuple[Text, str, float]]:
    """Return labels of a panel and its left title, each with the side along which it is long, and its room in px."""
    texts = {text.get_text(): text for text in ax.get_children() if isinstance(text, Text) and text.get_text()}
    left, right = (texts.get(ax.get_title(place)) for place in ("left", "right"))
    labels = [(ax.xaxis.label, "width", ax.bbox.width), (ax.yaxis.label, "height", ax.bbox.height)]
    if left:
        labels.append((left, "width", ax.bbox.width - (right.get_window_extent().width if right else 0.0)))
    return labels


def _folded(text: Text, side: str, room: float) -> bool:
    """Break a text that is longer than its room into lines; return True if that changed it."""
    words, length = text.get_text(), getattr(text.get_window_extent(), side)
    if not length > room > 0.0:
        return False
    whole = TOGETHER.sub(lambda part: part[0].replace(" ", "\u00a0"), words.replace("\n", " "))
    most = max(LEAST_LETTERS, int(max(map(len, words.split("\n"))) * room / length))
    text.set_text("\n".join(textwrap.wrap(whole, most, break_long_words=False)).replace("\u00a0", " "))
    return text.get_text() != words


def canvas(width: float, height: float, title: str, subtitle: str, ax: Axes | None = None) -> Figure | Borrowed:
    """Return a figure drawn by Agg, with title and subtitle in its upper left corner, or the given Axes.

    Width and height are in inches, where the sheet has none; its height may follow from the ratio of both. What is too
    long is broken between words. The given Axes have the title alone.
    """
    if ax is not None:
        ax.set_title(title)
        return Borrowed(ax)
    sheet = _sheet.get()
    if sheet.width:
        wide, high = sheet.inches()
        width, height = wide, high if sheet.height else min(high, HEAD + (height - HEAD) * wide / width)
    title, subtitle = wrapped(title, width, TITLE_LETTERS), wrapped(subtitle, width)
    figure = sheet.make(figsize=(width, height), dpi=DPI, layout=FoldedLayout(compress=True), facecolor=PAPER)
    if sheet.make is Figure:
        FigureCanvasAgg(figure)
    figure.scale = sheet.scale
    below = 0.12 + 0.25 * (1 + title.count("\n"))
    head = below + 0.05 + 0.17 * (1 + subtitle.count("\n"))
    figure.get_layout_engine().set(w_pad=0.08, h_pad=0.06, rect=(0.0, 0.0, 1.0, 1.0 - head / height))
    place = {"ha": "left", "va": "top", "in_layout": False}
    figure.text(0.12 / width, 1 - 0.12 / height, title, fontsize=12, fontweight="bold", linespacing=1.3, **place)
    figure.text(0.12 / width, 1 - below / height, subtitle, fontsize=8.5, color=QUIET, linespacing=1.4, **place)
    return figure


def panels(count: int, cell: tuple[float, float], title: str, subtitle: str, ax: Axes | None, **options):
    """Return a figure with so many panels, as they fit the sheet best, and the panels.

    `cell` and `beside` are those of `arranged`; other options are those of Matplotlib's `subplots`.
    """
    rows, columns, size = arranged(count, cell, options.pop("beside", BESIDE))
    figure = canvas(*size, title, subtitle, ax=ax)
    axes = figure.subplots(rows, columns, squeeze=False, **options).ravel()
    for spare in axes[count:]:
        spare.set_axis_off()
    return figure, axes[:count]


def wrapped(text: str, width: float, letters: float = SUBTITLE_LETTERS) -> str:
    """Return text wrapped to a canvas of so many inches with so many letters an inch, never within `name = value`."""
    most = int((width - 0.24) * letters)
    whole = VALUE.sub(lambda value: value[0].replace(" ", "\u00a0"), text)  # where textwrap breaks nothing
    return "\n".join(part for line in whole.split("\n") for part in textwrap.wrap(line, most) or [""])


def units(text: str) -> str:
    """Return UDUNITS text with superscripts: "rad s-1" becomes "rad s⁻¹", and "1" nothing."""
    return "" if text == "1" else re.sub(r"(?<=[A-Za-z])-?\d+", lambda m: m[0].translate(_SUPERSCRIPTS), text)


def with_unit(text: str, unit: str, form: str = " {}") -> str:
    """Return text followed by its unit (UDUNITS); the text alone where the unit is "1"."""
    unit = units(unit)
    return text + form.format(unit) if unit else text


def label_of(ds, name: str, symbols: Mapping = {}) -> str:
    """Return what a coordinate of a map is, with its symbol and unit, for an axis of a plot."""
    text = _as_formulas(ds[name].attrs.get("long_name", name).partition(";")[0])
    symbol = symbols[name].tex if name in symbols else _as_formulas(f" {name}").strip()
    if len(name) == 1:
        text = re.sub(rf"\b{name}\b", symbol.replace("\\", r"\\"), text) if symbol not in text else text
    if "$" in symbol and symbol not in text:
        text = f"{symbol} = {text}" if "/" in text else f"{text}, {symbol}"
    return with_unit(text, ds[name].attrs.get("units", "1"), "  ({})")


def fixed_at(ds, name: str, value: float, symbols: Mapping = {}) -> str:
    """Return the value at which a coordinate of a map is fixed: "spin rate = 2 rad s⁻¹"."""
    text = _as_formulas(f" {name}").strip().replace("_", " " if "_" in name else "_")
    text = symbols[name].tex if name in symbols else text
    return with_unit(f"{text} = {number(float(value), 4)}", ds[name].attrs.get("units", "1"))


def _as_formulas(text: str) -> str:
    """Return text with symbols such as I2, and a letter at its end, as mathtext."""
    text = re.sub(r"\b([A-Za-z])_?(\d)\b", r"$\1_\2$", text).replace(" - ", " − ")
    return re.sub(r"(?<= )([A-Za-z])$", r"$\1$", text)


def number(value: float, digits: int = 6) -> str:
    """Return a number as text: 1e-06 becomes 10⁻⁶, 0.0174799999 becomes 0.01748."""
    text = f"{value:.{digits}g}".replace("-", "−", 1) if value < 0 else f"{value:.{digits}g}"
    if "e" not in text:
        return text
    mantissa, exponent = text.split("e")
    power = "10" + str(int(exponent)).translate(_SUPERSCRIPTS)
    return power if mantissa == "1" else f"{mantissa}×{power}"


def count(n: int, noun: str, plural: str) -> str:
    """Return a count with its noun: "1 body", "1,200 bodies"."""
    return f"{n:,} {noun if n == 1 else plural}"


def dots() -> float:
    """Return the dots per inch of the file being written."""
    dpi = matplotlib.rcParams["savefig.dpi"]
    return DPI if dpi == "figure" else float(dpi)


class Shades(ListedColormap):
    """Shades of some colours, one after the other, so many of each, from pale, near the paper's, to full."""

    PALEST = 0.3

    def __init__(self, bases: Sequence, number: int):
        paper, full = np.array(to_rgb(PAPER)), [np.array(to_rgb(base)) for base in bases]
        shares = np.linspace(self.PALEST, 1.0, number)
        super().__init__([tuple(paper + share * (base - paper)) for base in full for share in shares], "shades")


def halo(width: float = 2.5, color: str = PAPER):
    """Return an outline that keeps text and lines readable on any colour."""
    return [withStroke(linewidth=width, foreground=color)]


def grid(ax: Axes, axis: str = "both") -> None:
    """Draw faint lines at the ticks of one axis or both, behind all else."""
    ax.grid(axis=axis, color=FAINT, lw=0.5, alpha=0.7)
    ax.set_axisbelow(True)


def note(ax: Axes, text: str, place, offset: tuple[float, float], **look) -> None:
    """Write a text beside a place, so many points away."""
    ax.annotate(text, place, offset, textcoords="offset points", **look)


def fractions(ax: Axes, x, y) -> np.ndarray:
    """Return places as fractions of a panel, shape (n, 2), with the axes scaled to what is drawn so far."""
    ax.get_xlim(), ax.get_ylim()  # Matplotlib scales axes when their limits are read, not in transData
    places = np.column_stack([np.ravel(x), np.ravel(y)])
    return ax.transAxes.inverted().transform(ax.transData.transform(places))


def spread(ax: Axes, x: float, values: np.ndarray, least: float) -> np.ndarray:
    """Return heights for texts beside values of a panel, in fractions of its height and at least so far apart."""
    ends = np.clip(np.nan_to_num(fractions(ax, np.full(len(values), x), values)[:, 1]), 0.0, 1.0)
    order, steps = np.argsort(ends), least * np.arange(ends.size)
    heights = np.maximum.accumulate(ends[order] - steps) + steps
    return (heights - max(heights[-1] - 1.0 + least / 2, 0.0))[np.argsort(order)]


def hatched(label: str = "physically impossible", **look) -> Patch:
    """Return what stands in a legend for a hatched region."""
    return Patch(**{"facecolor": "none", "edgecolor": QUIET, "hatch": "////", "lw": 0, "label": label} | look)


def is_logarithmic(values) -> bool:
    """Return True if values spread more evenly by ratio than by difference, over a factor of ten or more."""
    values = np.sort(np.asarray(values, float))
    if values.size < 3 or values[0] <= 0 or values[-1] < 10 * values[0]:
        return False
    steps = np.diff(values) / np.ptp(values), np.diff(np.log(values)) / np.log(values[-1] / values[0])
    return bool(np.std(steps[1]) < np.std(steps[0]))


def scale_as_spread(axis, values) -> None:
    """Set the scale of an axis: logarithmic where its values spread by ratio."""
    if is_logarithmic(values):
        getattr(axis.axes, f"set_{axis.axis_name}scale")("log")
        plain_log_ticks(axis)


def edges(values) -> np.ndarray:
    """Return cell edges halfway between ascending values (by ratio where they are logarithmic), shape (n + 1,)."""
    values = np.asarray(values, float)
    if values.size == 1:
        return values[0] * np.array([0.95, 1.05])
    by_ratio = is_logarithmic(values)
    values = np.log(values) if by_ratio else values
    inner = values[:-1] + 0.5 * np.diff(values)
    first, last = values[0] - 0.5 * (values[1] - values[0]), values[-1] + 0.5 * (values[-1] - values[-2])
    between = np.concatenate([[first], inner, [last]])
    return np.exp(between) if by_ratio else between


def plain_log_ticks(axis) -> None:
    """Set ticks at 1, 2 and 5 in plain numbers on a logarithmic axis of under two decades, else at powers of ten."""
    low, high = axis.get_view_interval()
    if high < 100 * low:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)) if high > 10 * low else MaxNLocator(5))
        axis.set_major_formatter(lambda value, _: number(value, 3))
    axis.set_minor_formatter(NullFormatter())


def log_ticks_above_zero(axis, zero: float, exponents) -> None:
    """Set ticks at powers of ten on a logarithmic axis, and 0 where values of zero are drawn."""
    axis.set_ticks([zero, *(10.0**n for n in exponents)], ["0", *map(power, exponents)])
    axis.axes.minorticks_off()


def power(exponent: int) -> str:
    """Return a power of ten as mathtext."""
    return f"$10^{{{exponent}}}$"


def legend(figure: Figure | Borrowed, handles: Sequence = ()) -> None:
    """Draw a legend below a figure's panels, with each label once in order of drawing, in as few rows as fit.

    Artists are large and strong enough to be seen in it; what an Axes with a legend of its own says is left out. In
    somebody's figure there is none: its Axes know the labels, `ax.legend()` makes one.
    `handles` stand for kinds of things that are no artist of their own, after the others.
    """
    entries = {}
    for artist in (
        a for ax in figure.axes if ax.get_legend() is None for a in (*ax.lines, *ax.collections, *ax.patches)
    ):
        if (label := artist.get_label()) and not str(label).startswith("_"):
            entries.setdefault(str(label), artist)
    entries |= {str(handle.get_label()): handle for handle in handles}
    if isinstance(figure, Borrowed) or not entries:
        return
    sizes = [TextPath((0, 0), label, LEGEND_POINTS).get_extents().width + 4.2 * LEGEND_POINTS for label in entries]
    room = 72 * (figure.get_size_inches()[0] - 0.2)
    rows = {n: sum(map(max, np.array_split(sizes, n))) for n in range(len(sizes), 0, -1)}  # columns → points
    columns = next((n for n, row in rows.items() if row <= room), 1)
    look = {"handlelength": 1.8, "columnspacing": 1.5, "handletextpad": 0.6, "borderaxespad": 0.8}
    size = LEGEND_POINTS * min(1.0, room / rows[columns])
    seen = [_seen(artist) for artist in entries.values()]
    figure.legend(handles=seen, ncols=columns, fontsize=size, loc="outside lower left", **look)


def _seen(artist):
    if not isinstance(artist, Line2D):
        return artist
    sample = copy(artist)
    sample.set(alpha=max(artist.get_alpha() or 1.0, 0.9), path_effects=[])
    sample.set_markersize(max(artist.get_markersize(), 4.0))
    return sample


def few(length: int, most: int) -> list[int]:
    """Return at most `most` indices of a dimension, evenly spaced."""
    return list(range(0, length, max(1, math.ceil(length / most))))


def even_stride(lengths: Iterable[int], most: int) -> int:
    """Return the stride that keeps at most `most` points of a grid: 1, or a prime that divides no dimension's length.

    A common factor would show some values of that dimension only.
    """
    lengths = tuple(lengths)
    stride = max(1, -(-math.prod(lengths) // most))

    def is_good(stride: int) -> bool:
        return all(stride % k for k in range(2, math.isqrt(stride) + 1)) and all(n % stride for n in lengths)

    while stride > 1 and not is_good(stride):
        stride += 1
    return stride
