"""The picture of measured values against theory: its content, read from the drawn artists and computed by hand."""

import math

import numpy as np
import pytest

import sweeps
from sweeps import systems
from sweeps.schema.iteration import coprime_stride
from sweeps.systems.presentation import agreement
from sweeps.views import figures


def compare_columns(ds):
    """Return the values that each column of the picture of a map shows."""
    presentation = systems.presentation_of(ds)
    table = presentation.system.layout().variables
    return [agreement.compare(ds, table, comparison) for comparison in presentation.compared if not comparison.is_spare]


def picture(ds):
    return figures.pictures(ds)["theory_against_measured"]()


def of_gid(ax, gid):
    return [line for line in ax.lines if line.get_gid() == gid]


def test_residuals_are_those_of_the_map(tiny, monkeypatch):
    monkeypatch.setattr(agreement, "BLOCK_POINTS", 50)  # so that blocks end inside every dimension
    figure = picture(tiny)
    for column, name, kinds in ((0, "frequency", ("stable_minor", "stable_major")), (1, "growth_rate", ("unstable",))):
        upper, lower = figure.axes[column], figure.axes[2 + column]
        possible = tiny.where((tiny[f"{name}_theory"] > 0) & (tiny.triangle_margin >= 0))
        deviation = (abs(possible[name] - possible[f"{name}_theory"]) / possible[f"{name}_theory"]).values.ravel()
        expected = np.sort(deviation[np.isfinite(deviation)])
        sizes = (possible[f"{name}_theory"] / abs(possible.omega0)).values.ravel()
        abscissas = np.concatenate([line.get_xdata() for kind in kinds for line in of_gid(lower, kind)])
        np.testing.assert_array_equal(np.sort(abscissas), np.sort(sizes[np.isfinite(deviation)]))
        residuals = np.sort(np.concatenate([line.get_ydata() for kind in kinds for line in of_gid(lower, kind)]))
        # exact zeros are drawn at the bottom
        np.testing.assert_array_equal(residuals, np.maximum(expected, agreement.EXACT))
        valid = tiny.where((tiny[f"{name}_theory"] > 0) & (tiny.status == 0))
        ratio = (abs(valid[name] - valid[f"{name}_theory"]) / valid[f"{name}_error"]).values.ravel()
        heights = [patch.get_height() for patch in upper.patches]
        # the first histogram contains all sizes of the perturbation, the next are drawn in front
        assert sum(heights[: len(agreement.RATIOS) - 1]) == np.isfinite(ratio).sum()
        place = upper.get_position().bounds
        shares = (of_gid(ax, "cumulative") for ax in figure.axes[4:] if ax.get_position().bounds == place)
        (curve,) = next(lines for lines in shares if lines)
        assert curve.get_ydata()[-1] == 1.0
        assert curve.get_xdata().max() <= 1.0  # every error covers
        assert len([line for line in upper.lines if (line.get_gid() or "").startswith("error ")]) == 3


def test_each_point_is_in_one_group(tiny):
    ds = tiny.copy(deep=True)
    ds["status"].values[0, 0] = 1
    ds["status"].values[0, 1] = 2
    ds["regime"].values[1, 0] = 2
    for ax, comparison in zip(picture(ds).axes[2:4], compare_columns(ds), strict=True):
        groups = {line.get_gid(): line.get_xdata().size for line in ax.lines if line.get_gid() != "error"}
        is_drawable = np.isfinite(comparison.columns["deviation"]) & (comparison.columns["theory"] > 0)
        assert sum(groups.values()) == np.count_nonzero(is_drawable)
        names = {
            "stable_minor",
            "stable_major",
            "short_window",
            "not_converged",
            "differs",
        }  # the statuses of frequencies
        assert {*groups} == {"impossible", *(names if "stable_minor" in groups else ["unstable"])}


def test_counts_are_written(tiny):
    ds = tiny.copy(deep=True)
    ds["status"].values[0, 0, 0, 0] = 2
    text = picture(ds).texts[1].get_text()
    for words in ("864 points", "126 unstable", "288 marginal", "858 ok", "6 not converged"):
        assert words in text


def test_thinning_is_said(tiny, monkeypatch):
    monkeypatch.setattr(agreement, "MAX_DRAWN", 150)
    figure = picture(tiny)
    assert "every 7th drawn" in figure.texts[1].get_text()  # 864/150 is above 5, and 6 divides lengths of 3
    assert sum(line.get_xdata().size for line in figure.axes[2].lines if line.get_gid() == "stable_minor") <= 150


@pytest.mark.parametrize(("shape", "max_points"), [((3, 24, 24, 24, 8), 200_000), ((3, 64, 64, 16), 1000), ((7,), 3)])
def test_stride_sees_every_value_of_every_dimension(shape, max_points):
    stride = coprime_stride(shape, max_points)
    selection = np.arange(0, math.prod(shape), stride)
    assert selection.size <= max_points
    for index, length in zip(np.unravel_index(selection, shape), shape, strict=True):
        assert np.unique(index).size == min(length, selection.size)


def test_worst_deviation_is_over_all_points_that_are_ok_possible_and_of_the_regime(tiny):
    ds = tiny.copy(deep=True)
    exact = ds["frequency_theory"]
    ds["frequency"] = exact.copy()
    stable_points = np.argwhere((exact > 0).values & (ds.triangle_margin > 0).values)
    impossible = np.argwhere((exact > 0).values & (ds.triangle_margin < 0).values)
    rows = ((stable_points[-2], 1.1), (stable_points[-4], 2.0), (stable_points[-6], 4.0), (impossible[0], 3.0))
    for index, factor in rows:
        ds["frequency"].values[tuple(index)] *= factor
    ds["status"].values[tuple(stable_points[-4])] = 2
    ds["regime"].values[tuple(stable_points[-6])] = 2
    # 1.1 of it is off by 0.1, but for rounding; the further points are not converged, of another regime, and impossible
    assert compare_columns(ds)[0].max_deviation == pytest.approx(0.1, abs=1e-15)


@pytest.mark.slow
def test_eigenvalues_are_compared_as_points_of_the_plane():
    ds = sweeps.survey({"system": "lagrange_points", "grid": {"mass_ratio": [0.01, 0.02]}})
    (comparison,) = compare_columns(ds)
    deviations = [
        ds[f"eigenvalue_{component}"] - ds[f"eigenvalue_{component}_theory"] for component in ("real", "imag")
    ]
    expected = (np.hypot(*deviations) / ds["rate_scale"]).values.ravel()
    np.testing.assert_array_equal(comparison.columns["deviation"], expected)
    assert picture(ds).axes[0].get_title("left") == "eigenvalues"


def test_a_map_without_rates_is_compared_by_their_squares(tiny):
    names = ["omega_squared", "omega_squared_theory", "omega_squared_error", "regime", "regime_theory", "status"]
    squares_alone = tiny[[*names, "triangle_margin"]]
    figure = picture(squares_alone)
    assert figure.axes[0].get_title("left") == "Ω²"
    points = {
        kind: line.get_xdata().size for kind in ("stable_major", "unstable") for line in of_gid(figure.axes[1], kind)
    }
    assert points["unstable"] == ((tiny.regime == 2) & (tiny.triangle_margin >= 0)).sum()
