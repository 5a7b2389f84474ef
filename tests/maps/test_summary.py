import numpy as np
import pytest
import xarray as xr
from maps import BODIES, DEFINITION, TOP

import sweeps
from sweeps import systems
from sweeps.maps import storage, summary, verify
from sweeps.maps.description import MapDescription
from sweeps.maps.selection import nearest_places
from sweeps.schema.datasets import dimensions
from sweeps.schema.iteration import blocks
from sweeps.systems.presentation import agreement
from sweeps.systems.presentation.appearance import Compared
from sweeps.systems.relative_equilibrium.system import REGIMES
from sweeps.systems.rigid_body.presentation.appearance import APPEARANCE
from sweeps.views import report_columns, textmap


@pytest.fixture(scope="module")
def ds():
    return sweeps.survey(DEFINITION)


def test_counts_are_those_of_the_arrays(ds):
    ds = ds.copy(deep=True)
    ds["regime"][0, 0] = 3  # otherwise than by theory
    totals = summary.summarise(ds)
    words = ds.regime.flag_meanings.split()
    for value, word in zip(ds.regime.flag_values, words, strict=True):
        assert totals.counts["regime"][word] == (ds.regime.values == value).sum()
        assert sum(n for (meaning, _), n in totals.table.items() if meaning == word) == totals.counts["regime"][word]
    assert totals.points == ds.regime.size == sum(totals.table.values())
    assert totals.impossible == (ds.triangle_margin.values < 0).sum()
    names = dict(zip(ds.regime.flag_values, words, strict=True))
    theory = dict(zip(ds.regime_theory.flag_values, ds.regime_theory.flag_meanings.split(), strict=True))
    unlike = sum(
        names[m] != theory[t] for m, t in zip(ds.regime.values.flat, ds.regime_theory.values.flat, strict=True)
    )
    assert totals.disagreements == {"regime": unlike}
    table = totals.confusion["regime_theory", "regime"]
    assert table.sum() == ds.regime.size
    expected = {word: (ds.regime_theory.values == value).sum() for value, word in theory.items()}
    assert {word: table[i].sum() for i, word in enumerate(totals.counts["regime_theory"])} == expected


def test_the_worst_stands_where_it_says(ds):
    totals = summary.summarise(ds)
    for name, worst in totals.checks.items():
        assert worst.value == np.nanmax(np.abs(ds[name].values))
        assert abs(ds[name].isel(worst.at).item()) == worst.value
    worst = totals.deviations["growth_rate_theory", "growth_rate"].worst
    point = ds.isel(worst.at)
    assert abs(point.growth_rate / point.growth_rate_theory - 1).item() == pytest.approx(worst.value, rel=1e-6)


def test_blocks_change_nothing(ds, monkeypatch):
    at_once = summary.summarise(ds)
    monkeypatch.setattr(summary, "BLOCK_POINTS", 15)
    assert len(list(blocks(dimensions(ds), 15))) > 10
    by_blocks = summary.summarise(ds)
    for name in ("points", "compared", "counts", "table", "disagreements", "impossible", "checks"):
        assert getattr(by_blocks, name) == getattr(at_once, name)
    for pair, deviation in by_blocks.deviations.items():
        assert deviation.worst == at_once.deviations[pair].worst
        assert (deviation.counts == at_once.deviations[pair].counts).all()


def test_show_and_report_say_the_same_of_one_map(ds):
    """A map with some points that are not ok: both report one worst deviation, by one rule."""
    bad = ds.copy(deep=True)
    bad["status"][0, 0, 0, 0, 0, 0] = 2
    bad["omega_squared"][0, 0, 0, 0, 0, 0] *= 1.5
    by_show = summary.summarise(bad)
    by_report, _, _ = report_columns.read_columns(bad, MapDescription(bad))
    pair = ("omega_squared_theory", "omega_squared")
    assert by_show.deviations[pair].worst == by_report.deviations[pair].worst
    assert by_show.deviations[pair].worst.value < 1e-2
    assert summary.comparison_rule(by_show) == summary.comparison_rule(by_report)
    assert by_show.compared == by_report.compared < by_show.points


def test_flat_bodies_exist():
    ds = sweeps.survey(BODIES)
    assert (ds.triangle_margin == 0).any()
    assert summary.summarise(ds).impossible == 0


def test_a_map_without_regimes_leads_with_what_it_has():
    assert MapDescription(sweeps.survey(TOP)).leading_flag == "sense"


def test_characters_are_the_regimes(ds):
    places = nearest_places(ds, {"omega0": "1", "epsilon": "1e-6"})
    text_map = textmap.draw_map(ds, MapDescription(ds), {dim: places[dim] for dim in ("omega0", "epsilon")})
    assert (text_map.x, text_map.y, [panel.title for panel in text_map.panels]) == (
        "I1",
        "I2",
        ["axis 1", "axis 2", "axis 3"],
    )
    plane = ds.sel(omega0=1.0, epsilon=1e-6).squeeze(drop=True).transpose("axis", "I2", "I1")
    names = dict(zip(ds.regime.flag_values, ds.regime.flag_meanings.split(), strict=True))
    for panel, values in zip(text_map.panels, plane.regime.values, strict=True):
        expected = ["".join(APPEARANCE.mark(names[v]).glyph for v in row) for row in values[::-1]]
        assert [text for _, text in panel.rows] == expected
        assert [label for label, _ in panel.rows] == ["1.4", "1", "0.75"]
    assert set(text_map.legend.values()) <= set(names.values())


def test_a_narrow_terminal_gets_a_thinner_map_with_both_ends():
    ds = sweeps.survey(
        {"grid": {"I1": {"start": 0.5, "stop": 1.5, "num": 201}, "I2": [0.9, 1.1], "I3": 1.0, "omega0": 1.0}}
    )
    for width in (40, 80, 200):
        text_map = textmap.draw_map(ds, MapDescription(ds), {}, width)
        line = "  ".join(panel.rows[0][1] for panel in text_map.panels)
        assert len(line) + len(text_map.panels[0].rows[0][0]) + 1 <= width
        assert text_map.panels[0].ends == ("0.5", "1.5")


def test_equal_panels_are_one(ds):
    equal_map = ds.assign(regime=(ds.regime.dims, ds.regime.isel(axis=[1, 1, 1]).values, ds.regime.attrs))
    equal_panels, all_panels = (textmap.draw_map(each, MapDescription(each), {}) for each in (equal_map, ds))
    assert [panel.title for panel in equal_panels.panels] == ["axis 1 … 3"]
    assert equal_panels.panels[0].rows == all_panels.panels[1].rows


@pytest.mark.parametrize(
    ("count", "total", "words"), [(0, 9, "0 %"), (9, 9, "100 %"), (1, 10**6, "0.1 %"), (1, 3, "33.3 %")]
)
def test_shares_are_0_or_100_only_where_they_are(count, total, words):
    assert summary.format_share(count, total) == words


def test_rates_that_may_be_rounding_are_told_over_their_scale():
    """A stable top's real parts are zero: their rounding over that of theory has no meaning."""
    dims = ("spin_rate", "equilibrium", "eigenvalue")
    real = np.array([[[0.0, 3e-16]], [[-2.0, 2.0]]])
    theory = np.array([[[0.0, -1e-16]], [[-2.0, 2.0 + 4e-9]]])
    regime = np.repeat([1, 2], 2).reshape(2, 1, 2).astype("i1")
    flags = {"flag_values": np.arange(-1, 5, dtype="i1"), "flag_meanings": " ".join(REGIMES)}
    variables = {"eigenvalue_real": real, "eigenvalue_real_theory": theory, "rate_scale": np.full_like(real, 4.0)}
    ds = xr.Dataset({name: (dims, values) for name, values in variables.items()}, attrs={"system": "sleeping_top"})
    ds = ds.assign(regime=(dims, regime, flags), regime_theory=(dims, regime, flags))
    deviation = summary.summarise(ds).deviations["eigenvalue_real_theory", "eigenvalue_real"]
    assert (deviation.scale, deviation.total) == ("rate_scale", 4)
    assert deviation.worst.value == pytest.approx(1e-9)
    deviation = summary.summarise(ds.drop_vars("rate_scale")).deviations["eigenvalue_real_theory", "eigenvalue_real"]
    assert deviation.scale == ""
    assert deviation.worst.value == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("system", "name"),
    [
        ("sleeping_top", "sum_of_squares"),
        ("mathieu", "multiplier_imag"),
        ("pendulum", "omega_squared"),
        ("rigid_body", "omega_squared_reduced"),
        ("pumped_body", "growth_per_period"),
    ],
)
def test_where_theory_is_zero_within_the_error_a_deviation_is_one_over_its_error(system, name):
    theory = np.array([0.0, 1e-17, -3e-17, 2.0])
    values, error = theory + np.array([2e-13, 5.1e-17, 0.0, 4e-9]), np.array([1e-12, 1e-12, 1e-12, 1e-8])
    specs = systems.resolve(system).layout().variables
    spec = specs[name]
    columns = {name: values, spec.theory: theory, spec.error: error}
    ds = xr.Dataset({key: ("x", column) for key, column in columns.items()}, {"x": range(4)}, {"system": system})
    deviation = summary.summarise(ds).deviations[spec.theory, name]
    assert (deviation.total, deviation.num_within, deviation.num_with_error) == (1, 4, 4)
    assert deviation.worst.value == pytest.approx(2e-9)
    assert (deviation.worst_at_zero.at, deviation.worst_at_zero.points) == ({"x": 0}, 3)
    assert deviation.worst_at_zero.value == pytest.approx(0.2)
    compared = agreement.compare(ds, specs, Compared((name,), ""))
    assert compared.max_deviation == pytest.approx(2e-9)  # of the figure


FLIPPING = {
    "bodies": [
        {"name": "racket", "I1": 0.00121, "I2": 0.01638, "I3": 0.01748},
        {"name": "book", "ratios": {"I1": 1.0, "I2": 2.0, "I3": 2.5}},
    ],
    "grid": {"omega0": [1.0, -3.0], "epsilon": [1e-4, 1e-2]},
    "integration": {"flips": True},
}


def test_a_rate_of_nought_is_compared_with_nothing(tmp_path):
    """About the intermediate axis `frequency` is 0, for there is none."""
    ds = sweeps.survey(FLIPPING)
    deviations = summary.summarise(ds).deviations
    stable, unstable = (int((ds[name] > 0).sum()) for name in ("frequency", "growth_rate"))
    assert 0 < stable < ds["frequency"].size
    frequency = deviations["frequency_theory", "frequency"]
    assert frequency.total == frequency.num_with_error == stable
    assert deviations["growth_rate_theory", "growth_rate"].total == unstable
    storage.write_map(ds, tmp_path / "map.nc")
    (check,) = (check for check in verify.verify(tmp_path / "map.nc", points=24) if check.name == "errors")
    assert not check.findings
    assert not check.skip_reason


def test_a_frequency_from_samples_is_not_held_against_that_of_the_whole_motion():
    """At its own amplitude the motion is slower than linear theory, the recurrence of its samples faster: no likes."""
    body = {"name": "Earth", "I1": 8.0101e37, "I2": 8.0103e37, "I3": 8.0365e37}
    earth = {"bodies": [body], "axes": [1], "grid": {"omega0": 1.0, "epsilon": 1e-2}, "integration": {"flips": True}}
    ds = sweeps.survey(earth).squeeze()
    theory = ds["frequency_theory"].item()
    assert ds["frequency"].item() > theory > ds["frequency_exact"].item()
    assert ("frequency_exact", "frequency") not in summary.summarise(sweeps.survey(earth)).deviations


def test_no_second_estimate_and_no_other_motions_law_is_shown_as_theory():
    """The slope of the logarithm is biased by design; the twist's law is valid on the separatrix alone."""
    tables = [systems.resolve(name).layout().variables for name in ("rigid_body", "twist", "pendulum")]
    pairs = {
        (variable.name, reference)
        for table in tables
        for variable in table.values()
        for reference in variable.references
    }
    assert ("growth_rate", "growth_rate_theory") in pairs
    assert ("twist", "twist_exact") in pairs
    assert not [pair for pair in pairs if "logslope" in pair[0] or "defect" in pair[0]]
