"""The report of a map: one HTML file that works offline, with the map to explore and the motion of each point.

The page requests nothing from a network and runs only the scripts written here: its content security policy
names each by its hash. All text that comes from the file is escaped by the template or set as text by the page.
"""

import base64
import hashlib
import math
import urllib.parse
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
import numpy as np
from jinja2.utils import htmlsafe_json_dumps  # JSON that cannot end the HTML element that contains it
from markupsafe import Markup

from sweeps.figure import colors, wording
from sweeps.maps.description import NUMBERS, MapDescription
from sweeps.maps.summary import Summary, comparison_rule, format_share
from sweeps.process.files import replace_output
from sweeps.reading.definitions import definition_of
from sweeps.schema.datasets import flags, long_name, units_of
from sweeps.schema.variables import POINT, Role
from sweeps.systems import make_presentation
from sweeps.systems.presentation import Opening, Page
from sweeps.views import plotly
from sweeps.views.report_columns import (
    Columns,
    Grid,
    Packed,
    PageColumn,
    pack_within,
    read_columns,
    scaling_laws,
    thin_columns,
)

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.systems.system import Dynamics

MAX_PAGE_BYTES = 8_000_000  # default size of a page, which browsers open in a second or two
JSON_OPTIONS: dict[str, Any] = {"allow_nan": False, "ensure_ascii": False, "separators": (",", ":")}
# scripts of the page in order; those of the map's system follow, then main.js
FIRST_SCRIPTS = (
    "numbers.js",
    "data.js",
    "state.js",
    "colors.js",
    "controls.js",
    "row.js",
    "plane.js",
    "cloud.js",
    "lecture.js",
)


@dataclass(frozen=True)
class PageContents:
    """The contents of a page except for its packed columns."""

    system_page: Page  #: of the map's system
    opening: Opening  #: the point at which the page begins, given by the map's system
    summary: Summary

    @property
    def map(self) -> MapDescription:
        """Return the description of the map."""
        return self.summary.description


def write_report(
    ds: "xr.Dataset", path: str | Path, limit: int = MAX_PAGE_BYTES, system: "Dynamics | None" = None
) -> None:
    """Write the report of a map, which is read once, box by box, so that it may exceed the memory.

    Args:
        ds: a map, from `sweeps.open_map` or `sweeps.survey`.
        path: the HTML file, replaced when the new file is complete.
        limit: maximum size of the file, bytes; a map that does not fit is thinned, and the page states it.
        system: the map's system, if it is one of a Python file, which is not run because a map names it; left out, the
            page of such a map has no motion by its equations.

    Raises:
        ValueError: if not even a single point of the map fits into `limit`.
    """
    description = MapDescription(ds)
    presentation = make_presentation(system) if system else description.presentation
    system_page, opening = presentation.page(ds), presentation.opening(ds)
    summary, columns, page_grid = read_columns(ds, description)
    contents = PageContents(system_page, opening, summary)
    packed_columns, page_grid = _fit_columns(contents, columns, page_grid, limit)
    page = _render_page(contents, packed_columns, page_grid)
    with replace_output(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _fit_columns(contents: PageContents, columns: Columns, page_grid: Grid, limit: int) -> tuple[list[Packed], Grid]:
    """Return (packed columns, their grid) of a page of `limit` bytes; points are left out until the columns fit."""
    while True:
        laws = scaling_laws(contents.map, columns, page_grid)
        budget = limit - _frame_size(contents, laws, page_grid)
        packed_columns = pack_within(laws, budget)
        if packed_columns is not None:
            return packed_columns, page_grid
        points = math.prod(len(values) for values in page_grid.values())
        if points == 1:
            raise ValueError(f"limit: no point of this map fits into a page of {limit:,} bytes")
        points = max(1, int(points * _fitting_share(laws, budget)))
        columns, page_grid = thin_columns(contents.map, columns, page_grid, points)


def _frame_size(contents: PageContents, columns: list[PageColumn], page_grid) -> int:
    """Return the size of a page without its columns, bytes."""
    empty = [Packed(c.name, c.values.shape, c.powers, "f8", -1000, 6, "") for c in columns]
    return len(_render_page(contents, empty, page_grid).encode("utf-8"))


def _fitting_share(columns: list[PageColumn], budget: int) -> float:
    """Return the share of the points that fits a budget, at about 2.6 characters for a number of the fewest bits."""
    numbers = sum(column.values.size for column in columns if column.values.dtype.kind == "f")
    return min(0.9, max(0.05, 1.05 * budget / (2.6 * max(numbers, 1))))


# -- data of the page's scripts


def page_data(contents: PageContents, packed_columns: list[Packed], page_grid: Grid) -> dict:
    """Return the map as a JSON object for the page's scripts, without the packed bytes.

    Args:
        contents: texts and description of the page.
        packed_columns: the columns.
        page_grid: dimension → indices of the map's values that the page has.
    """
    description = contents.map
    flat = (name for name, coordinate in description.coordinates.items() if len(coordinate.dims) <= 1)
    names = dict.fromkeys([*page_grid, *flat])
    return {
        "title": description.title,
        "dims": [{"name": dim, "size": len(page_grid[dim]), "of": description.sizes[dim]} for dim in page_grid],
        "coordinates": {name: _coordinate_data(description, name, page_grid) for name in names},
        "variables": [_variable_data(description, column, k) for k, column in enumerate(packed_columns)],
        "start": _start_data(contents, page_grid),
        **_appearance_data(description),
        "seriesColors": [colors.in_light(color) for color in colors.SERIES_COLORS],
        "table": contents.system_page.table,
        "cloud": description.own_of_points or None,
        **contents.system_page.facts,
    }


def _appearance_data(description: MapDescription) -> dict:
    """Return meanings of flags in words and colours, and symbols of parameters, of the map's system."""
    appearance = description.presentation.appearance
    columns = {**description.variables, **description.coordinates}
    words = {word for column in columns.values() for word in flags(column).values()}
    return {
        "words": {word: appearance.words(word) for word in sorted(words)},
        "colors": {word: color for word in sorted(words) if (color := colors.in_light(appearance.color(word)))},
        "symbols": {name: symbol.text for name, symbol in appearance.symbols.items()},
    }


def _coordinate_data(description: MapDescription, name: str, page_grid) -> dict:
    """Return values and attributes of a coordinate along one dimension (or none); numbers if there is no coordinate."""
    if name not in description.coordinates:
        words = {"units": "", "longName": name, "comment": ""}
        return {"dim": name, "values": page_grid[name].tolist(), "numeric": False, **words}
    coordinate = description.coordinates[name]
    dim = coordinate.dims[0] if coordinate.dims else None
    values = coordinate.values[page_grid[dim]] if dim else coordinate.values.reshape(1)
    kind = coordinate.dtype.kind
    entries = [_json_number(v) if kind in NUMBERS else str(v) for v in values.tolist()]
    words = _column_words(coordinate) | {"typed": name == description.named_along}  # by the author of the definition
    return {"dim": dim, "values": entries, "numeric": kind in "fiu", "whole": kind in "iu", **words}


def _variable_data(description: MapDescription, column: Packed, k: int) -> dict:
    """Return the facts that the page needs of one variable: packing, words, and related variables."""
    facts = {key: value for key, value in asdict(column).items() if key != "text"}
    spec = description.specs.get(column.name)
    relations = {kind: getattr(spec, kind, "") for kind in ("role", "theory", "exact", "error")}
    relations |= {} if spec is None or spec.references else {"theory": "", "exact": ""}
    relations |= {"role": "coordinate"} if column.name in description.coordinates else {}
    return facts | _column_words(description.columns[column.name]) | {"id": k, **relations}


def _column_words(column: "xr.DataArray") -> dict:
    meanings = [{"value": value, "meaning": meaning} for value, meaning in flags(column).items()]
    words = {"units": units_of(column), "longName": long_name(column), "comment": str(column.attrs.get("comment", ""))}
    return words | {"flags": meanings}


def _json_number(value):
    """Return a number for JSON, which has no NaN and no infinity: null."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _start_data(contents: PageContents, page_grid) -> dict:
    """Return the point at which the page begins: the system's, else middle real numbers and first further values."""
    description, opening = contents.map, contents.opening
    middle = {dim: (len(v) - 1) // 2 if dim in description.real_dimensions else 0 for dim, v in page_grid.items()}
    values = {dim: description.coordinates[dim].values[page_grid[dim]] for dim in opening.at if dim in page_grid}
    index = {dim: int(np.argmin(np.abs(coordinates - opening.at[dim]))) for dim, coordinates in values.items()}
    is_complete = all(len(values) == 1 or dim in opening.at for dim, values in page_grid.items())
    link = urllib.parse.urlencode(definition_of(description.attributes).get("start_at") or {})
    return {"plane": list(opening.plane), "index": middle | index, "whole": is_complete, "link": link}


# -- the page


def _read_asset(name: str) -> str:
    return (files("sweeps.views") / "page" / name).read_text(encoding="utf-8")


def _system_texts(page: Page, kind: str, is_first: bool | None = None) -> list[str]:
    """Return a system's files of one kind for the page: all, those of the first screen, or those that follow it."""
    paths = (path for path in page.files if path.suffix == kind and is_first in (None, path.stem == "first"))
    return [path.read_text(encoding="utf-8") for path in paths]


def _policy_hash(script: str) -> str:
    """Return a script's name in the page's content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode('utf-8')).digest()).decode('ascii')}'"


def _render_page(contents: PageContents, packed_columns: list[Packed], page_grid) -> str:
    """Return the page's HTML from its template, with styles, scripts and packed columns."""
    description, system_page = contents.map, contents.system_page
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    appearance = description.presentation.appearance
    environment.filters |= {"number": _format_value, "share": format_share, "words": appearance.words}
    columns = {**description.variables, **description.coordinates}
    environment.filters["long_name"] = lambda name: long_name(columns[name])
    scripts = _system_texts(system_page, ".js") or [_read_asset("part.js")]
    program = '"use strict";\n' + "\n".join((*map(_read_asset, FIRST_SCRIPTS), *scripts, _read_asset("main.js")))
    template = environment.from_string(_read_asset("report.html"))
    return template.render(
        policy=f"{_policy_hash(program)} 'sha256-{plotly.digest()}'",
        style=Markup("\n".join((_read_asset("style.css"), *_system_texts(system_page, ".css")))),
        first=Markup("\n".join(_system_texts(system_page, ".html", True))),
        sections=Markup("\n".join(_system_texts(system_page, ".html", False))),
        program=Markup(program),
        plotly=plotly.deflated(),
        payload=htmlsafe_json_dumps(page_data(contents, packed_columns, page_grid), **JSON_OPTIONS),
        columns=[column.text for column in packed_columns],
        question=system_page.question,
        keys=system_page.keys,
        table=system_page.table,
        cloud=POINT.name in description.sizes,
        **_page_texts(description, contents.summary, page_grid),
    )


def _page_texts(description: MapDescription, summary: Summary, page_grid) -> dict:
    """Return the values that the page's template writes: texts, numbers and lists, no figures.

    ``product`` lists dimensions and their sizes, ``thinned`` those of which the page has fewer values, ``confusion``
    the measured against the theoretical regimes, ``checks`` each check's worst value with its point, ``certificates``
    those among them that bound an error, and ``agreements`` the deviations of measured from theoretical values.
    """
    sizes, definition = description.sizes, description.definition
    return {
        "title": description.title or "A stability map",
        "about": [text for text in comment_paragraphs(definition)[:2] if "`" not in text],  # none about its own keys
        "definition": definition,
        "attributes": {k: str(v) for k, v in description.attributes.items() if k not in ("definition", "title")},
        "points": summary.points,
        "product": [(dim, n) for dim, n in sizes.items() if n > 1],
        "shown": math.prod(len(values) for values in page_grid.values()),
        "thinned": [(dim, len(page_grid[dim]), n) for dim, n in sizes.items() if len(page_grid[dim]) < n],
        "counts": summary.counts,
        "confusion": [_confusion_table(summary, pair, table) for pair, table in summary.confusion.items()],
        "checks": [(name, worst, _format_place(description, worst.at)) for name, worst in summary.checks.items()],
        "certificates": [name for name in summary.checks if description.specs[name].role == Role.CERTIFICATE],
        "agreements": [deviation for deviation in summary.deviations.values() if deviation.total],
        "rule": comparison_rule(summary),
    }


def comment_paragraphs(definition: str) -> list[str]:
    """Return the paragraphs of the comment with which a definition begins, before or after its title."""
    lines = []
    for line in definition.splitlines():
        if line.startswith("#"):
            lines.append(line.lstrip("#").strip())
        elif lines or not line.startswith("title:"):
            break
    return [" ".join(paragraph.split()) for paragraph in "\n".join(lines).split("\n\n") if paragraph.strip()]


def _format_place(description: MapDescription, at: Mapping[str, int]) -> list[tuple]:
    return [(dim, value) for dim, value in description.place(at).items() if description.sizes.get(dim) != 1]


def _confusion_table(summary: Summary, pair, table: np.ndarray) -> dict:
    """Return the rows and columns of two flags' common counts for the page."""
    reference, name = pair
    rows, columns = list(summary.counts[reference]), list(summary.counts[name])
    nonempty = [j for j in range(len(columns)) if table[:, j].any()]
    return {
        "names": pair,
        "columns": [columns[j] for j in nonempty],
        "rows": [(word, [(int(table[i, j]), columns[j] == word) for j in nonempty]) for i, word in enumerate(rows)],
        "agreed": summary.num_equal(reference, name),
        "total": int(table.sum()),
    }


def _format_value(value) -> str:
    """Return a value as text: integers with thousands separators, real numbers with four digits."""
    if isinstance(value, int):
        return f"{value:,}"
    return wording.format_number(value, 4) if isinstance(value, float) and math.isfinite(value) else str(value)
