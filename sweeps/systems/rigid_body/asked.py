"""What a person asks of one body, `polhode body`: the body that was given, and what becomes of its three spins."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict

from sweeps.schema.definition import Definition
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.rigid_body import wording
from sweeps.systems.rigid_body.definition import Body, RigidBodyDefinition
from sweeps.systems.rigid_body.spins import Spin, in_words, spins
from sweeps.systems.rigid_body.variables import MOMENTS

DEFAULTS = {"omega0": 1.0, "epsilon": 1e-6, "phase": 0.6}  # rad s-1, relative, rad
WAYS = ("moments", "ratios", "tensor", "mesh")


def bodies(definition: Definition, path: object) -> dict[str, Body]:
    """Name → body of a definition; `path` says where it stands.

    Raises:
        DefinitionError: where it has none.
    """
    found = definition.bodies if isinstance(definition, RigidBodyDefinition) else ()
    if not found:
        allowed = "a definition of rigid bodies with bodies"
        raise DefinitionError(f"{path}: bodies: (nothing) is missing; allowed: {allowed}")
    return {body.name: body for body in found}


def entry(asked: Mapping[str, object]) -> dict:
    """The entry of a definition for the body that is given by its numbers or its mesh.

    Args:
        asked: one of `WAYS` → three, three or nine numbers or a file's name; density, mass (or None) and unit of a
            mesh.
    """
    values: dict = {"name": asked["mesh"] or "the body given"}
    if asked["moments"]:
        return values | dict(zip(MOMENTS, asked["moments"], strict=True))
    if asked["ratios"]:
        return values | {"ratios": dict(zip(MOMENTS, asked["ratios"], strict=True))}
    if asked["tensor"]:
        return values | {"tensor": [asked["tensor"][i : i + 3] for i in (0, 3, 6)]}
    mesh = {"file": asked["mesh"]} | {name: asked[name] for name in ("density", "mass", "unit")}
    return values | {"mesh": {key: value for key, value in mesh.items() if value is not None}}


def checked(values: Mapping, asked: Mapping[str, object], load: Callable[[Mapping], Definition]) -> Body:
    """A body by the rules of a definition, with what is asked of its spin; refusals name the key of the definition."""
    own = {name: asked[name] for name in DEFAULTS if asked[name] is not None}
    try:
        return load({"bodies": [values | own], "grid": {} if "omega0" in own else {"omega0": 1.0}}).bodies[0]
    except DefinitionError as refused:
        raise DefinitionError(str(refused).replace("definition: bodies[0].", "body: ")) from None


def check_spin(name: str, asked: Mapping[str, object], load: Callable[[Mapping], Definition]) -> None:
    """Checks what is asked of the spin of a body that is known."""
    checked({"name": name, "ratios": dict.fromkeys(MOMENTS, 1.0)}, asked, load)


def setting(body: Body, asked: Mapping[str, object]) -> dict[str, float]:
    """Spin rate and nudge: as asked, else the body's own, else `DEFAULTS`."""
    ways = {name: (asked[name], getattr(body, name), default) for name, default in DEFAULTS.items()}
    return {name: next(value for value in values if value is not None) for name, values in ways.items()}


def facts(body: Body, spun: Mapping[str, float]) -> dict:
    """The answer for machines: SI units, angles in rad."""
    said = {"name": body.name, "moments": body.moments, "moments_are_ratios": body.ratios is not None, **spun}
    if body.principal is not None:
        said |= {"principal_axes": body.principal.axes, "notes": body.principal.notes}
    if body.solid is not None:
        said |= {name: getattr(body.solid, name) for name in ("mass", "volume", "centre", "extents", "faces")}
    axes = [asdict(spin) | {"max_tilt": math.radians(spin.max_tilt)} for spin in spins(body.moments, **spun)]
    return said | {"axes": axes}


def answer(body: Body, spun: Mapping[str, float]) -> tuple[list[str], list[tuple[str, str]], list[str]]:
    """The answer for people: lines about the body, (axis, what becomes of it) of each spin, and what is known."""
    found = spins(body.moments, **spun)
    rows = [(f"axis {one.axis}" + (", its own" if body.axis == one.axis else ""), _becomes(one)) for one in found]
    return [*_described(body), *_spun(spun, found)], rows, list(_known(body))


def _becomes(spin: Spin) -> str:
    return in_words(spin, wording.duration)


def _described(body: Body) -> Iterator[str]:
    if body.solid is not None:
        yield wording.solid_in_words(body.solid)
    if body.principal is not None:
        yield from wording.principal_axes(body.principal)
        return
    unit = "(ratios)" if body.ratios is not None else "kg m²"
    yield f"{', '.join(MOMENTS)} = {', '.join(f'{moment:.6g}' for moment in body.moments)} {unit}"


def _spun(spun: Mapping[str, float], found: list[Spin]) -> Iterator[str]:
    turn = wording.duration(2 * math.pi / abs(spun["omega0"]))
    yield f"spin {spun['omega0']:.6g} rad s⁻¹ (one turn in {turn}), nudged by {spun['epsilon']:.2g} of it"
    if any(spin.flip_period is not None for spin in found):
        yield "A larger nudge flips sooner: each flip time below is for this nudge and the axis of its line."


def _known(body: Body) -> Iterator[str]:
    if body.observed is not None:
        yield f"observed: {wording.duration(body.observed.period_days * wording.DAY)}, {body.observed.what}"
    if body.note:
        yield f"note: {' '.join(body.note.split())}"
