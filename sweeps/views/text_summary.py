"""Summary of a map in a terminal: counts, the worst of each check, a small map in characters."""


def write(console, ds, totals, drawn) -> None:
    """Print the counts, the worst points and the small map in characters of a map."""
    from sweeps import systems
    from sweeps.maps.summary import leading_flag, rule
    from sweeps.schema.boxes import dimensions

    look = systems.presentation_of(ds).look
    sizes = " × ".join(f"{n:,} {dim}" for dim, n in dimensions(ds).items())
    console.print(f"{ds.attrs.get('title', '')}", style="bold")
    console.print(f"{totals.points:,} points = {sizes}")
    console.print()
    if totals.table:
        console.print(_counts(totals, leading_flag(ds), look))
    for name, number in totals.unlike.items():
        console.print(f"{name} differs from theory at {number:,} of {totals.points:,} points")
    if totals.impossible:
        console.print(f"physically impossible: {totals.impossible:,} points")
    console.print()
    worst = _worst(ds, totals, {dim for dim, size in dimensions(ds).items() if size > 1})
    if worst.row_count:
        console.print(worst)
    if totals.deviations:
        console.print(f"compared with theory: {rule(totals)}", style="dim")
    if drawn is not None:
        console.print()
        _draw(console, drawn, look)


def _counts(totals, lead, look):
    from sweeps.figure.printing import table
    from sweeps.maps.summary import share

    statuses = list(dict.fromkeys(status for (_, status), number in totals.table.items() if number))
    made = table(lead, "points", "share", *statuses, right=tuple(range(1, 3 + len(statuses))))
    for meaning in dict.fromkeys(m for m, _ in totals.table):
        numbers = [totals.table[meaning, status] for status in statuses]
        if sum(numbers):
            row = [f"{n:,}" for n in (sum(numbers), *numbers)]
            made.add_row(look.words(meaning), row[0], share(sum(numbers), totals.points), *row[1:])
    return made


def _worst(ds, totals, dims):
    from sweeps.figure.printing import table
    from sweeps.maps.selection import in_words
    from sweeps.maps.summary import place

    made = table("worst", "value", "where", right=(1,))
    rows = [(_against(deviation), deviation.worst) for deviation in totals.deviations.values()]
    for name, worst in (*rows, *totals.checks.items()):
        if worst.points:
            where = ", ".join(f"{dim} {in_words(value)}" for dim, value in place(ds, worst.at).items() if dim in dims)
            made.add_row(name, f"{worst.value:.2g}", where)
    return made


def _against(deviation) -> str:
    over = f"over {deviation.scale}" if deviation.scale else "relative"
    return f"{deviation.name} against {deviation.reference}, {over}"


def _draw(console, drawn, look) -> None:
    from rich.text import Text

    from sweeps.maps.selection import in_words

    at = ", ".join(f"{dim} = {in_words(value)}" for dim, value in drawn.fixed.items())
    axes = f"y axis {drawn.y}" + (f", x axis {drawn.x}" if drawn.x else "")
    console.print(f"{drawn.flag}: {axes}" + (f"; {at}" if at else ""))
    label = max(len(name) for name, _ in drawn.panels[0].rows)
    wide = [max(len(panel.rows[0][1]), len(panel.title), len(" … ".join(panel.ends))) for panel in drawn.panels]
    if drawn.panels[0].title:
        console.print(" " * (label + 1) + "  ".join(p.title.ljust(w) for p, w in zip(drawn.panels, wide, strict=True)))
    for number, (name, _) in enumerate(drawn.panels[0].rows):
        line = Text(name.rjust(label) + " ")
        for panel, width in zip(drawn.panels, wide, strict=True):
            for character in panel.rows[number][1].ljust(width + 2):
                line.append(character, drawn.colors.get(character, ""))
        line.rstrip()
        console.print(line, no_wrap=True, crop=False)
    if drawn.x:
        ends = [
            panel.ends[0] + panel.ends[1].rjust(max(width - len(panel.ends[0]), len(panel.ends[1]) + 1))
            for panel, width in zip(drawn.panels, wide, strict=True)
        ]
        console.print(" " * (label + 1) + "  ".join(ends), no_wrap=True, crop=False)
    console.print("  ".join(f"{glyph} {look.words(meaning)}" for glyph, meaning in drawn.legend.items()))
