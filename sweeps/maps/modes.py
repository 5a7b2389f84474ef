"""Modes of a map: shapes by linear theory and measured, participation, damping, whirl, and their curves.

Shapes are computed for the points that are requested, from the matrices and the runs that made the map's rates, not
stored in it: they are derived from the same numbers, and most readers of a map need none.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from sweeps.maps import critical_values, selection
from sweeps.schema.refusals import RefusedError, hint
from sweeps.systems import mode_curves
from sweeps.systems.described import Described

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.points.sweep import Sweep


def select_points(
    stability_map: "xr.Dataset | str | Path",
    along: str | None,
    places: Mapping[str, object],
    definition: str | None,
    prefix: str = "",
) -> "MapPoints":
    """Return the points of a map for modes; see `sweeps.modes`.

    Args:
        stability_map: a map, or its path.
        along: the parameter along which modes are followed; None to follow none.
        places: dimension → value, for dimensions of which one value is chosen.
        definition: that of the map, if its system is a Python file.
        prefix: precedes names in messages: "--" on the command line.
    """
    with critical_values.open_spectral_map(stability_map, definition) as (whole_map, sweep, parameters):
        if not isinstance(sweep.system, Described):
            allowed = "a map of a described system's modes, eigenvalues or multipliers"
            raise RefusedError(f"map: its system {sweep.system.name} has no mode shapes; allowed: {allowed}")
        if along is not None and along not in parameters:
            allowed = ", ".join(parameters)
            raise RefusedError(f"{prefix}along: {along} is no parameter{hint(along, parameters)}; allowed: {allowed}")
        nearest = selection.nearest_places(whole_map, {name: str(value) for name, value in places.items()}, prefix)
        chosen = {dim: place for dim, place in nearest.items() if dim in places and dim != along}
        return MapPoints(whole_map, sweep, along, chosen, prefix)


class MapPoints:
    """Points of a map for its modes; see `select_points`.

    Attributes:
        sweep: the sweep of the map.
        system: its system.
        along: the parameter along which modes are followed, or None.
        places: the chosen values.
        spectrum: the dimension of modes or eigenvalues.
        points: the map there, with all of its modes or eigenvalues.
    """

    def __init__(self, whole_map, sweep: "Sweep", along: str | None, places: Mapping[str, selection.Place], prefix=""):
        self.sweep, self.along, self.places, self._prefix = sweep, along, places, prefix
        self.system = cast(Described, sweep.system)
        (self.spectrum,) = (*sweep.system.spectrum, *sweep.grid.extra_dimensions)
        cut = {dim: [place.index] for dim, place in places.items() if dim != self.spectrum}
        dims = [dim for dim in sweep.grid.dims if dim not in (along, self.spectrum)]
        self._dims = dims if along is None else [*dims, along]
        self.points = whole_map.isel(cut).transpose(*self._dims, ...).load()

    def check_line(self, over: str | None = None) -> None:
        """Refuse several values of dimensions other than the one along which modes are followed, and `over`."""
        dims = [dim for dim in self._dims if self.points.sizes[dim] > 1 and dim not in (self.along, over)]
        selection.check_places(self.points, dims, self._prefix)

    def arguments(self) -> dict[str, np.ndarray]:
        """Return dimension → its values at the points, shape (points,); a parameter that is followed varies fastest."""
        grids = np.meshgrid(*(self.points[dim].values for dim in self._dims), indexing="ij")
        return {dim: grid.ravel() for dim, grid in zip(self._dims, grids, strict=True)}

    def modes(self, measured: bool = True) -> "xr.Dataset":
        """Return the modes of all points, with their eigenvalues as the map contains them.

        Args:
            measured: False for theory's shapes alone, which need no runs.
        """
        import xarray as xr

        points, system = self.points, self.system
        shape = [points.sizes[dim] for dim in self._dims]
        arguments = self.arguments()
        integration = self.sweep.definition.integration if measured else None
        predicted, fitted = system.mode_shapes(arguments, integration)[:2]
        rates, rate_errors = system.complex_rates(points)
        components = system.components()
        dims = (*self._dims, self.spectrum)

        def variable(values, words, *extra):
            return (*dims, *extra), np.reshape(values, (*shape, *values.shape[1:])), {"long_name": words}

        modes = {}
        for kind, shapes in {"_theory": predicted, **({"": fitted} if measured else {})}.items():
            source = "linear theory" if kind else "measured"
            for axis_name in ("real", "imag"):
                words = f"mode shape, {axis_name} part, {source}"
                values = getattr(shapes.vectors, axis_name)
                modes[f"mode_shape_{axis_name}{kind}"] = variable(values, words, "component")
            modes[f"mode_shape_error{kind}"] = variable(shapes.errors, f"error of the mode shape, {source}")
            words = f"share of the kinetic energy in the component, {source}"
            modes[f"participation{kind}"] = variable(shapes.participation, words, "component")
            if (plane := system.description.given_plane) and system.spectrum:
                sense = np.sign(rates.imag.transpose(*dims).values.reshape(shapes.errors.shape))
                turning = sense * _turning(shapes, [components.index(name) for name in plane])
                words = f"1 from {plane[0]} to {plane[1]}, -1 back, 0 planar, {source}"
                modes[f"whirl{kind}"] = variable(turning, words)
        coordinates = {dim: points[dim] for dim in dims} | {"component": components}
        dataset = xr.Dataset(modes, coordinates, {"title": points.attrs.get("title", "")})
        dataset["eigenvalue_real"], dataset["eigenvalue_imag"] = rates.real, rates.imag
        dataset["eigenvalue_error"] = rate_errors
        with np.errstate(all="ignore"):
            dataset["damping_ratio"] = -rates.real / np.abs(rates)
            dataset["log_decrement"] = -2.0 * np.pi * rates.real / np.abs(rates.imag).where(rates.imag != 0.0)
        if self.along is not None:
            numbers = mode_curves.follow_modes(system, arguments)
            words = f"number of the mode's curve along {self.along}; 0 if it is not known"
            dataset["curve"] = variable(numbers, words)
            parameters = [dim for dim in self._dims if points[dim].dtype.kind == "f" and dim != self.along]
            for dim in (dim for dim in parameters if points.sizes[dim] > 1):
                words = f"two modes exchange their curves between this value of {dim} and the next"
                cuts = mode_curves.find_cuts(system, arguments, numbers, dim)
                dataset[f"cut_{dim}"] = self._dims, cuts, {"long_name": words}
        place = self.places.get(self.spectrum)
        return dataset if place is None else dataset.isel({self.spectrum: [place.index]})


def _turning(shapes, plane):
    """Return 1 for modes that turn from the first to the second component of a plane, -1 back, 0 for planar modes.

    Modes of negative frequency turn the other way.
    """
    first, second = (shapes.vectors[..., component] for component in plane)
    moment = -2.0 * (first.conj() * second).imag
    size = np.abs(first) ** 2 + np.abs(second) ** 2
    with np.errstate(invalid="ignore"):
        is_planar = np.abs(moment) <= 4.0 * shapes.errors * np.sqrt(size * size.max()) + 1e-9 * size
    return np.where(np.isnan(moment), np.nan, np.where(is_planar, 0.0, np.sign(moment)))
