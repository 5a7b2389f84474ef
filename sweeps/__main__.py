"""The command line, `python -m sweeps …`: what the Snakefile calls, and a person can too.

Each command reads, calls one function and writes. What only one command needs is imported by that command, so that
`check` answers at once.
"""

import argparse
import sys
from importlib.metadata import version
from pathlib import Path

from sweeps.refusals import DefinitionError

DESCRIPTION = """\
Stability maps of rotating rigid bodies, measured from integrated motion.

The usual way is one line,   snakemake --cores 2
which runs the commands below in their order for the default sweep. A DEFINITION is the name of a sweep that ships
(see `check --list`) or the path of a YAML file.
"""

EPILOG = """\
a sweep of your own, by hand:
  python -m sweeps check my.yaml                      is it right, how large is it
  python -m sweeps compile                            once per machine
  python -m sweeps shard my.yaml 1 2 -o a.nc          first half of the points
  python -m sweeps shard my.yaml 2 2 -o b.nc          second half
  python -m sweeps merge my.yaml a.nc b.nc -o map.nc
  python -m sweeps figures map.nc -o figures
  python -m sweeps report map.nc -o report.html
or at once:  snakemake --cores 2 --config definition=my.yaml

exit status: 0 done; 2 the input is wrong, and one message said what; 1 anything else
"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m sweeps",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"Polhode {version('polhode')}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for add in (_add_check, _add_compile, _add_shard, _add_merge, _add_figures, _add_report):
        add(commands)
    return parser


def _command(commands, name, help_text, run, *, definition=True):
    command = commands.add_parser(name, help=help_text, description=help_text[0].upper() + help_text[1:] + ".")
    command.set_defaults(run=run)
    if definition:
        command.add_argument("definition", metavar="DEFINITION", help="a sweep that ships, or the path of a YAML file")
    return command


def _add_check(commands):
    command = _command(commands, "check", "validate a definition and say what it will take", _check, definition=False)
    command.add_argument("definition", metavar="DEFINITION", nargs="?", help="a sweep that ships, or a path")
    command.add_argument("--list", action="store_true", help="list the sweeps that ship, and stop")


def _add_compile(commands):
    command = _command(commands, "compile", "compile the kernels, once per machine", _compile, definition=False)
    command.add_argument("-o", "--output", metavar="FILE", help="write the kernels' fingerprint to FILE")


def _add_shard(commands):
    command = _command(commands, "shard", "measure one part of a sweep's points", _shard)
    command.add_argument("number", type=int, metavar="K", help="which part, from 1")
    command.add_argument("count", type=int, metavar="N", help="into how many parts the points are cut")
    command.add_argument("-o", "--output", metavar="FILE", required=True, help="the shard to write")
    command.add_argument("--threads", type=int, default=1, metavar="T", help="threads (default 1); change no result")


def _add_merge(commands):
    command = _command(commands, "merge", "merge all shards of a sweep into its map", _merge)
    command.add_argument("shards", nargs="+", metavar="SHARD", help="the files that `shard` wrote, in any order")
    command.add_argument("-o", "--output", metavar="FILE", required=True, help="the map to write")
    command.add_argument("--threads", type=int, default=1, metavar="T", help="threads (default 1); change no result")


def _add_figures(commands):
    command = _command(commands, "figures", "draw a map's pictures as PNG", _figures, definition=False)
    command.add_argument("map", metavar="MAP", help="a map, results/<sweep>/stability_map.nc")
    command.add_argument("-o", "--output", metavar="FOLDER", required=True, help="the folder to write")


def _add_report(commands):
    command = _command(commands, "report", "write a map's report, one HTML file to explore", _report, definition=False)
    command.add_argument("map", metavar="MAP", help="a map, results/<sweep>/stability_map.nc")
    command.add_argument("-o", "--output", metavar="FILE", required=True, help="the HTML file to write")


def _check(args):
    from sweeps import catalogue, estimate
    from sweeps.grid import Grid

    if args.list:
        for name, path in catalogue.shipped().items():
            print(f"{name:16s} {catalogue.load(path).title}")
        return
    planned = catalogue.plan(catalogue.resolve(args.definition or catalogue.DEFAULT))
    grid = Grid(planned.definition)
    needs = estimate.estimate(planned.definition, grid)
    rows = {
        "definition": f"{planned.path}: valid",
        "title": planned.definition.title,
        "points": f"{needs.points:,} = " + " × ".join(f"{n:,} {d}" for d, n in zip(grid.dims, grid.shape, strict=True)),
        "shards": f"{needs.shards:,}",
        "memory": f"about {estimate.in_words(needs.memory_bytes)} a process",
        "disk": f"at most {estimate.in_words(needs.disk_bytes)}, half of it for the map",
        "time": f"about {needs.seconds:,.3g} s of integration on one core",
    }
    for name, text in rows.items():
        print(f"{name:11s} {text}")


def _compile(args):
    from kernels.fingerprint import fingerprint
    from sweeps import warmup

    warmup.compile_kernels()
    if args.output:
        Path(args.output).write_text(fingerprint() + "\n")


def _shard(args):
    from sweeps import catalogue
    from sweeps.grid import Grid

    planned = catalogue.plan(catalogue.resolve(args.definition))
    points = Grid(planned.definition).size
    if not 1 <= args.count <= points:
        raise DefinitionError(f"N: {args.count} parts are out of range; allowed: 1 to {points}, the number of points")
    if not 1 <= args.number <= args.count:
        raise DefinitionError(f"K: part {args.number} is out of range; allowed: 1 to {args.count}, the number of parts")
    if args.threads < 1:
        raise DefinitionError(f"--threads: {args.threads} is out of range; allowed: 1 or more")

    from sweeps import progress, shards

    start, stop = Grid(planned.definition).shard_bounds(args.count)[args.number - 1]
    with progress.points(stop - start, f"shard {args.number} of {args.count}") as advance:
        shards.write_shard(planned.definition, args.number, args.count, args.output, args.threads, advance)


def _merge(args):
    from sweeps import catalogue, storage

    planned = catalogue.plan(catalogue.resolve(args.definition))
    print(f"content_hash {storage.merge(planned.definition, args.shards, args.output, args.threads)}")


def _figures(args):
    from sweeps import figures, storage

    with storage.open_map(args.map) as ds:
        for path in figures.draw_all(ds, Path(args.output)):
            print(path)


def _report(args):
    from sweeps import report, storage

    with storage.open_map(args.map) as ds:
        report.write(ds, args.output)
    print(args.output)


def main(arguments: list[str] | None = None) -> int:
    """Runs one command; returns the exit status."""
    args = _parser().parse_args(arguments)
    try:
        args.run(args)
    except BrokenPipeError:
        return 1
    except ValueError as error:
        if not isinstance(error, DefinitionError) and type(error).__name__ != "MapError":
            raise
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
