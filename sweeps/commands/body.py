"""`body`: the three axes of a body, in words."""

from sweeps.commands import parser

EPILOG = """\
NAME may be a part of a name: `polhode body racket`. Without NAME the bodies are listed. Or give a body of your own:

  polhode body --moments 0.00121 0.01638 0.01748 --omega0 "90 rpm"
  polhode body --ratios 1 2 2.5
  polhode body --tensor 2 -0.5 0  -0.5 2 0.1  0 0.1 3
  polhode body --mesh racket.stl --density "0.6 g/cm3" --unit mm

  polhode body --tensor 2 -0.5 0  -0.5 2 0.1  0 0.1 3 --uncertainty 5% --omega0 0.1 --axis 3

With --uncertainty bodies are sampled and each is measured: the probability that each spin is unstable, and the growth
rates. X is a fraction of the moments, or of the tensor's entries where that is given (5%), or a mapping as in a
definition: "{moments: [5 %, 2 %, 1 %], omega0: 10 %, phase: any}". A fraction of an entry that is 0 is 0: for a sigma
of such an off-diagonal entry give {covariance: …}, 6 rows of 6, in kg2 m4.

The moments of a tensor or a mesh come out ascending, with their principal axes in the coordinates of the tensor or
the mesh; --moments and --ratios keep the order given. Off-diagonal entries of a tensor are minus the products of
inertia. --json prints SI units, angles (max_tilt) in rad, as in maps.
"""


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "body", "predict whether a spin about each principal axis is stable", _run, EPILOG)
    parser.add_body(command)
    sampling = {"type": parser.number, "metavar": "N"}
    text = "1-sigma uncertainty of the moments, e.g. 5%%, or a mapping"
    command.add_argument("--uncertainty", metavar="X", help=text)
    command.add_argument("--draws", help="number of draws, 64 to 4e6 (default 10,000)", **sampling)
    command.add_argument("--seed", help="seed of the draws (default 1)", **sampling)
    command.add_argument("--method", metavar="M", help="sampling: sobol (default), latin, random")
    command.add_argument("--turns", help="count a flip if it occurs within N turns (default 100)", **sampling)
    command.add_argument("--twist", action="store_true", help="state the twist about the handle too")
    command.add_argument("--axis", type=parser.number, metavar="A", help="spin axis (default all three)")
    command.add_argument("--figure", metavar="FILE", help="draw the sampled bodies on the triangle of inertia (PNG)")
    parser.add_json(command)


def _run(args):
    from sweeps.process import startup

    if args.uncertainty is None:
        startup.leave_out_the_compiler()  # loading it takes longer than a few formulas
    import sweeps
    from sweeps.figure import printing
    from sweeps.points import catalogue
    from sweeps.systems.bodies.presentation import one_body
    from sweeps.systems.rigid_body import prediction

    body = parser.body(args)
    if body is None:
        names = list(prediction.bodies(catalogue.load(args.definition), args.definition))
        printing.print_json(names) if args.json else print("\n".join(names))
        return
    setting = {name: getattr(args, name) for name in (*one_body.SPIN, *one_body.SAMPLING, "uncertainty")}
    answer = sweeps.body(body, axis=args.axis, twist=args.twist, definition=args.definition, **setting)
    if args.figure:
        answer.savefig(args.figure)
    printing.print_json(answer.facts) if args.json else answer.show(printing.console())
