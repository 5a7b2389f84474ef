"""A cloud of points as characters: over two of their coordinates, in each cell the flag that most points in it have."""

from typing import TYPE_CHECKING

import numpy as np

from sweeps.maps.selection import in_words
from sweeps.schema.boxes import dimensions, flags, own_of_points, spreads_by_ratio
from sweeps.views.textplane import Panel, TextMap

if TYPE_CHECKING:
    import xarray as xr

MOST_POINTS = 2**18
ROWS = 24
EMPTY = " "


def draw(ds: "xr.Dataset", flag: str, fixed: dict[str, int], beside: str | None, width: int, glyphs) -> TextMap | None:
    """Draw a flag over the first two varying coordinates of the points; return None without any."""
    part = ds.isel(point=slice(None, None, -(-ds.sizes["point"] // MOST_POINTS)))
    names = [name for name in own_of_points(ds) if np.ptp(part[name].values) > 0][:2]
    if not names:
        return None
    cells, ends = zip(*(_places(part[name].values) for name in names), strict=True)
    values = part[flag].isel({dim: i for dim, i in fixed.items() if dim != "point"}).load()
    numbers = range(ds.sizes[beside]) if beside else (None,)
    label = 1 + max(len(in_words(end)) for end in (ends[-1] if len(names) > 1 else ("",)))
    columns = max(8, (width - label - 2 * (len(numbers) - 1)) // len(numbers))
    rows = ROWS if len(names) > 1 else 1
    panels = []
    for number in numbers:
        one_panel = values if number is None else values.isel({beside: number})
        drawn = _cells(one_panel.values.reshape(-1), cells, columns, rows, glyphs)
        labels = [""] * rows
        if len(names) > 1:
            labels[0], labels[-1] = (in_words(float(end)) for end in reversed(ends[1]))
        title = f"{beside} {ds[beside].values[number]}" if beside else ""
        panels.append(Panel(title, list(zip(labels, drawn, strict=True)), tuple(in_words(float(e)) for e in ends[0])))
    occurs = {c for panel in panels for _, text in panel.rows for c in text}
    legend = {glyphs[v]: meaning for v, meaning in flags(ds[flag]).items() if glyphs[v] in occurs}
    values = {dim: ds[dim].values[i] for dim, i in fixed.items() if dim != "point" and dimensions(ds)[dim] > 1}
    fixed_values = {dim: value.item() if hasattr(value, "item") else str(value) for dim, value in values.items()}
    return TextMap(flag, names[0], names[1] if len(names) > 1 else "points", fixed_values, panels, legend, {})


def _places(values: np.ndarray) -> tuple[np.ndarray, tuple[float, float]]:
    """Return where each value stands between the least (0) and the greatest (1), by ratio where that spreads better."""
    ends = float(values.min()), float(values.max())
    if spreads_by_ratio(values):
        values = np.log(values)
    return (values - values.min()) / np.ptp(values), ends


def _cells(flag: np.ndarray, places, columns: int, rows: int, glyphs) -> list[str]:
    along = np.minimum((places[0] * columns).astype(int), columns - 1)
    up = np.minimum((places[1] * rows).astype(int), rows - 1) if len(places) > 1 else np.zeros(along.shape, int)
    counts = np.stack([np.bincount((up * columns + along)[flag == v], minlength=rows * columns) for v in glyphs])
    leading = np.where(counts.any(axis=0), counts.argmax(axis=0), -1).reshape(rows, columns)
    signs = [*glyphs.values()]
    return ["".join(signs[k] if k >= 0 else EMPTY for k in row) for row in leading[::-1]]
