"""`tumbler`: from two observed periods to the bodies and energies that have them."""

from sweeps.commands import parser

EPILOG = """\
P_psi is the period of the angular velocity in the body, P_phi the mean period of its axis of least inertia about the
angular momentum (the long-axis convention). With --ratios the answer is for one body, otherwise for all bodies:

  polhode tumbler --P-psi 368.7 --P-phi 67.27 --unit h --ratios 0.36 0.96
  polhode tumbler --P-psi 6.58 --P-phi 8.67 --sigma-phi 0.34 -o oumuamua.nc --figure oumuamua.png

The energy is 2T I3/L^2: 1 for a spin about axis 3, I3/I2 on the separatrix, I3/I1 for a spin about axis 1. A mode is
excluded where the ratio of both periods is below the minimum of the mode by more than 3 standard errors; without
--sigma-psi and --sigma-phi the periods are exact. The file written by -o is a map like any other (`show`, `point`,
`report`, `figures`, `verify`) of the system observed_periods.
"""


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "tumbler", "find the energy of a tumbling body from its two periods", _run, EPILOG)
    command.add_argument("--P-psi", type=parser.number, required=True, metavar="P", help="period in the body")
    command.add_argument("--P-phi", type=parser.number, required=True, metavar="P", help="period about L")
    command.add_argument("--sigma-psi", type=parser.number, default=0.0, metavar="S", help="standard error of P_psi")
    command.add_argument("--sigma-phi", type=parser.number, default=0.0, metavar="S", help="standard error of P_phi")
    command.add_argument("--unit", default="h", metavar="UNIT", help="unit of periods without one: s, h (default) or d")
    command.add_argument("--ratios", nargs=2, type=float, metavar="R", help="I1/I3 and I2/I3 of one body")
    command.add_argument("-o", "--output", metavar="FILE", help="write the map over all bodies (netCDF)")
    command.add_argument("--figure", metavar="FILE", help="draw the energies over all bodies (PNG)")
    parser.add_json(command)


def _run(args):
    from sweeps.schema.refusals import DefinitionError
    from sweeps.systems.observed_periods import answers

    periods = answers.TwoPeriods(args.P_psi, args.P_phi, args.sigma_psi, args.sigma_phi, args.unit)
    if args.ratios and (args.output or args.figure):
        wrong = "is given together with --output or --figure, which need all bodies"
        raise DefinitionError(f"--ratios: {wrong}; allowed: one of them")
    if args.ratios:
        _print(args, periods, answers.of_body(periods, *args.ratios))
        return
    import sweeps

    ds = sweeps.survey(periods.definition)
    if args.output:
        from sweeps.maps import storage

        storage.write_map(ds, args.output)
    if args.figure:
        from sweeps.figure import style
        from sweeps.process.files import replaced
        from sweeps.systems.observed_periods.presentation import figure_energies

        with style.drawn_for(style.ITS_OWN), replaced(args.figure) as temporary:
            figure_energies.draw(ds).savefig(temporary, format="png")
    _print(args, periods, answers.of_all(periods, ds))


def _print(args, periods, rows: list[dict]) -> None:
    from sweeps.figure import printing
    from sweeps.systems.observed_periods.answers import in_words
    from sweeps.systems.observed_periods.variables import WORDS

    if args.json:
        printing.print_json(rows)
        return
    console = printing.console()
    for row in rows:
        console.print(f"{WORDS[row['mode']]}: {in_words(row, periods)}")
