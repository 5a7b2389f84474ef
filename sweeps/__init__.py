"""Stability of rotating rigid bodies and other mechanical systems: measured maps, motions and answers.

Each command of `polhode` is a function here: `survey`, `open_map`, `point`, `critical`, `modes`, `response`, `body`,
`uncertainty`, `tumbler`, `motion`, `certify`, `run`; `content_hash` identifies a map; pictures are in `sweeps.plot` and
`ds.polhode`. Numbers are in SI units, or text with a unit: "30 rpm".

    >>> import sweeps
    >>> ds = sweeps.survey(I1=1.0, I2=2.0, I3=2.5, omega0="60 rpm", axes=[2])
    >>> round(ds.growth_rate.item(), 3)
    2.81
"""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypedDict, overload

import kernels
from sweeps import plot
from sweeps.schema.refusals import DefinitionError, MapError

if TYPE_CHECKING:
    from typing import Unpack

    import numpy as np
    import pandas as pd
    import xarray as xr

    from sweeps.mechanics import System
    from sweeps.systems.uncertain_bodies.body_answer import BodyAnswer

    Quantity: TypeAlias = float | str
    Body: TypeAlias = str | Mapping[str, Any] | Sequence[Quantity] | Sequence[Sequence[Quantity]] | np.ndarray

if getattr(kernels, "PROJECT", "") != "polhode":
    raise ImportError(f"kernels: {kernels.__file__} is another package; allowed: Polhode in an environment of its own")
if "xarray" in sys.modules:  # else `survey`, `open_map` and `plot` register it: `import sweeps` loads no library
    plot.register()


class BodySetting(TypedDict, total=False):
    """Further arguments of `sweeps.body`; see there."""

    omega0: "Quantity"
    epsilon: "Quantity"
    phase: "Quantity"
    omega: "Sequence[Quantity]"
    orbit: "Quantity"
    mu: "Quantity"
    uncertainty: "float | str | Mapping[str, Any]"
    draws: int
    seed: int
    method: str
    turns: float


class PeriodErrors(TypedDict, total=False):
    """Unit, convention and standard errors of the arguments of `sweeps.tumbler`; see there."""

    unit: str
    sigma_psi: "Quantity"
    sigma_phi: "Quantity"
    sigma_ratios: tuple[float, float]
    convention: str


def __getattr__(name: str) -> str:
    """Return `sweeps.__version__` when it is first used."""
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import version

    return version("polhode")


def survey(
    definition: "str | Path | Mapping[str, Any] | pd.DataFrame | xr.Dataset | None" = None,
    *,
    chunks: "int | str | Mapping[str, int] | None" = None,
    threads: int = 1,
    **keywords: Any,
) -> "xr.Dataset":
    """Measure a sweep and return its map.

    Args:
        definition: the path of a definition; the name of a shipped one; a mapping with its keys (its `system` may be a
            `sweeps.mechanics.System`); a DataFrame with a point in each row, its columns named as in a table ("omega0
            (rpm)"); a Dataset with the grid's coordinates. Left out, the keywords are all of it.
        chunks: None computes at once. A mapping of dimension to length, a number of points, or "auto" makes the
            Dataset lazy (Dask), to be computed by whatever scheduler is active.
        threads: threads that share the work where it is not lazy.
        keywords: keys of a definition (`axes`, `integration`, …) and of its grid (`I1`, `omega0`, …).

    Returns:
        The Dataset of results/README.md: variables over (axis, I1, I2, I3, omega0, epsilon, phase), or over
        (body, axis, …). Without `chunks` it carries its content hash.

    Raises:
        DefinitionError: naming key, value and the allowed values.

    Example:
        >>> ds = sweeps.survey(I1=1.0, I2=[1.5, 2.0], I3=2.5, omega0="30 rpm")
        >>> dict(ds.sizes)["axis"], dict(ds.sizes)["I2"]
        (3, 2)
    """
    from sweeps.maps import dataset
    from sweeps.points import in_memory_definitions

    plot.register()
    ds = dataset.survey_grid(in_memory_definitions.sweep_of(definition, keywords), chunks, threads)
    return ds if chunks is not None else ds.assign_attrs(content_hash=content_hash(ds))


def run(definition: str | Path, *, cores: int | None = None, again: bool = False, replace: bool = False) -> list[Path]:
    """Write the map, figures and report of a sweep to results/<sweep>, and return the files.

    Points that were measured for the same definition by the same kernels are kept; a finished sweep is only listed.

    Args:
        definition: the path of a definition, or the name of a shipped one.
        cores: number of processors, all by default; does not change results.
        again: compute everything again, finished or not.
        replace: replace the results of another definition that has the same file name.

    Raises:
        DefinitionError: naming key, value and the allowed values.

    Example:
        >>> [path.name for path in sweeps.run("tiny")]
        ['stability_map.nc', 'figures', 'report.html']
    """
    from sweeps.pipeline import run as pipeline
    from sweeps.points import catalogue

    return list(pipeline.run(catalogue.find_definition(str(definition)), cores, again, replace=replace))


def point(ds: "xr.Dataset | str | Path", **coordinates: "Quantity") -> "xr.Dataset":
    """Return every variable of a map at the grid point nearest to some coordinates.

    Args:
        ds: a map, or its path.
        coordinates: dimension → value. Dimensions of length one may be left out; modes, eigenvalues and multipliers
            without a value are returned whole.

    Returns:
        A Dataset of single values at the coordinates of the grid point. `sweeps.motion` takes it.

    Raises:
        SelectionError: for a dimension without a value, and a name or value that the map does not have.

    Example:
        >>> ds = sweeps.survey(I1=1.0, I2=[1.5, 2.0], I3=2.5, omega0=1.0)
        >>> sweeps.point(ds, axis=2, I2=1.9).I2.item()
        2.0
    """
    from sweeps.maps import selection

    plot.register()
    return selection.select_point(ds, coordinates)[0]


def critical(
    ds: "xr.Dataset | str | Path", along: str, *, definition: str | None = None, **coordinates: "Quantity"
) -> "xr.Dataset":
    """Return the values of a parameter at which the regime of a map changes, refined between its grid points.

    The smooth invariants of linear theory are solved for their zeros by measuring the system at new points; pairs of
    zeros between neighbouring grid points are found by an extremum between them.

    Args:
        ds: a map of equilibria, relative equilibria or periodic motions over a grid, or its path.
        along: the parameter; the changes are those on each line along it, in the direction of growing values.
        definition: name or path of the map's definition, if its system is a Python file.
        coordinates: dimension → value, to which the lines are restricted; the nearest grid value is used.

    Returns:
        A Dataset over `change`, with the coordinates of each line: `critical_value`, in the unit of the parameter, from
        measured invariants (missing where the fastest growth passes from one mode to another, which no invariant
        shows), `critical_value_error`, a bound on its distance from the critical value of the equations,
        `critical_value_theory`; `kind` (divergence, flutter, period_doubling, positive_multiplier, krein, restabilised,
        or undecided, if a regime beside it is not decided, or not measured as predicted); `regime_before` and
        `regime_after`, measured; `critical_mode`, the number of its mode, eigenvalue or multiplier (from 1), and
        `frequency_theory` (rad s-1) of it near the change. Zeros less than 1e-11 of the invariant's range beyond 0 are
        not searched for.

    Raises:
        RefusedError: for a map without modes, a parameter with fewer than three values, and a name or value that the
            map does not have.

    Example:
        >>> ds = sweeps.survey(system="sleeping_top", spin_rate=[3.0, 4.0, 5.0, 6.0])
        >>> changes = sweeps.critical(ds, "spin_rate")  # 2 √(I1 m g l)/I3
        >>> changes.kind.item(), round(changes.critical_value.item(), 9)
        ('restabilised', 4.714045208)
    """
    from sweeps.maps import critical_values

    plot.register()
    return critical_values.find_critical_values(ds, along, coordinates, definition)


def modes(
    ds: "xr.Dataset | str | Path", along: str | None = None, *, definition: str | None = None, **coordinates: "Quantity"
) -> "xr.Dataset":
    """Return the shapes of the modes of a map's points, and the modes' curves along a parameter.

    Shapes are computed for these points from the matrices and the runs behind the map's rates.

    Args:
        ds: a map of modes, eigenvalues or multipliers over a grid, or its path.
        along: a parameter along which modes are followed by the overlap of their states, through crossings and
            veerings, in place of their order by size.
        definition: name or path of the map's definition, if its system is a Python file.
        coordinates: dimension → value, to which the points are restricted; the nearest grid value is used.

    Returns:
        A Dataset over the map's dimensions and `component` (coordinates; or states of equations of first order, and
        where multipliers are modes: all states at the start of a period):
        `mode_shape_real` and `mode_shape_imag`, measured and with suffix _theory, with x^H M x = 1, M the kinetic
        matrix (of states: over the states' sizes), the first component within 1 % of the largest real and positive;
        `mode_shape_error` and `mode_shape_error_theory`, bounds on the deviation in that norm; all missing where modes
        are equal, so that a shape is not unique. `participation`, Re(conj(x_i) (M x)_i); the measured `eigenvalue_real`
        and `eigenvalue_imag` (s-1) with `eigenvalue_error`, `damping_ratio` and `log_decrement`; `whirl`, 1 forward,
        -1 backward, 0 planar, if the system has a plane; with `along` the number of each mode's `curve`, 0 if it is not
        known (where modes meet in rate and shape, as at the onset of flutter, curves end, and others begin with further
        numbers), and for each further parameter of several values `cut_<parameter>`: whether modes exchange their
        curves between this value and the next, as they do on a line that ends at an exceptional point.

    Raises:
        RefusedError: for a map without modes, and a name or value that the map does not have.

    Example:
        >>> ds = sweeps.survey(system="double_pendulum", mass2=1.0)
        >>> shape = sweeps.modes(ds, equilibrium="hanging").mode_shape_real.sel(mode=1).values.ravel()
        >>> round((shape[1] / shape[0]).item(), 9)  # √2
        1.414213562
    """
    from sweeps.maps.modes import select_points

    plot.register()
    return select_points(ds, along, coordinates, definition).modes()


def response(
    ds: "xr.Dataset | str | Path",
    force: Mapping[str, float],
    frequencies: "Sequence[Quantity] | np.ndarray",
    *,
    definition: str | None = None,
    **coordinates: "Quantity",
) -> "xr.Dataset":
    """Return the response of the linear motion about a stable equilibrium to a harmonic force.

    The force f cos(wt) makes the motion Re(Y exp(iwt)), with Y = (K - w^2 M + iwC)^-1 f by theory (C with gyroscopic, K
    with circulatory forces). Y is measured from the samples of an integrated motion over whole periods, from which the
    transient is removed by the flow over a period.

    Args:
        ds: a map of modes or of eigenvalues over a grid, or its path.
        force: coordinate → amplitude of its generalised force (of equations of first order: state → amplitude of what
            is added to its rate), all in phase.
        frequencies: angular frequencies w > 0, rad s-1.
        definition: name or path of the map's definition, if its system is a Python file.
        coordinates: dimension → value of the point; the nearest grid value is used.

    Returns:
        A Dataset over `angular_frequency` and `component`: `response_amplitude`, abs(Y) in the component's `unit`, and
        `response_phase` of Y (rad; negative behind the force), measured, with suffix _error, bounds on the deviation,
        and _theory. The measured ones are missing where an error exceeds a tenth, as at a resonance without damping.

    Raises:
        RefusedError: for a map without modes, a point that is not stable, and a name or value that the map does not
            have.

    Example:
        >>> ds = sweeps.survey(system="rotor", spin_rate=0.5)
        >>> shake = sweeps.response(ds, {"x": 1.0}, [0.5, 1.0])
        >>> [round(float(amplitude), 6) for amplitude in shake.response_amplitude.sel(component="x")]
        [1.331649, 14.583333]
    """
    from sweeps.maps.response import find_response

    plot.register()
    return find_response(ds, force, frequencies, coordinates, definition)


def body(
    body: "Body",
    *,
    axis: int | None = None,
    twist: bool = False,
    definition: str | Path = "bodies",
    **setting: "Unpack[BodySetting]",
) -> "BodyAnswer":
    """Predict whether a spin of a body is stable, with its margin, and what a spin about each principal axis does.

    Args:
        body: a name, or part of one, among the bodies of `definition`; three moments of inertia (kg m2); a tensor, 3 by
            3; a body's mapping as in a definition: {"ratios": …}, {"mesh": {"file": …, "density": …}}, or {"tensor": …}
            with mass (kg), size (three edges, m) and centre (m) for its diagnosis; a mapping of parts, {"parts":
            [{"name": "Bus", "box": [0.1, 0.1, 0.2], "mass": 2.0, "tolerance": {"mass": "5 %"}}, …]}, or a file of parts
            or of a robot, "sat.yaml" or "sat.yaml:deployed".
        axis: 1, 2 or 3; left out, all three, and `facts["verdict"]` states which spin is judged.
        twist: whether to add the twist about the handle.
        definition: the definition that lists a name.
        setting: omega0 (rad s-1), epsilon and phase of the perturbation; or omega, an angular velocity in any
            direction, in the axes of the tensor or mesh, otherwise about the principal axes (its mode, tilts and
            periods are `facts["rotation"]`); orbit, the altitude (km) of a circular orbit about the Earth, or its
            radius with mu (km3 s-2) of another body (stable orientations and librations: `facts["orbit"]`);
            uncertainty (0.05, "5 %", or a mapping), with draws, seed, method and turns: then bodies are sampled and
            measured.

    Returns:
        The answer: `print` shows it, `facts` contains its numbers, `meets("stable", 0.999)` compares the verdict with a
        requirement, and `write_definition` writes the body for sweeps.

    Raises:
        DefinitionError: naming the invalid argument and the allowed values.

    Example:
        >>> answer = sweeps.body([1.0, 2.0, 2.5], omega0="30 rpm")
        >>> [axis["regime"] for axis in answer.facts["axes"]]
        ['stable_minor', 'unstable', 'stable_major']
    """
    from sweeps.points import catalogue
    from sweeps.systems.uncertain_bodies import body_answer

    return body_answer.answer(body, axis, twist, definition, setting, catalogue.load_compiled)


def motion(
    system: "System | Body | xr.Dataset | Path",
    start: "Mapping[str, Any] | Sequence[Quantity] | None" = None,
    times: "Sequence[float] | Quantity | None" = None,
    *,
    parameters: "Mapping[str, Any] | None" = None,
    tolerance: float = 1e-12,
) -> "xr.Dataset":
    """Return the motion of a rigid body or of a described system, from any start, or at a point of a map.

    Args:
        system: a body as `body` takes it; a `sweeps.mechanics.System`, the path of a Python file that makes one, or the
            name of a shipped one; a point of a map from `point`.
        start: of a body, its three angular velocities (rad s-1) in the axes of its tensor or mesh, otherwise about its
            principal axes; or a mapping with omega1, omega2 and omega3, or with axis (a principal one), omega0, epsilon
            and phase, and with attitude (unit quaternion, scalar first, from these axes to space; by default, those at
            time 0). Left out, a spin about its intermediate axis. Of a described system, name → number, or one number a
            run, of each coordinate or state, and of velocities (`theta_dot`), which are 0 where they are not given.
        times: when the motion is wanted, s, ascending; the first is the start. Or a duration; of a body also None, for
            two flips or two wobble periods.
        parameters: of a described system, name → number, or one number a run; left out, the description's defaults.
        tolerance: of a described system, largest change by halving the steps, relative to the largest size of each
            state, 1e-13 to 1e-3; of a body, of the direct integration.

    Returns:
        A Dataset over `time`. Of a body: angular velocity omega1 … omega3 and attitude q0 … q3 (unit quaternion, scalar
        first, from the body's axes to those of space) in closed form, and (suffix _direct) by direct integration, in
        the body's axes that the attribute `frame` names. Of a described system: each state, its `_error`, and `status`,
        also over `run` where lists are given.

    Raises:
        DefinitionError: naming the invalid argument and the allowed values.

    Example:
        >>> ds = sweeps.motion([1.0, 2.0, 2.5], {"axis": 2, "omega0": "60 rpm", "epsilon": 0.01})
        >>> bool(ds.omega2.min() < -6)  # it flips
        True
        >>> pendulum = sweeps.motion("pendulum", {"theta": "170 deg"}, "2 s", parameters={"length": 1.0})
        >>> str(pendulum.status.item())
        '0'
    """
    import xarray as xr

    from sweeps.maps import motion
    from sweeps.points import catalogue
    from sweeps.systems import trajectories
    from sweeps.systems.rigid_body import spin_outcomes
    from sweeps.systems.rigid_body.motion import integrate_from, spin_of

    if isinstance(system, xr.Dataset):
        return motion.point_motion(system, times, tolerance)
    is_described_system = trajectories.is_described(system)
    if isinstance(system, str) and not is_described_system:  # part of a body's name, or else a described system's name
        names = spin_outcomes.bodies_by_name(catalogue.load_definition("bodies"), "bodies")
        is_described_system = not any(system.strip().lower() in name.lower() for name in names)
    if is_described_system:
        start, times = ({} if start is None else start), ([] if times is None else times)
        return trajectories.integrate_motions(system, start, times, parameters or {}, tolerance)
    chosen_body, spun = spin_outcomes.body_of(system, "bodies", spin_of(start), catalogue.load_definition)
    return integrate_from(chosen_body, spun, start, times, tolerance)


def certify(
    run: "str | Path | Mapping[str, Any] | pd.DataFrame | xr.Dataset",
    body: "Body",
    *,
    tolerance: float = 1e-6,
    fit_start: bool = False,
    frame: str = "inertial",
    definition: str | Path = "bodies",
    **options: Any,
) -> "xr.Dataset":
    """Compare the rotation of a free rigid body in a file with the exact motion, and diagnose its errors.

    Args:
        run: a file (.csv, .parquet, .nc, or .aem: CCSDS AEM), a DataFrame, a Dataset, or a mapping of names to arrays,
            with a time and with attitudes or angular velocity in the body's axes, or both.
        body: as `body` takes it.
        tolerance: allowed error of attitudes, rad, and of rates relative to the size of omega of the first row.
        fit_start: whether the exact motion is fitted to all rows; else it begins at the first row. Of attitudes alone
            the rates at the start are fitted.
        frame: "inertial", or "local": the frame of the attitudes turns at `frame_rate` about `frame_axis`.
        definition: the definition that lists a name.
        options: frame_rate (rad s-1, default that of the Earth) and frame_axis (in the axes of the frame; left out,
            north-east-down at the file's longitude and latitude); where names of columns say too little, columns (role
            → names), time_unit, angle_unit, rate_unit, sequence (of Euler angles, as in SciPy), scalar ("first" or
            "last"), direction ("body-to-space" or "space-to-body").

    Returns:
        A Dataset over `time` (s, from the first row): attitude_error (rad), rates_error (relative), and the exact
        motion in the principal axes, omega1 … omega3 and q0 … q3. Its attributes are the verdict ("pass", "fail" or
        "ill_conditioned"), diagnosis and evidence, errors and conditioning, as `polhode certify --json` prints them.

    Raises:
        DefinitionError: naming what cannot be judged and what is allowed.

    Example:
        >>> run = sweeps.motion([1.0, 2.0, 2.5], [0.1, 1.0, 0.2], "20 s")
        >>> sweeps.certify(run, [1.0, 2.0, 2.5]).attrs["verdict"]
        'pass'
    """
    from sweeps.certification import judging
    from sweeps.points import catalogue
    from sweeps.systems.rigid_body import spin_outcomes

    chosen_body, _ = spin_outcomes.body_of(body, definition, {}, catalogue.load_definition)
    return judging.certify(run, chosen_body, tolerance, fit_start, frame, options)


def uncertainty(
    bodies: "Body | Sequence[Mapping[str, Any]]",
    uncertainty: "float | str | Mapping[str, Any]",
    *,
    omega0: "Quantity" = 1.0,
    chunks: "int | str | Mapping[str, int] | None" = None,
    threads: int = 1,
    **more: Any,
) -> "xr.Dataset":
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
        DefinitionError: naming key, value and the allowed values.

    Example:
        >>> ds = sweeps.uncertainty([1.0, 2.0, 2.1], "5 %", draws=64)
        >>> bool(ds.probability_unstable.sel(axis=3).item() > 0.1)
        True
    """
    from sweeps.systems.uncertain_bodies.sampled_body import definition_of

    return survey(definition_of(bodies, uncertainty, omega0, more), chunks=chunks, threads=threads)


def open_map(path: str | Path, **options: Any) -> "xr.Dataset":
    """Open a map after checking it; the Dataset may be trusted.

    Args:
        path: the file, results/<sweep>/stability_map.nc, or its folder.
        options: passed on to `xarray.open_dataset`: `chunks={}` for Dask arrays.

    Returns:
        The Dataset of results/README.md, read where it is used.

    Raises:
        MapError: for a file that is missing, damaged, or not a map.

    Example:
        >>> ds = sweeps.open_map(sweeps.run("tiny")[0])
        >>> ds.attrs["system"]
        'rigid_body'
    """
    from sweeps.maps import storage

    plot.register()
    return storage.open_map(path, **options)


def content_hash(ds: "xr.Dataset") -> str:
    """Return the content hash of a map: SHA-256 of names, dimensions, types and values, without attributes.

    Maps of equal content have equal hashes, whoever measured them, in how many shards, and however they are stored.

    Args:
        ds: a map, computed or lazy; lazy variables are computed one at a time.

    Returns:
        64 hexadecimal digits, those that `survey` and `run` store as the map's attribute `content_hash`.

    Example:
        >>> ds = sweeps.survey(I1=1.0, I2=[1.5, 2.0], I3=2.5, omega0="30 rpm")
        >>> sweeps.content_hash(ds) == ds.content_hash
        True
    """
    from sweeps.shards import content_hash as hashes

    return hashes.content_hash(ds)


@overload
def tumbler(
    P_psi: "Quantity", P_phi: "Quantity", *, ratios: None = None, **errors: "Unpack[PeriodErrors]"
) -> "xr.Dataset": ...


@overload
def tumbler(
    P_psi: "Quantity", P_phi: "Quantity", *, ratios: tuple[float, float], **errors: "Unpack[PeriodErrors]"
) -> list[dict[str, Any]]: ...


def tumbler(
    P_psi: "Quantity",
    P_phi: "Quantity",
    *,
    unit: str = "h",
    sigma_psi: "Quantity" = 0.0,
    sigma_phi: "Quantity" = 0.0,
    ratios: tuple[float, float] | None = None,
    sigma_ratios: tuple[float, float] = (0.0, 0.0),
    convention: str = "long",
) -> "list[dict[str, Any]] | xr.Dataset":
    """Return the energies of a tumbling body that give two observed periods.

    Args:
        P_psi: period of the angular velocity in the body.
        P_phi: mean period of its axis of least moment about the angular momentum (the long-axis convention).
        unit: of both periods and their errors where they are numbers: "s", "min", "h" or "d".
        sigma_psi: standard error of P_psi.
        sigma_phi: standard error of P_phi.
        ratios: (I1/I3, I2/I3) of one body; left out, every possible body.
        sigma_ratios: standard errors of both ratios.
        convention: "long", or "short" if P_phi is of the axis of greatest moment, or "unknown" if both are periods of
            lines of a light curve, in any order.

    Returns:
        With `ratios`, for each mode {mode, verdict, sigma, least_ratio} and, if a motion has both periods, {energy,
        energy_stderr, m, omega0}: the energy 2T I3/L^2 and omega0 = L/I3 in rad s-1, NaN if the separatrix is so
        near that the energy is not determined, nutation, the angles of the long axis from L, and P_phi_short_axis. In
        an unknown convention, {lines, P_psi, P_phi, modes} of each pair of periods that a body can have. Else the map
        of the system `observed_periods` over all shapes of bodies, as `survey` gives it.

    Raises:
        DefinitionError: for ratios of no rigid body, and for numbers out of range.

    Example:
        >>> [answer["verdict"] for answer in sweeps.tumbler(368.7, "67.27 h", ratios=(0.36, 0.96))]
        ['possible', 'possible']
    """
    from sweeps.systems.observed_periods import answers, assignments

    periods = answers.TwoPeriods(P_psi, P_phi, sigma_psi, sigma_phi, unit)
    if convention == "unknown":
        return assignments.list_assignments(periods, ratios, sigma_ratios)
    periods = assignments.known_periods(periods, convention)
    return survey(periods.definition) if ratios is None else answers.periods_of_body(periods, ratios, sigma_ratios)


__all__ = [
    "DefinitionError",
    "MapError",
    "body",
    "certify",
    "content_hash",
    "critical",
    "modes",
    "motion",
    "open_map",
    "plot",
    "point",
    "response",
    "run",
    "survey",
    "tumbler",
    "uncertainty",
]


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
