"""The report as text: its sentences, its packed numbers, and that no text of a map becomes markup."""

import base64
import math
import re
import zlib

import numpy as np
import pytest
import repeated
import xarray as xr
from report_pages import HOSTILE, PLANE, data_of, hostile, write_report

import sweeps
from sweeps import systems
from sweeps.maps import summary as maps_summary
from sweeps.maps.description import MapDescription
from sweeps.systems.presentation.moving import equations
from sweeps.systems.uncertain_bodies.presentation import page as drawn
from sweeps.views import plotly, report, report_columns


def gather_columns(ds):
    """The totals of a map, its columns, and the indices kept along each dimension."""
    return report_columns.read_columns(ds, MapDescription(ds))


def unpack(column, ds, indices_of):
    """The numbers of a packed column over all its points, by NumPy and zlib."""
    raw = zlib.decompress(base64.b64decode(column.text))
    dtype = np.dtype(f"<{column.dtype}")
    values = np.frombuffer(raw, "u1").reshape(dtype.itemsize, -1).T.reshape(-1).view(dtype).reshape(column.shape)
    values = values.astype("f8") * 2.0**column.exponent
    for k, (dim, indices) in enumerate(indices_of.items()):
        if column.powers.get(dim):
            shape = [-1 if i == k else 1 for i in range(len(indices_of))]
            values = values * (np.abs(ds[dim].values[indices]) ** -float(column.powers[dim])).reshape(shape)
    return np.broadcast_to(values, [len(indices) for indices in indices_of.values()])


@pytest.mark.parametrize(("bits", "tolerance"), [(53, 3e-11), (24, 6e-8), (15, 2.0**-15)])
def test_packed_columns_hold_the_map(plane, bits, tolerance):
    """3e-11: laws are believed to 1e-11 each, along at most three dimensions; else half a unit of the last bit."""
    _, columns, indices = gather_columns(plane)
    for column in report_columns.scaling_laws(MapDescription(plane), columns, indices):
        numbers = unpack(report_columns.pack_column(column, bits), plane, indices)
        np.testing.assert_allclose(numbers, plane[column.name].values, rtol=tolerance + 1e-11, err_msg=column.name)


def test_scaling_laws_are_those_of_the_physics(plane):
    """The rate's square goes as the spin rate's square, a time as its inverse; the triangle depends on no axis."""
    _, columns, indices = gather_columns(plane)
    laws = {
        column.name: column.powers for column in report_columns.scaling_laws(MapDescription(plane), columns, indices)
    }
    assert laws["omega_squared"]["omega0"] == -2
    assert laws["window_end"]["omega0"] == 1
    assert laws["triangle_margin"] == {"axis": 0, "omega0": 0}
    assert "I1" not in laws["omega_squared"]


def test_a_law_that_fails_at_one_point_or_overflows_is_no_law():
    for odd in (1.0 + 1e-9, np.nan):
        values = np.ones((3, 5))
        values[2, 3] = odd
        assert report_columns.reduce_column("x", values, {"a": None, "b": None}).powers == {}
    values = np.array([1.5e308, 1.6e308])
    assert report_columns.reduce_column("x", values, {"a": np.array([10.0, 20.0])}).powers == {}


def test_numbers_beyond_single_precision_stay_doubles():
    column = report_columns.PageColumn("x", np.array([1e-200, 1.0, 1e200]))
    data = report_columns.pack_column(column, 24)
    assert data.dtype == "f8"
    scaled = report_columns.pack_column(report_columns.PageColumn("x", np.array([1e199, 1.0e200, np.inf, np.nan])), 24)
    assert scaled.dtype == "f4"
    ds = xr.Dataset(coords={"d": [1.0, 2.0, 3.0, 4.0]})
    values = unpack(scaled, ds, {"d": np.arange(4)})
    np.testing.assert_allclose(values, [1e199, 1e200, np.inf, np.nan], rtol=6e-8)  # half a unit of a float32


def test_thinning_keeps_the_ends_and_what_is_no_number():
    indices = report_columns.thin_dimensions(
        {"axis": 3, "I1": 500, "I2": 400, "omega0": 30}, {"I1", "I2", "omega0"}, 50_000
    )
    assert math.prod(map(len, indices.values())) <= 50_000
    assert len(indices["axis"]) == 3
    for name, size in (("I1", 500), ("I2", 400), ("omega0", 30)):
        assert indices[name][0] == 0
        assert indices[name][-1] == size - 1
    assert len(indices["I1"]) > len(indices["omega0"])


def test_a_map_too_large_is_thinned_and_says_so(plane, tmp_path):
    full_page = write_report(plane, tmp_path / "whole.html")
    limit = len(full_page.encode()) - 75_000  # of 100 kB of numbers; shorter numbers save 40
    thin = write_report(plane, tmp_path / "thin.html", limit=limit)
    assert len(thin.encode()) <= limit
    assert "The map is larger than a page" in thin
    assert "The map is larger than a page" not in full_page
    data = data_of(thin)
    num_points = math.prod(dim["size"] for dim in data["dims"])
    assert f"{num_points:,} of its 1,296 points" in thin
    for dim in data["dims"]:
        values = data["coordinates"][dim["name"]]["values"]
        assert len(values) == dim["size"]
        assert set(values) <= set(plane[dim["name"]].values.tolist())


def test_a_limit_that_no_point_meets_is_refused(plane, tmp_path):
    with pytest.raises(ValueError, match="limit"):
        report.write_report(plane, tmp_path / "r.html", limit=500_000)
    assert list(tmp_path.iterdir()) == []


def test_deviations_from_theory_are_those_of_the_map(plane):
    summary, _, _ = gather_columns(plane)
    agreement = summary.deviations["omega_squared_theory", "omega_squared"]
    theory, measured = plane.omega_squared_theory.values, plane.omega_squared.values
    is_same_regime = (plane.regime.values == plane.regime_theory.values) & (plane.regime.values != 3)
    is_compared = (theory != 0) & is_same_regime & (plane.status.values == 0)
    deviation = np.abs(measured[is_compared] - theory[is_compared]) / np.abs(theory[is_compared])
    assert agreement.total == deviation.size
    assert agreement.worst.value == deviation.max()
    for share in (0.5, 0.99):
        true = np.quantile(deviation, share, method="inverted_cdf")
        assert true <= agreement.quantile(share) <= true * 10 ** (1 / maps_summary.BINS_PER_DECADE)
    inside = np.abs(measured - theory)[is_compared] <= plane.omega_squared_error.values[is_compared]
    assert agreement.num_within == inside.sum()


def cloud_of(facts, body, name, spin=0):
    """Numbers of a cloud as the page's facts pack them, by NumPy."""
    data = facts["drawn"]["bodies"][body]["columns"][name][spin]
    return np.frombuffer(base64.b64decode(data["values"]), "<f4").astype("f8") * data["scale"]


def test_draws_of_the_page_are_those_of_the_map(uncertain):
    """To half a unit of a float32. If the map stores no draws, the definition gives the same bodies."""
    facts_of_map = drawn.facts(uncertain)
    facts_of_definition = drawn.facts(uncertain.drop_dims("draw"))
    assert (facts_of_map["drawn"]["measured"], facts_of_definition["drawn"]["measured"]) == (True, False)
    spins = uncertain.isel(body=0).squeeze()
    for i in (1, 2, 3):
        for facts in (facts_of_map, facts_of_definition):
            np.testing.assert_allclose(cloud_of(facts, "a_box", f"I{i}_draw"), spins[f"I{i}_draw"][0], rtol=6e-8)
    rates = spins.growth_rate_draw.values
    for spin in range(3):
        atol = 6e-8 * rates[spin].max()
        np.testing.assert_allclose(cloud_of(facts_of_map, "a_box", "growth_rate_draw", spin), rates[spin], atol=atol)
    quantiles = np.array(facts_of_map["spread"]["growth_rate_quantile"])
    np.testing.assert_allclose(quantiles, spins.growth_rate_quantile, rtol=1e-5)


def test_a_cloud_of_many_draws_is_thinned_by_a_seed_and_says_so(uncertain, monkeypatch):
    full_cloud = drawn.facts(uncertain)["drawn"]["bodies"]["a_box"]
    monkeypatch.setattr(drawn, "MAX_SHOWN", 60)
    thin_cloud = drawn.facts(uncertain)["drawn"]["bodies"]["a_box"]
    assert (thin_cloud["shown"], thin_cloud["of"], full_cloud["shown"]) == (60, 100, 100)
    assert len(set(thin_cloud["numbers"])) == 60
    first = uncertain.I1_draw.isel(body=0).squeeze()[0]
    values = cloud_of(drawn.facts(uncertain), "a_box", "I1_draw")
    np.testing.assert_allclose(values, first.sel(draw=thin_cloud["numbers"]), rtol=6e-8)
    monkeypatch.setattr(drawn, "MAX_CLOUD_NUMBERS", 100)
    assert drawn.facts(uncertain)["drawn"] == {}


@pytest.mark.parametrize("definition", ["", "[", "bodies: 7", "bodies: [{name: a_box, mesh: {file: /nowhere}}]"])
def test_a_definition_that_draws_nothing_makes_no_cloud(uncertain, definition):
    ds = uncertain.drop_dims("draw").assign_attrs(definition=definition)
    assert drawn.facts(ds)["drawn"] == {}


def test_no_text_of_a_map_becomes_markup(breakdown_map, tmp_path):
    html = write_report(hostile(breakdown_map), tmp_path / "r.html")
    assert "<script>globalThis.hostile" not in html
    assert "<img" not in html.lower().split("<script", 1)[0]
    assert data_of(html)["title"] == HOSTILE
    scripts = re.findall(r"<script[^>]*>", html)
    assert len(scripts) == 3 + len(data_of(html)["variables"])


def test_the_policy_names_the_scripts_and_forbids_the_rest(plane, tmp_path):
    html = write_report(plane, tmp_path / "r.html")
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', html)[1].replace("&#39;", "'")
    program = re.search(r'<script type="module">(.*?)</script>', html, re.DOTALL)[1]
    assert report._policy_hash(program) in policy
    assert "default-src 'none'" in policy
    assert "unsafe-inline" not in policy.split("style-src")[0]
    assert "unsafe-eval" not in policy


def symbols_of(tree):
    """Names of the symbols in a tree of the page's."""
    if isinstance(tree, list):
        return set().union(*map(symbols_of, tree[1:]))
    return {tree} if isinstance(tree, str) else set()


QUICK = ("double_pendulum", "foucault", "gyrostat", "lagrange_points", "paul_trap")


@pytest.mark.parametrize("name", repeated.but(QUICK, sorted({*systems.system_names()} - {*systems.MODULES})))
def test_every_system_that_is_described_is_drawn_of_what_its_page_knows(name):
    description = systems.resolve(name).description
    page = equations.page_equations(description)
    coordinates = {c[kind] for c in page["coordinates"] for kind in ("name", "velocity")}
    symbols = {*description.parameters, *coordinates, "t", *(f"attitude_{k}" for k in range(4) if page["attitude"])}
    for name, tree in (*page["shared"], *page["seen"]):
        assert symbols_of(tree) <= symbols
        symbols.add(name)
    points = [point for _, _, points in page["drawn"] for point in points]
    assert len({len(point) for point in points}) == 1  # in a plane, or in space
    assert symbols_of(["+", *page["forces"], *(tree for point in points for tree in point)]) <= symbols
    drawn_symbols = set().union(
        *(symbols_of(tree) for point in points for tree in point), *(symbols_of(t) for _, t in page["seen"])
    )
    assert drawn_symbols & ({*coordinates} | {f"attitude_{k}" for k in range(4)})  # something moves


def test_plotly_is_the_file_that_was_taken(monkeypatch):
    script = zlib.decompress(base64.b64decode(plotly.deflated()))
    assert f"plotly.js (cartesian - minified) v{plotly.VERSION}".encode() in script[:200]
    assert b"MIT" in script[:300]
    assert base64.b64decode(plotly.digest()).hex() == plotly.SHA256
    monkeypatch.setattr(plotly, "_file", lambda: zlib.compress(script + b" "))
    plotly.digest.cache_clear()
    with pytest.raises(ValueError, match="allowed"):
        plotly.digest()
    monkeypatch.undo()
    plotly.digest.cache_clear()


def test_coordinates_keep_their_digits_where_others_are_shortened():
    noise = np.random.default_rng(3).random(4000)
    columns = [report_columns.PageColumn("rate", noise), report_columns.PageColumn("I2", noise, exact=True)]
    size = sum(len(report_columns.pack_column(column).text) for column in columns)
    rate, moment = report_columns.pack_within(columns, size - 1)
    assert (rate.dtype, moment.dtype, moment.exponent) == ("f4", "f8", 0)


def test_moments_of_shapes_are_coordinates_of_the_page(shapes, tmp_path):
    data = data_of(write_report(shapes, tmp_path / "r.html"))
    variables = {variable["name"]: variable for variable in data["variables"]}
    for moment in (variables["I1"], variables["I2"]):
        assert (moment["role"], moment["dtype"], moment["powers"]["I3"]) == ("coordinate", "f8", -1)


def test_a_definition_says_where_its_page_opens(tmp_path):
    data = data_of(write_report(sweeps.survey(PLANE | {"start_at": {"axis": 1, "I1": 0.8}}), tmp_path / "r.html"))
    assert data["start"]["link"] == "axis=1&I1=0.8"


SIDES = {  # system → grid; the vertical parameter first
    "gravity_gradient": {"k1": [-0.3, 0.2, 0.5], "k3": [-0.2, 0.1, 0.4]},
    "mathieu": {"a": [0.1, 0.5, 1.0], "q": [0.1, 0.3, 0.5]},
    "bead_on_hoop": {"radius": [0.3, 0.5, 0.7], "spin_rate": [2.0, 5.0, 8.0]},
}


@pytest.mark.parametrize("system", repeated.but(("mathieu",), SIDES))
def test_the_page_opens_with_the_sides_of_the_picture(system, tmp_path):
    ds = sweeps.survey({"system": system, "grid": SIDES[system]})
    x, y = data_of(write_report(ds, tmp_path / "r.html"))["start"]["plane"]
    assert [y, x] == [*SIDES[system]]
    figure = next(draw() for name, draw in systems.presentation_of(ds).figures(ds).items() if "against" not in name)
    ends = [(ax.get_xlim(), ax.get_ylim()) for ax in figure.axes]  # with half a cell at either end
    assert any(np.ptp(across) == pytest.approx(1.5 * np.ptp(ds[x].values)) for across, _ in ends)
    assert any(np.ptp(up) == pytest.approx(1.5 * np.ptp(ds[y].values)) for _, up in ends)
