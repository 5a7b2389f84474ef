"""`show`: what a map says, in a terminal."""

from sweeps.commands import parser

EPILOG = """\
The map in characters is drawn at the middle of the dimensions that it does not show, or at --DIMENSION VALUE (the
nearest grid value). The numbers above it are of the whole map.
"""


def add(commands) -> None:
    """Add the command to the parser."""
    command = parser.add(commands, "show", "summarise a map, with a small map in characters", _run, EPILOG)
    command.takes_coordinates = True
    parser.add_map(command)
    parser.add_json(command)


def _run(args):
    from sweeps.figure import printing
    from sweeps.maps import admission, selection, summary
    from sweeps.views import text_summary, textmap

    with admission.opened(args.map) as whole:
        ds = summary.pointwise(whole)
        places = selection.nearest(ds, args.coordinates)
        totals = summary.summarise(ds)
        chosen = {dim: place for dim, place in places.items() if place.requested is not None}
        if args.json:
            printing.print_json(_facts(ds, totals))
        else:
            console = printing.console()
            text_summary.write(console, ds, totals, textmap.draw(ds, chosen, console.width))


def _facts(ds, totals) -> dict:
    from sweeps.maps.summary import place
    from sweeps.schema.boxes import dimensions

    def said(worst):
        return {"value": worst.value, "at": place(ds, worst.at), "points": worst.points}

    table = {}
    for (meaning, status), number in totals.table.items():
        table.setdefault(meaning, {})[status] = number
    facts = {name: str(ds.attrs.get(name, "")) for name in ("title", "system", "source", "content_hash")}
    facts |= {"dimensions": dimensions(ds), "points": totals.points, "counts": totals.counts, "table": table}
    facts |= {"unlike": totals.unlike, "impossible": totals.impossible, "compared": totals.compared, "deviations": {}}
    for (reference, name), deviation in totals.deviations.items():
        entry = said(deviation.worst) | {"against": reference, "over": deviation.scale or reference}
        facts["deviations"].setdefault(name, entry)
    return facts | {"checks": {name: said(worst) for name, worst in totals.checks.items()}}
