"""Energies from two observed periods, with their errors: against mpmath over the triangle, and as a map."""

import itertools
import json
import math
import re

import mpmath
import numpy as np
import precise
import pytest
from calls import run_command
from scipy.special import ndtr

import sweeps
from kernels.events import tumbling
from kernels.free import exact
from sweeps.__main__ import main
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.observed_periods import answers, assignments
from sweeps.systems.observed_periods.system import exclusion

HOUR = 3600.0


def bodies(count, seed=7):
    """Bodies evenly over the triangle I1 <= I2 <= I3 = 1, and its corners and sides nearly."""
    rng = np.random.default_rng(seed)
    x = 1.0 - np.sqrt(rng.random(count)) * 0.999
    y = 1.0 - x * rng.random(count)
    moments = np.sort([x, y], axis=0).T.tolist()
    return [*moments, [1e-6, 1.0 - 5e-7], [0.5, 0.5 + 1e-9], [0.3, 1.0 - 1e-9], [0.5, 0.5001], [0.9999, 0.99995]]


@pytest.mark.parametrize("times", [1.0 + 1e-6, 1.3, 7.0])
def test_the_energy_gives_mpmaths_ratio_back(times):
    count = 0
    for low, middle in bodies(6):
        least_ratio = tumbling.inverse(low, middle, 1.0, 1.0)["least_ratio"][:, 0]
        for k in (tumbling.SAM, tumbling.LAM):
            ratio = times * least_ratio[k]
            energy = float(tumbling.inverse(low, middle, 1.0, ratio)["energy"][k, 0])
            separatrix, end = 1.0 / middle, (1.0, 1.0 / low)[k]
            near = abs(energy - separatrix) / energy
            if near < 1e-6 or abs(energy - end) < 1e-10 * energy or min(middle - low, 1.0 - middle) < 1e-6:
                continue  # near the separatrix the digits of the energy do not determine the ratio
            count += 1
            # 8 roundings of the energy, as the ratio amplifies them near the separatrix and the least wobble
            allowed = 1e-12 + 16 * 2.2e-16 / near + 16 * 2.2e-16 * energy / abs(energy - end) * (times - 1)
            with mpmath.workdps(30):
                psi, phi, *_ = precise.legendre([mpmath.mpf(x) for x in (low, middle, 1)], mpmath.mpf(energy), 1)
                assert float(psi / phi) == pytest.approx(ratio, rel=max(allowed, 1e-10)), (low, middle, k)
    assert count > 6


@pytest.mark.parametrize("unit", [1.0, 3.0])
def test_the_least_ratio_is_that_of_small_oscillations_by_mpmath(unit):
    for low, middle in (np.array(bodies(60)) * unit).tolist():
        with mpmath.workdps(40):
            a, b, c = mpmath.mpf(low), mpmath.mpf(middle), mpmath.mpf(unit)
            wobble3 = mpmath.sqrt((c - a) * (c - b) / (a * b)) / c  # at L = 1, over the spin L/I3
            wobble1 = mpmath.sqrt((c - a) * (b - a) / (b * c)) / a
            # about axis 3 the long axis goes round with spin and wobble; about axis 1 it precesses alone
            short, long = (1 / c) / wobble3, (1 / a - wobble1) / wobble1
        least_ratio = tumbling.inverse(low, middle, unit, 1.0)["least_ratio"][:, 0]
        # a dozen roundings: differences of nearly equal moments are exact in any unit
        assert least_ratio == pytest.approx([float(short), float(long)], rel=4e-15)


@pytest.mark.parametrize(
    ("low", "middle"), [(0.6, 0.6), (0.5, 0.5), (0.999, 0.999), (0.2, 1.0), (1e-6, 1.0), (0.999, 1.0)]
)
def test_a_symmetric_body_has_the_one_mode_of_its_cone(low, middle):
    """Of a top P_psi and P_phi are elementary: nutation angle theta, P_phi = 2 pi I/L of the equatorial moment."""
    oblate = low == middle
    least_ratio = tumbling.inverse(low, middle, 1.0, 1.0)["least_ratio"][:, 0]
    mode, absent_mode = (tumbling.SAM, tumbling.LAM) if oblate else (tumbling.LAM, tumbling.SAM)
    assert math.isinf(least_ratio[absent_mode])
    for times in (1.0 + 1e-9, 1.5, 40.0):
        ratio = times * least_ratio[mode]
        inverse = tumbling.inverse(low, middle, 1.0, ratio)
        energy = float(inverse["energy"][mode, 0])
        assert math.isnan(inverse["energy"][absent_mode, 0])
        axial, equatorial = (1.0, low) if oblate else (low, 1.0)
        cosine2 = (energy - 1.0 / equatorial) / (1.0 / axial - 1.0 / equatorial)
        psi = math.sqrt(cosine2) / axial * abs(axial / equatorial - 1.0)  # rate of omega in the body, L = 1
        # the digits of the energy limit the angle, and its small difference from 0 at the least ratio
        allowed = 1e-7 if times < 1.1 else 1e-11 + 1e-15 / (cosine2 * abs(1.0 / axial - 1.0 / equatorial))
        # the long axis of an oblate body lies in its equator: it goes round with the cone, less the wobble
        about = 1.0 / equatorial - psi if oblate else 1.0 / equatorial
        assert about / psi == pytest.approx(ratio, rel=allowed)


DRAWN = [(1.0, 6.58, 8.67, 2.0, 3.0), (2.5, 4.0, 2.0, 1.0, 0.0), (3.0, 4.0, 2.0, 0.0, 0.5), (0.2, 1.0, 9.0, 0.3, 2.0)]


@pytest.mark.parametrize(("least_ratio", "P_psi", "P_phi", "sigma_psi", "sigma_phi"), DRAWN)
def test_sigma_is_that_of_drawn_periods(least_ratio, P_psi, P_phi, sigma_psi, sigma_phi):
    """The share of Gaussian periods that a mode allows is the normal tail of the exclusion: nothing is linearised."""
    psi, phi = np.random.default_rng(11).normal((P_psi, P_phi), (sigma_psi, sigma_phi), (400_000, 2)).T
    sigma = float(exclusion(np.float64(least_ratio), P_psi, P_phi, sigma_psi, sigma_phi))
    assert sigma > 0
    assert np.mean(psi > least_ratio * phi) == pytest.approx(ndtr(-sigma), abs=5 * math.sqrt(0.25 / 400_000))


@pytest.mark.parametrize(
    ("least_ratio", "periods", "sigma"),
    [
        (1.0, (2.0, 1.0, 0.0, 0.0), 0.0),
        (1.0, (1.0, 2.0, 0.0, 0.0), math.inf),
        (1.0, (1.0, 2.0, 0.5, 0.0), 2.0),
        (1.0, (1.0, 2.0, 0.0, 0.5), 2.0),
        (2.0, (1.0, 2.0, 0.0, 0.5), 3.0),
        (math.inf, (1.0, 2.0, 0.5, 0.5), math.inf),
        (math.inf, (1.0, 2.0, 0.5, 0.0), math.inf),
    ],
)
def test_one_sigma_or_none(least_ratio, periods, sigma):
    assert float(exclusion(np.float64(least_ratio), *map(np.float64, periods))) == sigma


# ---------------------------------------------------------------------------------------------------------
# On the command line


OUMUAMUA = ("--P-psi", 6.58, "--P-phi", 8.67)
FLAT = ((0.3, 0.7), (0.1, 0.9), (0.333333333, 0.666666667))
SHORT, LONG, WITHIN = "short-axis mode: ", "long-axis mode: ", "possible within the errors: "
VERDICTS = [
    ((), SHORT + "excluded: P_psi/P_phi = 0.758939, but for any body this ratio exceeds 1"),
    (("--sigma-phi", 0.34), SHORT + "excluded at 6.1σ: "),
    (("--sigma-psi", 2, "--sigma-phi", 3), SHORT + WITHIN + "0.58σ from the limit of small wobbles"),
    (("--ratios", 0.3, 0.9), LONG + "2T I3/L² = "),
    (("--ratios", 0.5, 0.9), LONG + "excluded: P_psi/P_phi = 0.758939, but for this body this ratio exceeds 1.12132"),
    (("--ratios", 0.5, 0.9, "--sigma-psi", 1), LONG + "excluded at 3.1σ: "),
    (("--ratios", 0.5, 0.9, "--sigma-psi", 2), LONG + WITHIN + "1.6σ from the limit of small wobbles"),
    (("--ratios", 0.5, 0.9, "--sigma-phi", 1), LONG + WITHIN + "2.8σ from the limit of small wobbles"),
    (("--ratios", 0.3, 1.0), SHORT + "excluded: a symmetric body has no such mode"),
    (("--P-psi", 1000, "--P-phi", 1), LONG + "possible for 100 % of all shapes"),
    (("--P-psi", 48, "--P-phi", 1, "--ratios", 0.5, 0.9), "m = 1, too near the separatrix for L/I3"),
    *((("--P-psi", 4, "--P-phi", 2, "--ratios", *flat), SHORT + "2T I3/L²") for flat in FLAT),
]


@pytest.mark.parametrize(("options", "words"), VERDICTS)
def test_the_verdict_uses_the_errors(capsys, options, words):
    assert words in run_command(capsys, "tumbler", *OUMUAMUA, *options)


def test_krylov_on_the_command_line_and_in_python(capsys):
    command = ("tumbler", "--P-psi", 368.7, "--P-phi", 67.27, "--unit", "h", "--ratios", 0.96, 0.36, "--sigma-phi", 0.1)
    assert main([*map(str, command), "--json"]) == 0
    text, note = capsys.readouterr()
    output = json.loads(text)
    assert note.endswith("--ratios: taken as I1/I3 = 0.36, I2/I3 = 0.96: I1 is the least moment\n")
    assert "--ratios" not in run_command(capsys, "tumbler", *OUMUAMUA, "--ratios", 0.36, 0.96)
    modes = sweeps.tumbler(368.7, 67.27, ratios=(0.36, 0.96), sigma_phi=0.1)
    assert output == modes
    short = modes[0]
    assert (short["mode"], short["verdict"], short["sigma"]) == ("sam", "possible", 0.0)
    assert short["energy"] == pytest.approx(1.0338, abs=5e-5)
    energies = [sweeps.tumbler(368.7, 67.27 + by, ratios=(0.36, 0.96))[0]["energy"] for by in (-0.1, 0.1)]
    assert short["energy_stderr"] == pytest.approx(0.5 * abs(energies[1] - energies[0]), rel=0.02)
    # the energy gives back both periods
    grid = {"I1": 0.36, "I2": 0.96, "I3": 1.0, "energy": short["energy"], "omega0": short["omega0"]}
    back = sweeps.survey({"system": "tumbling", "grid": grid}).squeeze()
    assert float(back["period_psi"]) / HOUR == pytest.approx(368.7, rel=1e-9)
    assert float(back["period_phi_long_axis"]) / HOUR == pytest.approx(67.27, rel=1e-9)


IMPOSSIBLE = "of any rigid body: I3 = 1 > I1 + I2 = "


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--P-psi -1 --P-phi 2", "P_psi: -1 is out of range"),
        ("--P-psi 1 --P-phi 2 --sigma-psi -1", "sigma_psi: -1 is out of range"),
        ("--P-psi 1 --P-phi 1 --sigma-psi 1e308s", "sigma_psi: '1e308s' is out of range"),
        ("--P-psi 1 --P-phi 2 --ratios 0.4 1.2", "I2/I3 1.2 is out of range; allowed: a number in (0, 1]"),
        ("--P-psi 1 --P-phi 2 --ratios 0.1 0.3", IMPOSSIBLE + "0.4; allowed: moments"),
        ("--P-psi 1 --P-phi 2 --ratios 0.5 0.3", IMPOSSIBLE + "0.8; allowed: moments"),
        ("--P-psi 1 --P-phi 2 --unit years", "unit: 'years' is not available; allowed: s, min, h, d"),
        ("--P-psi 1 --P-phi 2 --ratios 0.5 0.9 -o x.nc", "--ratios: is given together with"),
    ],
)
def test_periods_and_ratios_that_cannot_be_are_named(capsys, arguments, message):
    assert message in run_command(capsys, "tumbler", *arguments.split(), status=2)


@pytest.mark.parametrize(
    "settings",
    [
        *({"ratios": (0.5,)}, {"ratios": "ab"}, {"P_phi": 10**400}, {"unit": ["h"]}),
        *({"convention": "other"}, {"convention": "short"}, {"sigma_ratios": (0.1, -1)}),
    ],
)
def test_settings_that_cannot_be_are_named(settings):
    with pytest.raises(DefinitionError, match="allowed: "):
        sweeps.tumbler(**{"P_psi": 1.0, "P_phi": 2.0, "ratios": (0.5, 0.9)} | settings)


# ---------------------------------------------------------------------------------------------------------
# Angles, errors of ratios, conventions, unknown lines


@pytest.mark.parametrize(("mode", "energy"), [("sam", 1.2), ("lam", 1.3)])
def test_the_nutation_is_that_of_the_motion(mode, energy):
    moments = np.array([0.4, 0.8, 1.0])
    m1 = math.sqrt((energy - 1) * 0.4 / (1 - 0.4))  # the angular momentum is 1
    omega = exact.rotation(moments, [m1, 0, math.sqrt(1 - m1**2)] / moments, np.linspace(0.0, 30.0, 30_001))
    angles = np.arccos(0.4 * omega[:, 0])
    # the extremes are missed by half a step of 0.001 at most, in which an angle changes by 1e-6 near its extreme
    assert answers.nutation((0.4, 0.8), energy, mode) == pytest.approx((angles.min(), angles.max()), abs=1e-6)


def test_the_short_axis_convention_is_that_of_the_encircled_axis():
    point = {"I1": [0.36], "I2": [0.96], "I3": [1.0], "energy": [1.02], "omega0": [1.0]}
    rows = tumbling.survey({name: np.array(value) for name, value in point.items()}, 1e-10, measured=False)
    psi, long, short = (rows[f"period_{name}_exact"].item() for name in ("psi", "phi_long_axis", "phi_encircled"))
    (first, _), (second, _) = (
        sweeps.tumbler(f"{psi} s", f"{phi} s", ratios=(0.36, 0.96), convention=convention)
        for phi, convention in ((long, "long"), (short, "short"))
    )
    # a dozen roundings, as the least wobble amplifies them
    assert first["energy"] == pytest.approx(1.02, rel=1e-10)
    assert second["energy"] == pytest.approx(1.02, rel=1e-10)
    assert first["P_phi_short_axis"] == pytest.approx(short, rel=1e-12)


def test_the_error_of_the_energy_is_that_of_drawn_ratios():
    rng = np.random.default_rng(8)
    errors = (0.01, 0.004)
    drawn = rng.normal((0.36, 0.9), errors, (400, 2))
    energies = [sweeps.tumbler(368.7, 67.27, ratios=tuple(pair))[0]["energy"] for pair in drawn.tolist()]
    row = sweeps.tumbler(368.7, 67.27, ratios=(0.36, 0.9), sigma_ratios=errors)[0]
    # 400 draws have a standard deviation to 3.5 %, and the energy is curved
    assert row["energy_stderr"] == pytest.approx(np.std(energies), rel=0.15)
    excluded = sweeps.tumbler(6.58, 8.67, ratios=(0.5, 0.9))[1]
    assert excluded["sigma"] == math.inf
    assert sweeps.tumbler(6.58, 8.67, ratios=(0.5, 0.9), sigma_ratios=(0.1, 0.05))[1]["verdict"] == "within_errors"


def test_unknown_lines_have_the_true_periods_among_them(capsys):
    for lines in itertools.permutations(assignments.LINES, 2):
        (first, second) = (n / 67.27 + k / 368.7 for n, k in map(assignments.LINES.get, lines))
        if first <= 0 or second <= 0 or lines in (("2 f_psi", "f_psi"), ("f_psi", "2 f_psi")):
            continue
        periods = answers.TwoPeriods(1 / first, 1 / second)
        pair = assignments.convert_periods(periods, lines)
        if pair is not None:  # two lines of one frequency alone determine nothing
            assert (pair.P_psi, pair.P_phi) == pytest.approx((368.7, 67.27), rel=1e-9)
    command = ("tumbler", "--P-psi", 67.27 / 2, "--P-phi", 368.7, "--convention", "unknown", "--ratios", 0.36, 0.96)
    pairs = json.loads(run_command(capsys, *command, "--json"))
    (pair,) = [each for each in pairs if abs(each["P_psi"] - 368.7) < 1e-6 and abs(each["P_phi"] - 67.27) < 1e-6]
    assert pair["lines"] == ["2 f_phi", "f_psi"]
    assert pair["modes"][0]["energy"] == pytest.approx(1.0338, abs=5e-5)
    assert "(lines 2 f_phi, f_psi)" in run_command(capsys, *command)


def test_the_error_of_a_combination_is_that_of_drawn_periods():
    rng = np.random.default_rng(9)
    periods = answers.TwoPeriods(10.0, 7.0, 0.01, 0.02)
    lines = ("f_phi + f_psi", "2 f_phi - f_psi")
    pair = assignments.convert_periods(periods, lines)
    drawn = [
        assignments.convert_periods(answers.TwoPeriods(*each), lines)
        for each in rng.normal((10, 7), (0.01, 0.02), (4000, 2))
    ]
    spread = np.std([each.P_psi / each.P_phi for each in drawn]) * pair.P_phi / pair.P_psi
    # 4,000 draws have a standard deviation to 1.1 %
    assert math.hypot(pair.sigma_psi / pair.P_psi, pair.sigma_phi / pair.P_phi) == pytest.approx(spread, rel=0.05)


# ---------------------------------------------------------------------------------------------------------
# Maps of observed periods


@pytest.mark.slow
def test_the_file_is_a_map_like_any_other(capsys, tmp_path):
    path, picture = tmp_path / "map.nc", tmp_path / "map.png"
    words = run_command(capsys, "tumbler", *OUMUAMUA, "--sigma-phi", 0.34, "-o", path, "--figure", picture)
    assert "long-axis mode: possible for 30 % of all shapes" in words
    assert picture.stat().st_size > 10_000
    assert re.search(r"long-axis mode +2,542", run_command(capsys, "show", path))
    at = ("--I1_over_I3", 0.2, "--thickness", 0.5)
    point = json.loads(run_command(capsys, "point", path, *at, "--json"))["variables"]
    (row,) = [row for row in sweeps.tumbler(6.58, 8.67, sigma_phi=0.34, ratios=(0.2, 0.9)) if row["mode"] == "lam"]
    assert point["modes"]["value"] == "lam"
    assert point["energy_lam"]["value"] == pytest.approx(row["energy"], rel=1e-12)
    assert point["exclusion_sam"]["value"] > 3
    assert "differs" not in run_command(capsys, "verify", path, "--points", 40)
    with sweeps.open_map(path) as ds:
        assert ds["P_psi"].item() == 6.58 * HOUR
        np.testing.assert_array_equal(ds["energy_lam"], sweeps.tumbler(6.58, 8.67, sigma_phi=0.34)["energy_lam"])


def test_a_definition_of_observed_periods_is_swept(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "system: observed_periods\nbodies: [{name: Krylov, ratios: {I1: 0.36, I2: 0.96, I3: 1.0}}]\n"
    (tmp_path / "mine.yaml").write_text(
        text + "grid: {P_psi: [1.0e+5, 1.32732e+6], P_phi: 242172.0, sigma_psi: [0, 1.8e+4]}\n"
    )
    ds = sweeps.survey("mine.yaml").squeeze()
    assert ds["modes"].sel(P_psi=1e5).values.tolist() == [0, 2]  # the long-axis mode at 2.3 sigma
    assert ds["modes"].sel(P_psi=1.32732e6).values.tolist() == [3, 3]
    energy = sweeps.tumbler(368.7, 67.27, ratios=(0.36, 0.96))[0]["energy"]
    assert float(ds["energy_sam"].sel(P_psi=1.32732e6, sigma_psi=0)) == pytest.approx(energy, rel=1e-12)
    assert float(ds["energy_sam_stderr"].sel(P_psi=1.32732e6, sigma_psi=0)) == 0.0
    assert float(ds["energy_sam_stderr"].sel(P_psi=1.32732e6, sigma_psi=1.8e4)) > 0.0
    (tmp_path / "none.yaml").write_text("system: observed_periods\ngrid: {I1: 1, I2: 2, I3: 2.5, P_phi: 1}\n")
    assert "grid.P_psi: is missing" in run_command(capsys, "check", "none.yaml", status=2)
