"""Figures of maps as functions that return Matplotlib's Axes.

    import sweeps
    ds = sweeps.open_map("results/tennis_racket/stability_map.nc")
    ax = sweeps.plot.stability(ds, axis=2, at={"I3": 0.0175})
    ax.figure.savefig("racket.pdf")

Each takes a map, or its slice by `isel` or `sel`, the values at which to cut it (`at`: dimension → value; the nearest
grid value is used) and the Axes to draw in (`ax`; by default a new figure, with title and legend). A figure of several
panels replaces `ax`, which must have a grid specification (`subplots`). The first panel is returned; its attribute
`figure` is the whole figure.
"""

import importlib
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


def stability(ds: "xr.Dataset", axis: int | None = None, at: Mapping | None = None, ax: "Axes | None" = None) -> "Axes":
    """Draw the regime of a spin about an axis over two parameters, with theory's boundaries.

    Args:
        ds: a map over a grid of moments, or of relative equilibria.
        axis: spin axis, 1, 2 or 3; by default 2 if the map has it, else its first axis.
        at: dimension → value.
        ax: Axes to draw in; None for a new figure.
    """
    ds, at = _with_all_dimensions(ds), _check_places(at)
    has_axes = "axis" in ds.dims
    if has_axes:
        axis = (2 if 2 in ds["axis"].values else int(ds["axis"].values[0])) if axis is None else axis
    elif axis is not None:
        _refuse(f"axis: {axis!r} is given, and this map has no dimension axis; allowed: none")
    return draw(ds, "stability", {**at, "axis": axis} if has_axes else at, ax)


def campbell(
    ds: "xr.Dataset",
    along: str,
    at: Mapping | None = None,
    ax: "Axes | None" = None,
    orders: tuple[float, ...] = (1, 2),
) -> "Axes":
    """Draw a Campbell diagram: measured frequencies and damping ratios of the modes over a parameter.

    Modes are followed through crossings (`sweeps.modes`). If the parameter is a rate of rotation, its multiples are
    lines, and crossings are marked with their values, interpolated between the map's points.

    Args:
        ds: a map of modes or of eigenvalues.
        along: the parameter.
        at: dimension → value, for each further dimension of several values.
        ax: Axes to draw in; None for a new figure.
        orders: multiples of the parameter that are drawn.
    """
    from sweeps.views import mode_figures

    return _draw_modes(lambda modes, axes: mode_figures.draw_campbell(modes, along, orders, axes), ds, along, at, ax)


def root_locus(ds: "xr.Dataset", along: str, at: Mapping | None = None, ax: "Axes | None" = None) -> "Axes":
    """Draw the measured eigenvalues' paths in the complex plane as a parameter grows; arguments as of `campbell`."""
    from sweeps.views import mode_figures

    return _draw_modes(lambda modes, axes: mode_figures.draw_root_locus(modes, along, axes), ds, along, at, ax)


def mode_surface(
    ds: "xr.Dataset", along: str, over: str, curve: int = 1, at: Mapping | None = None, ax: "Axes | None" = None
) -> "Axes":
    """Draw the frequency of one mode, followed along a parameter, over a second one.

    Around a point at which two modes coincide in rate and shape, they are exchanged: the mode's number jumps at a cut,
    a line that ends at such a point.

    Args:
        ds: a map of modes or of eigenvalues.
        along: the parameter along which modes are followed.
        over: the second parameter.
        curve: number of the mode's curve.
        at: dimension → value, for each further dimension of several values.
        ax: Axes to draw in; None for a new figure.
    """
    from sweeps.views import mode_figures

    def drawing(modes, axes):
        return mode_figures.draw_surface(modes, along, over, curve, axes)

    return _draw_modes(drawing, ds, along, at, ax, over)


def response(
    ds: "xr.Dataset", force: Mapping, frequencies: Sequence, at: Mapping | None = None, ax: "Axes | None" = None
) -> "Axes":
    """Draw the response to a harmonic force over its frequency: measured amplitudes and phases on theory's lines.

    Args:
        ds: a map of modes or of eigenvalues.
        force: coordinate or state → amplitude, as of `sweeps.response`.
        frequencies: angular frequencies, rad s-1.
        at: dimension → value, for each dimension of several values.
        ax: Axes to draw in; None for a new figure.
    """
    from sweeps.maps.response import find_response
    from sweeps.views import mode_figures

    answer = find_response(ds, force, frequencies, _check_places(at), None)
    return _draw_panel(lambda panel: mode_figures.draw_response(answer, panel), "response", ax)


def _draw_modes(drawing: Callable, whole_map, along: str, places: Mapping | None, axes: "Axes | None", over=None):
    """Draw the modes of a map along a parameter, or over two."""
    from sweeps.maps.modes import select_points

    points = select_points(whole_map, along, _check_places(places), None)
    points.check_line(over)
    modes = points.modes(measured=False)
    return _draw_panel(lambda panel: drawing(modes, panel), "modes", axes)


_names = ["stability", "campbell", "root_locus", "mode_surface", "response", "deviations"]
_PICTURES = {"deviations": "theory_against_measured"}  # function → its picture, if that has another name


def _named_figure(name: str, doc: str, picture: str = "") -> Callable[..., "Axes"]:
    """Return the function of a picture: `name` is that of the function, `picture` that of the file if it differs."""

    def draw_figure(ds: "xr.Dataset", at: Mapping | None = None, ax: "Axes | None" = None) -> "Axes":
        return draw(ds, picture or name, at, ax)

    draw_figure.__name__, draw_figure.__qualname__, draw_figure.__doc__ = name, name, doc
    _names.append(name)
    _PICTURES.update({name: picture} if picture else {})
    return draw_figure


theory_against_measured = _named_figure("theory_against_measured", "Draw deviations from theory, and measured errors.")
deviations = theory_against_measured
bodies = _named_figure("bodies", "Draw real bodies side by side: rates, times between flips, and observed periods.")
breakdown = _named_figure("breakdown", "Draw deviations of rates from linear theory over the size of the perturbation.")
polhodes = _named_figure("polhodes", "Draw polhodes: curves of the angular velocity on the energy ellipsoid of a body.")
triangle = _named_figure("triangle", "Draw bodies by shape on the triangle of inertia.")
points = _named_figure("points", "Draw sampled or listed points over two coordinates, and a histogram of a variable.")
precession = _named_figure("precession", "Draw the precession rate of the free symmetric top over I3/I1.")
cones = _named_figure("cones", "Draw body cone and space cone of a symmetric top.")
oscillations = _named_figure(
    "oscillations", "Draw rates of every equilibrium and mode, and the equilibria's positions."
)
twist = _named_figure("twist", "Draw the twist of a thrown body about its handle.")
defect = _named_figure("defect", "Draw over the angle of the throw how near to a half twist bodies come.")
tumbling = _named_figure("tumbling", "Draw the ratio of both periods of a tumbling body.", "periods")
herpolhode = _named_figure(
    "herpolhode", "Draw the curve of the angular velocity in the plane normal to L: the herpolhode."
)
sense = _named_figure("sense", "Draw the final sense of spin of a body that loses energy over its starts.")
settling = _named_figure("settling", "Draw the times until bodies that lose energy are in a flat spin, over the loss.")
outlook = _named_figure("outlook", "Draw the probability that each spin of bodies with uncertain moments is unstable.")

NAMES = tuple(_names)
__all__ = [*NAMES, "draw", "Polhode", "register"]


def __dir__() -> list[str]:
    return __all__


def draw(ds: "xr.Dataset", name: str, at: Mapping | None = None, ax: "Axes | None" = None) -> "Axes":
    """Draw a figure of a map by its name, including figures of systems in separate packages.

    Args:
        ds: a map, or its slice by `isel` or `sel`.
        name: name of the figure's file, with or without its axis ("stability", "stability_axis_2").
        at: dimension → value at which the map is cut; the nearest grid value is used.
        ax: Axes to draw in; None for a new figure.

    Returns:
        The picture's first panel.

    Raises:
        RefusedError: if `ds` is not a map, or does not have this picture or this place.
    """
    from sweeps.views import figures

    register()
    cut_ds = figures.escape_dollars(_cut_map(_with_all_dimensions(ds), _check_places(at)))
    drawings = figures.pictures(cut_ds)
    names = [file_name for file_name in drawings if file_name == name or file_name.startswith(f"{name}_axis_")]
    drawing = drawings[names[0]] if names else None
    if drawing is None:
        from sweeps.schema.refusals import hint

        _refuse(f"{name}: is not a figure of this map{hint(name, drawings)}; allowed: {', '.join(drawings)}")
    if ax is not None and ax.get_subplotspec() is None:
        _refuse("ax: has no grid specification; allowed: an Axes of `subplots`, or none")
    return _draw_panel(drawing, name, ax)


def _refuse(message: str):
    from sweeps.schema.refusals import RefusedError

    raise RefusedError(message)


def _with_all_dimensions(ds):
    """Return a map, or its slice, with all dimensions of the map; refuse any other object."""
    from sweeps.maps import slices

    slices.check_is_map(ds)
    return slices.with_all_dimensions(ds)


def _check_places(at: Mapping | None) -> Mapping:
    if not isinstance(at or {}, Mapping):
        _refuse(f"at: is of type {type(at).__name__}; allowed: a mapping of dimensions to values")
    return at or {}


def _cut_map(ds, at: Mapping):
    """Return the map at the grid values nearest to `at`; the whole map without any."""
    from sweeps.maps import selection

    places = selection.nearest_places(ds, {name: str(value) for name, value in at.items()})
    return ds.isel({place.dim: [place.index] for place in places.values()}) if at else ds


def _draw_panel(drawing, name: str, ax: "Axes | None") -> "Axes":
    """Draw a figure and return its first panel; if pyplot is loaded, it manages the figure."""
    import numpy as np

    from sweeps.figure import sheets

    if "inline" in os.environ.get("MPLBACKEND", ""):  # a notebook shows only figures of pyplot
        importlib.import_module("matplotlib.pyplot")
    pyplot = sys.modules.get("matplotlib.pyplot")
    if ax is not None:
        with np.errstate(all="ignore"):
            figure = drawing(ax)
    else:
        sheet = sheets.OWN_SIZE if pyplot is None else sheets.OWN_SIZE._replace(new_figure=pyplot.figure)
        with sheets.use_sheet(sheet), np.errstate(all="ignore"):
            figure = drawing(None)
    if figure is None:
        _refuse(f"{name}: this map has nothing to show there; allowed: another position, or another map")
    return figure.axes[0]


def _flag_words(variable: "xr.DataArray", meanings: Mapping[int, str]) -> "xr.DataArray":
    """Return the words of a flag variable; "" for a number without a meaning."""
    import numpy as np

    words = np.array([meanings.get(code, "") for code in range(max(meanings) + 1)])
    attributes = {name: value for name, value in variable.attrs.items() if not name.startswith("flag_")}
    return variable.copy(data=words[variable.values]).drop_attrs().assign_attrs(attributes)


class Polhode:
    """The accessor `ds.polhode`: figures, a summary, and flags as words; each figure is the function of that name here.

    Example:
        >>> ds = sweeps.survey(I1=1.0, I2=2.0, I3=[2.5, 3.0], omega0=1.0, axes=[2])
        >>> ds.polhode.words().regime.values.ravel().tolist()
        ['unstable', 'unstable']
    """

    def __init__(self, ds: "xr.Dataset"):
        self._ds = ds

    def __dir__(self):
        """Return the methods, the pictures of this map, and the functions that draw them."""
        from sweeps import systems

        try:
            pictures = self.pictures()
        except ValueError:  # no map
            return super().__dir__()
        starts = {name.partition("_axis_")[0] for name in pictures}
        with_modes = (
            ("campbell", "root_locus", "mode_surface", "response")
            if getattr(systems.of_map(self._ds), "spectrum", ())
            else ()
        )
        names = [name for name in NAMES if _PICTURES.get(name, name) in starts or name in with_modes]
        return sorted({*super().__dir__(), *pictures, *names})

    def __getattr__(self, name: str):
        from functools import partial

        if name in NAMES:
            return partial(globals()[name], self._ds)
        if name.startswith("_") or name not in self.pictures():
            raise AttributeError(f"'polhode' has no {name!r}; it has summary, pictures, {', '.join(NAMES)}")
        return partial(draw, self._ds, name)

    def __repr__(self) -> str:
        try:
            names = ", ".join(self.pictures())
        except ValueError as unlike:
            return f"ds.polhode: {unlike}"
        methods = "summary(), words(), pictures()"
        return f"ds.polhode of {self._ds.attrs.get('title', 'a map')!r}: {methods}; figures: {names}"

    def _repr_html_(self) -> str:
        """Return the map's sentence, points and pictures as HTML, which a notebook shows."""
        from html import escape

        from sweeps import systems

        title = escape(str(self._ds.attrs.get("title", "a map")))
        sizes = " × ".join(f"{size:,} {name}" for name, size in self._ds.sizes.items() if size > 1)
        sentence = systems.presentation_of(self._ds).sentence(self._ds)
        calls = "".join(f"<li><code>ds.polhode.{name}()</code></li>" for name in self.pictures())
        return f"<h4>{title}</h4><p><b>{escape(sentence)}</b></p><p>{escape(sizes)}</p><ul>{calls}</ul>"

    def words(self) -> "xr.Dataset":
        """Return the map with its flag variables as words in place of numbers."""
        from sweeps.schema.datasets import flags

        return self._ds.map(
            lambda variable: _flag_words(variable, meanings) if (meanings := flags(variable)) else variable,
            keep_attrs=True,
        )

    def pictures(self) -> list[str]:
        """Return the names of this map's pictures."""
        from sweeps.views import figures

        return list(figures.pictures(_with_all_dimensions(self._ds)))

    def summary(self) -> str:
        """Return the text that `polhode show` prints for this map."""
        from io import StringIO

        from rich.console import Console

        from sweeps.maps import selection, summary
        from sweeps.maps.description import without_extra_dimensions
        from sweeps.views import textmap

        ds = without_extra_dimensions(_with_all_dimensions(self._ds))
        text = StringIO()
        console = Console(file=text, width=120)
        selection.nearest_places(ds, {})
        totals = summary.summarise(ds)
        textmap.print_summary(console, totals, textmap.draw_map(ds, totals.description, {}, console.width))
        return text.getvalue()


def register() -> None:
    """Register the accessor `polhode` with xarray, once."""
    import xarray as xr

    if getattr(xr.Dataset, "polhode", None) is None:
        xr.register_dataset_accessor("polhode")(Polhode)
