"""`shard`: one part of a sweep's points, measured."""

from sweeps.commands import parser
from sweeps.schema.refusals import DefinitionError


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "shard", "measure one part of the points of a sweep", _run)
    parser.add_definition(command)
    parser.add_digest(command)
    command.add_argument("number", type=int, metavar="K", help="number of the part, from 1")
    command.add_argument("count", type=int, metavar="N", help="number of parts")
    command.add_argument("-o", "--output", metavar="FILE", required=True, help="the shard to write")
    text = "number of threads (default 1); does not change results"
    command.add_argument("--threads", type=int, default=1, metavar="T", help=text)


def _run(args):
    from sweeps.points import catalogue
    from sweeps.process import progress
    from sweeps.shards import shard as shards

    sweep = catalogue.plan(catalogue.resolve(args.definition), digest=args.digest).sweep
    points = sweep.grid.size
    if not 1 <= args.count <= points:
        raise DefinitionError(f"N: {args.count} parts are out of range; allowed: 1 to {points}, the number of points")
    if not 1 <= args.number <= args.count:
        raise DefinitionError(f"K: part {args.number} is out of range; allowed: 1 to {args.count}, the number of parts")
    if args.threads < 1:
        raise DefinitionError(f"--threads: {args.threads} is out of range; allowed: 1 or more")
    start, stop = sweep.grid.shard_bounds(args.count)[args.number - 1]
    with progress.points(stop - start, f"shard {args.number} of {args.count}") as advance:
        shards.write_shard(sweep, args.number, args.count, args.output, args.threads, advance)
