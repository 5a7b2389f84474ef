"""Bodies in rows: how likely each spin is unstable, and how fast it would go."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweeps.figure import colors, style

MOST_BODIES = 40
OFFSETS = {1: -0.22, 2: 0.0, 3: 0.22}


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw the probability of instability and the range of the growth rate, per body and axis."""
    part = ds.isel({dim: 0 for dim in ("omega0", "epsilon", "phase") if dim in ds.dims})
    bodies = part.sizes["body"]
    part = part.isel(body=slice(MOST_BODIES)).load()
    more = f"; the first {MOST_BODIES} of {bodies:,} bodies" if bodies > MOST_BODIES else ""
    bars = "bars: standard errors (left), 5 to 95 % of the draws about their median (right)"
    subtitle = f"{ds.attrs.get('title', '')}\neach draw measured; {bars}{more}"
    rows, columns, size = style.arranged(2, (4.3, 0.5 + 0.42 * part.sizes["body"]), (1.0, 1.4))
    figure = style.canvas(*size, "Probability that each spin is unstable", subtitle, ax=ax)
    likely, rates = figure.subplots(rows, columns, sharey=True)
    handles = [_axis(likely, rates, part.sel(axis=axis), axis) for axis in part["axis"].values.tolist()]
    likely.set(xlim=(-0.03, 1.03), xlabel="probability that the spin is unstable")
    rates.set(xlabel=r"growth rate over the spin rate, $\sigma/\omega_0$", xlim=(-0.02, None))
    likely.set_yticks(range(part.sizes["body"]), [str(name)[:30] for name in part["body"].values])
    likely.set_ylim(part.sizes["body"] - 0.5, -0.5)
    for ax in (likely, rates):
        ax.grid(axis="x", color=colors.FAINT, linewidth=0.5)
    style.legend(figure, handles)
    return figure


def _axis(likely, rates, part: xr.Dataset, axis: int):
    rows = np.arange(part.sizes["body"]) + OFFSETS[axis]
    color = colors.SERIES_COLORS[axis - 1]
    p = part["probability_unstable"].values
    likely.errorbar(p, rows, xerr=part["probability_unstable_error"].values, fmt="o", ms=4, color=color, gid="likely")
    quantiles = part["growth_rate_quantile"] / np.abs(part["omega0"])
    low, middle, high = (quantiles.sel(quantile=level).values for level in (0.05, 0.5, 0.95))
    rates.hlines(rows, low, high, color=color, linewidth=2)
    return rates.plot(middle, rows, "o", ms=4, color=color, label=f"about axis {axis}")[0]
