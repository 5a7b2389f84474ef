"""No text of a picture lies on another, on the widest sheet and the narrowest: boxes of text as they are drawn."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.text import Text
from report_pages import SHIPPED

import sweeps
from sweeps.figure import sheets
from sweeps.handbook import gallery
from sweeps.points import catalogue
from sweeps.reading.definitions import file_text, plain, read_text
from sweeps.views import figures

SLACK = 3.0  # pixels of 200 an inch: a box is as high as its tallest letter, whether the text has it or not


def texts(figure, monkeypatch):
    """Return text and box of each text of a figure, laid out."""
    artists, draw = [], Text.draw
    monkeypatch.setattr(Text, "draw", lambda self, renderer: (artists.append(self), draw(self, renderer))[1])
    figure.canvas.draw()
    monkeypatch.undo()
    upright = [text for text in dict.fromkeys(artists) if text.get_visible() and text.get_rotation() % 90 == 0]
    boxes = [(text.get_text(), Text.get_window_extent(text, figure.canvas.get_renderer())) for text in upright]
    return [(words, box) for words, box in boxes if words.strip() and np.isfinite(box.extents).all()]


def faults(figure, monkeypatch):
    """Return texts that overlap or leave the sheet; numerals in marks may do so."""
    boxes = [box_a for box_a in texts(figure, monkeypatch) if box_a[0] not in ("1", "2", "3")]
    width, height = figure.bbox.size
    for words, box in boxes:
        if min(box.x0, box.y0, width - box.x1, height - box.y1) < -SLACK:
            yield words, "beyond the sheet"
    for (words, box_a), (words_b, box_b) in combinations(boxes, 2):
        across, along = np.minimum(box_a.max, box_b.max) - np.maximum(box_a.min, box_b.min)
        if min(across, along) > SLACK:
            yield words, words_b


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", SHIPPED)
def test_no_text_of_a_picture_lies_on_another(name, monkeypatch):
    monkeypatch.setattr(gallery, "MAX_CHEAP_POINTS", {})
    values = gallery.reduce_points(plain(read_text(file_text(catalogue.shipped_files()[name]))))
    ds = figures.escape_dollars(sweeps.survey(values))
    for size in ("slide", "column"):  # the widest and the narrowest figure
        for picture, draw in figures.pictures(ds).items():
            with sheets.use_sheet(sheets.SHEETS[size]), np.errstate(all="ignore"):
                if figure := draw():
                    assert not list(faults(figure, monkeypatch)), (picture, size)
