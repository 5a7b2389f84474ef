"""Pictures as functions and as `ds.polhode`, their themes, sizes and formats, and colours for every kind of sight."""

import re
from contextlib import nullcontext
from itertools import combinations

import numpy as np
import pytest
from calls import python
from matplotlib.colors import NoNorm, to_rgba_array
from matplotlib.figure import Figure
from matplotlib.image import imread

import sweeps
from sweeps import plot
from sweeps.__main__ import main
from sweeps.commands import maps as command
from sweeps.figure import canvas, colors, marks, sheets
from sweeps.maps import dataset
from sweeps.maps.storage import write_map
from sweeps.process import progress
from sweeps.schema.refusals import RefusedError
from sweeps.systems.presentation import regimes
from sweeps.systems.relative_equilibrium.presentation import APPEARANCE, figure_spectra
from sweeps.views import figures, films


@pytest.fixture(scope="module")
def path(tiny, tmp_path_factory):
    path = tmp_path_factory.mktemp("map") / "tiny.nc"
    write_map(tiny, path)
    return str(path)


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setitem(sheets.STYLE, "savefig.dpi", 50)


# ---------------------------------------------------------------------------------------------------------
# Functions


def test_a_function_draws_what_the_figures_command_draws(tiny):
    ax = plot.stability(tiny, axis=2, at={"I3": float(tiny.I3[1])})
    (mesh,) = (artist for artist in ax.collections if artist.get_array() is not None)
    axes = figures.pictures(tiny.isel(I3=[1]))["stability_axis_2"]().axes[0]
    (stored_mesh,) = (artist for artist in axes.collections if artist.get_array() is not None)
    np.testing.assert_array_equal(mesh.get_array(), stored_mesh.get_array())
    assert "axis 2" in ax.figure.texts[0].get_text()


def test_it_draws_into_an_axes_of_somebody_else(tiny):
    figure = Figure()
    first_axes, second_axes = figure.subplots(1, 2)
    assert plot.stability(tiny, ax=first_axes) is first_axes
    panel = plot.theory_against_measured(tiny, ax=second_axes)  # several panels, in the place of one
    figure.canvas.draw()
    inside = second_axes.get_subplotspec().get_position(figure)
    x, y = panel.get_position().get_points().mean(axis=0)
    assert inside.x0 < x < inside.x1
    assert inside.y0 < y < inside.y1
    assert not second_axes.axison
    assert "impossible" in " ".join(first_axes.get_legend_handles_labels()[1]) or not (tiny.triangle_margin < 0).any()


@pytest.mark.parametrize(
    "second", ["import sweeps", pytest.param("sweeps.open_map(sys.argv[1])", marks=pytest.mark.slow)]
)
def test_the_accessor_is_registered_where_a_dataset_comes_from(path, second):
    first = "import xarray" if second == "import sweeps" else "import sweeps"
    code = f"import sys; {first}; {second}; import xarray; xarray.Dataset().polhode"
    python(code, path, PYTHONWARNINGS="error")


def test_the_accessor_draws_and_has_a_summary(tiny):
    assert all(callable(getattr(tiny.polhode, name)) for name in plot.NAMES)
    assert tiny.polhode.polhodes().figure.texts[0].get_text() == "Polhodes"
    assert "stability_axis_1" in tiny.polhode.pictures()
    assert f"{tiny.status.size:,} points" in tiny.polhode.summary()
    with pytest.raises(AttributeError, match="stability"):
        tiny.polhode.stabilty  # noqa: B018


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda ds: plot.draw(ds, "stabilty"), "not a figure of this map"),
        (lambda ds: plot.cones(ds), "not a figure of this map"),
        (lambda ds: plot.stability(ds, at={"I9": 1.0}), "no dimension"),
        (lambda ds: plot.stability(ds, at=3), "at: is of type int"),
        (lambda ds: plot.points(ds, at=3), "at: is of type int"),
        (lambda ds: sweeps.point(3), "ds: is of type int"),
        (lambda ds: sweeps.open_map(3), "path: 3 is no path"),
        (lambda ds: sweeps.motion("pendulum", 3, 4), "start: 3; allowed: a mapping with theta"),
        (lambda ds: plot.stability(ds, ax=Figure().add_axes((0, 0, 1, 1))), "no grid"),
    ],
)
def test_what_cannot_be_drawn_is_said(tiny, call, message):
    with pytest.raises(RefusedError, match=message):
        call(tiny)


# ---------------------------------------------------------------------------------------------------------
# Sizes, formats, themes


@pytest.mark.slow
def test_a_picture_is_as_large_as_it_is_asked_for(path, tiny, tmp_path):
    size = np.array([160.0, 100.0])  # mm
    assert main(["figures", path, "-o", str(tmp_path), "--only", "stability_axis_2", "--size", "160x100mm"]) == 0
    for kind in ("svg", "pdf"):
        list(figures.draw_all(tiny, tmp_path, kind, ["stability_axis_2"], sheet=sheets.Sheet(*size)))
    height, width, _ = imread(tmp_path / "stability_axis_2.png").shape
    np.testing.assert_allclose((width, height), size / 25.4 * 50, atol=1.5)
    svg = (tmp_path / "stability_axis_2.svg").read_text()
    points = [float(x) for x in re.search(r'width="([\d.]+)pt" height="([\d.]+)pt"', svg).groups()]
    np.testing.assert_allclose(points, size / 25.4 * 72, rtol=1e-4)
    box = re.search(rb"/MediaBox \[ ?[0.]+ [0.]+ ([\d.]+) ([\d.]+)", (tmp_path / "stability_axis_2.pdf").read_bytes())
    np.testing.assert_allclose([float(x) for x in box.groups()], size / 25.4 * 72, rtol=1e-4)


@pytest.mark.parametrize(
    ("text", "size"),
    [("6in", (152.4, None)), ("15cm", (150.0, None)), ("160", (160.0, None)), ("6 x 4in", (152.4, 101.6))],
)
def test_a_length_has_a_unit(text, size):
    assert command._parse_sheet(text)[:2] == pytest.approx(size)


def test_a_slide_has_the_pixels_of_a_projector_and_letters_of_one_size(tmp_path):
    with sheets.use_sheet(sheets.SHEETS["slide"]):
        figures_made = [canvas.make_figure(width, 5.0, "title", "subtitle") for width in (5.0, 12.0)]
        figures.save_figure(figures_made[0], tmp_path / "slide.png", "png")
    assert imread(tmp_path / "slide.png").shape[:2] == (1080, 1920)
    assert figures_made[0].get_size_inches() == pytest.approx(figures_made[1].get_size_inches())
    assert 8.5 / 72 * figures_made[0].dpi > 20  # pixels of a subtitle


def test_panels_stand_beside_each_other_where_there_is_room():
    cell, margins = (3.9, 3.2), (1.2, 1.6)
    for sheet, panels, shape in (
        ("slide", 3, (1, 3)),
        ("page", 2, (1, 2)),
        ("column", 2, (2, 1)),
        ("column", 3, (3, 1)),
    ):
        with sheets.use_sheet(sheets.SHEETS[sheet]):
            assert canvas.arrange_panels(panels, cell, margins)[:2] == shape


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--size", "6in x 4cm"], "is not a size"),
        (["--size", "2cm"], "from 30 to 2000 mm"),
        (["--format", "mp4"], "needs ffmpeg"),
    ],
)
def test_a_wrong_wish_gets_one_message(path, tmp_path, capsys, monkeypatch, options, message):
    monkeypatch.setattr(films, "ffmpeg_path", lambda: None)
    assert main(["figures", path, "-o", str(tmp_path / "new"), *options]) == 2
    output = capsys.readouterr().err
    assert message in output
    assert "allowed" in output
    assert not (tmp_path / "new").exists()


# ---------------------------------------------------------------------------------------------------------
# Colours, as those see them who see fewer

# Machado, Oliveira and Fernandes 2009, "A physiologically-based model for simulation of color vision deficiency",
# severity 1, on linear red, green and blue
SIGHT = {
    "all colours": np.eye(3),
    "no red": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "no green": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "no blue": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
REGIMES = (colors.STABLE, colors.UNSTABLE, colors.LIGHT_BLUE)


def regimes_in(theme):
    """Colours of the regimes in a theme."""
    return to_rgba_array([colors.THEMES[theme][name] for name in REGIMES])[:, :3]


def signs_in(theme):
    """Colours of negative and positive rates in a theme."""
    with sheets.use_sheet(sheets.OWN_SIZE, theme):
        return sheets.color_map("signed")


def lab(rgb):
    """CIE L*a*b* (D65) of red, green and blue from 0 to 1."""
    to_xyz = np.array([[0.412456, 0.357576, 0.180438], [0.212673, 0.715152, 0.072175], [0.019334, 0.119192, 0.950304]])
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    t = linear @ to_xyz.T / (0.95047, 1.0, 1.08883)
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1)


def simulate_vision(rgb, sight):
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    rates = np.clip(linear @ np.transpose(SIGHT[sight]), 0.0, 1.0)
    return np.where(rates <= 0.0031308, 12.92 * rates, 1.055 * rates ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize("theme", colors.THEMES)
def test_a_figure_has_the_colours_of_its_theme(theme, tmp_path):
    with sheets.use_sheet(sheets.OWN_SIZE, theme):
        figure = canvas.make_figure(3.0, 2.0, "title", "")
        shades = marks.Shades([colors.STABLE, colors.UNSTABLE], 3).with_extremes(bad=colors.MISSING)
        mesh = figure.subplots().pcolormesh(np.ma.masked_less([[-1.0, 2.0, 5.0]], 0), cmap=shades, norm=NoNorm())
        figures.save_figure(figure, tmp_path / "figure.png", "png")
    paper, *cells = (colors.THEMES[theme][n] for n in (colors.PAPER, colors.MISSING, colors.STABLE, colors.UNSTABLE))
    shown_colors = [mesh.get_cmap().get_bad(), mesh.get_cmap()(2), mesh.get_cmap()(5)]
    np.testing.assert_allclose(shown_colors, to_rgba_array(cells))
    np.testing.assert_allclose(imread(tmp_path / "figure.png")[-1, 0, :3], to_rgba_array([paper])[0, :3], atol=1e-6)


@pytest.mark.parametrize("theme", colors.THEMES)
@pytest.mark.parametrize("sight", SIGHT)
def test_regimes_and_signs_are_told_apart_by_every_eye(theme, sight):
    """By 20 or more of ΔE (CIE 1976): some ten times the just noticeable difference."""
    points = lab(simulate_vision(regimes_in(theme), sight))
    assert min(np.linalg.norm(one - other) for one, other in combinations(points, 2)) > 20
    points = lab(simulate_vision(signs_in(theme)(np.linspace(0, 1, 9))[:, :3], sight))
    assert np.linalg.norm(points[1] - points[-2]) > 20
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).min() > (2 if theme == "print" else 5)


def test_print_tells_regimes_apart_without_colours_and_signs_only_grow_lighter():
    lightness = np.sort(lab(regimes_in("print"))[:, 0])
    assert np.diff(lightness).min() > 15
    assert lightness[-1] < 92  # and from paper
    lightness = lab(signs_in("print")(np.linspace(0, 1, 33))[:, :3])[:, 0]
    assert np.diff(lightness).min() > 0
    assert np.ptp(lightness) > 70


def test_regimes_of_equilibria_are_hatched_on_paper_alone():
    """In grey, the shades of one regime's colour are those of another's."""
    regime = np.repeat([0, 1, 2, 3], 4).reshape(4, 4)
    words = [APPEARANCE.words(name) for name in figure_spectra.REGIMES[1:5]]
    for theme, hatches in (("light", []), ("dark", []), ("print", ["....", "////", "xxxx"])):
        with sheets.use_sheet(sheets.OWN_SIZE, theme):
            figure = canvas.make_figure(5.0, 4.0, "", "")
            ax, painter = figure.subplots(), regimes.Regimes(figure_spectra.REGIMES, APPEARANCE, 1.0)
            painter.paint(ax, np.arange(5.0), np.arange(5.0), regime, 0.3 * (regime != 1), np.zeros((4, 4), int))
            painter.explain(figure, [ax], "growth")
        (legend,) = figure.legends
        assert [text.get_text() for text in legend.get_texts()] == words
        assert [h for artist in ax.collections[1:] for h in artist.hatches] == hatches
        assert [patch.get_hatch() for patch in legend.legend_handles if patch.get_hatch()] == hatches
        scale = figure.axes[1].collections[0].get_array()
        assert set(np.unique(scale // regimes.SHADES)) == {0, 2, 3}  # a column each for growth or decay


def test_tab_offers_the_pictures_of_a_map_and_a_cell_shows_its_sentence(tiny):
    assert {"stability", "stability_axis_1", "polhodes"} <= {*dir(tiny.polhode)}
    assert not {"herpolhode", "campbell", "cones"} & {*dir(tiny.polhode)}
    assert tiny.polhode.stability_axis_1().figure.texts[0].get_text().startswith("Spin about axis 1")
    bodies = sweeps.survey("bodies").polhode
    assert "<b>A rigid Earth would wobble in 304 days; the Earth takes 433</b>" in bodies._repr_html_()


def test_a_cell_shows_the_answer_about_a_body_as_text_or_tables():
    answer = sweeps.body({"name": "<Body>", "ratios": {"I1": 1.0, "I2": 2.0, "I3": 2.5}})
    assert repr(answer) == str(answer)
    assert "<h4>&lt;Body&gt;</h4>" in answer._repr_html_()
    assert answer._repr_html_().count("<tr>") == 3


def test_a_long_survey_shows_its_progress_and_measures_the_same(monkeypatch):
    finished = []
    monkeypatch.setattr(dataset, "LONG_SECONDS", 0.0)
    monkeypatch.setattr(progress, "count_pieces", lambda total, _: nullcontext(lambda: finished.append(total)))
    grid = {"I1": 1.0, "I2": {"start": 1.1, "stop": 2.4, "num": 100}, "I3": 2.5, "omega0": 1.0}
    shown = sweeps.survey(**grid, threads=2)
    monkeypatch.undo()
    assert len(finished) == finished[0] == dataset.PIECES
    assert shown.content_hash == sweeps.survey(**grid).content_hash
