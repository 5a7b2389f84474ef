"""`point`: one point of a map, with units, and its motion."""

from sweeps.commands import parser

EPILOG = """\
Give each dimension longer than one a value, --DIMENSION VALUE; the nearest grid value is used and reported.

  python -m sweeps point results/tennis_racket/stability_map.nc \\
      --axis 2 --I1 0.00121 --I2 0.01638 --I3 0.01748 --omega0 10 --trajectory racket.csv

--trajectory writes omega(t) in body axes and the attitude (a unit quaternion, scalar first, from body to inertial
frame), from the closed form (omega1 … omega3, q0 … q3) and, except for a symmetric top, from direct integration
(omega1_direct …, q0_direct …), over two flips or two wobble periods unless --duration is given.
"""


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "point", "print every variable at one grid point", _run, EPILOG)
    command.takes_coordinates = True
    parser.add_map(command)
    command.add_argument("--trajectory", metavar="FILE", help="write the motion of the point, as FILE.nc or FILE.csv")
    command.add_argument("--duration", type=float, metavar="SECONDS", help="length of the motion")
    command.add_argument("--samples", type=int, metavar="N", help="number of instants, both ends included")
    parser.add_json(command)


def _run(args):
    from sweeps.maps import motion, selection, storage, summary

    if args.trajectory:
        motion.check_format(args.trajectory)
    with storage.open_map(args.map) as ds:
        points = summary.pointwise(ds)
        places = selection.nearest(points, args.coordinates)
        dims = selection.left(points, places)
        if dims:
            what = f"{len(dims)} dimensions are left ({', '.join(dims)})"
            raise selection.SelectionError(
                f"{args.map}: {what}; allowed: a value for each, {selection.how_to_choose(points, dims)}"
            )
        row = selection.at(ds, places).load()
    if args.trajectory:
        _write_motion(row, args)
    _print(row, places, args.json)


def _write_motion(row, args) -> None:
    from sweeps import systems
    from sweeps.maps import motion
    from sweeps.reading.definitions import definition_of

    point = {name: row[name].item() for name in row.coords if row[name].ndim == 0}
    integration = definition_of(row.attrs).get("integration")
    tolerance = integration.get("tolerance") if isinstance(integration, dict) else None
    tolerance = tolerance if isinstance(tolerance, float) and 1e-13 <= tolerance <= 1e-3 else 1e-10
    moved = motion.of(systems.of_map(row), point, args.duration, args.samples, tolerance)
    kept = {name: row.attrs.get(name, "") for name in ("title", "source", "Conventions", "kernel_fingerprint")}
    kept["point"] = ", ".join(f"{name} = {value}" for name, value in point.items())
    motion.write(moved.assign_attrs(kept), args.trajectory)


def _print(row, places, as_json: bool) -> None:
    from sweeps.views import printing

    if as_json:
        printing.print_json({"point": _entries(row, row.coords), "variables": _entries(row, row.data_vars)})
        return
    console = printing.console()
    for place in places.values():
        console.print(str(place))
    for name in row.coords:
        if name not in places and row[name].ndim == 0:
            console.print(f"{name} = {_value(row[name])} {_units(row[name])}".rstrip())
    console.print()
    table = printing.table("variable", "value", "units", "meaning", right=(1,))
    for name, variable in row.data_vars.items():
        table.add_row(name, _value(variable), _units(variable), str(variable.attrs.get("long_name", "")))
    console.print(table)


def _units(variable) -> str:
    units = str(variable.attrs.get("units", ""))
    return "" if units == "1" else units


def _value(variable) -> str:
    """A value as people read it; all digits are in the JSON."""
    from sweeps.maps.selection import in_words

    value = _plain(variable)
    if isinstance(value, list):
        return ", ".join(in_words(item) for item in value)
    return "missing" if value != value else in_words(value)


def _plain(variable):
    from sweeps.schema.boxes import flags

    value = variable.values.tolist()
    return flags(variable).get(value, value) if not isinstance(value, list) else value


def _entries(row, names) -> dict:
    return {name: {"value": _plain(row[name]), "units": str(row[name].attrs.get("units", ""))} for name in names}
