"""Maps with legal but odd values: every view of them succeeds, or refuses with a message."""

import random
from functools import cache

import damages
import numpy as np
import pytest
import repeated
from maps import write

import sweeps
from sweeps import systems
from sweeps.maps import storage

VALUES = {
    "missing": np.nan,
    "zero": 0.0,
    "tiny": 5e-324,
    "small": 1e-300,
    "huge": 1.7e308,
    "hugely negative": -1.7e308,
    "infinite": np.inf,
    "one": 1.0,
}


def of_value(name):
    """Give all variables one value, and all flags one meaning."""

    def change(ds, specs, rng):
        return {n: np.full(v.shape, rng.choice(flags(specs[n])) if flags(specs[n]) else VALUES[name]) for n, v in ds}

    return change


def flags(spec):
    return range(0) if spec is None else range(spec.first_flag, spec.first_flag + len(spec.flags))


def mix_values(ds, specs, rng):
    """Give each value of each variable another size, sign or flag."""
    columns = {}
    for name, v in ds:
        choices = [*flags(specs[name])] or [*VALUES.values(), -1.0, 1e-8, 1e8, -5e-324]
        columns[name] = np.array(rng.choices(choices, k=v.size)).reshape(v.shape)
    return columns


def holes(ds, specs, rng):
    """Leave out each value with a probability of its variable."""
    shares = {n: rng.random() for n, _ in ds}
    return {
        n: np.where(np.array([rng.random() < shares[n] for _ in range(v.size)]).reshape(v.shape), np.nan, v.values)
        for n, v in ds
        if not flags(specs[n]) and v.dtype.kind == "f"
    }


def keep_values(ds, specs, rng):
    return {}


CHANGES = {name: of_value(name) for name in VALUES} | {"mixed": mix_values, "holes": holes, "as it is": keep_values}


def one_point(ds, rng):
    return {dim: [rng.randrange(size)] for dim, size in ds.sizes.items()}


def one_value(ds, rng):
    dim = rng.choice([*ds.sizes])
    return {dim: [rng.randrange(ds.sizes[dim])]}


def reverse_dims(ds, rng):
    return {dim: slice(None, None, -1) for dim in ds.dims if ds[dim].dtype.kind == "f" and rng.random() < 0.5}


CUTS = {
    "whole": lambda ds, rng: {},
    "one point": one_point,
    "one value of a dimension": one_value,
    "in another order": reverse_dims,
    "a plane": lambda ds, rng: {dim: [0] for dim in [*ds.sizes][2:]},
}


QUICK = [("pendulum", "one point", "missing"), ("pendulum", "one value of a dimension", "mixed")]
CASES = [  # (base, cut, change)
    *QUICK,
    ("pendulum", "one point", "as it is"),
    ("pendulum", "a plane", "huge"),
    ("pendulum", "in another order", "holes"),
    ("pendulum", "whole", "tiny"),
    ("bodies", "a plane", "zero"),  # once a traceback, as in the cases below: a rate of 0 that is called unstable
    ("twist", "whole", "infinite"),  # limits of axes
    ("sampled", "in another order", "mixed"),  # edges of a histogram
    ("tumbling", "whole", "missing"),  # a logarithmic axis
    ("foucault", "in another order", "mixed"),  # the number of a shade
]


@pytest.fixture(scope="module")
def make_map(tmp_path_factory):
    """Return the function that makes the map of a system once."""
    with damages.light():
        yield cache(lambda base: write(tmp_path_factory.mktemp("base"), damages.BASES[base], f"{base}.nc"))


def odd(path, target, cut, change, seed):
    """Write an odd map; the layout stays that of its system."""
    rng = random.Random(seed)
    with sweeps.open_map(path) as ds:
        ds = ds.load().drop_encoding()
    inner_dims = {dim for spec in systems.of_map(ds).layout().variables.values() for dim in spec.over}
    ds = ds.isel({dim: at for dim, at in CUTS[cut](ds, rng).items() if dim not in inner_dims})
    specs = {n: systems.of_map(ds).layout().variables.get(n) for n in ds}
    columns = CHANGES[change]([*ds.data_vars.items()], specs, rng)
    with np.errstate(all="ignore"):  # of whole numbers
        variables = {n: (ds[n].dims, v.astype(ds[n].dtype), ds[n].attrs) for n, v in columns.items()}
    storage.write_map(ds.assign(variables), target)


@pytest.mark.usefixtures("few_frames")
@pytest.mark.parametrize("case", repeated.but(QUICK, CASES), ids=" ".join)
def test_odd_maps_are_shown_or_refused_in_words(case, make_map, tmp_path, monkeypatch):
    base, cut, change = case
    monkeypatch.chdir(tmp_path)
    odd(make_map(base), tmp_path / "map.nc", cut, change, f"{cut} {change}")
    assert damages.one_by_one(damages.commands(tmp_path / "map.nc")) == {}
