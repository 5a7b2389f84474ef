"""Texts and legends of pictures, on the widest sheet and the narrowest, as they are drawn.

No text lies on another, and each entry of a legend has its colour in a panel.
"""

import contextlib
from itertools import combinations

import numpy as np
import pytest
from matplotlib.colors import to_rgba_array
from matplotlib.text import Text
from report_pages import DRAWN

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


def color_of(handle):
    """Return the colour of a legend's entry, shape (3,), 0 to 255; None for a hatch or an outline alone."""
    for name in ("get_facecolor", "get_markerfacecolor", "get_markeredgecolor", "get_color", "get_edgecolor"):
        with contextlib.suppress(AttributeError, ValueError, IndexError):
            *rgb, alpha = np.asarray(to_rgba_array(getattr(handle, name)()))[0]
            if alpha > 0.0 and min(rgb) < 1.0:  # a hollow mark has the paper's colour inside
                return None if getattr(handle, "get_hatch", lambda: None)() else 255.0 * np.array(rgb)
    return None


def undrawn_entries(figure):
    """Yield the labels of a legend whose colours are on no pixel of a panel, in any shade down to a quarter."""
    pixels = np.asarray(figure.canvas.buffer_rgba())
    height = pixels.shape[0]
    boxes = [np.rint(axes.bbox.extents).astype(int) for axes in figure.axes]
    # each pixel as one number of 32 bits, of which the different ones are found ten times faster
    panels = [pixels[height - y1 : height - y0, x0:x1].copy().view(np.uint32).ravel() for x0, y0, x1, y1 in boxes]
    towards_paper = 255.0 - np.unique(np.concatenate(panels)).view(np.uint8).reshape(-1, 4)[:, :3]
    for legend in figure.legends:
        for handle in legend.legend_handles:
            if (color := color_of(handle)) is not None:
                full = 255.0 - color
                shade = towards_paper @ full / max(full @ full, 1.0)
                is_near = np.abs(towards_paper - shade[:, None] * full).max(axis=1) < 8.0  # of 255: edges are blended
                if not (is_near & (shade > 0.25) & (shade < 1.1)).any():
                    yield handle.get_label()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", [x if x == "tumblers" else pytest.param(x, marks=pytest.mark.slow) for x in DRAWN])
def test_no_text_of_a_picture_lies_on_another_and_legends_show_what_is_drawn(name, monkeypatch):
    monkeypatch.setattr(gallery, "MAX_CHEAP_POINTS", {})
    monkeypatch.setattr(gallery, "MAX_GRID_POINTS", 400)
    values = gallery.reduce_points(plain(read_text(file_text(catalogue.shipped_files()[name]))))
    ds = figures.escape_dollars(sweeps.survey(values))
    for size in ("slide", "column"):  # the widest and the narrowest figure
        for picture, draw in figures.pictures(ds).items():
            with sheets.use_sheet(sheets.SHEETS[size]), np.errstate(all="ignore"):
                if figure := draw():
                    assert not list(faults(figure, monkeypatch)), (picture, size)
                    assert not list(undrawn_entries(figure)), (picture, size)
