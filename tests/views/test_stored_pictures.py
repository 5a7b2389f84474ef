"""Pictures against stored pictures, which a person has checked: a changed picture must be checked again.

`POLHODE_PICTURES=write pytest tests/views/test_stored_pictures.py -m slow` stores them anew.
"""

import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import sweeps
from sweeps.figure import sheets
from sweeps.views import figures

STORED = Path(__file__).parent / "pictures"
DOTS = 45  # an inch
TOPS = {
    "system": "symmetric_top",
    "grid": {
        "ratio": {"start": 0.2, "stop": 2.2, "num": 11},
        "omega3": 1.0,
        "half_angle": {"start": 10, "stop": 70, "num": 4},
    },
}
DRAWN = [
    ("tiny", "stability_axis_1", "light"),
    ("tiny", "stability_axis_2", "dark"),
    ("tiny", "stability_axis_3", "print"),
    ("tiny", "polhodes", "light"),
    ("tops", "precession", "light"),
    ("tops", "cones", "light"),
]


maps = pytest.fixture(lambda: {"tiny": sweeps.survey("tiny"), "tops": sweeps.survey(TOPS)}, scope="module")


@pytest.mark.slow
@pytest.mark.parametrize(("of", "name", "theme"), DRAWN)
def test_it_looks_as_it_did(maps, of, name, theme, tmp_path, monkeypatch):
    """Fonts and versions of Matplotlib move edges by a pixel: few pixels differ much, and all differ little."""
    monkeypatch.setitem(sheets.STYLE, "savefig.dpi", DOTS)
    (path,) = figures.draw_all(maps[of], tmp_path, only=[name], theme=theme)
    stored_path = STORED / f"{of}-{name}-{theme}.png"
    picture = Image.open(path).convert("RGB")
    if os.environ.get("POLHODE_PICTURES") == "write":
        STORED.mkdir(exist_ok=True)
        picture.quantize(64).save(stored_path, optimize=True)
    expected = Image.open(stored_path).convert("RGB")
    assert expected.size == picture.size
    difference = np.abs(np.asarray(picture, float) - np.asarray(expected, float)).max(axis=-1)
    assert difference.mean() < 6.0
    assert (difference > 60).mean() < 0.02
