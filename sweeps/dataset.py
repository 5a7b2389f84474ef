"""Columns → `xarray.Dataset`: names, units, flags and provenance, each from one table.

`evaluate` is the one function that turns coordinates into a Dataset. A shard under Snakemake, a chunk under Dask and a
call in a notebook all go through it.
"""

import platform
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from itertools import pairwise

import numpy as np
import xarray as xr

from kernels import survey as kernel
from kernels.fingerprint import fingerprint
from sweeps.definition import Definition, Integration
from sweeps.grid import Grid

CONTRACT_VERSION = "1.0"
CONVENTIONS = "CF-1.11"

PARAMETERS = ("I1", "I2", "I3", "axis", "omega0", "epsilon", "phase")

REGIMES = ("undetermined", "stable_minor", "stable_major", "unstable", "marginal", "sphere")
SHAPES = ("asymmetric", "oblate", "prolate", "sphere")
STATUSES = ("ok", "short_window", "not_converged", "non_finite")


@dataclass(frozen=True)
class Variable:
    """One variable of a map.

    Attributes:
        name: its name in the file, public contract.
        units: UDUNITS text; None for flags.
        long_name: what it means, one line, on axes and in `ncdump -h`.
        dtype: NumPy type in memory and on disk; NaN marks a missing float.
        flags: meanings of the whole numbers from `first_flag` on, for a flag variable.
        comment: what a reader should know beyond the long name.
        first_flag: number of the first meaning.
    """

    name: str
    units: str | None
    long_name: str
    dtype: str = "f8"
    flags: tuple[str, ...] = ()
    comment: str = ""
    first_flag: int = 0

    @property
    def attributes(self) -> dict:
        """CF attributes of the variable."""
        attributes = {"long_name": self.long_name}
        if self.units is not None:
            attributes["units"] = self.units
        if self.flags:
            values = np.arange(self.first_flag, self.first_flag + len(self.flags), dtype=self.dtype)
            attributes |= {"flag_values": values, "flag_meanings": " ".join(self.flags)}
        if self.comment:
            attributes["comment"] = self.comment
        return attributes


_SCATTER = "scatter of the samples only: it does not know the bias of a finite amplitude"

VARIABLES = {
    variable.name: variable
    for variable in (
        Variable("omega_squared_theory", "s-2", "signed square of the rate, linear theory"),
        Variable("omega_squared", "s-2", "signed square of the rate, measured"),
        Variable(
            "omega_squared_stderr",
            "s-2",
            "standard error of the measured signed square of the rate",
            comment=_SCATTER,
        ),
        Variable("growth_rate_theory", "s-1", "growth rate, linear theory; 0 where not unstable"),
        Variable("growth_rate", "s-1", "growth rate, measured; 0 where not unstable"),
        Variable("growth_rate_stderr", "s-1", "standard error of the measured growth rate", comment=_SCATTER),
        Variable("frequency_theory", "rad s-1", "angular frequency, linear theory; 0 where not stable"),
        Variable("frequency", "rad s-1", "angular frequency, measured; 0 where not stable"),
        Variable(
            "frequency_stderr",
            "rad s-1",
            "standard error of the measured angular frequency",
            comment=_SCATTER,
        ),
        Variable(
            "growth_rate_logslope",
            "s-1",
            "growth rate by the slope of the logarithm of the transverse size",
            comment="missing where its window (2 to 1000 times the start, below 0.01 omega0) holds under two e-folds",
        ),
        Variable("e_folds", "1", "e-folds of growth inside the window of the log slope"),
        Variable("regime_theory", None, "regime, linear theory", "i1", REGIMES[1:]),
        Variable("regime", None, "regime, measured", "i1", REGIMES, first_flag=-1),
        Variable("shape", None, "kind of body by its moments", "i1", SHAPES),
        Variable("growing_fraction", "1", "share of the start that lies on the growing mode"),
        Variable("samples_used", "1", "number of samples inside the measurement window", "i4"),
        Variable("window_end", "s", "time of the last sample inside the measurement window"),
        Variable("steps_per_sample", "1", "integration steps between two samples", "i4"),
        Variable("status", None, "whether the measurement can be trusted", "i1", STATUSES),
        Variable(
            "triangle_margin",
            "1",
            "least of (Ib + Ic - Ia)/(I1 + I2 + I3) over the axes; negative where no body can exist",
        ),
        Variable("energy_drift", "1", "largest relative change of twice the kinetic energy"),
        Variable("momentum_drift", "1", "largest relative change of the squared angular momentum"),
        Variable(
            "perturbation_drift",
            "1",
            "largest change of the perturbation's own invariant, relative to its absolute terms",
            comment="Ib (Ib - Ia) wb^2 + Ic (Ic - Ia) wc^2, which sees errors that energy and momentum do not",
        ),
    )
}

COORDINATES = {
    variable.name: variable
    for variable in (
        Variable("axis", "1", "spin axis (1, 2 or 3)", "i1"),
        Variable("body", None, "body", "str"),
        Variable("I1", "kg m2", "principal moment of inertia about axis 1"),
        Variable("I2", "kg m2", "principal moment of inertia about axis 2"),
        Variable("I3", "kg m2", "principal moment of inertia about axis 3"),
        Variable("omega0", "rad s-1", "spin rate"),
        Variable("epsilon", "1", "size of the nudge relative to the spin rate"),
        Variable("phase", "rad", "direction of the nudge in the (b, c) plane"),
        Variable(
            "moments_are_ratios",
            None,
            "whether the moments are known as ratios only",
            "i1",
            ("kilogram_square_metres", "ratios"),
            "where 1, I1, I2 and I3 of the body are in a unit of their own",
        ),
    )
}

BYTES_PER_POINT = sum(np.dtype(variable.dtype).itemsize for variable in VARIABLES.values())


def evaluate(coordinates: Mapping[str, xr.DataArray], integration: Integration, threads: int = 1) -> xr.Dataset:
    """Measures the points of some coordinates.

    Args:
        coordinates: `DataArray`s named I1, I2, I3 (kg m2), axis (1, 2, 3), omega0 (rad s-1), epsilon (1) and phase
            (rad), of any dimensions; they broadcast together by name. Dask arrays stay lazy.
        integration: length, sampling and accuracy of each run.
        threads: threads that share the work of one call; they change no bit.

    Returns:
        A Dataset with the variables of `VARIABLES` over the dimensions of the coordinates.
    """
    arrays = [coordinates[name] for name in PARAMETERS]
    results = xr.apply_ufunc(
        partial(_columns, integration=integration, threads=threads),
        *arrays,
        output_core_dims=[[] for _ in VARIABLES],
        dask="parallelized",
        output_dtypes=[np.dtype(variable.dtype) for variable in VARIABLES.values()],
        keep_attrs=False,
    )
    named = zip(VARIABLES.values(), results, strict=True)
    return xr.Dataset(
        {v.name: (result.dims, result.data, v.attributes) for v, result in named},
        coords={name: array for name, array in _index_coordinates(arrays)},
    )


def _index_coordinates(arrays):
    for array in arrays:
        yield from array.coords.items()


def _columns(*arrays: np.ndarray, integration: Integration, threads: int) -> tuple[np.ndarray, ...]:
    """The kernel's columns for broadcastable arrays in the order of PARAMETERS, in the order of VARIABLES."""
    shape = np.broadcast_shapes(*(array.shape for array in arrays))
    flat = [np.broadcast_to(array, shape).reshape(-1) for array in arrays]
    settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)

    def part(bounds):
        return kernel.survey(
            {name: array[slice(*bounds)] for name, array in zip(PARAMETERS, flat, strict=True)}, *settings
        )

    cuts = np.linspace(0, flat[0].size, threads + 1).astype(int)
    bounds = list(pairwise(cuts))
    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(part, bounds)) if threads > 1 else [part(bounds[0])]
    return tuple(
        np.concatenate([columns[name] for columns in parts]).astype(variable.dtype, copy=False).reshape(shape)
        for name, variable in VARIABLES.items()
    )


def point_coordinates(grid: Grid, start: int, stop: int) -> dict[str, xr.DataArray]:
    """Coordinates of the points start … stop − 1 of a grid, along one dimension `point`."""
    return {name: xr.DataArray(values, dims="point") for name, values in grid.points(start, stop).items()}


def grid_coordinates(grid: Grid) -> dict[str, xr.DataArray]:
    """Coordinates of a whole grid, each along its own dimension (or along `body`), with their attributes."""
    arrays = {}
    for dim, values in grid.coordinates.items():
        arrays[dim] = xr.DataArray(values, dims=dim, coords={dim: values}, attrs=COORDINATES[dim].attributes)
    for name, values in grid.body_coordinates.items():
        dtype = COORDINATES[name].dtype
        arrays[name] = xr.DataArray(values.astype(dtype), dims="body", attrs=COORDINATES[name].attributes)
    return arrays


def survey_grid(definition: Definition, chunks=None, threads: int = 1) -> xr.Dataset:
    """The map of a definition as a Dataset over the grid's dimensions; lazy where `chunks` is given."""
    grid = Grid(definition)
    coordinates = grid_coordinates(grid)
    arrays = {name: coordinates[name] for name in PARAMETERS}
    if chunks is not None:
        sizes = _chunk_sizes(grid, chunks)
        arrays = {name: array.chunk({d: sizes[d] for d in array.dims}) for name, array in arrays.items()}
    dataset = evaluate(arrays, definition.integration, threads)
    dataset = dataset.assign_coords({name: array.variable for name, array in coordinates.items()})
    dataset = dataset.transpose(*grid.dims)
    return dataset.assign_attrs(provenance(definition))


def _chunk_sizes(grid: Grid, chunks) -> dict[str, int]:
    """Chunk length of each dimension: as given by name, or ("auto", or a number of points) the last ones whole."""
    if isinstance(chunks, Mapping):
        unknown = sorted(set(chunks) - set(grid.dims))
        if unknown:
            raise ValueError(f"chunks: {unknown} are no dimensions; allowed: {', '.join(grid.dims)}")
        return {dim: chunks.get(dim, size) for dim, size in zip(grid.dims, grid.shape, strict=True)}
    room = 2**18 if chunks == "auto" else int(chunks)
    sizes = {}
    for dim, size in zip(reversed(grid.dims), reversed(grid.shape), strict=True):
        sizes[dim] = max(1, min(size, room))
        room //= sizes[dim]
    return sizes


def provenance(definition: Definition) -> dict:
    """Global attributes of a map, but for its history and content hash, which storage adds."""
    return {
        "title": definition.title,
        "source": f"Polhode {version('polhode')} (Python {platform.python_version()}, NumPy {version('numpy')}, "
        f"Numba {version('numba')}), {definition.integration.propagator} integration of Euler's equations",
        "references": "Landau and Lifshitz, Mechanics, sections 36 and 37",
        "Conventions": CONVENTIONS,
        "contract_version": CONTRACT_VERSION,
        "definition": definition.text,
        "kernel_fingerprint": fingerprint(),
    }
