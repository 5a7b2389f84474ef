"""`run`: a sweep's map, pictures and report in one go."""

from sweeps.commands import parser
from sweeps.schema.refusals import DefinitionError

EPILOG = """\
Writes what the workflow (snakemake) writes: results/<sweep>/stability_map.nc, figures/ and report.html. Broken off
and called again, it goes on: what was measured for the same definition by the same kernels is used as it is, but for
the last seconds of work, or the shard that was begun. What is finished and unchanged is named, and nothing is loaded.
"""


def add(commands) -> None:
    """Describes the command."""
    command = parser.add(commands, "run", "make a sweep's map, pictures and report in results/<sweep>", _run, EPILOG)
    parser.add_definition(command, nargs="?")
    command.add_argument("--cores", type=int, metavar="N", help="processors to use (default all); change no result")
    command.add_argument("--again", action="store_true", help="make everything again, finished or not")


def _run(args):
    from sweeps import processors
    from sweeps.points import catalogue
    from sweeps.run import finished, waiting

    if args.cores is not None and args.cores < 1:
        raise DefinitionError(f"--cores: {args.cores} is out of range; allowed: 1 or more")
    path = catalogue.resolve(args.definition or catalogue.DEFAULT)
    basis = finished.basis(path)
    if not args.again and (made := finished.found(path, basis)):
        print(*made, sep="\n")
        return
    workers = args.cores or processors.cores()
    with waiting.said(f"{path}: deriving its equations and looking at its points"):
        planned = catalogue.plan(path)
    from sweeps.run import pipeline

    for file in pipeline.make(planned, workers=workers, again=args.again):
        print(file)
    finished.keep(planned.sweep, basis)
