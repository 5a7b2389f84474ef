"""Animations read back by Pillow as they were drawn, and numbers along axes as text."""

import numpy as np
import pytest
from PIL import Image, ImageSequence

from sweeps import style
from sweeps.boxes import changed
from sweeps.views import gif

MILLISECONDS = 60


def drawn(colors: int, mode: str = "P") -> list[Image.Image]:
    """Frames whose changes are a box that moves; the third is the second again."""
    rng = np.random.default_rng(7)
    palette = rng.integers(0, 256, 3 * colors, dtype=np.uint8).tobytes()
    frame = rng.integers(0, colors, (20, 30), dtype=np.uint8)
    frame.flat[:colors] = np.arange(colors)
    frames = []
    for k in range(4):
        frame = frame.copy()
        if k != 2:
            frame[3 + k : 9 + k, 5 + 2 * k : 11] = rng.integers(0, colors, (6, 6 - 2 * k))
        frames.append(Image.fromarray(frame, "P"))
        frames[-1].putpalette(palette)
    return [picture.convert(mode) for picture in frames]


@pytest.mark.parametrize(("colors", "mode"), [(255, "P"), (256, "P"), (100, "P"), (12, "RGB")])
def test_an_animation_is_read_back_as_it_was_drawn(tmp_path, colors, mode):
    pictures = drawn(colors, mode)
    gif.write(pictures, tmp_path / "a.gif", MILLISECONDS)
    with Image.open(tmp_path / "a.gif") as animation:
        assert animation.info["loop"] == 0
        found = [(np.asarray(part.convert("RGB")), part.info["duration"]) for part in ImageSequence.Iterator(animation)]
    assert sum(duration for _, duration in found) == len(pictures) * MILLISECONDS
    if mode == "P":  # Pillow makes one frame of two equal ones, and takes colours of its own for RGB
        assert len(found) == len(pictures)
        for (pixels, _), picture in zip(found, pictures, strict=True):
            np.testing.assert_array_equal(pixels, np.asarray(picture.convert("RGB")))


def test_what_changes_between_two_planes():
    before = np.zeros((5, 7), int)
    after = before.copy()
    after[1, 2] = after[3, 4] = 1
    assert changed(None, after) == (slice(0, 5), slice(0, 7))
    assert changed(before, after) == (slice(1, 4), slice(2, 5))
    assert changed(after, after) == (slice(0, 1), slice(0, 1))


@pytest.mark.parametrize(
    ("formula", "text"),
    [
        (r"$\mathdefault{0.012}$", "0.012"),
        (r"$\mathdefault{−0.5}$", "−0.5"),
        (r"$\mathdefault{10^{-13}}$", "10⁻¹³"),
        (r"$\mathdefault{-10^{2}}$", "−10²"),
        (r"$\mathdefault{2\times10^{-3}}$", "2×10⁻³"),
        ("$10^{-16}$", "10⁻¹⁶"),
        ("$I_1$", "$I_1$"),
        ("0", "0"),
    ],
)
def test_numbers_along_axes_are_text(formula, text):
    assert style.in_text(formula) == text
