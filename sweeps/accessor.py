"""Register `ds.polhode`, the accessor of `sweeps.plot.Polhode`, on every `xarray.Dataset`.

`sweeps.survey`, `sweeps.open_map` and each function of `sweeps.plot` do so too, and `import sweeps` where xarray is
loaded already. Import this module for a Dataset that xarray has opened by itself.
"""

from sweeps import plot

plot.register()
