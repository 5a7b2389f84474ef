"""Pictures of small oscillations: their content, read from the drawn artists; the maps are made by hand."""

import matplotlib
import numpy as np
import pytest
import xarray as xr

import sweeps
from kernels.estimator.statuses import EQUILIBRIUM_UNDECIDED, NO_EQUILIBRIUM, NON_FINITE
from sweeps.figure import canvas, sheets
from sweeps.systems.oscillator.presentation import figure_oscillations
from sweeps.systems.oscillator.system import REGIMES
from sweeps.systems.presentation import planes

STABLE, UNSTABLE, MARGINAL = (REGIMES.index(name) - 1 for name in ("stable", "unstable", "marginal"))


@pytest.fixture(autouse=True)
def use_style():
    with matplotlib.rc_context(sheets.STYLE):
        yield


def a_map(square, regime, names=("cone",), x=None):
    """A map of one mode over two lengths, ω² in units of the scale: shapes (length, rod, equilibrium)."""
    dims = ("length", "rod", "mass", "gravity", "epsilon", "phase", "equilibrium", "mode")
    square, regime = (np.asarray(a)[:, :, None, None, None, None, :, None] for a in (square, regime))
    columns = {
        "omega_squared": square,
        "omega_squared_theory": square,
        "omega_squared_error": np.full_like(square, 2e-10),
        "rate_scale": np.ones_like(square),
        "regime": regime.astype("i1"),
        "status": np.zeros(square.shape, "i1"),
    }
    length, rod = (np.linspace(0.2, 5.0, n) for n in square.shape[:2])
    units = {"units": "m", "long_name": "length of the rod"}
    coordinates = {
        "length": ("length", length, units),
        "rod": ("rod", rod if x is None else x, units),
        "mass": ("mass", [1.0], {"units": "kg"}),
        "gravity": ("gravity", [9.80665], {"units": "m s-2"}),
        "epsilon": ("epsilon", [1e-6]),
        "phase": ("phase", [0.6], {"units": "rad"}),
        "equilibrium": list(names),
        "mode": [1],
    }
    title = {"title": "Conical motion of a spherical pendulum"}
    return xr.Dataset({name: (dims, values) for name, values in columns.items()}, coordinates, title)


def artist_labels(figure):
    artists = [artist for ax in figure.axes for artist in (*ax.lines, *ax.collections)]
    return {artist.get_gid() for artist in artists}


def legend_labels(figure):
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def test_the_legend_lists_what_is_drawn():
    square = np.linspace(0.5, 1.0, 30).reshape(5, 6, 1)
    assert legend_labels(figure_oscillations.draw(a_map(square, np.full(square.shape, STABLE)))) == []
    square[:, :3] = -1.0
    square[0, 0] = np.nan
    square[0, 1] = np.nan
    ds = a_map(square, np.where(square > 0, STABLE, UNSTABLE))
    for codes, words in (
        ((NO_EQUILIBRIUM, NO_EQUILIBRIUM), "no such equilibrium"),
        ((EQUILIBRIUM_UNDECIDED, EQUILIBRIUM_UNDECIDED), "equilibrium undecided"),
        ((EQUILIBRIUM_UNDECIDED, NO_EQUILIBRIUM), "no such equilibrium, or undecided"),
        ((NON_FINITE, NO_EQUILIBRIUM), "no measured value"),
    ):
        ds["status"].values[0, :2] = np.reshape(codes, (2, 1, 1, 1, 1, 1, 1))
        axes = figure_oscillations.draw(ds)
        assert artist_labels(axes) >= {"measured", "theory"}
        assert legend_labels(axes) == [r"theory: $\omega^2 = 0$", words]
    curve = figure_oscillations.draw(a_map(square[:1, 1:], np.where(square[:1, 1:] > 0, STABLE, UNSTABLE)))
    assert legend_labels(curve) == ["theory", "stable", "unstable"]
    assert artist_labels(curve) >= {"theory", "stable", "unstable"}


def test_what_is_the_same_everywhere_is_drawn_as_a_law_and_not_as_one_colour():
    square = np.ones((5, 6, 1))
    figure = figure_oscillations.draw(a_map(square, np.full(square.shape, STABLE)))
    assert "measured" not in artist_labels(figure)
    assert {"theory", "stable"} <= artist_labels(figure)
    assert len(figure.axes) == 1  # no bar of colours


LAWS = {  # of the measured rate over length and gravity
    "pendulum": lambda length, g: np.sqrt(g / length),
    "grows with both": lambda length, g: np.sqrt(g * length),
    "falls with both": lambda length, g: 1.0 / (length * g),
    "length alone, nearly": lambda length, g: length * g**0.1,
    "crowded at one end": lambda length, g: np.sqrt(g) * (1.0 + 1e-3 * length),
}


@pytest.mark.parametrize("span", [(0.05, 20.0), (20.0, 0.05)])
@pytest.mark.parametrize("law", LAWS)
def test_each_name_of_a_curve_stands_at_its_curve(law, span):
    length, g = np.geomspace(*span, 12), np.linspace(1.6, 24.8, 20)
    square = np.ones((12, 20, 1))
    ds = a_map(square, np.full(square.shape, STABLE)).assign_coords(length=("length", length, {"units": "m"}))
    ds = ds.assign_coords(rod=("rod", g, {"units": "m s-2"}))
    rates = LAWS[law](length[:, None], g)[:, :, None, None, None, None, None, None]
    ds["rate_scale"] = ds["rate_scale"] * rates
    for name in ("omega_squared", "omega_squared_theory"):
        ds[name] = ds[name] * rates**2
    figure = figure_oscillations.draw(ds)
    figure.canvas.draw()
    (ax,) = figure.axes
    names = [text for text in ax.texts if text.get_text()]
    over = ax.get_xlabel().startswith("length")
    assert len(names) == figure_oscillations.MAX_CURVES
    places = []
    for text in names:
        value = float(text.get_text().split()[0])
        rate = LAWS[law](length[-1], value) if over else LAWS[law](value, g[-1])
        end = ax.transAxes.inverted().transform(ax.transData.transform((1.0, rate)))[1]
        places.append((end, text.xy[1]))
    # names keep a distance, and 3 digits of a value move an end by a hundredth
    max_shift = figure_oscillations.MIN_LABEL_SPACING * (figure_oscillations.MAX_CURVES - 1) + 0.01
    assert all(abs(end - at) <= max_shift for end, at in places)
    ends = [round(end, 2) for end, _ in sorted(places, key=lambda place: place[1])]
    assert ends == sorted(ends)


def test_rounding_about_zero_is_no_boundary():
    """A flat mode: theory has ω² = 0, and 6e-17 of either sign."""
    noise = np.random.default_rng(0).choice([-6e-17, 6e-17], (60, 60, 1))
    figure = figure_oscillations.draw(a_map(noise, np.full(noise.shape, MARGINAL)))
    assert "theory" not in artist_labels(figure)
    assert legend_labels(figure) == ["marginal"]
    (dots,) = (line for line in figure.axes[0].lines if line.get_gid() == "marginal")
    assert 0 < dots.get_xdata().size <= figure_oscillations.MAX_DOTS  # 3,600 would be a grey page
    assert len(set(np.diff(np.unique(dots.get_xdata())).round(9))) == 1  # evenly strided


def test_long_lines_are_broken_between_words():
    text = "ten points\n" + "a word and " * 20
    lines = canvas.wrap_text(text, 4.0).split("\n")
    assert lines[0] == "ten points"
    assert len(lines) > 3
    assert max(map(len, lines)) <= 4.0 * canvas.SUBTITLE_LETTERS
    assert " ".join(" ".join(lines[1:]).split()) == ("a word and " * 20).strip()
    values = ["I2 = 0.017784 kg m²", "omega0 = 10 rad s⁻¹", "phase = 0.6 rad"]
    assert canvas.wrap_text(",  ".join(values), 2.6).replace("\u00a0", " ").split(",\n") == values


def test_a_map_of_more_values_than_can_be_seen_is_thinned():
    square = np.linspace(0.5, 2.0, 1000)[:, None, None] * np.array([1.0, 1.1, 1.2])[:, None]
    figure = figure_oscillations.draw(a_map(square, np.full(square.shape, STABLE)))
    (mesh,) = [c for ax in figure.axes for c in ax.collections if c.get_gid() == "measured"]
    assert max(mesh.get_array().shape) <= planes.MAX_DRAWN < square.shape[0]


def test_orbits_have_frequencies_over_the_orbital_rate_mode_by_mode():
    exponents = np.linspace(-1.75, 3.25, 21)
    panel = sweeps.plot.oscillations(sweeps.survey(system="central_potential", exponent=exponents))
    lines = {line.get_label().partition(",")[0]: line for line in panel.lines if line.get_gid() in ("mode", "equal")}
    apart = exponents[exponents != -1.0]
    for label, x, ratio in (
        ("radial oscillation", apart, np.sqrt(apart + 2.0)),
        ("tilt of the orbit", apart, np.ones(apart.size)),
        ("equal modes", [-1.0, -1.0], [1.0, 1.0]),
    ):
        np.testing.assert_allclose(lines[label].get_data(), [x, ratio], rtol=1e-8)  # error of the measured rates
    assert [text.get_text() for text in panel.texts] == ["Kepler: 1, closed orbits", "Hooke: 2, closed orbits"]
