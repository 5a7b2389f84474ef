"""Deviations of measured rates from linear theory, over all points of a map: over their errors, and relative ones."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweeps.figure import colors, style
from sweeps.systems.presentation import ratios
from sweeps.systems.rigid_body.fits import Agreement, agreement
from sweeps.systems.rigid_body.presentation.look import LOOK
from sweeps.systems.rigid_body.variables import STATUSES

if TYPE_CHECKING:
    import xarray as xr

EXACT = 1e-17  # where a deviation of exactly 0 is drawn on a logarithmic axis
IMPOSSIBLE = "#a6a9ad"
MOST_ERROR_POINTS = 3000  # beyond, their middle 90 % as a band
BINS = 48
WORDS = {  # group of points → what the legend says of it; of the others nothing
    "impossible": "physically impossible",
    "short_window": LOOK.words("short_window"),
    "not_converged": LOOK.words("not_converged"),
    "opposite": "sign differs from theory",
}


def draw(ds: "xr.Dataset", ax: Axes | None = None) -> Figure:
    """Draw oscillations (left) and growth (right); deviations over errors (top), relative ones (bottom)."""
    found = agreement(ds)
    lines, columns, size = style.arranged(2, (3.9, 5.2), (0.8, 1.6))
    figure = style.canvas(*size, "Measured against linear theory", _subtitle(ds, found), ax=ax)
    axes = figure.subplots(2 * lines, columns, height_ratios=(1.0, 1.35) * lines)
    axes = axes if columns == 2 else axes.reshape(2, 2).T
    sides = ((1.0, colors.STABLE, "oscillates", r"frequency $\Omega$"), (-1.0, colors.UNSTABLE, "grows", "growth rate"))
    for column, (sign, color, verb, name) in zip(axes.T, sides, strict=True):
        _side(column, found, sign, color)
        column[0].set_title(f"{verb} in theory", loc="left", color=color, fontweight="bold")
        column[0].set(xlabel="deviation from theory / error", ylabel="number of points")
        column[1].set(xlabel=rf"{name} $/\,|\omega_0|$ in linear theory", ylabel="relative deviation")
    _share_deviations(axes[1], found)
    figure.align_ylabels(axes)
    style.legend(figure)
    return figure


def _subtitle(ds: "xr.Dataset", found: Agreement) -> str:
    thinned = "all drawn" if found.stride == 1 else f"every {_ordinal(found.stride)} drawn"
    points = style.count(found.points, "point", "points")
    left_out = rf";  {found.marginal:,} with $\Omega^2 = 0$ in theory left out" if found.marginal else ""
    worst = f";  largest relative deviation, status ok: {style.number(found.worst, 2)}"
    title = f"{ds.attrs.get('title', '')}:  {points}, {thinned}{left_out}\nMeasured regime:  {_counts(found.regimes)}"
    status = f"Status:  {_counts(found.statuses)}{'' if np.isnan(found.worst) else worst}"
    return f"{title}\n{status}\n{ratios.BOUND}{_certificate(found)}"


def _certificate(found: Agreement) -> str:
    """What the map says of its own integration; nothing where it is exact."""
    if np.isnan(found.certificate):
        return ""
    largest = f"largest integration error {style.number(found.certificate, 2)}, relative to the perturbation"
    return f"\nCertificate:  {largest};  {found.statuses['not_converged']:,} not converged"


def _counts(numbers: dict[str, int]) -> str:
    return " · ".join(f"{n:,} {LOOK.words(name)}" for name, n in numbers.items() if n)


def _ordinal(n: int) -> str:
    ending = "th" if n % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(n % 10, "th")
    return f"{n:,}{ending}"


def groups(found: Agreement) -> dict[str, np.ndarray]:
    """Return masks of the kept points, each point in one: "ok", "impossible", "opposite" (sign), and two statuses.

    What is not finite, or has Ω² = 0 in theory, is in none.
    """
    drawable = np.isfinite(found.measured) & np.isfinite(found.theory) & (found.theory != 0)
    opposite = drawable & (found.measured * found.theory <= 0)
    rest = drawable & ~opposite
    masks = {"ok": rest & (found.status == 0) & found.possible}
    masks["impossible"] = rest & (found.status == 0) & ~found.possible
    masks |= {name: rest & (found.status == i) for i, name in enumerate(STATUSES) if i in (1, 2)}
    return masks | {"opposite": opposite}


def _looks(color: str, crowd: int) -> dict[str, dict]:
    """How each group is drawn; the more points, the smaller."""
    size = float(np.clip(40.0 / max(crowd, 1) ** 0.4, 1.2, 5.0))
    point = {"ls": "none", "marker": "o", "ms": size, "mew": 0.0, "alpha": 0.5 if crowd > 500 else 0.85}
    mark = {"ls": "none", "ms": 4.0, "mew": 0.9, "color": colors.INK}
    return {
        "impossible": point | {"color": IMPOSSIBLE},
        "ok": point | {"color": color},
        "short_window": mark | {"marker": "1"},
        "not_converged": mark | {"marker": "x", "ms": 3.5},
        "opposite": mark | {"marker": "v", "mfc": "none", "ms": 3.5},
    }


def _side(column, found: Agreement, sign: float, color: str) -> None:
    upper, lower = column
    side = found.theory * sign > 0
    theory = np.abs(found.theory)
    upper.set(xscale="log")
    lower.set(xscale="log", yscale="log")
    masks = groups(found)
    if not any((side & mask).any() for mask in masks.values()):
        upper.text(0.5, 0.5, "no such point", transform=upper.transAxes, ha="center", color=colors.QUIET)
        for ax in column:
            ax.set(xticks=[], yticks=[])
            ax.minorticks_off()
        return
    at = side & (found.status == 0)
    ratios.draw(upper, found.ratio[at], found.epsilon[at], color)
    _draw_errors(lower, theory, found.error, side & masks["ok"])
    for name, look in _looks(color, side.size).items():
        at = side & masks[name]
        if not at.any():
            continue
        order = {"zorder": 2.0 if name == "impossible" else 3.0, "gid": name}
        order |= {"label": f"{WORDS[name]} ({int(masks[name].sum()):,})"} if name in WORDS else {}
        lower.plot(theory[at], np.maximum(found.deviation[at], EXACT), **look, **order)
    style.plain_log_ticks(lower.xaxis)
    lower.minorticks_off()


def _draw_errors(ax: Axes, theory, error, at) -> None:
    """Relative errors: each as a dash or, where they are many, their middle 90 % along theory as a band."""
    at = at & np.isfinite(error) & (error > 0)
    if np.count_nonzero(at) <= MOST_ERROR_POINTS:
        look = {"ms": 6, "mew": 1.2, "color": ratios.ERROR, "zorder": 1, "gid": "error", "label": "relative error"}
        ax.plot(theory[at], np.maximum(error[at], EXACT), "_", **look)
        return
    x, y = np.log(theory[at]), error[at]
    cuts = np.linspace(x.min() - 1e-9, x.max() + 1e-9, BINS + 1)
    which = np.digitize(x, cuts) - 1
    low, high = np.full((2, BINS + 1), np.nan)
    for i in np.unique(which):
        low[i], high[i] = np.percentile(y[which == i], (5, 95))
    low, high = (np.maximum(v, EXACT) for v in (low, high))
    look = {"color": ratios.ERROR, "alpha": 0.6, "lw": 0, "zorder": 1, "gid": "error"}
    ax.fill_between(np.exp(cuts), low, high, step="post", label="relative error, middle 90 %", **look)


def _share_deviations(axes, found: Agreement) -> None:
    """The same range of deviations in both panels, with the line that stands for "equal to the last bit"."""
    finite = found.deviation[np.isfinite(found.deviation)]
    values = np.maximum(finite, EXACT)
    for ax in axes:
        if finite.size:
            ax.set_ylim(min(values.min() / 3, 1e-13), max(values.max() * 3, 1e-9))
        style.grid(ax, "y")
        if ax.get_ylim()[0] < EXACT * 1.5:
            exponents = range(-16, min(6, int(np.ceil(np.log10(ax.get_ylim()[1])))), 2)
            style.log_ticks_above_zero(ax.yaxis, EXACT, exponents)
