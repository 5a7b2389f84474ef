"""`motion`: the motion of a body or a described system from any start, as numbers or as a film."""

from sweeps.commands import parser

EPILOG = """\
The suffix of FILE decides: .csv and .nc hold angular velocity and attitude (unit quaternion, scalar first, from body to
inertial frame) in closed form (omega1 … omega3, q0 … q3) and by direct integration (omega1_direct …); .gif, .mp4 and
.webm show the body turning, by its mesh where it has one (MP4 and WebM: 1920 × 1080, need ffmpeg). NAME and the options
that give a body are those of `polhode body`. Of a described system (its name, or your Python file), .csv and .nc hold
coordinates, velocities and their errors over --duration; the others show its picture and its coordinates.

  polhode motion racket -o racket.mp4 --epsilon 0.05
  polhode motion --moments 0.00121 0.01638 0.01748 --omega "20 rpm" "90 rpm" 0 -o racket.csv
  polhode motion --mesh racket.stl --density 600 --unit mm -o racket.gif --duration "3 s"
  polhode motion pendulum --start theta="170 deg" theta_dot=0.1 --parameter length=2 --duration "10 s" -o pendulum.gif
"""
WAIT = "computing the motion; the first time on a machine its kernels are compiled"
OF_BODIES = ("moments", "ratios", "tensor", "mesh", "density", "mass", "omega0", "epsilon", "phase", "axis", "omega")


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "motion", "write the motion of a body or a system, or a film", _run, EPILOG)
    parser.add_body(command)
    command.add_argument("--axis", type=parser.number, metavar="A", help="spin axis (default the intermediate one)")
    text = "angular velocity about axes 1, 2, 3, rad s-1, in place of --axis and --omega0"
    command.add_argument("--omega", nargs=3, type=parser.number, metavar="W", help=text)
    settings = {"nargs": "+", "type": parser.setting, "metavar": "NAME=VALUE", "default": ()}
    text = "coordinates and velocities of a described system at time 0; velocities left out are 0"
    command.add_argument("--start", help=text, **settings)
    command.add_argument("--parameter", help="parameters of a described system, left out: its defaults", **settings)
    parser.add_duration(command)
    command.add_argument("-o", "--output", metavar="FILE", required=True, help="the file to write")


def _run(args):
    from pathlib import Path

    from sweeps.figure import style
    from sweeps.maps import motion
    from sweeps.systems import trajectories
    from sweeps.views import films

    kind = Path(args.output).suffix
    motion.check_format(args.output, (*motion.FORMATS, ".gif", *(f".{name}" for name in films.KINDS)))
    if kind[1:] in films.KINDS:
        films.refuse_unless_made(kind[1:], ("motion",))
    motion_of = _of_system if args.name and trajectories.is_described(args.name) else _of_body
    with style.drawn_for(style.ITS_OWN), films.drawn_for(args.output):
        moved, frames = motion_of(args, kind not in motion.FORMATS)
        if kind in motion.FORMATS:
            motion.write(moved, args.output)
        else:
            films.write(frames(moved), args.output)
    print(args.output)


def _of_body(args, _):
    """Return the motion of a body, and the function that draws its frames."""
    from sweeps.pipeline import waiting
    from sweeps.points import catalogue
    from sweeps.schema.refusals import DefinitionError
    from sweeps.systems.rigid_body import prediction
    from sweeps.systems.rigid_body.motion import RATES, SPIN, from_start, spin_of
    from sweeps.systems.rigid_body.presentation import figure_flip

    body = parser.body(args)
    if args.start or args.parameter:
        allowed = "its name or Python file as NAME"
        raise DefinitionError(f"--start, --parameter: are of a described system; allowed: {allowed}")
    if body is None:
        raise DefinitionError("NAME: is missing; allowed: NAME, --moments, --ratios, --tensor or --mesh")
    start = {name: value for name in SPIN if (value := getattr(args, name)) is not None}
    if args.omega:
        start |= dict(zip(RATES, args.omega, strict=True))
    chosen_body, spun = prediction.body_of(body, args.definition, spin_of(start), catalogue.load)
    with waiting.said(WAIT):
        return from_start(chosen_body, spun, start, args.duration, 1e-12, args.samples), figure_flip.film


def _of_system(args, is_film: bool):
    """Return the motion of a described system, at the times of a film or of a table, and what draws its frames."""
    from functools import partial

    import numpy as np

    from sweeps.maps import motion
    from sweeps.pipeline import waiting
    from sweeps.schema.refusals import DefinitionError
    from sweeps.schema.variables import amount
    from sweeps.systems import trajectories
    from sweeps.systems.motion import LEAST_SAMPLES, MotionError
    from sweeps.systems.presentation import animation
    from sweeps.systems.presentation.moving import film

    allowed = "--start, --parameter, --duration, --samples"
    for name in OF_BODIES:
        if getattr(args, name) is not None:
            raise DefinitionError(f"--{name}: is of a body, and {args.name} is a described system; allowed: {allowed}")
    duration = amount("--duration", args.duration, "s")
    motion.check_length(duration, args.samples)
    times = np.linspace(0.0, duration, args.samples or LEAST_SAMPLES + 1)
    times = animation.timing(duration)[0] if is_film else times
    with waiting.said(WAIT):
        moved = trajectories.trajectories(args.name, dict(args.start), times, dict(args.parameter), 1e-12)
    if status := int(moved["status"]):
        raise MotionError(f"motion: {trajectories.STATUSES[status]} at tolerance 1e-12; allowed: a shorter --duration")
    return moved, partial(film.frames, model=trajectories.model_of(args.name))
