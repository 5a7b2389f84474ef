"""Colours of figures, terminal and report: their names, and the colour of each name in each theme.

Figures are drawn with the names, which Matplotlib can resolve (see `sweeps.figure.sheets.use_sheet`); terminal and
report have the colours of the light theme. In the dark theme hues are the same and lighter; in print regimes differ by
how dark they are, so that a copy in grey still distinguishes them.
"""

from collections.abc import Mapping

PAPER, BLACK, INK, QUIET, FAINT = (f"polhode:{name}" for name in ("paper", "black", "ink", "quiet", "faint"))
STABLE, UNSTABLE, LIGHT_BLUE = (f"polhode:{name}" for name in ("stable", "unstable", "light blue"))
GREEN, PURPLE, ORANGE, CHARCOAL = (f"polhode:{name}" for name in ("green", "purple", "orange", "charcoal"))
GREY, LIGHT_GREY, OUTLINE, BAND, MISSING = (
    f"polhode:{name}" for name in ("grey", "light grey", "outline", "band", "missing")
)
SERIES_COLORS = (STABLE, UNSTABLE, GREEN, PURPLE, ORANGE, LIGHT_BLUE, CHARCOAL)

LIGHT = {
    PAPER: "#ffffff",
    BLACK: "#000000",
    INK: "#1a1a1a",
    QUIET: "#5f6368",
    FAINT: "#c9ccd1",
    # Okabe and Ito (2008), "Color universal design": apart for every kind of colour vision
    STABLE: "#0072b2",
    UNSTABLE: "#d55e00",
    LIGHT_BLUE: "#56b4e9",
    GREEN: "#009e73",
    PURPLE: "#cc79a7",
    ORANGE: "#e69f00",
    CHARCOAL: "#333333",
    GREY: "#8a8d91",
    LIGHT_GREY: "#bdbdbd",
    OUTLINE: "#55585c",  # outline of the region of physically impossible bodies
    BAND: "#f3f4f6",  # shaded range behind curves
    MISSING: "#e6e6e6",  # cells without a value
}
DARK = LIGHT | {
    PAPER: "#15181c",
    BLACK: "#f2f2f2",
    INK: "#ececec",
    QUIET: "#a3a9b1",
    FAINT: "#3a4048",
    STABLE: "#55a8df",
    UNSTABLE: "#ff8a3d",
    LIGHT_BLUE: "#b4e4fb",
    GREEN: "#34c79c",
    PURPLE: "#e3a3c6",
    CHARCOAL: "#d5d5d5",
    OUTLINE: "#b9bdc3",
    BAND: "#22262c",
    MISSING: "#3a4048",
}
PRINT = LIGHT | {
    STABLE: "#4f9fd0",
    UNSTABLE: "#7c2d00",
    LIGHT_BLUE: "#b5def5",
    GREEN: "#4db391",
    PURPLE: "#dca6c4",
    ORANGE: "#f0c24b",
    GREY: "#6d7074",
}
THEMES: Mapping[str, Mapping[str, str]] = {"light": LIGHT, "dark": DARK, "print": PRINT}


def in_light(color: str) -> str:
    """Return a colour, given by its name or as "#rrggbb", as "#rrggbb" of the light theme; "" for none."""
    return LIGHT.get(color, color)
