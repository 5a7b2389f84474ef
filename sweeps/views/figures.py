"""Pictures of a map: what it shows at a glance, how far it agrees with theory, where theory ends, and the flip."""

import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from sweeps import systems
from sweeps.figure import sheets
from sweeps.maps import slices, storage
from sweeps.maps.summary import read_box
from sweeps.process import startup
from sweeps.process.files import replace_output
from sweeps.schema.iteration import blocks
from sweeps.schema.refusals import RefusedError, cut_text, hint
from sweeps.views import films

if TYPE_CHECKING:
    import xarray as xr

LEAST_SHARED = 4  # fewer pictures are drawn before another process is ready
MAX_TITLE = 200  # characters, as of a definition's
MOST_PARTS = 20_000  # of one artist that SVG and PDF draw each by itself
SVG_SIZE = re.compile(r' (width|height)="([\d.]+)pt"')  # of the drawing, which its viewBox is scaled to
LARGEST = 1e150  # size of numbers, and of their inverses, of which Matplotlib makes limits and ticks
BLOCK_POINTS = 2**20


def open_to_draw(path: str | Path) -> "xr.Dataset":
    """Open a map for drawing, and leave out the compiler if its figures call few kernels."""
    ds = storage.open_map(path)
    is_slice = not all(coordinate.ndim for coordinate in ds.coords.values())
    if not is_slice and not systems.presentation_of(ds).needs_compiler(ds):
        startup.leave_out_the_compiler()
    return ds


def pictures(ds: "xr.Dataset") -> dict[str, Callable[[], Figure | None]]:
    """Return name → drawing function of each figure of a map (which returns None where there is nothing to show)."""
    ds = slices.with_all_dimensions(ds)
    presentation = systems.presentation_of(ds)
    draw_of = presentation.figures_of_points if "point" in ds.dims else presentation.figures
    return {name: _without(ds, draw, None) for name, draw in draw_of(ds).items()}


def animations(ds: "xr.Dataset") -> dict[str, Callable[[], Iterator[np.ndarray]]]:
    """Return name → function that draws the frames of each animation of a map."""
    ds = slices.with_all_dimensions(ds)
    if "point" in ds.dims:  # whose motion `point` writes
        return {}
    frames_of = systems.presentation_of(ds).animations(ds)
    return {name: _without(ds, partial(_begun, frames), iter(())) for name, frames in frames_of.items()}


def _begun(frames: Callable[[], Iterator[np.ndarray]]) -> Iterator[np.ndarray]:
    """Return the frames, of which the first is drawn at once."""
    drawn = iter(frames())
    return chain(list(islice(drawn, 1)), drawn)


def _without(ds: "xr.Dataset", draw: Callable, nothing: Iterator | None) -> Callable:
    """Return a drawing function that draws nothing where it needs a variable that the map leaves out."""

    def drawn(*place):
        try:
            return draw(*place)
        except KeyError as missing:
            left_out = set(systems.of_map(ds).layout().variables) - set(ds.variables)
            if any(repr(name) in str(missing) for name in left_out):
                return nothing
            raise

    return drawn


def draw_all(
    ds: "xr.Dataset",
    folder: str | Path,
    kind: str = "png",
    only: Sequence[str] = (),
    theme: str = "light",
    sheet: sheets.Sheet = sheets.OWN_SIZE,
    submit: Callable[..., Future] | None = None,
    meanwhile: Callable[[], None] = lambda: None,
) -> Iterator[Path]:
    """Draw the pictures of a map, and its animations as GIF; or its animations alone, as films.

    Reads only what they show, so a map larger than memory will do. A worker, which is ready later, draws every third.

    Args:
        ds: a map, from `sweeps.open_map` or `sweeps.survey`.
        folder: where the files go; it is made where it is missing, and files of the same name are replaced.
        kind: "png"; "svg", its letters as curves; "pdf", its text as text; "mp4" or "webm" for the animations alone.
        only: names of pictures and animations, or how they begin; all where there is none.
        theme: of `sweeps.figure.colors.THEMES`.
        sheet: what the pictures are for.
        submit: passes the arguments of `draw_one` behind its first to a worker; see `sweeps.views.drawing`.
        meanwhile: called once the worker has been given its work, before this process draws.

    Yields:
        The path of each file, once all are written.

    Raises:
        RefusedError: for a name that no picture of this map has, and for a film where there is none to be made.
    """
    folder, ds = Path(folder), literal(ds)
    still, moving = pictures(ds), animations(ds)
    if kind in films.KINDS:
        films.refuse_unless_made(kind, moving)
        still = {}
    names = _named([*still, *moving], only)
    with replace_output(folder, is_folder=True) as temporary:
        how = (temporary, kind, theme, sheet)
        given = names[::-3] if submit and len(names) >= LEAST_SHARED else []  # animations, the last, take longest
        futures = {name: submit(name, *how) for name in given}
        meanwhile()
        files = {name: draw_one(ds, name, *how) for name in names if name not in given}
        files |= {name: future.result() for name, future in futures.items()}
    yield from (folder / file for name in names for file in files[name])


def draw_one(
    ds: "xr.Dataset",
    name: str,
    folder: Path,
    kind: str = "png",
    theme: str = "light",
    sheet: sheets.Sheet = sheets.OWN_SIZE,
) -> list[str]:
    """Draw one picture or animation; return the names of its files, none where there is nothing to show."""
    still = pictures(ds)
    with sheets.use_sheet(sheet, theme), _refusing_what_cannot_be_drawn(ds, name):
        if name in still:
            path = folder / f"{name}.{kind}"
            return [path.name] if _write(still[name], path) else []
        path = folder / f"{name}.{kind if kind in films.KINDS else 'gif'}"
        return [path.name] if _animate(animations(ds)[name], path) else []


@contextmanager
def _refusing_what_cannot_be_drawn(ds: "xr.Dataset", picture: str) -> Iterator[None]:
    """Refuse a map that has numbers beyond `LARGEST`, where its picture could not be drawn."""
    try:
        yield
    except (ArithmeticError, ValueError):
        for name in (name for name in ds.variables if ds[name].dtype.kind == "f"):
            for box in blocks(dict(zip(ds[name].dims, ds[name].shape, strict=True)), BLOCK_POINTS):
                sizes = np.abs(read_box(ds, name, box), dtype=np.float64)
                beyond = sizes[(sizes > LARGEST) | ((sizes > 0.0) & (sizes < 1.0 / LARGEST))]
                if beyond.size:
                    wrong = f"{picture} cannot be drawn: {cut_text(repr(name))} holds {beyond[0]:g}"
                    allowed = f"0, and sizes from {1.0 / LARGEST:g} to {LARGEST:g}"
                    raise RefusedError(f"{wrong}; allowed: {allowed}, or other figures (--only)") from None
        raise


def _named(names: Sequence[str], only: Sequence[str]) -> list[str]:
    """Return those of some names that begin with one of `only`; all where there is none."""
    for start in only:
        if not any(name.startswith(start) for name in names):
            what = f"{cut_text(repr(start))} is not a figure of this map{hint(start, names)}"
            raise RefusedError(f"--only: {what}; allowed: {', '.join(names)}")
    return [name for name in names if not only or name.startswith(tuple(only))]


def literal(ds: "xr.Dataset") -> "xr.Dataset":
    """Return the map with dollar signs escaped, so that Matplotlib draws its text literally."""
    title = _plain(cut_text(" ".join(str(ds.attrs.get("title", "")).split()), MAX_TITLE))  # on one line
    names = {name: c.copy(data=[_plain(v) for v in c.values]) for name, c in ds.coords.items() if _is_named(c)}
    ds = ds.assign_coords(names).assign_attrs(title=title)
    for variable in ds.variables.values():
        variable.attrs = {key: _plain(value) for key, value in variable.attrs.items()}
    return ds


def _is_named(coordinate: "xr.DataArray") -> bool:
    return coordinate.dtype.kind in "OU" and coordinate.ndim == 1 and any("$" in str(v) for v in coordinate.values)


def _plain(value: object) -> object:
    return value.replace("$", r"\$") if isinstance(value, str) else value


def _animate(frames: Callable[[], Iterator[np.ndarray]], path: Path) -> bool:
    with np.errstate(all="ignore"), films.drawn_for(path):
        return films.write(frames(), path)


def _write(draw: Callable[[], Figure | None], path: Path) -> bool:
    with warnings.catch_warnings(), np.errstate(all="ignore"):  # of numbers of any size
        # matplotlib's remarks on names in scripts that its font lacks, on axes without room, on limits without extent
        warnings.simplefilter("ignore", UserWarning)
        figure = draw()
        if figure is None:
            return False
        _leave_logarithms(figure)
        _raster(figure)
        with replace_output(path) as temporary:
            save(figure, temporary, path.suffix[1:])
    return True


def save(figure: Figure, path: Path, kind: str) -> None:
    """Write a figure at the requested size."""
    scale = getattr(figure, "letter_scale", 1.0)
    if kind == "png":  # laid out and drawn at once: `savefig` draws twice
        figure.dpi = sheets.file_dpi() * scale
        figure.canvas.draw()
        pixels = Image.fromarray(np.asarray(figure.canvas.buffer_rgba()))
        pixels.save(path, format="PNG", dpi=(figure.dpi, figure.dpi))
        return
    figure.savefig(path, format=kind)
    if kind == "svg" and scale != 1.0:
        text, larger = path.read_text(encoding="utf-8"), lambda size: f' {size[1]}="{float(size[2]) * scale:g}pt"'
        path.write_text(SVG_SIZE.sub(larger, text, count=2), encoding="utf-8")
    elif kind == "pdf" and scale != 1.0:
        from pypdf import PdfWriter

        scaled = PdfWriter(clone_from=path)
        scaled.pages[0].scale_by(scale)
        scaled.write(path)


def _leave_logarithms(figure: Figure) -> None:
    """Make logarithmic axes linear where nothing drawn is positive: Matplotlib finds no ticks for them."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if axis.get_scale() == "log" and not axis.get_view_interval().min() > 0.0:
                axes.set(**{f"{axis.axis_name}scale": "linear"})


def _raster(figure: Figure) -> None:
    """Rasterise, in vector pictures, artists of more parts than a viewer would bear."""
    for axes in figure.axes:
        for artist in (*axes.collections, *axes.lines):
            parts = artist.get_array() if hasattr(artist, "get_array") else artist.get_xdata()
            artist.set_rasterized(parts is not None and np.size(parts) > MOST_PARTS)
