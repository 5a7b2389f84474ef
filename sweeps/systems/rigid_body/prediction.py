"""The answer for one body, `polhode body`: the body as given, and the outcome of its three spins."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict

from sweeps.schema.definition import Definition
from sweeps.schema.refusals import DefinitionError, display, named
from sweeps.systems.bodies import shapes, wording
from sweeps.systems.bodies.body import body_entry
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.rigid_body.definition import NearAxisDefinition, SpunBody
from sweeps.systems.rigid_body.spins import AXES, Axes, in_words, spins, twist_of

DEFAULTS = {"omega0": 1.0, "epsilon": 1e-6, "phase": 0.6}  # rad s-1, relative, rad


def bodies(definition: Definition, path: object) -> dict[str, SpunBody]:
    """Return name → body of a definition; `path` is used in messages."""
    listed = definition.bodies if isinstance(definition, NearAxisDefinition) else ()
    if not listed:
        raise DefinitionError(f"{path}: bodies: is missing; allowed: a definition of rigid bodies with bodies")
    return {body.name: body for body in listed}


def checked(values: Mapping, spin: Mapping[str, object], load: Callable[[Mapping], Definition]) -> SpunBody:
    """Return a body checked by the rules of a definition, with its requested spin; refusals name the key."""
    rates = {name: spin[name] for name in DEFAULTS if spin.get(name) is not None}
    try:
        body = load({"bodies": [values | rates], "grid": {} if "omega0" in rates else {"omega0": 1.0}}).bodies[0]
    except DefinitionError as refused:
        raise DefinitionError(str(refused).replace("definition: bodies[0].", "body: ")) from None
    shapes.refuse_impossible("body: moments", body.moments)
    return body


def setting(requested: SpunBody, body: SpunBody) -> dict[str, float]:
    """Return spin rate and perturbation: as requested, else the body's own, else `DEFAULTS`."""
    ways = {name: (getattr(requested, name), getattr(body, name), default) for name, default in DEFAULTS.items()}
    return {name: next(value for value in values if value is not None) for name, values in ways.items()}


def body_of(body: object, source: object, spin: Mapping[str, object], load: Callable) -> tuple[SpunBody, dict]:
    """Return a body, and the spin rate and perturbation that are given, else its own, else the default ones.

    The body is a name or a part of one, of those that the definition `source` lists, a body's mapping as in a
    definition, three moments, or a tensor of inertia; `load` reads a definition: a mapping, a path, or the name of one
    that ships.
    """
    if isinstance(body, str):
        listed = bodies(load(source), source)
        chosen = listed[named(body, list(listed), "body", DefinitionError)]
        requested = checked({"name": chosen.name, "ratios": dict.fromkeys(MOMENTS, 1.0)}, spin, load)
    else:
        chosen = requested = checked({"name": "your body"} | body_entry(body), spin, load)
    return chosen, setting(requested, chosen)


def facts(body: SpunBody, spun: Mapping[str, float], axes: Axes = AXES, thrown: bool = False) -> dict:
    """Return the answer for machines: SI units, angles in rad; see :func:`answer`."""
    said = {"name": body.name, "moments": body.moments, "moments_are_ratios": body.ratios is not None, **spun}
    if body.principal is not None:
        said |= {"principal_axes": body.principal.axes, "notes": body.principal.notes}
    if body.solid is not None:
        said |= {name: getattr(body.solid, name) for name in ("mass", "volume", "centre", "extents", "faces")}
    answers = [asdict(s) | {"max_tilt": math.radians(s.max_tilt)} for s in spins(body.moments, **spun, axes=axes)]
    if thrown:
        answers = [spin | {"twist_thrown": twist_of(body.moments, spin["axis"], spun)} for spin in answers]
    return said | {"axes": answers}


def answer(
    body: SpunBody, spun: Mapping[str, float], axes: Axes = AXES, thrown: bool = False
) -> tuple[list[str], list[tuple[str, str]], list[str]]:
    """Return the answer for people: lines about the body, (axis, outcome) of each spin, and what is known.

    With `thrown` the twist of the throw is added, but not about the handle, whose direction then stays near L.
    """
    about_axes, rows = spins(body.moments, **spun, axes=axes), []
    for one in about_axes:
        text = in_words(one, wording.duration)
        if thrown and (twist := twist_of(body.moments, one.axis, spun)) is not None:
            size, angle = f"ε = {spun['epsilon']:.3g}", f"{math.degrees(twist):.3g}°"
            text += f"; thrown with {size}, it twists by {angle} per revolution of its handle"
        rows.append((f"axis {one.axis}" + (" (usual spin)" if body.axis == one.axis else ""), text))
    turn, size = wording.duration(2 * math.pi / abs(spun["omega0"])), f"{spun['epsilon']:.2g}"
    rate = f"spin {spun['omega0']:.6g} rad s⁻¹ (one turn in {turn})"
    lines = [*_described(body), f"{rate}, perturbed by ε = {size} (transverse ω over ω₀)"]
    if any(spin.flip_period is not None for spin in about_axes):
        lines.append(f"flip times are for ε = {size}; larger perturbations flip sooner")
    return lines, rows, list(_known(body))


def axes_of(value: object) -> Axes:
    """Return the one axis that is asked for, or all three."""
    if value not in (None, *AXES):
        raise DefinitionError(f"body: axis: {display(value)} is out of range; allowed: 1, 2 or 3")
    return AXES if value is None else (int(value),)


def _described(body: SpunBody) -> Iterator[str]:
    if body.solid is not None:
        yield wording.solid_in_words(body.solid)
    if body.principal is not None:
        yield from wording.principal_axes(body.principal)
        yield "axes 1, 2, 3 in the order of ascending moments"
        return
    unit = "(ratios)" if body.ratios is not None else "kg m²"
    typed = "" if list(body.moments) == sorted(body.moments) else "; axes 1, 2, 3 in the order given"
    yield f"{', '.join(MOMENTS)} = {', '.join(f'{moment:.6g}' for moment in body.moments)} {unit}{typed}"
    if broken := shapes.violation(body.moments):
        yield f"no rigid body has these moments: {broken}"


def _known(body: SpunBody) -> Iterator[str]:
    if body.observed is not None:
        yield f"observed: {wording.duration(body.observed.period_days * wording.DAY)}, {body.observed.what}"
    if body.note:
        yield f"note: {' '.join(body.note.split())}"
