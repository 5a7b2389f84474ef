"""Maps as xarray Datasets: read, checked, selected, summarised, verified."""
