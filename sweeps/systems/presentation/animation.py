"""Common parts of animations: an empty figure with a title, a view of space, and frames over a fixed background."""

from collections.abc import Iterable, Iterator
from typing import cast

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sweeps.figure import colors, sheets, wording
from sweeps.figure.canvas import SUBTITLE_LETTERS, SUBTITLE_POINTS, wrap_text

FILM_SECONDS = (6.0, 20.0)  # bounds on a film's length; motions that take as long are shown in real time


def empty_stage(inches: tuple[float, float], dots: int, title: str, words: str, sizes=(11.0, 7.0)) -> Figure:
    """Return an empty figure with a title and a text below it.

    Args:
        inches: width and height.
        dots: pixels per inch of a GIF.
        title: title.
        words: text below the title, broken into lines.
        sizes: font sizes of title and line, points.
    """
    figure = Figure(figsize=inches, dpi=sheets.current_film.get().dpi(inches, dots), facecolor=colors.PAPER)
    FigureCanvasAgg(figure)
    top = 1.0 - 0.17 / inches[1]
    figure.text(0.03, top, title, fontsize=sizes[0], fontweight="bold", va="top", parse_math=False)
    lines = wrap_text(words, inches[0], SUBTITLE_LETTERS * SUBTITLE_POINTS / sizes[1])
    figure.text(0.03, top - 0.021 * sizes[0] / inches[1], lines, fontsize=sizes[1], color=colors.QUIET, va="top")
    return figure


def draw_frames(figure: Figure, frames: Iterable[Iterable[Artist]]) -> Iterator[np.ndarray]:
    """Yield pictures, shape (height, width, 4): the artists of each frame over the background, which is drawn once."""
    canvas = cast(FigureCanvasAgg, figure.canvas)
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)
    for artists in frames:
        canvas.restore_region(background)
        for artist in artists:
            artist.axes.draw_artist(artist)
        yield np.array(canvas.buffer_rgba())


def frame_times(duration: float) -> tuple[np.ndarray, str]:
    """Return times, s, of the frames of a motion, and its pace in words: real time if it takes 6 to 20 s."""
    seconds = min(max(duration, FILM_SECONDS[0]), FILM_SECONDS[1])
    times, speed = np.linspace(0.0, duration, round(seconds * sheets.current_film.get().rate) + 1), duration / seconds
    if 0.99 < speed < 1.01:
        return times, "real time"
    return times, f"{wording.format_number(max(speed, 1 / speed), 2)} times {'faster' if speed > 1 else 'slower'}"


def format_parameters(system, values) -> list[str]:
    """Return name, value and unit of each parameter of a described system, as text; `values` are by name."""
    parameters = [(p.name, float(values[p.name]), p.unit) for p in system.parameters.values()]
    return [
        wording.with_unit(f"{name.replace('_', ' ')} {wording.format_number(value, 3)}", unit)
        for name, value, unit in parameters
    ]


def screen_axes(towards: np.ndarray) -> np.ndarray:
    """Return the unit vectors to the right and upwards of a viewer in direction `towards`, as columns, shape (3, 2)."""
    towards = towards / np.linalg.norm(towards)
    right = np.array([-towards[1], towards[0], 0.0]) / np.hypot(*towards[:2])
    return np.stack([right, np.cross(towards, right)], axis=1)
