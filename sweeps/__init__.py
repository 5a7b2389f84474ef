"""Everything of Polhode with a name, a unit or a file: definitions, grids, datasets, storage, figures.

import sweeps
ds = sweeps.survey("sweeps/definitions/tiny.yaml")
ds = sweeps.open_map("results/tiny/stability_map.nc")
"""


def __getattr__(name: str) -> str:
    """`sweeps.__version__`, looked up when it is asked for."""
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import version

    return version("polhode")


def survey(definition, *, chunks=None, threads: int = 1):
    """Measures a sweep and returns its map as an `xarray.Dataset`.

    Args:
        definition: the path of a definition, the name of one that ships, or a mapping with its keys.
        chunks: None computes at once. A mapping of dimension to length, a number of points, or "auto" makes the
            Dataset lazy (Dask), to be computed by whatever scheduler is active.
        threads: threads that share the work where it is not lazy.

    Returns:
        The Dataset of results/README.md: variables over (axis, I1, I2, I3, omega0, epsilon, phase), or over
        (body, axis, …). Without `chunks` it carries its content hash.

    Raises:
        DefinitionError: naming key, value and what is allowed.
    """
    from collections.abc import Mapping

    from sweeps.maps import dataset
    from sweeps.points import catalogue
    from sweeps.points.loading import read
    from sweeps.shards import content

    source = definition if isinstance(definition, Mapping) else catalogue.resolve(str(definition))
    ds = dataset.survey_grid(read(source), chunks, threads)
    return ds if chunks is not None else ds.assign_attrs(content_hash=content.content_hash(ds))


def open_map(path, **options):
    """Opens a map with checks that say what is wrong; see `sweeps.maps.storage.open_map`."""
    from sweeps.maps import storage

    return storage.open_map(path, **options)
