"""`compile`: the kernels, once per machine, and what is generated for a sweep's system."""

from sweeps.commands import parser


def add(commands) -> None:
    """Describes the command."""
    command = parser.add(commands, "compile", "compile the kernels, once per machine", _run)
    parser.add_definition(command, nargs="?", default=None)
    command.add_argument("--all", action="store_true", help="compile the kernels of every system")
    command.add_argument("-o", "--output", metavar="FILE", help="write the kernels' fingerprint to FILE")
    command.epilog = "With DEFINITION, compiles what its system's equations are generated into besides."


def _run(args):
    from kernels.fingerprint import fingerprint
    from sweeps.files import replaced
    from sweeps.points import catalogue
    from sweeps.points.loading import read
    from sweeps.run import warmup

    # a definition that is wrong is refused before any work
    system = read(catalogue.resolve(args.definition)).system if args.definition else None
    warmup.compile_kernels(args.all)
    if system:
        warmup.compile_system(system)
    if args.output:
        with replaced(args.output) as temporary:
            temporary.write_text(fingerprint() + "\n")
