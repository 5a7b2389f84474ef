"""The explorer of a report, in a browser if there is one: the map, the choice, links, keys, and further systems."""

import itertools
import math
import re
import urllib.parse

import numpy as np
import pytest
from PIL import Image
from report_pages import (
    HOSTILE,
    KINDS,
    OPEN_ALL,
    PLAYED,
    hostile,
    map_of,
    parsed,
    position_on_map,
    shown_point,
    state_of,
)

import sweeps
from kernels.free import exact
from sweeps import __main__ as main
from sweeps import systems
from sweeps.figure import wording
from sweeps.figure.colors import in_light
from sweeps.handbook import gallery
from sweeps.points import catalogue
from sweeps.reading.definitions import file_text, plain, read_text
from sweeps.systems.dissipative_body import system as dissipative_body
from sweeps.systems.rigid_body.presets import PRESETS


def assert_row_is_the_maps(page, ds):
    point = shown_point(page, ds)
    for dim in ds.dims:
        assert float(page.row(dim)[0]) == float(point[dim])
    for name, variable in point.data_vars.items():
        (value, text), true = page.row(name), variable.values.item()
        if "flag_meanings" in variable.attrs:
            assert int(float(value)) == true
        elif math.isnan(true):
            assert text == "–"
        else:
            assert parsed(text) == pytest.approx(true, rel=1e-5), name  # six digits: 5e-6, and one more for ties
            assert text.endswith(wording.format_units(variable.attrs["units"]))


SHOWN = """[polhode.state.place,
    ...["say", "row-where", "row", "headline"].map((id) => document.getElementById(id).innerText)]"""


def test_hover_shows_a_small_box_alone_and_a_click_the_row_of_the_file(tab, plane):
    for cell in ((1, 1), (7, 3), (4, 6)):
        before = tab.evaluate(SHOWN)
        tab.mouse.move(*tab.center(*cell))
        lines = tab.locator("#tip div").all_inner_texts()
        assert 2 <= len(lines) <= 4
        assert parsed(lines[0].split(" = ")[1]) == pytest.approx(plane.I1.values[cell[0]], rel=1e-5)
        assert tab.evaluate(SHOWN) == before
        tab.mouse.click(*tab.center(*cell))
        assert float(tab.row("I1")[0]) == plane.I1.values[cell[0]]
        assert float(tab.row("I2")[0]) == plane.I2.values[cell[1]]
        assert_row_is_the_maps(tab, plane)


def cell_colors(tab):
    """The colours of the middles of all cells, row by row upwards, as "#rrggbb"."""
    return tab.evaluate(
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


def test_the_tool_bar_saves_the_picture_that_the_page_shows(tab, tmp_path):
    """Cells, names of regions, and axes about them, without ring and tools."""
    tab.locator("#map").hover()
    with tab.expect_download() as download:
        tab.locator('#map [data-title="Download plot as a PNG"]').click()
    assert download.value.suggested_filename == "map.png"
    download.value.save_as(tmp_path / "saved.png")
    tab.mouse.move(0, 0)
    tab.locator(".map-box").screenshot(path=tmp_path / "shown.png", style="#ring, .modebar { display: none }")
    saved, shown = (Image.open(tmp_path / name).convert("RGBA") for name in ("saved.png", "shown.png"))
    paper = Image.new("RGBA", saved.size, shown.getpixel((2, 2)))
    pictures = Image.alpha_composite(paper, saved), shown.crop((0, 0, *saved.size))
    apart = np.abs(np.subtract(*(np.asarray(picture, int) for picture in pictures))).max(axis=2) > 12
    assert apart.mean() < 0.025  # edges of letters and frames of names, drawn anew; one name less is some 0.01 more
    assert len(np.unique(np.asarray(pictures[1])[~apart], axis=0)) > 5


def test_axis_slider_plane_and_color_change_the_map(tab, plane):
    first = cell_colors(tab)
    tab.get_by_label("1", exact=True).check()
    second = cell_colors(tab)
    assert second != first
    slider = tab.get_by_label("principal moment of inertia about axis 3", exact=True)
    slider.focus()
    tab.keyboard.press("End")
    assert float(tab.row("I3")[0]) == 1.2
    assert cell_colors(tab) != second
    tab.get_by_label("colour by").select_option("regime")
    regime = plane.regime.sel(axis=1, I3=1.2, omega0=float(tab.row("omega0")[0])).squeeze()
    appearance = systems.presentation_of(plane).appearance
    words = dict(zip(plane.regime.flag_values, plane.regime.flag_meanings.split(), strict=True))
    assert cell_colors(tab) == [
        in_light(appearance.color(words[v])) for v in regime.transpose("I2", "I1").values.reshape(-1)
    ]
    tab.get_by_label("x axis").select_option("omega0")
    assert tab.evaluate("document.getElementById('map').layout.xaxis.title.text").startswith("ω₀")
    assert tab.evaluate("polhode.map.plane.x") == [2.0, 10.0]


def test_boundaries_and_hatching_are_those_of_theory(tab, plane):
    tab.get_by_label("3", exact=True).check()
    names = tab.evaluate("document.getElementById('map').data.map((trace) => trace.name)")
    assert {"I₁ = I₃", "I₂ = I₃"} <= set(names)
    assert "I₁ = I₂" not in names
    level = tab.evaluate("document.getElementById('map').data.find((trace) => trace.name === 'I₂ = I₃').y")
    assert level == [float(tab.row("I3")[0])] * 2
    margin = plane.triangle_margin.sel(axis=3, I3=float(tab.row("I3")[0]), omega0=10.0).squeeze()
    possible = (margin.transpose("I2", "I1").values >= 0).reshape(-1)
    assert tab.evaluate("Array.from(polhode.map.plane.exists)") == possible.astype(int).tolist()


def test_keys_move_the_choice(tab, plane):
    tab.mouse.click(*tab.center(4, 4))
    tab.locator("#map").focus()
    for key in ("ArrowRight", "ArrowUp", "ArrowUp", "ArrowLeft", "ArrowLeft"):
        tab.keyboard.press(key)
    assert float(tab.row("I1")[0]) == plane.I1.values[3]
    assert float(tab.row("I2")[0]) == plane.I2.values[6]
    tab.locator("#body-canvas").focus()
    before = tab.evaluate("document.getElementById('body-canvas').toDataURL()")
    tab.keyboard.press("ArrowLeft")
    assert tab.evaluate("document.getElementById('body-canvas').toDataURL()") != before


@pytest.mark.slow
def test_the_link_restores_the_state(tab, visit, plane_path):
    tab.get_by_label("1", exact=True).check()
    tab.get_by_label("colour by").select_option("frequency")
    tab.get_by_label("perturbation shown").fill("-2")
    tab.mouse.click(*tab.center(2, 5))
    tab.until("location.hash.includes('frequency') && location.hash === polhode.link()")
    values = dict(urllib.parse.parse_qsl(tab.evaluate("location.hash")[1:]))
    assert (values["axis"], float(values["I1"])) == ("1", float(tab.row("I1")[0]))
    assert all(len(values[name]) <= 14 for name in ("I1", "I2", "I3", "omega0", "epsilon"))
    other = visit(plane_path, tab.evaluate("location.hash"))
    assert other.locator("#link-notice").is_hidden()
    for name in ("axis", "I1", "I2", "I3", "omega0", "epsilon", "omega_squared"):
        assert other.row(name) == tab.row(name)
    assert other.get_by_label("colour by").input_value() == "frequency"
    flip = "document.getElementById('flip-period').value"
    assert other.evaluate(flip) == tab.evaluate(flip)
    other.follow("#axis=3&I1=1e9&_color=nonsense&_x=__proto__&constructor=7&I3=1.0000000000000002")
    assert other.row("axis")[0] == "3"
    assert float(other.row("I1")[0]) == 1.7
    notice = other.locator("#link-notice").inner_text()
    assert "no I₁ = 1e9: the nearest, 1.7" in notice
    assert "constructor = 7 is not in this map" in notice
    assert "I₃" not in notice


def test_no_button_of_the_page_leads_to_the_network(tab):
    """Whatever the toolbars offer is pressed; the fixture checks that there is no request."""
    windows = []
    tab.context.on("page", lambda window: windows.append(window))
    buttons = tab.locator(".modebar-btn")
    names = [button.get_attribute("data-title") or "" for button in buttons.all()]
    assert len(names) >= 3
    assert not [name for name in names if re.search("cloud|studio|share|plotly", name, re.IGNORECASE)]
    tab.locator("#map").hover()
    for button in buttons.all():
        if button.is_visible():
            button.click()
    tab.wait_for_timeout(300)
    assert windows == []
    assert tab.locator("a[href], form, iframe, link[href], [src]").count() == 0


@pytest.mark.slow
def test_the_policy_stops_what_would_ask_the_network(tab):
    assert tab.evaluate("fetch('https://example.org/').then(() => 'asked', () => 'refused')") == "refused"
    assert any("Content Security Policy" in text for text in tab.messages)
    tab.messages.clear()


@pytest.mark.slow
def test_a_telephone_is_tapped_needs_no_sideways_scroll_and_keeps_the_theme_chosen(visit, plane, plane_path):
    size = {"width": 400, "height": 800}
    page = visit(plane_path, has_touch=True, viewport=size, color_scheme="light")
    theme = "document.documentElement.dataset.theme"
    for cell in ((1, 3), (7, 4), (6, 1), (2, 6)):
        page.locator("#map").scroll_into_view_if_needed()
        page.touchscreen.tap(*page.center(*cell))
        page.wait_for_timeout(400)  # longer than a browser takes to make a click of a tap
        assert page.evaluate("polhode.state.place")[1:3] == [*cell]
        assert float(page.row("I1")[0]) == plane.I1.values[cell[0]]
    for scheme in ("dark", "light"):  # first the mode with which it does not start
        page.emulate_media(color_scheme=scheme)
        page.until(f"{theme} === '{scheme}'")
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
    page.get_by_role("button", name="change between light and dark").click()
    assert page.evaluate(theme) == "dark"
    page.reload()
    page.wait_for_selector("html[data-ready]", state="attached")
    assert page.evaluate(theme) == "dark"


@pytest.mark.slow
def test_a_drag_zooms_and_chooses_nothing(tab):
    before = tab.evaluate("polhode.state.place")
    tab.mouse.move(*tab.center(1, 1))
    tab.mouse.down()
    tab.mouse.move(*tab.center(6, 5), steps=5)
    tab.mouse.up()
    tab.until("document.getElementById('map')._fullLayout.xaxis.range[0] > 0.5")  # zoomed a bit later
    assert tab.evaluate("polhode.state.place") == before


def test_enter_and_space_need_no_mouse(tab):
    tab.locator("#map").focus()
    tab.keyboard.press("Enter")
    assert tab.evaluate("document.activeElement.id") == "play"
    for name in ("map", "body-canvas", "polhode-canvas"):
        tab.locator(f"#{name}").focus()
        tab.keyboard.press("Space")
        assert tab.evaluate("polhode.motion.player.playing")
        tab.keyboard.press("Space")
        assert not tab.evaluate("polhode.motion.player.playing")


def test_the_picture_has_a_table_and_words(tab, plane):
    tab.get_by_label("colour by").select_option("omega_squared")
    tab.locator("#map-table summary").click()
    cells = tab.locator("#map-table tbody td")
    tab.until("document.querySelectorAll('#map-table tbody td').length === 72")
    first = plane.omega_squared.sel({n: float(tab.row(n)[0]) for n in ("axis", "I3", "omega0")}).squeeze()
    true = float(first.sel(I1=plane.I1[0], I2=plane.I2[-1]))
    assert parsed(cells.first.inner_text()) == pytest.approx(true, rel=6e-3)  # three digits
    assert "Ω² (negative: unstable), measured" in tab.locator("#map-summary").inner_text()
    assert tab.locator("canvas:not([aria-label], [aria-hidden])").count() == 0


@pytest.mark.slow
def test_bodies_have_a_table_and_nudges_a_plot(visit_map, breakdown_map):
    tab = visit_map(breakdown_map)
    tab.get_by_label("colour by").select_option("omega_squared")
    buttons = tab.locator("#map table.bodies button")
    assert buttons.count() == breakdown_map.sizes["body"] * 3
    where = breakdown_map.body.values.tolist().index("Earth") * 3 + 2
    buttons.nth(where).click()
    tab.evaluate("polhode.choose({ epsilon: null })")
    assert tab.row("body")[0] == "Earth"
    assert tab.row("axis")[0] == "3"
    earth = breakdown_map.sel(body="Earth", axis=3, epsilon=float(tab.row("epsilon")[0])).squeeze()
    assert parsed(tab.row("omega_squared")[1]) == pytest.approx(float(earth.omega_squared), rel=1e-5)
    true = exact.flip_period(exact.set_up(*np.concatenate(state_of(earth))))
    assert float(tab.locator("#flip-period").get_attribute("value")) == pytest.approx(true, rel=1e-12)
    curve = tab.evaluate("[...document.getElementById('limit-plot').data.find((t) => t.name === 'axis 3').y]")
    every = breakdown_map.sel(body="Earth", axis=3).squeeze().sortby("epsilon")
    expected = np.abs(np.sqrt(every.omega_squared / every.omega_squared_theory).values - 1)
    values = np.array([np.nan if v is None else v for v in curve])
    np.testing.assert_allclose(np.nan_to_num(values), expected, atol=1e-14)  # the rounding of one minus one


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*KINDS, "names"])
def test_hostile_texts_do_not_run_and_lead_nowhere(kind, visit_map):
    link = f"#body={urllib.parse.quote(HOSTILE)}&_color={urllib.parse.quote(HOSTILE)}"
    tab = visit_map(hostile(map_of(kind)), link)
    tab.evaluate(OPEN_ALL)
    plots = tab.locator(".js-plotly-plot:visible").all()
    assert plots or kind == "bodies"
    for place in (*plots, tab.locator("#map")):
        place.hover()
        tab.wait_for_timeout(200)
        assert tab.locator("svg a, a[href], img, iframe, form").count() == 0
    assert tab.evaluate("globalThis.hostile") is None
    assert tab.locator("h1").inner_text() == HOSTILE
    if kind == "plane":  # unchanged
        assert HOSTILE in tab.locator("#map .xtitle").text_content()
    assert len(tab.requests) == 1


@pytest.mark.slow
def test_eigenvalues_stand_in_the_plane_as_in_the_map(visit_map):
    ds = map_of("equilibria")
    tab = visit_map(ds, "#moment_of_weight=4&spin_rate=1&equilibrium=sleeping")
    rings, dots = tab.evaluate(
        "document.getElementById('spectrum-plot').data.map(({ x, y, error_x }) => [x, y, error_x && error_x.array])"
    )
    point = ds.sel(moment_of_weight=4, spin_rate=1, equilibrium="sleeping").squeeze()
    np.testing.assert_array_equal(dots[:2], [point.eigenvalue_real, point.eigenvalue_imag])
    np.testing.assert_array_equal(rings[:2], [point.eigenvalue_real_theory, point.eigenvalue_imag_theory])
    assert dots[2] == pytest.approx(point.eigenvalue_real_error.values, rel=1e-6)  # seven digits of errors
    sentence = tab.locator("#say").inner_text()
    assert parsed(sentence.split("by a factor e in ")[1]) == pytest.approx(1 / float(point.growth_rate.max()), rel=1e-3)
    tab.locator("#spectrum-table summary").click()
    tab.until("document.querySelectorAll('#spectrum-table tbody tr').length === 4")  # an event fills it


@pytest.mark.slow
def test_draws_lie_on_the_triangle_and_are_chosen_by_link_click_and_key(visit_map, uncertain):
    tab = visit_map(uncertain, "#body=a_box&axis=2&_draw=7")
    spin_map = uncertain.sel(axis=2).squeeze()
    x, y, ring = tab.evaluate(
        "(([dots, ...more]) => [dots.x, dots.y, more.at(-1).x])(document.getElementById('drawn-plot').data)"
    )
    np.testing.assert_allclose(
        [x, y], [spin_map.I1_draw / spin_map.I3_draw, spin_map.I2_draw / spin_map.I3_draw], rtol=2e-7
    )  # of float32
    assert ring == [x[7]]
    assert "Draw 7:" in tab.locator("#drawn-chosen").inner_text()
    assert "a_box is unstable" in tab.locator("#say").inner_text()
    tab.locator("#drawn-plot").focus()
    tab.keyboard.press("ArrowRight")
    tab.until("location.hash.includes('_draw=8')")
    tab.locator("#drawn-plot .drag").first.scroll_into_view_if_needed()
    lone = int(np.argmax(np.array(y) - np.array(x)))  # the outermost: no point covers it
    at = position_on_map(tab, x[lone], y[lone], "drawn-plot")
    tab.mouse.move(*at)
    tab.mouse.click(*at)
    tab.until("(draw) => polhode.state.draw === draw", lone)
    counts = tab.evaluate("document.getElementById('drawn-histogram').data[0].y.reduce((a, b) => a + b)")
    assert counts == int(np.isfinite(spin_map.growth_rate_draw).sum())


def assert_axe_finds_nothing(page, **options):
    """Check a page by axe, a checker of accessibility that is not ours."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page.evaluate(OPEN_ALL)
    report_of_axe = axe.run(page, options=options | {"resultTypes": ["violations"]})
    assert report_of_axe.violations_count == 0, report_of_axe.generate_report()


@pytest.mark.slow
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "curve"])
def test_axe_finds_nothing_and_a_page_prints_on_one_sheet(kind, visit_map):
    """By all its rules in light, and the contrast in dark again."""
    page = visit_map(map_of(kind), color_scheme="light")
    if kind in ("plane", "oscillators"):
        pdf = page.pdf(prefer_css_page_size=True, print_background=True)
        assert re.findall(rb"/Count (\d+)", pdf) == [b"1"]
    assert_axe_finds_nothing(page)
    page.emulate_media(color_scheme="dark")
    page.wait_for_timeout(100)
    assert_axe_finds_nothing(page, runOnly=["color-contrast"])


SHAPE = ("I1_over_I3", "thickness")


@pytest.mark.slow
def test_shapes_are_drawn_on_their_triangle(visit, shapes, shapes_path):
    tab = visit(shapes_path, "#axis=1&I1=1.6&I2=1.04&I3=2")  # x = 0.8, y = 0.52: room 0.4
    assert "no I₁" not in tab.locator("#link-notice").inner_text()
    values = [float(tab.row(name)[0]) for name in ("axis", "I1_over_I3", "thickness", "I1", "I2", "I3")]
    assert values == pytest.approx([1, 0.8, 0.4, 1.6, 1.04, 2.0], rel=1e-15)
    assert tab.evaluate("document.getElementById('map')._fullLayout.yaxis.title.text") == "I₂/I₃"
    markers = "document.getElementById('map').data.find(({ mode }) => mode === 'markers')"
    names, *places = tab.evaluate(f"(({{ x, y, text }}) => [text, x, y])({markers})")
    assert names == [body["name"] for body in PRESETS]
    moments = np.array([body["moments"] for body in PRESETS])
    assert np.transpose(places) == pytest.approx(moments[:, :2] / moments[:, 2:], rel=1e-12)  # roundings of quotients
    rate = shapes.omega_squared.isel(axis=0, I3=1).squeeze()
    signed_rate = (np.sign(rate) * np.sqrt(np.abs(rate))).values
    for across, up in np.random.default_rng(5).random((60, 2)).tolist():
        cell = tab.evaluate(
            "([x, y]) => (({ exists, value, place }) => ({ exists, value, place }))(polhode.locate(x, y))", [across, up]
        )
        thickness = 1 - (1 - up) / across
        if thickness < 0:  # below the flat bodies
            assert (cell["exists"], cell["place"]) == (False, None)
            continue
        i, j = (int(np.abs(shapes[name] - at).argmin()) for name, at in zip(SHAPE, (across, thickness), strict=True))
        assert cell["place"][1:3] == [i, j]
        assert cell["value"] == pytest.approx(signed_rate[i, j], rel=1e-12)
    before = tab.evaluate(SHOWN)
    tab.mouse.click(*position_on_map(tab, 0.23, 0.17))
    assert tab.locator("#tip").inner_text() == "No rigid body has these moments."
    assert tab.evaluate(SHOWN) == before
    tab.mouse.click(*position_on_map(tab, 0.5, 0.95))  # thickness 0.9
    tab.until("polhode.state.place[1] === 4 && polhode.state.place[2] === 8")
    tab.locator("#map-table summary").click()
    tab.until("document.querySelectorAll('#map-table tbody td').length === 81")
    assert "81 points" in tab.locator("#map-summary").inner_text()
    assert "physically impossible" not in tab.locator("#map-summary").inner_text()


@pytest.mark.slow
@pytest.mark.parametrize("grip", [(0.5, 0.75), (0.31, 0.92)], ids=["ring", "triangle"])
def test_the_body_is_dragged_between_the_points_and_back_goes_back(grip, visit, shapes_path):
    """Moments, drawn edges and headline follow the pointer, on whichever possible body the drag begins."""
    tab = visit(shapes_path, "#axis=1&I1_over_I3=0.5&thickness=0.5&I3=1")
    x, y = position_on_map(tab, *grip)
    tab.wait_for_timeout(200)
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(*position_on_map(tab, 0.62, 0.83))  # in one move: each pause adds an entry to the history
    tab.wait_for_timeout(100)
    tab.mouse.up()
    moments = tab.evaluate("polhode.state.moments")
    assert moments == pytest.approx([0.62, 0.83, 1.0], abs=0.005)  # of pixels
    squares = np.sum(moments) / 2 - np.array(moments)  # mean squares of a box are those of its edges over 12
    corners = tab.evaluate("polhode.motion.faces.flatMap(({ corners }) => corners)")
    edges = np.ptp(corners, axis=0) ** 2
    assert edges / edges.max() == pytest.approx(squares / squares.max(), rel=1e-9)  # roundings
    transverse = 0.1 * math.cos(0.6), 0.1 * math.sin(0.6)  # rad/s: omega0 and phase of the map, epsilon of a throw
    period = exact.flip_period(exact.set_up(*moments, 1.0, *transverse))
    assert tab.evaluate("polhode.motion.trajectory.flipPeriod") == pytest.approx(period, rel=1e-9)
    tab.until("location.hash.includes('_moments')")
    tab.go_back()
    tab.until("polhode.state.moments === null")
    assert tab.row("I1")[0] == "0.5"


SMALL = """() => [...document.querySelectorAll("body *")].filter((one) => one.checkVisibility()
    && [...one.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim()) && !one.closest("noscript")
    && one.getBoundingClientRect().width > 1 && parseFloat(getComputedStyle(one).fontSize) < 20
).map((one) => `${one.tagName} ${one.className} ${one.textContent.slice(0, 40)}`)"""


@pytest.mark.slow
def test_a_lecture_of_six_steps_fits_the_screen_in_large_letters(visit, shapes_path):
    width, height = 1280, 720
    page = visit(shapes_path, viewport={"width": width, "height": height})
    chosen = "document.querySelector('[data-side=y] select').selectedOptions[0].textContent"
    assert page.evaluate(chosen) == page.locator("#map .ytitle").text_content()
    page.keyboard.press("l")
    titles = set()
    for step in range(1, 7):
        assert page.locator("#step-number").inner_text() == f"{step} of 6"
        page.wait_for_timeout(300)
        titles.add(page.locator("#step-title").inner_text())
        assert page.evaluate(SMALL) == []
        ends = "[...document.querySelectorAll('main *')].filter((one) => one.checkVisibility() && !one.closest('svg'))"
        assert page.evaluate(f"Math.max(...{ends}.map((one) => one.getBoundingClientRect().bottom))") <= height
        page.keyboard.press("ArrowRight")
    assert len(titles) == 6
    page.keyboard.press("l")
    assert page.locator("#own").is_visible()


SIZES = [(1920, 1080), (1280, 720), (390, 844)]
DIGITS = {"rel": 5e-7}  # six of them


def assert_step_is_that_of_the_command(page, step, epsilon):
    """Compare the motion shown at a step, about each axis, with `polhode body`."""
    moments, omega0, axis, shaken = page.evaluate(
        "(({ moments, omega0, axis, shaken }) => [moments, omega0, axis, shaken])(polhode.motion)"
    )
    axes = sweeps.body(moments, omega0=omega0, epsilon=epsilon).facts["axes"]
    outcomes = page.evaluate(
        "([I, w, e]) => [1, 2, 3].map((axis) => polhode.axisOutcome(I, axis, w, e, 0.6))", [moments, omega0, epsilon]
    )
    for outcome, expected in zip(outcomes, axes, strict=True):
        period = expected["flip_period"] or expected["wobble_period"]
        assert outcome["period"] == pytest.approx(period, **DIGITS)
        assert step != 4 or f"{period:.4g} s" in page.inner_text(f"#outcome-{expected['axis']}").replace("\xa0", " ")
    expected = axes[axis - 1]
    said = page.inner_text("#say").replace("\xa0", " ")
    if step < 5:
        assert float(page.get_attribute("#flip-period", "value")) == pytest.approx(expected["flip_period"], **DIGITS)
        assert f"flips every {expected['flip_period']:.4g} s" in said
    else:
        assert shaken["frequency"] == pytest.approx(4 * math.pi / expected["euler_period"], **DIGITS)
        assert "wobble grows" in said


LABELS = """async () => {
    const slider = document.getElementById("time"), frames = [];
    const { motion } = polhode;
    for (let k = 0; k <= 1000; k += 20) {
        slider.value = k;
        slider.dispatchEvent(new Event("input", { bubbles: true }));
        await new Promise((done) => setTimeout(done));
        for (const view of [motion.scene, motion.polhode.scene, motion.herpolhode, ...motion.thrown]) {
            const { clientWidth, clientHeight } = view.canvas;
            if (clientWidth && view.labels?.length) frames.push([clientWidth, clientHeight, view.labels]);
        }
    }
    return frames;
}"""
NAMES = """() => [...document.querySelectorAll("#names span:not([hidden]), #map .annotation")].map((one) => {
    const { left, top, width, height } = one.getBoundingClientRect();
    return { left, top, width, height, text: one.textContent };
})"""


def overlaps(labels):
    """Pairs of texts whose boxes have a common point."""
    ends = [[(one["left"], one["left"] + one["width"]), (one["top"], one["top"] + one["height"])] for one in labels]
    pairs = itertools.combinations(zip(labels, ends, strict=True), 2)
    meet = lambda a, b: all(p < v and u < q for (p, q), (u, v) in zip(a, b, strict=True))  # noqa: E731
    return [(one["text"], other["text"]) for (one, a), (other, b) in pairs if meet(a, b)]


@pytest.mark.slow
@pytest.mark.parametrize("size", SIZES)
def test_no_name_lies_on_another_over_a_whole_motion(size, visit, shapes_path):
    """L, ω and the axes in each picture, over two flips, in lecture mode as well; names of bodies and regions."""
    page = visit(shapes_path, viewport=dict(zip(("width", "height"), size, strict=True)))
    page.set_default_timeout(120_000)
    for is_lecture in (False, True):
        if is_lecture:
            page.click("#lecture")
        for preset in ("tennis racket", "phone", "Explorer 1", "3U CubeSat"):
            if preset != "tennis racket" or not is_lecture:
                page.get_by_role("button", name=preset).click()
            names = page.evaluate(NAMES)
            assert overlaps(names) == []
            assert all(box["left"] >= 0 and box["left"] + box["width"] <= size[0] for box in names)
            assert is_lecture or preset in {box["text"] for box in names}
        page.get_by_role("button", name="phone").click()
        page.evaluate("polhode.motion.player.set(false)")
        frames = page.evaluate(LABELS)
        assert len(frames) > 50
        assert {"L", "ω", "1", "2", "3"} <= {label["text"] for *_, labels in frames for label in labels}
        assert [pairs for *_, labels in frames if (pairs := overlaps(labels))] == []
        edges = [(w - label["left"] - label["width"], label["left"]) for w, _, labels in frames for label in labels]
        assert np.min(edges) >= 0


MOMENTS, BOX = (3.0, 1.0, 3.5), (7.15, 14.67, 0.74, 0.17228)
BLOCKS = """() => {
    const blocks = "header .tools, #step-title, #step-text, #presets, #own .controls, #own-notice, .map-box, #legend, "
        + "#motion-first canvas, .player, #three canvas, #three figcaption, #say, #steps > .controls";
    return [...document.querySelectorAll(blocks)].filter((block) => block.checkVisibility()).map((block) => {
        const range = document.createRange();
        range.selectNodeContents(block);
        const box = block.matches("p, h2, figcaption") ? range : block; // a paragraph is wider than its text
        const { left, top, width, height } = box.getBoundingClientRect();
        return { left, top, width, height, text: block.id || block.className || block.tagName };
    });
}"""


@pytest.mark.slow
@pytest.mark.parametrize(("size", "values"), [*zip(SIZES, [MOMENTS, BOX, MOMENTS], strict=True)], ids=str)
def test_a_typed_body_goes_through_the_lecture_and_stays(size, values, visit, plane_path):
    """Three moments, kg m2, or the edges, cm, and the mass, kg, of a box; axis 1 is the intermediate one of both."""
    page = visit(plane_path, viewport=dict(zip(("width", "height"), size, strict=True)))
    fields = ("I1", "I2", "I3", "mass")[: len(values)]
    page.select_option("#own-by", "box" if "mass" in fields else "moments")
    for name, value in zip(fields, values, strict=True):
        page.fill(f"#own-{name}", str(value))
    assert "nothing is measured here" in page.inner_text("#row-where")
    page.click("#lecture")
    for step, epsilon in enumerate((0.01, 0.3, 0.01, 0.1, 0.05), 1):
        page.wait_for_timeout(300)
        assert_step_is_that_of_the_command(page, step, epsilon)
        assert step == 3 or "your body" in page.inner_text("#say")
        blocks = page.evaluate(BLOCKS)
        assert overlaps(blocks) == []
        assert max(block["left"] + block["width"] for block in blocks) <= size[0]
        if step < 5:
            page.click("#step-next")
    page.select_option("#own-by", "moments")
    page.fill("#own-I3", "9")  # greater than the sum of the others
    assert page.inner_text("#say") == page.inner_text("#own-notice") != ""
    assert "Play" in page.inner_text("#play")
    for name, value in zip(("I1", "I2", "I3"), ("3", "1", "3.2"), strict=True):
        page.fill(f"#own-{name}", value)
    page.click("#lecture")
    assert [page.input_value(f"#own-I{k}") for k in (1, 2, 3)] == ["3", "1", "3.2"]
    assert "your body keeps its axis" in page.inner_text("#say") or "your body flips" in page.inner_text("#say")


@pytest.mark.slow
def test_explorer_goes_into_a_flat_spin_over_days(visit, plane_path):
    """The tilt is that of the double bracket with two equal moments: a published digit, DOP853, and |L| that stays."""
    page = visit(plane_path)
    tilt = "([time, moments, omega0, loss, tilt]) => polhode.tiltAfter(time, moments, omega0, loss, tilt)"
    assert page.evaluate(tilt, [200, [1, 2], 2, 0.02, 0.01]) == pytest.approx(0.499766776686, abs=1e-12)
    moments = PRESETS[-1]["moments"]
    point = dict(zip(("I1", "I2", "I3"), moments, strict=True)) | {"loss": 0.05, "from_angle": 0.01, "phase": 0.6}
    direction = dissipative_body.solve(point, 2 * math.pi * 20, 1e-12)[1].y[:3, -1]
    at_end = page.evaluate(tilt, [2 * math.pi * 20 / 78.5, moments[:2], 78.5, 0.05, 0.01])
    assert at_end == pytest.approx(math.atan2(math.hypot(*direction[1:]), direction[0]), rel=1e-9)  # of DOP853
    page.click("#lecture")
    for _ in range(5):
        page.click("#step-next")
    for days in (0.0, 0.68, 2.0):
        page.fill("#days", str(days))
        momentum = np.array(page.evaluate("polhode.motion.trajectory.at(0)")) * moments
        assert np.linalg.norm(momentum) == pytest.approx(78.5 * moments[0], rel=1e-12)  # roundings
        expected = page.evaluate(tilt, [86400 * days, moments[:2], 78.5, 1e-6, 0.01])
        assert math.atan2(math.hypot(*momentum[1:]), momentum[0]) == pytest.approx(expected, rel=1e-9)
        assert f"{math.degrees(expected):.3g}° from L" in page.inner_text("#say")
    assert page.inner_text("#say").startswith("Flat spin")
    page.click("#lecture")
    assert "from L" not in page.inner_text("#say")


@pytest.mark.slow
def test_a_body_goes_with_the_link_and_with_the_command_of_its_film(visit, plane_path, tmp_path):
    page = visit(plane_path)
    page.get_by_role("button", name="phone").click()
    assert "your phone flips every 0.9802 s" in page.inner_text("#say").replace("\xa0", " ")
    page.select_option("#own-by", "box")
    edges = [page.input_value(f"#own-{name}") for name in ("I1", "I2", "I3", "mass")]
    assert edges == ["14.67", "7.15", "0.74", "0.17228"]  # cm and kg, as the definition `bodies` has them
    other = visit(plane_path, page.evaluate("polhode.link()"))
    assert other.inner_text("#say") == page.inner_text("#say")
    command = other.text_content("#film code").removesuffix("body.mp4") + f"{tmp_path / 'body.csv'} --duration 1"
    main.main(command.split()[1:])
    rows = np.loadtxt(tmp_path / "body.csv", delimiter=",", skiprows=1)
    omegas = other.evaluate("(times) => times.map((t) => polhode.motion.trajectory.at(t))", rows[:, 0].tolist())
    assert rows[:, 1:4] == pytest.approx(np.array(omegas), rel=1e-9, abs=1e-9)  # rounding, on 10 rad/s


@pytest.fixture(scope="module")
def own_page(pages):
    """The page that `polhode page` writes."""
    assert main.main(["page", "-o", str(pages / "index.html")]) == 0
    return pages / "index.html"


@pytest.mark.slow
def test_the_page_without_a_map_is_small_and_accessible_and_its_link_carries_a_body(own_page, visit):
    assert own_page.stat().st_size <= 1_500_000
    tab = visit(own_page, "#moments=1,2,2.5&axis=2", color_scheme="light")
    assert {url.split("#")[0] for url in tab.requests} == {own_page.as_uri()}
    assert tab.locator("#link-notice").is_hidden()
    period = sweeps.body([1.0, 2.0, 2.5], omega0=10.0, epsilon=0.1).facts["axes"][1]["flip_period"]
    assert f"your body flips every {period:.4g} s" in tab.inner_text("#say").replace("\xa0", " ")
    assert_axe_finds_nothing(tab)


NO_BODIES = dict.fromkeys(("", "1,2", "1,2,x", "-1,2,2", "1e999,1,1", HOSTILE), "Three positive numbers are needed")
NO_BODIES |= {"1,2,9": "No rigid body has these moments: I₃ is greater", "__proto__,constructor,1": "Three positive"}


@pytest.mark.slow
def test_a_link_without_a_possible_body_states_the_reason_and_runs_nothing(own_page, visit):
    links = [f"#{urllib.parse.urlencode({'moments': moments})}&axis=2" for moments in NO_BODIES]
    tab = visit(own_page, links[0])
    for link, reason in zip(links, NO_BODIES.values(), strict=True):
        tab.follow(link)
        assert reason in tab.inner_text("#link-notice")
        assert tab.evaluate("[polhode.state.moments, typeof globalThis.hostile]") == [None, "undefined"]
        assert tab.locator("#link-notice *").count() == 0
    assert {url.split("#")[0] for url in tab.requests} == {own_page.as_uri()}


@pytest.mark.slow
@pytest.mark.parametrize("name", PLAYED)
def test_the_page_of_a_shipped_sweep_plays_without_a_word_on_its_console(name, visit_map, monkeypatch):
    """A few points of each; `visit_map` checks the console."""
    monkeypatch.setattr(gallery, "MAX_GRID_POINTS", 36)
    monkeypatch.setattr(gallery, "MAX_CHEAP_POINTS", {})
    values = gallery.reduce_points(plain(read_text(file_text(catalogue.shipped_files()[name]))))
    visit_map(sweeps.survey(values), reduced_motion="no-preference").wait_for_timeout(500)
