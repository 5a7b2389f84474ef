"""Maps of regimes: colours that are deeper the faster a perturbation grows or decays, and their scale."""

import math
from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colorbar import make_axes
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sweeps.figure import canvas, colors, marks, sheets, wording
from sweeps.systems.presentation.appearance import Appearance, missing_words

SHADES = 6  # of a regime's colour, by the square root of the growth
HATCHES = {"asymptotically_stable": "....", "unstable": "////", "flutter": "xxxx", "period_doubling": "\\\\\\\\"}


def at_most(sizes: np.ndarray) -> float:
    """Return 1, 2 or 5 times a power of ten, above all sizes; 0 where none is positive."""
    most = float(np.nanmax(sizes, initial=0.0))
    if not most > 1e-9:  # rounding
        return 0.0
    power = 10.0 ** math.floor(math.log10(most))
    return next(n * power for n in (1, 2, 5, 10) if n * power >= most)


def rated(names: Sequence[str]) -> list[int]:
    """Return the codes of the regimes that have a rate of growth or decay, of names in the order of codes from -1."""
    return [k - 1 for k, name in enumerate(names) if name in HATCHES]


def dots(
    ax: Axes, x: np.ndarray, y: np.ndarray, codes: np.ndarray, names: Sequence[str], appearance: Appearance, **marks
) -> None:
    """Draw points, those of each regime in its colour and named in the legend; names in the order of codes from 0."""
    for k, name in enumerate(names):
        if (at := codes == k).any():
            marker = {"color": appearance.color(name), "gid": name, "label": appearance.words(name)}
            ax.plot(x[at], y[at], "o", **{"mew": 0.0} | marker | marks)


def _middles(edges: np.ndarray) -> np.ndarray:
    """Return the middles between neighbours along each dimension."""
    for k in range(edges.ndim):
        edges = 0.5 * (np.delete(edges, 0, k) + np.delete(edges, -1, k))
    return edges


def _hatch_of(name: str) -> dict:
    """Return the hatch of a regime in a legend in print."""
    return {"hatch": HATCHES[name], "edgecolor": colors.INK, "lw": 0.0} if sheets.is_print() and name in HATCHES else {}


class Regimes:
    """The colours of regimes in the panels of one figure.

    Names are in the order of their codes from -1; growth or decay of `top` has the full colour, 0 shows none.
    """

    def __init__(self, names: Sequence[str], appearance: Appearance, top: float):
        self.names, self.appearance, self.top, self.rated, self.most = names[1:], appearance, top, rated(names), 0.0
        self.shades = marks.Shades([appearance.color(name) for name in self.names], SHADES).with_extremes(
            bad=colors.MISSING
        )
        self.seen: set[int] = set()
        self.shaded: set[int] = set()
        self.without: list[int] = []

    def _mesh(self, ax: Axes, x: np.ndarray, y: np.ndarray, code: np.ndarray, **props) -> None:
        norm = BoundaryNorm(np.arange(self.shades.N + 1) - 0.5, self.shades.N)
        ax.pcolormesh(x, y, code, cmap=self.shades, norm=norm, rasterized=True, **props)

    def paint(self, ax: Axes, x: np.ndarray, y: np.ndarray, regime: np.ndarray, growth: np.ndarray, status) -> None:
        """Draw cells in the colour of their regime, paler where |growth| is small, but for 0.

        x and y are the edges of the cells, shape (y, x), or the places of their corners.
        """
        size = np.where(np.isin(regime, self.rated), np.nan_to_num(np.abs(growth)), 0.0)
        depth = np.where(size > 0.0, np.sqrt(np.minimum(size / (self.top or 1.0), 1.0)), 1.0)
        code = regime * SHADES + np.minimum((depth * SHADES).astype(int), SHADES - 1)
        code = np.ma.masked_where(regime < 0, code)
        self._mesh(ax, x, y, code, gid="measured")
        if sheets.is_print():
            self._hatch(ax, x, y, regime)
        self.most = max(self.most, float(size.max(initial=0.0)))
        self.seen |= set(np.unique(regime[regime >= 0]).tolist())
        self.shaded |= set(np.unique(regime[(regime >= 0) & (size > 0.0)]).tolist())
        self.without += np.unique(status[regime < 0]).tolist()

    def explain(self, figure: Figure, axes: Iterable[Axes], label: str, more: Iterable[Patch] = ()) -> None:
        """Draw the scale of the shades beside the panels, and the legend of the regimes and of what else is drawn."""
        shaded = sorted(self.shaded) if self.top else []
        if shaded:
            scale, _ = make_axes(list(axes), fraction=0.05, pad=0.02, aspect=26 / len(shaded), shrink=0.8)
            steps = np.arange(SHADES)[:, None] + SHADES * np.array(shaded)
            self._mesh(scale, np.arange(len(shaded) + 1), np.linspace(0.0, 1.0, SHADES + 1), steps)
            ticks = [0.0, 0.5, 1.0]
            least, half, most = (wording.format_number(self.top * tick**2, 3) for tick in ticks)
            scale.set_yticks(ticks, [least, half, f"≥ {most}" if self.most > self.top else most])
            scale.yaxis.tick_right()
            scale.yaxis.set_label_position("right")
            scale.set(xticks=[], ylabel=label)
        names = [(name, self.appearance.words(name)) for name in (self.names[k] for k in sorted(self.seen))]
        handles = [
            Patch(facecolor=self.appearance.color(name), label=words, **_hatch_of(name)) for name, words in names
        ]
        if self.without:
            handles.append(Patch(facecolor=colors.MISSING, label=missing_words(self.without)))
        canvas.draw_legend(figure, [*handles, *more])

    def _hatch(self, ax: Axes, x: np.ndarray, y: np.ndarray, regime: np.ndarray) -> None:
        """Hatch the cells of regimes: in grey, a colour's shades are those of any other."""
        for k, name in enumerate(self.names):
            chosen = (regime == k).astype(float)
            if name in HATCHES and chosen.any() and min(chosen.shape) > 1:
                ax.contourf(_middles(x), _middles(y), chosen, [0.5, 1.5], colors="none", hatches=[HATCHES[name]])
