"""`compile`: the kernels of a sweep, once per machine."""

from sweeps.commands import parser


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "compile", "compile the kernels of a sweep, once per machine", _run)
    parser.add_definition(command, nargs="?", default=None)
    command.add_argument("--all", action="store_true", help="compile the kernels of every system")
    command.epilog = "Without DEFINITION, those of the default sweep."


def _run(args):
    from sweeps import systems
    from sweeps.points import catalogue, compile
    from sweeps.points.loading import read

    sweep = read(catalogue.resolve(args.definition or catalogue.DEFAULT))  # refused before any work
    compile.compile_kernels([*sweep.system.kernels_of(sweep.definition), *(systems.all_kernels() if args.all else ())])
