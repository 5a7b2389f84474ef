"""Pictures of a map, as PNG files: what a map shows at a glance, how far it agrees with theory, where theory ends."""

from collections.abc import Callable, Iterator
from pathlib import Path

import matplotlib
import xarray as xr
from matplotlib.figure import Figure

from sweeps import systems
from sweeps.figure_style import STYLE
from sweeps.storage import replaced
from sweeps.systems import oscillator


def pictures(ds: xr.Dataset) -> dict[str, Callable[[], Figure | None]]:
    """Name of each picture of a map → what draws it (None where there is nothing to show).

    Args:
        ds: a map, from `sweeps.open_map` or `sweeps.survey`.
    """
    name = ds.attrs.get("system", systems.DEFAULT)
    if systems.is_file(name):  # not run: a map is all that its pictures need
        return oscillator.pictures(ds)
    return systems.resolve(name).pictures(ds)


def draw_all(ds: xr.Dataset, folder: str | Path) -> Iterator[Path]:
    """Draws the pictures of a map; reads only what they show, so a map larger than memory will do.

    Args:
        ds: a map, from `sweeps.open_map` or `sweeps.survey`.
        folder: where the PNG files go; it is made where it is missing, and files of the same name are replaced.

    Yields:
        The path of each file once it is written.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in pictures(ds).items():
        path = folder / f"{name}.png"
        if _write(draw, path):
            yield path


def _write(draw: Callable[[], Figure | None], path: Path) -> bool:
    with matplotlib.rc_context(STYLE):
        figure = draw()
        if figure is None:
            return False
        with replaced(path) as temporary:
            figure.savefig(temporary, format="png")
    return True
