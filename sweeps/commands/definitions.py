"""Commands that take a definition: check, run, compile, shard, merge, schema."""

import json
import math
from contextlib import nullcontext
from pathlib import Path

from sweeps.commands import parser
from sweeps.figure import printing
from sweeps.points import catalogue
from sweeps.process import progress
from sweeps.process.files import replace_output
from sweeps.schema.refusals import DefinitionError, display

RUN = """\
Writes what the workflow (snakemake) writes: results/<sweep>/stability_map.nc, figures/ and report.html. After an
interruption the same command resumes: shards (of ten seconds of work or more) that were finished for the same
definition by the same kernels are kept. Finished and unchanged results are listed, and nothing is computed.
"""
SCHEMA = """\
Editors with a YAML language server complete keys and mark mistakes from it:

  polhode schema -o polhode.schema.json
  # yaml-language-server: $schema=polhode.schema.json      (the first line of my.yaml)

For a system described in a Python file, give its name or file: its grid has its own parameters.
"""


def add_check(commands) -> None:
    """Add the command `check`."""
    command = parser.add(
        commands, "check", "validate a definition, and predict memory, disk and time", _check_definition
    )
    parser.share(command, "definition", nargs="?")
    command.add_argument("--list", action="store_true", help="list the shipped sweeps, and stop")
    parser.share(command, "--json")


def _check_definition(args):
    """Print size, memory, disk and time of a valid definition; with --list, print the shipped sweeps."""
    if args.list:
        _print_sweeps(catalogue.shipped_contents(), args.json)
        return
    path = catalogue.find_definition(args.definition or catalogue.DEFAULT)
    with progress.announce(f"{path}: deriving its equations and checking its points"):
        plan = catalogue.plan_sweep(path, anywhere=True)
    if args.json:
        print(json.dumps(_plan_entries(plan), indent=1))
    else:
        for name, text in _plan_lines(plan):
            print(f"{name:11s} {text}")


def _print_sweeps(contents: dict, as_json: bool) -> None:
    """Print name, system, size and title of each shipped sweep; in JSON name and title."""
    if as_json:
        print(json.dumps({name: entry.title for name, entry in contents.items()}, indent=1))
        return
    table = printing.table("sweep", "system", "points", "title", right=(2,))
    for name, entry in contents.items():
        table.add_row(name, entry.system, f"{entry.points:,}", entry.title)
    printing.console().print(table)


def _plan_entries(plan) -> dict:
    """Return the mapping that `check --json` prints: path, title, dimensions, needs and proofs of a planned sweep."""
    from dataclasses import asdict

    from sweeps.points.estimate import count_impossible, list_shortages

    grid, definition, needs = plan.sweep.grid, plan.sweep.definition, plan.needs
    return {
        "definition": str(plan.path),
        "title": definition.title,
        "dimensions": grid.sizes,
        **asdict(needs),
        **dict(zip(("impossible", "impossible_counted"), count_impossible(plan.sweep), strict=True)),
        "lacking_here": list_shortages(plan.sweep, needs, "results"),
        "proved": plan.sweep.system.proofs(grid),
        **definition.facts,
    }


def _plan_lines(plan):
    """Yield (heading, text) of each line that `check` prints about a planned sweep."""
    from kernels.compile.cache import why_unkept
    from sweeps.points.estimate import PAGE_BYTES, count_impossible, format_duration, in_words, list_shortages

    grid, definition, needs = plan.sweep.grid, plan.sweep.definition, plan.needs
    yield "definition", f"{plan.path}: valid"
    yield "title", definition.title
    dimensions = " × ".join(f"{n:,} {d}" for d, n in grid.sizes.items())
    yield "points", f"{plan.sweep.size_in_words.replace(' points', '', 1)} = {dimensions}"
    count, is_exact = count_impossible(plan.sweep)
    if count:
        share = f"{count:,}" if is_exact else f"about {100 * count / needs.points:.2g} % of the"
        yield "impossible", f"{share} points violate the triangle inequality of moments; the map flags them"
    if definition.rows is not None and definition.rows.text_columns:
        yield "ignored", f"columns of text: {', '.join(map(display, definition.rows.text_columns))}"
    yield "shards", f"{needs.shards:,}"
    yield "memory", f"about {in_words(needs.memory_bytes)} per process"
    for_figures = f"{PAGE_BYTES // 10**6} MB for figures and report"
    yield "disk", f"at most {in_words(needs.disk_bytes)} for shards and map, {for_figures}"
    how_often = "each time" if needs.compile_seconds and why_unkept() else "once"
    work = f"figures and report included; {format_duration(needs.seconds)} of it integration"
    if needs.compile_seconds:
        work += f" and {format_duration(needs.compile_seconds)} of compiling, {how_often}"
    yield "time", f"about {format_duration(needs.wait_seconds)} on one core, {work}"
    for line in plan.sweep.system.proofs(grid):
        yield "proved", line
    for line in list_shortages(plan.sweep, needs, "results"):
        yield "not here", f"{line} (`run` and the workflow refuse it on this machine)"
    yield from definition.remarks


def add_run(commands) -> None:
    """Add the command `run`."""
    words = "write the map, figures and report of a sweep to results/<sweep>"
    command = parser.add(commands, "run", words, _run_sweep, RUN)
    parser.share(command, "definition", nargs="?", default="tennis_racket")
    text = "number of processors (default all); does not change results"
    command.add_argument("--cores", type=int, metavar="N", help=text)
    command.add_argument("--again", action="store_true", help="compute everything again, finished or not")
    text = "replace the results of another definition with the same file name"
    command.add_argument("--replace", action="store_true", help=text)
    text = "folder of results (default results); the files go to FOLDER/<sweep>"
    command.add_argument("-o", "--output", metavar="FOLDER", default="results", help=text)
    command.add_argument("--quiet", action="store_true", help="print no progress, only the files")


def _run_sweep(args):
    """Run a definition to its map, figures and report, and print the name of each file."""
    from sweeps.pipeline.run import run
    from sweeps.views import drawing

    with progress.silence() if args.quiet else nullcontext():
        definition = catalogue.find_definition(args.definition)
        for file in run(definition, args.cores, args.again, args.output, drawing.start_worker, args.replace):
            print(file)


def add_compile(commands) -> None:
    """Add the command `compile`."""
    command = parser.add(commands, "compile", "compile the kernels of a sweep, once per machine", _compile_kernels)
    parser.share(command, "definition", nargs="?", default=None)
    command.add_argument("--all", action="store_true", help="compile the kernels of every system")
    command.epilog = "Without DEFINITION, those of the default sweep."


def _compile_kernels(args):
    """Compile the kernels of a sweep, with --all those of every system; refuse if their cache cannot be kept."""
    from kernels.compile.cache import why_unkept
    from sweeps import systems
    from sweeps.points import compile_kernels
    from sweeps.points.loading import read_sweep

    sweep = read_sweep(catalogue.find_definition(args.definition or catalogue.DEFAULT))  # refused before any work
    if why := why_unkept():
        raise DefinitionError(f"compile: {compile_kernels.cache_warning(why)}")
    examples = [*sweep.system.examples(sweep.definition), *(systems.all_examples() if args.all else ())]
    compile_kernels.compile_examples(examples)


def add_shard(commands) -> None:
    """Add the command `shard`."""
    command = parser.add(commands, "shard", "measure one part of the points of a sweep", _write_shard)
    parser.share(command, "definition", "--digest")
    command.add_argument("number", type=int, metavar="K", help="number of the part, from 1")
    command.add_argument("count", type=int, metavar="N", help="number of parts")
    parser.add_output(command, "the shard to write")
    text = "number of threads (default 1); does not change results"
    command.add_argument("--threads", type=int, default=1, metavar="T", help=text)


def _write_shard(args):
    """Measure the points of part K of N of a sweep and write them as a shard; refuse numbers out of range."""
    from sweeps.shards import shard as shards

    sweep = catalogue.plan_sweep(catalogue.find_definition(args.definition), digest=args.digest or "").sweep
    points = sweep.grid.size
    if not 1 <= args.count <= points:
        raise DefinitionError(f"N: {args.count} parts are out of range; allowed: 1 to {points}, the number of points")
    if not 1 <= args.number <= args.count:
        raise DefinitionError(f"K: part {args.number} is out of range; allowed: 1 to {args.count}, the number of parts")
    if args.threads < 1:
        raise DefinitionError(f"--threads: {args.threads} is out of range; allowed: 1 or more")
    start, stop = sweep.grid.shard_bounds(args.count)[args.number - 1]
    motions_per_point = math.prod(sweep.each.values())
    with progress.count_points(stop - start, f"shard {args.number} of {args.count}", motions_per_point) as advance:
        shards.write_shard(sweep, args.number, args.count, args.output, args.threads, advance)


def add_merge(commands) -> None:
    """Add the command `merge`."""
    command = parser.add(commands, "merge", "merge all shards of a sweep into its map", _merge_shards)
    parser.share(command, "definition", "--digest")
    command.add_argument("shards", nargs="+", metavar="SHARD", help="files written by `shard`, or their folder")
    command.add_argument("--renew", action="store_true", help="measure shards of other definitions or kernels again")
    parser.add_output(command, "the map to write")
    text = "threads to measure with again (default 1)"
    command.add_argument("--threads", type=int, default=1, metavar="T", help=text)


def _merge_shards(args):
    """Merge the shards of a sweep into its map, and print the content hash of the map."""
    from sweeps.shards import merging

    plan = catalogue.plan_sweep(catalogue.find_definition(args.definition), digest=args.digest or "")
    content_hash = merging.merge_shards(plan.sweep, args.shards, args.output, args.threads, args.renew)
    print(f"content_hash {content_hash}")


def add_schema(commands) -> None:
    """Add the command `schema`."""
    command = parser.add(commands, "schema", "print the JSON Schema of definitions, for editors", _print_schema, SCHEMA)
    text = "a shipped system, or the path of a Python file that describes one"
    command.add_argument("systems", metavar="SYSTEM", nargs="*", help=text)
    parser.add_output(command, "write the schema to FILE", required=False)


def _print_schema(args):
    """Print the JSON Schema of definitions, or write it to the output."""
    from sweeps.points import loading

    text = json.dumps(loading.json_schema(args.systems), indent=1)
    if not args.output:
        print(text)
        return
    with replace_output(args.output) as temporary:
        Path(temporary).write_text(text + "\n", encoding="utf-8")
