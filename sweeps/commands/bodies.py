"""Commands that take a body or a system in place of a definition: body, motion, page, cases, tumbler."""

import sys
from functools import partial
from pathlib import Path
from typing import Any

import sweeps
from sweeps.commands import certifying, parser
from sweeps.figure import printing
from sweeps.points import catalogue
from sweeps.process import progress, startup
from sweeps.process.files import replace_output
from sweeps.schema.refusals import DefinitionError

BODY = """\
NAME may be a part of a name: `polhode body racket`. Without NAME the bodies are listed. Or give a body of your own:

  polhode body --moments 0.00121 0.01638 0.01748 --omega0 "90 rpm"
  polhode body --ratios 1 2 2.5
  polhode body --tensor 2 -0.5 0  -0.5 2 0.1  0 0.1 3
  polhode body racket.stl --density "0.6 g/cm3" --unit mm
  polhode body --tensor 2 -0.5 0  -0.5 2 0.1  0 0.1 3 --omega 0 0 "5 rpm"
  polhode body --rotational "27.88 cm-1" "14.52 cm-1" "9.278 cm-1"
  polhode body sat.yaml:deployed --omega0 "30 rpm" --require stable --probability 0.999
  polhode body --moments 10 12 14 --orbit "500 km"
  polhode body robot.urdf --link forearm
  polhode body robot.urdf -o links.yaml

  polhode body --tensor 2 -0.5 0  -0.5 2 0.1  0 0.1 3 --uncertainty 5% --omega0 0.1 --axis 3

A file of parts (YAML, JSON, or a CSV table) has shapes with masses, places and tolerances, in one or several states:
see the handbook's page "A satellite from its parts". -o writes the sums, with their uncertainty, for sweeps.

A tensor, and each link of a robot file (URDF, SDF, MJCF), is checked. If no rigid body has it, or if it is unlikely for
--mass, --size and --centre or for mass and shapes of the link, the causes that explain it are listed.

Of a flat molecule (--rotational, or moments such as "0.6 amu Å2"), an inertial defect up to 3 % is reported.

With --uncertainty bodies are sampled and each is measured: the probability that each spin is unstable, and the growth
rates. X is a fraction of the moments, or of the tensor's entries where that is given (5%), or a mapping as in a
definition: "{moments: [5 %, 2 %, 1 %], omega0: 10 %, phase: any}". A fraction of an entry that is 0 is 0: for a sigma
of such an off-diagonal entry give {covariance: …}, 6 rows of 6, in kg2 m4.

The moments of a tensor or a mesh come out ascending, with their principal axes in the coordinates of the tensor or
the mesh; --moments and --ratios keep the order given. Off-diagonal entries of a tensor are minus the products of
inertia. --json prints SI units, angles (max_tilt) in rad, as in maps.

The answer begins with the verdict on one spin: stable (with dissipation too), stable_without_loss, unstable, marginal
or uncertain, and with its margin, the smallest relative change of one moment that changes it. The judged axis is that
of --axis, the one nearest to --omega or to the spin of a file, that of the usual spin of a listed body, or else the
axis of greatest inertia. --require exits with 3 for another verdict.

With --orbit the answer lists the orientations that gravity keeps: the axes that point down, along the path and across,
the verdict, and the periods of libration.

--omega is in the coordinates of the tensor or the mesh, or about axes 1, 2, 3 of --moments and --ratios. The answer is
the mode (short-axis mode: the polhode encircles the axis of greatest inertia; long-axis mode: of least inertia), the
largest tilts of angular velocity and momentum from that axis, and the periods P_psi and P_phi of `polhode tumbler`.
"""


def add_body(commands) -> None:
    """Add the command `body`."""
    command = parser.add(
        commands, "body", "predict whether a spin about each principal axis is stable", _print_body, BODY
    )
    parser.add_body(command)
    sampling: dict[str, Any] = {"type": parser.number, "metavar": "N"}
    text = "1-sigma uncertainty of the moments, e.g. 5%%, or a mapping"
    command.add_argument("--uncertainty", metavar="X", help=text)
    command.add_argument("--draws", help="number of draws, 64 to 4e6 (default 10,000; 131,072 of parts)", **sampling)
    command.add_argument("--seed", help="seed of the draws (default 1)", **sampling)
    command.add_argument("--method", metavar="M", help="sampling: sobol (default), latin, random")
    command.add_argument("--turns", help="count a flip if it occurs within N turns (default 100)", **sampling)
    command.add_argument("--twist", action="store_true", help="state the twist about the handle too")
    command.add_argument("--axis", type=parser.number, metavar="A", help="spin axis (default all three)")
    parser.add_omega(command, "in any direction")
    text = "report which axis may point down on a circular orbit so high above the Earth, km; with --mu of this radius"
    command.add_argument("--orbit", metavar="H", type=parser.number, help=text)
    text = "gravitational parameter of another central body, km3 s-2"
    command.add_argument("--mu", metavar="MU", type=parser.number, help=text)
    command.add_argument("--figure", metavar="FILE", help="draw the sampled bodies on the triangle of inertia (PNG)")
    text = "exit with 3 unless the verdict is stable, stable_without_loss (or stable), or unstable"
    command.add_argument("--require", choices=("stable", "stable_without_loss", "unstable"), help=text)
    text = "least probability of --require (refused if the draws cannot decide it)"
    command.add_argument("--probability", metavar="P", type=float, help=text)
    parser.add_output(command, "write the body, or those of a file, as a definition for sweeps (YAML)", required=False)
    parser.share(command, "--json")


def _print_body(args):
    """Print the verdict on a body and the outcome of each spin; without a body, print the known names."""
    if args.probability is not None and args.require is None:
        raise DefinitionError("--probability: is given without --require; allowed: both, or neither")
    if args.uncertainty is None:
        startup.leave_out_compiler()  # loading it takes longer than a few formulas
    from sweeps.systems.bodies import body_files
    from sweeps.systems.rigid_body import spin_outcomes
    from sweeps.systems.uncertain_bodies import body_answer

    body = parser.body(args)
    if body is None:
        names = list(spin_outcomes.bodies_by_name(catalogue.load_definition(args.definition), args.definition))
        printing.print_json(names) if args.json else print("\n".join(names))
        return
    setting = {name: getattr(args, name) for name in body_answer.OPTIONS}
    try:
        answer = sweeps.body(body, axis=args.axis, twist=args.twist, definition=args.definition, **setting)
    except body_files.ImpossibleBodyError as error:
        if args.json:
            printing.print_json(error.facts)
        raise
    is_met = args.require is None or answer.meets(args.require, args.probability)
    if args.figure:
        answer.savefig(args.figure)
    if args.output:
        answer.write_definition(args.output)
    printing.print_json(answer.facts) if args.json else answer.show(printing.console())
    return None if is_met else certifying.FAILED


MOTION = """\
The suffix of FILE decides: .csv and .nc hold angular velocity and attitude (unit quaternion, scalar first, from body to
inertial frame) in closed form (omega1 … omega3, q0 … q3) and by direct integration (omega1_direct …); .aem is a CCSDS
attitude ephemeris message (KVN) of the closed form, its times from 2000-01-01T00:00:00 TAI; .gif, .mp4 and .webm show
the body turning, with its angular momentum upwards, by its mesh where it has one (MP4 and WebM: 1920 × 1080, need
ffmpeg). NAME and the options that give a body are those of `polhode body`. --omega, --attitude and the columns are in
the axes of the tensor or the mesh, otherwise in the principal axes. Of a described system (its name, or your Python
file), .csv and .nc hold coordinates, velocities and their errors over --duration; .gif, .mp4 and .webm show its picture
and its coordinates.

  polhode motion racket -o racket.mp4 --epsilon 0.05
  polhode motion --moments 0.00121 0.01638 0.01748 --omega "20 rpm" "90 rpm" 0 -o racket.csv
  polhode motion --moments 1 2 3 --omega 0.1 1 0 -o spin.aem
  polhode motion --mesh racket.stl --density 600 --unit mm -o racket.gif --duration "3 s"
  polhode motion pendulum --start theta="170 deg" theta_dot=0.1 --parameter length=2 --duration "10 s" -o pendulum.gif
"""
WAIT = "computing the motion; the first time on a machine its kernels are compiled"
OF_BODIES = (*parser.BODY_FORMS, "density", "mass", "omega0", "epsilon", "phase", "axis", "omega", "attitude")


def add_motion(commands) -> None:
    """Add the command `motion`."""
    command = parser.add(commands, "motion", "write the motion of a body or a system, or a film", _write_motion, MOTION)
    parser.add_body(command)
    command.add_argument("--axis", type=parser.number, metavar="A", help="spin axis (default the intermediate one)")
    parser.add_omega(command, "at the start")
    text = "attitude at the start: unit quaternion, scalar first, from the body's axes to space (default 1 0 0 0)"
    command.add_argument("--attitude", nargs=4, type=parser.number, metavar="Q", help=text)
    settings: dict[str, Any] = {"nargs": "+", "type": parser.setting, "metavar": "NAME=VALUE", "default": ()}
    text = "coordinates and velocities of a described system at time 0; velocities left out are 0"
    command.add_argument("--start", help=text, **settings)
    command.add_argument("--parameter", help="parameters of a described system, left out: its defaults", **settings)
    parser.share(command, "--duration", "--samples")
    parser.add_output(command, "the file to write")


def _write_motion(args):
    """Write the motion of a body or a described system as a table or a film, by the suffix of the output."""
    import numpy as np

    from sweeps.figure import sheets
    from sweeps.maps import motion
    from sweeps.systems import trajectories
    from sweeps.systems.presentation import animation
    from sweeps.views import films

    kind = Path(args.output).suffix
    motion.check_format(args.output, (*motion.FORMATS, ".gif", *(f".{name}" for name in films.KINDS)))
    if kind[1:] in films.KINDS:
        films.require_encoder(kind[1:], ("motion",))
    motion_of = _system_motion if args.name and trajectories.is_described(args.name) else _body_motion
    with sheets.use_sheet(sheets.OWN_SIZE), films.use_film_of(args.output):
        trajectory, frames = motion_of(args, kind not in motion.FORMATS)
        if kind in motion.FORMATS:
            motion.write_motion(trajectory, args.output)
        else:
            count = animation.frame_times(float(np.ptp(trajectory["time"].values)))[0].size
            with progress.count_pieces(count, "drawing frames") as advance:
                films.write_frames((advance() or frame for frame in frames(trajectory)), args.output)
    print(args.output)
    if frame := trajectory.attrs.get("frame"):
        print(f"omega1 … omega3, q0 … q3: in the {frame}", file=sys.stderr)


def _body_motion(args, _):
    """Return the motion of a body, and the function that draws its frames."""
    from sweeps.systems.rigid_body import spin_outcomes
    from sweeps.systems.rigid_body.motion import RATES, SPIN, integrate_from, spin_of
    from sweeps.systems.rigid_body.presentation import figure_flip

    body = parser.body(args)
    if args.start or args.parameter:
        allowed = "its name or Python file as NAME"
        raise DefinitionError(f"--start, --parameter: are of a described system; allowed: {allowed}")
    if body is None:
        raise DefinitionError("NAME: is missing; allowed: NAME, or moments, a mesh or another form of a body")
    start = {name: value for name in SPIN if (value := getattr(args, name)) is not None}
    if args.omega:
        start |= dict(zip(RATES, args.omega, strict=True))
    if args.attitude:
        start["attitude"] = args.attitude
    chosen_body, spun = spin_outcomes.body_of(body, args.definition, spin_of(start), catalogue.load_definition)
    with progress.announce(WAIT):
        motion = integrate_from(chosen_body, spun, start, args.duration, 1e-12, args.samples)
    return motion.assign_attrs({"ratios": "of moments"} if chosen_body.ratios else {}), figure_flip.film


def _system_motion(args, is_film: bool):
    """Return the motion of a described system at the times of a film or a table, and the function that draws frames."""
    import numpy as np

    from sweeps.maps import motion
    from sweeps.mechanics import motions
    from sweeps.schema.variables import parse_amount
    from sweeps.systems import trajectories
    from sweeps.systems.motion import MIN_SAMPLES, MotionError
    from sweeps.systems.presentation import animation
    from sweeps.systems.presentation.moving import film

    allowed = "--start, --parameter, --duration, --samples"
    for name in OF_BODIES:
        if getattr(args, name) is not None:
            raise DefinitionError(f"--{name}: is of a body, and {args.name} is a described system; allowed: {allowed}")
    duration = parse_amount("--duration", args.duration, "s")
    motion.check_length(duration, args.samples)
    times = np.linspace(0.0, duration, args.samples or MIN_SAMPLES + 1)
    times = animation.frame_times(duration)[0] if is_film else times
    with progress.announce(WAIT):
        trajectory = trajectories.integrate_motions(args.name, dict(args.start), times, dict(args.parameter), 1e-12)
    if status := int(trajectory["status"]):
        name = motions.STATUSES[status]
        raise MotionError(f"motion: {name} at tolerance 1e-12: {trajectories.REASONS[name]}")
    return trajectory, partial(film.frames, model=trajectories.model_of(args.name))


PAGE = """\
The page spins any body: typed, dragged over the triangle of shapes, or chosen among well-known ones. It contains the
triangle of the sweep `tennis_racket` at one size and spin rate, measured now, and requests nothing from the network.
A link carries a body, its moments in kg m2: index.html#moments=1,2,3&axis=2
"""
MAX_BYTES = 1_500_000  # a page for a web server, which a phone loads in some seconds


def add_page(commands) -> None:
    """Add the command `page`."""
    text = "write the page for bodies of your own, one HTML file for a web server"
    parser.add_output(parser.add(commands, "page", text, _write_page, PAGE), "the HTML file to write")


def _write_page(args):
    """Measure the triangle of shapes, write its page as one HTML file, and print its name."""
    from sweeps.reading.definitions import file_text, plain, read_text
    from sweeps.systems.rigid_body.presentation.page import ONE_SIZE, OWN_TITLE
    from sweeps.views import report

    values = plain(read_text(file_text(catalogue.shipped_files()[catalogue.DEFAULT])))
    values |= {"title": OWN_TITLE, "grid": values["grid"] | ONE_SIZE}
    with progress.announce("measuring the triangle of shapes; the first time on a machine its kernels are compiled"):
        report.write_report(sweeps.survey(values), args.output, MAX_BYTES)
    print(args.output)


CASES = """\
Each case is a free rigid body that begins at exact numbers, with its exact motion in 1,001 rows over five flips or ten
wobbles. DIR gets three files of each, NAME.csv, NAME.nc and NAME.aem, and the table cases.csv of moments, starts, steps
and conditioning. Run your simulator from the start of a case and compare, or judge its file:

  polhode cases -o cases
  polhode certify cases/plate.csv --moments 1 2 3
"""


def add_cases(commands) -> None:
    """Add the command `cases`."""
    command = parser.add(commands, "cases", "write check cases for simulators, exact motions", _cases, CASES)
    command.add_argument("-o", "--output", metavar="DIR", required=True, help="the folder to write")


def _cases(args):
    """Write the check cases in all formats to a new folder, with a table of them."""
    from sweeps.maps import motion
    from sweeps.systems.rigid_body import check_cases

    cases = dict(check_cases.motions())
    with replace_output(args.output, is_folder=True) as folder:
        for name, case in cases.items():
            for suffix in motion.FORMATS:
                motion.write_motion(case, folder / f"{name}{suffix}")
        (folder / "cases.csv").write_text(check_cases.table(cases), encoding="utf-8")
    print(args.output)


TUMBLER = """\
P_psi is the period of the angular velocity in the body, P_phi the mean period of its axis of least inertia about the
angular momentum (the long-axis convention), or with --convention short that of its axis of greatest inertia. In the
convention unknown both are lines of a light curve, and all pairs of periods that a body can have are listed. With
--ratios the answer is for one body, otherwise for all bodies:

  polhode tumbler --P-psi 368.7 --P-phi 67.27 --unit h --ratios 0.36 0.96
  polhode tumbler --P-psi 6.58 --P-phi 8.67 --sigma-phi 0.34 -o oumuamua.nc --figure oumuamua.png
  polhode tumbler --P-psi 7.35 --P-phi 6.58 --convention unknown --ratios 0.36 0.96 --sigma-ratios 0.02 0.02

The energy is 2T I3/L^2: 1 for a spin about axis 3, I3/I2 on the separatrix, I3/I1 for a spin about axis 1. A mode is
excluded where the ratio of both periods is below the minimum of the mode by more than 3 standard errors; without
--sigma-psi and --sigma-phi the periods are exact. The file written by -o is a map like any other (`show`, `point`,
`report`, `figures`, `verify`) of the system observed_periods.
"""


def add_tumbler(commands) -> None:
    """Add the command `tumbler`."""
    command = parser.add(
        commands, "tumbler", "find the energy of a tumbling body from its two periods", _print_energies, TUMBLER
    )
    command.add_argument("--P-psi", type=parser.number, required=True, metavar="P", help="period in the body")
    command.add_argument("--P-phi", type=parser.number, required=True, metavar="P", help="period about L")
    command.add_argument("--sigma-psi", type=parser.number, default=0.0, metavar="S", help="standard error of P_psi")
    command.add_argument("--sigma-phi", type=parser.number, default=0.0, metavar="S", help="standard error of P_phi")
    text = "unit of periods without one: s, min, h (default) or d"
    command.add_argument("--unit", default="h", metavar="UNIT", help=text)
    text = "long: P_phi is of the axis of least inertia (default); short: of greatest inertia; unknown: both are lines"
    command.add_argument("--convention", default="long", metavar="C", help=f"{text} of a light curve, in any order")
    command.add_argument("--ratios", nargs=2, type=float, metavar="R", help="I1/I3 and I2/I3 of one body")
    text = "standard errors of the ratios"
    command.add_argument("--sigma-ratios", nargs=2, type=float, default=(0.0, 0.0), metavar="S", help=text)
    parser.add_output(command, "write the map over all bodies (netCDF)", required=False)
    command.add_argument("--figure", metavar="FILE", help="draw the energies over all bodies (PNG)")
    parser.share(command, "--json")


def _print_energies(args):
    """Print the energies in both modes that give two periods, of one body (--ratios) or as ranges over all bodies."""
    from sweeps.systems.observed_periods import answers, assignments
    from sweeps.systems.observed_periods.system import WORDS

    periods = answers.TwoPeriods(args.P_psi, args.P_phi, args.sigma_psi, args.sigma_phi, args.unit)
    is_known = args.convention != "unknown"
    if (args.ratios or not is_known) and (args.output or args.figure):
        wrong = "is given together with --output or --figure, which need all bodies and known periods"
        raise DefinitionError(f"{'--ratios' if args.ratios else '--convention'}: {wrong}; allowed: one of them")
    if is_known:
        periods = assignments.known_periods(periods, args.convention)
        body = args.ratios and answers.periods_of_body(periods, args.ratios, args.sigma_ratios)
        rows = body or _energies_of_all_bodies(args, periods)
    else:
        rows = assignments.list_assignments(periods, args.ratios, args.sigma_ratios)
    if args.ratios and args.ratios[0] > args.ratios[1]:
        I2, I1 = args.ratios
        print(f"--ratios: taken as I1/I3 = {I1:g}, I2/I3 = {I2:g}: I1 is the least moment", file=sys.stderr)
    if args.json:
        return printing.print_json(rows)
    for pair in [{"modes": rows}] if is_known else rows:
        if not is_known:
            text = f"P_psi = {pair['P_psi']:.6g} {args.unit}, P_phi = {pair['P_phi']:.6g} {args.unit}"
            printing.console().print(f"{text} (lines {', '.join(pair['lines'])})")
        for row in pair["modes"]:
            printing.console().print(f"{WORDS[row['mode']]}: {answers.describe_row(row, periods)}")


def _energies_of_all_bodies(args, periods) -> list[dict]:
    """Return the answers for all bodies; write their map and draw it if the arguments request it."""
    from sweeps.systems.observed_periods import answers

    ds = sweeps.survey(periods.definition)
    if args.output:
        from sweeps.maps import storage

        storage.write_map(ds, args.output)
    if args.figure:
        from sweeps.figure import sheets
        from sweeps.systems.observed_periods.presentation import figure_energies

        with sheets.use_sheet(sheets.OWN_SIZE), replace_output(args.figure) as temporary:
            figure_energies.draw(ds).savefig(temporary, format="png")
    return answers.periods_of_all_bodies(periods, ds)
