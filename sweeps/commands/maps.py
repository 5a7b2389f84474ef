"""Commands that take a map: show, point, slice, figures, report, verify."""

import re
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

from sweeps.commands import parser
from sweeps.figure import colors, printing
from sweeps.process import progress
from sweeps.schema.datasets import dimensions, flags, units_of
from sweeps.schema.refusals import RefusedError, cut_text

SHOW = """\
A grid is also drawn in characters, at the middle of the dimensions that the drawing does not show, or at
--DIMENSION VALUE (the nearest grid value). The numbers above it are of the whole map.
"""


def add_show(commands) -> None:
    """Add the command `show`."""
    command = parser.add(
        commands, "show", "summarise a map, with a small map in characters", _print_summary, SHOW, coordinates=True
    )
    parser.share(command, "map", "--json")


def _print_summary(args):
    """Print the summary of a map and a drawing in characters at the chosen values; with --json, only the summary."""
    from sweeps.maps import selection, storage, summary
    from sweeps.maps.description import without_extra_dimensions
    from sweeps.views import textmap

    with storage.open_map(args.map) as map_file:
        ds = without_extra_dimensions(map_file)
        grid_values = selection.nearest_places(ds, args.coordinates, "--")
        totals = summary.summarise(ds)
        requested = {dim: grid_value for dim, grid_value in grid_values.items() if grid_value.requested is not None}
        if args.json:
            printing.print_json(_summary_entries(totals))
        else:
            console = printing.console()
            textmap.print_summary(console, totals, textmap.draw_map(ds, totals.description, requested, console.width))


def _summary_entries(totals) -> dict:
    """Return the summary of a map as the mapping that `show --json` prints.

    Its keys: title, system, source, content_hash, dimensions, points, compared, impossible (numbers of points), counts
    (flag variable → meaning → points), table (regime → status → points), unlike (flag variable → points that differ
    from theory), deviations and checks (variable → largest value, its place, and number of points).
    """
    description = totals.description

    def as_entry(worst):
        return {"value": worst.value, "at": description.place(worst.at), "points": worst.points}

    table: dict[str, dict[str, int]] = {}
    for (meaning, status), number in totals.table.items():
        table.setdefault(meaning, {})[status] = number
    names = ("title", "system", "source", "content_hash")
    facts: dict[str, Any] = {name: str(description.attributes.get(name, "")) for name in names}
    facts |= {"dimensions": description.sizes, "points": totals.points, "counts": totals.counts, "table": table}
    facts |= {"unlike": totals.disagreements, "impossible": totals.impossible, "compared": totals.compared}
    facts["deviations"] = {}
    for (reference, name), deviation in totals.deviations.items():
        entry = as_entry(deviation.worst) | {"against": reference, "over": deviation.scale or reference}
        facts["deviations"].setdefault(name, entry)
    return facts | {"checks": {name: as_entry(worst) for name, worst in totals.checks.items()}}


POINT = """\
Give each dimension longer than one a value, --DIMENSION VALUE; the nearest grid value is used and reported. Without a
value of --mode, --eigenvalue or --multiplier all of them are printed.

  polhode point results/tennis_racket --axis 2 --I1 0.00121 --I2 0.01638 --I3 0.01748 --omega0 "90 rpm" \\
      --trajectory racket.csv

--trajectory writes omega(t) in body axes and the attitude (a unit quaternion, scalar first, from body to inertial
frame), from the closed form (omega1 … omega3, q0 … q3) and, except for a symmetric top, from direct integration
(omega1_direct …, q0_direct …), over two flips or two wobble periods unless --duration is given. FILE ends in .nc,
.csv or .aem (attitude of a body, CCSDS AEM); for a film see `polhode motion`.
"""


def add_point(commands) -> None:
    """Add the command `point`."""
    command = parser.add(
        commands, "point", "print every variable at one grid point", _print_point, POINT, coordinates=True
    )
    parser.share(command, "map")
    command.add_argument("--trajectory", metavar="FILE", help="write the motion of the point")
    parser.share(command, "--duration", "--samples", "--json")


def _print_point(args):
    """Print all variables at the grid point nearest to the coordinates; with --trajectory, write its motion."""
    from sweeps.maps import motion, selection

    if args.trajectory:
        motion.check_format(args.trajectory)
    row, places = selection.select_point(args.map, args.coordinates, "--")
    if args.trajectory:
        with progress.announce("computing the motion; the first time on a machine its kernels are compiled"):
            trajectory = motion.point_motion(row, args.duration, motion.map_tolerance(row), args.samples)
        motion.write_motion(trajectory, args.trajectory)
    _print_variables(row, places, args.json)


def _print_variables(row, places, as_json: bool) -> None:
    """Print coordinates and variables of one point, as a table or as JSON."""
    if as_json:
        printing.print_json({"point": _value_entries(row, row.coords), "variables": _value_entries(row, row.data_vars)})
        return
    console = printing.console()
    for place in places.values():
        console.print(str(place))
    for name, value in row.coords.items():
        if name not in places and value.ndim == 0 and not ("flag_meanings" in value.attrs and value.item() == 0):
            # the flag 0 is the usual one: moments in kg m2
            console.print(f"{name} = {_format_value(value)} {units_of(value)}".rstrip())
    console.print()
    table = printing.table("variable", "value", "units", "meaning", right=(1,))
    for name, variable in row.data_vars.items():
        table.add_row(name, _format_value(variable), units_of(variable), str(variable.attrs.get("long_name", "")))
    console.print(table)


def _format_value(variable) -> str:
    """Return a value as people read it; all digits are in the JSON."""
    from sweeps.maps.selection import format_value

    value = _plain_value(variable)
    words = [
        "missing" if item != item else format_value(item) for item in (value if isinstance(value, list) else [value])
    ]
    return ", ".join(words if len({*words}) > 1 else words[:1])


def _plain_value(variable):
    """Return the value of a variable for JSON, a number or a list, with flags replaced by their meanings."""
    value, meanings = variable.values.tolist(), flags(variable)
    if isinstance(value, list):
        return [meanings.get(item, item) for item in value] if meanings else value
    return meanings.get(value, value)


def _value_entries(row, names) -> dict:
    return {name: {"value": _plain_value(row[name]), "units": str(row[name].attrs.get("units", ""))} for name in names}


SLICE = """\
Give all dimensions but two a value, --DIMENSION VALUE; the nearest grid value is used and reported. Dimensions of
length one need none, nor do those that single variables have in addition, such as the multipliers of a periodic motion:
without a value they are kept whole. CDO, NCO, ncview and Panoply open the file.

  polhode slice results/tennis_racket/stability_map.nc --axis 2 --I3 0.01748 --omega0 10 -o slice.nc
"""


def add_slice(commands) -> None:
    """Add the command `slice`."""
    command = parser.add(commands, "slice", "cut a map down to two dimensions", _write_slice, SLICE, coordinates=True)
    parser.share(command, "map")
    parser.add_output(command, "the netCDF file to write")


def _write_slice(args):
    """Write the plane of a map through the chosen grid values to a netCDF file, and print the values used."""
    from sweeps.maps import selection, storage
    from sweeps.maps.description import extra_dimensions
    from sweeps.shards.mapfile import write_part

    with storage.open_map(args.map) as ds:
        places = selection.nearest_places(ds, args.coordinates, "--")
        kept_dims, extra_dims = [dim for dim in dimensions(ds) if dim not in places], extra_dimensions(ds)
        plane = [dim for dim in kept_dims if dim not in extra_dims]
        _check_plane(args.map, ds, plane)
        write_part(selection.select_places(ds, places), args.output, "slice")
    for place in places.values():
        print(place)
    print(f"{args.output}: {' × '.join(plane)}")
    for dim in kept_dims:
        if dim in extra_dims:
            names = ", ".join(name for name, variable in ds.data_vars.items() if dim in variable.dims)
            print(f"{names}: along {dim}, too ({ds.sizes[dim]:,} values; --{dim} VALUE keeps one)")


def _check_plane(path: str, ds, dims: list[str]) -> None:
    """Refuse dimensions that form no plane."""
    from sweeps.maps import selection

    if selection.POINT.name in dims:
        what = "its points are sampled or listed and form no plane"
        allowed = "--point N where two other dimensions are left; `report` and `figures` show all points"
    elif len(dims) != 2:
        what = (
            f"{len(dims)} dimension{' is' if len(dims) == 1 else 's are'} without a value ({', '.join(dims) or 'none'})"
        )
        fewer = "fewer values: two dimensions must remain"
        allowed = selection.how_to_choose(ds, dims, "--") if len(dims) > 2 else fewer
    else:
        return
    raise selection.SelectionError(f"{path}: {what}; allowed: {allowed}")


FORMATS = ("png", "svg", "pdf", "mp4", "webm")
MIN_SIDE, MAX_SIDE = 30, 2000  # mm, sides of a figure
MILLIMETRES = {"": 1.0, "mm": 1.0, "cm": 10.0, "in": 25.4}
FIGURES = """\
Draws all figures, or those named by --only, at the values given by --at or --DIMENSION VALUE (the nearest grid value is
used and reported). SVG and PDF are for slides and papers: the text of a PDF can be searched, and its fonts are in the
file; the letters of an SVG are curves. MP4 and WebM are for animations and need ffmpeg; with the other formats
animations are GIF. SIZE is slide (16:9, 1920 x 1080 pixels), page (178 mm wide), column (86 mm), or a width or width x
height: 160 (mm), 15cm, 6x4in.

  polhode figures results/tennis_racket/stability_map.nc -o slides --format pdf --only stability --axis 2
"""


def add_figures(commands) -> None:
    """Add the command `figures`."""
    command = parser.add(commands, "figures", "draw the figures of a map", _draw_figures, FIGURES, coordinates=True)
    parser.share(command, "map")
    command.add_argument("-o", "--output", metavar="FOLDER", required=True, help="the folder to write")
    command.add_argument("--format", choices=FORMATS, default="png", help="format of figures; mp4, webm: of animations")
    command.add_argument("--theme", choices=colors.THEMES, default="light", help="print: distinguishable in greyscale")
    text = "slide, page, column, 160mm, 15cm, 6in, 160x100mm (default: set by the figure)"
    command.add_argument("--size", metavar="SIZE", help=text)
    text = "name of a figure or its beginning; may be given several times"
    command.add_argument("--only", metavar="NAME", action="append", default=[], help=text)
    text = "value at which to cut the map; may be given several times"
    command.add_argument("--at", metavar="DIMENSION=VALUE", action="append", default=[], help=text)


def _draw_figures(args):
    """Draw the figures of a map; a second process draws some of them unless --only selects few."""
    from sweeps.views import drawing

    sheet = _parse_sheet(args.size)
    with nullcontext() if args.only else drawing.start_worker() as worker:  # few are drawn before a worker is ready
        return _draw_at_values(args, sheet, worker)


def _draw_at_values(args, sheet, worker):
    """Draw the figures of a map at the chosen coordinates, and print the files and the grid values used."""
    from sweeps.maps import selection
    from sweeps.views import drawing, figures

    with figures.open_to_draw(args.map) as ds:
        requested = args.coordinates | dict(selection.parse_assignment(text) for text in args.at)
        places = selection.nearest_places(ds, requested, "--")
        cut_places = [places[name] for name in requested]
        cut = {place.dim: slice(place.index, place.index + 1) for place in cut_places}
        submit = partial(worker.submit, drawing.draw_picture, args.map, cut) if worker else None
        wish = (args.format, args.only, args.theme, sheet, submit)
        for path in figures.draw_all(ds.isel(cut), Path(args.output), *wish):
            print(path)
    for place in cut_places:
        print(place)


def _parse_sheet(text: str | None):
    """Return the sheet of paper or slide that `--size` names."""
    from sweeps.figure import sheets

    if text is None or text in sheets.SHEETS:
        return sheets.OWN_SIZE if text is None else sheets.SHEETS[text]
    match = re.fullmatch(r"(\d+(?:\.\d+)?)(?: ?[x×] ?(\d+(?:\.\d+)?))? ?(mm|cm|in|)", text)
    *lengths, unit = match.groups() if match else ("",)
    sides = [float(length) * MILLIMETRES[unit] for length in lengths if length]
    if not sides or not all(MIN_SIDE <= side <= MAX_SIDE for side in sides):
        allowed = f"{', '.join(sheets.SHEETS)}, a width or width x height from {MIN_SIDE} to {MAX_SIDE} mm"
        allowed += " (160, 160x100mm, 15cm, 6x4in)"
        raise RefusedError(f"--size: {cut_text(repr(text))} is not a size; allowed: {allowed}")
    return sheets.Sheet(*sides)


def add_report(commands) -> None:
    """Add the command `report`."""
    command = parser.add(commands, "report", "write the report of a map, one HTML file to explore", _write_report)
    parser.share(command, "map")
    text = "the map's definition, to show motions by the equations of the Python file that it names"
    command.add_argument("--definition", metavar="DEFINITION", help=text)
    parser.add_output(command, "the HTML file to write")


def _write_report(args):
    """Write the report of a map as one HTML file, and print its name."""
    from sweeps.points import catalogue, loading
    from sweeps.views import figures, report

    path = args.definition and catalogue.find_definition(args.definition)
    sweep = path and loading.read_sweep(path, check=False)
    with figures.open_to_draw(args.map) as ds:
        if sweep and sweep.definition.text != ds.attrs.get("definition"):
            raise RefusedError(f"--definition: {path} is not the map's; allowed: the definition that made the map")
        report.write_report(ds, args.output, system=sweep and sweep.system)
    print(args.output)


VERIFY = """\
exit status: 0 the map is whole; 1 it differs (the differences are listed); 2 the file is not a map
"""


def add_verify(commands) -> None:
    """Add the command `verify`."""
    words = "compare a map with its definition, and measure random points again"
    command = parser.add(commands, "verify", words, _verify_map, VERIFY)
    parser.share(command, "map")
    command.add_argument("--definition", metavar="DEFINITION", help="the definition that should have made the map")
    command.add_argument("--points", type=int, default=100, metavar="N", help="points to measure again (default 100)")
    command.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the choice of points (default 0)")
    command.add_argument("--any-kernels", action="store_true", help="allow a map of other kernels or another machine")


def _verify_map(args):
    """Compare a map with its definition and with points measured again; print each check, and return 1 if one fails."""
    from sweeps.maps import verify

    sweep = verify.read_expected_sweep(args.map, args.definition)
    checks = verify.verify(args.map, args.points, args.seed, sweep, args.any_kernels)
    table = printing.table("check", "what was compared", "")
    for check in checks:
        verdict = "differs" if check.findings else f"not checked: {check.skip_reason}" if check.skip_reason else "holds"
        table.add_row(check.name, check.covers, verdict)
    printing.console().print(table)
    for difference in (difference for check in checks for difference in check.findings):
        printing.console().print(difference, soft_wrap=True)
    return 1 if any(check.findings for check in checks) else 0
