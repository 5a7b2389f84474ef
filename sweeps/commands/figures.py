"""`figures`: a map's pictures."""

from pathlib import Path

from sweeps.commands import parser


def add(commands) -> None:
    """Describes the command."""
    command = parser.add(commands, "figures", "draw a map's pictures as PNG", _run)
    parser.add_map(command)
    command.add_argument("-o", "--output", metavar="FOLDER", required=True, help="the folder to write")


def _run(args):
    from sweeps.maps import storage
    from sweeps.views import figures

    with storage.open_map(args.map) as ds:
        for path in figures.draw_all(ds, Path(args.output)):
            print(path)
