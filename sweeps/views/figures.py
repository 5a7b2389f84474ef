"""Pictures of a map: regimes, deviations from theory, limits of linear theory, and animations."""

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

MIN_SHARED_PICTURES = 4  # fewer pictures are drawn before another process is ready
MAX_TITLE = 200  # characters, as in definitions
MAX_VECTOR_PARTS = 20_000  # an artist of more parts is a bitmap in SVG and PDF, which viewers would draw too slowly
SVG_SIZE = re.compile(r' (width|height)="([\d.]+)pt"')  # the size of the drawing, to which its viewBox is scaled
MAX_MAGNITUDE = 1e150  # Matplotlib has no limits and ticks for numbers larger than this or smaller than its inverse
BLOCK_POINTS = 2**20


def open_to_draw(path: str | Path) -> "xr.Dataset":
    """Open a map for drawing, and import no compiler if its figures call few kernels."""
    ds = storage.open_map(path)
    is_slice = not all(coordinate.ndim for coordinate in ds.coords.values())
    if not is_slice and not systems.presentation_of(ds).needs_compiler(ds):
        startup.leave_out_compiler()
    return ds


def pictures(ds: "xr.Dataset") -> dict[str, Callable[[], Figure | None]]:
    """Return name → drawing function of each figure of a map (which returns None if there is nothing to show)."""
    ds = slices.with_all_dimensions(ds)
    presentation = systems.presentation_of(ds)
    draw_of = presentation.figures_of_points if "point" in ds.dims else presentation.figures
    return {name: _nothing_if_missing(ds, draw, None) for name, draw in draw_of(ds).items()}


def animations(ds: "xr.Dataset") -> dict[str, Callable[[], Iterator[np.ndarray]]]:
    """Return name → function that draws the frames of each animation of a map."""
    ds = slices.with_all_dimensions(ds)
    if "point" in ds.dims:  # `polhode point` writes the motion of such points
        return {}
    frames_of = systems.presentation_of(ds).animations(ds)
    return {name: _nothing_if_missing(ds, partial(_draw_first, frames), iter(())) for name, frames in frames_of.items()}


def _draw_first(frames: Callable[[], Iterator[np.ndarray]]) -> Iterator[np.ndarray]:
    """Return the frames; the first frame is drawn at once."""
    frame_iterator = iter(frames())
    return chain(list(islice(frame_iterator, 1)), frame_iterator)


def _nothing_if_missing(ds: "xr.Dataset", draw: Callable, placeholder: Iterator | None) -> Callable:
    """Return a drawing function that returns `placeholder` if `draw` needs a variable that the map lacks."""

    def draw_if_possible(*place):
        """Draw the figure, or return the placeholder if the map lacks a variable that the figure needs."""
        try:
            return draw(*place)
        except KeyError as missing:
            missing_names = set(systems.of_map(ds).layout().variables) - set(ds.variables)
            if any(repr(name) in str(missing) for name in missing_names):
                return placeholder
            raise

    return draw_if_possible


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

    Only the drawn values are read, so the map may exceed the memory. A worker process draws every third picture.

    Args:
        ds: a map, from `sweeps.open_map` or `sweeps.survey`.
        folder: folder of the files; it is created if it is missing, and files of the same name are replaced.
        kind: "png"; "svg", with letters as curves; "pdf", with text; "mp4" or "webm" for the animations alone.
        only: names of pictures and animations, or their beginnings; () for all.
        theme: of `sweeps.figure.colors.THEMES`.
        sheet: paper or slide of the pictures.
        submit: passes the arguments of `draw_one` after the first to a worker; see `sweeps.views.drawing`.
        meanwhile: called when the worker has its tasks, before this process draws.

    Yields:
        The path of each file, when all are written.

    Raises:
        RefusedError: for a name that no picture of this map has, and if a film cannot be made.
    """
    folder, ds = Path(folder), escape_dollars(ds)
    drawings, frame_makers = pictures(ds), animations(ds)
    if kind in films.KINDS:
        films.require_encoder(kind, frame_makers)
        drawings = {}
    names = _select_names([*drawings, *frame_makers], only)
    with replace_output(folder, is_folder=True) as temporary:
        options = (temporary, kind, theme, sheet)
        is_shared = submit and len(names) >= MIN_SHARED_PICTURES
        worker_names = names[::-3] if is_shared else []  # animations, the last names, take longest
        futures = {name: submit(name, *options) for name in worker_names}
        meanwhile()
        files = {name: draw_one(ds, name, *options) for name in names if name not in worker_names}
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
    """Draw one picture or animation; return the names of its files, [] if there is nothing to show.

    Args:
        ds: a map.
        name: of the picture or animation.
        folder: folder of the files, which exists.
        kind: as of `draw_all`.
        theme: of `sweeps.figure.colors.THEMES`.
        sheet: paper or slide of the picture.
    """
    drawings = pictures(ds)
    with sheets.use_sheet(sheet, theme), _refuse_extreme_values(ds, name):
        if name in drawings:
            path = folder / f"{name}.{kind}"
            return [path.name] if _write_picture(drawings[name], path) else []
        path = folder / f"{name}.{kind if kind in films.KINDS else 'gif'}"
        return [path.name] if _write_animation(animations(ds)[name], path) else []


@contextmanager
def _refuse_extreme_values(ds: "xr.Dataset", picture: str) -> Iterator[None]:
    """Refuse a map that has numbers beyond `MAX_MAGNITUDE`, if drawing its picture raises an error."""
    try:
        yield
    except (ArithmeticError, ValueError):
        for name in (name for name in map(str, ds.variables) if ds[name].dtype.kind == "f"):
            for box in blocks(dict(zip(map(str, ds[name].dims), ds[name].shape, strict=True)), BLOCK_POINTS):
                sizes = np.abs(read_box(ds, name, box), dtype=np.float64)
                extreme = sizes[(sizes > MAX_MAGNITUDE) | ((sizes > 0.0) & (sizes < 1.0 / MAX_MAGNITUDE))]
                if extreme.size:
                    problem = f"{picture} cannot be drawn: {cut_text(repr(name))} holds {extreme[0]:g}"
                    allowed = f"0, and sizes from {1.0 / MAX_MAGNITUDE:g} to {MAX_MAGNITUDE:g}"
                    raise RefusedError(f"{problem}; allowed: {allowed}, or other figures (--only)") from None
        raise


def _select_names(names: Sequence[str], only: Sequence[str]) -> list[str]:
    """Return the names that begin with a name in `only`; all names if `only` is empty."""
    for start in only:
        if not any(name.startswith(start) for name in names):
            problem = f"{cut_text(repr(start))} is not a figure of this map{hint(start, names)}"
            raise RefusedError(f"--only: {problem}; allowed: {', '.join(names)}")
    return [name for name in names if not only or name.startswith(tuple(only))]


def escape_dollars(ds: "xr.Dataset") -> "xr.Dataset":
    """Return the map with dollar signs escaped, so that Matplotlib draws its text literally."""
    title = _escape_text(cut_text(" ".join(str(ds.attrs.get("title", "")).split()), MAX_TITLE))  # on one line
    names = {name: c.copy(data=[_escape_text(v) for v in c.values]) for name, c in ds.coords.items() if _has_dollars(c)}
    ds = ds.assign_coords(names).assign_attrs(title=title)
    for variable in ds.variables.values():
        variable.attrs = {key: _escape_text(value) for key, value in variable.attrs.items()}
    return ds


def _has_dollars(coordinate: "xr.DataArray") -> bool:
    return coordinate.dtype.kind in "OU" and coordinate.ndim == 1 and any("$" in str(v) for v in coordinate.values)


def _escape_text(value: object) -> object:
    return value.replace("$", r"\$") if isinstance(value, str) else value


def _write_animation(frames: Callable[[], Iterator[np.ndarray]], path: Path) -> bool:
    with np.errstate(all="ignore"), films.use_film_of(path):
        return films.write_frames(frames(), path)


def _write_picture(draw: Callable[[], Figure | None], path: Path) -> bool:
    """Draw a figure and save it to `path`; return False if there is nothing to draw."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):  # overflow of large numbers has no effect here
        # Matplotlib warns of scripts that its font lacks, of axes without space and of limits without extent
        warnings.simplefilter("ignore", UserWarning)
        figure = draw()
        if figure is None:
            return False
        _avoid_empty_logarithms(figure)
        _rasterise(figure)
        with replace_output(path) as temporary:
            save_figure(figure, temporary, path.suffix[1:])
    return True


def save_figure(figure: Figure, path: Path, kind: str) -> None:
    """Write a figure at the size of its sheet.

    Args:
        figure: the figure.
        path: the file.
        kind: "png", "svg" or "pdf".
    """
    scale = getattr(figure, "letter_scale", 1.0)
    if kind == "png":  # one drawing suffices, while `savefig` draws twice
        figure.dpi = sheets.file_dpi() * scale
        figure.canvas.draw()
        pixels = Image.fromarray(np.asarray(figure.canvas.buffer_rgba()))
        pixels.save(path, format="PNG", dpi=(figure.dpi, figure.dpi))
        return
    figure.savefig(path, format=kind)
    if kind == "svg" and scale != 1.0:
        svg, enlarge = path.read_text(encoding="utf-8"), lambda size: f' {size[1]}="{float(size[2]) * scale:g}pt"'
        path.write_text(SVG_SIZE.sub(enlarge, svg, count=2), encoding="utf-8")
    elif kind == "pdf" and scale != 1.0:
        from pypdf import PdfWriter

        document = PdfWriter(clone_from=path)
        document.pages[0].scale_by(scale)
        document.write(path)


def _avoid_empty_logarithms(figure: Figure) -> None:
    """Make logarithmic axes without positive values linear: Matplotlib finds no ticks for them."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if axis.get_scale() == "log" and not min(axis.get_view_interval()) > 0.0:
                axes.set(**{f"{axis.axis_name}scale": "linear"})


def _rasterise(figure: Figure) -> None:
    """Draw artists of more than `MAX_VECTOR_PARTS` parts as bitmaps in SVG and PDF."""
    for axes in figure.axes:
        for artist in (*axes.collections, *axes.lines):
            values = artist.get_array() if hasattr(artist, "get_array") else artist.get_xdata()
            artist.set_rasterized(values is not None and np.size(values) > MAX_VECTOR_PARTS)
