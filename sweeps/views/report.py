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
from typing import TYPE_CHECKING

import jinja2
import numpy as np
from jinja2.utils import htmlsafe_json_dumps  # JSON that cannot end the element in which it stands
from markupsafe import Markup

from sweeps.figure import colors
from sweeps.figure import style as figure_style
from sweeps.maps.description import ColumnDescription, MapDescription, describe_map
from sweeps.maps.summary import Summary, rule, share
from sweeps.process.files import replace_output
from sweeps.reading.definitions import definition_of
from sweeps.schema.variables import POINT, Role
from sweeps.systems.presentation import Opening, Page
from sweeps.views import plotly
from sweeps.views.report_columns import Packed, PageColumn, fewer, gather, pack_within, scaling_laws

if TYPE_CHECKING:
    import xarray as xr

LIMIT = 8_000_000  # bytes of a page
JSON = {"allow_nan": False, "ensure_ascii": False, "separators": (",", ":")}
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

    map: MapDescription
    part: Page  #: of the map's system
    opening: Opening  #: where the page begins, given by the map's system
    summary: Summary


def write(ds: "xr.Dataset", path: str | Path, limit: int = LIMIT) -> None:
    """Write the report of a map, which is read once, box by box, so that it may exceed the memory.

    Args:
        ds: a map, from `sweeps.open_map` or `sweeps.survey`.
        path: the HTML file, replaced once the new one is whole.
        limit: bytes that the file may have; a map that does not fit is thinned, and the page says so.

    Raises:
        ValueError: where not even a thinned map fits into `limit`.
    """
    described = describe_map(ds)
    part, opening = described.presentation.page(ds), described.presentation.opening(ds)
    summary, columns, kept = gather(ds, described)
    contents = Contents(described, part, opening, summary)
    packed, kept = _fitted(contents, columns, kept, limit)
    page = _page(contents, packed, kept)
    with replace_output(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _fitted(contents: Contents, columns, kept, limit: int) -> tuple[list[Packed], dict[str, np.ndarray]]:
    """Return columns packed into a page of `limit` bytes, with fewer and fewer points until they fit."""
    while True:
        laws = scaling_laws(contents.map, columns, kept)
        budget = limit - _frame(contents, laws, kept)
        packed = pack_within(laws, budget)
        if packed is not None:
            return packed, kept
        points = math.prod(len(values) for values in kept.values())
        if points == 1:
            raise ValueError(f"limit: no point of this map fits into a page of {limit:,} bytes")
        columns, kept = fewer(contents.map, columns, kept, max(1, int(points * _share(laws, budget))))


def _frame(contents: Contents, columns: list[PageColumn], kept) -> int:
    """Return bytes of a page but for its columns."""
    empty = [Packed(c.name, c.values.shape, c.powers, "f8", -1000, 6, "") for c in columns]
    return len(_page(contents, empty, kept).encode("utf-8"))


def _share(columns: list[PageColumn], budget: int) -> float:
    """Return the share of the points that fits a budget, at the two bytes or so that a short number takes as text."""
    numbers = sum(column.values.size for column in columns if column.values.dtype.kind == "f")
    return min(0.9, max(0.05, 1.05 * budget / (2.6 * max(numbers, 1))))


# -- what the page's scripts get


def payload(contents: Contents, packed: list[Packed], kept: Mapping[str, np.ndarray]) -> dict:
    """Return the map as JSON for the page's scripts, without the packed bytes."""
    described = contents.map
    flat = (name for name, one in described.coordinates.items() if len(one.dims) <= 1)
    return {
        "title": described.title,
        "dims": [{"name": dim, "size": len(kept[dim]), "of": described.sizes[dim]} for dim in kept],
        "coordinates": {name: _coordinate(described, name, kept) for name in dict.fromkeys([*kept, *flat])},
        "variables": [_variable(described, column, k) for k, column in enumerate(packed)],
        "start": _start(contents, kept),
        **_look(described),
        "seriesColors": [colors.in_light(color) for color in colors.SERIES_COLORS],
        "table": contents.part.table,
        "cloud": described.own_of_points or None,
        **contents.part.facts,
    }


def _look(described: MapDescription) -> dict:
    """Return meanings of flags in words and colours, and symbols of parameters, of the map's system."""
    look = described.presentation.look
    every = described.variables | described.coordinates
    words = {word for one in every.values() for word in one.flags.values()}
    return {
        "words": {word: look.words(word) for word in sorted(words)},
        "colors": {word: color for word in sorted(words) if (color := colors.in_light(look.color(word)))},
        "symbols": {name: symbol.text for name, symbol in look.symbols.items()},
    }


def _coordinate(described: MapDescription, name: str, kept) -> dict:
    """Return values and attributes of a coordinate along one dimension (or none); numbers if there is no coordinate."""
    if name not in described.coordinates:
        words = {"units": "", "longName": name, "comment": ""}
        return {"dim": name, "values": kept[name].tolist(), "numeric": False, **words}
    coordinate = described.coordinates[name]
    dim = coordinate.dims[0] if coordinate.dims else None
    values = coordinate.values[kept[dim]] if dim else coordinate.values.reshape(1)
    kind = coordinate.kind
    plain = [_number(v) for v in values.tolist()] if kind in "fiub" else [str(v) for v in values.tolist()]
    typed = name == described.named_along  # names by whoever wrote the definition
    words = _words(coordinate) | {"typed": typed}
    return {"dim": dim, "values": plain, "numeric": kind in "fiu", "whole": kind in "iu", **words}


def _variable(described: MapDescription, column: Packed, k: int) -> dict:
    packed = {key: value for key, value in asdict(column).items() if key != "text"}
    spec = described.specs.get(column.name)
    relations = {kind: getattr(spec, kind, "") for kind in ("role", "theory", "exact", "error")}
    relations |= {} if spec is None or spec.references else {"theory": "", "exact": ""}
    relations |= {"role": "coordinate"} if column.name in described.coordinates else {}
    return packed | _words(described.columns[column.name]) | {"id": k, **relations}


def _words(column: ColumnDescription) -> dict:
    flags = [{"value": value, "meaning": meaning} for value, meaning in column.flags.items()]
    return {"units": column.units, "longName": column.long_name, "comment": column.comment, "flags": flags}


def _number(value):
    """Return a number for JSON, which knows no NaN and no infinity."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _start(contents: Contents, kept) -> dict:
    """Return where the page begins: given by the map's system, else amid real numbers and at the first of others."""
    described, opening = contents.map, contents.opening
    middle = {dim: (len(v) - 1) // 2 if dim in described.real_dimensions else 0 for dim, v in kept.items()}
    values = {dim: described.coordinates[dim].values[kept[dim]] for dim in opening.at if dim in kept}
    index = {dim: int(np.argmin(np.abs(along - opening.at[dim]))) for dim, along in values.items()}
    whole = all(len(values) == 1 or dim in opening.at for dim, values in kept.items())
    link = urllib.parse.urlencode(definition_of(described.attributes).get("start_at") or {})
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


def _page(contents: Contents, packed: list[Packed], kept) -> str:
    described, part = contents.map, contents.part
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters |= {"number": _text, "share": share, "words": described.presentation.look.words}
    environment.filters["long_name"] = described.long_name
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
        payload=htmlsafe_json_dumps(payload(contents, packed, kept), **JSON),
        columns=[column.text for column in packed],
        question=part.question,
        keys=part.keys,
        table=part.table,
        cloud=POINT.name in described.sizes,
        **_said(described, contents.summary, kept),
    )


def _said(described: MapDescription, summary: Summary, kept) -> dict:
    """Return the texts and tables of the page."""
    sizes, definition = described.sizes, described.definition
    return {
        "title": described.title or "A stability map",
        "about": [text for text in paragraphs(definition)[:2] if "`" not in text],  # not those about its own keys
        "definition": definition,
        "attributes": {k: str(v) for k, v in described.attributes.items() if k not in ("definition", "title")},
        "points": summary.points,
        "product": [(dim, n) for dim, n in sizes.items() if n > 1],
        "shown": math.prod(len(values) for values in kept.values()),
        "thinned": [(dim, len(kept[dim]), n) for dim, n in sizes.items() if len(kept[dim]) < n],
        "counts": summary.counts,
        "confusion": [_confusion(summary, pair, table) for pair, table in summary.confusion.items()],
        "checks": [(name, worst, _where(described, worst.at)) for name, worst in summary.checks.items()],
        "certificates": [name for name in summary.checks if summary.role(name) == Role.CERTIFICATE],
        "agreements": [deviation for deviation in summary.deviations.values() if deviation.total],
        "rule": rule(summary),
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


def _where(described: MapDescription, at: Mapping[str, int]) -> list[tuple]:
    return [(dim, value) for dim, value in described.place(at).items() if described.sizes.get(dim) != 1]


def _confusion(summary: Summary, pair, table: np.ndarray) -> dict:
    reference, name = pair
    rows, columns = list(summary.counts[reference]), list(summary.counts[name])
    used = [j for j in range(len(columns)) if table[:, j].any()]
    return {
        "names": pair,
        "columns": [columns[j] for j in used],
        "rows": [(word, [(int(table[i, j]), columns[j] == word) for j in used]) for i, word in enumerate(rows)],
        "agreed": summary.agreed(reference, name),
        "total": int(table.sum()),
    }


def _text(value) -> str:
    """Return a value as people write it: whole numbers with commas, others with up to six digits."""
    if isinstance(value, int):
        return f"{value:,}"
    return figure_style.number(value, 4) if isinstance(value, float) and math.isfinite(value) else str(value)
