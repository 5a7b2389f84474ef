"""`run`: a sweep's map, pictures and report in one go."""

from sweeps.commands import parser

EPILOG = """\
Writes what the workflow (snakemake) writes: results/<sweep>/stability_map.nc, figures/ and report.html. After an
interruption the same command resumes: shards (of ten seconds of work or more) that were finished for the same
definition by the same kernels are kept. Finished and unchanged results are listed, and nothing is computed.
"""


def add(commands) -> None:
    """Add the command to the parser."""
    words = "write the map, figures and report of a sweep to results/<sweep>"
    command = parser.add(commands, "run", words, _run, EPILOG)
    parser.add_definition(command, nargs="?", default="tennis_racket")
    text = "number of processors (default all); does not change results"
    command.add_argument("--cores", type=int, metavar="N", help=text)
    command.add_argument("--again", action="store_true", help="compute everything again, finished or not")
    text = "folder of results (default results); the files go to FOLDER/<sweep>"
    command.add_argument("-o", "--output", metavar="FOLDER", default="results", help=text)
    command.add_argument("--quiet", action="store_true", help="print no progress, only the files")


def _run(args):
    from contextlib import nullcontext

    from sweeps.pipeline import making
    from sweeps.process import progress
    from sweeps.views import drawing

    with progress.silenced() if args.quiet else nullcontext():
        for file in making.make(args.definition, args.cores, args.again, args.output, drawing.worker):
            print(file)
