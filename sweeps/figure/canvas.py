"""Figures with a title, panels that fit the sheet, texts in lines, and one legend."""

import math
import re
import textwrap
from collections.abc import Sequence
from copy import copy
from typing import cast

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.textpath import TextPath

from sweeps.figure import sheets
from sweeps.figure.colors import PAPER, QUIET

SUBTITLE_LETTERS, TITLE_LETTERS = 15.0, 10.5  # average letters per inch in the sizes of subtitle and title
SUBTITLE_POINTS = 8.5  # size of a subtitle's letters, points
VALUE = re.compile(r"[^\s,][^,\n=]{0,18} = [^,\n=]{0,18}[^\s,]")  # a name and its value, with its unit
UNBROKEN = re.compile(r"\$[^$]*\$|\([^)]*\)|\w+ \d+$")  # a formula, a unit or a number, kept in one line of a label
MIN_LINE_LETTERS = 12  # labels are not broken into lines with fewer letters
LEGEND_POINTS = 8.5  # size of a legend's letters, points
HEAD_HEIGHT = 1.4  # inches, average height of title, subtitle and legend
MIN_PANEL_SCALE = 0.72  # panels that would be smaller by this factor are arranged in fewer columns
PANEL_MARGINS = (1.2, 1.6)  # inches next to and above all panels


def arrange_panels(
    count: int, cell: tuple[float, float], margins=PANEL_MARGINS
) -> tuple[int, int, tuple[float, float]]:
    """Return (rows, columns, size) of panels that fit the sheet best; the picture's size is in inches.

    Args:
        count: number of panels.
        cell: width and height of a panel, inches.
        margins: width next to all panels and height above them, inches.
    """
    sheet_size = sheets.current_sheet().layout_size()

    def picture_size(columns: int) -> tuple[float, float]:
        return margins[0] + columns * cell[0], margins[1] + math.ceil(count / columns) * cell[1]

    def panel_scale(columns: int) -> float:
        scale = min(available / side for available, side in zip(sheet_size, picture_size(columns), strict=True))
        return scale * count / (columns * math.ceil(count / columns))

    good = [columns for columns in range(count, 0, -1) if panel_scale(columns) >= MIN_PANEL_SCALE]
    columns = good[0] if good else max(range(1, count + 1), key=panel_scale)
    return math.ceil(count / columns), columns, picture_size(columns)


class BorrowedAxes:
    """One Axes in a user's figure, with the methods of a figure: panels are made in the place of the Axes."""

    def __init__(self, ax: Axes):
        self.ax, self.figure = ax, ax.figure
        self.axes: list[Axes] = []

    def __getattr__(self, name: str):
        """Return any further attribute from the figure."""
        return getattr(self.figure, name)

    def add_gridspec(self, *shape: int, **options):
        """Return a grid specification within the given Axes, which are hidden."""
        self.ax.set_axis_off()
        return self.ax.get_subplotspec().subgridspec(*shape, **options)

    def add_subplot(self, at=None, **options) -> Axes:
        """Return the given Axes, or a cell `at` of their grid."""
        self.axes.append(self.ax if at is None else self.figure.add_subplot(at, **options))
        return self.axes[-1]

    def subplots(self, rows: int = 1, columns: int = 1, *, sharex=False, sharey=False, squeeze=True, **options):
        """Return panels, the given Axes if there is one panel; parameters as of Matplotlib's `subplots`.

        Args:
            rows: number of rows.
            columns: number of columns.
            sharex: whether panels have a common abscissa.
            sharey: whether panels have a common ordinate.
            squeeze: whether dimensions of length one are left out.
            options: of `add_gridspec`.
        """
        if rows == columns == 1:
            panels = np.array([[self.add_subplot()]])
        else:
            panels = self.add_gridspec(rows, columns, **options).subplots(sharex=sharex, sharey=sharey, squeeze=False)
            self.axes += panels.ravel().tolist()
        return (panels.item() if panels.size == 1 else panels.squeeze()) if squeeze else panels


class LineBreakingLayout(ConstrainedLayoutEngine):
    """Matplotlib's compressed layout, in which a label or title longer than its panel is broken into lines."""

    def execute(self, fig: Figure) -> None:
        """Fit panels and texts to the figure, a second time if a panel was smaller than its label or title."""
        super().execute(fig)
        if any([_break_text(text, side, length) for ax in fig.axes for text, side, length in _labels_of(ax)]):
            super().execute(fig)


def _labels_of(ax: Axes) -> list[tuple[Text, str, float]]:
    """Return (text, "width" or "height", available length in pixels) of a panel's labels and its left title."""
    texts = {text.get_text(): text for text in ax.get_children() if isinstance(text, Text) and text.get_text()}
    left_title, right_title = (texts.get(ax.get_title(place)) for place in ("left", "right"))
    labels = [(ax.xaxis.label, "width", ax.bbox.width), (ax.yaxis.label, "height", ax.bbox.height)]
    if left_title:
        right_width = right_title.get_window_extent().width if right_title else 0.0
        labels.append((left_title, "width", ax.bbox.width - right_width))
    return labels


def _break_text(text: Text, side: str, available: float) -> bool:
    """Break a text that is longer than the available length into lines; return True if that changed it."""
    words, length = text.get_text(), getattr(text.get_window_extent(), side)
    if not length > available > 0.0:
        return False
    one_line = UNBROKEN.sub(lambda match: match[0].replace(" ", "\u00a0"), words.replace("\n", " "))
    letters = max(MIN_LINE_LETTERS, int(max(map(len, words.split("\n"))) * available / length))
    text.set_text("\n".join(textwrap.wrap(one_line, letters, break_long_words=False)).replace("\u00a0", " "))
    return text.get_text() != words


def make_figure(width: float, height: float, title: str, subtitle: str, ax: Axes | None = None) -> Figure:
    """Return a figure drawn by Agg, with title and subtitle in its upper left corner, or the given Axes.

    Args:
        width: inches, used if the sheet has no size.
        height: inches, used likewise; if the sheet has a width alone, height/width is kept.
        title: broken between words if it is too long.
        subtitle: broken likewise.
        ax: Axes to draw in, which are given the title alone; None for a new figure.
    """
    if ax is not None:
        ax.set_title(title, wrap=True)
        return cast(Figure, BorrowedAxes(ax))
    sheet = sheets.current_sheet()
    if sheet.width:
        sheet_width, sheet_height = sheet.layout_size()
        own_height = HEAD_HEIGHT + (height - HEAD_HEIGHT) * sheet_width / width
        width, height = sheet_width, sheet_height if sheet.height else min(sheet_height, own_height)
    title, subtitle = wrap_text(title, width, TITLE_LETTERS), wrap_text(subtitle, width)
    figure = sheet.new_figure(
        figsize=(width, height), dpi=sheets.DPI, layout=LineBreakingLayout(compress=True), facecolor=PAPER
    )
    if sheet.new_figure is Figure:
        FigureCanvasAgg(figure)
    figure.letter_scale = sheet.letter_scale
    title_bottom = 0.12 + 0.25 * (1 + title.count("\n"))
    head = title_bottom + 0.05 + 0.17 * (1 + subtitle.count("\n"))
    figure.get_layout_engine().set(w_pad=0.08, h_pad=0.06, rect=(0.0, 0.0, 1.0, 1.0 - head / height))
    place = {"ha": "left", "va": "top", "in_layout": False}
    figure.text(0.12 / width, 1 - 0.12 / height, title, fontsize=12, fontweight="bold", linespacing=1.3, **place)
    figure.text(
        0.12 / width,
        1 - title_bottom / height,
        subtitle,
        fontsize=SUBTITLE_POINTS,
        color=QUIET,
        linespacing=1.4,
        **place,
    )
    return figure


def make_panels(count: int, cell: tuple[float, float], title: str, subtitle: str, ax: Axes | None, **options):
    """Return (figure, panels): a figure with `count` panels as they fit the sheet best.

    Args:
        count: number of panels.
        cell: width and height of a panel, inches.
        title: of the figure.
        subtitle: of the figure.
        ax: as of `make_figure`.
        options: `margins` of `arrange_panels`, and options of Matplotlib's `subplots`.
    """
    rows, columns, size = arrange_panels(count, cell, options.pop("margins", PANEL_MARGINS))
    figure = make_figure(*size, title, subtitle, ax=ax)
    panels = figure.subplots(rows, columns, squeeze=False, **options).ravel()
    for empty_panel in panels[count:]:
        empty_panel.set_axis_off()
    return figure, panels[:count]


def wrap_text(text: str, width: float, letters: float = SUBTITLE_LETTERS) -> str:
    """Return text broken into lines for a figure, never within `name = value`.

    Args:
        text: its line breaks are kept.
        width: of the figure, inches.
        letters: average number of letters per inch.
    """
    max_letters = int((width - 0.24) * letters)
    unbroken = VALUE.sub(lambda value: value[0].replace(" ", "\u00a0"), text)  # textwrap does not break lines there
    lines = (textwrap.wrap(line, max_letters) or [""] for line in unbroken.split("\n"))
    return "\n".join(line for paragraph in lines for line in paragraph)


def draw_legend(figure: Figure | BorrowedAxes, handles: Sequence[Artist] = ()) -> None:
    """Draw a legend below a figure's panels, with each label once in order of drawing, in as few rows as fit.

    Artists are large and strong enough to be visible in it; labels of an Axes with its own legend are left out. A
    user's figure has no legend: its Axes have the labels, and `ax.legend()` draws one.

    Args:
        figure: with all its panels.
        handles: additional entries, after the artists of the panels.
    """
    entries: dict[str, Artist] = {}
    open_panels = [ax for ax in figure.axes if ax.get_legend() is None]
    for artist in (artist for ax in open_panels for artist in (*ax.lines, *ax.collections, *ax.patches)):
        if (label := artist.get_label()) and not str(label).startswith("_"):
            entries.setdefault(str(label), artist)
    entries |= {str(handle.get_label()): handle for handle in handles}
    if isinstance(figure, BorrowedAxes) or not entries:
        return
    sizes = [TextPath((0, 0), label, LEGEND_POINTS).get_extents().width + 4.2 * LEGEND_POINTS for label in entries]
    available = 72 * (figure.get_size_inches()[0] - 0.2)
    row_widths = {n: sum(map(max, np.array_split(sizes, n))) for n in range(len(sizes), 0, -1)}  # columns → points
    columns = next((n for n, row_width in row_widths.items() if row_width <= available), 1)
    style = {"handlelength": 1.8, "columnspacing": 1.5, "handletextpad": 0.6, "borderaxespad": 0.8}
    size = LEGEND_POINTS * min(1.0, available / row_widths[columns])
    samples = [_legend_sample(artist) for artist in entries.values()]
    figure.legend(handles=samples, ncols=columns, fontsize=size, loc="outside lower left", **style)


def _legend_sample(artist: Artist) -> Artist:
    """Return an artist, or a copy of a line that is visible in a legend."""
    if not isinstance(artist, Line2D):
        return artist
    sample = copy(artist)
    sample.set(alpha=max(artist.get_alpha() or 1.0, 0.9), path_effects=[])
    sample.set_markersize(max(artist.get_markersize(), 4.0))
    return sample
