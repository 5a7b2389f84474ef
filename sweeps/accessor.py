"""`ds.polhode`: pictures and words of a map, at hand on every Dataset once `sweeps` is imported."""

from sweeps import plot
from sweeps.awaited import once_loaded


class Polhode:
    """Pictures and words of a map; each picture is the function of `sweeps.plot` of that name.

    ds.polhode.stability(axis=2, at={"I3": 0.0175})
    print(ds.polhode.summary())
    """

    def __init__(self, ds):
        self._ds = ds

    def __dir__(self):
        return [*super().__dir__(), *plot.NAMES]

    def __getattr__(self, name: str):
        if name not in plot.NAMES:
            raise AttributeError(f"'polhode' has no {name!r}; it has summary, pictures, {', '.join(plot.NAMES)}")
        from functools import partial

        return partial(getattr(plot, name), self._ds)

    def pictures(self) -> list[str]:
        """Names of this map's pictures."""
        from sweeps.views import figures

        return list(figures.pictures(self._ds))

    def summary(self) -> str:
        """What `polhode show` says of this map, as text."""
        from io import StringIO

        from rich.console import Console

        from sweeps.maps import selection, summary
        from sweeps.views import textmap, told

        ds = summary.pointwise(self._ds)
        written = StringIO()
        console = Console(file=written, width=120)
        selection.nearest(ds, {})
        told.write(console, ds, summary.summarise(ds), textmap.draw(ds, {}, console.width))
        return written.getvalue()


def register() -> None:
    """Gives every Dataset `polhode`: now where xarray is loaded, else as soon as somebody loads it."""
    once_loaded("xarray", _give)


def _give(xr) -> None:
    if getattr(xr.Dataset, "polhode", None) is None:
        xr.register_dataset_accessor("polhode")(Polhode)
