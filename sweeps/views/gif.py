"""Animations as GIF: of each frame only the box that has changed, and one table of colours for all of them.

The format: https://www.w3.org/Graphics/GIF/spec-gif89a.txt
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import GifImagePlugin, Image

from sweeps.boxes import changed

COLORS = 256  # of the table, always as many
FOREVER = b"!\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"  # it begins again at its end
TABLE_OF_ALL, DEPTH = 0x80, 0x77  # flags: a table for all frames, of 8 bits a channel and 256 colours
TRAILER = b";"


def write(pictures: Sequence[Image.Image], path: Path, milliseconds: int) -> None:
    """Writes an animation, which is played again and again.

    Args:
        pictures: its frames, all of one size; those that share a table of colours are written as they are.
        path: the file.
        milliseconds: how long each frame is shown.
    """
    palette = _shared(pictures)
    if palette is None:
        first, *others = pictures
        first.save(path, format="GIF", save_all=True, append_images=others, duration=milliseconds, loop=0)
        return
    width, height = pictures[0].size
    parts = [b"GIF89a", width.to_bytes(2, "little"), height.to_bytes(2, "little"), bytes([TABLE_OF_ALL | DEPTH, 0, 0])]
    parts += [palette.ljust(3 * COLORS, b"\0"), FOREVER]
    frames = [np.asarray(picture) for picture in pictures]
    boxes = [changed(before, frame) for before, frame in zip([None, *frames], frames, strict=False)]
    free = _free(frames, boxes)
    for number, (frame, box) in enumerate(zip(frames, boxes, strict=True)):
        part, more = frame[box], {}
        if number and free is not None:  # what stays is left out: a run of one number
            part, more = np.where(part == frames[number - 1][box], np.uint8(free), part), {"transparency": free}
        place = box[1].start, box[0].start
        parts += GifImagePlugin.getdata(Image.fromarray(part), place, duration=milliseconds, **more)
    path.write_bytes(b"".join([*parts, TRAILER]))


def _free(frames: Sequence[np.ndarray], boxes: Sequence[tuple[slice, slice]]) -> int | None:
    """The number of a colour that no frame has; None where all are used."""
    used = np.zeros(COLORS, bool)
    for frame, box in zip(frames, boxes, strict=True):
        used[frame[box]] = True
    return None if used.all() else int(np.argmin(used))


def _shared(pictures: Sequence[Image.Image]) -> bytes | None:
    """The table of colours that all pictures have, red, green and blue of each; None where there is no such table."""
    palettes = {bytes(picture.getpalette()) if picture.mode == "P" else b"" for picture in pictures}
    return palettes.pop() or None if len(palettes) == 1 else None
