"""Animations as films, MP4 and WebM, where ffmpeg is at hand."""

import shutil
import subprocess
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from sweeps.schema.refusals import RefusedError

# even numbers of pixels and this order of colours are what every player shows; three times round
EVEN = ("-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-pix_fmt", "yuv420p")
KINDS = {
    "mp4": (*EVEN, "-movflags", "+faststart"),
    "webm": (*EVEN, "-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "33", "-deadline", "realtime", "-cpu-used", "6"),
}


def encoder() -> str | None:
    """Return the path of ffmpeg, None where it is not installed."""
    return shutil.which("ffmpeg")


def refuse_unless_made(kind: str, animations: Collection[str]) -> None:
    """Refuse to make a film with one message where it cannot be made.

    Raises:
        RefusedError: for a map without animations, and where ffmpeg is not at hand.
    """
    if not animations:
        raise RefusedError(f"--format: {kind} is for animations, and this map has none; allowed: png, svg, pdf")
    if encoder() is None:
        allowed = "gif (written with any other format), or a machine with ffmpeg"
        raise RefusedError(f"--format: {kind} needs ffmpeg, which was not found; allowed: {allowed}")


def made(animation: Path, kinds: Sequence[str] = tuple(KINDS)) -> Iterator[Path]:
    """Write the film of a GIF in each format that the installed ffmpeg can write, and yield the paths."""
    called = encoder()
    for kind in kinds if called else ():
        film = animation.with_suffix(f".{kind}")
        command = [called, "-nostdin", "-v", "error", "-y", "-stream_loop", "2", "-i", str(animation)]
        command += [*KINDS[kind], str(film)]
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=False)
        if done.returncode == 0 and film.is_file() and film.stat().st_size:
            yield film
        else:
            film.unlink(missing_ok=True)  # an ffmpeg without this codec: the GIF is there
