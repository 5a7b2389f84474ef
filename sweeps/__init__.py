"""Everything of Polhode with a name, a unit or a file: definitions, grids, datasets, storage, figures.

import sweeps
ds = sweeps.survey("sweeps/definitions/tiny.yaml")
ds = sweeps.open_map("results/tiny/stability_map.nc")
ax = sweeps.plot.stability(ds, axis=2)  # or ds.polhode.stability(axis=2)
"""

import sys

from sweeps import plot

if "xarray" in sys.modules:  # else `survey`, `open_map` and `plot` register it: `import sweeps` loads no library
    plot.register()


def __getattr__(name: str) -> str:
    """Return `sweeps.__version__` when it is first used."""
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import version

    return version("polhode")


def survey(definition, *, chunks=None, threads: int = 1):
    """Measure a sweep and return its map as an `xarray.Dataset`.

    Args:
        definition: the path of a definition, the name of one that ships, or a mapping with its keys, whose `system`
            may be a `sweeps.mechanics.System`.
        chunks: None computes at once. A mapping of dimension to length, a number of points, or "auto" makes the
            Dataset lazy (Dask), to be computed by whatever scheduler is active.
        threads: threads that share the work where it is not lazy.

    Returns:
        The Dataset of results/README.md: variables over (axis, I1, I2, I3, omega0, epsilon, phase), or over
        (body, axis, …). Without `chunks` it carries its content hash.

    Raises:
        DefinitionError: naming key, value and what is allowed.
    """
    from collections.abc import Mapping

    from sweeps.maps import dataset
    from sweeps.points import catalogue
    from sweeps.points.loading import read
    from sweeps.shards import content

    plot.register()
    source = definition if isinstance(definition, Mapping) else catalogue.resolve(str(definition))
    if isinstance(definition, Mapping) and not isinstance(definition.get("system", ""), str):
        from sweeps import mechanics, systems

        if isinstance(definition["system"], mechanics.System):
            source = {**definition, "system": systems.built(definition["system"])}
    ds = dataset.survey_grid(read(source), chunks, threads)
    return ds if chunks is not None else ds.assign_attrs(content_hash=content.content_hash(ds))


def motion(system, start, times, *, parameters=None, tolerance: float = 1e-12):
    """Integrate motions of a described system, near an equilibrium or far from any, from one start or many.

    Args:
        system: a `sweeps.mechanics.System`, the path of a Python file that makes one, or the name of one that ships.
        start: state at the first time: name → number, or one number a run, of each coordinate or state, and of
            velocities (`theta_dot`), which are 0 where they are not given.
        times: where the motion is wanted, s, ascending; the first is the start.
        parameters: name → number, or one number a run; left out, the description's defaults.
        tolerance: largest change by halving the steps, relative to the largest size of each state; 1e-13 to 1e-3.

    Returns:
        A Dataset over (run, time), or (time) where all are numbers: each state, its `_error`, and `status`.

    Raises:
        DefinitionError: naming what is wrong and what is allowed.
    """
    from sweeps.systems.trajectories import trajectories

    return trajectories(system, start, times, parameters or {}, tolerance)


def uncertainty(bodies, uncertainty, *, omega0: float = 1.0, chunks=None, threads: int = 1, **more):
    """Sample bodies with uncertain moments, measure every draw, and return probabilities and quantiles.

    Args:
        bodies: (I1, I2, I3); a tensor of inertia, 3 by 3; a body's mapping as in a definition (`bodies:`); or a list of
            such mappings.
        uncertainty: of all bodies that give none of their own: 0.05, "5 %", or a mapping as in a definition.
        omega0: spin rate of bodies that give none of their own, rad s-1.
        chunks: as in `survey`.
        threads: as in `survey`.
        more: further keys of a definition: draws, seed, method, turns, keep, axes, grid, integration.

    Returns:
        The Dataset of results/README.md for uncertain bodies, over (body, axis, …), `quantile` and `input`.

    Raises:
        DefinitionError: naming key, value and what is allowed.
    """
    from sweeps.systems.uncertain_bodies.asked import definition_of

    return survey(definition_of(bodies, uncertainty, omega0, more), chunks=chunks, threads=threads)


def open_map(path, **options):
    """Open a map after checking it; see `sweeps.maps.storage.open_map`."""
    from sweeps.maps import storage

    plot.register()
    return storage.open_map(path, **options)


def tumbler(P_psi, P_phi, *, unit="h", sigma_psi=0.0, sigma_phi=0.0, ratios=None):
    """Return the energies of a tumbling body that give two observed periods.

    Args:
        P_psi: period of the angular velocity in the body.
        P_phi: mean period of its axis of least moment about the angular momentum (the long-axis convention).
        unit: of both periods and their errors: "s", "h" or "d".
        sigma_psi: standard error of P_psi.
        sigma_phi: standard error of P_phi.
        ratios: (I1/I3, I2/I3) of one body; left out, every body that can exist.

    Returns:
        With `ratios`, for each mode {mode, verdict, sigma, least_ratio} and, where a motion has both periods, {energy,
        energy_stderr, m, omega0}: the energy 2T I3/L^2 and omega0 = L/I3 in rad s-1. Else the map of the system
        `observed_periods` over all shapes of bodies, as `survey` gives it.

    Raises:
        DefinitionError: for ratios of no rigid body, and for numbers out of range.
    """
    from sweeps.systems.observed_periods import answers

    periods = answers.TwoPeriods(P_psi, P_phi, sigma_psi, sigma_phi, unit)
    return survey(periods.definition) if ratios is None else answers.of_body(periods, *ratios)
