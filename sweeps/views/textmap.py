"""A map's flags as characters in a terminal, coloured where it has colours and legible where it has none."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sweeps import systems
from sweeps.maps.selection import Place, in_words
from sweeps.maps.summary import leading_flag
from sweeps.schema.boxes import dimensions, flags
from sweeps.systems.presentation.look import Look
from sweeps.views import textcloud
from sweeps.views.textplane import Panel, TextMap

if TYPE_CHECKING:
    import xarray as xr

MOST_ROWS = 24
NARROWEST = 4


def draw(ds: "xr.Dataset", places: dict[str, Place], width: int = 80) -> TextMap | None:
    """Draw the leading flag over two dimensions, one panel per spin axis or mode; return None where impossible.

    Names (of bodies, of equilibria) stand upwards; of numbers, the two dimensions that are longest make the plane.

    Args:
        ds: a map.
        places: where to stand along other dimensions; those not given stand in their middle.
        width: characters in a line.
    """
    flag = leading_flag(ds)
    sizes = {dim: size for dim, size in dimensions(ds).items() if size > 1 and dim not in places}
    whole = (dim for dim in sizes if ds[dim].dtype.kind in "iu" and dim != "point" and len(sizes) > 1)
    beside = next(whole, None)
    count = sizes.pop(beside) if beside else 1
    if not sizes or not flag:
        return None
    if "point" in sizes:
        return _cloud(ds, flag, places, beside, width)
    y, x = _plane(ds, sizes)
    drawn_dims = (x, y, beside)
    fixed = {dim: (n - 1) // 2 for dim, n in dimensions(ds).items() if dim not in drawn_dims}
    fixed |= {dim: place.index for dim, place in places.items()}
    values = ds[flag].isel(fixed).load()
    panels = [values.isel({beside: number}) for number in range(count)] if beside else [values]
    room = (width - _label_width(ds, y) - 2 * (len(panels) - 1)) // len(panels)
    columns, lines = _few(sizes.get(x, 1), max(NARROWEST, room)), _few(sizes[y], MOST_ROWS)
    glyphs = _glyphs(flags(ds[flag]), systems.presentation_of(ds).look)
    upwards = lines if ds[y].dtype.kind in "OU" else lines[::-1]
    read = (panel.transpose(y, *([x] if x else [])).values for panel in panels)
    drawn = [_panel(ds, values.reshape(sizes[y], -1)[:, columns], y, x, upwards, glyphs) for values in read]
    titles = [f"{beside} {int(ds[beside].values[number])}" if beside else "" for number in range(count)]
    drawn = [replace(panel, title=title) for panel, title in zip(drawn, titles, strict=True)]
    occurs = {c for panel in drawn for _, text in panel.rows for c in text}
    legend = {glyphs[value]: meaning for value, meaning in flags(ds[flag]).items() if glyphs[value] in occurs}
    at = {dim: _value(ds, dim, index) for dim, index in fixed.items() if dimensions(ds)[dim] > 1}
    look = systems.presentation_of(ds).look
    return TextMap(flag, x, y, at, drawn, legend, {glyph: look.color(meaning) for glyph, meaning in legend.items()})


def _cloud(ds: "xr.Dataset", flag: str, places: dict[str, Place], beside: str | None, width: int) -> TextMap | None:
    """Return points that are drawn or listed, over two of their coordinates."""
    look = systems.presentation_of(ds).look
    fixed = {dim: (n - 1) // 2 for dim, n in dimensions(ds).items() if dim not in ("point", beside)}
    fixed |= {dim: place.index for dim, place in places.items()}
    drawn = textcloud.draw(ds, flag, fixed, beside, width, _glyphs(flags(ds[flag]), look))
    colored = drawn and {glyph: look.color(meaning) for glyph, meaning in drawn.legend.items()}
    return drawn and replace(drawn, colors=colored)


def _glyphs(meanings: dict[int, str], look: Look) -> dict[int, str]:
    """Return flag → its character; a letter for those without one of their own."""
    marks = {value: look.mark(meaning) for value, meaning in meanings.items()}
    return {v: mark.glyph if mark else chr(ord("a") + k % 26) for k, (v, mark) in enumerate(marks.items())}


def _plane(ds: "xr.Dataset", sizes: dict[str, int]) -> tuple[str, str]:
    """Return dimensions upwards and along the bottom: names upwards, else the two longest, the first of them along."""
    longest = sorted(sizes, key=lambda dim: -sizes[dim])
    for names in (dim for dim in sizes if ds[dim].dtype.kind in "OU"):
        return names, next((dim for dim in longest if dim != names), "")
    return (longest[1], longest[0]) if len(longest) > 1 else (longest[0], "")


def _few(size: int, most: int) -> np.ndarray:
    return np.array(sorted({*np.linspace(0, size - 1, min(size, max(most, 2))).round().astype(int).tolist()}))


def _label_width(ds: "xr.Dataset", y: str) -> int:
    return max(len(_value_in_words(value)) for value in ds[y].values) + 1


def _value(ds: "xr.Dataset", dim: str, index: int) -> float | int | str:
    value = ds[dim].values[index]
    return value.item() if hasattr(value, "item") else str(value)


def _value_in_words(value) -> str:
    value = value.item() if hasattr(value, "item") else value
    text = f"{value:.4g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 16 else text[:15] + "…"


def _panel(ds: "xr.Dataset", numbers: np.ndarray, y: str, x: str, upwards, glyphs) -> Panel:
    rows = [
        (_value_in_words(ds[y].values[i]), "".join(glyphs.get(int(number), "?") for number in numbers[i]))
        for i in upwards
    ]
    ends = tuple(in_words(ds[x].values[i].item()) for i in (0, -1)) if x else ("", "")
    return Panel("", rows, ends)
