"""`figures`: a map's pictures."""

from pathlib import Path

from sweeps.commands import parser

FORMATS = ("png", "svg", "pdf")
EPILOG = """\
All of them, or those that --only names; at the places that --at, or --DIMENSION VALUE, chooses (the grid's nearest is
taken, and said). SVG and PDF are for slides and papers: their text can be searched and edited.

  python -m sweeps figures results/tennis_racket/stability_map.nc -o slides --format pdf --only stability --axis 2
"""


def add(commands) -> None:
    """Describes the command."""
    command = parser.add(commands, "figures", "draw a map's pictures", _run, EPILOG)
    command.takes_coordinates = True
    parser.add_map(command)
    command.add_argument("-o", "--output", metavar="FOLDER", required=True, help="the folder to write")
    command.add_argument("--format", choices=FORMATS, default="png", help="of the pictures (animations are GIF)")
    text = "a picture's name or how it begins; may be given several times"
    command.add_argument("--only", metavar="NAME", action="append", default=[], help=text)
    text = "where to cut the map; may be given several times"
    command.add_argument("--at", metavar="DIMENSION=VALUE", action="append", default=[], help=text)


def _run(args):
    from sweeps.maps import selection, storage
    from sweeps.views import figures

    with storage.open_map(args.map) as ds:
        asked = args.coordinates | dict(selection.assigned(text) for text in args.at)
        places = selection.nearest(ds, asked)
        chosen = [places[name] for name in asked]
        ds = ds.isel({place.dim: [place.index] for place in chosen})
        for path in figures.draw_all(ds, Path(args.output), args.format, args.only):
            print(path)
    for place in chosen:
        print(place)
