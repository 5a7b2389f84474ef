"""Motions of described systems from any initial state, by direct integration; the library's `sweeps.motion`."""

from collections.abc import Mapping
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.schema.datasets import Dataset
from sweeps.schema.refusals import DefinitionError, cut_text, display, hint
from sweeps.schema.variables import Variable, parse_amount
from sweeps.systems.motion import MIN_SAMPLES, check_times, check_tolerance

if TYPE_CHECKING:
    from sweeps import mechanics
    from sweeps.mechanics.model import Model

REASONS = {  # status → message
    "not_converged": "halving the steps still changes it; allowed: a shorter duration, or a larger tolerance",
    "non_finite": "it leaves the range of doubles; allowed: a shorter duration",
    "too_many_steps": "it takes more than 500,000 steps; allowed: a shorter duration, or a larger tolerance",
    "stiff": "the equations are stiff: they contain rates much faster than the motion, and explicit steps would be too "
    "many; allowed: a shorter duration, or an implicit integrator (SciPy's Radau)",
}


def integrate_motions(system, start: Any, times, parameters: Mapping[str, Any], tolerance: float) -> Dataset:
    """Return motions of a described system; see `sweeps.motion`.

    Args:
        system: a System, the path of a Python file, or the name of a shipped system.
        start: coordinate or rate → initial value, or one value a run.
        times: instants, s, ascending; or the duration, s.
        parameters: parameter → value, or one value a run.
        tolerance: relative truncation error of the integration.
    """
    import xarray as xr

    from sweeps.mechanics import motions

    model = model_of(system)
    equations = model.equations
    defaults = {x.name: None for x in equations.q} | {x.name: 0.0 for x in equations.v}
    default_values = {name: p.default for name, p in model.system.parameters.items()}
    state_units = {name: unit for name, unit, _ in _state_columns(equations)}
    states = _read_values("start", start, defaults, state_units)
    parameter_arrays = _read_values(
        "parameters", parameters, default_values, {n: p.unit for n, p in model.system.parameters.items()}
    )
    for name, values in parameter_arrays.items():
        if not all(map(model.system.parameters[name].allows, np.ravel(values))):
            raise DefinitionError(f"parameters: {name}: {values}; allowed: {model.system.parameters[name].allowed}")
    if np.ndim(times) == 0:
        times = np.linspace(0.0, parse_amount("times", times, "s"), MIN_SAMPLES + 1)
    times = check_times(times)
    try:
        shape = np.broadcast_shapes(*map(np.shape, (*states.values(), *parameter_arrays.values())))
    except ValueError:
        problem = "start, parameters: lists of different lengths"
        raise DefinitionError(f"{problem}; allowed: numbers, or lists of one number a run") from None
    check_tolerance(tolerance)
    runs = shape[0] if shape else 1
    x, p = (np.array([np.broadcast_to(v, runs) for v in values.values()]) for values in (states, parameter_arrays))
    parameter_values = list(p) or [np.zeros(runs)]
    solution = motions.solve_between_jumps(model, parameter_values, x.T, np.tile(times, (runs, 1)), tolerance)
    if solution is None:
        raise DefinitionError("times: the jumps of the equations are not all found; allowed: system.jump(t) for each")
    motion_states, error, status = solution
    motion_states[status > motions.NOT_CONVERGED], error[status > motions.NOT_CONVERGED] = np.nan, np.nan
    variables: dict[str, tuple] = {}
    for i, (name, unit, meaning) in enumerate(_state_columns(equations)):
        variables[name] = (("run", "time"), motion_states[..., i], {"units": unit, "long_name": meaning})
        words = {"units": unit, "long_name": f"error of {meaning}"}
        words["comment"] = "four times the change by halving the steps and by a rounding of the start"
        variables[f"{name}_error"] = (("run", "time"), error[..., i], words)
    flags = Variable("status", None, "whether the motion keeps the tolerance", "i1", motions.STATUSES).attributes
    variables["status"] = ("run", status, flags)
    coordinates = {"time": ("time", times, {"units": "s", "long_name": "time"})}
    for q, values in zip(model.system.parameters.values(), p, strict=True):
        coordinates[q.name] = ("run", values, {"units": q.unit, "long_name": q.meaning})
    ds = xr.Dataset(variables, coordinates, {"title": model.system.title})
    return ds if shape else ds.isel(run=0)


def is_described(system: object) -> bool:
    """Return True for a described system: itself, a Python file, or the name of a shipped one."""
    from sweeps import mechanics, systems

    is_direct = isinstance(system, mechanics.System) or systems.is_file(system)
    return is_direct or (isinstance(system, str) and system in systems.described_names())


def model_of(system) -> "Model":
    """Return the model of a described system: itself, of a Python file, or the name of a shipped one."""
    from sweeps import mechanics, systems
    from sweeps.systems import described

    if isinstance(system, mechanics.System):
        return _model(system)
    if systems.is_file(system):
        return _model(described.run_file(system, "")[0])
    names = systems.described_names()
    if system not in names:
        problem = f"{system!r} is no described system" + hint(system, names)
        raise DefinitionError(f"system: {problem}; allowed: a System, a Python file, {', '.join(names)}")
    return _model(systems.resolve(system).description)


@cache
def _model(description: "mechanics.System") -> "Model":
    from sweeps.mechanics.model import Model

    return Model(description)


def _read_values(where, values, defaults, unit_of):
    """Return values in the order of their defaults; a default None marks a required value."""
    if not hasattr(values, "keys"):
        raise DefinitionError(f"{where}: {display(values)}; allowed: a mapping with {', '.join(defaults) or 'nothing'}")
    values = dict(values)
    unknown = sorted(map(str, set(values) - set(defaults)))
    missing = [name for name, default in defaults.items() if default is None and name not in values]
    if unknown or missing:
        problems = [f"{cut_text(name)} is unknown{hint(name, defaults)}" for name in unknown]
        problems += [f"{', '.join(missing)} {'are' if missing[1:] else 'is'} missing"] if missing else []
        raise DefinitionError(f"{where}: {'; '.join(problems)}; allowed: {_names_with_units(defaults, unit_of)}")
    arrays = {}
    for name, default in defaults.items():
        value, read = values.get(name, default), partial(parse_amount, f"{where}: {name}", unit=unit_of[name])
        is_list = isinstance(value, list | tuple) or np.ndim(value) > 0
        arrays[name] = np.array([read(v) for v in value] if is_list else read(value))
    return arrays


def _names_with_units(defaults, unit_of) -> str:
    """Return "theta (rad), theta_dot (s-1; default 0)": each name with its unit and its default."""
    words = []
    for name, default in defaults.items():
        unit = [] if unit_of[name] in ("", "1") else [unit_of[name]]
        words.append(f"{name} ({'; '.join([*unit, 'required' if default is None else f'default {default:g}'])})")
    return ", ".join(words) or "nothing"


def _state_columns(equations):
    """Yield (name, unit, meaning) of each coordinate or state, then of each velocity."""
    for place in equations.places:
        yield place.name, place.unit, place.meaning
    for place in equations.places if equations.v else ():
        unit = "s-1" if place.unit == "1" else f"{place.unit} s-1"
        yield place.velocity.name, unit, f"rate of change of {place.meaning}"
