"""A map in a terminal: counts, the worst of each check, and its flags as characters, legible without colours."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from rich.text import Text

from sweeps.figure import colors
from sweeps.figure.printing import table
from sweeps.maps.description import MapDescription
from sweeps.maps.selection import Place, format_value
from sweeps.maps.summary import Deviation, Summary, comparison_rule, format_share
from sweeps.schema.datasets import along
from sweeps.schema.refusals import cut_text
from sweeps.schema.variables import POINT
from sweeps.systems.presentation.appearance import Appearance

if TYPE_CHECKING:
    import xarray as xr
    from rich.console import Console
    from rich.table import Table

MOST_ROWS = 24
NARROWEST = 4


@dataclass(frozen=True)
class Panel:
    """One plane of characters."""

    title: str  #: what is special to this plane, "axis 2" or ""
    rows: list[tuple[str, str]]  #: (label, characters) from the top
    ends: tuple[str, str]  #: first and last value along the bottom


@dataclass(frozen=True)
class TextMap:
    """Planes beside one another, with what is the same in all."""

    flag: str  #: the variable that is drawn
    x: str  #: dimension along the bottom, "" for none
    y: str  #: dimension upwards
    fixed: dict[str, float | int | str]  #: dimension → value of what is not shown
    panels: list[Panel]  #: the planes
    legend: dict[str, str]  #: character → meaning, of what occurs
    colors: dict[str, str]  #: character → colour, "" where it has none


def write(console: "Console", totals: Summary, drawn: TextMap | None) -> None:
    """Print the counts, the worst points and the small map in characters of a map."""
    description, appearance = totals.description, totals.description.presentation.appearance
    console.print(description.title, style="bold")
    console.print(f"{totals.points:,} points = {' × '.join(f'{n:,} {dim}' for dim, n in description.sizes.items())}")
    console.print()
    if totals.table:
        console.print(_counts(totals, description.leading_flag, appearance))
    for name, number in totals.disagreements.items():
        console.print(f"{name} differs from theory at {number:,} of {totals.points:,} points")
    if totals.impossible:
        console.print(f"physically impossible: {totals.impossible:,} points")
    console.print()
    worst = _worst(totals)
    if worst.row_count:
        console.print(worst)
    if totals.deviations:
        console.print(f"compared with theory: {comparison_rule(totals)}", style="dim")
    if drawn is not None:
        console.print()
        _print_map(console, drawn, appearance)


def _counts(totals: Summary, lead: str, appearance: Appearance) -> "Table":
    statuses = list(dict.fromkeys(status for (_, status), number in totals.table.items() if number))
    made = table(lead, "points", "share", *statuses, right=tuple(range(1, 3 + len(statuses))))
    for meaning in dict.fromkeys(m for m, _ in totals.table):
        numbers = [totals.table[meaning, status] for status in statuses]
        if sum(numbers):
            row = [f"{n:,}" for n in (sum(numbers), *numbers)]
            made.add_row(appearance.words(meaning), row[0], format_share(sum(numbers), totals.points), *row[1:])
    return made


def _worst(totals: Summary) -> "Table":
    description = totals.description
    made = table("worst", "value", "where", right=(1,))
    rows = [(_against(deviation), deviation.worst) for deviation in totals.deviations.values()]
    at_zero = [(f"{d.name} over its error, {d.reference} 0", d.worst_at_zero) for d in totals.deviations.values()]
    for name, worst in (*rows, *at_zero, *totals.checks.items()):
        if worst.points:
            at = {dim: value for dim, value in description.place(worst.at).items() if description.sizes.get(dim) != 1}
            where = ", ".join(f"{dim} {format_value(value)}" for dim, value in at.items())
            made.add_row(name, f"{worst.value:.2g}", where)
    return made


def _against(deviation: Deviation) -> str:
    over = f"over {deviation.scale}" if deviation.scale else "relative"
    return f"{deviation.name} against {deviation.reference}, {over}"


def _print_map(console: "Console", drawn: TextMap, appearance: Appearance) -> None:
    at = ", ".join(f"{dim} = {format_value(value)}" for dim, value in drawn.fixed.items())
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
    console.print("  ".join(f"{glyph} {appearance.words(meaning)}" for glyph, meaning in drawn.legend.items()))
    for mark in filter(None, map(appearance.mark, drawn.legend.values())):
        if mark.more:
            console.print(f"{mark.words}; {mark.more}", style="dim")


def draw(ds: "xr.Dataset", description: MapDescription, places: dict[str, Place], width: int = 80) -> TextMap | None:
    """Draw the leading flag over two dimensions, one panel per spin axis or mode.

    Names (of bodies, of equilibria) are along the vertical; of numbers, the two longest dimensions make the plane.
    Equal panels, as those of the eigenvalues of one regime, are one. Return None for a map without a flag or a plane,
    and for sampled and listed points.

    Args:
        ds: a map.
        description: its description.
        places: where to stand along other dimensions; those not given stand in their middle.
        width: characters in a line.
    """
    flag = description.leading_flag
    sizes = {dim: size for dim, size in description.sizes.items() if size > 1 and dim not in places}
    if not (sizes and flag) or POINT.name in sizes:
        return None
    beside = next((dim for dim in sizes if ds[dim].dtype.kind in "iu" and len(sizes) > 1), None)
    count = sizes.pop(beside) if beside else 1
    drawn = _Grid(ds, sizes)
    fixed = {dim: (n - 1) // 2 for dim, n in description.sizes.items() if dim not in (drawn.x, drawn.y, beside)}
    fixed |= {dim: place.index for dim, place in places.items()}
    values = ds[flag].isel(fixed).load()
    names = [f"{beside} {value}" for value in ds[beside].values] if beside else [""]
    if beside and not np.ptp(values.values, axis=values.dims.index(beside)).any():  # a regime is one of all eigenvalues
        values, names, count = values.isel({beside: 0}), [f"{names[0]} … {ds[beside].values[-1]}"], 1
    room = max(NARROWEST, (width - drawn.label_width() - 2 * (count - 1)) // count)
    appearance, meanings = description.presentation.appearance, description.variables[flag].flags
    glyphs = _glyphs(meanings, appearance)
    panels = []
    for number in range(count):
        labels, cells = drawn.cells(values.isel({beside: number}) if count > 1 else values, room)
        rows = ["".join(glyphs.get(cell, "?") for cell in row) for row in cells]
        panels.append(Panel(names[number], list(zip(labels, rows, strict=True)), drawn.ends))
    occurs = {character for panel in panels for _, row in panel.rows for character in row}
    legend = {glyphs[value]: meaning for value, meaning in meanings.items() if glyphs[value] in occurs}
    at = description.place({dim: i for dim, i in fixed.items() if description.sizes[dim] > 1})
    tints = {glyph: colors.in_light(appearance.color(meaning)) for glyph, meaning in legend.items()}
    return TextMap(flag, drawn.x, drawn.y, at, panels, legend, tints)


def _glyphs(meanings: dict[int, str], appearance: Appearance) -> dict[int, str]:
    """Return flag → its character; a letter for those without one of their own."""
    marks = {value: appearance.mark(meaning) for value, meaning in meanings.items()}
    return {value: mark.glyph if mark else chr(ord("a") + k % 26) for k, (value, mark) in enumerate(marks.items())}


class _Grid:
    """A plane of two dimensions: names stand upwards, else the two longest do, the first of them along the bottom."""

    def __init__(self, ds: "xr.Dataset", sizes: dict[str, int]):
        longest = sorted(sizes, key=lambda dim: -sizes[dim])
        self.names = [dim for dim in sizes if ds[dim].dtype.kind in "OU"]
        self.y = self.names[0] if self.names else longest[:2][-1]
        self.x = next((dim for dim in longest if dim != self.y), "")
        self.labels = [_short(value) for value in ds[self.y].values]
        self.ends = tuple(format_value(ds[self.x].values[i].item()) for i in (0, -1)) if self.x else ("", "")

    def label_width(self) -> int:
        """Return the characters beside the rows."""
        return max(map(len, self.labels)) + 1

    def cells(self, values: "xr.DataArray", room: int) -> tuple[list[str], list[list[int]]]:
        """Return labels and flags of the rows from the top."""
        numbers = along(values, (self.y, self.x))
        rows, columns = _few(numbers.shape[0], MOST_ROWS), _few(numbers.shape[1], room)
        rows = rows if self.names else rows[::-1]
        return [self.labels[i] for i in rows], numbers[np.ix_(rows, columns)].tolist()


def _few(size: int, most: int) -> list[int]:
    return sorted({*np.linspace(0, size - 1, min(size, max(most, 2))).round().astype(int).tolist()})


def _short(value) -> str:
    value = value.item() if hasattr(value, "item") else value
    return cut_text(f"{value:.4g}" if isinstance(value, float) else str(value), 16)
