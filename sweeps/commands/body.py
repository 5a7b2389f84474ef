"""`body`: the three axes of a body, in words."""

from sweeps.commands import parser

UNCERTAIN = ("draws", "seed", "method", "turns", "figure")

EPILOG = """\
NAME may be a part of a name: `body racket`. Without NAME the bodies are listed. Or give a body of your own:

  polhode body --moments 0.00121 0.01638 0.01748 --omega0 10
  polhode body --ratios 1 2 2.5
  polhode body --tensor 2 -0.5 0  -0.5 2 0.1  0 0.1 3
  polhode body --mesh racket.stl --density 600 --unit mm

  polhode body --tensor 2 -0.5 0  -0.5 2 0.1  0 0.1 3 --uncertainty 5% --omega0 0.1 --axis 3

With --uncertainty bodies are sampled and each is measured: the probability that each spin is unstable, and the growth
rates. X is a fraction of the moments, or of the tensor's entries where that is given (5%), or a mapping as in a
definition: "{moments: [5 %, 2 %, 1 %], omega0: 10 %, phase: any}". A fraction of an entry that is 0 is 0: for a sigma
of such an off-diagonal entry give {covariance: …}, 6 rows of 6, in kg2 m4.

The moments of a tensor or a mesh come out ascending, with their principal axes in the coordinates of the tensor or
the mesh; --moments and --ratios keep the order given. Off-diagonal entries of a tensor are minus the products of
inertia. --json prints SI units, angles (max_tilt) in rad, as in maps.
"""


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "body", "predict whether a spin about each principal axis is stable", _run, EPILOG)
    command.add_argument("name", metavar="NAME", nargs="?", help="a body of the sweep `bodies`, or of --definition")
    command.add_argument("--definition", metavar="DEFINITION", default="bodies", help="the definition that lists NAME")
    numbers = {"type": float, "metavar": "X"}
    command.add_argument("--moments", nargs=3, help="I1 I2 I3 in kg m2", **numbers)
    command.add_argument("--ratios", nargs=3, help="I1 I2 I3 in any one unit", **numbers)
    command.add_argument("--tensor", nargs=9, help="tensor of inertia, row by row, in kg m2", **numbers)
    command.add_argument("--mesh", metavar="FILE", help="a closed surface: STL, OBJ, PLY or OFF")
    command.add_argument("--density", type=float, metavar="D", help="density of the mesh, kg m-3")
    command.add_argument("--mass", type=float, metavar="M", help="mass of the mesh, kg, in place of its density")
    command.add_argument("--unit", default="m", help="unit of length of the mesh: m (default), cm, mm, in, ft")
    command.add_argument("--omega0", type=float, metavar="W", help="spin rate, rad s-1 (default the body's own, or 1)")
    command.add_argument("--epsilon", type=float, metavar="E", help="size of the perturbation, relative (default 1e-6)")
    command.add_argument(
        "--phase",
        type=float,
        metavar="P",
        help="direction of the perturbation in the transverse plane, rad (default 0.6)",
    )
    command.add_argument(
        "--uncertainty", metavar="X", help="1-sigma uncertainty of the moments, e.g. 5%%, or a mapping"
    )
    command.add_argument("--draws", type=parser.number, metavar="N", help="number of draws, 64 to 4e6 (default 10,000)")
    command.add_argument("--seed", type=parser.number, metavar="S", help="seed of the draws (default 1)")
    command.add_argument("--method", metavar="M", help="sampling: sobol (default), latin, random")
    command.add_argument(
        "--turns", type=parser.number, metavar="T", help="count a flip if it occurs within T turns (default 100)"
    )
    command.add_argument("--twist", action="store_const", const=True, help="state the twist about the handle too")
    command.add_argument("--axis", type=parser.number, metavar="A", help="spin axis (default all three)")
    command.add_argument("--figure", metavar="FILE", help="draw the sampled bodies on the triangle of inertia (PNG)")
    parser.add_json(command)


def _run(args):
    from sweeps.process import startup

    if args.uncertainty is None:  # a few formulas: loading the compiler takes longer than all of them
        startup.leave_out_the_compiler()
    from sweeps.systems.rigid_body import asked
    from sweeps.views import printing

    given = [way for way in asked.WAYS if getattr(args, way) is not None]
    if args.name is None and not given:
        names = list(_bodies(args))
        printing.print_json(names) if args.json else print("\n".join(names))
        return
    body = _own(args, given) if given else _known(args)
    spun, axis = asked.setting(body, vars(args)), asked.axis_of(args.axis)
    if args.uncertainty is not None:
        _uncertain(args, body, spun, given, axis)
    elif beside := [f"--{name}" for name in UNCERTAIN if getattr(args, name) is not None]:
        from sweeps.schema.refusals import DefinitionError

        raise DefinitionError(f"body: {', '.join(beside)}: is given without --uncertainty; allowed: both, or neither")
    elif args.json:
        printing.print_json(asked.facts(body, spun, axis, bool(args.twist)))
    else:
        _print(printing.console(), body.name, *asked.answer(body, spun, axis, bool(args.twist)))


def _uncertain(args, body, spun: dict, given: list[str], axis: int | None) -> None:
    """Print the answer for a body with uncertain moments."""
    from sweeps.points import compile
    from sweeps.points.loading import load
    from sweeps.process import memory, processors
    from sweeps.systems import resolve
    from sweeps.systems.rigid_body import asked
    from sweeps.systems.uncertain_bodies import asked as uncertain
    from sweeps.views import printing

    entry = asked.entry(vars(args)) if given else uncertain.entry_of(body)
    definition = uncertain.definition(entry, vars(args), spun, load)
    compile.compile_kernels(resolve("uncertain_bodies").kernels_of(definition))
    memory.keep_freed()
    found = uncertain.answer(definition, processors.cores())
    if args.figure:
        _draw(found, args.figure)
    if args.json:
        facts, more = asked.facts(body, spun, axis), uncertain.facts(found)
        spins = [spin | more["axes"][spin["axis"]] for spin in facts["axes"] if spin["axis"] in more["axes"]]
        printing.print_json(facts | more | {"axes": spins})
        return
    lines, rows, known = asked.answer(body, spun, axis)
    lines += uncertain.lines(found)
    _print(printing.console(), body.name, lines, [(f"{name}, nominal", text) for name, text in rows], [])
    _print(printing.console(), "", [], uncertain.rows(found), known)


def _draw(found, path: str) -> None:
    from sweeps.figure import style
    from sweeps.process.files import replaced
    from sweeps.systems.uncertain_bodies import asked
    from sweeps.systems.uncertain_bodies.presentation import figure_cloud

    with style.drawn_for(style.ITS_OWN), replaced(path) as temporary:
        figure = figure_cloud.draw(found.body.name, next(asked.lines(found)), found.axes)
        figure.savefig(temporary, format="png")


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
    from sweeps.views.printing import table

    console.print(name, style="bold")
    for line in lines:
        console.print(line)
    console.print()
    made = table("spin about", "outcome")
    for row in rows:
        made.add_row(*row)
    console.print(made)
    if known:
        console.print()
    for line in known:
        console.print(line)
