"""`verify`: is a map what its definition makes."""

from sweeps.commands import parser

EPILOG = """\
exit status: 0 the map is whole; 1 it differs, and lines say in what; 2 it is no map
"""


def add(commands) -> None:
    """Describes the command."""
    command = parser.add(commands, "verify", "say whether a map is what its definition makes", _run, EPILOG)
    parser.add_map(command)
    command.add_argument("--definition", metavar="DEFINITION", help="what the map should have been made from")
    command.add_argument("--points", type=int, default=100, metavar="N", help="points to measure again (default 100)")
    command.add_argument("--seed", type=int, default=0, metavar="S", help="seed of their choice (default 0)")
    command.add_argument("--any-kernels", action="store_true", help="allow a map of other kernels or another machine")


def _run(args):
    from sweeps.maps import verify

    return verify.command(args.map, args.points, args.seed, args.definition, args.any_kernels)
