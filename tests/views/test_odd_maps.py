"""Maps with legal but odd values: every view of them succeeds, or refuses with a message."""

import random

import damages
import numpy as np
import pytest
import repeated
from maps import random_map

from sweeps import systems
from sweeps.maps import storage

VALUES = {"missing": np.nan, "zero": 0.0, "infinite": np.inf}
SIZES = [*VALUES.values(), 5e-324, -5e-324, 1e-300, 1e-8, 1.0, -1.0, 1e8, 1.7e308, -1.7e308]


def flags(spec):
    return range(0) if spec is None else range(spec.first_flag, spec.first_flag + len(spec.flags))


def change(variable, spec, kind, rng):
    """Return values of a variable: all of one size and one flag; or "mixed", another size, sign or flag for each."""
    if kind == "mixed":
        return np.array(rng.choices([*flags(spec)] or SIZES, k=variable.size)).reshape(variable.shape)
    return np.full(variable.shape, rng.choice(flags(spec)) if flags(spec) else VALUES[kind])


def one_value(ds, rng):
    dim = rng.choice([*ds.sizes])
    return {dim: [rng.randrange(ds.sizes[dim])]}


def reverse_dims(ds, rng):
    return {dim: slice(None, None, -1) for dim in ds.dims if ds[dim].dtype.kind == "f" and rng.random() < 0.5}


CUTS = {
    "whole": lambda ds, rng: {},
    "one value of a dimension": one_value,
    "in another order": reverse_dims,
    "a plane": lambda ds, rng: {dim: [0] for dim in [*ds.sizes][2:]},
}
QUICK = [("pendulum", "one value of a dimension", "mixed")]
CASES = [  # (base, cut, change); all but the first were once a traceback
    *QUICK,
    ("bodies", "a plane", "zero"),  # a rate of 0 that is called unstable
    ("twist", "whole", "infinite"),  # limits of axes
    ("sampled", "in another order", "mixed"),  # edges of a histogram
    ("tumbling", "whole", "missing"),  # a logarithmic axis
    ("foucault", "in another order", "mixed"),  # the number of a shade
]


@pytest.fixture
def light():
    with damages.light():
        yield


def odd(base, target, cut, kind):
    """Write an odd map; the layout stays that of its system."""
    rng, ds = random.Random(f"{cut} {kind}"), random_map(damages.BASES[base])
    inner_dims = {dim for spec in systems.of_map(ds).layout().variables.values() for dim in spec.over}
    ds = ds.isel({dim: at for dim, at in CUTS[cut](ds, rng).items() if dim not in inner_dims})
    specs = systems.of_map(ds).layout().variables
    columns = {n: change(variable, specs.get(n), kind, rng) for n, variable in ds.data_vars.items()}
    with np.errstate(all="ignore"):  # of whole numbers
        variables = {n: (ds[n].dims, v.astype(ds[n].dtype), ds[n].attrs) for n, v in columns.items()}
    storage.write_map(ds.assign(variables), target)


@pytest.mark.usefixtures("few_frames", "light")
@pytest.mark.parametrize("case", repeated.but(QUICK, CASES), ids=" ".join)
def test_odd_maps_are_shown_or_refused_in_words(case, tmp_path, monkeypatch):
    base, cut, kind = case
    monkeypatch.chdir(tmp_path)
    odd(base, tmp_path / "map.nc", cut, kind)
    assert damages.one_by_one(damages.commands(tmp_path / "map.nc")) == {}
