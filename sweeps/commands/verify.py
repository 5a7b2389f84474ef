"""`verify`: is a map what its definition makes."""

from sweeps.commands import parser

EPILOG = """\
exit status: 0 the map is whole; 1 it differs (the differences are listed); 2 the file is not a map
"""


def add(commands) -> None:
    """Add the command to the parser."""
    words = "compare a map with its definition, and measure random points again"
    command = parser.add(commands, "verify", words, _run, EPILOG)
    parser.add_map(command)
    command.add_argument("--definition", metavar="DEFINITION", help="the definition that should have made the map")
    command.add_argument("--points", type=int, default=100, metavar="N", help="points to measure again (default 100)")
    command.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the choice of points (default 0)")
    command.add_argument("--any-kernels", action="store_true", help="allow a map of other kernels or another machine")


def _run(args):
    from sweeps.figure import printing
    from sweeps.maps import verify

    checks = verify.checked(args.map, args.points, args.seed, args.definition, args.any_kernels)
    table = printing.table("check", "what was compared", "")
    for check in checks:
        verdict = "differs" if check.findings else f"not checked: {check.skipped}" if check.skipped else "holds"
        table.add_row(check.name, check.covers, verdict)
    printing.console().print(table)
    for finding in (finding for check in checks for finding in check.findings):
        printing.console().print(finding, soft_wrap=True)
    return 1 if any(check.findings for check in checks) else 0
