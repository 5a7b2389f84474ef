"""`figures`: a map's pictures."""

from pathlib import Path

from sweeps.commands import parser

FORMATS = ("png", "svg", "pdf", "mp4", "webm")
THEMES = ("light", "dark", "print")
LEAST_MM, MOST_MM = 30, 2000
MILLIMETRES = {"": 1.0, "mm": 1.0, "cm": 10.0, "in": 25.4}
EPILOG = """\
Draws all figures, or those named by --only, at the values given by --at or --DIMENSION VALUE (the nearest grid value is
used and reported). SVG and PDF are for slides and papers: their text can be searched and edited, and the fonts are in
the file. MP4 and WebM are for animations and need ffmpeg; with the other formats animations are GIF. SIZE is slide
(16:9, 1920 x 1080 pixels), page (178 mm wide), column (86 mm), or a width or width x height: 160 (mm), 15cm, 6x4in.

  polhode figures results/tennis_racket/stability_map.nc -o slides --format pdf --only stability --axis 2
"""


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "figures", "draw the figures of a map", _run, EPILOG)
    command.takes_coordinates = True
    parser.add_map(command)
    command.add_argument("-o", "--output", metavar="FOLDER", required=True, help="the folder to write")
    command.add_argument("--format", choices=FORMATS, default="png", help="format of figures; mp4, webm: of animations")
    command.add_argument("--theme", choices=THEMES, default="light", help="print: distinguishable in greyscale")
    text = "slide, page, column, 160mm, 15cm, 6in, 160x100mm (default: set by the figure)"
    command.add_argument("--size", metavar="SIZE", help=text)
    text = "name of a figure or its beginning; may be given several times"
    command.add_argument("--only", metavar="NAME", action="append", default=[], help=text)
    text = "value at which to cut the map; may be given several times"
    command.add_argument("--at", metavar="DIMENSION=VALUE", action="append", default=[], help=text)


def _run(args):
    from contextlib import nullcontext

    from sweeps.views import drawing

    sheet = _sheet(args.size)
    with nullcontext() if args.only else drawing.worker() as worker:  # few are drawn before a worker is ready
        return _draw(args, sheet, worker)


def _draw(args, sheet, worker):
    from functools import partial

    from sweeps.maps import selection
    from sweeps.views import drawing, figures

    with figures.opened(args.map) as ds:
        requested = args.coordinates | dict(selection.assigned(text) for text in args.at)
        places = selection.nearest(ds, requested)
        chosen = [places[name] for name in requested]
        cut = {place.dim: slice(place.index, place.index + 1) for place in chosen}
        submit = partial(worker.submit, drawing.draw, args.map, cut) if worker else None
        wish = (args.format, args.only, args.theme, sheet, submit)
        for path in figures.draw_all(ds.isel(cut), Path(args.output), *wish):
            print(path)
    for place in chosen:
        print(place)


def _sheet(text: str | None):
    """Return the sheet of paper or slide that `--size` names."""
    import re

    from sweeps.figure import style
    from sweeps.schema.refusals import RefusedError, shortened

    if text is None or text in style.SHEETS:
        return style.SHEETS.get(text, style.ITS_OWN)
    match = re.fullmatch(r"(\d+(?:\.\d+)?)(?: ?[x×] ?(\d+(?:\.\d+)?))? ?(mm|cm|in|)", text)
    *sides, unit = match.groups() if match else ("",)
    sides = [float(side) * MILLIMETRES[unit] for side in sides if side]
    if not sides or not all(LEAST_MM <= side <= MOST_MM for side in sides):
        allowed = f"{', '.join(style.SHEETS)}, a width or width x height from {LEAST_MM} to {MOST_MM} mm"
        allowed += " (160, 160x100mm, 15cm, 6x4in)"
        raise RefusedError(f"--size: {shortened(repr(text))} is not a size; allowed: {allowed}")
    return style.Sheet(*sides)
