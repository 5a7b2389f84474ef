"""The report of a map: one HTML file that works offline, with the map to explore and the motion of each point.

The page asks no network for anything and runs no script but those written here: its content security policy
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
from jinja2.utils import htmlsafe_json_dumps  # JSON that cannot end the element in which it stands
from markupsafe import Markup

from sweeps.figure import colors, wording
from sweeps.maps.description import ColumnDescription, MapDescription, describe_map
from sweeps.maps.summary import Summary, comparison_rule, format_share
from sweeps.process.files import replace_output
from sweeps.reading.definitions import definition_of
from sweeps.schema.variables import POINT, Role
from sweeps.systems.presentation import Opening, Page
from sweeps.views import plotly
from sweeps.views.report_columns import (
    Columns,
    Grid,
    Packed,
    PageColumn,
    gather,
    pack_within,
    scaling_laws,
    thin_columns,
)

if TYPE_CHECKING:
    import xarray as xr

LIMIT = 8_000_000  # bytes of a page
JSON: dict[str, Any] = {"allow_nan": False, "ensure_ascii": False, "separators": (",", ":")}
# before those of a map's own system; main.js is the last
SCRIPTS = (
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
class Contents:
    """All that a page says of a map but for its packed columns."""

    part: Page  #: of the map's system
    opening: Opening  #: where the page begins, given by the map's system
    summary: Summary

    @property
    def map(self) -> MapDescription:
        """Return the description of the map."""
        return self.summary.description


def write(ds: "xr.Dataset", path: str | Path, limit: int = LIMIT) -> None:
    """Write the report of a map, which is read once, box by box, so that it may exceed the memory.

    Args:
        ds: a map, from `sweeps.open_map` or `sweeps.survey`.
        path: the HTML file, replaced once the new one is whole.
        limit: bytes that the file may have; a map that does not fit is thinned, and the page says so.

    Raises:
        ValueError: where not even a thinned map fits into `limit`.
    """
    description = describe_map(ds)
    part, opening = description.presentation.page(ds), description.presentation.opening(ds)
    summary, columns, page_grid = gather(ds, description)
    contents = Contents(part, opening, summary)
    packed_columns, page_grid = _fit_columns(contents, columns, page_grid, limit)
    page = _page(contents, packed_columns, page_grid)
    with replace_output(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _fit_columns(contents: Contents, columns: Columns, page_grid: Grid, limit: int) -> tuple[list[Packed], Grid]:
    """Return columns packed into a page of `limit` bytes, with fewer and fewer points until they fit."""
    while True:
        laws = scaling_laws(contents.map, columns, page_grid)
        budget = limit - _frame(contents, laws, page_grid)
        packed_columns = pack_within(laws, budget)
        if packed_columns is not None:
            return packed_columns, page_grid
        points = math.prod(len(values) for values in page_grid.values())
        if points == 1:
            raise ValueError(f"limit: no point of this map fits into a page of {limit:,} bytes")
        columns, page_grid = thin_columns(contents.map, columns, page_grid, max(1, int(points * _share(laws, budget))))


def _frame(contents: Contents, columns: list[PageColumn], page_grid) -> int:
    """Return bytes of a page but for its columns."""
    empty = [Packed(c.name, c.values.shape, c.powers, "f8", -1000, 6, "") for c in columns]
    return len(_page(contents, empty, page_grid).encode("utf-8"))


def _share(columns: list[PageColumn], budget: int) -> float:
    """Return the share of the points that fits a budget, at the two bytes or so that a short number takes as text."""
    numbers = sum(column.values.size for column in columns if column.values.dtype.kind == "f")
    return min(0.9, max(0.05, 1.05 * budget / (2.6 * max(numbers, 1))))


# -- what the page's scripts get


def payload(contents: Contents, packed_columns: list[Packed], page_grid: Grid) -> dict:
    """Return the map as JSON for the page's scripts, without the packed bytes."""
    description = contents.map
    flat = (name for name, coordinate in description.coordinates.items() if len(coordinate.dims) <= 1)
    return {
        "title": description.title,
        "dims": [{"name": dim, "size": len(page_grid[dim]), "of": description.sizes[dim]} for dim in page_grid],
        "coordinates": {name: _coordinate(description, name, page_grid) for name in dict.fromkeys([*page_grid, *flat])},
        "variables": [_variable(description, column, k) for k, column in enumerate(packed_columns)],
        "start": _start(contents, page_grid),
        **_look(description),
        "seriesColors": [colors.in_light(color) for color in colors.SERIES_COLORS],
        "table": contents.part.table,
        "cloud": description.own_of_points or None,
        **contents.part.facts,
    }


def _look(description: MapDescription) -> dict:
    """Return meanings of flags in words and colours, and symbols of parameters, of the map's system."""
    appearance = description.presentation.appearance
    columns = description.variables | description.coordinates
    words = {word for column in columns.values() for word in column.flags.values()}
    return {
        "words": {word: appearance.words(word) for word in sorted(words)},
        "colors": {word: color for word in sorted(words) if (color := colors.in_light(appearance.color(word)))},
        "symbols": {name: symbol.text for name, symbol in appearance.symbols.items()},
    }


def _coordinate(description: MapDescription, name: str, page_grid) -> dict:
    """Return values and attributes of a coordinate along one dimension (or none); numbers if there is no coordinate."""
    if name not in description.coordinates:
        words = {"units": "", "longName": name, "comment": ""}
        return {"dim": name, "values": page_grid[name].tolist(), "numeric": False, **words}
    coordinate = description.coordinates[name]
    dim = coordinate.dims[0] if coordinate.dims else None
    values = coordinate.values[page_grid[dim]] if dim else coordinate.values.reshape(1)
    kind = coordinate.kind
    entries = [_number(v) if kind in "fiub" else str(v) for v in values.tolist()]
    words = _words(coordinate) | {"typed": name == description.named_along}  # by whoever wrote the definition
    return {"dim": dim, "values": entries, "numeric": kind in "fiu", "whole": kind in "iu", **words}


def _variable(description: MapDescription, column: Packed, k: int) -> dict:
    packing = {key: value for key, value in asdict(column).items() if key != "text"}
    spec = description.specs.get(column.name)
    relations = {kind: getattr(spec, kind, "") for kind in ("role", "theory", "exact", "error")}
    relations |= {} if spec is None or spec.references else {"theory": "", "exact": ""}
    relations |= {"role": "coordinate"} if column.name in description.coordinates else {}
    return packing | _words(description.columns[column.name]) | {"id": k, **relations}


def _words(column: ColumnDescription) -> dict:
    flags = [{"value": value, "meaning": meaning} for value, meaning in column.flags.items()]
    return {"units": column.units, "longName": column.long_name, "comment": column.comment, "flags": flags}


def _number(value):
    """Return a number for JSON, which knows no NaN and no infinity."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _start(contents: Contents, page_grid) -> dict:
    """Return where the page begins: given by the map's system, else amid real numbers and at the first of others."""
    description, opening = contents.map, contents.opening
    middle = {dim: (len(v) - 1) // 2 if dim in description.real_dimensions else 0 for dim, v in page_grid.items()}
    values = {dim: description.coordinates[dim].values[page_grid[dim]] for dim in opening.at if dim in page_grid}
    index = {dim: int(np.argmin(np.abs(along - opening.at[dim]))) for dim, along in values.items()}
    whole = all(len(values) == 1 or dim in opening.at for dim, values in page_grid.items())
    link = urllib.parse.urlencode(definition_of(description.attributes).get("start_at") or {})
    return {"plane": list(opening.plane), "index": middle | index, "whole": whole, "link": link}


# -- the page


def _asset(name: str) -> str:
    return (files("sweeps.views") / "page" / name).read_text(encoding="utf-8")


def _texts(page: Page, kind: str, is_first: bool | None = None) -> list[str]:
    """Return a system's files of one kind for the page; all, or those of the first screen, or others."""
    paths = (path for path in page.files if path.suffix == kind and is_first in (None, path.stem == "first"))
    return [path.read_text(encoding="utf-8") for path in paths]


def _hash(script: str) -> str:
    """Return a script's name in the page's content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode('utf-8')).digest()).decode('ascii')}'"


def _page(contents: Contents, packed_columns: list[Packed], page_grid) -> str:
    description, part = contents.map, contents.part
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters |= {"number": _text, "share": format_share, "words": description.presentation.appearance.words}
    environment.filters["long_name"] = description.long_name
    scripts = _texts(part, ".js") or [_asset("part.js")]
    program = '"use strict";\n' + "\n".join((*map(_asset, SCRIPTS), *scripts, _asset("main.js")))
    template = environment.from_string(_asset("report.html"))
    return template.render(
        policy=f"{_hash(program)} 'sha256-{plotly.digest()}'",
        style=Markup("\n".join((_asset("style.css"), *_texts(part, ".css")))),
        first=Markup("\n".join(_texts(part, ".html", True))),
        sections=Markup("\n".join(_texts(part, ".html", False))),
        program=Markup(program),
        plotly=plotly.deflated(),
        payload=htmlsafe_json_dumps(payload(contents, packed_columns, page_grid), **JSON),
        columns=[column.text for column in packed_columns],
        question=part.question,
        keys=part.keys,
        table=part.table,
        cloud=POINT.name in description.sizes,
        **_page_texts(description, contents.summary, page_grid),
    )


def _page_texts(description: MapDescription, summary: Summary, page_grid) -> dict:
    """Return the texts and tables of the page."""
    sizes, definition = description.sizes, description.definition
    return {
        "title": description.title or "A stability map",
        "about": [text for text in paragraphs(definition)[:2] if "`" not in text],  # not those about its own keys
        "definition": definition,
        "attributes": {k: str(v) for k, v in description.attributes.items() if k not in ("definition", "title")},
        "points": summary.points,
        "product": [(dim, n) for dim, n in sizes.items() if n > 1],
        "shown": math.prod(len(values) for values in page_grid.values()),
        "thinned": [(dim, len(page_grid[dim]), n) for dim, n in sizes.items() if len(page_grid[dim]) < n],
        "counts": summary.counts,
        "confusion": [_confusion(summary, pair, table) for pair, table in summary.confusion.items()],
        "checks": [(name, worst, _place_of(description, worst.at)) for name, worst in summary.checks.items()],
        "certificates": [name for name in summary.checks if summary.role(name) == Role.CERTIFICATE],
        "agreements": [deviation for deviation in summary.deviations.values() if deviation.total],
        "rule": comparison_rule(summary),
    }


def paragraphs(definition: str) -> list[str]:
    """Return the paragraphs of the comment with which a definition begins, before or after its title."""
    lines = []
    for line in definition.splitlines():
        if line.startswith("#"):
            lines.append(line.lstrip("#").strip())
        elif lines or not line.startswith("title:"):
            break
    return [" ".join(part.split()) for part in "\n".join(lines).split("\n\n") if part.strip()]


def _place_of(description: MapDescription, at: Mapping[str, int]) -> list[tuple]:
    return [(dim, value) for dim, value in description.place(at).items() if description.sizes.get(dim) != 1]


def _confusion(summary: Summary, pair, table: np.ndarray) -> dict:
    reference, name = pair
    rows, columns = list(summary.counts[reference]), list(summary.counts[name])
    used = [j for j in range(len(columns)) if table[:, j].any()]
    return {
        "names": pair,
        "columns": [columns[j] for j in used],
        "rows": [(word, [(int(table[i, j]), columns[j] == word) for j in used]) for i, word in enumerate(rows)],
        "agreed": summary.num_equal(reference, name),
        "total": int(table.sum()),
    }


def _text(value) -> str:
    """Return a value as people write it: whole numbers with commas, others with up to six digits."""
    if isinstance(value, int):
        return f"{value:,}"
    return wording.format_number(value, 4) if isinstance(value, float) and math.isfinite(value) else str(value)
