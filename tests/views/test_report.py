"""The report: what it says, what it packs, and, in a browser where there is one, what it does."""

import base64
import json
import math
import re
import shutil
import urllib.parse
import zlib
from importlib import import_module
from pathlib import Path

import mpmath
import numpy as np
import pytest
import xarray as xr
from PIL import Image
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import sweeps
from kernels import direct, exact
from sweeps import systems
from sweeps.__main__ import main
from sweeps.handbook import gallery
from sweeps.maps import summary as maps_summary
from sweeps.maps.storage import open_map, write_map
from sweeps.points import catalogue
from sweeps.reading.definitions import file_text, plain, read_text
from sweeps.schema.boxes import blocks
from sweeps.systems.bodies.variables import VERDICTS
from sweeps.systems.presentation.moving import equations
from sweeps.systems.relative_equilibrium.system import REGIMES
from sweeps.systems.rigid_body import prediction
from sweeps.systems.rigid_body.presentation.page import PRESETS
from sweeps.systems.uncertain_bodies.presentation import page as drawn
from sweeps.views import plotly, report, report_columns

HOSTILE = "</script><script>globalThis.hostile = 1</script><img src=x onerror='globalThis.hostile = 1'>"
HOSTILE += "<a href='https://example.org/'>a link</a>&lt;"
PLANE = {
    "title": "A plane",
    "grid": {
        "I1": {"start": 0.5, "stop": 1.7, "num": 9},
        "I2": {"start": 0.55, "stop": 1.65, "num": 8},
        "I3": [0.9, 1.0, 1.2],
        "omega0": [2.0, 10.0],
        "epsilon": 1.0e-3,
    },
}


@pytest.fixture(scope="module")
def plane():
    return sweeps.survey(PLANE)


@pytest.fixture(scope="module")
def breaking():
    return sweeps.survey("breakdown")


UNCERTAIN = {
    "bodies": [{"name": "a_box", "I1": 1.0, "I2": 2.0, "I3": 2.5, "uncertainty": "10 %"}],
    "draws": 100,
    "grid": {"omega0": 0.1},
    "keep": True,
}


@pytest.fixture(scope="module")
def uncertain():
    return sweeps.survey(UNCERTAIN)


def oscillator(n=6):
    """A map of another system, as xarray alone makes it: parameters, equilibria and modes, some missing."""
    length = np.linspace(0.2, 2.0, n)
    spin = np.geomspace(0.1, 30.0, n + 1)
    square = 9.81 / length[:, None, None, None] * np.array([1.0, -1.0])[:, None] * np.array([1.0, 4.0])
    square = square - 0.1 * spin[None, :, None, None] ** 2
    square[0, 0, 1, 1], square[1, 0, 0, 0] = np.nan, 1e-15
    dims = ("length", "spin", "equilibrium", "mode")
    regime = np.where(np.isnan(square), -1, np.where(square > 0, 0, 1)).astype("i1")
    regime[1, 0, 0, 0] = 2
    flags = {"flag_values": np.array([-1, 0, 1, 2], "i1"), "flag_meanings": "absent stable unstable marginal"}
    variables = {
        "omega_squared_theory": (
            dims,
            square * (1 + 1e-9),
            {"units": "s-2", "long_name": "square of the rate, theory"},
        ),
        "omega_squared": (dims, square, {"units": "s-2", "long_name": "square of the rate, measured"}),
        "regime_theory": (dims, regime, {"long_name": "regime, theory", **flags}),
        "regime": (dims, regime, {"long_name": "regime, measured", **flags}),
        "angle": (dims[:3], np.arccos(np.clip(spin / 40, 0, 1))[None, :, None] * np.ones((n, 1, 2)), {"units": "rad"}),
    }
    coordinates = {
        "length": ("length", length, {"units": "m", "long_name": "length of the rod"}),
        "spin": ("spin", spin, {"units": "rad s-1"}),
        "equilibrium": ("equilibrium", ["hanging", "upright"]),
        "mode": ("mode", np.array([1, 2], "i1"), {"long_name": "mode"}),
    }
    return xr.Dataset(
        variables,
        coordinates,
        {"title": "A pendulum that turns", "system": "double_pendulum", "definition": "system: double_pendulum\n"},
    )


def equilibria(n=7):
    """A map of relative equilibria, as xarray alone makes it: pairs that turn or grow, with errors and theory."""
    weight, spin = np.linspace(-1.0, 4.0, n), np.linspace(0.5, 5.0, n + 1)
    square = (spin[None, :] ** 2 - 4.0 * weight[:, None])[..., None] * np.array([1.0, 0.25])
    root = np.sqrt(-square.astype(complex))
    values = np.concatenate([root, -root], axis=-1)[:, :, None, :]
    values = np.take_along_axis(values, np.lexsort((values.real, values.imag), axis=-1), axis=-1)
    dims = ("moment_of_weight", "spin_rate", "equilibrium", "eigenvalue")
    growth = np.broadcast_to(values.real.max(axis=-1, keepdims=True), values.shape)
    regime = np.where(growth > 0, 2, 1).astype("i1")
    flags = {"flag_values": np.array([-1, 0, 1, 2, 3, 4], "i1"), "flag_meanings": " ".join(REGIMES)}
    variables = {
        "eigenvalue_real_theory": (dims, values.real * (1 + 1e-9), {"units": "s-1"}),
        "eigenvalue_real": (dims, values.real, {"units": "s-1", "long_name": "real part"}),
        "eigenvalue_real_error": (dims, np.full(values.shape, 0.02), {"units": "s-1"}),
        "eigenvalue_imag_theory": (dims, values.imag * (1 + 1e-9), {"units": "s-1"}),
        "eigenvalue_imag": (dims, values.imag, {"units": "s-1", "long_name": "imaginary part"}),
        "eigenvalue_imag_error": (dims, np.full(values.shape, 0.03), {"units": "s-1"}),
        "growth_rate_theory": (dims, growth, {"units": "s-1", "long_name": "growth, theory"}),
        "growth_rate": (dims, growth, {"units": "s-1", "long_name": "growth"}),
        "regime_theory": (dims, regime, flags),
        "regime": (dims, regime, {"long_name": "regime, measured", **flags}),
    }
    coordinates = {
        "moment_of_weight": ("moment_of_weight", weight, {"units": "N m"}),
        "spin_rate": ("spin_rate", spin, {"units": "rad s-1"}),
        "equilibrium": ("equilibrium", ["upright"]),
        "eigenvalue": ("eigenvalue", np.arange(1, 5, dtype="i1")),
    }
    return xr.Dataset(
        variables,
        coordinates,
        {"title": "A top that sleeps", "system": "sleeping_top", "definition": "system: sleeping_top\n"},
    )


def written(ds, path, **options):
    report.write(ds, path, **options)
    return path.read_text(encoding="utf-8")


def data_of(html):
    return json.loads(re.search(r'id="map-data">(.*?)</script>', html, re.DOTALL)[1])


# ---------------------------------------------------------------------------------------------------------
# Columns


def test_blocks_cover_a_grid_once_and_in_bounds():
    seen = np.zeros((3, 4, 7), int)
    for box in blocks({"a": 3, "b": 4, "c": 7}, 10):
        part = seen[tuple(box.values())]
        assert part.size <= 10
        part += 1
    assert (seen == 1).all()


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
    _, columns, kept = report._gather(plane)
    scales = {dim: report._scale(plane, dim, indices) for dim, indices in kept.items()}
    for name, values in columns.items():
        packed = report_columns.pack(report_columns.reduced(name, values, scales), bits)
        np.testing.assert_allclose(
            unpacked(packed, plane, kept), plane[name].values, rtol=tolerance + 1e-11, err_msg=name
        )


def test_scaling_laws_are_those_of_the_physics(plane):
    """The rate's square goes as the spin rate's square, a time as its inverse; the triangle knows no axis."""
    _, columns, kept = report._gather(plane)
    scales = {dim: report._scale(plane, dim, indices) for dim, indices in kept.items()}
    laws = {name: report_columns.reduced(name, values, scales).powers for name, values in columns.items()}
    assert laws["omega_squared"]["omega0"] == -2
    assert laws["window_end"]["omega0"] == 1
    assert laws["triangle_margin"] == {"axis": 0, "omega0": 0}
    assert "I1" not in laws["omega_squared"]


def test_a_law_that_fails_at_one_point_is_no_law():
    values = np.ones((3, 5))
    values[2, 3] += 1e-9
    assert report_columns.reduced("x", values, {"a": None, "b": None}).powers == {}
    values[2, 3] = np.nan
    assert report_columns.reduced("x", values, {"a": None, "b": None}).powers == {}


def test_products_that_overflow_obey_no_law():
    values = np.array([1.5e308, 1.6e308])
    assert report_columns.reduced("x", values, {"a": np.array([10.0, 20.0])}).powers == {}


def test_numbers_beyond_single_precision_stay_doubles():
    column = report_columns.PageColumn("x", np.array([1e-200, 1.0, 1e200]))
    packed = report_columns.pack(column, 24)
    assert packed.dtype == "f8"
    scaled = report_columns.pack(report_columns.PageColumn("x", np.array([1e199, 1.0e200, np.inf, np.nan])), 24)
    assert scaled.dtype == "f4"
    ds = xr.Dataset(coords={"d": [1.0, 2.0, 3.0, 4.0]})
    values = unpacked(scaled, ds, {"d": np.arange(4)})
    np.testing.assert_allclose(values, [1e199, 1e200, np.inf, np.nan], rtol=6e-8)  # half a unit of a float32


def test_thinning_keeps_the_ends_and_what_is_no_number():
    kept = report_columns.thinned({"axis": 3, "I1": 500, "I2": 400, "omega0": 30}, {"I1", "I2", "omega0"}, 50_000)
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
        report.write(plane, tmp_path / "r.html", limit=500_000)
    assert list(tmp_path.iterdir()) == []


# ---------------------------------------------------------------------------------------------------------
# Numbers


def test_deviations_from_theory_are_those_of_the_map(plane):
    summary, _, _ = report._gather(plane)
    agreement = summary.deviations["omega_squared_theory", "omega_squared"]
    theory, measured = plane.omega_squared_theory.values, plane.omega_squared.values
    same = (plane.regime.values == plane.regime_theory.values) & (plane.regime.values != 3)
    some = (theory != 0) & same & (plane.status.values == 0)
    deviation = np.abs(measured[some] - theory[some]) / np.abs(theory[some])
    assert agreement.total == deviation.size
    assert agreement.worst.value == deviation.max()
    for share in (0.5, 0.99):
        true = np.quantile(deviation, share, method="inverted_cdf")
        assert true <= agreement.quantile(share) <= true * 10 ** (1 / maps_summary.PER_DECADE)
    inside = np.abs(measured - theory)[some] <= plane.omega_squared_error.values[some]
    assert agreement.within == inside.sum()


def test_a_marginal_points_deviation_does_not_count():
    ds = oscillator()
    theory = ds.omega_squared_theory.copy()
    theory[1, 0, 0, 0] = 1e-25  # nothing but rounding on either side
    summary, _, _ = report._gather(ds.assign(omega_squared_theory=theory))
    agreement = summary.deviations["omega_squared_theory", "omega_squared"]
    assert int(ds.regime[1, 0, 0, 0]) == 2
    assert agreement.total == int(np.isfinite(ds.omega_squared).sum()) - 1
    assert agreement.worst.value < 1.0


def test_the_command_writes_the_report_of_a_file(plane_path, folder, capsys):
    assert main(["report", str(folder / "plane.nc"), "-o", str(folder / "sub" / "again.html")]) == 0
    assert (folder / "sub" / "again.html").read_bytes() == plane_path.read_bytes()
    assert main(["report", str(plane_path), "-o", str(folder / "none.html")]) == 2
    assert "allowed" in capsys.readouterr().err
    assert not (folder / "none.html").exists()


def test_a_map_with_neither_theory_nor_flags_has_a_report(tmp_path):
    ds = xr.Dataset({"depth": (("x", "y"), np.arange(6.0).reshape(2, 3))}, {"x": [1.0, 2.0], "y": [1.0, 2.0, 3.0]})
    html = written(ds, tmp_path / "r.html")
    assert data_of(html)["dims"] == [{"name": "x", "size": 2, "of": 2}, {"name": "y", "size": 3, "of": 3}]


# ---------------------------------------------------------------------------------------------------------
# Clouds


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
    monkeypatch.setattr(drawn, "MOST_SHOWN", 60)
    part = drawn.facts(uncertain)["drawn"]["bodies"]["a_box"]
    assert (part["shown"], part["of"], whole["shown"]) == (60, 100, 100)
    assert len(set(part["numbers"])) == 60
    first = uncertain.I1_draw.isel(body=0).squeeze()[0]
    found = cloud_of(drawn.facts(uncertain), "a_box", "I1_draw")
    np.testing.assert_allclose(found, first.sel(draw=part["numbers"]), rtol=6e-8)
    monkeypatch.setattr(drawn, "MOST_TOLD", 100)
    assert drawn.facts(uncertain)["drawn"] == {}


@pytest.mark.parametrize("definition", ["", "[", "bodies: 7", "bodies: [{name: a_box, mesh: {file: /nowhere}}]"])
def test_a_definition_that_draws_nothing_makes_no_cloud(uncertain, definition):
    ds = uncertain.drop_dims("draw").assign_attrs(definition=definition)
    assert drawn.facts(ds)["drawn"] == {}


# ---------------------------------------------------------------------------------------------------------
# The page as text


def hostile(ds):
    """A map whose every text tries to run a script or to lead elsewhere, among them names in coordinates."""
    bad = {"title": HOSTILE, "history": HOSTILE, HOSTILE: "x", "definition": f"# {HOSTILE}\ntitle: x\n"}
    ds = ds.copy(deep=True).assign_attrs(bad)
    for variable in ds.variables.values():
        variable.attrs |= {"long_name": HOSTILE, "comment": HOSTILE, "units": HOSTILE}
        if number := len(variable.attrs.get("flag_meanings", "").split()):
            links = (f"<a_href='https://example.org/'>{k}</a>" for k in range(number))
            variable.attrs["flag_meanings"] = " ".join(links)
    names = [name for name in ("body", "equilibrium") if ds.get(name) is not None]
    return ds.assign_coords({name: [HOSTILE, *ds[name].values[1:].tolist()] for name in names})


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
    assert report._hash(program) in policy
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
    found = equations.facts(import_module("sweeps.mechanics.library.double_pendulum").system)
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


@pytest.mark.parametrize("name", sorted({*systems.names()} - {*systems.MODULES}))
def test_every_system_that_is_described_is_drawn_of_what_its_page_knows(name):
    description = systems.resolve(name).description
    found = equations.facts(description)
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


# ---------------------------------------------------------------------------------------------------------
# In a browser


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None:
        pytest.skip("there is no Chromium: the report's own tests did not run")
    with playwright.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield browser
        browser.close()


PATIENCE = 60  # s until what must come has come, on however busy a machine


class Opened:
    """A report in a browser, with all that its console said and all that it asked for."""

    def __init__(self, browser, path: Path, link="", **context):
        self.said, self.asked = [], []
        self.context = browser.new_context(
            **({"viewport": {"width": 1280, "height": 2400}, "reduced_motion": "reduce"} | context)
        )
        self.context.set_default_timeout(1000 * PATIENCE)
        self.page = self.context.new_page()
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.context.route(re.compile("^(?!file:)"), lambda route: route.abort())
        self.page.goto(path.as_uri() + link)
        self.page.wait_for_selector("html[data-ready]", state="attached")

    def until(self, expression, argument=None):
        """Waits for a condition; Playwright's own wait evaluates text in the page, which its policy forbids."""
        for _ in range(20 * PATIENCE):
            if self.page.evaluate(expression, argument):
                return
            self.page.wait_for_timeout(50)
        raise AssertionError(f"still not true after {PATIENCE} s: {expression}")

    def follow(self, link):
        """Another link in the same page; what follows it is done when the event that it makes has been seen."""
        self.page.evaluate(
            """(link) => new Promise((done) => {
                if (location.hash === link) return done();
                addEventListener("hashchange", () => setTimeout(done), { once: true });
                location.hash = link;
            })""",
            link,
        )

    def row(self, name):
        """A value of the row that is shown: (the whole number behind it, its text)."""
        self.page.evaluate(  # it is filled while it is open, by an event that comes before the next frame but one
            """() => {
                document.getElementById("all-values").open = true;
                return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
            }"""
        )
        data = self.page.locator(f'#row tr[data-name="{name}"] data')
        return data.get_attribute("value"), data.text_content()

    def center(self, i, j):
        """Where a cell of the plane lies on the screen."""
        return on_map(self, *self.page.evaluate("([i, j]) => [polhode.map.plane.x[i], polhode.map.plane.y[j]]", [i, j]))


@pytest.fixture
def visit(browser):
    """Opens reports: what their consoles said is looked at in the end, and their windows are closed."""
    visited = []

    def opens(path, link="", **context):
        visited.append(Opened(browser, path, link, **context))
        return visited[-1]

    yield opens
    for one in visited:
        one.context.close()
    assert [said for one in visited for said in one.said] == []


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("reports")


@pytest.fixture(scope="module")
def plane_path(plane, folder):
    """The report of a map that has gone through a file, as the workflow makes it."""
    write_map(plane, folder / "plane.nc")
    with open_map(folder / "plane.nc") as ds:
        report.write(ds, folder / "plane.html")
    return folder / "plane.html"


@pytest.fixture(scope="module")
def shared(browser, plane_path):
    page = Opened(browser, plane_path)
    page.first = page.page.evaluate("(({ listeners, ...chosen }) => chosen)(polhode.state)")
    yield page
    page.context.close()


@pytest.fixture(scope="module")
def second(browser, plane_path):
    """Another reader's page, which links are sent to: opened by one, and followed by others."""
    page = Opened(browser, plane_path, "#axis=1&I1=0.8&_color=frequency&_nudge=0.05")
    page.first = (page.row("axis")[0], page.row("I1")[0], page.page.get_by_label("colour by").input_value())
    page.first_nudge = page.page.evaluate("polhode.state.nudge")
    yield page
    assert page.said == []
    page.context.close()


@pytest.fixture(scope="module")
def telephone(browser, plane_path):
    """A page on a small screen that is touched."""
    page = Opened(browser, plane_path, has_touch=True, viewport={"width": 400, "height": 800}, color_scheme="light")
    yield page
    assert page.said == []
    page.context.close()


@pytest.fixture
def opened(shared, plane_path):
    """The page as it was when it opened: unpacking it takes seconds, so that tests share one."""
    shared.page.evaluate(
        """(first) => {
            document.querySelectorAll("details[open]").forEach((details) => details.removeAttribute("open"));
            document.activeElement.blur();
            if (polhode.motion.player.playing) document.getElementById("play").click();
            polhode.choose(first);
            document.querySelector('#map [data-title="Reset axes"]').click();
            scrollTo(0, 0);
        }""",
        shared.first,
    )
    shared.page.mouse.move(0, 0)
    yield shared
    assert shared.said == []
    assert {url.split("#")[0] for url in shared.asked} == {plane_path.as_uri()}


def parsed(text):
    """The number that a person reads in a text with a unit."""
    text = text.replace("−", "-").replace("\u00a0", " ")
    match = re.match(r"(-?[\d.]+)(?: × 10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?", text)
    power = (match[2] or "⁰").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    return float(match[1]) * 10.0 ** int(power)


def shown_point(page, ds):
    """The row of the map at the point whose coordinates the page shows."""
    return ds.sel({dim: float(page.row(dim)[0]) for dim in ds.dims}, method="nearest")


def assert_row_is_the_maps(page, ds):
    point = shown_point(page, ds)
    for dim in ds.dims:
        assert float(page.row(dim)[0]) == float(point[dim])
    for name, variable in point.data_vars.items():
        value, text = page.row(name)
        true = variable.values.item()
        if "flag_meanings" in variable.attrs:
            assert int(float(value)) == true
        elif math.isnan(true):
            assert text == "–"
        else:
            assert parsed(text) == pytest.approx(true, rel=1e-5), name  # six digits: 5e-6, and one more for ties
            unit = variable.attrs["units"]
            assert text.endswith(
                "" if unit == "1" else {"s-2": "s⁻²", "s-1": "s⁻¹", "rad s-1": "rad s⁻¹"}.get(unit, unit)
            )


SHOWN = """[polhode.state.place,
    ...["say", "row-where", "row", "headline"].map((id) => document.getElementById(id).innerText)]"""


def test_hover_shows_a_small_box_alone_and_a_click_the_row_of_the_file(opened, plane):
    for cell in ((1, 1), (7, 3), (4, 6)):
        before = opened.page.evaluate(SHOWN)
        opened.page.mouse.move(*opened.center(*cell))
        lines = opened.page.locator("#tip div").all_inner_texts()
        assert 2 <= len(lines) <= 4
        assert parsed(lines[0].split(" = ")[1]) == pytest.approx(plane.I1.values[cell[0]], rel=1e-5)
        assert opened.page.evaluate(SHOWN) == before
        opened.page.mouse.click(*opened.center(*cell))
        assert float(opened.row("I1")[0]) == plane.I1.values[cell[0]]
        assert float(opened.row("I2")[0]) == plane.I2.values[cell[1]]
        assert_row_is_the_maps(opened, plane)


def painted(opened):
    """The colours of the middles of all cells, row by row upwards, as "#rrggbb"."""
    return opened.page.evaluate(
        """() => {
            const canvas = document.getElementById("cells");
            const { xaxis, yaxis } = document.getElementById("map")._fullLayout;
            const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
            const hex = (x, y) => {
                const at = 4 * (Math.floor(yaxis.d2p(y)) * canvas.width + Math.floor(xaxis.d2p(x)));
                return "#" + [...data.slice(at, at + 3)].map((part) => part.toString(16).padStart(2, "0")).join("");
            };
            const { x, y } = polhode.map.plane;
            return y.flatMap((Y) => x.map((X) => hex(X, Y)));
        }"""
    )


def test_the_tool_bar_saves_the_cells_within_plotlys_axes(opened, tmp_path):
    """The saved picture has each cell's colour where the page shows it, each region's name, and axes about them."""
    page = opened.page
    colors = painted(opened)
    places = page.evaluate(
        """() => {
            const { xaxis, yaxis } = document.getElementById("map")._fullLayout;
            const { plane } = polhode.map;
            const on = (x, y) => [xaxis._offset + x, yaxis._offset + y];
            const cells = plane.y.flatMap((Y) => plane.x.map((X) => on(xaxis.d2p(X), yaxis.d2p(Y))));
            const box = document.getElementById("map").getBoundingClientRect();
            const names = [...document.querySelectorAll("#names span")].map((name) => {
                const { left, top, width, height } = name.getBoundingClientRect();
                return [left - box.left + width / 2, top - box.top + height / 2];
            });
            return { cells, names, bottom: yaxis._offset + yaxis._length, left: xaxis._offset };
        }"""
    )
    page.locator("#map").hover()
    with page.expect_download() as download:
        page.locator('#map [data-title="Download plot as a PNG"]').click()
    assert download.value.suggested_filename == "map.png"
    download.value.save_as(tmp_path / "map.png")
    with Image.open(tmp_path / "map.png") as image:
        paper = Image.new("RGBA", image.size, "white")
        saved = np.asarray(Image.alpha_composite(paper, image.convert("RGBA")))[..., :3]
    cells, names = np.array(places["cells"]), np.array(places["names"])
    assert len(names) >= 2
    # hidden by what stands above the cells: the names' boxes, lines of theory, and the hatching of impossible bodies
    away = np.abs(cells[:, None] - names).max(axis=2).min(axis=1) > 60
    at = np.round(cells).astype(int)
    wanted = np.array([[int(color[k : k + 2], 16) for k in (1, 3, 5)] for color in colors])
    like = np.abs(saved[at[:, 1], at[:, 0]].astype(int) - wanted).max(axis=1) <= 12  # drawn anew, and smoothed
    assert like[away].mean() > 0.5
    assert len(np.unique(wanted[like & away], axis=0)) > 5
    dark = saved.max(axis=2) < 90
    assert dark[int(places["bottom"]) + 5 :].sum() > 100  # numbers and name of the x axis
    assert dark[:, : int(places["left"]) - 5].sum() > 100
    for x, y in names:
        assert (saved.max(axis=2) < 130)[int(y) - 16 : int(y) + 16, int(x) - 25 : int(x) + 25].sum() > 20


def test_axis_slider_plane_and_color_change_the_map(opened, plane):
    page = opened.page
    first = painted(opened)
    page.get_by_label("1", exact=True).check()
    second = painted(opened)
    assert second != first
    slider = page.get_by_label("principal moment of inertia about axis 3", exact=True)
    slider.focus()
    page.keyboard.press("End")
    assert float(opened.row("I3")[0]) == 1.2
    assert painted(opened) != second
    page.get_by_label("colour by").select_option("regime")
    regime = plane.regime.sel(axis=1, I3=1.2, omega0=float(opened.row("omega0")[0])).squeeze()
    look = systems.presentation_of(plane).look
    words = dict(zip(plane.regime.flag_values, plane.regime.flag_meanings.split(), strict=True))
    assert painted(opened) == [look.color(words[v]) for v in regime.transpose("I2", "I1").values.reshape(-1)]
    page.get_by_label("x axis").select_option("omega0")
    assert page.evaluate("document.getElementById('map').layout.xaxis.title.text").startswith("ω₀")
    assert page.evaluate("polhode.map.plane.x") == [2.0, 10.0]


def test_boundaries_and_hatching_are_those_of_theory(opened, plane):
    page = opened.page
    page.get_by_label("3", exact=True).check()
    names = page.evaluate("document.getElementById('map').data.map((trace) => trace.name)")
    assert {"I₁ = I₃", "I₂ = I₃"} <= set(names)
    assert "I₁ = I₂" not in names
    level = page.evaluate("document.getElementById('map').data.find((trace) => trace.name === 'I₂ = I₃').y")
    assert level == [float(opened.row("I3")[0])] * 2
    margin = plane.triangle_margin.sel(axis=3, I3=float(opened.row("I3")[0]), omega0=10.0).squeeze()
    possible = (margin.transpose("I2", "I1").values >= 0).reshape(-1)
    assert page.evaluate("Array.from(polhode.map.plane.exists)") == possible.astype(int).tolist()


def moments_of(ds, point):
    return [float(point[name]) for name in ("I1", "I2", "I3")]


def start_of(point):
    axis, omega0, epsilon, phase = (float(point[name]) for name in ("axis", "omega0", "epsilon", "phase"))
    start = np.zeros(3)
    at = np.array([0, 1, 2]) + int(axis) - 1
    start[at % 3] = omega0 * np.array([1.0, epsilon * math.cos(phase), epsilon * math.sin(phase)])
    return start


def test_a_click_shows_the_motion_of_the_point(opened, plane):
    page = opened.page
    page.get_by_label("2", exact=True).check()
    page.evaluate("polhode.choose({ nudge: null })")  # the map's own, in place of one that is seen
    flips = set()
    for cell in ((1, 3), (8, 4), (6, 1)):
        page.mouse.click(*opened.center(*cell))
        point = shown_point(opened, plane)
        assert float(point.I1) == plane.I1.values[cell[0]]
        shown = float(page.locator("#flip-period").get_attribute("value"))
        true = exact.flip_period(exact.set_up(*moments_of(plane, point), *start_of(point)))
        assert shown == pytest.approx(true, rel=1e-12)  # both carry all digits; the bar is 1e-6
        assert parsed(page.locator("#flip-period").text_content()) == pytest.approx(true, rel=1e-6)
        flips.add(shown)
        times, *traces = page.evaluate("(([one, ...more]) => [one.x, one.y, ...more.map(({ y }) => y)])(traces.data)")
        assert times[-1] == page.evaluate("polhode.motion.end")
        expected = exact.rotation(moments_of(plane, point), start_of(point), times)
        np.testing.assert_allclose(np.transpose(traces), expected, atol=1e-11 * abs(float(point.omega0)))
    assert len(flips) == 3


def test_play_turns_the_body_and_pause_holds_it(opened):
    page = opened.page
    picture = "document.getElementById('body-canvas').toDataURL()"
    before = page.evaluate(picture)
    page.get_by_role("button", name="Play").click()
    opened.until("polhode.motion.t > 0.05 * polhode.motion.end")
    page.get_by_role("button", name="Pause").click()
    held = page.evaluate(picture)
    assert held != before
    page.wait_for_timeout(100)
    assert page.evaluate(picture) == held
    box = page.locator("#polhode-canvas").bounding_box()
    ball = page.evaluate("document.getElementById('polhode-canvas').toDataURL()")
    page.mouse.move(box["x"] + 100, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 160, box["y"] + 120, steps=3)
    page.mouse.up()
    assert page.evaluate(picture) != held
    assert page.evaluate("document.getElementById('polhode-canvas').toDataURL()") != ball


def test_keys_move_the_choice(opened, plane):
    page = opened.page
    page.mouse.click(*opened.center(4, 4))
    page.locator("#map").focus()
    for key in ("ArrowRight", "ArrowUp", "ArrowUp", "ArrowLeft", "ArrowLeft"):
        page.keyboard.press(key)
    assert float(opened.row("I1")[0]) == plane.I1.values[3]
    assert float(opened.row("I2")[0]) == plane.I2.values[6]
    page.locator("#body-canvas").focus()
    before = page.evaluate("document.getElementById('body-canvas').toDataURL()")
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("document.getElementById('body-canvas').toDataURL()") != before


@pytest.mark.slow
def test_a_page_opens_where_its_link_says(second):
    assert second.first == ("1", "0.8", "frequency")
    assert second.first_nudge == 0.05


@pytest.mark.slow
def test_the_link_restores_the_state(opened, second):
    page = opened.page
    page.get_by_label("1", exact=True).check()
    page.get_by_label("colour by").select_option("frequency")
    page.get_by_label("perturbation shown").fill("-2")
    page.mouse.click(*opened.center(2, 5))
    opened.until("location.hash.includes('frequency') && location.hash === polhode.link()")
    link = page.evaluate("location.hash")
    said = dict(urllib.parse.parse_qsl(link[1:]))
    assert said["axis"] == "1"
    assert float(said["I1"]) == float(opened.row("I1")[0])
    second.follow(link)
    for name in ("axis", "I1", "I2", "I3", "omega0", "epsilon", "omega_squared"):
        assert second.row(name) == opened.row(name)
    assert second.page.get_by_label("colour by").input_value() == "frequency"
    flip = "document.getElementById('flip-period').value"
    assert second.page.evaluate(flip) == page.evaluate(flip)
    second.follow("#axis=3&I1=1e9&_color=nonsense&_x=__proto__&constructor=7")
    assert second.row("axis")[0] == "3"
    assert float(second.row("I1")[0]) == 1.7


def test_no_button_of_the_page_leads_to_the_network(opened):
    """Whatever the toolbars offer is pressed; `opened` sees to it that nothing was asked for."""
    page = opened.page
    windows = []
    page.context.on("page", lambda window: windows.append(window))
    buttons = page.locator(".modebar-btn")
    names = [button.get_attribute("data-title") or "" for button in buttons.all()]
    assert len(names) >= 3
    assert not [name for name in names if re.search("cloud|studio|share|plotly", name, re.IGNORECASE)]
    page.locator("#map").hover()
    for button in buttons.all():
        if button.is_visible():
            button.click()
    page.wait_for_timeout(300)
    assert windows == []
    assert page.locator("a[href], form, iframe, link[href], [src]").count() == 0


@pytest.mark.slow
def test_the_policy_stops_what_would_ask_the_network(second):
    before = len(second.said)
    assert second.page.evaluate("fetch('https://example.org/').then(() => 'asked', () => 'refused')") == "refused"
    assert [url for url in second.asked if not url.startswith("file:")] == []
    assert any("Content Security Policy" in text for text in second.said[before:])
    del second.said[before:]


def test_only_what_flips_has_a_flip_period(opened, plane):
    page = opened.page
    seen = set()
    for axis in (1, 2, 3):
        page.get_by_label(str(axis), exact=True).check()
        point = shown_point(opened, plane)
        flips = exact.max_tilt(exact.set_up(*moments_of(plane, point), *start_of(point)), axis) > math.pi / 2
        assert page.locator("#flip-line").is_visible() == flips
        seen.add(bool(flips))
    assert seen == {True, False}


@pytest.mark.slow
def test_each_tap_chooses_the_cell_under_the_finger(telephone, plane):
    page = telephone.page
    for cell in ((1, 3), (7, 4), (6, 1), (2, 6)):
        page.locator("#map").scroll_into_view_if_needed()
        page.touchscreen.tap(*telephone.center(*cell))
        page.wait_for_timeout(400)  # longer than a browser takes to make a click of a tap
        assert page.evaluate("polhode.state.place.map((at, k) => polhode.map.order[k] + at)")[1:3] == [
            f"I1{cell[0]}",
            f"I2{cell[1]}",
        ]
        assert float(telephone.row("I1")[0]) == plane.I1.values[cell[0]]


@pytest.mark.slow
def test_a_drag_zooms_and_chooses_nothing(opened):
    page = opened.page
    before = page.evaluate("polhode.state.place")
    page.mouse.move(*opened.center(1, 1))
    page.mouse.down()
    page.mouse.move(*opened.center(6, 5), steps=5)
    page.mouse.up()
    page.wait_for_function("document.getElementById('map')._fullLayout.xaxis.range[0] > 0.5")  # zoomed a bit later
    assert page.evaluate("polhode.state.place") == before


def test_enter_and_space_need_no_mouse(opened):
    page = opened.page
    page.locator("#map").focus()
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "play"
    for name in ("map", "body-canvas", "polhode-canvas"):
        page.locator(f"#{name}").focus()
        page.keyboard.press("Space")
        assert page.evaluate("polhode.motion.player.playing")
        page.keyboard.press("Space")
        assert not page.evaluate("polhode.motion.player.playing")


@pytest.mark.slow
def test_a_link_says_where_it_was_not_followed(opened, second):
    page = opened.page
    assert page.locator("#link-notice").is_hidden()
    # an earlier choice's link may be written between a new link and the event that tells of it
    page.evaluate(
        "location.hash = '#axis=7&I3=1.0000000000000002&spin=4'; history.replaceState(null, '', polhode.link())"
    )
    opened.until("!document.getElementById('link-notice').hidden")
    said = page.locator("#link-notice").inner_text()
    assert "no axis = 7: the nearest, 3, is shown" in said
    assert "spin = 4 is not in this map" in said
    assert "I₃" not in said
    page.mouse.click(*opened.center(1, 1))
    opened.until("location.hash === polhode.link()")  # which is written a moment after the page has changed
    values = dict(urllib.parse.parse_qsl(page.evaluate("location.hash")[1:]))
    assert all(len(values[name]) <= 14 for name in ("I1", "I2", "I3", "omega0", "epsilon"))
    second.follow(page.evaluate("location.hash"))
    assert second.page.locator("#link-notice").is_hidden()
    assert second.row("I2") == opened.row("I2")


def test_the_picture_has_a_table_and_words(opened, plane):
    page = opened.page
    page.get_by_label("colour by").select_option("omega_squared")
    page.locator("#map-table summary").click()
    cells = page.locator("#map-table tbody td")
    opened.until("document.querySelectorAll('#map-table tbody td').length === 72")
    first = plane.omega_squared.sel({n: float(opened.row(n)[0]) for n in ("axis", "I3", "omega0")}).squeeze()
    true = float(first.sel(I1=plane.I1[0], I2=plane.I2[-1]))
    assert parsed(cells.first.inner_text()) == pytest.approx(true, rel=6e-3)  # three digits
    assert "Ω² (negative: unstable), measured" in page.locator("#map-summary").inner_text()
    assert page.locator("canvas:not([aria-label], [aria-hidden])").count() == 0


@pytest.mark.slow
def test_a_telephone_needs_no_sideways_scroll_in_either_theme_and_keeps_the_one_chosen(telephone):
    page, theme = telephone.page, "document.documentElement.dataset.theme"
    for scheme in ("dark", "light"):  # the one it does not start with first
        page.emulate_media(color_scheme=scheme)
        telephone.until(f"{theme} === '{scheme}'")
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
    page.get_by_role("button", name="change between light and dark").click()
    assert page.evaluate(theme) == "dark"
    page.reload()
    page.wait_for_selector("html[data-ready]", state="attached")
    assert page.evaluate(theme) == "dark"


@pytest.mark.slow
def test_bodies_have_a_table_and_nudges_a_plot(visit, breaking, folder):
    report.write(breaking, folder / "breakdown.html")
    opened = visit(folder / "breakdown.html")
    page = opened.page
    page.get_by_label("colour by").select_option("omega_squared")
    buttons = page.locator("#map table.bodies button")
    assert buttons.count() == breaking.sizes["body"] * 3
    where = breaking.body.values.tolist().index("Earth") * 3 + 2
    buttons.nth(where).click()
    page.evaluate("polhode.choose({ nudge: null })")
    assert opened.row("body")[0] == "Earth"
    assert opened.row("axis")[0] == "3"
    earth = breaking.sel(body="Earth", axis=3, epsilon=float(opened.row("epsilon")[0])).squeeze()
    assert parsed(opened.row("omega_squared")[1]) == pytest.approx(float(earth.omega_squared), rel=1e-5)
    true = exact.flip_period(exact.set_up(*moments_of(breaking, earth), *start_of(earth)))
    assert float(page.locator("#flip-period").get_attribute("value")) == pytest.approx(true, rel=1e-12)
    curve = page.evaluate("[...document.getElementById('nudges-plot').data.find((t) => t.name === 'axis 3').y]")
    every = breaking.sel(body="Earth", axis=3).squeeze().sortby("epsilon")
    expected = np.abs(np.sqrt(every.omega_squared / every.omega_squared_theory).values - 1)
    shown = np.array([np.nan if v is None else v for v in curve])
    np.testing.assert_allclose(np.nan_to_num(shown), expected, atol=1e-14)  # the rounding of one minus one


@pytest.mark.slow
def test_another_system_draws_with_its_mode(visit, folder):
    ds = oscillator()
    report.write(ds, folder / "oscillator.html")
    opened = visit(folder / "oscillator.html", "#length=0.92&spin=0.1&equilibrium=upright&mode=2")
    page = opened.page
    assert page.evaluate("[polhode.state.x, polhode.state.y].sort()") == ["length", "spin"]
    point = ds.isel(length=2, spin=0, equilibrium=1, mode=1)
    assert parsed(opened.row("omega_squared")[1]) == pytest.approx(float(point.omega_squared), rel=1e-5)
    assert parsed(opened.row("angle")[1]) == pytest.approx(float(point.angle), rel=1e-5)
    assert page.locator("#motion").is_hidden()
    assert "grow by a factor e" in page.locator("#mode-words").inner_text()
    page.get_by_label("hanging").check()
    opened.until("document.getElementById('mode-words').textContent.includes('oscillate with period')")
    page.evaluate("location.hash = '#length=0.56&spin=0.1&equilibrium=hanging&mode=1'")
    opened.until("document.getElementById('mode-words').textContent.includes('stay constant')")


@pytest.mark.slow
def test_a_system_without_a_part_of_its_own_promises_none(visit, folder):
    depth = xr.DataArray(np.arange(6.0).reshape(2, 3), {"x": [1.0, 2.0], "y": [1.0, 2.0, 3.0]}, ("x", "y"))
    html = written(depth.to_dataset(name="depth").assign_attrs(system="tumbling"), folder / "plain.html")
    assert "motion" not in re.sub("<(script|style).*?</(script|style)>", "", html, flags=re.DOTALL)
    opened = visit(folder / "plain.html", "#x=2&y=3")
    assert opened.row("depth") == ("5", "5")
    assert opened.page.locator("#part > section").count() == 0
    opened.page.locator("#map").focus()
    opened.page.keyboard.press("ArrowLeft")
    opened.page.keyboard.press("Enter")
    assert opened.row("depth") == ("2", "2")


@pytest.mark.slow
def test_a_symmetric_top_turns_about_its_figure_axis(visit, folder):
    """The body's turn about its own axis takes 2π/(ω3 |ratio − 1|), whatever the angle."""
    definition = {
        "system": "symmetric_top",
        "grid": {"ratio": [0.4, 1.6], "omega3": [-2.0, 5.0], "half_angle": [10.0, 40.0]},
    }
    report.write(sweeps.survey(definition), folder / "top.html")
    opened = visit(folder / "top.html", "#ratio=1.6&omega3=-2&half_angle=40")
    assert opened.page.evaluate("2 * polhode.motion.trajectory.flipPeriod") == pytest.approx(
        2 * math.pi / 1.2, rel=1e-14
    )
    spin = opened.page.evaluate("polhode.motion.omega")
    assert math.degrees(math.atan2(math.hypot(spin[0], spin[1]), abs(spin[2]))) == pytest.approx(40.0, rel=1e-14)
    assert "Stable" in opened.page.locator("#motion-words").inner_text()
    assert "angle between ω and the figure axis" in opened.page.locator("#motion-words").inner_text()


def strange_names():
    """A plane and a curve of a map that no system made, its every name one that Plotly could read as a link."""
    link = "<a href='https://example.org/'>%s</a>"
    values = (tuple(link % name for name in "xy"), np.arange(6.0).reshape(2, 3))
    axes = {link % "x": [1.0, 2.0], link % "y": [1.0, 2.0, 3.0]}
    return xr.Dataset({link % "z": values}, axes, {"system": "tumbling"})


KINDS = {
    "plane": lambda: sweeps.survey(PLANE),
    "curve": lambda: sweeps.survey(PLANE | {"grid": {"I1": [0.5, 0.6, 0.7], "I2": 1.0, "I3": 0.9, "omega0": 2.0}}),
    "bodies": lambda: sweeps.survey("breakdown"),
    "oscillators": oscillator,
    "equilibria": equilibria,
    "uncertain": lambda: sweeps.survey(UNCERTAIN),
    "points": lambda: sweeps.survey(DRAWN),
    "names": strange_names,
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_hostile_texts_do_not_run_and_lead_nowhere(kind, visit, folder):
    report.write(hostile(KINDS[kind]()), folder / "hostile.html")
    opened = visit(folder / "hostile.html", f"#body={urllib.parse.quote(HOSTILE)}&_color={urllib.parse.quote(HOSTILE)}")
    page = opened.page
    page.evaluate(OPEN_ALL)
    plots = page.locator(".js-plotly-plot:visible").all()
    assert plots or kind == "bodies"
    for place in (*plots, page.locator("#map")):
        place.hover()
        page.wait_for_timeout(200)
        assert page.locator("svg a, a[href], img, iframe, form").count() == 0
    assert page.evaluate("globalThis.hostile") is None
    assert page.locator("h1").inner_text() == HOSTILE
    if kind == "plane":  # as it stands
        assert HOSTILE in page.locator("#map .xtitle").text_content()
    assert len(opened.asked) == 1


@pytest.mark.slow
def test_an_unstable_motion_is_followed_by_its_full_equations(visit, folder):
    """A bead at the bottom of a hoop, beside SciPy's DOP853 of the equation written by hand; the nudge is 0.01 rad."""
    grid = {"radius": [0.5, 1.0, 1.5], "spin_rate": [2.0, 6.0]}
    ds = sweeps.survey({"system": "bead_on_hoop", "grid": grid})
    report.write(ds, folder / "hoop.html")
    opened = visit(folder / "hoop.html", "#radius=1&spin_rate=6&equilibrium=bottom")
    times, theta = opened.page.evaluate("[polhode.map.mode.times, polhode.map.mode.followed[0]]")
    slope = lambda t, y: [y[1], (36.0 * math.cos(y[0]) - 9.80665) * math.sin(y[0])]  # noqa: E731
    start = opened.page.evaluate("polhode.map.mode.motion[0]")
    along = [0.01, 0.01 * math.sqrt(36.0 - 9.80665)]  # the mode that grows
    np.testing.assert_allclose(start, along, rtol=1e-6)  # slopes by differences of the page's forces
    true = solve_ivp(slope, (0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-14).y[0]
    # its tolerance, 1e-11 rad, grown with the motion a hundredfold out, and as much again back near the bottom
    np.testing.assert_allclose(theta, true, rtol=0, atol=1e-6)
    assert max(theta) > 1
    words = opened.page.locator("#mode-words").inner_text()
    assert parsed(re.search(r"at most ([\d.]+)", words)[1]) == pytest.approx(max(true), rel=5e-3)  # three digits
    tilt = math.acos(9.80665 / 36.0)
    drawn = opened.page.evaluate(
        "document.getElementById('places-plot').data.filter(({ mode }) => mode === 'markers')"
        ".flatMap((trace) => trace.x.map((x, i) => [x, trace.y[i]]))"
    )
    assert any(x == 1.0 and y == pytest.approx(tilt, rel=1e-6) for x, y in drawn)


@pytest.mark.slow
def test_a_motion_near_l4_is_that_of_the_equations_in_space_at_rest(visit, folder):
    """Two bodies that attract the third, in axes that do not turn, by DOP853: another form of the same equations."""
    ds = sweeps.survey({"system": "lagrange_points", "grid": {"mass_ratio": [0.01, 0.02]}})
    report.write(ds, folder / "points.html")
    opened = visit(folder / "points.html", "#mass_ratio=0.01&equilibrium=L4&_nudge=0.01")
    times, x, y = opened.page.evaluate("[polhode.map.mode.times, ...polhode.map.mode.followed]")
    speed = opened.page.evaluate("polhode.map.mode.motion[0].slice(2)")

    def slope(t, state):
        places = [(r * math.cos(t), r * math.sin(t)) for r in (-0.01, 0.99)]
        pulls = [np.subtract(p, state[:2]) for p in places]
        return [*state[2:], *(0.99 * pulls[0] / np.hypot(*pulls[0]) ** 3 + 0.01 * pulls[1] / np.hypot(*pulls[1]) ** 3)]

    start = [x[0], y[0], speed[0] - y[0], speed[1] + x[0]]
    u, v = solve_ivp(slope, (0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-14).y[:2]
    c, s = np.cos(times), np.sin(times)
    # its tolerance, 1e-11, over some ten periods of motions that do not grow
    np.testing.assert_allclose([x, y], [c * u + s * v, c * v - s * u], atol=1e-8)
    theory = opened.page.evaluate("polhode.map.mode.theory")
    np.testing.assert_allclose(theory, [x, y], atol=2e-3)  # linear theory: ε² and its growth in phase
    assert opened.page.locator("#mechanism").is_visible()


@pytest.mark.slow
def test_a_shaken_pendulum_moves_as_scipy_has_it(visit, folder):
    grid = {"amplitude": [0.1, 0.2], "frequency": [30.0, 60.0]}
    report.write(sweeps.survey({"system": "kapitza_pendulum", "grid": grid}), folder / "shaken.html")
    opened = visit(folder / "shaken.html", "#amplitude=0.1&frequency=60&equilibrium=inverted&_nudge=0.1")
    times, theta = opened.page.evaluate("[polhode.map.mode.times, polhode.map.mode.followed[0]]")
    slope = lambda t, y: [y[1], -(9.80665 - 0.1 * 3600 * math.cos(60 * t)) * math.sin(y[0])]  # noqa: E731
    true = solve_ivp(slope, (0, times[-1]), [math.pi + 0.1, 0.0], "DOP853", times, rtol=1e-12, atol=1e-14).y[0]
    np.testing.assert_allclose(theta, true, atol=1e-7)  # its tolerance, 1e-10, of some thousand steps
    assert np.abs(np.subtract(theta, np.pi)).max() < 0.5  # it stays upside down
    assert "stay bounded" in opened.page.locator("#say").inner_text()


def test_a_growing_motion_starts_along_its_floquet_vector(visit, folder):
    """x'' + (a - 2 q cos 2t) x = 0 in the first tongue: each period of π multiplies the motion by one multiplier."""
    report.write(
        sweeps.survey({"system": "mathieu", "grid": {"a": [1.0, 1.1], "q": [0.3, 0.5]}}), folder / "tongue.html"
    )
    opened = visit(folder / "tongue.html", "#a=1&q=0.5&_nudge=0.001")
    times, x, sizes = opened.page.evaluate(
        "[polhode.map.mode.times, polhode.map.mode.followed[0], polhode.map.mode.sizes]"
    )
    slope = lambda t, y: [y[1], -(1 - np.cos(2 * t)) * y[0]]  # noqa: E731
    matrix = np.transpose(
        [solve_ivp(slope, (0, np.pi), e, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1] for e in np.eye(2)]
    )
    values, vectors = np.linalg.eig(matrix)
    fastest = np.argmax(np.abs(values))
    assert np.abs(values[fastest]) > 1.5
    start = 1e-3 * sizes[0] * vectors[:, fastest] / vectors[0, fastest]
    true = solve_ivp(slope, (0, times[-1]), start, "DOP853", times[: len(x)], rtol=1e-12, atol=1e-15).y[0]
    # the matrix on the page is a difference quotient: its vector is off by some 1e-9
    np.testing.assert_allclose(x, true, rtol=1e-6, atol=1e-7 * np.abs(true).max())


@pytest.mark.slow
def test_eigenvalues_stand_in_the_plane_as_in_the_map(visit, folder):
    ds = equilibria()
    report.write(ds, folder / "spectrum.html")
    opened = visit(folder / "spectrum.html", f"#moment_of_weight={float(ds.moment_of_weight[6])}&spin_rate=0.5")
    rings, dots = opened.page.evaluate(
        "document.getElementById('spectrum-plot').data.map(({ x, y, error_x }) => [x, y, error_x && error_x.array])"
    )
    point = ds.isel(moment_of_weight=6, spin_rate=0, equilibrium=0)
    np.testing.assert_array_equal(dots[:2], [point.eigenvalue_real, point.eigenvalue_imag])
    np.testing.assert_array_equal(rings[:2], [point.eigenvalue_real_theory, point.eigenvalue_imag_theory])
    assert dots[2] == pytest.approx([0.02] * 4, rel=1e-7)  # the page keeps seven digits of errors
    said = opened.page.locator("#say").inner_text()
    assert parsed(said.split("by a factor e in ")[1]) == pytest.approx(1 / float(point.growth_rate.max()), rel=1e-3)
    opened.page.locator("#spectrum-table summary").click()
    opened.until("document.querySelectorAll('#spectrum-table tbody tr').length === 4")  # an event fills it


@pytest.mark.slow
def test_a_bodys_own_mesh_turns_and_no_file_is_read_for_it(visit, folder, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((3.0, 2.0, 1.0)).export(tmp_path / "brick.stl")
    mesh = {"file": str(tmp_path / "brick.stl"), "mass": 1.0}
    box = {"name": "Box", "I1": 1.0, "I2": 2.0, "I3": 2.5}
    ds = sweeps.survey({"bodies": [{"name": "Brick", "mesh": mesh}, box], "grid": {"omega0": 1.0, "epsilon": 0.01}})
    write_map(ds, tmp_path / "mesh.nc")
    (tmp_path / "brick.stl").unlink()
    with open_map(tmp_path / "mesh.nc") as stored:
        report.write(stored, folder / "mesh.html")
    opened = visit(folder / "mesh.html", "#body=Brick&axis=2")
    corners = opened.page.evaluate("polhode.motion.faces.map((face) => face.corners)")
    half = np.array([1.5, 1.0, 0.5]) / np.linalg.norm([1.5, 1.0, 0.5])
    np.testing.assert_allclose(np.abs(corners), np.broadcast_to(half, (12, 3, 3)), atol=1e-4)  # of 16 bits
    assert opened.page.locator("#shape").input_value() == "own"
    opened.follow("#body=Box&axis=2")
    assert opened.page.locator("#shape").input_value() != "own"
    assert opened.page.locator("#shape option[value=own]").is_disabled()


@pytest.mark.slow
def test_draws_lie_on_the_triangle_and_are_chosen_by_link_click_and_key(visit, uncertain, folder):
    report.write(uncertain, folder / "draws.html")
    opened = visit(folder / "draws.html", "#body=a_box&axis=2&_draw=7")
    page, one = opened.page, uncertain.sel(axis=2).squeeze()
    plot = "document.getElementById('drawn-plot')"
    x, y, ring = page.evaluate(f"(([dots, ...more]) => [dots.x, dots.y, more.at(-1).x])({plot}.data)")
    np.testing.assert_allclose([x, y], [one.I1_draw / one.I3_draw, one.I2_draw / one.I3_draw], rtol=2e-7)  # of float32
    assert ring == [x[7]]
    assert "Draw 7:" in page.locator("#drawn-chosen").inner_text()
    assert "a_box is unstable" in page.locator("#say").inner_text()
    page.locator("#drawn-plot").focus()
    page.keyboard.press("ArrowRight")
    opened.until("location.hash.includes('_draw=8')")
    page.locator("#drawn-plot .drag").first.scroll_into_view_if_needed()
    lone = int(np.argmax(np.array(y) - np.array(x)))  # the outermost: no other lies over it
    at = page.evaluate(
        f"""([x, y]) => {{
            const {{ xaxis, yaxis }} = {plot}._fullLayout, box = {plot}.getBoundingClientRect();
            return [box.left + xaxis._offset + xaxis.d2p(x), box.top + yaxis._offset + yaxis.d2p(y)];
        }}""",
        [x[lone], y[lone]],
    )
    page.mouse.move(*at)
    page.mouse.click(*at)
    opened.until("(draw) => polhode.state.draw === draw", lone)
    # by theory: the ground is unstable where axis 2 is the middle one, which each draw's regime says too
    counts = page.evaluate("document.getElementById('drawn-histogram').data[0].y.reduce((a, b) => a + b)")
    assert counts == int(np.isfinite(one.growth_rate_draw).sum())


@pytest.mark.slow
def test_a_page_prints_on_one_sheet(visit, plane_path, folder):
    report.write(oscillator(), folder / "sheet.html")
    for path in (plane_path, folder / "sheet.html"):
        opened = visit(path, viewport={"width": 1280, "height": 800})
        printed = opened.page.pdf(prefer_css_page_size=True, print_background=True)
        assert re.findall(rb"/Count (\d+)", printed) == [b"1"]


DRAWN = {
    "axes": [1, 2],
    "grid": {
        "ratios": {"I1_over_I3": {"start": 0.3, "stop": 0.9}, "thickness": {"start": 0.2, "stop": 0.7}},
        "omega0": 1.0,
    },
    "sample": {"num": 6},
}
OPEN_ALL = "document.querySelectorAll('details').forEach((details) => (details.open = true))"


@pytest.mark.slow
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("curve", "names")])
def test_axe_finds_nothing(kind, visit, folder):
    """Axe, a checker of accessibility that is not ours: by all its rules in light, and the contrast in dark again."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    report.write(KINDS[kind](), folder / f"axe-{kind}.html")
    opened = visit(folder / f"axe-{kind}.html", color_scheme="light")
    opened.page.evaluate(OPEN_ALL)
    for scheme, options in (("light", {}), ("dark", {"runOnly": ["color-contrast"]})):
        opened.page.emulate_media(color_scheme=scheme)
        opened.page.wait_for_timeout(100)
        found = axe.run(opened.page, options=options | {"resultTypes": ["violations"]})
        assert found.violations_count == 0, found.generate_report()


# ---------------------------------------------------------------------------------------------------------
# The page's own mathematics


@pytest.mark.slow
def test_elliptic_functions_of_the_page_against_mpmath(opened):
    """Error of a phase: some 1e-16 of u; 1e-12 is the bar, and dn and cn hold it of themselves."""
    cases = [(m, u) for m in (0.0, 1e-9, 0.3, 0.5, 0.9, 1 - 1e-6) for u in (0.0, 1e-9, 0.4, 1.9, -3.3, 47.0)]
    complements = [(1e-12, u) for u in (0.4, 9.0, 31.0)]
    with mpmath.workdps(40):
        for m, u in cases:
            found = opened.page.evaluate("([u, m]) => polhode.jacobi(u, m, 1 - m)", [u, m])
            for kind, value in zip(("sn", "cn", "dn"), found, strict=True):
                assert value == pytest.approx(float(mpmath.ellipfun(kind, u, m=mpmath.mpf(m))), abs=1e-12, rel=1e-12)
            K = opened.page.evaluate("(m) => polhode.completeK(m, 1 - m)", m)
            assert pytest.approx(float(mpmath.ellipk(mpmath.mpf(m))), rel=1e-12) == K
        for m1, u in complements:
            found = opened.page.evaluate("([u, m1]) => polhode.jacobi(u, 1 - m1, m1)", [u, m1])
            for kind, value in zip(("sn", "cn", "dn"), found, strict=True):
                true = mpmath.ellipfun(kind, u, m=1 - mpmath.mpf(m1))
                assert value == pytest.approx(float(true), rel=1e-12)
    limit = opened.page.evaluate("polhode.jacobi(2, 1, 0)")
    assert limit == pytest.approx([math.tanh(2), 1 / math.cosh(2), 1 / math.cosh(2)], rel=1e-15)
    assert opened.page.evaluate("polhode.completeK(1, 0) === Infinity")


BODIES = {
    "asymmetric": ([1.0, 2.0, 2.7], [1e-4, 10.0, -2e-4]),
    "near the separatrix": ([1.0, 2.0, 3.0], [1e-9, 1.0, 2e-9]),
    "on the separatrix": ([1.0, 2.0, 3.0], [1.0, 0.5, 0.5773502691896258]),
    "oblate": ([1.0, 1.0, 1.8], [0.2, -0.1, 3.0]),
    "prolate, transverse": ([2.0, 2.0, 0.5], [3.0, 1e-3, 2e-3]),
    "sphere": ([1.3, 1.3, 1.3], [0.3, 0.2, -1.0]),
    "principal spin": ([1.0, 2.0, 3.0], [0.0, 2.0, 0.0]),
    "molecule": ([1.0e-47, 1.9e-47, 2.9e-47], [1e9, 1e13, -3e9]),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BODIES)
def test_rotations_of_the_page_against_direct_integration(opened, name):
    moments, start = BODIES[name]
    times = np.linspace(0.0, 15.0, 7) / np.linalg.norm(start)
    found = opened.page.evaluate(
        "([I, w, times]) => { const one = new polhode.Trajectory(I, w); return times.map((t) => one.at(t)); }",
        [moments, start, times.tolist()],
    )
    expected = direct.rotation(moments, start, times, 1e-13)
    # the direct solution's own tolerance, grown by up to e^(0.6·15) about the middle axis
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.linalg.norm(start))
    np.testing.assert_allclose(found, exact.rotation(moments, start, times), atol=1e-13 * np.linalg.norm(start))


@pytest.mark.slow
@pytest.mark.parametrize("name", BODIES)
def test_attitudes_of_the_page_are_the_closed_form(opened, name):
    moments, start = BODIES[name]
    times = np.linspace(-9.0, 200.0, 12) / np.linalg.norm(start)
    found = opened.page.evaluate(
        """([I, w, times]) => {
            const one = new polhode.Attitude(new polhode.Trajectory(I, w));
            return [one.at(0), ...times.map((t) => one.at(t))];
        }""",
        [moments, start, times.tolist()],
    )
    first, *turned = (Rotation.from_quat(q, scalar_first=True) for q in found)
    L = np.multiply(moments, start)
    np.testing.assert_allclose(first.apply(L / np.linalg.norm(L)), [0, 0, 1], atol=1e-14)
    for q, wanted in zip(turned, exact.attitude(moments, start, times), strict=True):
        assert (q.inv() * first * Rotation.from_quat(wanted, scalar_first=True)).magnitude() <= 1e-10


@pytest.mark.slow
def test_the_body_is_seen_from_space_and_from_itself(opened):
    page = opened.page
    page.get_by_label("time", exact=True).fill("300")
    seen = {}
    for frame in ("body", "space"):
        page.locator("#frame").select_option(frame)
        assert ("Body frame" in page.locator("#body-note").inner_text()) == (frame == "body")
        seen[frame] = page.evaluate("document.getElementById('body-canvas').toDataURL()")
    assert seen["body"] != seen["space"]
    drawn = page.evaluate("document.getElementById('herpolhode-canvas').toDataURL()")
    page.get_by_label("time", exact=True).fill("700")
    assert page.evaluate("document.getElementById('herpolhode-canvas').toDataURL()") != drawn


# ---------------------------------------------------------------------------------------------------------
# Shapes: the plane is the triangle of all bodies

SHAPES = {
    "axes": [1, 2],
    "grid": {
        "ratios": {
            "I1_over_I3": {"start": 0.1, "stop": 0.9, "num": 9},
            "thickness": {"start": 0.1, "stop": 0.9, "num": 9},
        },
        "I3": [1.0, 2.0],
        "omega0": 1.0,
    },
}


SHAPE = ("I1_over_I3", "thickness")


@pytest.fixture(scope="module")
def shapes():
    return sweeps.survey(SHAPES)


def on_map(opened, x, y):
    """Where a point of the picture lies on the screen."""
    return opened.page.evaluate(
        """([x, y]) => {
            const plot = document.getElementById("map"), { xaxis, yaxis } = plot._fullLayout;
            const box = plot.getBoundingClientRect();
            return [box.left + xaxis._offset + xaxis.d2p(x), box.top + yaxis._offset + yaxis.d2p(y)];
        }""",
        [x, y],
    )


def test_coordinates_keep_their_digits_where_others_are_shortened():
    noise = np.random.default_rng(3).random(4000)
    both = [report_columns.PageColumn("rate", noise), report_columns.PageColumn("I2", noise, exact=True)]
    whole = sum(len(report_columns.pack(column).text) for column in both)
    rate, moment = report_columns.pack_within(both, whole - 1)
    assert (rate.dtype, moment.dtype, moment.exponent) == ("f4", "f8", 0)


def test_moments_of_shapes_are_coordinates_of_the_page(shapes, folder):
    report.write(shapes, folder / "shapes.html")
    page = (folder / "shapes.html").read_text()
    told = json.loads(re.search(r'<script[^>]*id="map-data"[^>]*>(.*?)</script>', page, re.DOTALL)[1])
    found = {one["name"]: (one["role"], one["dtype"], one["powers"].get("I3")) for one in told["variables"]}
    assert found["I1"] == found["I2"] == ("coordinate", "f8", -1)


@pytest.mark.slow
def test_shapes_are_drawn_on_their_triangle(visit, shapes, folder):
    report.write(shapes, folder / "shapes.html")
    opened = visit(folder / "shapes.html", "#axis=1&I1=1.6&I2=1.04&I3=2")  # x = 0.8, y = 0.52: room 0.4
    page = opened.page
    assert "no I₁" not in page.locator("#link-notice").inner_text()
    values = [float(opened.row(name)[0]) for name in ("axis", "I1_over_I3", "thickness", "I1", "I2", "I3")]
    assert values == pytest.approx([1, 0.8, 0.4, 1.6, 1.04, 2.0], rel=1e-15)
    assert page.evaluate("document.getElementById('map')._fullLayout.yaxis.title.text") == "I₂/I₃"
    named = page.evaluate(
        """() => {
            const { x, y, text } = document.getElementById("map").data.find(({ mode }) => mode === "markers+text");
            return text.map((name, i) => [name, x[i], y[i]]);
        }"""
    )
    assert [name for name, *_ in named] == [body["name"] for body in PRESETS]
    moments = np.array([body["moments"] for body in PRESETS])
    ratios = moments[:, :2] / moments[:, 2:]
    assert np.array([at for _, *at in named]) == pytest.approx(ratios, rel=1e-12)  # roundings of quotients
    rate = shapes.omega_squared.isel(axis=0, I3=1).squeeze()
    signed = (np.sign(rate) * np.sqrt(np.abs(rate))).values
    for across, up in np.random.default_rng(5).random((60, 2)).tolist():
        cell = page.evaluate(
            "([x, y]) => (({ exists, value, place }) => ({ exists, value, place }))(polhode.locate(x, y))", [across, up]
        )
        thickness = 1 - (1 - up) / across
        if thickness < 0:  # below the flat bodies
            assert (cell["exists"], cell["place"]) == (False, None)
            continue
        i, j = (int(np.abs(shapes[name] - at).argmin()) for name, at in zip(SHAPE, (across, thickness), strict=True))
        assert cell["place"][1:3] == [i, j]
        assert cell["value"] == pytest.approx(signed[i, j], rel=1e-12)
    before = page.evaluate(SHOWN)
    page.mouse.click(*on_map(opened, 0.23, 0.17))
    assert page.locator("#tip").inner_text() == "No rigid body has these moments."
    assert page.evaluate(SHOWN) == before
    page.mouse.click(*on_map(opened, 0.5, 0.95))  # thickness 0.9
    opened.until("polhode.state.place[1] === 4 && polhode.state.place[2] === 8")
    page.locator("#map-table summary").click()
    opened.until("document.querySelectorAll('#map-table tbody td').length === 81")
    assert "81 points" in page.locator("#map-summary").inner_text()
    assert "physically impossible" not in page.locator("#map-summary").inner_text()


# ---------------------------------------------------------------------------------------------------------
# Any body, and the lecture


def test_a_definition_says_where_its_page_opens(tmp_path):
    told = data_of(written(sweeps.survey(PLANE | {"start_at": {"axis": 1, "I1": 0.8}}), tmp_path / "r.html"))
    assert told["start"]["link"] == "axis=1&I1=0.8"


@pytest.fixture(scope="module")
def shapes_path(shapes, folder):
    report.write(shapes, folder / "any-body.html")
    return folder / "any-body.html"


@pytest.mark.slow
def test_any_body_is_shown_at_once_with_the_numbers_of_the_command(visit, shapes_path, capsys):
    page = visit(shapes_path).page
    moments = [1.0, 2.0, 2.5]
    assert main(["body", "--moments", *map(str, moments), "--omega0", "10", "--epsilon", "0.01", "--json"]) == 0
    spins = json.loads(capsys.readouterr().out)["axes"]
    taken = page.evaluate(
        """(moments) => {
            polhode.choose({ spin: 10, nudge: 0.01 });
            const begun = performance.now();
            moments.forEach((I, i) => (document.getElementById(`own-I${i + 1}`).value = String(I)));
            document.getElementById("own-I3").dispatchEvent(new Event("input"));
            document.body.getBoundingClientRect();
            return performance.now() - begun;
        }""",
        moments,
    )
    print(f"a typed body is shown in {taken:.0f} ms")
    assert "nothing is measured here" in page.locator("#row-where").inner_text()
    for axis, spin in enumerate(spins, start=1):
        found = page.evaluate("(more) => polhode.axisOutcome(...more)", [moments, axis, 10, 0.01, 0.6])
        linear = 1 / found["rate"] if found["square"] < 0 else 2 * math.pi / found["rate"]
        assert linear == pytest.approx(spin["e_folding_time"] or spin["euler_period"], rel=1e-6)
        if spin["flip_period"]:
            assert found["period"] == pytest.approx(spin["flip_period"], rel=1e-6)
        shown = page.locator(f"#outcome-{axis}").text_content()
        assert ("unstable" in shown) == (axis == 2)
        assert parsed(re.search(r"(?:wobble period|e-fold in) ([\d.]+)", shown)[1]) == pytest.approx(linear, rel=1e-5)
    page.locator("#own-I1").fill("9")
    assert "greater than the sum of the others" in page.locator("#own-notice").inner_text()
    assert page.evaluate("polhode.state.moments") == moments


SPUN = [
    (1.0, 1.0, 0.5),
    (1.0, 1.0, 1.5),
    (1.0, 2.0, 2.5),
    (2.5, 1.0, 2.0),
    (2.0, 2.0, 2.0),
    (1.5, 1.0, 1.0),
    (1.0, 1.9, 2.0),
]


@pytest.mark.slow
@pytest.mark.parametrize("epsilon", [0.01, 0.9])
def test_the_page_words_each_spin_as_the_command_does(visit, plane_path, epsilon):
    page = visit(plane_path).page
    for moments in SPUN:
        for spin in prediction.spins(moments, 10.0, epsilon, 0.6):
            verdict = VERDICTS[spin.regime]
            found = page.evaluate("(more) => polhode.axisOutcome(...more)", [moments, spin.axis, 10.0, epsilon, 0.6])
            assert found["regime"] == spin.regime
            assert found["words"].startswith(f"{verdict.words}: ")
            assert verdict.more in found["words"]
            assert bool(found["flips"]) == (spin.flip_period is not None)
            page.evaluate(
                "([moments, axis, nudge]) => polhode.choose({ moments, spin: 10, nudge, named: null, "
                "place: polhode.state.place.map((k, i) => (polhode.map.order[i] === 'axis' ? axis - 1 : k)) })",
                [moments, spin.axis, epsilon],
            )
            said = page.locator("#motion-words").inner_text()
            assert said.split(".")[0].split(",")[0].lower() == verdict.words.split(",")[0]
            assert ("wobbles with period" in said) == (spin.wobble_period is not None)
            assert ("flips" in said) == (spin.flip_period is not None)
            assert ("flat spin" in said) == (spin.regime == "stable_minor")
            assert ("drifts away" in said) == (spin.regime == "marginal")


@pytest.mark.slow
def test_the_ring_is_dragged_between_the_points_and_back_goes_back(visit, shapes_path):
    opened = visit(shapes_path, "#axis=1&I1_over_I3=0.5&thickness=0.5&I3=1")
    page = opened.page
    x, y = on_map(opened, 0.5, 0.75)
    page.wait_for_timeout(200)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(*on_map(opened, 0.62, 0.83))  # at once: where the hand pauses, Back goes
    page.wait_for_timeout(100)
    page.mouse.up()
    assert page.evaluate("polhode.state.moments") == pytest.approx([0.62, 0.83, 1.0], abs=0.005)  # of pixels
    opened.until("location.hash.includes('_moments')")
    page.go_back()
    opened.until("polhode.state.moments === null")
    assert opened.row("I1")[0] == "0.5"


SMALL = """() => [...document.querySelectorAll("body *")].filter((one) => one.checkVisibility()
    && [...one.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim()) && !one.closest("noscript")
    && one.getBoundingClientRect().width > 1 && parseFloat(getComputedStyle(one).fontSize) < 20
).map((one) => `${one.tagName} ${one.className} ${one.textContent.slice(0, 40)}`)"""


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), [(1920, 1080), (1280, 720)])
def test_a_lecture_of_five_steps_fits_the_screen_in_large_letters(visit, shapes_path, width, height):
    page = visit(shapes_path, viewport={"width": width, "height": height}).page
    page.keyboard.press("l")
    said = set()
    for step in range(1, 6):
        assert page.locator("#step-number").inner_text() == f"{step} of 5"
        page.wait_for_timeout(300)
        said.add(page.locator("#step-title").inner_text())
        assert page.evaluate(SMALL) == []
        ends = "[...document.querySelectorAll('main *')].filter((one) => one.checkVisibility() && !one.closest('svg'))"
        assert page.evaluate(f"Math.max(...{ends}.map((one) => one.getBoundingClientRect().bottom))") <= height
        page.keyboard.press("ArrowRight")
    assert len(said) == 5
    page.keyboard.press("l")
    assert page.locator("#own").is_visible()


@pytest.mark.slow
@pytest.mark.parametrize("name", catalogue.shipped())
def test_the_page_of_each_shipped_sweep_plays_without_a_word_on_its_console(name, visit, folder, monkeypatch):
    """Of a few points of each; `visit` reads what the console said."""
    monkeypatch.setattr(gallery, "MOST", 36)
    monkeypatch.setattr(gallery, "MANY", {})
    values = gallery.reduced(plain(read_text(file_text(catalogue.shipped()[name]))))
    report.write(sweeps.survey(values), folder / f"{name}.html")
    visit(folder / f"{name}.html", reduced_motion="no-preference").page.wait_for_timeout(2_000)


THROWS = {
    "twist": {"grid": {"I1": 0.3, "I2": 1.0, "I3": 1.2, "chi": [0.01, 0.1]}},
    "tumbling": {"grid": {"I1": 0.3, "I2": 0.8, "I3": 1.0, "energy": [1.1, 2.0]}},
    "pumped_body": {
        "axes": [3],
        "grid": {"I1": 1.0, "I2": 1.9, "I3": 2.0, "depth2": [0.0, 0.2], "frequency": 0.25, "omega0": 0.5},
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("system", THROWS)
def test_bodies_of_other_systems_move_as_the_command_has_it(visit, folder, system):
    """Beside DOP853 of the angular momentum's equation from the same start, of changing moments too."""
    report.write(sweeps.survey({"system": system, **THROWS[system]}), folder / f"{system}.html")
    page = visit(folder / f"{system}.html").page
    end, moments, starts, found = page.evaluate(
        "(({ end, moments, trajectory }) => [end, moments, trajectory.at(0), trajectory.at(0.3 * end)])(polhode.motion)"
    )
    depth = page.evaluate("polhode.motion.shaken?.depths[1] ?? 0")
    inertia = lambda t: np.array(moments) * np.array([1, 1 + depth * math.cos(0.25 * t), 1])  # noqa: E731
    L = inertia(0) * starts
    slope = lambda t, L: np.cross(L, L / inertia(t))  # noqa: E731
    true = solve_ivp(slope, (0, 0.3 * end), L, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1] / inertia(0.3 * end)
    # of changing moments, lines between the steps: (2 pi/160)^2/8 of the rates
    np.testing.assert_allclose(found, true, atol=(1e-8 if system != "pumped_body" else 1e-3) * np.abs(starts).max())
