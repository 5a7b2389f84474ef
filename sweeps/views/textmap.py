"""Maps in a terminal: counts, the worst value of each check, and flags as characters, legible without colours."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from rich.text import Text

from sweeps.figure import colors
from sweeps.figure.printing import table
from sweeps.maps.description import MapDescription
from sweeps.maps.selection import Place, format_value
from sweeps.maps.summary import Deviation, Summary, comparison_rule, format_share
from sweeps.schema.datasets import along, flags
from sweeps.schema.refusals import cut_text
from sweeps.schema.variables import POINT
from sweeps.systems.presentation.appearance import Appearance

if TYPE_CHECKING:
    import xarray as xr
    from rich.console import Console
    from rich.table import Table

MAX_ROWS = 24  # lines of a panel, which fit into a terminal of the usual height
MIN_PANEL_WIDTH = 4  # characters; panels are not narrower, even if the line is too short


@dataclass(frozen=True)
class Panel:
    """One plane of characters."""

    title: str  #: value of the panels' own dimension, for example "axis 2"; or ""
    rows: list[tuple[str, str]]  #: (label, characters) from the top
    ends: tuple[str, ...]  #: first and last value along the bottom


@dataclass(frozen=True)
class TextMap:
    """Panels in one row, with their common legend and axes."""

    flag: str  #: the drawn variable
    x: str  #: horizontal dimension, "" for none
    y: str  #: vertical dimension
    fixed: dict[str, float | int | str]  #: dimension that is not drawn → its value
    panels: list[Panel]  #: the panels from the left
    legend: dict[str, str]  #: character that occurs → meaning
    colors: dict[str, str]  #: character → colour, "" for none


def print_summary(console: "Console", totals: Summary, text_map: TextMap | None) -> None:
    """Print counts, worst points and (if it is not None) the text map of a map.

    Args:
        console: of Rich.
        totals: the summary of the map.
        text_map: of `draw_map`.
    """
    description, appearance = totals.description, totals.description.presentation.appearance
    console.print(description.title, style="bold")
    console.print(f"{totals.points:,} points = {' × '.join(f'{n:,} {dim}' for dim, n in description.sizes.items())}")
    console.print()
    if totals.table:
        console.print(_count_table(totals, description.leading_flag, appearance))
    for name, number in totals.disagreements.items():
        console.print(f"{name} differs from theory at {number:,} of {totals.points:,} points")
    if totals.impossible:
        console.print(f"physically impossible: {totals.impossible:,} points")
    console.print()
    worst = _worst_table(totals)
    if worst.row_count:
        console.print(worst)
    if totals.deviations:
        console.print(f"compared with theory: {comparison_rule(totals)}", style="dim")
    if text_map is not None:
        console.print()
        _print_map(console, text_map, appearance)


def _count_table(totals: Summary, lead: str, appearance: Appearance) -> "Table":
    """Return the table of points by headline and status."""
    statuses = list(dict.fromkeys(status for (_, status), number in totals.table.items() if number))
    counts = table(lead, "points", "share", *statuses, right=tuple(range(1, 3 + len(statuses))))
    for meaning in dict.fromkeys(m for m, _ in totals.table):
        numbers = [totals.table[meaning, status] for status in statuses]
        if sum(numbers):
            row = [f"{n:,}" for n in (sum(numbers), *numbers)]
            counts.add_row(appearance.words(meaning), row[0], format_share(sum(numbers), totals.points), *row[1:])
    return counts


def _worst_table(totals: Summary) -> "Table":
    """Return the table of the largest deviations, and of the points at which they occur."""
    description = totals.description
    worst_table = table("worst", "value", "where", right=(1,))
    rows = [(_deviation_name(deviation), deviation.worst) for deviation in totals.deviations.values()]
    at_zero = [(f"{d.name} over its error, {d.reference} 0", d.worst_at_zero) for d in totals.deviations.values()]
    for name, worst in (*rows, *at_zero, *totals.checks.items()):
        if worst.points:
            at = {dim: value for dim, value in description.place(worst.at).items() if description.sizes.get(dim) != 1}
            where = ", ".join(f"{dim} {format_value(value)}" for dim, value in at.items())
            worst_table.add_row(name, f"{worst.value:.2g}", where)
    return worst_table


def _deviation_name(deviation: Deviation) -> str:
    over = f"over {deviation.scale}" if deviation.scale else "relative"
    return f"{deviation.name} against {deviation.reference}, {over}"


def _print_map(console: "Console", text_map: TextMap, appearance: Appearance) -> None:
    """Print the map in characters, panel next to panel, with the names of rows and axes."""
    at = ", ".join(f"{dim} = {format_value(value)}" for dim, value in text_map.fixed.items())
    axes = f"y axis {text_map.y}" + (f", x axis {text_map.x}" if text_map.x else "")
    console.print(f"{text_map.flag}: {axes}" + (f"; {at}" if at else ""))
    label = max(len(name) for name, _ in text_map.panels[0].rows)
    widths = [max(len(panel.rows[0][1]), len(panel.title), len(" … ".join(panel.ends))) for panel in text_map.panels]
    if text_map.panels[0].title:
        titles = (panel.title.ljust(width) for panel, width in zip(text_map.panels, widths, strict=True))
        console.print(" " * (label + 1) + "  ".join(titles))
    for number, (name, _) in enumerate(text_map.panels[0].rows):
        line = Text(name.rjust(label) + " ")
        for panel, width in zip(text_map.panels, widths, strict=True):
            for character in panel.rows[number][1].ljust(width + 2):
                line.append(character, text_map.colors.get(character, ""))
        line.rstrip()
        console.print(line, no_wrap=True, crop=False)
    if text_map.x:
        ends = [
            panel.ends[0] + panel.ends[1].rjust(max(width - len(panel.ends[0]), len(panel.ends[1]) + 1))
            for panel, width in zip(text_map.panels, widths, strict=True)
        ]
        console.print(" " * (label + 1) + "  ".join(ends), no_wrap=True, crop=False)
    console.print("  ".join(f"{glyph} {appearance.words(meaning)}" for glyph, meaning in text_map.legend.items()))
    for mark in filter(None, map(appearance.mark, text_map.legend.values())):
        if mark.more:
            console.print(f"{mark.words}; {mark.more}", style="dim")


def draw_map(
    ds: "xr.Dataset", description: MapDescription, places: dict[str, Place], width: int = 80
) -> TextMap | None:
    """Draw the leading flag over two dimensions, one panel per spin axis or mode.

    Names (of bodies, of equilibria) are along the vertical; otherwise, the two longest dimensions span the plane.
    Equal panels, as those of eigenvalues with one regime, are drawn once. Return None for a map without a flag or a
    plane, and for sampled and listed points.

    Args:
        ds: a map.
        description: its description.
        places: dimension → place at which the map is cut; further dimensions are cut in their middle.
        width: characters in a line.
    """
    flag = description.leading_flag
    sizes = {dim: size for dim, size in description.sizes.items() if size > 1 and dim not in places}
    if not (sizes and flag) or POINT.name in sizes:
        return None
    panel_dim = next((dim for dim in sizes if ds[dim].dtype.kind in "iu" and len(sizes) > 1), None)
    num_panels = sizes.pop(panel_dim) if panel_dim else 1
    plane = _Plane(ds, sizes)
    fixed = {dim: (n - 1) // 2 for dim, n in description.sizes.items() if dim not in (plane.x, plane.y, panel_dim)}
    fixed |= {dim: place.index for dim, place in places.items()}
    values = ds[flag].isel(fixed).load()
    names = [f"{panel_dim} {value}" for value in ds[panel_dim].values] if panel_dim else [""]
    # all eigenvalues have one regime
    if panel_dim and not np.ptp(values.values, axis=values.dims.index(panel_dim)).any():
        values, names, num_panels = values.isel({panel_dim: 0}), [f"{names[0]} … {ds[panel_dim].values[-1]}"], 1
    panel_width = max(MIN_PANEL_WIDTH, (width - plane.label_width() - 2 * (num_panels - 1)) // num_panels)
    appearance, meanings = description.presentation.appearance, flags(description.variables[flag])
    glyphs = _flag_glyphs(meanings, appearance)
    panels = []
    for number in range(num_panels):
        labels, cells = plane.cells(values.isel({panel_dim: number}) if num_panels > 1 else values, panel_width)
        rows = ["".join(glyphs.get(cell, "?") for cell in row) for row in cells]
        panels.append(Panel(names[number], list(zip(labels, rows, strict=True)), plane.ends))
    used_glyphs = {character for panel in panels for _, row in panel.rows for character in row}
    legend = {glyphs[value]: meaning for value, meaning in meanings.items() if glyphs[value] in used_glyphs}
    at = description.place({dim: i for dim, i in fixed.items() if description.sizes[dim] > 1})
    tints = {glyph: colors.in_light(appearance.color(meaning)) for glyph, meaning in legend.items()}
    return TextMap(flag, plane.x, plane.y, at, panels, legend, tints)


def _flag_glyphs(meanings: Mapping[int, str], appearance: Appearance) -> dict[int, str]:
    """Return flag value → character: that of the system's appearance, else a letter."""
    marks = {value: appearance.mark(meaning) for value, meaning in meanings.items()}
    return {value: mark.glyph if mark else chr(ord("a") + k % 26) for k, (value, mark) in enumerate(marks.items())}


class _Plane:
    """A plane of two dimensions: names are vertical; else the longest dimension is horizontal, the second vertical."""

    def __init__(self, ds: "xr.Dataset", sizes: dict[str, int]):
        longest = sorted(sizes, key=lambda dim: -sizes[dim])
        self.names = [dim for dim in sizes if ds[dim].dtype.kind in "OU"]
        self.y = self.names[0] if self.names else longest[:2][-1]
        self.x = next((dim for dim in longest if dim != self.y), "")
        self.labels = [_short_label(value) for value in ds[self.y].values]
        self.ends = tuple(format_value(ds[self.x].values[i].item()) for i in (0, -1)) if self.x else ("", "")

    def label_width(self) -> int:
        """Return the width of the rows' labels, characters."""
        return max(map(len, self.labels)) + 1

    def cells(self, values: "xr.DataArray", max_columns: int) -> tuple[list[str], list[list[int]]]:
        """Return labels and flags of the rows from the top."""
        numbers = along(values, (self.y, self.x))
        rows, columns = _spaced_indices(numbers.shape[0], MAX_ROWS), _spaced_indices(numbers.shape[1], max_columns)
        rows = rows if self.names else rows[::-1]
        return [self.labels[i] for i in rows], numbers[np.ix_(rows, columns)].tolist()


def _spaced_indices(size: int, max_count: int) -> list[int]:
    return sorted({*np.linspace(0, size - 1, min(size, max(max_count, 2))).round().astype(int).tolist()})


def _short_label(value) -> str:
    value = value.item() if hasattr(value, "item") else value
    return cut_text(f"{value:.4g}" if isinstance(value, float) else str(value), 16)
