"""The report of a map: one HTML file that works offline, with the map to explore and the motion of each point.

The page asks no network for anything and runs no script but those written here: its content security policy
names each by its hash. All text that comes from the file is escaped by the template or set as text by the page.
"""

import base64
import hashlib
import math
import urllib.parse
from collections.abc import Mapping
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import jinja2
import numpy as np
from jinja2.utils import htmlsafe_json_dumps  # JSON that cannot end the element in which it stands
from markupsafe import Markup

from sweeps import systems
from sweeps.figure import colors
from sweeps.figure import style as figure_style
from sweeps.maps.summary import Summary, place, pointwise, read, rule, share, specifications
from sweeps.process.files import replaced
from sweeps.reading.definitions import definition_of
from sweeps.schema.boxes import blocks, dimensions, flags, own_of_points
from sweeps.schema.variables import Role
from sweeps.systems.presentation import Page
from sweeps.views import plotly
from sweeps.views.report_columns import (
    BLOCK_POINTS,
    MOST_POINTS,
    Gatherer,
    Packed,
    PageColumn,
    is_number,
    pack_within,
    reduced,
    thinned,
)

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


def write(ds: "xr.Dataset", path: str | Path, limit: int = LIMIT) -> None:
    """Write the report of a map, which is read once, box by box, so that it may exceed the memory.

    Args:
        ds: a map, from `sweeps.open_map` or `sweeps.survey`.
        path: the HTML file, replaced once the new one is whole.
        limit: bytes that the file may have; a map that does not fit is thinned, and the page says so.

    Raises:
        ValueError: where not even a thinned map fits into `limit`.
    """
    part = systems.presentation_of(ds).page(ds)  # which may show what `pointwise` leaves out
    ds = pointwise(ds)
    summary, columns, kept = _gather(ds)
    packed, kept = _fitted(ds, part, summary, columns, kept, limit)
    page = _page(ds, part, summary, packed, kept)
    with replaced(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


# -- reading


def _gather(ds: "xr.Dataset") -> tuple[Summary, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Read a map once: return its totals, and the columns at the points that a page can hold at most."""
    sizes = dimensions(ds)
    kept = thinned(sizes, _numeric(ds, sizes), MOST_POINTS)
    beside = [name for name in ds.coords if ds[name].ndim > 1]
    names = [name for name in (*ds.data_vars, *beside) if is_number(ds[name])]
    gatherer, summary = Gatherer(ds, names, kept), Summary(ds)
    for box in blocks(sizes, BLOCK_POINTS):
        values = {name: read(ds, name, box) for name in names}
        summary.add(box, {name: values[name] for name in names if name in ds.data_vars})
        for name in names:
            gatherer.add(box, name, values[name])
    return summary, gatherer.columns, kept


def _numeric(ds: "xr.Dataset", dims) -> set[str]:
    """Return dimensions along which values of a real parameter stand."""
    return {dim for dim in dims if dim in ds.coords and ds[dim].dtype.kind == "f"}


def _fitted(ds, part: Page, summary: Summary, columns, kept, limit: int) -> tuple[list[Packed], dict[str, np.ndarray]]:
    """Return columns packed into a page of `limit` bytes, with fewer and fewer points until they fit."""
    while True:
        scales = {dim: _scale(ds, dim, indices) for dim, indices in kept.items()}
        laws = [reduced(name, values, scales, name in ds.coords) for name, values in columns.items()]
        budget = limit - _frame(ds, part, summary, laws, kept)
        packed = pack_within(laws, budget)
        if packed is not None:
            return packed, kept
        points = math.prod(len(values) for values in kept.values())
        if points == 1:
            raise ValueError(f"limit: no point of this map fits into a page of {limit:,} bytes")
        columns, kept = _fewer(ds, columns, kept, max(1, int(points * _share(laws, budget))))


def _frame(ds, part: Page, summary: Summary, columns: list[PageColumn], kept) -> int:
    """Return bytes of a page but for its columns."""
    empty = [Packed(c.name, c.values.shape, c.powers, "f8", -1000, 6, "") for c in columns]
    return len(_page(ds, part, summary, empty, kept).encode("utf-8"))


def _scale(ds, dim: str, indices) -> np.ndarray | None:
    """Return magnitudes of a dimension's values, where laws may hold in them."""
    if dim not in ds.coords or ds[dim].dtype.kind != "f":
        return None
    values = np.abs(ds[dim].values[indices])
    return values if np.isfinite(values).all() and (values > 1e-100).all() and (values < 1e100).all() else None


def _share(columns: list[PageColumn], budget: int) -> float:
    """Return the share of the points that fits a budget, at the two bytes or so that a short number takes as text."""
    numbers = sum(column.values.size for column in columns if column.values.dtype.kind == "f")
    return min(0.9, max(0.05, 1.05 * budget / (2.6 * max(numbers, 1))))


def _fewer(ds, columns, kept, points: int):
    sizes = {dim: len(indices) for dim, indices in kept.items()}
    chosen = thinned(sizes, _numeric(ds, sizes), points)
    columns = dict(columns)
    for name, values in columns.items():
        for k, indices in enumerate(chosen.values()):
            if values.shape[k] > 1:
                values = np.take(values, indices, axis=k)
        columns[name] = values
    return columns, {dim: kept[dim][indices] for dim, indices in chosen.items()}


# -- what the page's scripts get


def payload(ds: "xr.Dataset", page: Page, packed: list[Packed], kept: Mapping[str, np.ndarray]) -> dict:
    """Return the map as JSON for the page's scripts, without the packed bytes."""
    return {
        "title": str(ds.attrs.get("title", "")),
        "dims": [{"name": dim, "size": len(kept[dim]), "of": ds.sizes[dim]} for dim in kept],
        "coordinates": {n: _coordinate(ds, n, kept) for n in _coordinates(ds, kept)},
        "variables": [_variable(ds, column, k) for k, column in enumerate(packed)],
        "start": _start(ds, kept),
        **_look(ds),
        "seriesColors": colors.SERIES_COLORS,
        "table": page.table,
        "cloud": (own_of_points(ds) or None) if "point" in kept else None,
        **page.facts,
    }


def _look(ds) -> dict:
    """Return meanings of flags in words and colours, and symbols of parameters, of the map's system."""
    look = systems.presentation_of(ds).look
    words = {word for name in ds.variables for word in flags(ds[name]).values()}
    return {
        "words": {word: look.words(word) for word in sorted(words)},
        "colors": {word: color for word in sorted(words) if (color := look.color(word))},
        "symbols": {name: symbol.text for name, symbol in look.symbols.items()},
    }


def _coordinates(ds, kept) -> list[str]:
    return [*kept, *(name for name in ds.coords if ds[name].ndim <= 1 and name not in kept)]


def _coordinate(ds, name: str, kept) -> dict:
    """Return values and attributes of a coordinate along one dimension (or none); numbers if there is no coordinate."""
    if name not in ds.coords:
        return {"dim": name, "values": kept[name].tolist(), "numeric": False, **_words({}, name)}
    variable = ds[name]
    dim = variable.dims[0] if variable.dims else None
    values = variable.values[kept[dim]] if dim else variable.values.reshape(1)
    kind = values.dtype.kind
    plain = [_number(v) for v in values.tolist()] if kind in "fiub" else [str(v) for v in values.tolist()]
    described = _words(variable.attrs, name) | {"flags": _flag_list(variable)}
    described["typed"] = name == systems.of_map(ds).layout().along  # names by whoever wrote the definition
    return {"dim": dim, "values": plain, "numeric": kind in "fiu", "whole": kind in "iu", **described}


def _variable(ds, column: Packed, k: int) -> dict:
    described = {key: value for key, value in asdict(column).items() if key != "text"}
    spec = specifications(ds).get(column.name)
    relations = {kind: getattr(spec, kind, "") for kind in ("role", "theory", "exact", "error")}
    relations |= {} if spec is None or spec.references else {"theory": "", "exact": ""}
    relations |= {"role": "coordinate"} if column.name in ds.coords else {}
    return (
        described
        | _words(ds[column.name].attrs, column.name)
        | {"flags": _flag_list(ds[column.name]), "id": k, **relations}
    )


def _words(attributes: Mapping, name: str) -> dict:
    units = str(attributes.get("units", "1"))
    return {
        "units": units if units != "1" else "",
        "longName": str(attributes.get("long_name", name)),
        "comment": str(attributes.get("comment", "")),
    }


def _flag_list(variable: "xr.DataArray") -> list[dict]:
    return [{"value": value, "meaning": meaning} for value, meaning in flags(variable).items()]


def _number(value):
    """Return a number for JSON, which knows no NaN and no infinity."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _start(ds, kept) -> dict:
    """Return where the page begins: given by the map's system, else amid real numbers and at the first of others."""
    opening = systems.presentation_of(ds).opening(ds)
    middle = {dim: (len(values) - 1) // 2 if dim in _numeric(ds, kept) else 0 for dim, values in kept.items()}
    index = {dim: int(np.argmin(np.abs(ds[dim].values[kept[dim]] - v))) for dim, v in opening.at.items() if dim in kept}
    whole = all(len(values) == 1 or dim in opening.at for dim, values in kept.items())
    link = urllib.parse.urlencode(definition_of(ds.attrs).get("start_at") or {})
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


def _page(ds, part: Page, summary: Summary, packed: list[Packed], kept) -> str:
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters |= {"number": _text, "share": share, "words": systems.presentation_of(ds).look.words}
    environment.filters["long_name"] = lambda name: str(ds[name].attrs.get("long_name", name))
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
        payload=htmlsafe_json_dumps(payload(ds, part, packed, kept), **JSON),
        columns=[column.text for column in packed],
        question=part.question,
        keys=part.keys,
        table=part.table,
        cloud="point" in ds.dims,
        **_said(ds, summary, kept),
    )


def _said(ds, summary: Summary, kept) -> dict:
    """Return the texts and tables of the page."""
    sizes = dimensions(ds)
    definition = str(ds.attrs.get("definition", ""))
    return {
        "title": str(ds.attrs.get("title", "")) or "A stability map",
        "about": [text for text in paragraphs(definition)[:2] if "`" not in text],  # not those about its own keys
        "definition": definition,
        "attributes": {k: str(v) for k, v in ds.attrs.items() if k not in ("definition", "title")},
        "points": summary.points,
        "product": [(dim, n) for dim, n in sizes.items() if n > 1],
        "shown": math.prod(len(values) for values in kept.values()),
        "thinned": [(dim, len(kept[dim]), n) for dim, n in sizes.items() if len(kept[dim]) < n],
        "counts": summary.counts,
        "confusion": [_confusion(summary, pair, table) for pair, table in summary.confusion.items()],
        "checks": [(name, worst, _where(ds, worst.at)) for name, worst in summary.checks.items()],
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


def _where(ds, at: Mapping[str, int]) -> list[tuple]:
    return [(dim, value) for dim, value in place(ds, at).items() if ds.sizes.get(dim) != 1]


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
