"""`run`: a sweep's map, pictures and report in one go."""

from sweeps.commands import parser
from sweeps.schema.refusals import DefinitionError

EPILOG = """\
Writes what the workflow (snakemake) writes: results/<sweep>/stability_map.nc, figures/ and report.html. After an
interruption the same command resumes: points measured for the same definition by the same kernels are kept, except for
the last seconds of work or the unfinished shard. Finished and unchanged results are listed, and nothing is computed.
"""


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(
        commands, "run", "write the map, figures and report of a sweep to results/<sweep>", _run, EPILOG
    )
    parser.add_definition(command, nargs="?")
    command.add_argument(
        "--cores", type=int, metavar="N", help="number of processors (default all); does not change results"
    )
    command.add_argument("--again", action="store_true", help="compute everything again, finished or not")


def _run(args):
    from sweeps.pipeline import finished, waiting
    from sweeps.points import catalogue
    from sweeps.process import processors

    if args.cores is not None and args.cores < 1:
        raise DefinitionError(f"--cores: {args.cores} is out of range; allowed: 1 or more")
    path = catalogue.resolve(args.definition or catalogue.DEFAULT)
    basis = finished.basis(path)
    if not args.again and (made := finished.found(path, basis)):
        print(*made, sep="\n")
        return
    workers = args.cores or processors.cores()
    with waiting.said(f"{path}: deriving its equations"):
        planned = catalogue.plan(path, check=False)
    from sweeps.pipeline import steps as pipeline

    for file in pipeline.make(planned, workers=workers, again=args.again):
        print(file)
    finished.keep(planned.sweep, basis)
