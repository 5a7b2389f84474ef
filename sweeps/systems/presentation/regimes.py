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

SHADES = 6  # shades per regime, deeper with the square root of the growth
MIN_FINE_CELLS = 100  # cells per side of a panel; beyond, single cells are as narrow as lines, and not in the legend
HATCHES = {"asymptotically_stable": "....", "unstable": "////", "flutter": "xxxx", "period_doubling": "\\\\\\\\"}


def round_up(sizes: np.ndarray) -> float:
    """Return the least of 1, 2 or 5 times a power of ten that bounds all sizes; 0 if all are 0."""
    maximum = float(np.nanmax(sizes, initial=0.0))
    if not 0.0 < maximum < math.inf:
        return 0.0
    power = 10.0 ** math.floor(math.log10(maximum))
    return next(n * power for n in (1, 2, 5, 10) if n * power >= maximum)


def regimes_with_rate(names: Sequence[str]) -> list[int]:
    """Return the codes of the regimes that grow or decay at a rate; `names` are in the order of codes from -1."""
    return [k - 1 for k, name in enumerate(names) if name in HATCHES]


def draw_points(
    ax: Axes, x: np.ndarray, y: np.ndarray, codes: np.ndarray, names: Sequence[str], appearance: Appearance, **marks
) -> None:
    """Draw points in the colours of their regimes, which the legend names.

    Args:
        ax: the panel.
        x: coordinates, shape (n,).
        y: coordinates, shape (n,).
        codes: code of each point's regime, shape (n,).
        names: names of the regimes, in the order of codes from 0.
        appearance: words and colours of the regimes.
        **marks: properties of Matplotlib's markers.
    """
    for k, name in enumerate(names):
        if (is_regime := codes == k).any():
            marker = {"color": appearance.color(name), "gid": name, "label": appearance.words(name)}
            ax.plot(x[is_regime], y[is_regime], "o", **{"mew": 0.0} | marker | marks)


def _middles(edges: np.ndarray) -> np.ndarray:
    """Return the middles between neighbours along each dimension."""
    for k in range(edges.ndim):
        edges = 0.5 * (np.delete(edges, 0, k) + np.delete(edges, -1, k))
    return edges


def _hatch_of(name: str) -> dict:
    """Return the properties of a regime's patch in a printed legend."""
    return {"hatch": HATCHES[name], "edgecolor": colors.INK, "lw": 0.0} if sheets.is_print() and name in HATCHES else {}


class Regimes:
    """Colours of regimes in the panels of one figure.

    Names are in the order of their codes from -1; growth or decay of `top` has the full colour, and with 0 no cell is
    paler.
    """

    def __init__(self, names: Sequence[str], appearance: Appearance, top: float):
        self.names, self.appearance, self.top, self.with_rate = names[1:], appearance, top, regimes_with_rate(names)
        self.max_growth = 0.0
        self.shades = marks.Shades([appearance.color(name) for name in self.names], SHADES).with_extremes(
            bad=colors.MISSING
        )
        self.drawn_codes: set[int] = set()
        self.shaded_codes: set[int] = set()
        self.missing_statuses: list[int] = []

    def _mesh(self, ax: Axes, x: np.ndarray, y: np.ndarray, code: np.ndarray, **props) -> None:
        norm = BoundaryNorm(np.arange(self.shades.N + 1) - 0.5, self.shades.N)
        ax.pcolormesh(x, y, code, cmap=self.shades, norm=norm, rasterized=True, **props)

    def paint(self, ax: Axes, x: np.ndarray, y: np.ndarray, regime: np.ndarray, growth: np.ndarray, status) -> None:
        """Draw cells in the colour of their regime, paler for small |growth|, except 0.

        Args:
            ax: the panel.
            x: edges of the cells, shape (x + 1,), or their corners, shape (y + 1, x + 1).
            y: edges of the cells, shape (y + 1,), or their corners, shape (y + 1, x + 1).
            regime: codes, shape (y, x); -1 if undetermined.
            growth: growth rate (> 0) or decay rate (< 0), shape (y, x), in the unit of `top`.
            status: status codes, shape (y, x).
        """
        size = np.where(np.isin(regime, self.with_rate), np.nan_to_num(np.abs(growth)), 0.0)
        depth = np.where(size > 0.0, np.sqrt(np.minimum(size / (self.top or 1.0), 1.0)), 1.0)
        code = regime * SHADES + np.minimum((depth * SHADES).astype(int), SHADES - 1)
        code = np.ma.masked_where(regime < 0, code)
        self._mesh(ax, x, y, code, gid="measured")
        if sheets.is_print():
            self._hatch(ax, x, y, regime)
        self.max_growth = max(self.max_growth, float(size.max(initial=0.0)))
        is_visible = regime >= 0
        if min(regime.shape) > MIN_FINE_CELLS:
            is_visible[:-1, :-1] &= (regime[:-1, :-1] == regime[1:, :-1]) & (regime[:-1, :-1] == regime[:-1, 1:])
        self.drawn_codes |= set(np.unique(regime[is_visible]).tolist())
        self.shaded_codes |= set(np.unique(regime[(regime >= 0) & (size > 0.0)]).tolist())
        self.missing_statuses += np.unique(status[regime < 0]).tolist()

    def explain(self, figure: Figure, axes: Iterable[Axes], label: str, more_handles: Iterable[Patch] = ()) -> None:
        """Draw the scale of the shades next to the panels, and the legend.

        Args:
            figure: the figure.
            axes: its panels.
            label: name of the growth on the scale.
            more_handles: legend entries in addition to those of the regimes.
        """
        shaded_names = sorted(self.shaded_codes) if self.top else []
        if shaded_names:
            scale, _ = make_axes(list(axes), fraction=0.05, pad=0.02, aspect=26 / len(shaded_names), shrink=0.8)
            steps = np.arange(SHADES)[:, None] + SHADES * np.array(shaded_names)
            self._mesh(scale, np.arange(len(shaded_names) + 1), np.linspace(0.0, 1.0, SHADES + 1), steps)
            ticks = [0.0, 0.5, 1.0]
            zero, quarter, full = (wording.format_number(self.top * tick**2, 3) for tick in ticks)
            scale.set_yticks(ticks, [zero, quarter, f"≥ {full}" if self.max_growth > self.top else full])
            scale.yaxis.tick_right()
            scale.yaxis.set_label_position("right")
            scale.set(xticks=[], ylabel=label)
        names = [(name, self.appearance.words(name)) for name in (self.names[k] for k in sorted(self.drawn_codes))]
        handles = [
            Patch(facecolor=self.appearance.color(name), label=words, **_hatch_of(name)) for name, words in names
        ]
        if self.missing_statuses:
            handles.append(Patch(facecolor=colors.MISSING, label=missing_words(self.missing_statuses)))
        canvas.draw_legend(figure, [*handles, *more_handles])

    def _hatch(self, ax: Axes, x: np.ndarray, y: np.ndarray, regime: np.ndarray) -> None:
        """Hatch the cells of regimes, as their colours in grey cannot be distinguished."""
        for k, name in enumerate(self.names):
            cells = (regime == k).astype(float)
            if name in HATCHES and cells.any() and min(cells.shape) > 1:
                ax.contourf(_middles(x), _middles(y), cells, [0.5, 1.5], colors="none", hatches=[HATCHES[name]])
