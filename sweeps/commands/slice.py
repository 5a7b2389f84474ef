"""`slice`: two dimensions of a map, for programs that show planes."""

from sweeps.commands import parser

EPILOG = """\
Give all dimensions but two a value, --DIMENSION VALUE; the nearest grid value is used and reported. Dimensions of
length one need none. CDO, NCO, ncview and Panoply open the file.

  polhode slice results/tennis_racket/stability_map.nc --axis 2 --I3 0.01748 --omega0 10 -o slice.nc
"""


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "slice", "cut a map down to two dimensions", _run, EPILOG)
    command.takes_coordinates = True
    parser.add_map(command)
    command.add_argument("-o", "--output", metavar="FILE", required=True, help="the netCDF file to write")


def _run(args):
    from sweeps.maps import admission, parts, selection, summary

    with admission.opened(args.map) as whole:
        ds = summary.pointwise(whole)
        places = selection.nearest(ds, args.coordinates)
        dims = selection.left(ds, places)
        _check_plane(args.map, ds, dims)
        parts.write_part(selection.at(ds, places), args.output, "slice")
    for place in places.values():
        print(place)
    print(f"{args.output}: {' × '.join(dims)}")


def _check_plane(path: str, ds, dims: list[str]) -> None:
    """Refuse dimensions that form no plane."""
    from sweeps.maps import selection

    if selection.POINT in dims:
        what = "its points are sampled or listed and form no plane"
        allowed = "--point N where two other dimensions are left; `report` and `figures` show all points"
    elif len(dims) != 2:
        what = f"{len(dims)} dimensions are left ({', '.join(dims) or 'none'})"
        fewer = "fewer values: two dimensions must remain"
        allowed = selection.how_to_choose(ds, dims) if len(dims) > 2 else fewer
    else:
        return
    raise selection.SelectionError(f"{path}: {what}; allowed: {allowed}")
