"""Commands on the modes of a map: critical, modes, response."""

import math
from pathlib import Path

from sweeps.commands import parser
from sweeps.figure import printing
from sweeps.process import progress

CRITICAL = """\
Each value of the parameter at which the regime changes, on every line of the map along it, or on those at --DIMENSION
VALUE (the nearest grid value is used). Values are refined between the grid points by measuring the system again.

  polhode critical results/sleeping_top --along spin_rate --I3 0.6 --moment_of_weight 2
"""


def add_critical(commands) -> None:
    """Add the command `critical`."""
    words = "refine the values of a parameter at which the regime changes"
    command = parser.add(commands, "critical", words, _print_critical_values, CRITICAL, coordinates=True)
    parser.share(command, "map")
    command.add_argument("--along", metavar="PARAMETER", required=True, help="the parameter")
    _add_definition(command)
    parser.share(command, "--json")


def _add_definition(command) -> None:
    """Add the option for the definition of a map."""
    text = "the map's definition, if its system is a Python file"
    command.add_argument("--definition", metavar="DEFINITION", help=text)


def _print_critical_values(args):
    """Print each change of the regime along a parameter, with its line, as a table or as JSON."""
    from sweeps.maps.critical_values import find_critical_values

    with progress.announce("measuring between the grid points"):
        changes = find_critical_values(args.map, args.along, args.coordinates, args.definition, "--")
    if args.json:
        printing.print_json({str(name): changes[name].values.tolist() for name in changes.variables})
        return
    varied = [str(name) for name in changes.coords if len({*changes[name].values.tolist()}) > 1]
    table = printing.table(*varied, args.along, "error", "theory", "kind", "regime", "critical mode", "rad s-1")
    for change in range(changes.sizes["change"]):
        row = {str(name): variable.values.tolist()[change] for name, variable in changes.variables.items()}
        places = [_format_number(row[name]) for name in varied]
        regimes = f"{row['regime_before']} → {row['regime_after']}"
        values = [_format_number(row[f"critical_value{suffix}"], digits) for suffix, digits in VALUE_DIGITS.items()]
        mode = [str(row["critical_mode"]), _format_number(row["frequency_theory"])]
        table.add_row(*places, *values, row["kind"], regimes, *mode)
    printing.console().print(table)
    count = changes.sizes["change"]
    print(f"{count} change{'' if count == 1 else 's'} of the regime along {args.along}")


def _format_number(value: float | int | str, digits: int = 6) -> str:
    """Return a value as people read it; all digits are in the JSON."""
    return str(value) if isinstance(value, str) else "missing" if value != value else f"{value + 0.0:.{digits}g}"


VALUE_DIGITS = {"": 13, "_error": 2, "_theory": 13}  # printed digits of a critical value, its error and theory's


MODES = """\
The modes at one point of a map: give each dimension longer than one a value, --DIMENSION VALUE (the nearest grid value
is used and reported); with --along PARAMETER those on a line along it, followed through crossings and veerings. Of
conjugate modes one is printed. Rates are measured, and so are shapes: x^H M x = 1, with M the kinetic matrix, the first
large component real and positive. Errors are bounds; those of a shape are in that norm.

The suffix of FILE decides: .nc and .csv hold modes and shapes; .png, .svg and .pdf show frequency and damping ratio
over the parameter (Campbell diagram), or with --root-locus the eigenvalues in the complex plane.

  polhode modes results/double_pendulum --mass2 1 --length2 1 --equilibrium hanging
  polhode modes results/rotor --along spin_rate --stiffness_y 1 --internal_damping 0.05 -o campbell.png
"""
FIGURES, TABLES = (".png", ".svg", ".pdf"), (".nc", ".csv")


def add_modes(commands) -> None:
    """Add the command `modes`."""
    words = "print frequency, damping and shape of the modes at a point, or along a parameter"
    command = parser.add(commands, "modes", words, _show_modes, MODES, coordinates=True)
    parser.share(command, "map")
    command.add_argument("--along", metavar="PARAMETER", help="the parameter along which modes are followed")
    _add_definition(command)
    parser.add_output(command, "the file to write", required=False)
    text = "draw the root locus in place of the Campbell diagram"
    command.add_argument("--root-locus", action="store_true", help=text)
    parser.share(command, "--json")


def _show_modes(args):
    """Print the modes of a point or a line as a table or as JSON, or write them, or their picture, to a file."""
    from sweeps.maps import modes, motion

    suffix = Path(args.output).suffix if args.output else ""
    if args.output:
        motion.check_format(args.output, (*TABLES, *(FIGURES if args.along else ())))
    points = modes.select_points(args.map, args.along, args.coordinates, args.definition, "--")
    points.check_line()
    with progress.announce("computing shapes; the first time on a machine kernels are compiled"):
        line = points.modes(measured=suffix not in FIGURES)
    picture = "draw_root_locus" if args.root_locus else "draw_campbell"
    if not _has_written(line, args, picture, args.along):
        _print_modes(line, points.spectrum, args.along)
    if not args.json:
        for place in points.places.values():
            print(place)


def _has_written(dataset, args, picture, *setting) -> bool:
    """Write a Dataset as JSON, netCDF, CSV (a line for each component) or a picture; False if none is asked for.

    Args:
        dataset: the Dataset.
        args: arguments of the command, with `json` and `output`.
        picture: the function of `sweeps.views.mode_figures` that draws the Dataset with the `setting`.
        setting: further arguments of that function.
    """
    from sweeps.process.files import replace_output
    from sweeps.shards.mapfile import write_part

    if args.json:
        printing.print_json(dataset.squeeze().to_dict())
    if not args.output:
        return args.json
    suffix = Path(args.output).suffix
    if suffix == ".nc":
        write_part(dataset, args.output, "table")
    else:
        with replace_output(args.output) as temporary:
            if suffix == ".csv":
                table = dataset.to_dataframe().reset_index()
                table.to_csv(temporary, index=False, float_format="%.17g", lineterminator="\n")
            else:
                from sweeps.figure import sheets
                from sweeps.views import figures, mode_figures

                with sheets.use_sheet(sheets.OWN_SIZE):
                    figure = getattr(mode_figures, picture)(figures.escape_dollars(dataset), *setting)
                    figures.save_figure(figure, temporary, suffix[1:])
    if not args.json:
        print(args.output)
    return True


def _print_modes(line, spectrum, along):
    """Print each mode of frequency 0 or more, with its shape at a point, or by its curve along a parameter."""
    digits = {along: 6, "curve": 6} if along else {spectrum: 6}
    digits |= {
        "eigenvalue_imag": 9,
        "eigenvalue_real": 9,
        "eigenvalue_error": 2,
        "damping_ratio": 4,
        "log_decrement": 4,
    }
    whirl = ["whirl"] * ("whirl" in line)
    rates = printing.table(*[*digits][: -len(RATE_HEADINGS)], *RATE_HEADINGS, *whirl)
    shapes = printing.table(spectrum, "component", "shape", "error", "share of kinetic energy")
    rows = line.squeeze([str(dim) for dim in line.dims if dim not in (spectrum, along, "component")])
    rows = rows.stack(row=[along, spectrum] if along else [spectrum])
    rows = rows.sortby("curve") if along else rows
    for number in range(rows.sizes["row"]):
        mode = rows.isel(row=number)
        if mode["eigenvalue_imag"] < 0.0:
            continue
        cells = [_format_number(mode[name].item(), count) for name, count in digits.items()]
        rates.add_row(*cells, *(WHIRLS.get(mode[name].item(), "missing") for name in whirl))
        error = _format_number(mode["mode_shape_error"].item(), 2)
        for component in mode["component"].values[: 0 if along else None]:
            place = mode.sel(component=component)
            parts = (place[f"mode_shape_{part}"].item() for part in ("real", "imag"))
            share = _format_number(place["participation"].item(), 4)
            shapes.add_row(str(mode[spectrum].item()), component, _format_complex(*parts), error, share)
    printing.console().print(rates)
    if not along:
        printing.console().print()
        printing.console().print(shapes)


def _format_complex(real, imag):
    """Return a component of a shape as people read it, with its angle unless that is 0 or 180 degrees."""
    angle = math.degrees(math.atan2(imag, real))
    if abs(imag) < 1e-9 * abs(real) or real == imag == 0.0:
        return _format_number(real)
    return "missing" if real != real else f"{math.hypot(real, imag):.6g} at {angle:.4g}°"


RATE_HEADINGS = ["rad s-1", "s-1", "error", "damping ratio", "log decrement"]
WHIRLS = {1.0: "forward", -1.0: "backward", 0.0: "planar"}


RESPONSE = """\
Amplitude and phase of the linear motion about a stable equilibrium under the force f cos(wt), over w: from the samples
of an integrated motion, with a bound on the error, and by theory. Give each dimension longer than one a value,
--DIMENSION VALUE. Without -o or --json the frequencies of largest amplitude among those measured are printed.

The suffix of FILE decides: .nc and .csv hold all frequencies; .png, .svg and .pdf show them.

  polhode response results/rotor --stiffness_y 1.3 --internal_damping 0.02 --spin_rate 0.5 --force x=1 \\
      --frequency 0.1 2 -o response.png
"""


def add_response(commands) -> None:
    """Add the command `response`."""
    words = "measure the response to a harmonic force over its frequency"
    command = parser.add(commands, "response", words, _show_response, RESPONSE, coordinates=True)
    parser.share(command, "map")
    text = "amplitudes of the force along coordinates"
    command.add_argument("--force", nargs="+", type=parser.setting, metavar="NAME=VALUE", required=True, help=text)
    text = 'first and last angular frequency, rad s-1 ("30 rpm")'
    command.add_argument("--frequency", nargs=2, metavar="W", required=True, help=text)
    parser.share(command, "--samples", default=400, help="number of frequencies, evenly spaced (default 400)")
    _add_definition(command)
    parser.add_output(command, "the file to write", required=False)
    parser.share(command, "--json")


def _show_response(args):
    """Print the largest amplitudes of the response to a force, or write the response to a file."""
    import numpy as np
    from scipy.signal import argrelmax

    from sweeps.maps import motion
    from sweeps.maps.response import find_response
    from sweeps.schema.variables import parse_amount

    if args.output:
        motion.check_format(args.output, (*TABLES, *FIGURES))
    motion.check_length(None, args.samples)
    ends = [parse_amount("--frequency", text, "rad s-1") for text in args.frequency]
    frequencies = np.linspace(*ends, args.samples)
    response = find_response(args.map, dict(args.force), frequencies, args.coordinates, args.definition, "--")
    if _has_written(response, args, "draw_response"):
        return
    component, place = argrelmax(np.nan_to_num(response["response_amplitude"].values.T), axis=1)
    headings = ("component", "rad s-1", "response", "error", "phase, degrees")
    table = printing.table(*headings)
    for pair in zip(component, place, strict=True):
        row = response.isel(dict(zip(("component", "angular_frequency"), pair, strict=True)))
        cells = [(row["angular_frequency"].item(), 8), (row["response_amplitude"].item(), 10)]
        cells += [(row["response_amplitude_error"].item(), 2)]
        phase = f"{math.degrees(row['response_phase'].item()):.4f}"
        table.add_row(str(row["component"].item()), *(_format_number(*cell) for cell in cells), phase)
    printing.console().print(table)
