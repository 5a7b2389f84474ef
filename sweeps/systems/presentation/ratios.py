"""How true error bars are, in a picture: the distribution of deviation over error, over sizes of the perturbation."""

import numpy as np
from matplotlib.axes import Axes

from sweeps.figure import colors, style

RATIOS = np.geomspace(1e-3, 10.0, 33)  # bins of deviation over error; what is less is in the first
BOUND = "An error bounds the finite-amplitude shift: where the deviation is that shift, their ratio is near 1"
ERROR = "#e9c46a"  # of an error beside a deviation
MARKED = (1, 2, 3)  # errors
MOST_NUDGES = 5  # sizes of the nudge that have a colour each; more are put together by decades of so many


def nudges(epsilon: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Return label and mask of each size of the perturbation, or of ranges of sizes where they are many, ascending."""
    sizes = np.unique(epsilon)
    parts = np.array_split(sizes, min(MOST_NUDGES, sizes.size))
    words = [[style.number(float(size), 2) for size in (part[0], part[-1])[: part.size]] for part in parts]
    return [(" to ".join(ends), np.isin(epsilon, part)) for ends, part in zip(words, parts, strict=True)]


def draw(ax: Axes, ratio: np.ndarray, epsilon: np.ndarray, color: str) -> None:
    """Draw a histogram of finite |deviation|/error, stacked by ε, and the cumulative fraction."""
    at = np.isfinite(ratio)
    if not at.any():
        return
    inside = np.mean(ratio[at] <= 1.0)
    ratio = np.clip(ratio, RATIOS[0], RATIOS[-1])
    groups = [(label, ratio[at & mask]) for label, mask in nudges(epsilon)]
    shades = np.linspace(0.3, 1.0, len(groups)) if len(groups) > 1 else [0.8]
    for k, (shade, (size, _)) in enumerate(zip(shades, groups, strict=True)):
        upto = np.concatenate([values for _, values in groups[k:]])
        label = rf"$\varepsilon$ = {size}" if len(groups) > 1 else None
        ax.hist(upto, RATIOS, color=color, alpha=float(shade), zorder=2, gid="ratio", label=label)
    if len(groups) > 1:
        ax.legend(loc="upper left", fontsize=7.5, frameon=False, reverse=True)
    share, ordered = ax.twinx(), np.sort(ratio[at])
    share.plot(ordered, np.arange(1, ordered.size + 1) / ordered.size, color=colors.INK, lw=1.0, gid="cumulative")
    share.set(ylim=(0.0, 1.05), ylabel="cumulative fraction")
    for count in MARKED:
        ax.axvline(count, color=colors.QUIET, lw=0.8, ls=":", zorder=1, gid=f"error {count}")
    ax.set_title(f"{100 * inside:.4g} % within the error", loc="right", color=colors.QUIET)
    ax.set_xticks([1e-3, 1e-2, 0.1, *MARKED], ["≤0.001", "0.01", "0.1", *map(str, MARKED)])
    ax.minorticks_off()
