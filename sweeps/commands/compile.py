"""`compile`: the kernels, once per machine."""

from sweeps.commands import parser


def add(commands) -> None:
    """Describes the command."""
    command = parser.add(commands, "compile", "compile the kernels, once per machine", _run)
    command.add_argument("-o", "--output", metavar="FILE", help="write the kernels' fingerprint to FILE")


def _run(args):
    from kernels.fingerprint import fingerprint
    from sweeps import warmup
    from sweeps.files import replaced

    warmup.compile_kernels()
    if args.output:
        with replaced(args.output) as temporary:
            temporary.write_text(fingerprint() + "\n")
