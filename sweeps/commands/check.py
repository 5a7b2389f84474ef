"""`check`: is a definition right, and what will it take."""

import json

from sweeps.commands import parser


def add(commands) -> None:
    """Describes the command."""
    command = parser.add(commands, "check", "validate a definition and say what it will take", _run)
    parser.add_definition(command, nargs="?")
    command.add_argument("--list", action="store_true", help="list the sweeps that ship, and stop")
    parser.add_json(command)


def _run(args):
    from sweeps.points import catalogue

    if args.list:
        from sweeps.points.loading import load

        titles = {name: load(path, check=False).title for name, path in catalogue.shipped().items()}
        print(json.dumps(titles, indent=1) if args.json else "\n".join(f"{n:16s} {t}" for n, t in titles.items()))
        return
    planned = catalogue.plan(catalogue.resolve(args.definition or catalogue.DEFAULT))
    if args.json:
        print(json.dumps(_facts(planned), indent=1))
    else:
        for name, text in _rows(planned):
            print(f"{name:11s} {text}")


def _facts(planned) -> dict:
    from dataclasses import asdict

    from sweeps.points.estimate import estimate

    grid, definition = planned.sweep.grid, planned.sweep.definition
    return {
        "definition": str(planned.path),
        "title": definition.title,
        "dimensions": dict(zip(grid.dims, grid.shape, strict=True)),
        **asdict(estimate(planned.sweep)),
        "bodies": {
            body.name: {"moments": body.moments, "axes": body.principal.axes, "notes": body.principal.notes}
            for body in _diagonalised(definition)
        },
    }


def _rows(planned):
    from sweeps.points.estimate import estimate, in_words

    grid, definition = planned.sweep.grid, planned.sweep.definition
    needs = estimate(planned.sweep)
    yield "definition", f"{planned.path}: valid"
    yield "title", definition.title
    dimensions = " × ".join(f"{n:,} {d}" for d, n in zip(grid.dims, grid.shape, strict=True))
    yield "points", f"{needs.points:,} = {dimensions}"
    yield "shards", f"{needs.shards:,}"
    yield "memory", f"about {in_words(needs.memory_bytes)} a process"
    yield "disk", f"at most {in_words(needs.disk_bytes)}, half of it for the map"
    yield "time", f"about {needs.seconds:,.3g} s of integration on one core"
    for body in _diagonalised(definition):
        from sweeps.systems.rigid_body.wording import principal_axes

        yield "body", f"{body.name}: principal moments and axes, in the coordinates it is given in"
        for line in principal_axes(body.principal):
            yield "", line


def _diagonalised(definition) -> list:
    """The bodies whose moments come from a tensor or a mesh."""
    return [body for body in getattr(definition, "bodies", ()) if body.principal is not None]
