"""No text of a picture lies on another, on the widest sheet and the narrowest: boxes of text as they are drawn."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.text import Text

import sweeps
from sweeps.figure import style
from sweeps.points import catalogue
from sweeps.reading.definitions import file_text, plain, read_text
from sweeps.views import figures

SLACK = 3.0  # pixels of 200 an inch: a box is as high as its tallest letter, whether the text has it or not

MOST = 15  # values of a dimension


def texts(figure, monkeypatch):
    """Return text and box of what a figure draws, laid out."""
    seen, draw = [], Text.draw
    monkeypatch.setattr(Text, "draw", lambda self, renderer: (seen.append(self), draw(self, renderer))[1])
    figure.canvas.draw()
    monkeypatch.undo()
    upright = [text for text in dict.fromkeys(seen) if text.get_visible() and text.get_rotation() % 90 == 0]
    boxes = [(text.get_text(), Text.get_window_extent(text, figure.canvas.get_renderer())) for text in upright]
    return [(words, box) for words, box in boxes if words.strip() and np.isfinite(box.extents).all()]


def faults(figure, monkeypatch):
    """Return what lies on something else, or beyond the sheet; numerals in marks may, as marks do."""
    found = [one for one in texts(figure, monkeypatch) if one[0] not in ("1", "2", "3")]
    width, height = figure.bbox.size
    for words, box in found:
        if min(box.x0, box.y0, width - box.x1, height - box.y1) < -SLACK:
            yield words, "beyond the sheet"
    for (words, one), (others, other) in combinations(found, 2):
        across, along = np.minimum(one.max, other.max) - np.maximum(one.min, other.min)
        if min(across, along) > SLACK:
            yield words, others


def few_points(name):
    """Return a shipped definition with at most so many values a dimension, bodies and draws."""
    definition = plain(read_text(file_text(catalogue.shipped()[name])))
    grid = definition.get("grid", {})
    for key, value in grid.items():
        if isinstance(value, list):
            grid[key] = value[:6]
        for axis in (value, *value.values()) if isinstance(value, dict) else ():
            if isinstance(axis, dict) and "num" in axis:
                axis["num"] = min(axis["num"], MOST)
    if isinstance(definition.get("bodies"), list):
        definition["bodies"] = definition["bodies"][:8]
    return definition | ({"draws": min(definition["draws"], 512)} if "draws" in definition else {})


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", catalogue.shipped())
def test_no_text_of_a_picture_lies_on_another(name, monkeypatch):
    ds = figures.literal(sweeps.survey(few_points(name)))
    for size in ("slide", "column"):  # what is widest and what is narrowest
        for picture, draw in figures.pictures(ds).items():
            with style.drawn_for(style.SHEETS[size]), np.errstate(all="ignore"):
                if figure := draw():
                    assert not list(faults(figure, monkeypatch)), (picture, size)
