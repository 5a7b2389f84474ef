"""Response of a stable point of a map to a harmonic force: amplitude and phase over frequency."""

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.maps import critical_values, modes
from sweeps.schema.datasets import flags
from sweeps.schema.refusals import RefusedError, hint
from sweeps.schema.variables import parse_amount

if TYPE_CHECKING:
    import xarray as xr

MAX_FREQUENCIES = 100_000


def find_response(
    stability_map: "xr.Dataset | str | Path",
    force: Mapping[str, float],
    frequencies: Iterable[Any],
    places: Mapping[str, object],
    definition: str | None,
    prefix: str = "",
) -> "xr.Dataset":
    """Return the response of a point of a map; see `sweeps.response`.

    Args:
        stability_map: a map, or its path.
        force: coordinate or state → amplitude.
        frequencies: angular frequencies.
        places: dimension → value, for dimensions of which one value is chosen.
        definition: that of the map, if its system is a Python file.
        prefix: precedes names in messages: "--" on the command line.
    """
    import xarray as xr

    from sweeps.mechanics import forced_response, relative

    points = modes.select_points(stability_map, None, places, definition, prefix)
    points.check_line()
    system, regime = points.system, points.points["regime"]
    model, components = system.mechanism, system.mechanism.equations.places
    names = [component.name for component in components]
    amplitudes = _amplitudes(force, names, prefix)
    numbers = np.array([parse_amount("frequencies", value, "rad s-1") for value in frequencies])
    if not 0 < numbers.size <= MAX_FREQUENCIES or not (numbers > 0.0).all():
        raise RefusedError(f"frequencies: allowed: 1 to {MAX_FREQUENCIES:,} numbers > 0 (rad s-1)")
    if unstable := {flags(regime)[code] for code in regime.values.ravel().tolist()} - {*critical_values.STABLE_REGIMES}:
        allowed = "a point with the regime stable or asymptotically_stable"
        raise RefusedError(f"map: the regime of this point is {', '.join(sorted(unstable))}; allowed: {allowed}")
    if model.n < model.equations.n:
        raise RefusedError("map: its system has conserved quantities, which a force changes; allowed: one without them")
    theory = relative.theory(model, system.slots(points.arguments()))
    push = forced_response.scaled_push(model, theory, amplitudes)
    *responses, error = forced_response.respond(theory["matrix"][0], push, theory["scale"][0], numbers)
    sizes = theory["sizes"][0, : len(names)]
    exact, measured = (response[:, : len(names)] * sizes for response in responses)
    errors, size = error[:, None] * sizes, np.abs(measured)
    with np.errstate(all="ignore"):
        phase_errors = np.where(errors < size, np.arcsin(errors / size), np.pi)
    columns = {
        "response_amplitude": size,
        "response_amplitude_error": errors,
        "response_amplitude_theory": np.abs(exact),
        "response_phase": np.angle(measured),
        "response_phase_error": np.where(np.isnan(size), np.nan, phase_errors),
        "response_phase_theory": np.angle(exact),
    }
    coordinates = {name: coordinate for name, coordinate in points.points.coords.items() if coordinate.size == 1}
    words = {"units": "rad s-1", "long_name": "angular frequency of the force"}
    coordinates |= {"angular_frequency": ("angular_frequency", numbers, words)}
    coordinates |= {"component": names, "unit": ("component", [component.unit for component in components])}
    words = ", ".join(f"{name} = {value:g}" for name, value in force.items())
    variables = {name: (("angular_frequency", "component"), column) for name, column in columns.items()}
    response = xr.Dataset(variables, coordinates, {"title": points.points.attrs.get("title", ""), "force": words})
    for name in ("", "_error", "_theory"):
        response[f"response_phase{name}"].attrs["units"] = "rad"
    return response


def _amplitudes(force: Mapping[str, float], names: Sequence[str], prefix: str) -> list[float]:
    """Return the amplitude of the force on each component; refuse unknown names, and forces that are all 0."""
    for name, value in force.items():
        if name not in names:
            allowed = ", ".join(names)
            raise RefusedError(f"{prefix}force: {name} is no component{hint(name, names)}; allowed: {allowed}")
        if not isinstance(value, int | float) or not math.isfinite(value):
            raise RefusedError(f"{prefix}force: {name}: {value!r}; allowed: a finite number")
    if not any(force.values()):
        raise RefusedError(f"{prefix}force: is 0; allowed: a number that is not 0 for one of {', '.join(names)}")
    return [float(force.get(name, 0.0)) for name in names]
