"""Pictures of a map: what it shows at a glance, how far it agrees with theory, where theory ends, and the flip."""

import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from PIL import Image

from sweeps import systems
from sweeps.files import replaced, replaced_folder
from sweeps.style import STYLE

FRAME_MILLISECONDS = 60


def pictures(ds: xr.Dataset) -> dict[str, Callable[[], Figure | None]]:
    """Name of each picture of a map → what draws it (None where there is nothing to show).

    Args:
        ds: a map, from `sweeps.open_map` or `sweeps.survey`.
    """
    return {name: _without(ds, draw, None) for name, draw in systems.of_map(ds).pictures(ds).items()}


def animations(ds: xr.Dataset) -> dict[str, Callable[[], list[Image.Image]]]:
    """Name of each animation of a map → what draws its frames (none where there is nothing to show)."""
    return {name: _without(ds, frames, []) for name, frames in systems.of_map(ds).animations(ds).items()}


def _without(ds: xr.Dataset, draw: Callable, nothing: list | None) -> Callable:
    """What draws, or nothing where it shows a variable that the map's definition has left out."""

    def drawn():
        try:
            return draw()
        except KeyError as missing:
            left_out = set(systems.of_map(ds).layout().variables) - set(ds.variables)
            if any(repr(name) in str(missing) for name in left_out):
                return nothing
            raise

    return drawn


def draw_all(ds: xr.Dataset, folder: str | Path) -> Iterator[Path]:
    """Draws the pictures of a map as PNG, and its animations as GIF.

    Reads only what they show, so a map larger than memory will do.

    Args:
        ds: a map, from `sweeps.open_map` or `sweeps.survey`.
        folder: where the files go; it is made where it is missing, and files of the same name are replaced.

    Yields:
        The path of each file, once all are written.
    """
    folder, ds = Path(folder), _literal(ds)
    with replaced_folder(folder) as temporary:
        drawn = [f"{name}.png" for name, draw in pictures(ds).items() if _write(draw, temporary / f"{name}.png")]
        moving = [f"{n}.gif" for n, frames in animations(ds).items() if _animate(frames, temporary / f"{n}.gif")]
    yield from (folder / name for name in drawn + moving)


def _literal(ds: xr.Dataset) -> xr.Dataset:
    """The map with text that matplotlib draws as it stands: a dollar sign begins no formula."""
    names = {name: c.copy(data=[_plain(v) for v in c.values]) for name, c in ds.coords.items() if _is_named(c)}
    ds = ds.assign_coords(names).assign_attrs(title=_plain(ds.attrs.get("title", "")))
    for variable in ds.variables.values():
        variable.attrs = {key: _plain(value) for key, value in variable.attrs.items()}
    return ds


def _is_named(coordinate: xr.DataArray) -> bool:
    return coordinate.dtype.kind in "OU" and coordinate.ndim == 1 and any("$" in str(v) for v in coordinate.values)


def _plain(value: object) -> object:
    return value.replace("$", r"\$") if isinstance(value, str) else value


def _animate(frames: Callable[[], list[Image.Image]], path: Path) -> bool:
    with matplotlib.rc_context(STYLE), np.errstate(all="ignore"):
        pictures = frames()
    if not pictures:
        return False
    with replaced(path) as temporary:
        first, *others = pictures
        first.save(temporary, format="GIF", save_all=True, append_images=others, duration=FRAME_MILLISECONDS, loop=0)
    return True


def _write(draw: Callable[[], Figure | None], path: Path) -> bool:
    with matplotlib.rc_context(STYLE), warnings.catch_warnings(), np.errstate(all="ignore"):  # of numbers of any size
        # matplotlib's remarks on names in scripts that its font lacks, on axes without room, on limits without extent
        warnings.simplefilter("ignore", UserWarning)
        figure = draw()
        if figure is None:
            return False
        with replaced(path) as temporary:
            figure.savefig(temporary, format="png")
    return True
