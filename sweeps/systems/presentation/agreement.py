"""Measured values against theory, for the maps of every system: deviations over their errors, and relative deviations.

A presentation lists the compared quantities (`Compared`). The names of errors and of theory come from the system's
table of variables, words and colours from its `Appearance`. A map is read once, in blocks: it may exceed the memory.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweeps.figure import axis_scales, canvas, colors, marks, wording
from sweeps.schema.datasets import Dataset, along, flags
from sweeps.schema.iteration import blocks, coprime_stride
from sweeps.schema.variables import Role, Variable, of_role
from sweeps.systems.presentation.appearance import Appearance, Compared

BLOCK_POINTS = 2**18
MAX_DRAWN = 200_000  # points of a panel; a picture with more is slow to draw and shows no more
EXACT = 1e-17  # a deviation of exactly 0 is drawn at this value of a logarithmic axis
RATIOS = np.geomspace(1e-3, 10.0, 33)  # bins of deviation over error; smaller ratios are counted in the first
MARKED_RATIOS = (1, 2, 3)  # deviations in units of the error that have a line
MAX_DEVIATION = 1e9  # relative; larger deviations are drawn at this value
MIN_THEORY = 1e-12  # relative to the largest theoretical value; smaller values are drawn at this one
MAX_SHADES = 5  # shades of the histogram; more sizes of the perturbation share one
MAX_DASHES = 3000  # errors drawn as dashes; beyond, a band of their middle 90 %, in `BAND_BINS` bins
BAND_BINS = 48
BOUND = "An error bounds the finite-amplitude shift: where the deviation is that shift, their ratio is near 1"
UNDECIDED = ("undetermined", "marginal")  # flags that agree with every theory
ERROR, IMPOSSIBLE = "#e9c46a", "#a6a9ad"
MARKS = ("1", "x", "+", "2", "3", "4", "|", "_")  # markers of the statuses other than ok


Specs = Mapping[str, Variable]  # a system's table of variables by name


@dataclass
class Agreement:
    """Comparison of a measured quantity of a map with theory."""

    points: int  #: number of points of the map
    stride: int  #: `columns` has each stride-th point, in storage order
    counts: dict[Role, dict[int, int]]  #: leading flag and status → code of each meaning → number of points
    #: theory (its size), deviation and error (relative), ratio (deviation over error), flag, status, possible,
    #: differs (True if the flag is not the theoretical one), epsilon; each of shape (points // stride,).
    columns: dict[str, np.ndarray] = field(default_factory=dict)
    max_deviation: float = math.nan  #: largest relative deviation of points with status ok, possible, flag as predicted
    certificate: float = math.nan  #: largest value of the certificate; NaN if the map has none


def compare(ds: Dataset, specs: Specs, quantity: Compared) -> Agreement:
    """Compare a measured quantity with theory.

    Args:
        ds: the map.
        specs: the system's table of variables.
        quantity: the measured variable, or the components of a vector.
    """
    values = ds[quantity.names[0]]
    sizes = dict(zip(map(str, values.dims), values.shape, strict=True))
    counts = {role: dict.fromkeys(_meanings(ds, specs, role), 0) for role in (Role.HEADLINE, Role.STATUS)}
    comparison = Agreement(values.size, coprime_stride(sizes.values(), MAX_DRAWN), counts)
    tables, num_points = [], 0
    for box in blocks(sizes, BLOCK_POINTS):
        columns = _columns(ds, specs, quantity, box, sizes)
        for role, column in ((Role.HEADLINE, "flag"), (Role.STATUS, "status")):
            for number in counts[role]:
                counts[role][number] += int(np.count_nonzero(columns[column] == number))
        is_ok = columns["possible"] & (columns["status"] == 0) & ~columns["differs"]
        comparison.max_deviation = float(np.fmax.reduce(columns["deviation"][is_ok], initial=comparison.max_deviation))
        comparison.certificate = float(np.fmax.reduce(columns.pop("certificate"), initial=comparison.certificate))
        kept_points = slice(-num_points % comparison.stride, None, comparison.stride)
        # a copy, as a view would keep the whole block in memory
        tables.append({name: column[kept_points].copy() for name, column in columns.items()})
        num_points += is_ok.size
    comparison.columns = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    return comparison


def _meanings(ds: Dataset, specs: Specs, role: Role) -> dict[int, str]:
    """Return code → meaning of the flag variable of a role; {} if the map has no such variable."""
    name = of_role(specs, role)
    return flags(ds[name]) if name in ds.variables else {}


@np.errstate(all="ignore")
def _columns(ds, specs: Specs, quantity: Compared, box: Mapping[str, slice], sizes: Mapping[str, int]):
    """Return the columns of `Agreement`, and the certificate, at all points of a block, in storage order."""
    shape = [len(range(n)[box[dim]]) for dim, n in sizes.items()]

    def read(name: str, missing: float = math.nan) -> np.ndarray:
        block = ds[name].isel({dim: box[dim] for dim in ds[name].dims}) if name in ds.variables else None
        return np.broadcast_to(missing if block is None else along(block, tuple(sizes)), shape).reshape(-1)

    components, flag = [specs[name] for name in quantity.names], of_role(specs, Role.HEADLINE)
    theory = _size(read(spec.truth) for spec in components)
    deviation = _size(read(spec.name) - read(spec.truth) for spec in components)
    error = _size(read(spec.error) for spec in components)
    scale = np.abs(read(components[0].scale)) if components[0].scale else np.where(theory > 0, theory, np.nan)
    code, predicted = read(flag), read(specs[flag].truth)
    open_codes = [code for code, name in _meanings(ds, specs, Role.HEADLINE).items() if name in UNDECIDED]
    return {
        "theory": theory / np.abs(read(quantity.per, 1.0)),
        "deviation": deviation / np.where((theory <= error) & (components[0].scale == ""), np.nan, scale),
        "error": error / scale,
        "ratio": np.where(deviation == 0, 0.0, deviation / error) + 0.0 * scale,
        "flag": code,
        "differs": (code != predicted) & np.isfinite(predicted) & ~np.isin([code, predicted], open_codes).any(axis=0),
        "status": read(of_role(specs, Role.STATUS), 0),
        "possible": read(of_role(specs, Role.EXISTENCE), 0) >= 0,
        "epsilon": read("epsilon"),
        "certificate": read(of_role(specs, Role.CERTIFICATE)),
    }


def _size(components: Iterable[np.ndarray]) -> np.ndarray:
    """Return the root of the sum of squares; of a single component its size, to the last bit."""
    first, *more_components = components
    return np.hypot(first, *more_components) if more_components else np.abs(first)


# -- the picture


def draw(
    ds: Dataset, specs: Specs, compared: Iterable[Compared], appearance: Appearance, ax: Axes | None = None
) -> Figure | None:
    """Draw a column for each comparison: deviations over errors above, relative deviations over theory below.

    Args:
        ds: the map.
        specs: the system's table of variables.
        compared: the measured quantities.
        appearance: words, symbols and colours of the system.
        ax: place of the figure within another one.

    Returns:
        The figure; None if no point can be compared.
    """
    pairs = [(quantity, compare(ds, specs, quantity)) for quantity in compared]
    pairs = [(quantity, comparison) for quantity, comparison in pairs if _is_drawable(comparison.columns).any()]
    if not pairs:
        return None
    compared, comparisons = zip(*pairs, strict=True)
    lines, columns, size = canvas.arrange_panels(
        len(comparisons), (3.9, 5.2), (0.8 if len(comparisons) > 1 else 2.5, 1.6)
    )
    figure = canvas.make_figure(*size, "Measured against theory", _subtitle(ds, specs, comparisons, appearance), ax=ax)
    axes = figure.subplots(2 * lines, columns, height_ratios=(1.0, 1.35) * lines, squeeze=False)
    axes = axes if lines == 1 else axes.reshape(len(comparisons), 2).T
    for quantity, comparison, (ratio_ax, theory_ax) in zip(compared, comparisons, axes.T, strict=True):
        spec = specs[quantity.names[0]]
        unit = f" / {appearance.symbol(quantity.per)}" if quantity.per else wording.with_unit("", spec.units, "  ({})")
        ratio_ax.set_title(quantity.title, loc="left", fontweight="bold")
        ratio_ax.set(xscale="log", xlabel="deviation from theory / error", ylabel="number of points")
        words = f"deviation / {appearance.symbol(spec.scale)}" if spec.scale else "relative deviation"
        theory_ax.set(xscale="log", yscale="log", xlabel=f"theory{unit}", ylabel=words)
        _draw_comparison(ratio_ax, theory_ax, comparison, _groups(ds, specs, comparison.columns, appearance))
    deviations = np.concatenate([comparison.columns["deviation"] for comparison in comparisons])
    deviations = np.clip(deviations[np.isfinite(deviations)], EXACT, MAX_DEVIATION)
    for theory_ax in axes[1]:  # all have the same range, with the line EXACT for "equal to the last bit"
        theory_ax.set_ylim(min(deviations.min() / 3, 1e-13), max(deviations.max() * 3, 1e-9))
        marks.draw_grid(theory_ax, "y")
        if theory_ax.get_ylim()[0] < EXACT * 1.5:
            exponents = range(-15, min(6, int(np.ceil(np.log10(theory_ax.get_ylim()[1])))), 2)
            axis_scales.set_log_ticks_above_zero(theory_ax.yaxis, EXACT, exponents)
    figure.align_ylabels(axes)
    canvas.draw_legend(figure)
    return figure


def _subtitle(ds: Dataset, specs: Specs, comparisons: list[Agreement], appearance: Appearance) -> str:
    """Return title, numbers of points by regime and by status, largest deviation and integration error, one a line."""
    stride, first = comparisons[0].stride, comparisons[0]
    suffix = "th" if stride % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(stride % 10, "th")
    drawn_fraction = "all drawn" if stride == 1 else f"every {stride:,}{suffix} drawn"
    rows = [f"{ds.attrs.get('title', '')}:  {wording.format_count(first.points, 'point', 'points')}, {drawn_fraction}"]
    for role, counts in first.counts.items():
        meanings, name = _meanings(ds, specs, role), of_role(specs, role).replace("_", " ").capitalize()
        rows.append(f"{name}:  " + " · ".join(f"{n:,} {appearance.words(meanings[k])}" for k, n in counts.items() if n))
    max_deviation = np.fmax.reduce([comparison.max_deviation for comparison in comparisons])
    rows[-1] += (
        ""
        if np.isnan(max_deviation)
        else f";  largest relative deviation, status ok: {wording.format_number(max_deviation, 2)}"
    )
    rows += [BOUND] if "amplitude_shift" in specs else []
    if not np.isnan(first.certificate):
        rows.append(f"Certificate:  largest integration error {wording.format_number(first.certificate, 2)}")
    return "\n".join(rows)


def _is_drawable(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    return np.isfinite(columns["deviation"]) & (columns["theory"] > 0)


def _groups(ds: Dataset, specs: Specs, columns: Mapping[str, np.ndarray], appearance: Appearance) -> list[tuple]:
    """Return name, mask, words and marker of each group of points; each point that can be drawn is in one group."""
    drawable = _is_drawable(columns)
    marker_size = float(np.clip(40.0 / max(int(np.count_nonzero(drawable)), 1) ** 0.4, 1.2, 5.0))
    point = {"marker": "o", "ms": marker_size, "mew": 0.0, "alpha": 0.5 if drawable.size > 500 else 0.85}
    mark = {"ms": 4.0, "mew": 0.9, "mfc": "none", "color": colors.INK}
    is_settled = drawable & ~columns["differs"] & (columns["status"] == 0)
    possible = is_settled & columns["possible"]
    groups = [("impossible", is_settled & ~columns["possible"], "physically impossible", point | {"color": IMPOSSIBLE})]
    for number, name in (_meanings(ds, specs, Role.HEADLINE) or {math.nan: ""}).items():
        dot = {"color": appearance.color(name) or colors.STABLE}
        groups.append(
            (name or "ok", possible & ((columns["flag"] == number) | (not name)), appearance.words(name), point | dot)
        )
    for number, name in _meanings(ds, specs, Role.STATUS).items():
        if number:
            at = drawable & ~columns["differs"] & (columns["status"] == number)
            groups.append((name, at, appearance.words(name), mark | {"marker": MARKS[(number - 1) % len(MARKS)]}))
    return [*groups, ("differs", drawable & columns["differs"], "differs from theory", mark | {"marker": "v"})]


def _draw_comparison(ratio_ax: Axes, theory_ax: Axes, comparison: Agreement, groups: list[tuple]) -> None:
    """Draw measured-to-theory ratios over ε in one panel, and reported errors and deviations over theory."""
    columns = comparison.columns
    theory = np.maximum(columns["theory"], MIN_THEORY * np.nanmax(columns["theory"]))
    with_theory = (columns["status"] == 0) & (columns["theory"] > 0)
    draw_ratios(ratio_ax, columns["ratio"][with_theory], columns["epsilon"][with_theory])
    is_settled = np.any([with_theory for _, with_theory, _, props in groups if props["marker"] == "o"], axis=0)
    _draw_errors(theory_ax, theory, columns["error"], is_settled)
    for name, in_group, words, props in groups:
        if in_group.any():
            deviation = np.clip(columns["deviation"][in_group], EXACT, MAX_DEVIATION)
            theory_ax.plot(theory[in_group], deviation, ls="none", gid=name, label=words, rasterized=True, **props)
    axis_scales.set_plain_log_ticks(theory_ax.xaxis)
    theory_ax.minorticks_off()


def group_by_size(epsilon: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Return label and mask of each size of the perturbation, ascending; of ranges of sizes if there are many."""
    sizes = np.unique(epsilon)
    ranges = np.array_split(sizes, min(MAX_SHADES, sizes.size))
    ends = [[wording.format_number(float(size), 2) for size in (group[0], group[-1])[: group.size]] for group in ranges]
    return [(" to ".join(limits), np.isin(epsilon, group)) for limits, group in zip(ends, ranges, strict=True)]


def draw_ratios(ax: Axes, ratio: np.ndarray, epsilon: np.ndarray) -> None:
    """Draw on `ax` a histogram of |deviation|/error, `ratio`, stacked by `epsilon`, and the cumulative fraction."""
    finite = np.isfinite(ratio)
    if not finite.any():
        return
    fraction_below_1 = np.mean(ratio[finite] <= 1.0)
    ratio = np.clip(ratio, RATIOS[0], RATIOS[-1])
    groups = (
        [(label, ratio[finite & mask]) for label, mask in group_by_size(epsilon)] if np.isfinite(epsilon).all() else []
    )
    groups = groups or [("", ratio[finite])]
    shades = np.linspace(0.3, 1.0, len(groups)) if len(groups) > 1 else [0.8]
    for k, (shade, (size, _)) in enumerate(zip(shades, groups, strict=True)):
        ratios = np.concatenate([values for _, values in groups[k:]])
        label = rf"$\varepsilon$ = {size}" if len(groups) > 1 else None
        ax.hist(ratios, RATIOS.tolist(), color=colors.STABLE, alpha=float(shade), zorder=2, gid="ratio", label=label)
    if len(groups) > 1:
        ax.legend(loc="upper left", fontsize=7.5, frameon=False, reverse=True)
    fraction_ax, sorted_ratios = ax.twinx(), np.sort(ratio[finite])
    fraction_ax.plot(
        sorted_ratios,
        np.arange(1, sorted_ratios.size + 1) / sorted_ratios.size,
        color=colors.INK,
        lw=1.0,
        gid="cumulative",
    )
    fraction_ax.set(ylim=(0.0, 1.05), ylabel="cumulative fraction")
    for count in MARKED_RATIOS:
        ax.axvline(count, color=colors.QUIET, lw=0.8, ls=":", zorder=1, gid=f"error {count}")
    ax.set_title(f"{100 * fraction_below_1:.4g} % below 1", loc="right", color=colors.QUIET)
    ax.set_xticks([1e-3, 1e-2, 0.1, *MARKED_RATIOS], ["≤0.001", "0.01", "0.1", *map(str, MARKED_RATIOS)])
    ax.minorticks_off()


def _draw_errors(ax: Axes, theory, error, drawable) -> None:
    """Draw relative errors: each as a dash or, if they are many, their middle 90 % along theory as a band."""
    drawable = drawable & np.isfinite(error) & (error > 0)
    if np.count_nonzero(drawable) <= MAX_DASHES:
        dash: dict[str, Any] = {"ms": 6, "mew": 1.2, "color": ERROR, "zorder": 1, "gid": "error"}
        ax.plot(theory[drawable], np.maximum(error[drawable], EXACT), "_", label="relative error", **dash)
        return
    x, y = np.log(theory[drawable]), error[drawable]
    cuts = np.linspace(x.min() - 1e-9, x.max() + 1e-9, BAND_BINS + 1)
    bin_of_point = np.digitize(x, cuts) - 1
    low, high = np.full((2, BAND_BINS + 1), np.nan)
    for i in np.unique(bin_of_point):
        low[i], high[i] = np.percentile(y[bin_of_point == i], (5, 95))
    low, high = (np.maximum(v, EXACT) for v in (low, high))
    band: dict[str, Any] = {"color": ERROR, "alpha": 0.6, "lw": 0, "zorder": 1, "gid": "error"}
    ax.fill_between(np.exp(cuts), low, high, step="post", label="relative error, middle 90 %", **band)
