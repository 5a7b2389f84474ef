"""`body`: the three axes of a body, in words."""

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
    from sweeps.systems.rigid_body import asked

    given = [way for way in asked.WAYS if getattr(args, way) is not None]
    if args.name is None and not given:
        names = list(_bodies(args))
        printing.print_json(names) if args.json else print("\n".join(names))
        return
    body = _own(args, given) if given else _known(args)
    spun = asked.setting(body, vars(args))
    if args.json:
        printing.print_json(asked.facts(body, spun))
    else:
        _print(printing.console(), body.name, *asked.answer(body, spun))


def _bodies(args) -> dict:
    from sweeps.points import catalogue
    from sweeps.points.loading import load
    from sweeps.systems.rigid_body import asked

    path = catalogue.resolve(args.definition)
    return asked.bodies(load(path), path)


def _known(args):
    """The body of that name, with what is set on the command line checked as a definition's."""
    from sweeps.maps.selection import named
    from sweeps.points.loading import load
    from sweeps.systems.rigid_body import asked

    bodies = _bodies(args)
    body = bodies[named(args.name, list(bodies), "body")]
    asked.check_spin(body.name, vars(args), load)
    return body


def _own(args, given: list[str]):
    """The body given by its numbers or its mesh."""
    from sweeps.points.loading import load
    from sweeps.schema.refusals import DefinitionError
    from sweeps.systems.rigid_body import asked

    if args.name is not None or len(given) > 1:
        allowed = "NAME, --moments, --ratios, --tensor or --mesh, one of them"
        raise DefinitionError(f"body: more than one is given; allowed: {allowed}")
    return asked.checked(asked.entry(vars(args)), vars(args), load)


def _print(console, name: str, lines: list[str], rows: list[tuple[str, str]], known: list[str]) -> None:
    from sweeps.commands.printing import table

    console.print(name, style="bold")
    for line in lines:
        console.print(line)
    console.print()
    made = table("about", "what becomes of it")
    for row in rows:
        made.add_row(*row)
    console.print(made)
    if known:
        console.print()
    for line in known:
        console.print(line)
