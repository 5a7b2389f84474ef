"""Parts of animations: a stage with its title, a view of space, and frames over what stands still."""

from collections.abc import Iterable, Iterator

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sweeps.figure import colors, sheets, wording

SHOWN_SECONDS = (6.0, 20.0)  # of a film: motions are shown in real time where they take as long


def stage(inches: tuple[float, float], dots: int, title: str, words: str, sizes=(11.0, 7.0)) -> Figure:
    """Return an empty figure with a title and a line of words; `dots` are the pixels per inch of a GIF."""
    figure = Figure(figsize=inches, dpi=sheets.current_film.get().dpi(inches, dots), facecolor=colors.PAPER)
    FigureCanvasAgg(figure)
    top = 1.0 - 0.17 / inches[1]
    figure.text(0.03, top, title, fontsize=sizes[0], fontweight="bold", va="top", parse_math=False)
    figure.text(0.03, top - 0.021 * sizes[0] / inches[1], words, fontsize=sizes[1], color=colors.QUIET, va="top")
    return figure


def played(figure: Figure, frames: Iterable[Iterable[Artist]]) -> Iterator[np.ndarray]:
    """Yield pictures, shape (height, width, 4): on what stands still, drawn once, the artists of each frame."""
    figure.canvas.draw()
    still = figure.canvas.copy_from_bbox(figure.bbox)
    for artists in frames:
        figure.canvas.restore_region(still)
        for artist in artists:
            artist.axes.draw_artist(artist)
        yield np.array(figure.canvas.buffer_rgba())


def timing(duration: float) -> tuple[np.ndarray, str]:
    """Return times, s, of the frames of a motion, and its pace in words: real time if it takes 6 to 20 s."""
    seconds = min(max(duration, SHOWN_SECONDS[0]), SHOWN_SECONDS[1])
    times, speed = np.linspace(0.0, duration, round(seconds * sheets.current_film.get().rate) + 1), duration / seconds
    if 0.99 < speed < 1.01:
        return times, "real time"
    return times, f"{wording.format_number(max(speed, 1 / speed), 2)} times {'faster' if speed > 1 else 'slower'}"


def settings(system, values) -> list[str]:
    """Return each parameter of a described system with its value, in words; values by the parameters' names."""
    given = [(p.name, float(values[p.name]), p.unit) for p in system.parameters.values()]
    return [
        wording.with_unit(f"{name.replace('_', ' ')} {wording.format_number(value, 3)}", unit)
        for name, value, unit in given
    ]


def screen(towards: np.ndarray) -> np.ndarray:
    """Return the right and the up of a viewer in a direction of space, z upright, as columns, shape (3, 2)."""
    towards = towards / np.linalg.norm(towards)
    right = np.array([-towards[1], towards[0], 0.0]) / np.hypot(*towards[:2])
    return np.stack([right, np.cross(towards, right)], axis=1)
