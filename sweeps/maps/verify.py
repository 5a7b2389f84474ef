"""Is a map what its definition and its kernels make? Check by check, and what differs, in words.

`verify` trusts nothing that a file says of itself: hashes are recomputed, coordinates made again from the definition,
and points of a random sample measured again by this project's kernels, by SciPy and by the closed form. A system that
a file of somebody's own describes is never run.
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
SHOWN = 3  # findings of one kind that are spelled out
MOST_POINTS = 100_000  # of a sample
MOST_SECONDS = 60.0  # that one check of a sample takes, about; then what is left of the sample is left
# attributes of a variable in the file that belong to netCDF-4 or to the content hash
FORMAT_OWN = ("_FillValue", "_Netcdf4Coordinates", "_Netcdf4Dimid", "CLASS", "NAME", "sha256")
TURNED = 5  # motions of the sample whose quaternions SciPy integrates again


@dataclass(frozen=True)
class Check:
    """One thing that was looked at."""

    name: str  #: what it is called
    covers: str  #: what was compared, one line
    findings: tuple[str, ...] = ()  #: what differs, one line each; empty where nothing does
    skipped: str = ""  #: why it could not be looked at, or ""


def verify(
    path: str | Path, points: int = 100, seed: int = 0, against: Sweep | None = None, any_kernels: bool = False
) -> list[Check]:
    """Return the checks of everything that a map promises, in order; it is whole where none has findings.

    Args:
        path: a map, or the folder it lies in.
        points: how many random points are measured again.
        seed: of their choice.
        against: a sweep that the map should have been made from; left out, the one in the file is taken.
        any_kernels: whether a map that other kernels, or this code on another machine, made is right.
    """
    with storage.open_map(path, any_flags=True) as ds:
        checks = [_content(ds)]
        sweep, check = _definition(ds, against)
        checks.append(check)
        if sweep is None:
            reason = check.skipped or "its definition cannot be read"
            return [*checks, *(Check(name, "", skipped=reason) for name in ("kernels", "grid", "values", "sample"))]
        checks += [_kernels(ds, sweep, any_kernels), _grid(ds, sweep)]
        if checks[-1].findings:
            return [*checks, *(Check(name, "", skipped="its grid is another") for name in ("values", "sample"))]
        return [*checks, _attributes(path, sweep), _values(ds, sweep), *_sample(ds, sweep, points, seed)]


def _shown(findings: list[str]) -> tuple[str, ...]:
    more = [f"and {len(findings) - SHOWN:,} more"] if len(findings) > SHOWN else []
    return (*findings[:SHOWN], *more)


# -- what needs the file alone


def _content(ds: xr.Dataset) -> Check:
    """Return findings where a variable no longer holds the bytes that were written."""
    digest = content_hash.hash_content(ds, BLOCK_POINTS)
    promised = {name: str(variable.encoding.get("sha256", "")) for name, variable in ds.variables.items()}
    differing = [n for n, actual in digest.digests().items() if promised[n] and promised[n] != actual]
    findings = [f"{name}: holds other values than were written" for name in differing]
    if not findings and digest.hexdigest() != str(ds.attrs.get("content_hash", "")):
        problem = "is missing" if "content_hash" not in ds.attrs else "is not that of what the file holds"
        findings = [f"content_hash: {problem}"]
    return Check("content", f"SHA-256 of {len(promised)} variables", tuple(findings))


def _definition(ds: xr.Dataset, against: Sweep | None) -> tuple[Sweep | None, Check]:
    """Return the definition in the file, and whether it is the one expected."""
    name, covers = "definition", "the one in the file" + (f", against {against.name}" if against else "")
    text = ds.attrs.get("definition", "")
    if against is not None and text == against.definition.text:
        changed = str(ds.attrs.get("inputs", "")) != against.definition.inputs
        return against, Check(name, covers, ("inputs: a file of its bodies or points was another",) if changed else ())
    try:
        values = mapping_of(text)
        if (elsewhere := _needs_files(values)) is not None:
            return None, Check(name, covers, skipped=elsewhere)
        sweep = read_sweep(values, against.name if against else DEFAULT_NAME)
    except (DefinitionError, UnreadableError) as error:
        return None, Check(name, covers, (f"definition: cannot be used ({cut_text(str(error))!r})",))
    findings, definition = [], sweep.definition
    if definition.system != str(ds.attrs.get("system", DEFAULT_SYSTEM)):
        findings.append(f"system: the file says {ds.attrs.get('system')!r}, its definition {definition.system!r}")
    if against is not None:
        differing = _differing(definition, against.definition)
        findings += [f"definition: another {key} than {against.name}'s" for key in differing]
    return sweep, Check(name, covers, tuple(findings))


def _needs_files(values: dict) -> str | None:
    """Return why other files that a map's definition names are not read: nobody here has asked for those."""
    if systems.is_file(values.get("system")):
        return "its system is a Python file, run only where --definition names it"
    if "table" in values:
        return "its points are those of a table, read only where --definition names it"
    try:
        system = systems.resolve(str(values.get("system", DEFAULT_SYSTEM)))
    except KeyError:  # which reading it will refuse
        return None
    return system.model.needs_files(values) or None


def _differing(one: Definition, other: Definition) -> list[str]:
    """Return the keys in which two definitions differ, but for the number of shards, which changes no result."""
    ours, theirs = one.model_dump(exclude={"shards"}), other.model_dump(exclude={"shards"})
    return [key for key in {**ours, **theirs} if ours.get(key, ...) != theirs.get(key, ...)]


def _kernels(ds: xr.Dataset, sweep: Sweep, any_kernels: bool) -> Check:
    check = Check("kernels", "fingerprint of sources, versions and processor")
    if _same_kernels(ds, sweep):
        return check
    what = "kernel_fingerprint: made by other kernels, or by these on another machine"
    return replace(check, skipped=what) if any_kernels else replace(check, findings=(what,))


def _same_kernels(ds: xr.Dataset, sweep: Sweep) -> bool:
    return str(ds.attrs.get("kernel_fingerprint", "")) == sweep.system.fingerprint()


# -- what needs the definition


def _grid(ds: xr.Dataset, sweep: Sweep) -> Check:
    """Return findings where the map lacks dimensions, coordinates or variables of its definition."""
    grid = sweep.grid
    covers = f"{grid.size:,} points: dimensions, coordinates, {len(sweep.variables)} variables"
    sizes = dict(zip(grid.dims, grid.shape, strict=True)) | {dim: v.size for dim, v in grid.extra_dimensions.items()}
    if dict(ds.sizes) != sizes:
        held, wanted = (
            " × ".join(f"{size:,} {cut_text(str(dim))}" for dim, size in of.items()) or "none"
            for of in (ds.sizes, sizes)
        )
        return Check("grid", covers, (f"dimensions: {held}, by the definition {wanted}",))
    # dimensions and types of variables were held against the system's when the map was opened
    missing = [f"{name}: is missing" for name in sweep.variables if name not in ds.variables]
    return Check("grid", covers, _shown([*_wrong_coordinates(ds, sweep), *missing]))


def _wrong_coordinates(ds: xr.Dataset, sweep: Sweep) -> Iterator[str]:
    expected = contract.coordinates(sweep)
    for name, (dims, values, _) in expected.items():
        if name not in ds.variables:
            yield f"{name}: is missing"
            continue
        stored = ds.variables[name]
        boxes = runs(stored.shape, BLOCK_POINTS)
        if stored.dims != dims or (stored.dtype.kind != values.dtype.kind and stored.dtype.kind not in "OU"):
            yield f"{name}: is no coordinate along {', '.join(dims)} of type {values.dtype}"
        elif any(content_hash.as_bytes(stored[box].values) != content_hash.as_bytes(values[box]) for box in boxes):
            yield f"{name}: has other values than the definition's"
    beside = set(ds.variables) | set(ds.encoding.get("ignored", ()))
    for name in beside - set(expected) - set(sweep.variables):
        yield f"{cut_text(repr(name))}: is no variable of this map"


def _attributes(path: str | Path, sweep: Sweep) -> Check:
    """Return findings if attributes in the file are not those that the definition and its system give.

    Readers of the file take them from there; `open_map` takes them from the system's own tables.
    """
    with closing(FileBytes(validation.map_of(path))) as file:
        structure = read_structure(file)
    expected = {name: dict(attributes) for name, (_, _, attributes) in contract.coordinates(sweep).items()}
    expected |= {name: spec.attributes_among(sweep.variables) for name, spec in sweep.variables.items()}
    findings = []
    for name, attributes in expected.items():
        stored = {key: _as_text(v) for key, v in structure.variables[name].attributes.items() if key not in FORMAT_OWN}
        attributes = {key: _as_text(value) for key, value in attributes.items()}
        differing = [key for key in {**attributes, **stored} if attributes.get(key) != stored.get(key)]
        findings += [f"{name}: {_difference(key, attributes, stored)}" for key in sorted(differing)]
    made = {key: str(value) for key, value in contract.provenance(sweep).items()}
    stored = {key: _as_text(value) for key, value in structure.attributes.items()}
    compared = ["references", "Conventions"] + ["title"] * ("title" in mapping_of(sweep.definition.text))
    findings += [f"(file): {_difference(key, made, stored)}" for key in compared if stored.get(key) != made[key]]
    method = made["source"].partition("), ")[2]  # what precedes are versions
    if not re.fullmatch(rf"Polhode [^()]*\([^()]*\), {re.escape(method)}", stored.get("source", "")):
        findings.append(f"(file): {_difference('source', made, stored)}")
    return Check(
        "attributes", f"names, units and meanings of {len(expected)} variables, and of the file", _shown(findings)
    )


def _as_text(value: object) -> str:
    return " ".join(map(str, np.atleast_1d(value)))


def _difference(key: str, expected: Mapping[str, str], stored: Mapping[str, str]) -> str:
    if key not in stored:
        return f"{cut_text(key)} is missing"
    allowed = (
        f"by the definition {cut_text(repr(expected[key]))}" if key in expected else "by the definition there is none"
    )
    return f"{cut_text(key)} is {cut_text(repr(stored[key]))}, {allowed}"


def _values(ds: xr.Dataset, sweep: Sweep) -> Check:
    """Return findings where flags have no meaning, or points with status ok hold no numbers."""
    specs, status = sweep.variables, of_role(sweep.variables, Role.STATUS)
    measured = [name for name, spec in specs.items() if status and spec.role == Role.MEASUREMENT]
    unknown, empty = Counter(), Counter()
    for box in runs(sweep.grid.shape, BLOCK_POINTS):
        for name in (name for name, spec in specs.items() if spec.flags):
            values, first = ds.variables[name][box].values, specs[name].first_flag
            outside = (values < first) | (values >= first + len(specs[name].flags))
            unknown[name] += int(np.count_nonzero(outside))
        for name in measured:
            sound = ds.variables[status][box].values == 0
            holes = sound & ~np.isfinite(ds.variables[name][box].values)
            empty[name] += int(np.count_nonzero(holes))
    findings = [f"{name}: {count:,} flags without a meaning" for name, count in unknown.items() if count]
    findings += [f"{name}: {count:,} points without a number are called ok" for name, count in empty.items() if count]
    return Check("values", "flags, and a number at every point called ok", tuple(findings))


# -- a sample, measured again


@dataclass(frozen=True)
class _Sample:
    numbers: np.ndarray
    points: dict[str, np.ndarray]
    columns: dict[str, np.ndarray]

    def name(self, i: int) -> str:
        return f"point {self.numbers[i]}"

    def at(self, i: int) -> dict:
        return {name: values[i] for name, values in self.points.items()}


def _sample(ds: xr.Dataset, sweep: Sweep, count: int, seed: int) -> Iterator[Check]:
    if count < 1:
        return
    sample = _drawn(ds, sweep, count, seed)
    yield _by_own_kernels(ds, sweep, sample, seed)
    yield from _by_references(sweep, sample)
    if sweep.definition.follows_attitude:
        yield _by_attitude(sweep, sample)
    yield from _by_errors(sweep, sample)


def _drawn(ds: xr.Dataset, sweep: Sweep, count: int, seed: int) -> _Sample:
    grid = sweep.grid
    numbers = np.unique(np.random.default_rng(seed).integers(0, grid.size, count))
    parts = [grid.points(int(number), int(number) + 1) for number in numbers]
    points = {name: np.concatenate([part[name] for part in parts]) for name in grid.arguments}
    return _Sample(numbers, points, {n: _held(ds.variables[n], numbers, len(grid.dims)) for n in sweep.variables})


def _held(variable: xr.Variable, numbers: np.ndarray, points: int) -> np.ndarray:
    """Return a variable's values at points of these numbers, ascending; each block that holds one is read once.

    Its first `points` dimensions are those of the points.
    """
    parts, first, inner = [], 0, variable.shape[points:]
    for box in runs(variable.shape[:points], max(1, BLOCK_POINTS // math.prod(inner))):
        after = first + variable[box].size // math.prod(inner)
        low, high = np.searchsorted(numbers, (first, after))
        if low < high:
            parts.append(variable[box].values.reshape(-1, *inner)[numbers[low:high] - first])
        first = after
    return np.concatenate(parts)


def _by_own_kernels(ds: xr.Dataset, sweep: Sweep, sample: _Sample, seed: int) -> Check:
    """Return findings where the kernels that made the map give other bits now."""
    from kernels.compile.blocks import W

    name, count = "this project's kernels", len(sample.numbers)
    covers = f"{count:,} points (seed {seed}), bit for bit"
    if reason := sweep.definition.differing_bits if _same_kernels(ds, sweep) else "other kernels make other bits":
        return Check(name, covers, skipped=reason)
    samples, rate = sweep.system.cost(sweep.definition).samples, sweep.system.samples_per_second
    if W * samples > MOST_SECONDS * rate:  # a point takes as long as a block of them
        return Check(name, covers, skipped=f"a run of {samples:,} samples takes more than {MOST_SECONDS:g} s")
    findings, done = [], 0
    step = max(W, int(rate / samples))  # a second's work
    for part in _while_patient([range(at, min(at + step, count)) for at in range(0, count, step)]):
        findings += _differing_bits(sweep, sample, part)
        done = part.stop
    left = "" if done == count else f"; {done:,} of them, no more in {MOST_SECONDS:g} s"
    return Check(name, covers + left, _shown(findings))


def _differing_bits(sweep: Sweep, sample: _Sample, numbers: range) -> list[str]:
    """Return findings where some points of a sample, measured again, have other bits."""
    part = slice(numbers.start, numbers.stop)
    again = measure_points({name: values[part] for name, values in sample.points.items()}, sweep)
    findings = []
    for variable, held in sample.columns.items():
        for i, a, b in zip(numbers, held[part], again[variable], strict=True):
            if a.tobytes() != b.tobytes():
                findings.append(f"{variable} at {sample.name(i)}: the map holds {_said(a)}, measured again {_said(b)}")
    return findings


def _said(value: np.ndarray | np.generic) -> str:
    return f"{value:.17g}" if np.ndim(value) == 0 else f"{np.size(value)} values"


def _while_patient(parts: Sequence) -> Iterator:
    """Yield parts until `MOST_SECONDS` after the first was done: compiling and loading do not count."""
    end = math.inf
    for part in parts:
        if time.monotonic() > end:
            return
        yield part
        end = min(end, time.monotonic() + MOST_SECONDS)


def _by_references(sweep: Sweep, sample: _Sample) -> Iterator[Check]:
    """Yield findings where SciPy or the closed form differs by more than the definition's tolerance allows."""
    first = sweep.system.reference()
    references = () if first is None else (first, *first.more)
    yield from (_by_reference(sweep, sample, one, name) for one in references for name in one.ways)


def _by_reference(sweep: Sweep, sample: _Sample, reference: Reference, name: str) -> Check:
    variable, integration = reference.variable, sweep.definition.integration
    status = of_role(sweep.variables, Role.STATUS)
    covers = f"{variable} within the tolerance"
    if variable not in sample.columns or not status:
        return Check(name, covers, skipped=f"the map has no {variable} with a status")
    findings, compared, seen = [], 0, 0
    # what is missing without leave, `_values` finds: a principal spin and the separatrix have no period
    sound = np.flatnonzero((sample.columns[status] == 0) & ~np.isnan(sample.columns[variable]))
    errors = sample.columns.get(sweep.variables[variable].error) if reference.within_error else None
    for i in _while_patient(sound):
        seen += 1
        point, held = sample.at(i), float(sample.columns[variable][i])
        with np.errstate(all="ignore"):
            value = reference.ways[name](point, integration)
            most = reference.allowed(point, integration) if np.isfinite(value) else math.nan
        if np.isfinite(value):
            compared += 1
            most += 0.0 if errors is None else 2.0 * float(errors[i])
            if not abs(held - value) <= most:
                findings.append(f"{variable} at {sample.name(i)}: the map holds {held:.15g}, {name} finds {value:.15g}")
    left = "" if seen == len(sound) else f"; no more in {MOST_SECONDS:g} s"
    check = Check(name, f"{compared} points, {covers}{left}", _shown(findings))
    return check if compared else replace(check, skipped="no run of the sample is short enough, or none is ok")


def _by_attitude(sweep: Sweep, sample: _Sample) -> Check:
    """Return findings where a motion's quaternions are not those of its angular velocity."""
    tolerance, findings, compared = sweep.definition.integration.tolerance, [], 0
    for i in _while_patient(range(min(TURNED, len(sample.numbers)))):
        with np.errstate(all="ignore"):
            apart = _apart_after_a_rotation(sweep.system, sample.at(i), tolerance)
        if not np.isfinite(list(apart.values())).all():
            continue
        compared += 1
        for way, angle in apart.items():
            if not angle <= 1e-9 + 10.0 * tolerance:
                findings.append(f"attitude at {sample.name(i)}: {way} is {angle:.3g} rad from what SciPy integrates")
    check = Check("attitude", f"{compared} motions of a rotation, by SciPy DOP853", _shown(findings))
    return check if compared else replace(check, skipped="no motion of the sample is within doubles")


def _apart_after_a_rotation(system, point: dict, tolerance: float) -> dict[str, float]:
    """Return the angle between a motion's attitude and the integral of q' = q (0, omega)/2, rad, of each way."""
    from scipy.integrate import solve_ivp
    from scipy.interpolate import make_interp_spline
    from scipy.spatial.transform import Rotation

    rates = [f"omega{k}" for k in (1, 2, 3)]
    begin = system.motion(point, 1e-300, 2, tolerance)
    rotation = 2.0 * math.pi / max(abs(float(begin[name][0])) for name in rates)
    moved = system.motion(point, rotation, 1025, tolerance)
    samples = np.stack([moved[name].values for name in rates], axis=1) * rotation
    if not np.isfinite(samples).all():
        return {"the motion": math.nan}
    omega = make_interp_spline(np.linspace(0.0, 1.0, len(samples)), samples, k=7)

    def turning(t, q):
        w = omega(t)
        return 0.5 * np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)])

    run = solve_ivp(turning, (0.0, 1.0), [1.0, 0.0, 0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-13)
    wanted, apart = Rotation.from_quat(run.y[:, -1], scalar_first=True), {}
    for way, suffix in (("the closed form", ""), ("the direct integration", "_direct")):
        q = [float(moved[f"q{k}{suffix}"][-1]) for k in range(4)]
        apart[way] = float((Rotation.from_quat(q, scalar_first=True).inv() * wanted).magnitude())
    return apart


def _by_errors(sweep: Sweep, sample: _Sample) -> Iterator[Check]:
    """Yield findings where errors do not cover: each measured value against theory, else against its closed form.

    Errors cover 999 of 1,000 points, and none is missed by more than twice: that is what is asked.
    """
    held, status = sample.columns, of_role(sweep.variables, Role.STATUS)
    specs = [s for s in sweep.variables.values() if s.error in held and s.truth in held]
    if not status or not specs:
        return
    sound = held[status] == 0
    findings, compared = [], 0
    for spec in specs:
        value, error, truth = held[spec.name], held[spec.error], held[spec.truth]
        sound_values = sound.reshape(-1, *(1,) * (value.ndim - 1))  # of all that a variable has at a point
        judged = sound_values & np.isfinite(error) & np.isfinite(truth)
        compared += int(judged.sum())
        with np.errstate(over="ignore", invalid="ignore"):
            missed = judged & ~(np.abs(value - truth) <= 2.0 * error)
        for i in zip(*np.nonzero(missed), strict=True):
            findings.append(
                f"{spec.name} at {sample.name(i[0])}: the map holds {value[i]:.15g} with an error of {error[i]:.2g}, "
                f"{spec.truth} is {truth[i]:.15g}"
            )
    yield Check("errors", f"{compared} errors against closed forms and theory", _shown(findings))


# -- the command


def checked(path: str, points: int, seed: int, definition: str | None, any_kernels: bool) -> list[Check]:
    """Return the checks of `verify` for what its command was given."""
    if not 0 <= points <= MOST_POINTS:
        raise DefinitionError(f"--points: {points} is out of range; allowed: 0 to {MOST_POINTS:,}")
    if seed < 0:
        raise DefinitionError(f"--seed: {seed} is out of range; allowed: 0 or more")
    return verify(path, points, seed, _expected(path, definition), any_kernels)


def _expected(path: str, definition: str | None) -> Sweep | None:
    """Return the sweep of a definition; left out, of the one that ships and whose folder the map lies in."""
    folder = Path(os.path.realpath(validation.map_of(path))).parent
    shipped = catalogue.shipped_files() if folder.parent.name == "results" else {}
    source = catalogue.find_definition(definition) if definition is not None else shipped.get(folder.name)
    return None if source is None else read_sweep(source)
