"""Measured values against theory, for the maps of every system: deviations over their errors, and relative ones.

A presentation lists what is compared (`Compared`); names of errors and of theory, words and colours come from the
system's table of variables and its look. A map is read once, in blocks, so that it need not fit into memory.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweeps.figure import axis_scales, canvas, colors, marks, wording
from sweeps.schema.datasets import Dataset, along, flags
from sweeps.schema.iteration import blocks, coprime_stride
from sweeps.schema.variables import Role, Variable, of_role
from sweeps.systems.presentation.appearance import Appearance, Compared

BLOCK_POINTS = 2**18
MOST_DRAWN = 200_000
EXACT = 1e-17  # where a deviation of exactly 0 is drawn on a logarithmic axis
RATIOS = np.geomspace(1e-3, 10.0, 33)  # bins of deviation over error; what is less is in the first
MARKED = (1, 2, 3)  # errors
MOST_DEVIATION, LEAST_THEORY = 1e9, 1e-12  # larger ones, and less of the largest theory, stand at the edge
MOST_SIZES = 5  # of the perturbation that have a shade each; more are put together
MOST_ERROR_POINTS, BINS = 3000, 48  # of errors drawn as dashes; beyond, their middle 90 % as a band of so many bins
BOUND = "An error bounds the finite-amplitude shift: where the deviation is that shift, their ratio is near 1"
UNDECIDED = ("undetermined", "marginal")  # flags that differ from no theory
ERROR, IMPOSSIBLE = "#e9c46a", "#a6a9ad"
MARKS = ("1", "x", "+", "2", "3", "4", "|", "_")  # of statuses other than ok


Specs = Mapping[str, Variable]  # name → variable, of a system's table


@dataclass
class Agreement:
    """How one measured quantity of a map compares with theory."""

    points: int  #: number of points of the map
    stride: int  #: every how many points one is kept in `columns`, in storage order
    counts: dict[Role, dict[int, int]]  #: of the leading flag and the status: number of a meaning → number of points
    #: at the kept points: theory (its size), deviation and error (relative), ratio (deviation over error), flag,
    #: status, possible, differs (whether the flag is another than theory's), epsilon.
    columns: dict[str, np.ndarray] = field(default_factory=dict)
    worst: float = math.nan  #: largest relative deviation of points that are ok, possible and of theory's flag
    certificate: float = math.nan  #: largest value of the certificate; NaN where the map has none


def agreement(ds: Dataset, specs: Specs, one: Compared, most: int = MOST_DRAWN) -> Agreement:
    """Compare a measured quantity with theory; at most `most` points are kept, the other numbers are over all."""
    first = ds[one.names[0]]
    sizes = dict(zip(first.dims, first.shape, strict=True))
    counts = {role: dict.fromkeys(_meanings(ds, specs, role), 0) for role in (Role.HEADLINE, Role.STATUS)}
    comparison = Agreement(first.size, coprime_stride(sizes.values(), most), counts)
    parts, start = [], 0
    for box in blocks(sizes, BLOCK_POINTS):
        columns = _columns(ds, specs, one, box, sizes)
        for role, column in ((Role.HEADLINE, "flag"), (Role.STATUS, "status")):
            for number in counts[role]:
                counts[role][number] += int(np.count_nonzero(columns[column] == number))
        sound = columns["possible"] & (columns["status"] == 0) & ~columns["differs"]
        comparison.worst = float(np.fmax.reduce(columns["deviation"][sound], initial=comparison.worst))
        comparison.certificate = float(np.fmax.reduce(columns.pop("certificate"), initial=comparison.certificate))
        kept = slice(-start % comparison.stride, None, comparison.stride)
        parts.append({name: column[kept].copy() for name, column in columns.items()})  # a view would keep its block
        start += sound.size
    comparison.columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return comparison


def _meanings(ds: Dataset, specs: Specs, role: Role) -> dict[int, str]:
    """Return number → meaning of the flag variable of a role; {} of one that the map has not."""
    name = of_role(specs, role)
    return flags(ds[name]) if name in ds.variables else {}


@np.errstate(all="ignore")
def _columns(ds, specs: Specs, one: Compared, box: Mapping[str, slice], sizes: Mapping[str, int]):
    """Return columns of `Agreement` and the certificate at all points of a block, in storage order."""
    shape = [len(range(n)[box[dim]]) for dim, n in sizes.items()]

    def read(name: str, missing: float = math.nan) -> np.ndarray:
        part = ds[name].isel({dim: box[dim] for dim in ds[name].dims}) if name in ds.variables else None
        return np.broadcast_to(missing if part is None else along(part, tuple(sizes)), shape).reshape(-1)

    parts, flag = [specs[name] for name in one.names], of_role(specs, Role.HEADLINE)
    theory = _size(read(spec.truth) for spec in parts)
    off = _size(read(spec.name) - read(spec.truth) for spec in parts)
    error = _size(read(spec.error) for spec in parts)
    scale = np.abs(read(parts[0].scale)) if parts[0].scale else np.where(theory > 0, theory, np.nan)
    code, expected = read(flag), read(specs[flag].truth)
    open_codes = [code for code, name in _meanings(ds, specs, Role.HEADLINE).items() if name in UNDECIDED]
    return {
        "theory": theory / np.abs(read(one.per, 1.0)),
        "deviation": off / np.where((theory <= error) & (parts[0].scale == ""), np.nan, scale),
        "error": error / scale,
        "ratio": np.where(off == 0, 0.0, off / error) + 0.0 * scale,
        "flag": code,
        "differs": (code != expected) & np.isfinite(expected) & ~np.isin([code, expected], open_codes).any(axis=0),
        "status": read(of_role(specs, Role.STATUS), 0),
        "possible": read(of_role(specs, Role.EXISTENCE), 0) >= 0,
        "epsilon": read("epsilon"),
        "certificate": read(of_role(specs, Role.CERTIFICATE)),
    }


def _size(components: Iterable[np.ndarray]) -> np.ndarray:
    """Return the root of the sum of squares; of one component its size, to the last bit."""
    first, *others = components
    return np.hypot(first, *others) if others else np.abs(first)


# -- the picture


def draw(
    ds: Dataset, specs: Specs, compared: Iterable[Compared], appearance: Appearance, ax: Axes | None = None
) -> Figure | None:
    """Draw a column for each comparison: deviations over errors above, relative ones over theory below.

    None is drawn without a point to compare. `specs` is the system's table, `look` how its flags look.
    """
    every = [(one, agreement(ds, specs, one)) for one in compared]
    some = [(one, values) for one, values in every if _is_drawable(values.columns).any()]
    if not some:
        return None
    compared, comparisons = zip(*some, strict=True)
    lines, columns, size = canvas.arrange_panels(
        len(comparisons), (3.9, 5.2), (0.8 if len(comparisons) > 1 else 2.5, 1.6)
    )
    figure = canvas.make_figure(*size, "Measured against theory", _subtitle(ds, specs, comparisons, appearance), ax=ax)
    axes = figure.subplots(2 * lines, columns, height_ratios=(1.0, 1.35) * lines, squeeze=False)
    axes = axes if lines == 1 else axes.reshape(len(comparisons), 2).T
    for one, values, (upper, lower) in zip(compared, comparisons, axes.T, strict=True):
        spec = specs[one.names[0]]
        unit = f" / {appearance.symbol(one.per)}" if one.per else wording.with_unit("", spec.units, "  ({})")
        upper.set_title(one.title, loc="left", fontweight="bold")
        upper.set(xscale="log", xlabel="deviation from theory / error", ylabel="number of points")
        words = f"deviation / {appearance.symbol(spec.scale)}" if spec.scale else "relative deviation"
        lower.set(xscale="log", yscale="log", xlabel=f"theory{unit}", ylabel=words)
        _side(upper, lower, values, _groups(ds, specs, values.columns, appearance))
    deviations = np.concatenate([values.columns["deviation"] for values in comparisons])
    deviations = np.clip(deviations[np.isfinite(deviations)], EXACT, MOST_DEVIATION)
    for lower in axes[1]:  # the same range in all, with the line that stands for "equal to the last bit"
        lower.set_ylim(min(deviations.min() / 3, 1e-13), max(deviations.max() * 3, 1e-9))
        marks.draw_grid(lower, "y")
        if lower.get_ylim()[0] < EXACT * 1.5:
            exponents = range(-15, min(6, int(np.ceil(np.log10(lower.get_ylim()[1])))), 2)
            axis_scales.set_log_ticks_above_zero(lower.yaxis, EXACT, exponents)
    figure.align_ylabels(axes)
    canvas.draw_legend(figure)
    return figure


def _subtitle(ds: Dataset, specs: Specs, comparisons: list[Agreement], appearance: Appearance) -> str:
    stride, first = comparisons[0].stride, comparisons[0]
    ending = "th" if stride % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(stride % 10, "th")
    thinned = "all drawn" if stride == 1 else f"every {stride:,}{ending} drawn"
    rows = [f"{ds.attrs.get('title', '')}:  {wording.format_count(first.points, 'point', 'points')}, {thinned}"]
    for role, counts in first.counts.items():
        meanings, name = _meanings(ds, specs, role), of_role(specs, role).replace("_", " ").capitalize()
        rows.append(f"{name}:  " + " · ".join(f"{n:,} {appearance.words(meanings[k])}" for k, n in counts.items() if n))
    worst = np.fmax.reduce([one.worst for one in comparisons])
    rows[-1] += (
        "" if np.isnan(worst) else f";  largest relative deviation, status ok: {wording.format_number(worst, 2)}"
    )
    rows += [BOUND] if "amplitude_shift" in specs else []
    if not np.isnan(first.certificate):
        rows.append(f"Certificate:  largest integration error {wording.format_number(first.certificate, 2)}")
    return "\n".join(rows)


def _is_drawable(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    return np.isfinite(columns["deviation"]) & (columns["theory"] > 0)


def _groups(ds: Dataset, specs: Specs, columns: Mapping[str, np.ndarray], appearance: Appearance) -> list[tuple]:
    """Return name, mask, words and look of each group of points; each point that can be drawn is in one."""
    drawable = _is_drawable(columns)
    size = float(np.clip(40.0 / max(np.count_nonzero(drawable), 1) ** 0.4, 1.2, 5.0))
    point = {"marker": "o", "ms": size, "mew": 0.0, "alpha": 0.5 if drawable.size > 500 else 0.85}
    mark = {"ms": 4.0, "mew": 0.9, "mfc": "none", "color": colors.INK}
    sound = drawable & ~columns["differs"] & (columns["status"] == 0)
    alike = sound & columns["possible"]
    groups = [("impossible", sound & ~columns["possible"], "physically impossible", point | {"color": IMPOSSIBLE})]
    for number, name in (_meanings(ds, specs, Role.HEADLINE) or {math.nan: ""}).items():
        dot = {"color": appearance.color(name) or colors.STABLE}
        groups.append(
            (name or "ok", alike & ((columns["flag"] == number) | (not name)), appearance.words(name), point | dot)
        )
    for number, name in _meanings(ds, specs, Role.STATUS).items():
        if number:
            at = drawable & ~columns["differs"] & (columns["status"] == number)
            groups.append((name, at, appearance.words(name), mark | {"marker": MARKS[(number - 1) % len(MARKS)]}))
    return [*groups, ("differs", drawable & columns["differs"], "differs from theory", mark | {"marker": "v"})]


def _side(upper: Axes, lower: Axes, comparison: Agreement, groups: list[tuple]) -> None:
    columns = comparison.columns
    theory = np.maximum(columns["theory"], LEAST_THEORY * np.nanmax(columns["theory"]))
    at = (columns["status"] == 0) & (columns["theory"] > 0)
    draw_ratios(upper, columns["ratio"][at], columns["epsilon"][at])
    sound = np.any([at for _, at, _, props in groups if props["marker"] == "o"], axis=0)
    _draw_errors(lower, theory, columns["error"], sound)
    for name, at, words, props in groups:
        if at.any():
            drawn = np.clip(columns["deviation"][at], EXACT, MOST_DEVIATION)
            lower.plot(theory[at], drawn, ls="none", gid=name, label=words, rasterized=True, **props)
    axis_scales.set_plain_log_ticks(lower.xaxis)
    lower.minorticks_off()


def sizes_of(epsilon: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Return label and mask of each size of the perturbation, or of ranges of sizes where they are many, ascending."""
    sizes = np.unique(epsilon)
    parts = np.array_split(sizes, min(MOST_SIZES, sizes.size))
    words = [[wording.format_number(float(size), 2) for size in (part[0], part[-1])[: part.size]] for part in parts]
    return [(" to ".join(ends), np.isin(epsilon, part)) for ends, part in zip(words, parts, strict=True)]


def draw_ratios(ax: Axes, ratio: np.ndarray, epsilon: np.ndarray) -> None:
    """Draw a histogram of finite |deviation|/error, stacked by ε, and the cumulative fraction."""
    at = np.isfinite(ratio)
    if not at.any():
        return
    inside = np.mean(ratio[at] <= 1.0)
    ratio = np.clip(ratio, RATIOS[0], RATIOS[-1])
    groups = [(label, ratio[at & mask]) for label, mask in sizes_of(epsilon)] if np.isfinite(epsilon).all() else []
    groups = groups or [("", ratio[at])]
    shades = np.linspace(0.3, 1.0, len(groups)) if len(groups) > 1 else [0.8]
    for k, (shade, (size, _)) in enumerate(zip(shades, groups, strict=True)):
        upto = np.concatenate([values for _, values in groups[k:]])
        label = rf"$\varepsilon$ = {size}" if len(groups) > 1 else None
        ax.hist(upto, RATIOS, color=colors.STABLE, alpha=float(shade), zorder=2, gid="ratio", label=label)
    if len(groups) > 1:
        ax.legend(loc="upper left", fontsize=7.5, frameon=False, reverse=True)
    share, ordered = ax.twinx(), np.sort(ratio[at])
    share.plot(ordered, np.arange(1, ordered.size + 1) / ordered.size, color=colors.INK, lw=1.0, gid="cumulative")
    share.set(ylim=(0.0, 1.05), ylabel="cumulative fraction")
    for count in MARKED:
        ax.axvline(count, color=colors.QUIET, lw=0.8, ls=":", zorder=1, gid=f"error {count}")
    ax.set_title(f"{100 * inside:.4g} % below 1", loc="right", color=colors.QUIET)
    ax.set_xticks([1e-3, 1e-2, 0.1, *MARKED], ["≤0.001", "0.01", "0.1", *map(str, MARKED)])
    ax.minorticks_off()


def _draw_errors(ax: Axes, theory, error, at) -> None:
    """Draw relative errors: each as a dash or, where they are many, their middle 90 % along theory as a band."""
    at = at & np.isfinite(error) & (error > 0)
    if np.count_nonzero(at) <= MOST_ERROR_POINTS:
        props = {"ms": 6, "mew": 1.2, "color": ERROR, "zorder": 1, "gid": "error", "label": "relative error"}
        ax.plot(theory[at], np.maximum(error[at], EXACT), "_", **props)
        return
    x, y = np.log(theory[at]), error[at]
    cuts = np.linspace(x.min() - 1e-9, x.max() + 1e-9, BINS + 1)
    which = np.digitize(x, cuts) - 1
    low, high = np.full((2, BINS + 1), np.nan)
    for i in np.unique(which):
        low[i], high[i] = np.percentile(y[which == i], (5, 95))
    low, high = (np.maximum(v, EXACT) for v in (low, high))
    props = {"color": ERROR, "alpha": 0.6, "lw": 0, "zorder": 1, "gid": "error"}
    ax.fill_between(np.exp(cuts), low, high, step="post", label="relative error, middle 90 %", **props)
