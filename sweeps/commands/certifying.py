"""The command that judges the rotation in a file: certify."""

import sys
from collections.abc import Iterator, Mapping
from typing import Any
from xml.etree import ElementTree

import sweeps
from sweeps.commands import parser
from sweeps.figure import printing
from sweeps.process import progress
from sweeps.process.files import replace_output
from sweeps.schema.refusals import DefinitionError

FAILED = 3  # exit status of the verdict `fail`
UNCLEAR = ("time_unit", "angle_unit", "rate_unit", "sequence", "scalar", "direction")
KEYS: tuple[str, ...] = ("verdict", "diagnosis", "attitude_error_max_rad", "attitude_error_end_rad")
KEYS += ("rates_error_max_relative", "conditioning_rad", "warning")
CONSERVED = {
    "energy_error_relative": "2T          largest relative change",
    "momentum_size_error_relative": "|L|         largest relative change",
    "momentum_direction_error_rad": "L           largest change of direction, rad",
    "period_error_relative": "period      relative change, last row",
}

HELP = "judge the rotation in a file, and diagnose what is wrong"
CERTIFY = """\
RUN is a CSV, Parquet or netCDF file, or a quaternion AEM (KVN) of CCSDS, with a time and with attitudes (quaternion,
matrix, or Euler angles) or angular velocity in the body's axes, or both. Each row is compared with the exact motion of
the free body that begins at the first row.

  polhode certify run.csv --moments 1 2 3
  polhode certify run.csv --body racket --tolerance 1e-4 --json
  polhode certify brick.csv --moments 0.001894220 0.006211019 0.007194665 --frame local
  polhode certify run.csv --moments 1 2 3 --columns time=T attitude=a,b,c,d --scalar last --rate-unit deg/s

Columns are found by their names (time, q0 … q3, qw qx qy qz, w1 … w3, p q r, yaw pitch roll, …) and units in them
(time_ms, "w1 (deg/s)"); SI units otherwise. The tolerance holds for attitudes in rad and for rates relative to the
first. The verdict is pass, fail (exit status 3), or ill_conditioned (0, with a warning): motions that begin within the
resolution of the file differ by as much. The diagnosis states the fault that fits the file, with the evidence.
"""


def add_certify(commands) -> None:
    """Add the command `certify`."""
    command = parser.add(commands, "certify", HELP, _certify, CERTIFY)
    command.add_argument("run_file", metavar="RUN", help="the file of the motion")
    parser.add_moments(command)
    command.add_argument("--body", dest="name", metavar="NAME", help="a body of `bodies`, or of --definition")
    command.add_argument("--definition", metavar="DEFINITION", default="bodies", help="the definition that lists NAME")
    command.add_argument("--tolerance", type=parser.number, default=1e-6, metavar="X", help="allowed error (1e-6)")
    command.add_argument("--fit-start", action="store_true", help="fit the start to all rows")
    text = "frame of the attitudes: inertial (default), or local, which turns"
    command.add_argument("--frame", choices=("inertial", "local"), default="inertial", help=text)
    text = 'rate of a local frame, rad s-1 ("15 deg/h"; default that of the Earth)'
    command.add_argument("--frame-rate", type=parser.number, metavar="X", help=text)
    text = "axis of a local frame, in its own axes (default: from the columns longitude and latitude)"
    command.add_argument("--frame-axis", nargs=3, type=float, metavar="X", help=text)
    text = "columns of a role, where names do not say it: time, attitude, rates, longitude, latitude"
    setting: dict[str, Any] = {"nargs": "+", "type": parser.setting, "metavar": "ROLE=NAME,…", "default": ()}
    command.add_argument("--columns", help=text, **setting)
    command.add_argument("--scalar", choices=("first", "last"), help="which of four columns is the scalar")
    command.add_argument(
        "--sequence", metavar="XYZ", help="of Euler angles: ZYX about turned axes, zyx about fixed ones"
    )
    command.add_argument("--direction", choices=("body-to-space", "space-to-body"), help="of attitudes")
    for name, text in (("time", "s"), ("angle", "rad"), ("rate", "rad/s")):
        command.add_argument(f"--{name}-unit", metavar="UNIT", help=f"unit of {name}s without one (default {text})")
    command.add_argument("--figure", metavar="FILE", help="draw errors over time and the motion (PNG)")
    command.add_argument("--junit", metavar="FILE", help="write the verdict as JUnit XML")
    parser.share(command, "--json")


def _certify(args):
    """Print the verdict on a file, or its JSON, and return the exit status."""
    body = parser.body(args)
    if body is None:
        raise DefinitionError("body: is missing; allowed: --moments, --ratios, --tensor, --mesh or --body")
    names = ("definition", "tolerance", "fit_start", "frame", "frame_rate", "frame_axis", *UNCLEAR)
    options = {name: value for name in names if (value := getattr(args, name)) is not None}
    columns = {role: str(names).split(",") for role, names in args.columns}
    with progress.announce("comparing; the first time on a machine its kernels are compiled"):
        ds = sweeps.certify(args.run_file, body, columns=columns, **options)
    if args.figure:
        from sweeps.certification import figure_errors
        from sweeps.figure import sheets

        with sheets.use_sheet(sheets.OWN_SIZE), replace_output(args.figure) as temporary:
            figure_errors.draw(ds).savefig(temporary, format="png")
    if args.junit:
        with replace_output(args.junit) as temporary:
            temporary.write_bytes(junit(args.run_file, ds.attrs))
    if args.json:
        printing.print_json(dict.fromkeys(KEYS) | ds.attrs)
    else:
        print("\n".join(lines(ds.attrs)))
    if "warning" in ds.attrs:
        print(f"{args.run_file}: {ds.attrs['warning']}", file=sys.stderr)
    return FAILED if ds.attrs["verdict"] == "fail" else 0


def junit(name: str, facts: Mapping[str, Any]) -> bytes:
    """Return the verdict as JUnit XML: a test of one file, failed where the verdict is `fail`."""
    is_failed = facts["verdict"] == "fail"
    counts = {"tests": "1", "failures": str(int(is_failed)), "errors": "0"}
    suite = ElementTree.Element("testsuite", counts, name="polhode certify")
    case = ElementTree.SubElement(suite, "testcase", classname="polhode.certify", name=name)
    text = "\n".join(lines(facts))
    if is_failed:
        message = ", ".join(facts["diagnosis"])
        ElementTree.SubElement(case, "failure", type="fail", message=message).text = text
    ElementTree.SubElement(case, "system-out").text = text
    if "warning" in facts:
        ElementTree.SubElement(case, "system-err").text = facts["warning"]
    return ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True)


def lines(facts: Mapping[str, Any]) -> Iterator[str]:
    """Yield the answer in words, a line for each fact."""
    yield f"verdict     {facts['verdict']}: tolerance {facts['tolerance']:g}, start: {facts['start'].replace('_', ' ')}"
    for word, evidence in zip(facts["diagnosis"], facts["evidence"], strict=True):
        yield f"diagnosis   {word}" + (f": {evidence}" if evidence else "")
    for name, unit, label in (("attitude_error", "rad", "attitude"), ("rates_error", "relative", "rates")):
        if f"{name}_max_{unit}" in facts:
            worst, last = facts[f"{name}_max_{unit}"], facts[f"{name}_end_{unit}"]
            row = f"{label:<10}  error {worst:.3g} {unit} at most, {last:.3g} at the end"
            when = facts.get(f"{name}_passes_tolerance_s")
            yield row + (f"; beyond the tolerance from {when:g} s on" if when is not None else "")
    for name, label in CONSERVED.items():
        if name in facts:
            yield f"{label}  {facts[name]:.3g}"
    for name, unit in (("conditioning_rad", "rad"), ("conditioning_rates_relative", "of the rates, relative")):
        if name in facts:
            yield f"conditioning  {facts[name]:.3g} {unit}"
