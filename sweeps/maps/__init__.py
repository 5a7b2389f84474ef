"""Maps as `xarray` Datasets: made, opened, selected, summed up, verified."""
