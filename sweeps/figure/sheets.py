"""Sheets, themes and films that figures are drawn for, and Matplotlib's settings for all figures."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, NamedTuple

import matplotlib
from matplotlib.colors import Colormap, LinearSegmentedColormap, get_named_colors_mapping
from matplotlib.figure import Figure

from sweeps.figure.colors import BLACK, INK, PAPER, QUIET, THEMES

DPI = 200  # dots per inch of a figure that is drawn for no sheet

STYLE: Any = {
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
    "pdf.fonttype": 42,  # the file contains the font
}

INCHES_PER_MM = 1.0 / 25.4
SLIDE = (338.7, 190.5)  # mm, width and height of a slide of 16:9
SLIDE_LETTER_SCALE = 4.0 / 3.0  # letters on a slide are 24 of its 1080 pixels high
MIN_LETTER_SCALE = 0.8  # letters of the text are at least 7.2 points high on the narrowest sheet
MAX_PAGE_HEIGHT = 240.0  # mm, height of a picture on a page of paper
DEFAULT_SIZE = (10.0, 8.0)  # inches in which a picture without a sheet is laid out
NARROW_WIDTH = 6.0  # inches; a narrower sheet has no room next to its panels


class Sheet(NamedTuple):
    """The paper or slide that pictures are made for."""

    width: float | None = None  #: of the paper or the slide, mm; None for the size that a picture has by itself
    height: float | None = None  #: of the same, mm; None keeps the picture's own ratio of width to height
    dpi: float | None = None  #: dots per inch of the paper, of PNG; None for `DPI`
    #: the function that creates an empty figure: matplotlib's class, or pyplot's function in a notebook.
    new_figure: Callable[..., Figure] = Figure

    @property
    def letter_scale(self) -> float:
        """Return the size of letters relative to those of a picture without a sheet."""
        if self.width is None:
            return 1.0
        slides = min(self.width / SLIDE[0], (self.height or MAX_PAGE_HEIGHT) / SLIDE[1])
        return max(MIN_LETTER_SCALE, slides * SLIDE_LETTER_SCALE)

    def layout_size(self) -> tuple[float, float]:
        """Return width and height in which a picture is laid out before letters are scaled, inches."""
        if self.width is None:
            return DEFAULT_SIZE
        height = self.height or MAX_PAGE_HEIGHT
        return self.width * INCHES_PER_MM / self.letter_scale, height * INCHES_PER_MM / self.letter_scale


class Film(NamedTuple):
    """The frame rate and the size of an animation."""

    rate: float  #: frames per second
    frame_factor: int  #: number of frames relative to a GIF of the same motion
    width: int | None  #: pixels of the frame of 16:9 that the animation fills; None for the animation's own size

    def dpi(self, size: tuple[float, float], own_dpi: int) -> float:
        """Return the pixels per inch of a picture of some size (inches) that has `own_dpi` outside of films."""
        return min(self.width / size[0], self.width * 9 / 16 / size[1]) if self.width else own_dpi


GIF, HD = Film(1000 / 60, 1, None), Film(30.0, 2, 1920)
current_film: ContextVar[Film] = ContextVar("film", default=GIF)

SHEETS = {"slide": Sheet(*SLIDE, dpi=144.0), "page": Sheet(178.0), "column": Sheet(86.0)}  # a slide: 1920 x 1080
OWN_SIZE = Sheet()  # each picture has the size that it has by itself
_sheet: ContextVar[Sheet] = ContextVar("sheet", default=OWN_SIZE)
_theme: ContextVar[str] = ContextVar("theme", default="light")

# kind of values → colour map of Matplotlib
COLOR_MAPS = {"signed": "RdBu", "logarithm": "coolwarm", "size": "cividis", "backdrop": "Greys"}
# In print, signed values from growth, dark, by zero to oscillation, light: a copy in grey still orders them.
DARK_TO_LIGHT = LinearSegmentedColormap.from_list(
    "print", ["#4d0011", "#a3192b", "#d6604d", "#eb9a7c", "#f4c3a2", "#d3dde3", "#cfe8f5", "#e4f3fa", "#f7fcff"]
)
PRINT_COLOR_MAPS = {"signed": DARK_TO_LIGHT, "logarithm": DARK_TO_LIGHT.reversed()}
DARK_SURFACE_BRIGHTNESS = 0.3  # brightness of shaded surfaces in the dark theme, on which curves are pale


def _name_colors(theme: str) -> None:
    """Give the names of Polhode's colours the values of a theme, in figures that are drawn or written from now on."""
    names = get_named_colors_mapping()
    for name, color in THEMES[theme].items():
        names[name] = color


_name_colors("light")


@contextmanager
def use_sheet(sheet: Sheet, theme: str = "light") -> Iterator[None]:
    """Draw and write the figures of a `with` block for one sheet, in Polhode's style and not in the user's."""
    sheet_token, theme_token = _sheet.set(sheet), _theme.set(theme)
    try:
        with matplotlib.rc_context():
            matplotlib.rcdefaults()
            matplotlib.rcParams.update(STYLE | ({"savefig.dpi": sheet.dpi} if sheet.dpi else {}))
            _name_colors(theme)
            yield
    finally:
        _sheet.reset(sheet_token)
        _theme.reset(theme_token)
        _name_colors(_theme.get())


def current_sheet() -> Sheet:
    """Return the sheet that figures are drawn for."""
    return _sheet.get()


def is_narrow() -> bool:
    """Return True if the sheet is as narrow as a column of a journal."""
    return _sheet.get().layout_size()[0] < NARROW_WIDTH


def is_print() -> bool:
    """Return True if figures are drawn for a printer without colours."""
    return _theme.get() == "print"


def surface_brightness() -> float:
    """Return the brightness of shaded surfaces in the theme, from 0 to 1."""
    return DARK_SURFACE_BRIGHTNESS if _theme.get() == "dark" else 1.0


def color_map(kind: str) -> Colormap:
    """Return the colours of a kind of values (`COLOR_MAPS`) in the theme."""
    print_colors = PRINT_COLOR_MAPS.get(kind) if is_print() else None
    return print_colors or matplotlib.colormaps[COLOR_MAPS[kind]]


def file_dpi() -> float:
    """Return the dots per inch of the file being written."""
    dpi = matplotlib.rcParams["savefig.dpi"]
    return DPI if dpi == "figure" else float(dpi)
