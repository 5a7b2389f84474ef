"""Checks of a map against its definition and its kernels, with each difference in words.

`verify` trusts no hash and no coordinate of the file: both are computed again from the definition, and points of a
random sample are measured again by this project's kernels, by SciPy and by the closed form. A system that a user's
Python file describes is never run.
"""

import math
import os
import re
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweeps import systems
from sweeps.maps import storage, validation
from sweeps.points import catalogue
from sweeps.points.columns import measure_points
from sweeps.points.loading import read_sweep
from sweeps.points.sweep import Sweep
from sweeps.reading.definitions import mapping_of
from sweeps.reading.files import FileBytes
from sweeps.reading.hdf5 import read_structure
from sweeps.schema import DEFAULT_SYSTEM
from sweeps.schema.definition import DEFAULT_NAME, Definition
from sweeps.schema.iteration import runs
from sweeps.schema.refusals import DefinitionError, UnreadableError, cut_text
from sweeps.schema.variables import Role, of_role
from sweeps.shards import content_hash, contract
from sweeps.systems.system import Reference

BLOCK_POINTS = 2**18
MAX_LISTED = 3  # findings of one kind that are listed; further findings are counted
MAX_SAMPLE_POINTS = 100_000  # limit of --points; a sample of so many points already takes minutes
MAX_CHECK_SECONDS = 60.0  # approximate duration of one check of a sample; the remaining points are then left out
# attributes of a variable in the file that belong to netCDF-4 or to the content hash
FILE_ATTRIBUTES = ("_FillValue", "_Netcdf4Coordinates", "_Netcdf4Dimid", "CLASS", "NAME", "sha256")
ATTITUDE_MOTIONS = 5  # SciPy integrates the quaternions of this many motions of the sample, which takes seconds


@dataclass(frozen=True)
class Check:
    """One check of a map and its result."""

    name: str  #: name of the check, as printed
    covers: str  #: compared quantities, one line
    findings: tuple[str, ...] = ()  #: differences, one line each; empty if there is none
    skip_reason: str = ""  #: why the check was not possible, or ""


def verify(
    path: str | Path, points: int = 100, seed: int = 0, expected_sweep: Sweep | None = None, any_kernels: bool = False
) -> list[Check]:
    """Return the checks of a map, in order; the map agrees with its definition if no check has findings.

    Args:
        path: a map, or its folder.
        points: number of random points that are measured again, 0 to `MAX_SAMPLE_POINTS`.
        seed: of the random choice of points, 0 or more.
        expected_sweep: the sweep from which the map should have been made; None for the definition in the file.
        any_kernels: True to accept a map that was made by different kernels or on a different machine.

    Raises:
        DefinitionError: for a number of points or a seed that is out of range.
    """
    if not 0 <= points <= MAX_SAMPLE_POINTS:
        raise DefinitionError(f"--points: {points} is out of range; allowed: 0 to {MAX_SAMPLE_POINTS:,}")
    if seed < 0:
        raise DefinitionError(f"--seed: {seed} is out of range; allowed: 0 or more")
    with storage.open_map(path, any_flags=True) as ds:
        checks = [_check_content(ds)]
        sweep, check = _check_definition(ds, expected_sweep)
        checks.append(check)
        if sweep is None:
            reason = check.skip_reason or "its definition cannot be read"
            return [*checks, *(Check(name, "", skip_reason=reason) for name in ("kernels", "grid", "values", "sample"))]
        checks += [_check_kernels(ds, sweep, any_kernels), _check_grid(ds, sweep)]
        if checks[-1].findings:
            return [*checks, *(Check(name, "", skip_reason="its grid is another") for name in ("values", "sample"))]
        checks += [_check_attributes(path, sweep), _check_values(ds, sweep)]
        return [*checks, *_check_sample(ds, sweep, points, seed)]


def _shorten(findings: list[str]) -> tuple[str, ...]:
    more = [f"and {len(findings) - MAX_LISTED:,} more"] if len(findings) > MAX_LISTED else []
    return (*findings[:MAX_LISTED], *more)


# -- checks of the file alone


def _check_content(ds: xr.Dataset) -> Check:
    """Check that the values of each variable still have the hash that was written with them."""
    digest = content_hash.hash_content(ds, BLOCK_POINTS)
    stored_hashes = {name: str(variable.encoding.get("sha256", "")) for name, variable in ds.variables.items()}
    names = [n for n, actual in digest.digests().items() if stored_hashes[n] and stored_hashes[n] != actual]
    findings = [f"{name}: holds other values than were written" for name in names]
    if not findings and digest.hexdigest() != str(ds.attrs.get("content_hash", "")):
        problem = "is missing" if "content_hash" not in ds.attrs else "is not that of what the file holds"
        findings = [f"content_hash: {problem}"]
    return Check("content", f"SHA-256 of {len(stored_hashes)} variables", tuple(findings))


def _check_definition(ds: xr.Dataset, expected_sweep: Sweep | None) -> tuple[Sweep | None, Check]:
    """Return the sweep of the definition in the file (None if it cannot be read), and the check of the definition."""
    name, covers = "definition", "the one in the file" + (f", against {expected_sweep.name}" if expected_sweep else "")
    text = ds.attrs.get("definition", "")
    if expected_sweep is not None and text == expected_sweep.definition.text:
        differs = str(ds.attrs.get("inputs", "")) != expected_sweep.definition.inputs
        input_findings = ("inputs: a file of its bodies or points was another",) if differs else ()
        return expected_sweep, Check(name, covers, input_findings)
    try:
        values = mapping_of(text)
        if (file_reason := _needs_files(values)) is not None:
            return None, Check(name, covers, skip_reason=file_reason)
        sweep = read_sweep(values, expected_sweep.name if expected_sweep else DEFAULT_NAME)
    except (DefinitionError, UnreadableError) as error:
        return None, Check(name, covers, (f"definition: cannot be used ({cut_text(str(error))!r})",))
    findings, definition = [], sweep.definition
    if definition.system != str(ds.attrs.get("system", DEFAULT_SYSTEM)):
        findings.append(f"system: the file says {ds.attrs.get('system')!r}, its definition {definition.system!r}")
    if expected_sweep is not None:
        keys = _differing_keys(definition, expected_sweep.definition)
        findings += [f"definition: another {key} than {expected_sweep.name}'s" for key in keys]
    return sweep, Check(name, covers, tuple(findings))


def _needs_files(values: dict) -> str | None:
    """Return why the definition in a map is not used, if it names further files; these are read only on request."""
    if systems.is_file(values.get("system")):
        return "its system is a Python file, run only where --definition names it"
    if "table" in values:
        return "its points are those of a table, read only where --definition names it"
    try:
        system = systems.resolve(str(values.get("system", DEFAULT_SYSTEM)))
    except KeyError:  # which reading it will refuse
        return None
    return system.model.needs_files(values) or None


def _differing_keys(definition: Definition, reference: Definition) -> list[str]:
    """Return the keys in which two definitions differ, except for the number of shards, which changes no result."""
    values, expected_values = definition.model_dump(exclude={"shards"}), reference.model_dump(exclude={"shards"})
    return [key for key in {**values, **expected_values} if values.get(key, ...) != expected_values.get(key, ...)]


def _check_kernels(ds: xr.Dataset, sweep: Sweep, any_kernels: bool) -> Check:
    """Return the check of the map's kernel fingerprint against that of these kernels."""
    check = Check("kernels", "fingerprint of sources, versions and processor")
    if _has_same_kernels(ds, sweep):
        return check
    problem = "kernel_fingerprint: made by other kernels, or by these on another machine"
    return replace(check, skip_reason=problem) if any_kernels else replace(check, findings=(problem,))


def _has_same_kernels(ds: xr.Dataset, sweep: Sweep) -> bool:
    return str(ds.attrs.get("kernel_fingerprint", "")) == sweep.system.fingerprint()


# -- checks by the definition


def _check_grid(ds: xr.Dataset, sweep: Sweep) -> Check:
    """Check dimensions, coordinates and variables of the map against its definition."""
    grid = sweep.grid
    covers = f"{grid.size:,} points: dimensions, coordinates, {len(sweep.variables)} variables"
    sizes = grid.sizes | grid.extra_sizes
    if dict(ds.sizes) != sizes:
        return Check("grid", covers, (f"dimensions: {_sizes_text(ds.sizes)}, by the definition {_sizes_text(sizes)}",))
    # dimensions and types of variables were compared with the system's when the map was opened
    missing = [f"{name}: is missing" for name in sweep.variables if name not in ds.variables]
    return Check("grid", covers, _shorten([*_wrong_coordinates(ds, sweep), *missing]))


def _sizes_text(sizes: Mapping) -> str:
    return " × ".join(f"{size:,} {cut_text(str(dim))}" for dim, size in sizes.items()) or "none"


def _wrong_coordinates(ds: xr.Dataset, sweep: Sweep) -> Iterator[str]:
    """Yield a message for each coordinate that differs from the definition's, and for each unknown variable."""
    expected = contract.coordinates(sweep)
    for name, (dims, values, _) in expected.items():
        if name not in ds.variables:
            yield f"{name}: is missing"
            continue
        coordinate = ds.variables[name]
        boxes = runs(coordinate.shape, BLOCK_POINTS)
        if coordinate.dims != dims or (
            coordinate.dtype.kind != values.dtype.kind and coordinate.dtype.kind not in "OU"
        ):
            yield f"{name}: is no coordinate along {', '.join(dims)} of type {values.dtype}"
        elif any(content_hash.as_bytes(coordinate[box].values) != content_hash.as_bytes(values[box]) for box in boxes):
            yield f"{name}: has other values than the definition's"
    all_names = {*map(str, ds.variables)} | set(ds.encoding.get("ignored", ()))
    for name in all_names - set(expected) - set(sweep.variables):
        yield f"{cut_text(repr(name))}: is no variable of this map"


def _check_attributes(path: str | Path, sweep: Sweep) -> Check:
    """Check the attributes in the file against those of the definition and its system.

    Further programs read them from the file; `open_map` reads them from the system's own tables.
    """
    with closing(FileBytes(validation.map_of(path))) as file:
        structure = read_structure(file)
    expected = {name: dict(attributes) for name, (_, _, attributes) in contract.coordinates(sweep).items()}
    expected |= {name: spec.attributes_among(sweep.variables) for name, spec in sweep.variables.items()}
    findings = []
    for name, attributes in expected.items():
        attributes_in_file = structure.variables[name].attributes
        in_map = {key: _as_text(value) for key, value in attributes_in_file.items() if key not in FILE_ATTRIBUTES}
        attributes = {key: _as_text(value) for key, value in attributes.items()}
        keys = [key for key in {**attributes, **in_map} if attributes.get(key) != in_map.get(key)]
        findings += [f"{name}: {_difference(key, attributes, in_map)}" for key in sorted(keys)]
    global_attributes = {key: str(value) for key, value in contract.provenance(sweep).items()}
    in_map = {key: _as_text(value) for key, value in structure.attributes.items()}
    keys = ["references", "Conventions"] + ["title"] * ("title" in mapping_of(sweep.definition.text))
    keys = [key for key in keys if in_map.get(key) != global_attributes[key]]
    findings += [f"(file): {_difference(key, global_attributes, in_map)}" for key in keys]
    method = global_attributes["source"].partition("), ")[2]  # the text before it lists versions
    if not re.fullmatch(rf"Polhode [^()]*\([^()]*\), {re.escape(method)}", in_map.get("source", "")):
        findings.append(f"(file): {_difference('source', global_attributes, in_map)}")
    covers = f"names, units and meanings of {len(expected)} variables, and of the file"
    return Check("attributes", covers, _shorten(findings))


def _as_text(value: Any) -> str:
    return " ".join(map(str, np.atleast_1d(value)))


def _difference(key: str, expected: Mapping[str, str], stored: Mapping[str, str]) -> str:
    """Return how a stored attribute differs from the expected one, as a clause of a message."""
    if key not in stored:
        return f"{cut_text(key)} is missing"
    value = cut_text(repr(expected[key])) if key in expected else "there is none"
    return f"{cut_text(key)} is {cut_text(repr(stored[key]))}, by the definition {value}"


def _check_values(ds: xr.Dataset, sweep: Sweep) -> Check:
    """Check that every flag has a meaning, and every point with status ok has numbers."""
    specs, status = sweep.variables, of_role(sweep.variables, Role.STATUS)
    measured = [name for name, spec in specs.items() if status and spec.role == Role.MEASUREMENT]
    unknown_flags: Counter[str] = Counter()
    empty: Counter[str] = Counter()
    for box in runs(sweep.grid.shape, BLOCK_POINTS):
        for name in (name for name, spec in specs.items() if spec.flags):
            values, first_flag = ds.variables[name][box].values, specs[name].first_flag
            has_no_meaning = (values < first_flag) | (values >= first_flag + len(specs[name].flags))
            unknown_flags[name] += int(np.count_nonzero(has_no_meaning))
        for name in measured:
            is_ok = ds.variables[status][box].values == 0
            is_missing = is_ok & ~np.isfinite(ds.variables[name][box].values)
            empty[name] += int(np.count_nonzero(is_missing))
    findings = [f"{name}: {count:,} flags without a meaning" for name, count in unknown_flags.items() if count]
    findings += [f"{name}: {count:,} points without a number are called ok" for name, count in empty.items() if count]
    return Check("values", "flags, and a number at every point called ok", tuple(findings))


# -- a sample, measured again


@dataclass(frozen=True)
class _Sample:
    """Points of a map with their numbers in the grid and the values of all variables."""

    numbers: np.ndarray
    points: dict[str, np.ndarray]
    columns: dict[str, np.ndarray]

    def name(self, i: int) -> str:
        return f"point {self.numbers[i]}"

    def at(self, i: int) -> dict:
        return {name: values[i] for name, values in self.points.items()}


def _check_sample(ds: xr.Dataset, sweep: Sweep, count: int, seed: int) -> Iterator[Check]:
    """Yield the checks of randomly drawn points: bits, references, attitude and errors."""
    if count < 1:
        return
    sample = _draw_sample(ds, sweep, count, seed)
    yield _check_bits(ds, sweep, sample, seed)
    yield from _check_references(sweep, sample)
    if sweep.definition.follows_attitude:
        yield _check_attitude(sweep, sample)
    yield from _check_errors(sweep, sample)


def _draw_sample(ds: xr.Dataset, sweep: Sweep, count: int, seed: int) -> _Sample:
    """Return random points of the grid with the map's columns at them."""
    grid = sweep.grid
    numbers = np.unique(np.random.default_rng(seed).integers(0, grid.size, count))
    all_points = [grid.points(int(number), int(number) + 1) for number in numbers]
    points = {name: np.concatenate([point[name] for point in all_points]) for name in grid.arguments}
    columns = {name: _read_points(ds.variables[name], numbers, len(grid.dims)) for name in sweep.variables}
    return _Sample(numbers, points, columns)


def _read_points(variable: xr.Variable, numbers: np.ndarray, point_dims: int) -> np.ndarray:
    """Return the values of a variable at the points with these numbers, ascending; each block is read at most once.

    The first `point_dims` dimensions of the variable are those of the points.
    """
    chunks, start, value_shape = [], 0, variable.shape[point_dims:]
    for box in runs(variable.shape[:point_dims], max(1, BLOCK_POINTS // math.prod(value_shape))):
        end = start + variable[box].size // math.prod(value_shape)
        low, high = np.searchsorted(numbers, (start, end))
        if low < high:
            chunks.append(variable[box].values.reshape(-1, *value_shape)[numbers[low:high] - start])
        start = end
    return np.concatenate(chunks)


def _check_bits(ds: xr.Dataset, sweep: Sweep, sample: _Sample, seed: int) -> Check:
    """Check that the kernels that made the map give the same bits now."""
    from kernels.compile.blocks import W

    name, count = "this project's kernels", len(sample.numbers)
    covers = f"{count:,} points (seed {seed}), bit for bit"
    if reason := sweep.definition.differing_bits if _has_same_kernels(ds, sweep) else "other kernels make other bits":
        return Check(name, covers, skip_reason=reason)
    run_samples, rate = sweep.system.cost(sweep.definition).samples, sweep.system.samples_per_second
    if W * run_samples > MAX_CHECK_SECONDS * rate:  # a point takes as long as a block of them
        too_long = f"a run of {run_samples:,} samples takes more than {MAX_CHECK_SECONDS:g} s"
        return Check(name, covers, skip_reason=too_long)
    findings, last_point = [], 0
    step = max(W, int(rate / run_samples))  # a second's work
    for numbers in _within_time([range(at, min(at + step, count)) for at in range(0, count, step)]):
        findings += _differing_bits(sweep, sample, numbers)
        last_point = numbers.stop
    time_note = "" if last_point == count else f"; {last_point:,} of them, no more in {MAX_CHECK_SECONDS:g} s"
    return Check(name, covers + time_note, _shorten(findings))


def _differing_bits(sweep: Sweep, sample: _Sample, numbers: range) -> list[str]:
    """Return a finding for each point and variable that has different bits if it is measured again."""
    rows = slice(numbers.start, numbers.stop)
    new_columns = measure_points({name: values[rows] for name, values in sample.points.items()}, sweep)
    findings = []
    for variable, map_values in sample.columns.items():
        for i, old, new in zip(numbers, map_values[rows], new_columns[variable], strict=True):
            if old.tobytes() != new.tobytes():
                comparison = f"the map holds {_value_text(old)}, measured again {_value_text(new)}"
                findings.append(f"{variable} at {sample.name(i)}: {comparison}")
    return findings


def _value_text(value: np.ndarray | np.generic) -> str:
    return f"{value:.17g}" if np.ndim(value) == 0 else f"{np.size(value)} values"


def _within_time(items: Sequence) -> Iterator:
    """Yield items until `MAX_CHECK_SECONDS` after the end of the first: compiling and loading do not count."""
    end = math.inf
    for item in items:
        if time.monotonic() > end:
            return
        yield item
        end = min(end, time.monotonic() + MAX_CHECK_SECONDS)


def _check_references(sweep: Sweep, sample: _Sample) -> Iterator[Check]:
    """Yield the checks of the sample by SciPy and by the closed form, within the definition's tolerance."""
    first = sweep.system.reference()
    references = () if first is None else (first, *first.more)
    yield from (_check_reference(sweep, sample, reference, name) for reference in references for name in reference.ways)


def _check_reference(sweep: Sweep, sample: _Sample, reference: Reference, name: str) -> Check:
    """Return the check of a variable at sampled points against one independent method of computation."""
    variable, integration = reference.variable, sweep.definition.integration
    status = of_role(sweep.variables, Role.STATUS)
    covers = f"{variable} within the tolerance"
    if variable not in sample.columns or not status:
        return Check(name, covers, skip_reason=f"the map has no {variable} with a status")
    findings, num_compared, count = [], 0, 0
    # `_check_values` finds values that are missing without a reason: principal spin and separatrix have no period
    usable_points = np.flatnonzero((sample.columns[status] == 0) & ~np.isnan(sample.columns[variable]))
    errors = sample.columns.get(sweep.variables[variable].error) if reference.within_error else None
    for i in _within_time(usable_points):
        count += 1
        point, map_value = sample.at(i), float(sample.columns[variable][i])
        with np.errstate(all="ignore"):
            value = reference.ways[name](point, integration)
            allowed = reference.allowed(point, integration) if np.isfinite(value) else math.nan
        if np.isfinite(value):
            num_compared += 1
            allowed += 0.0 if errors is None else 2.0 * float(errors[i])
            if not abs(map_value - value) <= allowed:
                comparison = f"the map holds {map_value:.15g}, {name} finds {value:.15g}"
                findings.append(f"{variable} at {sample.name(i)}: {comparison}")
    time_note = "" if count == len(usable_points) else f"; no more in {MAX_CHECK_SECONDS:g} s"
    check = Check(name, f"{num_compared} points, {covers}{time_note}", _shorten(findings))
    return check if num_compared else replace(check, skip_reason="no run of the sample is short enough, or none is ok")


def _check_attitude(sweep: Sweep, sample: _Sample) -> Check:
    """Check that quaternions of motions are the integral of their angular velocity."""
    tolerance, findings, num_compared = sweep.definition.integration.tolerance, [], 0
    for i in _within_time(range(min(ATTITUDE_MOTIONS, len(sample.numbers)))):
        with np.errstate(all="ignore"):
            errors = _attitude_errors(sweep.system, sample.at(i), tolerance)
        if not np.isfinite(list(errors.values())).all():
            continue
        num_compared += 1
        for way, angle in errors.items():
            if not angle <= 1e-9 + 10.0 * tolerance:
                findings.append(f"attitude at {sample.name(i)}: {way} is {angle:.3g} rad from what SciPy integrates")
    check = Check("attitude", f"{num_compared} motions of a rotation, by SciPy DOP853", _shorten(findings))
    return check if num_compared else replace(check, skip_reason="no motion of the sample is within doubles")


def _attitude_errors(system, point: dict, tolerance: float) -> dict[str, float]:
    """Return method → angle (rad) between its attitude after a rotation and the integral of q' = q (0, omega)/2."""
    from scipy.integrate import solve_ivp
    from scipy.interpolate import make_interp_spline
    from scipy.spatial.transform import Rotation

    rates = [f"omega{k}" for k in (1, 2, 3)]
    start_state = system.motion(point, 1e-300, 2, tolerance)
    rotation = 2.0 * math.pi / max(abs(float(start_state[name][0])) for name in rates)
    motion = system.motion(point, rotation, 1025, tolerance)
    samples = np.stack([motion[name].values for name in rates], axis=1) * rotation
    if not np.isfinite(samples).all():
        return {"the motion": math.nan}
    omega = make_interp_spline(np.linspace(0.0, 1.0, len(samples)), samples, k=7)

    def quaternion_rate(t, q):
        w = omega(t)
        return 0.5 * np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)])

    run = solve_ivp(quaternion_rate, (0.0, 1.0), [1.0, 0.0, 0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-13)
    rotation_after, errors = Rotation.from_quat(run.y[:, -1], scalar_first=True), {}
    for way, suffix in (("the closed form", ""), ("the direct integration", "_direct")):
        q = [float(motion[f"q{k}{suffix}"][-1]) for k in range(4)]
        errors[way] = float((Rotation.from_quat(q, scalar_first=True).inv() * rotation_after).magnitude())
    return errors


def _check_errors(sweep: Sweep, sample: _Sample) -> Iterator[Check]:
    """Yield the check of error bounds: measured values against theory, or against their closed forms.

    Errors are bounds for 999 of 1,000 points; the check requires that no deviation exceeds twice its error.
    """
    columns, status = sample.columns, of_role(sweep.variables, Role.STATUS)
    specs = [s for s in sweep.variables.values() if s.error in columns and s.truth in columns]
    if not status or not specs:
        return
    is_ok = columns[status] == 0
    findings, num_compared = [], 0
    for spec in specs:
        value, error, truth = columns[spec.name], columns[spec.error], columns[spec.truth]
        is_ok_value = is_ok.reshape(-1, *(1,) * (value.ndim - 1))  # broadcasts over the variable's further dimensions
        has_error = is_ok_value & np.isfinite(error) & np.isfinite(truth)
        num_compared += int(has_error.sum())
        with np.errstate(over="ignore", invalid="ignore"):
            is_beyond = has_error & ~(np.abs(value - truth) <= 2.0 * error)
        for i in zip(*np.nonzero(is_beyond), strict=True):
            findings.append(
                f"{spec.name} at {sample.name(i[0])}: the map holds {value[i]:.15g} with an error of {error[i]:.2g}, "
                f"{spec.truth} is {truth[i]:.15g}"
            )
    yield Check("errors", f"{num_compared} errors against closed forms and theory", _shorten(findings))


def read_expected_sweep(path: str | Path, definition: str | None) -> Sweep | None:
    """Return the sweep of a definition. If `definition` is None, use the shipped sweep named like the map's folder."""
    folder = Path(os.path.realpath(validation.map_of(path))).parent
    shipped_files = catalogue.shipped_files() if folder.parent.name == "results" else {}
    source = catalogue.find_definition(definition) if definition is not None else shipped_files.get(folder.name)
    return None if source is None else read_sweep(source)
