"""Animations as files: GIF, and (if ffmpeg is installed) MP4 and WebM."""

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

PALETTE_FRAMES = 12  # frames from which the 256 colours of a GIF are computed, evenly spaced
KINDS = {  # even numbers of pixels, 16:9, and this order of colours suit every player
    "mp4": ("-pix_fmt", "yuv420p", "-movflags", "+faststart"),
    "webm": ("-pix_fmt", "yuv420p", "-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "33", "-deadline", "realtime"),
}


def ffmpeg_path() -> str | None:
    """Return the path of ffmpeg, None if it is not installed."""
    return shutil.which("ffmpeg")


@contextmanager
def use_film_of(path: str | Path) -> Iterator[None]:
    """Draw the animations of a `with` block for a file: as a film of 1920 x 1080 pixels, or as a GIF."""
    token = sheets.current_film.set(sheets.HD if Path(path).suffix[1:] in KINDS else sheets.GIF)
    try:
        yield
    finally:
        sheets.current_film.reset(token)


def require_encoder(kind: str, animations: Collection[str]) -> None:
    """Refuse to make a film of some kind if the map has no animations or ffmpeg is not installed."""
    if not animations:
        raise RefusedError(f"--format: {kind} is for animations, and this map has none; allowed: png, svg, pdf")
    if ffmpeg_path() is None:
        allowed = "gif (written with any other format), or a machine with ffmpeg"
        raise RefusedError(f"--format: {kind} needs ffmpeg, which was not found; allowed: {allowed}")


def write_frames(frames: Iterable[np.ndarray], path: str | Path) -> bool:
    """Write frames to a file, complete or not at all, in the format of its suffix. Return False without frames."""
    frames = iter(frames)
    first = next(frames, None)
    if first is None:
        return False
    kind = Path(path).suffix[1:]
    with replace_output(path) as temporary:
        (_write_film if kind in KINDS else _write_gif)(chain([first], frames), temporary, kind)
    return True


def _write_gif(frames: Iterable[np.ndarray], path: Path, kind: str) -> None:
    first, *later_images = _quantize_colors(list(frames))
    duration = 1000 / sheets.GIF.rate
    first.save(path, format="GIF", save_all=True, append_images=later_images, duration=duration, loop=0)


def _write_film(frames: Iterable[np.ndarray], path: Path, kind: str) -> None:
    """Write frames by ffmpeg, each in the middle of a frame of 16:9 that has the colour of its corner."""
    frames = iter(frames)
    first = next(frames)
    height, width = first.shape[:2]
    paper = "#{:02x}{:02x}{:02x}".format(*first[0, 0, :3])
    padded_width, padded_height = (
        2 * math.ceil(n / 2) for n in (max(width, height * 16 / 9), max(height, width * 9 / 16))
    )
    pad = f"pad={padded_width}:{padded_height}:(ow-iw)/2:(oh-ih)/2:color={paper}"
    command = [ffmpeg_path(), "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgba", "-s", f"{width}x{height}"]
    command += ["-r", f"{sheets.HD.rate:g}", "-i", "-", "-vf", pad, *KINDS[kind], "-f", kind, str(path)]
    with tempfile.TemporaryFile() as messages:
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=messages, stderr=messages) as process:
            try:
                for frame in chain([first], frames):
                    process.stdin.write(np.ascontiguousarray(frame))
            except BrokenPipeError:  # ffmpeg has ended; its messages have the reason
                pass
            finally:
                process.stdin.close()
        if process.returncode or not path.stat().st_size:
            raise RefusedError(f"{kind}: cannot be written by the installed ffmpeg; allowed: gif, or an ffmpeg with it")


def _quantize_colors(images: list[np.ndarray]) -> list[Image.Image]:
    """Return opaque pictures, shape (height, width, 4), in the same 256 colours."""
    sample = np.concatenate([image[::2, ::2, :3] for image in images[:: max(1, len(images) // PALETTE_FRAMES)]])
    palette = Image.fromarray(sample).quantize(256)
    opaque = (Image.fromarray(np.ascontiguousarray(image[..., :3])) for image in images)
    return [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in opaque]
