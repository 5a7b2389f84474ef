"""Pictures of maps: their list, and that they show the values of the map, read from the drawn artists."""

import matplotlib
import matplotlib.image
import numpy as np
import pytest
from maps import random_map

import sweeps
from kernels.free import linear
from sweeps import systems
from sweeps.figure import axis_scales, sheets, wording
from sweeps.handbook import gallery
from sweeps.maps.storage import open_map, write_map
from sweeps.points import catalogue
from sweeps.reading.definitions import file_text, plain, read_text
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.rigid_body import fits
from sweeps.systems.rigid_body.presentation import (
    figure_bodies,
    figure_breakdown,
    figure_flip,
    figure_stability,
    figure_triangle,
)
from sweeps.views import figures

# 24 multiples of these moments, kg m2, a tennis racket's among them
STEPS = {"I1": 0.00121, "I2": 0.001638, "I3": 0.002185}
AROUND_A_RACKET = {name: {"start": step, "stop": 24 * step, "num": 24} for name, step in STEPS.items()}

racket = pytest.fixture(
    lambda: sweeps.survey(title="Around a tennis racket", grid=AROUND_A_RACKET | {"omega0": 10.0}), scope="module"
)


@pytest.fixture(scope="module")
def shapes():
    """The default sweep at one size and one rate of spin."""
    definition = dict(read_text(catalogue.shipped_files()["tennis_racket"].read_text()))
    return sweeps.survey(definition | {"grid": dict(definition["grid"]) | {"I3": 0.01748, "omega0": 10.0}})


@pytest.fixture(autouse=True)
def use_style():
    with matplotlib.rc_context(sheets.STYLE):
        yield


pytestmark = pytest.mark.usefixtures("few_frames")


def artists_of_gid(axes, gid):
    return [line for line in axes.lines if line.get_gid() == gid]


# ---------------------------------------------------------------------------------------------------------
# Files


def test_pictures_of_a_grid_on_the_disk(tiny, tmp_path, monkeypatch):
    """No variable is loaded, no temporary file is left, and Matplotlib's settings stay, between two pictures too."""
    monkeypatch.setitem(sheets.STYLE, "savefig.dpi", 50)
    write_map(tiny, tmp_path / "map.nc")
    paths, folder = [], tmp_path / "new" / "figures"
    with open_map(tmp_path / "map.nc") as ds, matplotlib.rc_context():
        matplotlib.rcdefaults()
        before = dict(matplotlib.rcParams)
        for path in figures.draw_all(ds, folder):
            assert dict(matplotlib.rcParams) == before
            paths.append(path)
        assert [name for name in ds.data_vars if ds.variables[name]._in_memory] == []
    names = [*(f"stability_axis_{axis}.png" for axis in (1, 2, 3)), "theory_against_measured.png", "polhodes.png"]
    assert [path.name for path in paths] == [*names, "flip.gif"]
    assert sorted(folder.iterdir()) == sorted(paths)
    assert paths.pop().read_bytes()[:6] == b"GIF89a"  # its frames are checked in test_figure_flip.py
    for path in paths:
        pixels = matplotlib.image.imread(path)[..., :3]
        assert min(pixels.shape[:2]) > 2.5 * 50  # inches, over several inches
        assert pixels.std() > 0.05  # a blank page has 0; a page of text has some 0.1


# ---------------------------------------------------------------------------------------------------------
# Stability maps


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_cells_are_the_measured_rates(racket, axis):
    ax = figure_stability.draw(racket, axis).axes[0]
    (mesh,) = (artist for artist in ax.collections if artist.get_array() is not None)
    plane = racket.sel(axis=axis, I3=0.01748).squeeze().transpose("I2", "I1")
    rate = np.sign(plane.omega_squared) * np.sqrt(abs(plane.omega_squared)) / 10.0
    np.testing.assert_allclose(mesh.get_array().reshape(24, 24), rate.values, rtol=1e-15)
    assert mesh.norm.vmin == -mesh.norm.vmax  # the neutral colour is that of 0
    assert mesh.norm.vmax == np.abs(rate.values[plane.triangle_margin.values >= 0]).max()
    # a cell's middle is its value, up to rounding
    np.testing.assert_allclose(mesh.get_coordinates()[0, :, 0][:-1] + np.diff(racket.I1)[0] / 2, racket.I1, rtol=1e-12)


@pytest.mark.parametrize(
    "grid",
    [
        {"I1": {"start": 2.0, "stop": 9.0, "num": 12}, "I2": {"start": 2.0, "stop": 16.0, "num": 12}, "I3": 13.0},
        {"I1": {"start": 0.5, "stop": 9.0, "num": 12}, "I2": 3.0, "I3": {"start": 1.0, "stop": 16.0, "num": 12}},
        {"I1": 1.0, "I2": {"start": 0.1, "stop": 3.0, "num": 12}, "I3": {"start": 0.1, "stop": 3.0, "num": 12}},
        {"I1": {"start": 0.1, "stop": 90.0, "num": 12, "spacing": "log"}, "I2": [1.0, 2.0, 3.0], "I3": 5.0},
        {"I1": [1.0, 2.0, 3.0], "I2": [1.0, 2.0, 3.0], "I3": 9.0},  # none is possible
    ],
)
def test_a_cell_that_cannot_exist_is_blank_in_the_public_picture(grid):
    ds = sweeps.survey({"axes": [2], "grid": grid | {"omega0": 1.0}})
    ax = sweeps.plot.stability(ds, axis=2)
    blank = [collection for collection in ax.collections if collection.get_gid() == "impossible"]
    assert all((collection.get_facecolor() == 1.0).all() for collection in blank)  # white, and nothing shines through
    (mesh,) = (artist for artist in ax.collections if artist.get_array() is not None)
    assert all(collection.get_zorder() >= mesh.get_zorder() for collection in blank)
    x, y = (name for name in ("I1", "I2", "I3") if ds.sizes.get(name, 1) > 1)
    margin = ds.triangle_margin.squeeze().transpose(y, x).values
    points = np.column_stack([values.ravel() for values in np.meshgrid(ds[x], ds[y])])
    paths = [path for collection in blank for path in collection.get_paths()]
    inside = np.any([path.contains_points(points) for path in paths], axis=0).reshape(margin.shape)
    assert inside[margin < 0].all()
    assert not inside[margin > 0].any()
    assert (margin < 0).any()


@pytest.mark.parametrize("axis", [1, 2, 3])
@pytest.mark.parametrize("axes_of_plane", [("I1", "I2"), ("I1", "I3"), ("I2", "I3")])
def test_boundaries_are_where_theory_changes_sign(axis, axes_of_plane):
    window = {axes_of_plane[0]: (0.5, 3.0), axes_of_plane[1]: (0.8, 2.5)}
    (third,) = {"I1", "I2", "I3"} - set(axes_of_plane)
    lines = figure_stability.boundaries(axis, window, {third: 1.4})
    assert len(lines) == 2
    for line in lines.values():
        at = {third: np.full(200, 1.4)} | {name: np.linspace(*window[name], 200) for name in axes_of_plane} | line
        crossed = next(iter({*line} & {*axes_of_plane}))
        points = [at | {crossed: at[crossed] * factor} for factor in (0.999, 1.0, 1.001)]
        low, middle, high = (linear.omega_squared(*(p[name] for name in MOMENTS), 1.0, axis) for p in points)
        assert (middle == 0).all()
        # on both sides of the line the signs are opposite, except where the second boundary crosses it
        assert np.count_nonzero(low * high < 0) > 195


def test_what_is_not_ok_is_marked(racket):
    ds = racket.copy(deep=True)
    ds["status"][:] = 0
    ds["status"].loc[{"axis": 1, "I1": 0.00121, "I2": 0.01638, "I3": 0.01748}] = 2
    ax = figure_stability.draw(ds, 1).axes[0]
    (marks,) = artists_of_gid(ax, "status 2")
    assert [values.tolist() for values in marks.get_data()] == [[0.00121], [0.01638]]


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_the_default_picture_is_the_triangle_with_each_body_in_its_place(shapes, axis):
    ax = figure_triangle.draw_axis(shapes, axis).axes[0]
    mesh = next(c for c in ax.collections if c.get_gid() == "cells")
    rate = fits.signed_rate(shapes.omega_squared.sel(axis=axis).squeeze().values, 10.0)
    np.testing.assert_array_equal(mesh.get_array(), rate)
    places = np.stack([shapes.I1.values[:, :1] * np.ones(rate.shape), shapes.I2.values[..., 0]], axis=-1) / 0.01748
    corners = mesh.get_coordinates()
    low, high = np.minimum(corners[:-1, :-1], corners[1:, :-1]), np.maximum(corners[1:, 1:], corners[:-1, 1:])
    assert ((low <= places) & (places <= high)).all()
    assert corners.sum(axis=-1).min() >= 1.0 - 1e-12  # no body has moments below, up to rounding
    assert corners.max() <= 1.0
    line = {line.get_gid() for line in ax.lines}
    assert ("I1 = I2" in line) == (axis != 3)
    assert {"tennis racket", "sphere"} <= {text.get_text() for text in ax.texts}


def test_the_default_shows_its_racket(shapes):
    assert figure_flip.racket(shapes)["body"] == "Tennis racket"
    opening = systems.presentation_of(shapes).opening(shapes)
    assert opening.plane == ("I1_over_I3", "thickness")
    at = shapes.sel(opening.at)
    assert [float(at[name]) for name in ("I1", "I2", "I3")] == pytest.approx([0.00121, 0.01638, 0.01748], rel=1e-14)
    assert int(at["axis"]) == 2
    assert figure_flip.racket(shapes.isel(I1_over_I3=slice(5, None))) is None


def test_one_moment_is_a_curve():
    moments = {"I1": {"start": 0.2, "stop": 4.0, "num": 20}, "I2": 1.0, "I3": 2.0}
    ds = sweeps.survey({"axes": [1], "grid": moments | {"omega0": -3.0}})
    ax = figure_stability.draw(ds, 1).axes[0]
    x, y = np.concatenate([line.get_data() for line in artists_of_gid(ax, "measured")], axis=1)
    flat = ds.squeeze().isel(I1=np.searchsorted(ds.I1, x))
    np.testing.assert_allclose(y, fits.signed_rate(flat.omega_squared.values, -3.0), rtol=1e-15)
    assert x.size == 20
    (theory,) = artists_of_gid(ax, "theory")
    at = np.argmin(np.abs(theory.get_xdata() - 3.0))
    I1 = theory.get_xdata()[at]
    assert theory.get_ydata()[at] == pytest.approx(np.sqrt((I1 - 1) * (I1 - 2) / 2), rel=1e-12)  # I2, I3 = 1, 2
    assert sorted(line.get_xdata()[0] for line in ax.lines if "=" in str(line.get_gid())) == [1.0, 2.0]
    assert ax.get_xlabel() == "$I_1$  (kg m²)"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.017479999999999999, "0.01748"), (1e-6, "10⁻⁶"), (-3e12, "−3×10¹²"), (-2.5e-7, "−2.5×10⁻⁷"), (10.0, "10")],
)
def test_numbers_as_people_write_them(value, text):
    assert wording.format_number(value) == text


def test_units_and_edges_as_people_write_them():
    np.testing.assert_allclose(axis_scales.cell_edges([1.0, 2.0, 4.0]), [0.5, 1.5, 3.0, 5.0])
    np.testing.assert_allclose(axis_scales.cell_edges([1.0, 10.0, 100.0]), 10.0 ** np.array([-0.5, 0.5, 1.5, 2.5]))
    assert [wording.format_units(u) for u in ("kg m2", "rad s-1", "1")] == ["kg m²", "rad s⁻¹", ""]


# ---------------------------------------------------------------------------------------------------------
# Breakdown and bodies


def test_breakdown_panels_and_table(breakdown_map):
    figure = figure_breakdown.draw(breakdown_map)
    left, right, table = figure.axes
    theory = breakdown_map.omega_squared_theory.isel(epsilon=0, phase=0).values
    for ax, belongs in ((left, theory > 0), (right, theory < 0)):
        series = {tuple(map(int, line.get_gid().split())) for line in ax.lines if (line.get_gid() or " ")[0].isdigit()}
        assert series == {(i, j + 1) for i, j in np.argwhere(belongs)}
        assert r"\varepsilon" in ax.get_xlabel()
        (reference,) = artists_of_gid(ax, "slope 2")
        assert np.diff(np.log(reference.get_ydata())) / np.diff(np.log(reference.get_xdata())) == pytest.approx(2.0)
    slopes = fits.fit_breakdown(breakdown_map).slope.values
    cell_texts = sorted(text.get_text() for text in table.texts)
    for slope in slopes[np.isfinite(slopes)]:
        assert f"{slope:.3f}" in cell_texts
    assert cell_texts.count(r"$\Omega^2=0$") == 7  # two axes of the plate, two of the cylinder, three of the cube
    assert cell_texts.count("no law") == 2  # the two symmetric tops' own axes
    assert "27 of 27" in figure.texts[1].get_text()


def test_breakdown_says_when_the_law_is_another(breakdown_map):
    ds = breakdown_map.copy(deep=True)
    ds["omega_squared"] = ds.omega_squared_theory * (1 + 0.1 * ds.epsilon**1.5)
    ds["omega_squared_reduced_error"] = abs(ds.omega_squared) * 1e-14
    figure = figure_breakdown.draw(ds)
    assert "0 of 29" in figure.texts[1].get_text()
    assert any(text.get_text().endswith(" !") for text in figure.axes[2].texts)


def test_breakdown_of_a_grid():
    nudges = {"start": 1e-7, "stop": 0.1, "num": 8, "spacing": "log"}
    grid = {"I1": [1.0, 1.1, 1.2, 1.3, 1.4], "I2": [2.0, 2.1, 2.2], "I3": 2.5, "omega0": [1.0, 2.0], "epsilon": nudges}
    ds = sweeps.survey({"title": "nudges", "grid": grid})
    assert "breakdown" in figures.pictures(ds)
    assert "breakdown" not in figures.pictures(ds.isel(epsilon=slice(0, 5)))
    selection, total = figure_breakdown.select_bodies(ds)
    assert total == 15
    assert selection.sizes["body"] == 8  # every second: at most 14
    assert "8 of 15 bodies" in figure_breakdown.draw(ds).texts[1].get_text()


def test_bodies_rates_and_periods(breakdown_map):
    rates, periods = figure_bodies.draw(breakdown_map).axes
    markers = [line for line in rates.lines if line.get_gid() == "unstable"]
    rows = sorted(round(line.get_ydata()[0]) for line in markers)
    assert rows == [0, 1, 2, 3, 4, 5, 7, 8, 9]  # every body with three different moments, once
    racket = next(line for line in markers if round(line.get_ydata()[0]) == 3)
    expected = np.sqrt((0.01638 - 0.00121) * (0.01748 - 0.01638) / (0.01748 * 0.00121))
    assert racket.get_xdata()[0] == pytest.approx(expected, rel=1e-9)  # measured at a nudge of 1e-8
    texts = {text.get_text() for text in periods.texts}
    assert {"303.74 d", "433 d", "185.13 d", "207 d", "27,263 d"} <= texts
    assert periods.get_xlabel() == "period in the body's frame  (days of 86,400 s)"
    measured = [line.get_xdata()[0] for line in periods.lines if line.get_gid() == "rigid body, measured"]
    assert measured[0] == pytest.approx(303.741, abs=5e-4)


def test_bodies_say_how_soon_they_grow_and_flip(breakdown_map):
    rates = figure_bodies.draw(sweeps.survey("bodies")).axes[0]
    grows, flips = (
        {round(t.xy[1]): t.get_text() for t in rates.texts if t.get_gid() == gid} for gid in ("e-fold", "flip")
    )
    # the racket: 1/8.882 s, by the formula; its flips are compared with the closed form in test_flips.py
    assert grows[3] == "0.113 s"
    assert flips[3] == "4.55 s"
    assert (grows[0], flips[0]) == ("556 d", "19,535 d")
    assert grows[5] == "1.74×10⁻¹³ s"
    assert set(grows) == set(flips) == {0, 1, 2, 3, 4, 5}  # not the plate, which has no unstable axis
    texts = figure_bodies.draw(breakdown_map).axes[0].texts  # the map has no flips
    assert "flip" not in {text.get_gid() for text in texts}


@pytest.mark.slow
def test_many_bodies_fit_a_page():
    """Forty bodies, every second with an observed period, from a second to years."""
    bodies = [{"name": f"Body {k}", "axis": 3, "ratios": {"I1": 1, "I2": 1.1 + k / 80, "I3": 1.7}} for k in range(40)]
    for k, body in enumerate(bodies[::2]):
        body["observed"] = {"period_days": 10.0 ** (k / 2 - 5), "what": "a wobble with a name that goes on and on"}
    ds = sweeps.survey({"bodies": bodies, "grid": {"omega0": 3.0}, "integration": {"flips": True}})
    figure = figure_bodies.draw(ds)
    figure.draw_without_rendering()
    assert figure.get_size_inches()[1] < 17
    rates, periods = figure.axes
    assert len(rates.get_yticks()) <= figure_bodies.MAX_BODIES
    assert len(artists_of_gid(periods, "observed")) <= figure_bodies.MAX_PERIODS
    assert "20 of 40 bodies" in figure.texts[1].get_text()
    texts = [text.get_text() for text in periods.texts]
    assert "0 d" not in texts
    assert "10⁻⁵ d" in texts  # less than a second
    values = [t.get_window_extent() for t in periods.texts if t.get_text().endswith(" d")]
    assert all(periods.bbox.x0 <= box.x0 < box.x1 <= periods.bbox.x1 for box in values)
    assert {text.get_text() for text in rates.texts if text.get_gid() == "about"} == {"axis 2"}
    assert "ε = 10⁻⁶,\nflips every" in {text.get_text() for text in rates.texts}


def test_the_period_drawn_is_the_measured_one(breakdown_map):
    ds = breakdown_map.copy(deep=True)
    ds["euler_period"].loc[{"body": "Earth", "axis": 3}] = 100 * 86_400.0
    assert "100 d" in {text.get_text() for text in figure_bodies.draw(ds).axes[1].texts}


def test_bodies_without_observation_have_one_panel():
    body = {"name": "a body with a name that goes on and on", "ratios": {"I1": 1, "I2": 2, "I3": 2.5}}
    ds = sweeps.survey({"bodies": [body], "grid": {"omega0": [1.0, -2.0]}})
    assert len(figure_bodies.draw(ds).axes) == 1


def test_gist_is_the_last_sentence():
    note = "Ratio 1/305 gives 305.  The observed 433 (solar)\n days come from elsewhere."
    assert figure_bodies.conclusion(note) == "The observed 433 (solar) days come from elsewhere."
    assert figure_bodies.conclusion(one := "One clause; C = 0.355 M R2, 3.5 times.") == one


USERS_SETTINGS = {
    **{"font.size": 30.0, "axes.titlesize": 40.0, "font.family": "monospace", "mathtext.fontset": "cm"},
    **{"text.usetex": True, "lines.linewidth": 9.0, "lines.marker": "x", "axes.facecolor": "black"},
    **{"axes.grid": True, "xtick.direction": "in", "xtick.top": True, "image.origin": "upper", "image.cmap": "jet"},
    **{"legend.loc": "lower left", "savefig.bbox": "tight", "savefig.dpi": 30.0, "figure.dpi": 30.0},
}


@pytest.mark.slow
def test_a_users_settings_of_matplotlib_change_no_picture(tiny, tmp_path):
    (with_settings,) = figures.draw_all(tiny, tmp_path / "own", only=["theory_against_measured"])
    with matplotlib.rc_context(USERS_SETTINGS):
        theirs = dict(matplotlib.rcParams)
        (path,) = figures.draw_all(tiny, tmp_path / "theirs", only=["theory_against_measured"])
        assert path.read_bytes() == with_settings.read_bytes()
        assert dict(matplotlib.rcParams) == theirs


# ---------------------------------------------------------------------------------------------------------
# Pictures of maps of random values: no kernel is compiled for them

SHAPES = {"I1_over_I3": [0.3, 0.6, 0.9], "thickness": [0.2, 0.5, 0.8]}
ENERGIES = {"system": "observed_periods", "grid": {"ratios": SHAPES, "I3": 1.0, "P_psi": 2.0, "P_phi": 1.0}}
PICTURES = {  # sweep that ships, or a definition → pictures of its map, without that of theory against measured
    "asymmetric_shaft": {"tongues_centred"},
    "central_potential": {"oscillations"},
    "cubesats": {"outlook"},
    "dimorphos": {"out_of_plane"},
    "explorer": {"settling"},
    "foucault": {"turn", "stability"},
    "gravity_gradient": {"stability"},
    "gravity_gradient_ellipse": {"in_plane", "out_of_plane"},
    "kapitza_pendulum": {"tongues_inverted", "tongues_hanging"},
    "pumped_shapes": {"triangle"},
    "rackets": {"defect"},
    "twist": {"twist"},
    "tennis_racket": {"triangle", *(f"stability_axis_{axis}" for axis in (1, 2, 3)), "polhodes"},
    "tumbling": {"periods", "herpolhode"},
    "observed_periods": {"energies"},
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", PICTURES)
def test_a_map_of_random_values_has_all_pictures_of_its_system_and_a_sentence(name, monkeypatch):
    monkeypatch.setattr(gallery, "MAX_GRID_POINTS", 60)
    monkeypatch.setattr(gallery, "MAX_CHEAP_POINTS", {})
    shipped = catalogue.shipped_files().get(name)
    values = gallery.reduce_points(plain(read_text(file_text(shipped)))) if shipped else ENERGIES
    ds = random_map(values)
    assert "nan" not in systems.presentation_of(ds).sentence(ds)
    panels = {}
    for picture, draw in figures.pictures(ds).items():
        with np.errstate(all="ignore"):
            if figure := draw():
                figure.draw_without_rendering()
                panels[picture] = [axes for axes in figure.axes if axes.has_data()]
    assert PICTURES[name] <= {*panels} <= PICTURES[name] | {"theory_against_measured"}
    assert all(panels.values())
