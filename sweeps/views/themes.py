"""Themes: a finished picture in other colours, for a dark room or a printer without colours.

Pictures are drawn in the light theme; a theme is what each of its colours becomes. What a picture says by colour it
says in the dark theme by the same hues, lighter; for print by how dark it is, so that a copy in grey still says it.
"""

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import Collection
from matplotlib.colors import Colormap, LinearSegmentedColormap, ListedColormap, to_hex, to_rgba
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Annotation, Text

from sweeps.figure import colors, style

PAPER, INK = "#ffffff", "#000000"
DARK = {  # colour of the light theme → of this one
    PAPER: "#15181c",
    INK: "#f2f2f2",
    colors.INK: "#ececec",
    colors.QUIET: "#a3a9b1",
    colors.FAINT: "#3a4048",
    colors.STABLE: "#55a8df",
    colors.UNSTABLE: "#ff8a3d",
    colors.LIGHT_BLUE: "#b4e4fb",
    "#009e73": "#34c79c",
    "#cc79a7": "#e3a3c6",
    "#333333": "#d5d5d5",
    "#f3f4f6": "#22262c",
    "#f7f7f7": "#f7f7f7",  # zero of the maps' colours, which stay
    "#55585c": "#b9bdc3",
    "#e6e6e6": "#3a4048",
}
PRINT = {
    colors.STABLE: "#4f9fd0",
    colors.UNSTABLE: "#7c2d00",
    colors.LIGHT_BLUE: "#b5def5",
    "#009e73": "#4db391",
    "#cc79a7": "#dca6c4",
    "#e69f00": "#f0c24b",
    colors.GREY: "#6d7074",
}
THEMES: dict[str, Mapping[str, str]] = {"light": {}, "dark": DARK, "print": PRINT}
# growth dark, oscillation light, zero between: one way only from black to white
ONE_WAY = LinearSegmentedColormap.from_list(
    "print", ["#4d0011", "#a3192b", "#d6604d", "#eb9a7c", "#f4c3a2", "#d3dde3", "#cfe8f5", "#e4f3fa", "#f7fcff"]
)
DIMMED = 0.3  # of shaded surfaces, on which curves of the dark theme are pale
MOST_NAMED = 64  # colours of a map that stand for kinds; of more, for numbers
BOTH_WAYS = ("RdBu", "coolwarm")  # maps of colours that are dark at both ends


def apply(figure: Figure, theme: str) -> None:
    """Apply the colours of a theme to a figure and everything in it."""
    table = THEMES[theme]
    for draw in getattr(figure, "on_paper", ()) if theme == "print" else ():
        draw()
    if table:
        artists = [figure, *figure.findobj(include_self=False)]
        arrows = [one.arrow_patch for one in artists if isinstance(one, Annotation) and one.arrow_patch]
        recolor([*artists, *arrows], table, theme == "print")
    for image in figure.findobj(AxesImage) if theme == "dark" else ():
        if image.get_array().ndim == 3:  # colours, and not numbers
            image.set_data(image.get_array() * [DIMMED, DIMMED, DIMMED, 1.0])


def recolor(artists: Iterable, table: Mapping[str, str], one_way: bool = False) -> None:
    """Replace the colours of artists by a table of colours.

    Args:
        artists: of matplotlib.
        table: "#rrggbb" → "#rrggbb".
        one_way: whether maps of colours that are dark at both ends become one that goes one way.
    """

    def other(color):
        return _other(color, table)

    for artist in artists:
        if isinstance(artist, ScalarMappable):
            with artist.callbacks.blocked():  # a colour bar would begin anew, with ticks of its own
                artist.set_cmap(_recolored(artist.get_cmap(), other, one_way))
        for kind, names in PARTS:
            if isinstance(artist, kind):
                _each(artist, names, other)
        for effect in artist.get_path_effects() or ():
            gc = getattr(effect, "_gc", {})
            if "foreground" in gc:
                gc["foreground"] = other(gc["foreground"])


PARTS = (
    (Line2D, ("color", "markerfacecolor", "markeredgecolor")),
    (Text, ("color",)),
    (Patch, ("edgecolor", "facecolor")),
    (Collection, ("edgecolor", "facecolor")),
    (Figure, ("facecolor",)),
)


def _each(artist, names: Iterable[str], other: Callable) -> None:
    for name in names:
        now = getattr(artist, f"get_{name}")()
        if isinstance(now, str) and now in ("none", "face", "auto"):
            continue
        if isinstance(artist, Patch) and to_rgba(now)[3] == 0.0:  # an edge that is not drawn
            continue
        many = isinstance(now, np.ndarray) and now.ndim == 2
        if isinstance(artist, Collection) and (artist.get_array() is not None or not many or len(now) > 64):
            continue
        changed = [other(one) for one in now] if many else other(now)
        if many and not len(now):
            continue
        getattr(artist, f"set_{name}")(changed)


def _other(color, table: Mapping[str, str]):
    """Return the theme's colour in place of a colour, its transparency kept."""
    red, green, blue, alpha = to_rgba(color)
    other = table.get(to_hex((red, green, blue)))
    return (red, green, blue, alpha) if other is None else (*to_rgba(other)[:3], alpha)


def _recolored(colormap: Colormap, other: Callable, one_way: bool) -> Colormap:
    """Return a colour map in a theme: of a few named ones each colour, of others the colour of missing values."""
    made = in_one_way(colormap) if one_way else colormap
    if isinstance(made, style.Shades):
        return made.recolored(other)
    bad = tuple(made.get_bad())
    if isinstance(made, ListedColormap) and made.N <= MOST_NAMED:
        made = ListedColormap([other(color) for color in made.colors], made.name)
    return made.with_extremes(bad=other(bad))


def in_one_way(colormap: Colormap) -> Colormap:
    """Return a colour map that is dark at both ends as one that goes from dark to light; others as they are."""
    if colormap.name not in BOTH_WAYS:
        return colormap
    made = ONE_WAY.reversed() if colormap.name == "coolwarm" else ONE_WAY
    return made.with_extremes(bad=tuple(colormap.get_bad()))
