"""`report`: a map's page to explore."""

from sweeps.commands import parser


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "report", "write the report of a map, one HTML file to explore", _run)
    parser.add_map(command)
    command.add_argument("-o", "--output", metavar="FILE", required=True, help="the HTML file to write")


def _run(args):
    from sweeps.views import figures, report

    with figures.opened(args.map) as ds:
        report.write(ds, args.output)
    print(args.output)
