"""Colours of figures, terminal and report."""

INK, QUIET, FAINT = "#1a1a1a", "#5f6368", "#c9ccd1"

# Okabe and Ito (2008), "Color universal design": apart for every kind of colour vision.
STABLE, UNSTABLE, LIGHT_BLUE = "#0072b2", "#d55e00", "#56b4e9"
GREY, LIGHT_GREY, BLACK = "#8a8d91", "#bdbdbd", "#000000"
SERIES_COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#333333")
