"""`check`: is a definition right, and what will it take."""

import json

from sweeps.commands import parser


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "check", "validate a definition, and predict memory, disk and time", _run)
    parser.add_definition(command, nargs="?")
    command.add_argument("--list", action="store_true", help="list the shipped sweeps, and stop")
    parser.add_json(command)


def _run(args):
    from sweeps.pipeline import waiting
    from sweeps.points import catalogue

    if args.list:
        titles = {name: one.title for name, one in catalogue.contents().items()}
        print(json.dumps(titles, indent=1)) if args.json else _list()
        return
    path = catalogue.resolve(args.definition or catalogue.DEFAULT)
    with waiting.said(f"{path}: deriving its equations and checking its points"):
        planned = catalogue.plan(path, anywhere=True)
    if args.json:
        print(json.dumps(_facts(planned), indent=1))
    else:
        for name, text in _rows(planned):
            print(f"{name:11s} {text}")


def _list() -> None:
    """Print name, system, size and title of each shipped sweep."""
    from sweeps.figure import printing
    from sweeps.points import catalogue

    table = printing.table("sweep", "system", "points", "title", right=(2,))
    for name, one in catalogue.contents().items():
        table.add_row(name, one.system, f"{one.points:,}", one.title)
    printing.console().print(table)


def _facts(planned) -> dict:
    from dataclasses import asdict

    from sweeps.points.estimate import estimate, lacking
    from sweeps.points.existence import impossible

    grid, definition, needs = planned.sweep.grid, planned.sweep.definition, estimate(planned.sweep)
    return {
        "definition": str(planned.path),
        "title": definition.title,
        "dimensions": dict(zip(grid.dims, grid.shape, strict=True)),
        **asdict(needs),
        **dict(zip(("impossible", "impossible_counted"), impossible(planned.sweep), strict=True)),
        "lacking_here": lacking(planned.sweep, needs, "results"),
        "proved": planned.sweep.system.proofs(grid),
        **definition.facts,
    }


def _rows(planned):
    from sweeps.points.estimate import PAGE_BYTES, estimate, in_words, lacking, span
    from sweeps.points.existence import impossible

    grid, definition = planned.sweep.grid, planned.sweep.definition
    needs = estimate(planned.sweep)
    yield "definition", f"{planned.path}: valid"
    yield "title", definition.title
    dimensions = " × ".join(f"{n:,} {d}" for d, n in zip(grid.dims, grid.shape, strict=True))
    yield "points", f"{needs.points:,} = {dimensions}"
    count, counted = impossible(planned.sweep)
    if count:
        share = f"{count:,}" if counted else f"about {100 * count / needs.points:.2g} % of the"
        yield "impossible", f"{share} points violate the triangle inequality of moments; the map flags them"
    yield "shards", f"{needs.shards:,}"
    yield "memory", f"about {in_words(needs.memory_bytes)} per process"
    drawn = f"{PAGE_BYTES // 10**6} MB for figures and report"
    yield "disk", f"at most {in_words(needs.disk_bytes)} for shards and map, {drawn}"
    compiled = f" and {span(needs.compile_seconds)} of compiling, once" if needs.compile_seconds else ""
    parts = f"figures and report included; {span(needs.seconds)} of it integration{compiled}"
    yield "time", f"about {span(needs.wait_seconds)} on one core, {parts}"
    for line in planned.sweep.system.proofs(grid):
        yield "proved", line
    for line in lacking(planned.sweep, needs, "results"):
        yield "not here", f"{line} (`run` and the workflow refuse it on this machine)"
    yield from definition.remarks
