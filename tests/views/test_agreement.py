"""The picture of measured values against theory: what it holds, read off the drawn artists and worked out by hand."""

import math

import numpy as np
import pytest

import sweeps
from sweeps import systems
from sweeps.schema.iteration import coprime_stride
from sweeps.systems.presentation import agreement
from sweeps.views import figures


def compared(ds, most=agreement.MAX_DRAWN):
    """Return the values that each column of the picture of a map shows."""
    presentation = systems.presentation_of(ds)
    table = presentation.system.layout().variables
    return [agreement.compare(ds, table, one, most) for one in presentation.compared if not one.is_spare]


def picture(ds):
    return figures.pictures(ds)["theory_against_measured"]()


def of_gid(ax, gid):
    return [line for line in ax.lines if line.get_gid() == gid]


def test_residuals_are_those_of_the_map(tiny):
    figure = picture(tiny)
    for column, name, kinds in ((0, "frequency", ("stable_minor", "stable_major")), (1, "growth_rate", ("unstable",))):
        upper, lower = figure.axes[column], figure.axes[2 + column]
        part = tiny.where((tiny[f"{name}_theory"] > 0) & (tiny.triangle_margin >= 0))
        deviation = (abs(part[name] - part[f"{name}_theory"]) / part[f"{name}_theory"]).values.ravel()
        expected = np.sort(deviation[np.isfinite(deviation)])
        found = np.sort(np.concatenate([line.get_ydata() for kind in kinds for line in of_gid(lower, kind)]))
        # exact zeros are drawn at the bottom
        np.testing.assert_array_equal(found, np.maximum(expected, agreement.EXACT))
        whole = tiny.where((tiny[f"{name}_theory"] > 0) & (tiny.status == 0))
        ratio = (abs(whole[name] - whole[f"{name}_theory"]) / whole[f"{name}_error"]).values.ravel()
        heights = [patch.get_height() for patch in upper.patches]
        # the first histogram holds all sizes of the perturbation, the others stand before it
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
    presentation = systems.presentation_of(ds)
    for found in compared(ds):
        groups = agreement._groups(ds, presentation.system.layout().variables, found.columns, presentation.appearance)
        masks = {name: at for name, at, *_ in groups}
        columns = found.columns
        drawable = np.isfinite(columns["deviation"]) & (columns["theory"] > 0)
        np.testing.assert_array_equal(sum(at.astype(int) for at in masks.values()), drawable)
    frequency = compared(ds)[0]
    groups = agreement._groups(ds, presentation.system.layout().variables, frequency.columns, presentation.appearance)
    some = {name for name, at, *_ in groups if at.any()}
    assert {"stable_minor", "stable_major", "impossible", "short_window", "not_converged", "differs"} <= some


def test_counts_are_written(tiny):
    ds = tiny.copy(deep=True)
    ds["status"].values[0, 0, 0, 0] = 2
    text = picture(ds).texts[1].get_text()
    for words in ("864 points", "126 unstable", "288 marginal", "858 ok", "6 not converged"):
        assert words in text


def test_thinning_is_said(tiny, monkeypatch):
    monkeypatch.setattr(agreement.compare, "__defaults__", (150,))
    figure = picture(tiny)
    assert "every 7th drawn" in figure.texts[1].get_text()  # 864/150 is above 5, and 6 divides lengths of 3
    assert sum(line.get_xdata().size for line in figure.axes[2].lines if line.get_gid() == "stable_minor") <= 150


@pytest.mark.parametrize(("shape", "most"), [((3, 24, 24, 24, 8), 200_000), ((3, 64, 64, 16), 1000), ((7,), 3)])
def test_stride_sees_every_value_of_every_dimension(shape, most):
    stride = coprime_stride(shape, most)
    kept = np.arange(0, math.prod(shape), stride)
    assert kept.size <= most
    for index, length in zip(np.unravel_index(kept, shape), shape, strict=True):
        assert np.unique(index).size == min(length, kept.size)


def test_agreement_by_hand(tiny, monkeypatch):
    monkeypatch.setattr(agreement, "BLOCK_POINTS", 50)  # so that blocks end inside every dimension
    found, _ = compared(tiny, 200)
    kept = slice(None, None, found.stride)
    measured, theory, error = (
        tiny[name].values.ravel()[kept] for name in ("frequency", "frequency_theory", "frequency_error")
    )
    omega0 = np.broadcast_to(tiny.omega0.values[:, None, None], tiny.frequency.shape).reshape(-1)[kept]
    np.testing.assert_array_equal(found.columns["theory"], theory / abs(omega0))
    assert found.points == tiny.frequency.size == 864
    assert measured.size <= 200
    regimes, statuses = found.counts.values()
    assert regimes[2] == np.count_nonzero(tiny.regime == 2)
    assert sum(regimes.values()) == sum(statuses.values()) == 864
    with np.errstate(all="ignore"):
        expected = abs(measured - theory) / theory, error / theory
    for name, values in zip(("deviation", "error"), expected, strict=True):
        np.testing.assert_array_equal(found.columns[name][theory > 0], values[theory > 0])
    assert np.nanmax(found.columns["ratio"]) <= 1.0


def test_worst_deviation_is_over_all_points_that_are_ok_possible_and_of_the_regime(tiny):
    ds = tiny.copy(deep=True)
    exact = ds["frequency_theory"]
    ds["frequency"] = exact.copy()
    oscillating = np.argwhere((exact > 0).values & (ds.triangle_margin > 0).values)
    impossible = np.argwhere((exact > 0).values & (ds.triangle_margin < 0).values)
    rows = ((oscillating[-2], 1.1), (oscillating[-4], 2.0), (oscillating[-6], 4.0), (impossible[0], 3.0))
    for index, factor in rows:
        ds["frequency"].values[tuple(index)] *= factor
    ds["status"].values[tuple(oscillating[-4])] = 2
    ds["regime"].values[tuple(oscillating[-6])] = 2
    # 1.1 of it is off by 0.1, but for rounding; the others are not converged, of another regime, and impossible
    assert compared(ds)[0].max_deviation == pytest.approx(0.1, abs=1e-15)


@pytest.mark.slow
def test_eigenvalues_are_compared_as_points_of_the_plane():
    ds = sweeps.survey({"system": "lagrange_points", "grid": {"mass_ratio": [0.01, 0.02]}})
    (found,) = compared(ds)
    off = [ds[f"eigenvalue_{part}"] - ds[f"eigenvalue_{part}_theory"] for part in ("real", "imag")]
    expected = (np.hypot(*off) / ds["rate_scale"]).values.ravel()
    np.testing.assert_array_equal(found.columns["deviation"], expected)
    assert picture(ds).axes[0].get_title("left") == "eigenvalues"


def test_a_map_without_rates_is_compared_by_their_squares(tiny):
    names = ["omega_squared", "omega_squared_theory", "omega_squared_error", "regime", "regime_theory", "status"]
    part = tiny[[*names, "triangle_margin"]]
    figure = picture(part)
    assert figure.axes[0].get_title("left") == "Ω²"
    points = {
        kind: line.get_xdata().size for kind in ("stable_major", "unstable") for line in of_gid(figure.axes[1], kind)
    }
    assert points["unstable"] == ((tiny.regime == 2) & (tiny.triangle_margin >= 0)).sum()
