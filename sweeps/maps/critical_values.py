r"""Critical values: at which values of a parameter the regime changes, between the grid points of a map.

On each line of the map along the parameter, zeros of smooth invariants f are found: sign changes between neighbouring
grid points, and pairs of zeros between them, at which an extremum of f lies beyond 0 (a tongue narrower than a cell).
At new points the system is measured again, and Chandrupatla's method (Brent's, by inverse quadratic interpolation)
finds the zero p of f by linear theory. On both sides of it the measured f deviates from theory's by d on average, with
the error δ: so the measured critical value is :math:`p - d/f'` with the error :math:`δ/|f'|`. A zero counts if the
regimes on both sides, halfway to the neighbouring zeros and grid points, differ.

If the fastest growth passes from one eigenvalue to another, no invariant vanishes: the regime itself is bisected.

Invariants: `sweeps.systems.invariants`. Source: Chandrupatla, Adv. Eng. Softw. 28 (1997) 145, for zeros.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from sweeps import systems
from sweeps.maps import selection, slices, storage
from sweeps.points import catalogue
from sweeps.points.columns import measure_points
from sweeps.points.loading import read_sweep
from sweeps.reading.definitions import mapping_of
from sweeps.schema.refusals import RefusedError, hint
from sweeps.systems.described import REGISTERED
from sweeps.systems.invariants import Invariant, SpectralSystem

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.points.sweep import Sweep

MIN_SEPARATION = 1e-9  # zeros of two invariants nearer to each other than this fraction of a cell count as one
SIDE_DISTANCE = 0.02  # distance of the measurements beside a zero, relative to that of the next zero or point
MIN_TONGUE_DEPTH = 1e-11  # depth of extrema beyond 0, relative to the largest value on the line, above rounding
EXTREMUM_TOLERANCE = 1e-10  # width of the last bracket of an extremum, relative to the range of the parameter
MAX_EXTREMUM_STEPS = 60  # steps of the search for an extremum
MAX_VERTEX = 0.9  # an extremum is refined if a parabola through three grid points falls below this share of the least
ROOT_TOLERANCE = 1e-15  # width of a zero's last bracket, relative to the cell
NUM_BISECTIONS = 50  # bisections of a regime, which leave 2^-50 of a cell
MIN_POINTS = 3  # points of a line: three show an extremum between them
STABLE_REGIMES = ("stable", "asymptotically_stable")
OPEN_REGIMES = ("undetermined", "marginal")
# Units of the columns of changes; None for that of the parameter.
UNITS: dict[str, str | None] = {"critical_value": None, "critical_value_error": None, "critical_value_theory": None}
UNITS |= {"frequency_theory": "rad s-1"}


def find_critical_values(
    stability_map: "xr.Dataset | str | Path",
    along: str,
    places: Mapping[str, object],
    definition: str | None,
    prefix: str = "",
) -> "xr.Dataset":
    """Return the critical values of a map's lines along a parameter; see `sweeps.critical`.

    Args:
        stability_map: a map, or its path.
        along: the parameter.
        places: dimension → value, for dimensions of which one value is chosen.
        definition: that of the map, if its system is a Python file.
        prefix: precedes names in messages: "--" on the command line.
    """
    import xarray as xr

    with open_spectral_map(stability_map, definition) as (whole_map, sweep, parameters):
        if along not in parameters or whole_map.sizes[along] < MIN_POINTS:
            long_enough = [dim for dim in parameters if whole_map.sizes[dim] >= MIN_POINTS]
            allowed = f"a parameter with {MIN_POINTS} values or more ({', '.join(long_enough) or 'there is none'})"
            near = "" if along in parameters else hint(along, parameters)
            raise RefusedError(f"{prefix}along: {along} is no parameter with so many values{near}; allowed: {allowed}")
        spectrum = [*sweep.system.spectrum, *sweep.grid.extra_dimensions] * (not system_of(sweep).modes_are_separate)
        nearest = selection.nearest_places(whole_map, {name: str(value) for name, value in places.items()}, prefix)
        cut = {dim: [place.index] for dim, place in nearest.items() if dim in places and dim not in (along, *spectrum)}
        lines = Lines.of_map(whole_map.isel(cut), sweep, along, spectrum)
        columns = lines.changes()
        number = columns.pop("line")
        changes = xr.Dataset({name: ("change", column) for name, column in columns.items()})
        changes = changes.assign_coords({dim: ("change", values[number]) for dim, values in lines.places.items()})
        for name, unit in (dict.fromkeys(lines.places) | UNITS).items():
            unit = unit or whole_map[along if name in UNITS else name].attrs.get("units")
            changes[name].attrs |= {"units": unit} if unit else {}
        return changes.assign_attrs(along=along, title=whole_map.attrs.get("title", ""))


@contextmanager
def open_spectral_map(
    stability_map: "xr.Dataset | str | Path", definition: str | None
) -> Iterator[tuple["xr.Dataset", "Sweep", list[str]]]:
    """Yield a map with all its dimensions, its sweep as of `sweep_of`, and its parameters: dimensions of numbers.

    Args:
        stability_map: a map, or its path.
        definition: that of the map, if its system is a Python file.
    """
    is_path = isinstance(stability_map, str | Path)
    with storage.open_map(stability_map) if is_path else nullcontext(stability_map) as given_map:
        slices.check_is_map(given_map)
        whole_map = slices.with_all_dimensions(given_map)
        sweep = sweep_of(whole_map, definition)
        yield whole_map, sweep, [dim for dim in sweep.grid.dims if whole_map[dim].dtype.kind == "f"]


def sweep_of(whole_map: "xr.Dataset", definition: str | None = None) -> "Sweep":
    """Return the sweep that measures further points of a map of a system with equilibria, modes or multipliers.

    Args:
        whole_map: the map.
        definition: name or path of its definition; left out, the definition in the map, which runs no file.
    """
    if not isinstance(systems.of_map(whole_map), SpectralSystem) or "point" in whole_map.dims:
        allowed = "a grid of a system with equilibria, modes or multipliers"
        raise RefusedError(f"map: its system {whole_map.attrs.get('system')} has none along a grid; allowed: {allowed}")
    if definition is not None:
        return read_sweep(catalogue.find_definition(definition), check=False)
    name = str(whole_map.attrs["system"])
    if systems.is_file(name) and name not in REGISTERED:
        allowed = "the definition that names it (--definition)"
        raise RefusedError(f"system: {name}: a file that a map names is not run; allowed: {allowed}")
    return read_sweep(mapping_of(whole_map.attrs["definition"]), check=False)


def system_of(sweep: "Sweep") -> SpectralSystem:
    """Return the system of a sweep that `sweep_of` made."""
    return cast(SpectralSystem, sweep.system)


@dataclass
class Lines:
    """The lines of a map along a parameter, and measurements at further points of them.

    Attributes:
        sweep: the sweep of the map.
        along: the parameter.
        values: its values, ascending, shape (k,).
        places: dimension → value of each line, shape (lines,).
        columns: variable → values of the map, shape (lines k,), or (lines k, n) of eigenvalues and multipliers.
    """

    sweep: "Sweep"
    along: str
    values: np.ndarray
    places: dict[str, np.ndarray]
    columns: dict[str, np.ndarray]

    @classmethod
    def of_map(cls, whole_map: "xr.Dataset", sweep: "Sweep", along: str, spectrum: list[str]) -> "Lines":
        """Return the lines of a map.

        Args:
            whole_map: the map.
            sweep: its sweep.
            along: the parameter.
            spectrum: the dimension of eigenvalues or multipliers; [] if each mode has a line.
        """
        whole_map = whole_map.sortby(along)
        dims = [dim for dim in sweep.grid.dims if dim not in (along, *spectrum)]
        columns = {}
        for name in sweep.variables:
            variable = whole_map[name].transpose(*dims, along, ...)
            columns[name] = variable.values.reshape(-1, *variable.shape[len(dims) + 1 :])
        grids = np.meshgrid(*(whole_map[dim].values for dim in dims), indexing="ij")
        places = {dim: grid.ravel() for dim, grid in zip(dims, grids, strict=True)}
        return cls(sweep, along, whole_map[along].values.astype(float), places, _of_points(columns))

    @cached_property
    def system(self) -> SpectralSystem:
        """The system."""
        return system_of(self.sweep)

    @cached_property
    def has_pairs(self) -> np.ndarray:
        """True for lines with eigenvalues in pairs ±μ, or multipliers in pairs μ, 1/μ, at all points."""
        return self.system.has_pairs(self.columns).reshape(-1, self.values.size).all(axis=1)

    def measure(self, lines: np.ndarray, values: np.ndarray) -> dict[str, np.ndarray]:
        """Return the columns of points, each given by its line and its value of the parameter, shape (points,)."""
        if not lines.size:
            return {name: column[:0] for name, column in self.columns.items()}
        points = {name: place[lines] for name, place in self.places.items()} | {self.along: values}
        names = self.sweep.grid.arguments
        spectrum = next((name for name in names if name not in points), None)
        if spectrum is not None:
            numbers = self.sweep.grid.coordinates[spectrum]
            points = {name: np.repeat(column, len(numbers)) for name, column in points.items()}
            points[spectrum] = np.tile(numbers, lines.size)
        columns = measure_points({name: points[name] for name in names}, self.sweep)
        if spectrum is None:
            return columns
        return _of_points({name: column.reshape(lines.size, -1) for name, column in columns.items()})

    def invariants(self, lines: np.ndarray, values: np.ndarray) -> Invariant:
        """Return the invariants of points, shape (invariants, points), each given as for `measure`."""
        return self.system.invariants(self.measure(lines, values), self.has_pairs[lines])

    # -- zeros of invariants

    def zeros(self) -> dict[str, np.ndarray]:
        """Return the zeros of all invariants by linear theory: `line`, `invariant` and `value`, ordered by the first.

        Zeros of several invariants at the same value count once.
        """
        from scipy.optimize.elementwise import find_root

        line, number, low, high = np.concatenate([*self._sign_changes(), *self._hidden_tongues()], axis=1)
        line, number = line.astype(int), number.astype(int)
        tolerances = {"xatol": ROOT_TOLERANCE * np.ptp(self.values), "xrtol": ROOT_TOLERANCE}
        value = find_root(self._theory, (low, high), args=(line, number), tolerances=tolerances).x
        order = np.lexsort((number, value, line))
        line, number, value = line[order], number[order], value[order]
        cell = np.ptp(self.values) / (self.values.size - 1)
        is_repeated = (np.diff(line, prepend=-1) == 0) & (np.diff(value, prepend=-np.inf) < MIN_SEPARATION * cell)
        is_inside = (value > self.values[0]) & (value < self.values[-1]) & ~is_repeated
        return {"line": line[is_inside], "invariant": number[is_inside], "value": value[is_inside]}

    def _theory(self, values, lines, numbers, sign=1.0):
        """Return one invariant of each point by linear theory, times a sign."""
        return sign * _select(self.invariants(lines.astype(int), values).theory, numbers.astype(int))

    @cached_property
    def _on_grid(self):
        """The invariants at the map's points by linear theory, shape (invariants, lines, k)."""
        has_pairs = np.repeat(self.has_pairs, self.values.size)
        theory = self.system.invariants(self.columns, has_pairs).theory
        return theory.reshape(len(theory), -1, self.values.size)

    def _sign_changes(self):
        """Yield (line, invariant, low, high), shape (4, brackets), of sign changes between neighbouring points."""
        first, second = self._on_grid[..., :-1], self._on_grid[..., 1:]
        number, line, cell = np.nonzero((first * second < 0.0) | ((first == 0.0) & (second != 0.0)))
        yield np.array([line, number, self.values[cell], self.values[cell + 1]])

    def _hidden_tongues(self):
        """Yield brackets, as of `_sign_changes`, of pairs of zeros on both sides of an extremum beyond 0."""
        from scipy.optimize.elementwise import find_minimum

        values = self.values
        invariants = self._on_grid[: len(self._on_grid) - self.system.num_jumping_invariants]
        triples = np.lib.stride_tricks.sliding_window_view(invariants, 3, axis=2)
        sizes, signs = np.abs(triples), np.sign(triples)
        is_lowest = (sizes[..., 1] == sizes.min(axis=3)) & (sizes[..., 1] < sizes.max(axis=3))
        number, line, cell = np.nonzero(is_lowest & (np.abs(signs.sum(axis=3)) == 3.0))
        slopes = np.diff(sizes[number, line, cell]) / np.diff(values)[cell[:, None] + [0, 1]]
        curvature = (slopes[:, 1] - slopes[:, 0]) / (values[cell + 2] - values[cell])
        slope = slopes[:, 0] + curvature * (values[cell + 1] - values[cell])
        lowest_size = sizes[number, line, cell, 1]
        is_promising = lowest_size - slope**2 / (4.0 * curvature) < MAX_VERTEX * lowest_size
        number, line, cell = number[is_promising], line[is_promising], cell[is_promising]
        if not line.size:
            return
        sign, (low, middle, high) = signs[number, line, cell, 1], (values[cell + shift] for shift in range(3))
        options = {"tolerances": {"xatol": EXTREMUM_TOLERANCE * np.ptp(values)}, "maxiter": MAX_EXTREMUM_STEPS}
        extremum = find_minimum(self._theory, (low, middle, high), args=(line, number, sign), **options)
        error = _select(self.invariants(line, extremum.x).error, number)
        rounding = MIN_TONGUE_DEPTH * np.nanmax(np.abs(invariants[number, line]), axis=1)
        is_beyond = extremum.f_x < -np.fmin(error, rounding)
        for ends in ((low, extremum.x), (extremum.x, high)):
            yield np.array([line, number, *ends])[:, is_beyond]

    # -- changes of the regime

    def changes(self) -> dict[str, np.ndarray]:
        """Return the columns of the changes of the regime, in the order of lines and values."""
        line, number, value = self.zeros().values()
        before, after, distance = self._samples(line, value)
        is_change = self._stability(before) != self._stability(after)
        line, number, value, distance = line[is_change], number[is_change], value[is_change], distance[is_change]
        measured, error = self._measured_values(line, number, value, distance)
        bisected_line, bisected_value = self._bisected_regimes(line, value)
        line, value = np.append(line, bisected_line), np.append(value, bisected_value)
        missing = np.full(bisected_line.size, np.nan)
        columns = {"line": line, "critical_value": np.append(measured, missing)}
        columns |= {"critical_value_error": np.append(error, missing), "critical_value_theory": value}
        columns |= self._descriptions(line, value)
        order = np.lexsort((value, line))
        return {name: column[order] for name, column in columns.items()}

    def _samples(self, line, value):
        """Return the columns before and after each zero, halfway to its neighbours, and the side distance.

        Neighbours are zeros and points of the grid.
        """
        grid = self.values
        below, above = np.searchsorted(grid, value) - 1, np.searchsorted(grid, value, side="right")
        low, high = grid[np.maximum(below, 0)], grid[np.minimum(above, grid.size - 1)]
        order = np.lexsort((value, line))
        first, second = (order[rows][np.diff(line[order]) == 0] for rows in (slice(None, -1), slice(1, None)))
        low[second], high[first] = np.maximum(low[second], value[first]), np.minimum(high[first], value[second])
        before, after = (self.measure(line, 0.5 * (value + end)) for end in (low, high))
        return before, after, SIDE_DISTANCE * np.minimum(value - low, high - value)

    def _regimes(self, columns, name="regime_theory"):
        """Return the regimes of points as words."""
        variable = self.sweep.variables[name]
        return np.array(variable.flags)[columns[name] - variable.first_flag]

    def _stability(self, columns, name="regime_theory"):
        """Return the regimes of points as words, with one word for all that are stable, and "" for open ones."""
        words = self._regimes(columns, name)
        return np.where(np.isin(words, STABLE_REGIMES), "stable", np.where(np.isin(words, OPEN_REGIMES), "", words))

    def _measured_values(self, line, number, value, distance):
        """Return the measured critical values and their errors, from the invariant a distance before and after each."""
        sides = [self.invariants(line, value + sign * distance) for sign in (-1.0, 1.0)]
        low, high = (Invariant(*(_select(rows, number) for rows in side)) for side in sides)
        with np.errstate(all="ignore"):
            slope = (high.theory - low.theory) / (2.0 * distance)
            deviation = 0.5 * (low.measured - low.theory + high.measured - high.theory)
            error = np.maximum(low.error, high.error) / np.abs(slope)
            return value - deviation / slope, error + np.finfo(float).eps * np.abs(value)

    def _bisected_regimes(self, line, value):
        """Return (line, value) of changes between neighbouring decided points that no zero of an invariant explains."""
        stability = self._stability(self.columns).reshape(-1, self.values.size)
        brackets = []
        for number, words in enumerate(stability):
            zeros = value[line == number]
            for first, second in pairwise(np.flatnonzero(words != "")):
                low, high = self.values[first], self.values[second]
                if words[first] != words[second] and not ((low <= zeros) & (zeros <= high)).any():
                    brackets.append((number, low, high))
        line, low, high = np.array(brackets).reshape(-1, 3).T
        line = line.astype(int)
        regime = self._stability(self.measure(line, low))
        for _bisection in range(NUM_BISECTIONS if line.size else 0):
            middle = 0.5 * (low + high)
            is_first = self._stability(self.measure(line, middle)) == regime
            low, high = np.where(is_first, middle, low), np.where(is_first, high, middle)
        return line, high

    def _descriptions(self, line, value):
        """Return the kind of each change, the regimes before and after it, and its mode's number and frequency."""
        before, after, distance = self._samples(line, value)
        system, regime = self.system, self._stability(after)
        kinds = dict(system.change_kinds) | {"stable": "restabilised", "": "undecided"}
        kind = np.array([kinds[word] for word in regime], dtype=object)
        for word, paired_kind in system.paired_change_kinds.items():
            kind[(regime == word) & self.has_pairs[line]] = paired_kind
        agrees = [self._stability(columns) == self._stability(columns, "regime") for columns in (before, after)]
        kind[~np.all([*agrees, self._stability(before) != ""], axis=0)] = "undecided"
        side = np.where(regime == "stable", -1.0, 1.0)
        mode, frequency = system.critical_modes(self.measure(line, value + side * distance))
        if system.modes_are_separate:
            mode = self.places[system.spectrum[0]][line]
        words = {"regime_before": self._regimes(before, "regime"), "regime_after": self._regimes(after, "regime")}
        return {"kind": kind.astype(str), **words, "critical_mode": mode, "frequency_theory": frequency}


def _select(invariants, numbers):
    """Return the invariant with the number of each point, shape (points,), of (invariants, points)."""
    return np.take_along_axis(invariants, numbers[None], axis=0)[0]


def _of_points(columns):
    """Return columns with one value a point for variables that all eigenvalues of the point share."""
    names = [name for name in columns if name.startswith(("eigenvalue_", "multiplier_", "exponent_"))]
    return {name: values if name in names or values.ndim == 1 else values[:, 0] for name, values in columns.items()}
