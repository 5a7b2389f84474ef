"""The report as text: what it says, what it packs, and that no text of a map becomes markup."""

import base64
import json
import math
import re
import zlib
from importlib import import_module

import numpy as np
import pytest
import repeated
import xarray as xr
from report_pages import HOSTILE, PLANE, data_of, hostile, written

import sweeps
from sweeps import systems
from sweeps.maps import summary as maps_summary
from sweeps.maps.description import describe_map
from sweeps.systems.presentation.moving import equations
from sweeps.systems.uncertain_bodies.presentation import page as drawn
from sweeps.views import plotly, report, report_columns


def gathered(ds):
    """The totals of a map, its columns, and the indices kept along each dimension."""
    return report_columns.read_columns(ds, describe_map(ds))


def unpacked(column, ds, kept):
    """The numbers of a packed column over all its points, by NumPy and zlib."""
    raw = zlib.decompress(base64.b64decode(column.text))
    dtype = np.dtype(f"<{column.dtype}")
    values = np.frombuffer(raw, "u1").reshape(dtype.itemsize, -1).T.reshape(-1).view(dtype).reshape(column.shape)
    values = values.astype("f8") * 2.0**column.exponent
    for k, (dim, indices) in enumerate(kept.items()):
        if column.powers.get(dim):
            shape = [-1 if i == k else 1 for i in range(len(kept))]
            values = values * (np.abs(ds[dim].values[indices]) ** -float(column.powers[dim])).reshape(shape)
    return np.broadcast_to(values, [len(indices) for indices in kept.values()])


@pytest.mark.parametrize(("bits", "tolerance"), [(53, 3e-11), (24, 6e-8), (15, 2.0**-15)])
def test_packed_columns_hold_the_map(plane, bits, tolerance):
    """3e-11: laws are believed to 1e-11 each, along at most three dimensions; else half a unit of the last bit."""
    _, columns, kept = gathered(plane)
    for column in report_columns.scaling_laws(describe_map(plane), columns, kept):
        numbers = unpacked(report_columns.pack_column(column, bits), plane, kept)
        np.testing.assert_allclose(numbers, plane[column.name].values, rtol=tolerance + 1e-11, err_msg=column.name)


def test_scaling_laws_are_those_of_the_physics(plane):
    """The rate's square goes as the spin rate's square, a time as its inverse; the triangle knows no axis."""
    _, columns, kept = gathered(plane)
    laws = {one.name: one.powers for one in report_columns.scaling_laws(describe_map(plane), columns, kept)}
    assert laws["omega_squared"]["omega0"] == -2
    assert laws["window_end"]["omega0"] == 1
    assert laws["triangle_margin"] == {"axis": 0, "omega0": 0}
    assert "I1" not in laws["omega_squared"]


def test_a_law_that_fails_at_one_point_is_no_law():
    values = np.ones((3, 5))
    values[2, 3] += 1e-9
    assert report_columns.reduce_column("x", values, {"a": None, "b": None}).powers == {}
    values[2, 3] = np.nan
    assert report_columns.reduce_column("x", values, {"a": None, "b": None}).powers == {}


def test_products_that_overflow_obey_no_law():
    values = np.array([1.5e308, 1.6e308])
    assert report_columns.reduce_column("x", values, {"a": np.array([10.0, 20.0])}).powers == {}


def test_numbers_beyond_single_precision_stay_doubles():
    column = report_columns.PageColumn("x", np.array([1e-200, 1.0, 1e200]))
    packed = report_columns.pack_column(column, 24)
    assert packed.dtype == "f8"
    scaled = report_columns.pack_column(report_columns.PageColumn("x", np.array([1e199, 1.0e200, np.inf, np.nan])), 24)
    assert scaled.dtype == "f4"
    ds = xr.Dataset(coords={"d": [1.0, 2.0, 3.0, 4.0]})
    values = unpacked(scaled, ds, {"d": np.arange(4)})
    np.testing.assert_allclose(values, [1e199, 1e200, np.inf, np.nan], rtol=6e-8)  # half a unit of a float32


def test_thinning_keeps_the_ends_and_what_is_no_number():
    kept = report_columns.thin_dimensions(
        {"axis": 3, "I1": 500, "I2": 400, "omega0": 30}, {"I1", "I2", "omega0"}, 50_000
    )
    assert math.prod(map(len, kept.values())) <= 50_000
    assert len(kept["axis"]) == 3
    for name, size in (("I1", 500), ("I2", 400), ("omega0", 30)):
        assert kept[name][0] == 0
        assert kept[name][-1] == size - 1
    assert len(kept["I1"]) > len(kept["omega0"])


def test_a_map_too_large_is_thinned_and_says_so(plane, tmp_path):
    whole = written(plane, tmp_path / "whole.html")
    limit = len(whole.encode()) - 75_000  # of 100 kB of numbers; shorter ones save 40
    thin = written(plane, tmp_path / "thin.html", limit=limit)
    assert len(thin.encode()) <= limit
    assert "The map is larger than a page" in thin
    assert "The map is larger than a page" not in whole
    data = data_of(thin)
    shown = math.prod(dim["size"] for dim in data["dims"])
    assert f"{shown:,} of its 1,296 points" in thin
    for dim in data["dims"]:
        values = data["coordinates"][dim["name"]]["values"]
        assert len(values) == dim["size"]
        assert set(values) <= set(plane[dim["name"]].values.tolist())


def test_a_limit_that_no_point_meets_is_refused(plane, tmp_path):
    with pytest.raises(ValueError, match="limit"):
        report.write_report(plane, tmp_path / "r.html", limit=500_000)
    assert list(tmp_path.iterdir()) == []


def test_deviations_from_theory_are_those_of_the_map(plane):
    summary, _, _ = gathered(plane)
    agreement = summary.deviations["omega_squared_theory", "omega_squared"]
    theory, measured = plane.omega_squared_theory.values, plane.omega_squared.values
    same = (plane.regime.values == plane.regime_theory.values) & (plane.regime.values != 3)
    some = (theory != 0) & same & (plane.status.values == 0)
    deviation = np.abs(measured[some] - theory[some]) / np.abs(theory[some])
    assert agreement.total == deviation.size
    assert agreement.worst.value == deviation.max()
    for share in (0.5, 0.99):
        true = np.quantile(deviation, share, method="inverted_cdf")
        assert true <= agreement.quantile(share) <= true * 10 ** (1 / maps_summary.BINS_PER_DECADE)
    inside = np.abs(measured - theory)[some] <= plane.omega_squared_error.values[some]
    assert agreement.num_within == inside.sum()


def cloud_of(told, body, name, spin=0):
    """Numbers of a cloud as the page's facts pack them, by NumPy."""
    packed = told["drawn"]["bodies"][body]["columns"][name][spin]
    return np.frombuffer(base64.b64decode(packed["values"]), "<f4").astype("f8") * packed["scale"]


def test_draws_of_the_page_are_those_of_the_map(uncertain):
    """To half a unit of a float32. Where the map keeps none, the definition's own are drawn again: the same bodies."""
    told = drawn.facts(uncertain)
    again = drawn.facts(uncertain.drop_dims("draw"))
    assert (told["drawn"]["measured"], again["drawn"]["measured"]) == (True, False)
    spins = uncertain.isel(body=0).squeeze()
    for i in (1, 2, 3):
        for facts in (told, again):
            np.testing.assert_allclose(cloud_of(facts, "a_box", f"I{i}_draw"), spins[f"I{i}_draw"][0], rtol=6e-8)
    rates = spins.growth_rate_draw.values
    for spin in range(3):
        atol = 6e-8 * rates[spin].max()
        np.testing.assert_allclose(cloud_of(told, "a_box", "growth_rate_draw", spin), rates[spin], atol=atol)
    quantiles = np.array(told["spread"]["growth_rate_quantile"])
    np.testing.assert_allclose(quantiles, spins.growth_rate_quantile, rtol=1e-5)


def test_a_cloud_of_many_draws_is_thinned_by_a_seed_and_says_so(uncertain, monkeypatch):
    whole = drawn.facts(uncertain)["drawn"]["bodies"]["a_box"]
    monkeypatch.setattr(drawn, "MAX_SHOWN", 60)
    part = drawn.facts(uncertain)["drawn"]["bodies"]["a_box"]
    assert (part["shown"], part["of"], whole["shown"]) == (60, 100, 100)
    assert len(set(part["numbers"])) == 60
    first = uncertain.I1_draw.isel(body=0).squeeze()[0]
    found = cloud_of(drawn.facts(uncertain), "a_box", "I1_draw")
    np.testing.assert_allclose(found, first.sel(draw=part["numbers"]), rtol=6e-8)
    monkeypatch.setattr(drawn, "MAX_CLOUD_NUMBERS", 100)
    assert drawn.facts(uncertain)["drawn"] == {}


@pytest.mark.parametrize("definition", ["", "[", "bodies: 7", "bodies: [{name: a_box, mesh: {file: /nowhere}}]"])
def test_a_definition_that_draws_nothing_makes_no_cloud(uncertain, definition):
    ds = uncertain.drop_dims("draw").assign_attrs(definition=definition)
    assert drawn.facts(ds)["drawn"] == {}


def test_no_text_of_a_map_becomes_markup(breaking, tmp_path):
    html = written(hostile(breaking), tmp_path / "r.html")
    assert "<script>globalThis.hostile" not in html
    assert "<img" not in html.lower().split("<script", 1)[0]
    assert data_of(html)["title"] == HOSTILE
    scripts = re.findall(r"<script[^>]*>", html)
    assert len(scripts) == 3 + len(data_of(html)["variables"])


def test_the_policy_names_the_scripts_and_forbids_the_rest(plane, tmp_path):
    html = written(plane, tmp_path / "r.html")
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', html)[1].replace("&#39;", "'")
    program = re.search(r'<script type="module">(.*?)</script>', html, re.DOTALL)[1]
    assert report._policy_hash(program) in policy
    assert "default-src 'none'" in policy
    assert "unsafe-inline" not in policy.split("style-src")[0]
    assert "unsafe-eval" not in policy


def valued(tree, at):
    """A tree of the page's, worked out."""
    if isinstance(tree, float):
        return tree
    if isinstance(tree, str):
        return at[tree]
    parts = [valued(part, at) for part in tree[1:]]
    ways = {"+": sum, "*": math.prod, "^": lambda both: both[0] ** both[1]}
    return ways[tree[0]](parts) if tree[0] in ways else getattr(math, tree[0])(*parts)


def test_equations_of_the_page_are_those_of_the_double_pendulum():
    """Beside the accelerations that textbooks give, solved by hand for equal rods and masses of one."""
    found = equations.page_equations(import_module("sweeps.mechanics.library.double_pendulum").system)
    one, two, speed, other = 0.7, -0.4, 1.3, 0.8
    at = {"mass1": 1.0, "mass2": 1.0, "length1": 1.0, "length2": 1.0, "gravity": 9.8, "theta1": one, "theta2": two}
    at |= {found["coordinates"][0]["velocity"]: speed, found["coordinates"][1]["velocity"]: other}
    for name, tree in found["shared"]:
        at[name] = valued(tree, at)
    a = [[valued(tree, at) for tree in row] for row in found["a"]]
    forces = [valued(tree, at) for tree in found["forces"]]
    sine, cosine = math.sin(one - two), math.cos(one - two)
    first = -9.8 * 3 * math.sin(one) - 9.8 * math.sin(one - 2 * two) - 2 * sine * (other**2 + speed**2 * cosine)
    second = 2 * sine * (2 * speed**2 + 2 * 9.8 * math.cos(one) + other**2 * cosine)
    expected = np.array([first, second]) / (3 - math.cos(2 * (one - two)))
    np.testing.assert_allclose(np.linalg.solve(a, forces), expected, rtol=1e-13)
    for name, tree in found["seen"]:
        at[name] = valued(tree, at)
    drawn = [(kind, [[valued(tree, at) for tree in place] for place in points]) for kind, _, points in found["drawn"]]
    upper = [math.sin(one), -math.cos(one)]
    lower = [upper[0] + math.sin(two), upper[1] - math.cos(two)]
    places = [[[0.0, 0.0], upper], [upper, lower], [[0.0, 0.0]], [upper], [lower]]
    assert [kind for kind, _ in drawn] == ["line", "line", "body", "mass", "mass"]
    for (_, points), expected in zip(drawn, places, strict=True):
        np.testing.assert_allclose(points, expected, rtol=1e-15)


def symbols_of(tree):
    """Names of the symbols in a tree of the page's."""
    if isinstance(tree, list):
        return set().union(*map(symbols_of, tree[1:]))
    return {tree} if isinstance(tree, str) else set()


QUICK = ("double_pendulum", "foucault", "gyrostat", "lagrange_points", "paul_trap")


@pytest.mark.parametrize("name", repeated.but(QUICK, sorted({*systems.system_names()} - {*systems.MODULES})))
def test_every_system_that_is_described_is_drawn_of_what_its_page_knows(name):
    description = systems.resolve(name).description
    found = equations.page_equations(description)
    moving = {c[kind] for c in found["coordinates"] for kind in ("name", "velocity")}
    known = {*description.parameters, *moving, "t", *(f"attitude_{k}" for k in range(4) if found["attitude"])}
    for name, tree in (*found["shared"], *found["seen"]):
        assert symbols_of(tree) <= known
        known.add(name)
    points = [point for _, _, points in found["drawn"] for point in points]
    assert len({len(point) for point in points}) == 1  # in a plane, or in space
    assert symbols_of(["+", *found["forces"], *(tree for point in points for tree in point)]) <= known
    drawn = set().union(
        *(symbols_of(tree) for point in points for tree in point), *(symbols_of(t) for _, t in found["seen"])
    )
    assert drawn & ({*moving} | {f"attitude_{k}" for k in range(4)})  # something moves


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
    both = [report_columns.PageColumn("rate", noise), report_columns.PageColumn("I2", noise, exact=True)]
    whole = sum(len(report_columns.pack_column(column).text) for column in both)
    rate, moment = report_columns.pack_within(both, whole - 1)
    assert (rate.dtype, moment.dtype, moment.exponent) == ("f4", "f8", 0)


def test_moments_of_shapes_are_coordinates_of_the_page(shapes, pages):
    report.write_report(shapes, pages / "shapes.html")
    page = (pages / "shapes.html").read_text()
    told = json.loads(re.search(r'<script[^>]*id="map-data"[^>]*>(.*?)</script>', page, re.DOTALL)[1])
    found = {one["name"]: (one["role"], one["dtype"], one["powers"].get("I3")) for one in told["variables"]}
    assert found["I1"] == found["I2"] == ("coordinate", "f8", -1)


def test_a_definition_says_where_its_page_opens(tmp_path):
    told = data_of(written(sweeps.survey(PLANE | {"start_at": {"axis": 1, "I1": 0.8}}), tmp_path / "r.html"))
    assert told["start"]["link"] == "axis=1&I1=0.8"
