"""Reports as text and in a browser: helpers of the tests of pages.

POLHODE_ALL_CASES=1 has further sweeps that ship.
"""

import json
import re
from functools import cache
from pathlib import Path

import euler
import numpy as np
import repeated
import xarray as xr
from maps import random_map

import sweeps
from sweeps.views import report

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


TENTHS = {"start": 0.1, "stop": 0.9, "num": 9}
LINK = "<a href='https://example.org/'>%s</a>"
KINDS = {  # kind of page → definition of its map
    "plane": PLANE,
    "curve": PLANE | {"grid": {"I1": [0.5, 0.6, 0.7], "I2": 1.0, "I3": 0.9, "omega0": 2.0}},
    "bodies": "breakdown",
    "oscillators": {"system": "double_pendulum", "grid": {"mass2": [0.5, 1.0, 2.0], "length2": [0.5, 1.0]}},
    "equilibria": {"system": "sleeping_top", "grid": {"moment_of_weight": [1, 2, 4], "spin_rate": [1, 2, 3, 4]}},
    "uncertain": {
        "bodies": [{"name": "a_box", "I1": 1.0, "I2": 2.0, "I3": 2.5, "uncertainty": "10 %"}],
        "draws": 100,
        "grid": {"omega0": 0.1},
        "keep": True,
    },
    "points": {
        "axes": [1, 2],
        "grid": {
            "ratios": {"I1_over_I3": {"start": 0.3, "stop": 0.9}, "thickness": {"start": 0.2, "stop": 0.7}},
            "omega0": 1.0,
        },
        "sample": {"num": 6},
    },
    "orbit": {"system": "orbit", "grid": {"k1": [0.3, 0.5], "k3": 0.2, "eccentricity": [0.0, 0.1]}},
    "shapes": {
        "axes": [1, 2],
        "grid": {"ratios": {"I1_over_I3": TENTHS, "thickness": TENTHS}, "I3": [1.0, 2.0], "omega0": 1.0},
    },
}


@cache
def map_of(kind):
    """Return the map of a kind of page; that of "names" no system made, and Plotly could read its names as links."""
    if kind == "orbit":  # no test reads its values
        return random_map(KINDS[kind])
    if kind != "names":
        return sweeps.survey(KINDS[kind])
    values = (tuple(LINK % name for name in "xy"), np.arange(6.0).reshape(2, 3))
    axes = {LINK % "x": [1.0, 2.0], LINK % "y": [1.0, 2.0, 3.0]}
    return xr.Dataset({LINK % "z": values}, axes, {"system": "tumbling"})


def write_report(ds, path, **options):
    report.write_report(ds, path, **options)
    return path.read_text(encoding="utf-8")


def data_of(html):
    return json.loads(re.search(r'id="map-data">(.*?)</script>', html, re.DOTALL)[1])


def hostile(ds):
    """Return a map in which every text, names in coordinates too, tries to run a script or to lead elsewhere."""
    bad = {"title": HOSTILE, "history": HOSTILE, HOSTILE: "x", "definition": f"# {HOSTILE}\ntitle: x\n"}
    ds = ds.copy(deep=True).assign_attrs(bad)
    for variable in ds.variables.values():
        variable.attrs |= {"long_name": HOSTILE, "comment": HOSTILE, "units": HOSTILE}
        if number := len(variable.attrs.get("flag_meanings", "").split()):
            links = (f"<a_href='https://example.org/'>{k}</a>" for k in range(number))
            variable.attrs["flag_meanings"] = " ".join(links)
    names = [name for name in ("body", "equilibrium") if ds.get(name) is not None]
    return ds.assign_coords({name: [HOSTILE, *ds[name].values[1:].tolist()] for name in names})


# sweeps that ship: of each kind of system, of further forms of pictures, and of similar systems
KINDS_OF_SYSTEMS = ["mathieu", "bead_on_hoop", "foucault", "bodies", "rackets", "symmetric", "tumblers"]
KINDS_OF_SYSTEMS += ["kapitzas_racket"]
KINDS_OF_PICTURES = ["double_pendulum", "linear_triatomic", "gravity_gradient", "breakdown", "tennis_racket"]
SIMILAR = ["paul_trap", "swing", "spherical_pendulum", "lagrange_points", "cubesats", "tumbling", "twist"]
DRAWN = KINDS_OF_SYSTEMS + KINDS_OF_PICTURES + repeated.number([], SIMILAR)
PLAYED = repeated.number(KINDS_OF_SYSTEMS, DRAWN)
PATIENCE = 60  # s, the longest wait for an expected state on a busy machine


class ReportTab:
    """A report in a browser: Playwright's page, with the messages of its console and its requests."""

    def __init__(self, browser, path: Path, link="", **context):
        self.messages, self.requests = [], []
        self.context = browser.new_context(
            **({"viewport": {"width": 1280, "height": 2400}, "reduced_motion": "reduce"} | context)
        )
        self.context.set_default_timeout(1000 * PATIENCE)
        self.page = self.context.new_page()
        self.page.on("console", lambda message: self.messages.append(message.text))
        self.page.on("pageerror", lambda error: self.messages.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.context.route(re.compile("^(?!file:)"), lambda route: route.abort())
        self.page.goto(path.as_uri() + link)
        self.page.wait_for_selector("html[data-ready]", state="attached")

    def __getattr__(self, name):
        return getattr(self.page, name)

    def until(self, expression, argument=None):
        """Waits for a condition; Playwright's own wait evaluates text in the page, which its policy forbids."""
        for _ in range(20 * PATIENCE):
            if self.page.evaluate(expression, argument):
                return
            self.page.wait_for_timeout(50)
        raise AssertionError(f"still not true after {PATIENCE} s: {expression}")

    def follow(self, link):
        """Open another link in the same page, and wait for the event that it makes."""
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
        """Return the position of a cell of the plane on the screen."""
        return position_on_map(
            self, *self.page.evaluate("([i, j]) => [polhode.map.plane.x[i], polhode.map.plane.y[j]]", [i, j])
        )


def parsed(text):
    """The number that a person reads in a text with a unit."""
    text = text.replace("−", "-").replace("\u00a0", " ")
    match = re.match(r"(-?[\d.]+)(?: × 10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?", text)
    power = (match[2] or "⁰").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    return float(match[1]) * 10.0 ** int(power)


def shown_point(page, ds):
    """Return the row of the map at the point that the page shows."""
    return ds.sel({dim: float(page.row(dim)[0]) for dim in ds.dims}, method="nearest")


def state_of(point):
    """Return moments and initial angular velocity of a point of a map."""
    axis, *spin = (float(point[name]) for name in ("axis", "omega0", "epsilon", "phase"))
    return np.array([float(point[name]) for name in ("I1", "I2", "I3")]), euler.spin(int(axis), *spin)


OPEN_ALL = "document.querySelectorAll('details').forEach((details) => (details.open = true))"


def position_on_map(tab, x, y, plot="map"):
    """Return the position of a point of a picture on the screen."""
    return tab.evaluate(
        """([x, y, id]) => {
            const plot = document.getElementById(id), { xaxis, yaxis } = plot._fullLayout;
            const box = plot.getBoundingClientRect();
            return [box.left + xaxis._offset + xaxis.d2p(x), box.top + yaxis._offset + yaxis.d2p(y)];
        }""",
        [x, y, plot],
    )
