"""`body`: the three axes of a body, in words."""

import math

from sweeps.commands import parser

EPILOG = """\
NAME may be a part of a name: `body racket`. Without NAME the bodies are listed. Or give a body of your own:

  polhode body --moments 0.00121 0.01638 0.01748 --omega0 10
  polhode body --ratios 1 2 2.5
  polhode body --tensor 2 -0.5 0  -0.5 2 0.1  0 0.1 3
  polhode body --mesh racket.stl --density 600 --unit mm

The moments of a tensor or a mesh come out ascending, with their principal axes in the coordinates of the tensor or
the mesh. Off-diagonal entries of a tensor are minus the products of inertia.
"""


def add(commands) -> None:
    """Describes the command."""
    command = parser.add(commands, "body", "say what becomes of a body's spin about each axis", _run, EPILOG)
    command.add_argument("name", metavar="NAME", nargs="?", help="a body of the sweep `bodies`, or of --definition")
    command.add_argument("--definition", metavar="DEFINITION", default="bodies", help="where NAME stands")
    numbers = {"type": float, "metavar": "X"}
    command.add_argument("--moments", nargs=3, help="I1 I2 I3 in kg m2", **numbers)
    command.add_argument("--ratios", nargs=3, help="I1 I2 I3 in any one unit", **numbers)
    command.add_argument("--tensor", nargs=9, help="the whole tensor of inertia, row by row, in kg m2", **numbers)
    command.add_argument("--mesh", metavar="FILE", help="a closed surface: STL, OBJ, PLY or OFF")
    command.add_argument("--density", type=float, metavar="D", help="of the mesh, kg m-3")
    command.add_argument("--mass", type=float, metavar="M", help="of the mesh, kg, in place of its density")
    command.add_argument("--unit", default="m", help="of the mesh's lengths: m (default), cm, mm, in, ft")
    command.add_argument("--omega0", type=float, metavar="W", help="spin rate, rad s-1 (default the body's own, or 1)")
    command.add_argument("--epsilon", type=float, metavar="E", help="size of the nudge, relative (default 1e-6)")
    command.add_argument(
        "--phase", type=float, metavar="P", help="its direction in the (b, c) plane, rad (default 0.6)"
    )
    parser.add_json(command)


def _run(args):
    from sweeps.commands import printing

    if args.name is None and not any(_given(args)):
        _list(args)
        return
    body = _own(args) if any(_given(args)) else _known(args)
    setting = {
        "omega0": _first(args.omega0, body.omega0, 1.0),
        "epsilon": _first(args.epsilon, body.epsilon, 1e-6),
        "phase": _first(args.phase, body.phase, 0.6),
    }

    from sweeps.systems.rigid_body.spins import spins

    found = spins(body.moments, **setting)
    if args.json:
        printing.print_json(_facts(body, setting, found))
    else:
        _print(printing.console(), body, setting, found)


def _given(args) -> list:
    return [value for value in (args.moments, args.ratios, args.tensor, args.mesh) if value is not None]


def _first(*values):
    return next(value for value in values if value is not None)


def _bodies(args) -> dict:
    from sweeps.points import catalogue
    from sweeps.points.loading import load
    from sweeps.schema.definition import DEFAULT_SYSTEM
    from sweeps.schema.refusals import DefinitionError

    path = catalogue.resolve(args.definition)
    definition = load(path)
    bodies = {body.name: body for body in getattr(definition, "bodies", ())}
    if not bodies or definition.system != DEFAULT_SYSTEM:
        raise DefinitionError(
            f"{path}: bodies: (nothing) is missing; allowed: a definition of rigid bodies with bodies"
        )
    return bodies


def _list(args) -> None:
    from sweeps.commands import printing

    names = list(_bodies(args))
    if args.json:
        printing.print_json(names)
    else:
        print("\n".join(names))


def _known(args):
    """The body of that name, with what is set on the command line checked as a definition's."""
    from sweeps.maps.selection import named

    bodies = _bodies(args)
    body = bodies[named(args.name, list(bodies), "body")]
    _checked(args, {"name": body.name, "ratios": {"I1": 1.0, "I2": 1.0, "I3": 1.0}})
    return body


def _own(args):
    """The body given by its numbers or its mesh."""
    from sweeps.schema.refusals import DefinitionError

    if args.name is not None or len(_given(args)) > 1:
        allowed = "NAME, --moments, --ratios, --tensor or --mesh, one of them"
        raise DefinitionError(f"body: more than one is given; allowed: {allowed}")
    values = {"name": args.mesh or "the body given"}
    if args.moments:
        values |= dict(zip(("I1", "I2", "I3"), args.moments, strict=True))
    elif args.ratios:
        values["ratios"] = dict(zip(("I1", "I2", "I3"), args.ratios, strict=True))
    elif args.tensor:
        values["tensor"] = [args.tensor[i : i + 3] for i in (0, 3, 6)]
    else:
        mesh = {"file": args.mesh, "density": args.density, "mass": args.mass, "unit": args.unit}
        values["mesh"] = {key: value for key, value in mesh.items() if value is not None}
    return _checked(args, values)


def _checked(args, values: dict):
    """A body by the rules of a definition; refusals name the key of the definition."""
    from sweeps.points.loading import load
    from sweeps.schema.refusals import DefinitionError

    own = {name: getattr(args, name) for name in ("omega0", "epsilon", "phase") if getattr(args, name) is not None}
    try:
        return load({"bodies": [values | own], "grid": {} if "omega0" in own else {"omega0": 1.0}}).bodies[0]
    except DefinitionError as refused:
        raise DefinitionError(str(refused).replace("definition: bodies[0].", "body: ")) from None


def _facts(body, setting, found) -> dict:
    from dataclasses import asdict

    facts = {"name": body.name, "moments": body.moments, "moments_are_ratios": body.ratios is not None, **setting}
    if body.principal is not None:
        facts |= {"principal_axes": body.principal.axes, "notes": body.principal.notes}
    if body.solid is not None:
        facts |= {name: getattr(body.solid, name) for name in ("mass", "volume", "centre", "extents", "faces")}
    return facts | {"axes": [asdict(spin) for spin in found]}


def _print(console, body, setting, found) -> None:
    from sweeps.commands.printing import table as table_of
    from sweeps.systems.rigid_body import wording
    from sweeps.systems.rigid_body.spins import in_words

    console.print(body.name, style="bold")
    if body.solid is not None:
        console.print(wording.solid_in_words(body.solid))
    if body.principal is None:
        unit = "(ratios)" if body.ratios is not None else "kg m²"
        console.print("I1, I2, I3 = " + ", ".join(f"{moment:.6g}" for moment in body.moments) + f" {unit}")
    else:
        for line in wording.principal_axes(body.principal):
            console.print(line)
    turn = wording.duration(2 * math.pi / abs(setting["omega0"]))
    console.print(
        f"spin {setting['omega0']:.6g} rad s⁻¹ (one turn in {turn}), nudged by {setting['epsilon']:.2g} of it"
    )
    if any(spin.flip_period is not None for spin in found):
        console.print("A larger nudge flips sooner: each flip time below is for this nudge and the axis of its line.")
    console.print()
    table = table_of("about", "what becomes of it")
    for spin in found:
        natural = ", its own" if body.axis == spin.axis else ""
        table.add_row(f"axis {spin.axis}{natural}", in_words(spin, wording.duration))
    console.print(table)
    if body.observed is not None:
        console.print()
        console.print(f"observed: {wording.duration(body.observed.period_days * wording.DAY)}, {body.observed.what}")
    if body.note:
        console.print(f"note: {' '.join(body.note.split())}")
