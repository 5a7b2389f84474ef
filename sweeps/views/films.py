"""Animations as files: GIF, and MP4 and WebM where ffmpeg is at hand."""

import math
import shutil
import subprocess
import tempfile
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path

import numpy as np
from PIL import Image

from sweeps.figure import sheets
from sweeps.process.files import replace_output
from sweeps.schema.refusals import RefusedError

SOME = 12  # frames from which the colours of a GIF are chosen
KINDS = {  # even numbers of pixels, 16:9, and this order of colours are what every player shows
    "mp4": ("-pix_fmt", "yuv420p", "-movflags", "+faststart"),
    "webm": ("-pix_fmt", "yuv420p", "-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "33", "-deadline", "realtime"),
}


def encoder() -> str | None:
    """Return the path of ffmpeg, None where it is not installed."""
    return shutil.which("ffmpeg")


@contextmanager
def drawn_for(path: str | Path) -> Iterator[None]:
    """Draw animations of this block for a file: a film of 1920 x 1080 pixels, or a GIF."""
    token = sheets.current_film.set(sheets.HD if Path(path).suffix[1:] in KINDS else sheets.GIF)
    try:
        yield
    finally:
        sheets.current_film.reset(token)


def refuse_unless_made(kind: str, animations: Collection[str]) -> None:
    """Refuse to make a film with one message where it cannot be made."""
    if not animations:
        raise RefusedError(f"--format: {kind} is for animations, and this map has none; allowed: png, svg, pdf")
    if encoder() is None:
        allowed = "gif (written with any other format), or a machine with ffmpeg"
        raise RefusedError(f"--format: {kind} needs ffmpeg, which was not found; allowed: {allowed}")


def write(frames: Iterable[np.ndarray], path: str | Path) -> bool:
    """Write frames as the kind of file that the suffix names, complete or not at all; False where there are none."""
    frames = iter(frames)
    first = next(frames, None)
    if first is None:
        return False
    kind = Path(path).suffix[1:]
    with replace_output(path) as temporary:
        (_film if kind in KINDS else _gif)(chain([first], frames), temporary, kind)
    return True


def _gif(frames: Iterable[np.ndarray], path: Path, kind: str) -> None:
    first, *others = _in_few_colors(list(frames))
    duration = 1000 / sheets.GIF.rate
    first.save(path, format="GIF", save_all=True, append_images=others, duration=duration, loop=0)


def _film(frames: Iterable[np.ndarray], path: Path, kind: str) -> None:
    """Feed frames to ffmpeg, on a sheet of 16:9 of the colour of their corner."""
    frames = iter(frames)
    first = next(frames)
    height, width = first.shape[:2]
    paper = "#{:02x}{:02x}{:02x}".format(*first[0, 0, :3])
    wide, high = (2 * math.ceil(n / 2) for n in (max(width, height * 16 / 9), max(height, width * 9 / 16)))
    pad = f"pad={wide}:{high}:(ow-iw)/2:(oh-ih)/2:color={paper}"
    command = [encoder(), "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgba", "-s", f"{width}x{height}"]
    command += ["-r", f"{sheets.HD.rate:g}", "-i", "-", "-vf", pad, *KINDS[kind], "-f", kind, str(path)]
    with tempfile.TemporaryFile() as said:
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=said, stderr=said) as running:
            try:
                for frame in chain([first], frames):
                    running.stdin.write(np.ascontiguousarray(frame))
            except BrokenPipeError:  # it has ended, and says why
                pass
            finally:
                running.stdin.close()
        if running.returncode or not path.stat().st_size:
            raise RefusedError(f"{kind}: cannot be written by the installed ffmpeg; allowed: gif, or an ffmpeg with it")


def _in_few_colors(images: list[np.ndarray]) -> list[Image.Image]:
    """Return opaque pictures, shape (height, width, 4), in the same 256 colours."""
    some = np.concatenate([image[::2, ::2, :3] for image in images[:: max(1, len(images) // SOME)]])
    palette = Image.fromarray(some).quantize(256)
    opaque = (Image.fromarray(np.ascontiguousarray(image[..., :3])) for image in images)
    return [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in opaque]
