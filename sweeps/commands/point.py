"""`point`: one point of a map, with units, and its motion."""

from sweeps.commands import parser

EPILOG = """\
Give each dimension longer than one a value, --DIMENSION VALUE; the nearest grid value is used and reported.

  polhode point results/tennis_racket --axis 2 --I1 0.00121 --I2 0.01638 --I3 0.01748 --omega0 "90 rpm" \\
      --trajectory racket.csv

--trajectory writes omega(t) in body axes and the attitude (a unit quaternion, scalar first, from body to inertial
frame), from the closed form (omega1 … omega3, q0 … q3) and, except for a symmetric top, from direct integration
(omega1_direct …, q0_direct …), over two flips or two wobble periods unless --duration is given. FILE ends in .nc or
.csv; for a film see `polhode motion`.
"""


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "point", "print every variable at one grid point", _run, EPILOG)
    command.takes_coordinates = True
    parser.add_map(command)
    command.add_argument("--trajectory", metavar="FILE", help="write the motion of the point")
    parser.add_duration(command)
    parser.add_json(command)


def _run(args):
    from sweeps.maps import motion, selection
    from sweeps.pipeline import waiting

    if args.trajectory:
        motion.check_format(args.trajectory)
    row, places = selection.point(args.map, args.coordinates)
    if args.trajectory:
        with waiting.said("computing the motion; the first time on a machine its kernels are compiled"):
            moved = motion.of_point(row, args.duration, motion.tolerance_of(row), args.samples)
        motion.write(moved, args.trajectory)
    _print(row, places, args.json)


def _print(row, places, as_json: bool) -> None:
    from sweeps.figure import printing

    if as_json:
        printing.print_json({"point": _entries(row, row.coords), "variables": _entries(row, row.data_vars)})
        return
    console = printing.console()
    for place in places.values():
        console.print(str(place))
    for name, one in row.coords.items():
        if name not in places and one.ndim == 0 and not ("flag_meanings" in one.attrs and one.item() == 0):
            console.print(f"{name} = {_value(one)} {_units(one)}".rstrip())  # of flags, all but moments in kg m2
    console.print()
    table = printing.table("variable", "value", "units", "meaning", right=(1,))
    for name, variable in row.data_vars.items():
        table.add_row(name, _value(variable), _units(variable), str(variable.attrs.get("long_name", "")))
    console.print(table)


def _units(variable) -> str:
    units = str(variable.attrs.get("units", ""))
    return "" if units == "1" else units


def _value(variable) -> str:
    """Return a value as people read it; all digits are in the JSON."""
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
