import dask
import numpy as np
import pytest
import repeated
import xarray as xr
from maps import assert_same_bits

import sweeps
from kernels.near_axis import survey as kernel
from sweeps.points import catalogue
from sweeps.points.loading import read_sweep
from sweeps.reading.definitions import plain, read_text
from sweeps.shards import content_hash
from sweeps.systems.rigid_body import system as rigid_body

TINY = catalogue.shipped_files()["tiny"]

FLAGS = {
    "regime_theory": {0: "stable_minor", 1: "stable_major", 2: "unstable", 3: "marginal", 4: "sphere"},
    "regime": {-1: "undetermined", 0: "stable_minor", 1: "stable_major", 2: "unstable", 3: "marginal", 4: "sphere"},
    "encircles": {0: "none", 1: "minor_axis", 2: "major_axis", 3: "separatrix"},
    "shape": {0: "asymmetric", 1: "oblate", 2: "prolate", 3: "sphere"},
    "status": {0: "ok", 1: "short_window", 2: "not_converged", 3: "non_finite"},
}


def test_variables_flags_and_coordinates_are_those_of_the_contract(tiny):
    """results/README.md, which a test compares with the tables, is the public contract."""
    tables = rigid_body.VARIABLES | rigid_body.CERTIFICATE
    assert set(tiny.data_vars) == set(tables)
    for name, spec in tables.items():
        variable = tiny[name]
        assert variable.sizes == {"axis": 3, "I1": 4, "I2": 4, "I3": 3, "omega0": 3, "epsilon": 2, "phase": 1}
        assert (variable.attrs.get("units"), variable.attrs["long_name"]) == (spec.units, spec.long_name)
        assert variable.dtype == spec.dtype, name
    for name, meanings in FLAGS.items():
        attributes = tiny[name].attrs
        words = attributes["flag_meanings"].split()
        assert dict(zip(attributes["flag_values"].tolist(), words, strict=True)) == meanings
        assert attributes["flag_values"].dtype == tiny[name].dtype  # CF-1.11, section 3.5
        assert set(np.unique(tiny[name])) <= set(meanings)
    units = {"axis": "1", "omega0": "rad s-1", "epsilon": "1", "phase": "rad"}
    units |= dict.fromkeys(("I1", "I2", "I3"), "kg m2")
    assert {str(name): coordinate.attrs["units"] for name, coordinate in tiny.coords.items()} == units
    assert (tiny.title, tiny.Conventions) == ("One example of each symmetry class", "CF-1.11")
    assert tiny.contract_version.split(".")[0] == "3"
    assert tiny.definition == read_sweep(TINY).definition.text


def test_values_sit_at_their_coordinates(tiny):
    """Euler's linear theory, Ω² = ω0² (Ia − Ib)(Ia − Ic)/(Ib Ic), from the coordinates by xarray's own broadcasting."""
    moments = [tiny.I1, tiny.I2, tiny.I3]
    expected = []
    for axis in (1, 2, 3):
        a, b, c = moments[axis - 1], moments[axis % 3], moments[(axis + 1) % 3]
        expected.append(tiny.omega0**2 * (a - b) * (a - c) / (b * c))
    expected = xr.concat(expected, xr.DataArray([1, 2, 3], dims="axis", name="axis"))
    values = tiny.omega_squared_theory
    # six roundings of the formula, each half a unit in the last place
    xr.testing.assert_allclose(values, expected.broadcast_like(values).transpose(*values.dims), rtol=4e-15, atol=0)
    total = tiny.I1 + tiny.I2 + tiny.I3
    margin = (total - 2 * xr.concat(xr.broadcast(*moments), "moment").max("moment")) / total
    values = tiny.triangle_margin
    # a float32 of at most 1/3
    xr.testing.assert_allclose(values, margin.broadcast_like(values).transpose(*values.dims), rtol=0, atol=2e-8)


@pytest.mark.parametrize("chunks", repeated.but(["auto"], ["auto", 150, {"axis": 2, "omega0": 2, "I3": 3}]))
def test_lazy_equals_eager_bit_for_bit(tiny, chunks):
    lazy = sweeps.survey("tiny", chunks=chunks)
    assert all(dask.is_dask_collection(lazy[name].data) for name in lazy.data_vars)
    assert "content_hash" not in lazy.attrs
    with dask.config.set(scheduler="threads", num_workers=2):
        assert content_hash.content_hash(lazy) == tiny.attrs["content_hash"]
        assert_same_bits(lazy.compute(), tiny)


def test_chunks_are_those_asked_for():
    lazy = sweeps.survey("tiny", chunks={"I1": 1, "omega0": 2})
    assert lazy.omega_squared.chunksizes["I1"] == (1, 1, 1, 1)
    assert lazy.omega_squared.chunksizes["omega0"] == (2, 1)
    assert lazy.omega_squared.chunksizes["axis"] == (3,)
    data = sweeps.survey("tiny", chunks=100).omega_squared.data
    assert max(np.prod([max(c) for c in data.chunks]), 1) <= 100
    with pytest.raises(ValueError, match=r"\['I4'\].*allowed: axis, I1"):
        sweeps.survey("tiny", chunks={"I4": 1})


def test_one_point_of_a_lazy_map_runs_one_chunk(tiny, monkeypatch):
    points = []
    survey = kernel.survey
    monkeypatch.setattr(
        kernel,
        "survey",
        lambda columns, *rest, **more: points.append(columns["I1"].size) or survey(columns, *rest, **more),
    )
    lazy = sweeps.survey("tiny", chunks={"I1": 1, "I2": 1, "axis": 1})
    assert points == []
    value = lazy.omega_squared[2, 1, 3].values
    assert points == [3 * 3 * 2 * 1]
    assert value.tobytes() == tiny.omega_squared[2, 1, 3].values.tobytes()


def test_bodies_have_the_values_of_the_same_bodies_in_a_grid():
    grid = {"omega0": [1.0, 2.0, -5.0], "phase": [0.1, 0.2]}
    bodies = [{"name": "a", "I1": 1.0, "I2": 2.0, "I3": 2.5}, {"name": "Mond, größer", "I1": 1.0, "I2": 1.0, "I3": 1.5}]
    ds = sweeps.survey({"bodies": bodies, "grid": grid})
    assert ds.omega_squared.dims == ("body", "axis", "omega0", "epsilon", "phase")
    assert ds.body.values.tolist() == ["a", "Mond, größer"]
    alone = sweeps.survey({"grid": {"I1": 1.0, "I2": 2.0, "I3": 2.5, **grid}})
    for name in ds.data_vars:
        assert ds[name][0].values.tobytes() == alone[name].values.tobytes(), name


def test_chosen_variables_are_made_alone_and_are_the_same(tiny):
    names = ["omega_squared", "regime", "propagation_error"]
    mapping = plain(read_text(TINY.read_text())) | {"integration": {"variables": names}}
    selection = sweeps.survey(mapping)
    assert sorted(selection.data_vars) == sorted(names)
    for name in names:
        assert selection[name].values.tobytes() == tiny[name].values.tobytes()


def test_a_collapsed_sweep_is_the_full_one():
    spins = [-3.0, 0.5, 1.0, 2.0, 7.0]
    grid = {"I1": [0.5, 1.0, 2.0], "I2": [0.7, 1.4, 2.8], "I3": [0.6, 1.2], "omega0": spins, "epsilon": [1e-6, 1e-2]}
    full, collapsed_map = (sweeps.survey({"grid": grid, "integration": {"collapse": flag}}) for flag in (False, True))
    spin = abs(full.omega0)
    difference = abs(collapsed_map.omega_squared - full.omega_squared) / spin**2
    assert float(difference.max()) <= 1e-12
    for name in full.data_vars:
        if full[name].dtype.kind == "i":
            np.testing.assert_array_equal(collapsed_map[name], full[name], err_msg=name)
