"""`merge`: all shards of a sweep into its map."""

from sweeps.commands import parser


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "merge", "merge all shards of a sweep into its map", _run)
    parser.add_definition(command)
    parser.add_digest(command)
    command.add_argument("shards", nargs="+", metavar="SHARD", help="files written by `shard`, or their folder")
    command.add_argument("--renew", action="store_true", help="measure shards of other definitions or kernels again")
    command.add_argument("-o", "--output", metavar="FILE", required=True, help="the map to write")
    text = "threads to measure with again (default 1)"
    command.add_argument("--threads", type=int, default=1, metavar="T", help=text)


def _run(args):
    from sweeps.points import catalogue
    from sweeps.shards import merging

    planned = catalogue.plan(catalogue.resolve(args.definition), digest=args.digest)
    content_hash = merging.merge(planned.sweep, args.shards, args.output, args.threads, args.renew)
    print(f"content_hash {content_hash}")
