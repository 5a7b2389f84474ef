"""The check cases that ship, against mpmath, NASA's published numbers, and `certify`; their files in three formats.

Every row is made again in 60 digits, and every format read again, for some cases, with POLHODE_ALL_CASES=1 for all.
"""

import os
from decimal import Decimal
from fractions import Fraction

import check_cases as made
import mpmath as mp
import numpy as np
import precise
import pytest
import xarray as xr

import sweeps
from sweeps.__main__ import main
from sweeps.maps import motion
from sweeps.reading.attitude_files import AttitudeMessage
from sweeps.reading.files import FileBytes
from sweeps.systems.rigid_body import check_cases

CASES = {case.name: case for case in made.CASES}
NAMES = list(CASES)
ALL_CASES = bool(os.environ.get("POLHODE_ALL_CASES"))
COLUMNS = ["q0", "q1", "q2", "q3", "omega1", "omega2", "omega3"]


shipped = pytest.fixture(lambda: dict(check_cases.motions()), scope="module")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cases") / "all"
    assert main(["cases", "-o", str(folder)]) == 0
    return folder


def values(case):
    return np.stack([case[name].values for name in COLUMNS], 1)


def test_thirteen_cases_begin_at_numbers_exact_in_decimal_and_binary(shipped):
    mp.mp.dps = made.DIGITS
    assert list(shipped) == NAMES
    assert len(NAMES) == 13
    assert check_cases.PATH.stat().st_size < 2e6
    for name, case in CASES.items():
        for text, key in zip((*case.moments, *case.omega), ("I1", "I2", "I3", *COLUMNS[4:]), strict=True):
            assert Decimal(text) == Decimal(float(text)), name
            assert float(text) == shipped[name][key].values.flat[0]
        times = shipped[name].time.values
        assert [Fraction(t) for t in times[[1, 500, 1000]]] == [made.step_of(case) * k for k in (1, 500, 1000)]
        assert len(times) == 1001
        assert made.span(case) <= times[-1] < 1.1 * made.span(case)
        assert values(shipped[name])[0, :4].tolist() == [1.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("name", NAMES)
def test_rows_are_those_of_mpmath_rounded(name, shipped):
    mp.mp.dps = made.DIGITS
    case = CASES[name]
    chosen = [0, 1, 333, 1000]
    times = [made.times_of(case)[k] for k in chosen]
    stored = values(shipped[name])[chosen]
    degrees = mp.pi / 180 if case.unit == "deg s-1" else 1
    for form in made.closed_forms(case):
        for row, expected in zip(form(*made.start_of(case), times), stored, strict=True):
            sign = 1 if sum(float(x) * y for x, y in zip(row[:4], expected[:4], strict=True)) > 0 else -1
            computed = [sign * x for x in row[:4]] + [x / degrees for x in row[4:]]
            for x, y in zip(computed, expected, strict=True):
                # rounding to a double; the digits asked for
                assert abs(x - mp.mpf(float(y))) <= 2.0**-53 * abs(y) + 1e-40


def test_parameters_are_those_that_the_titles_give():
    mp.mp.dps = made.DIGITS
    for name, complement in {"separatrix_2": 1e-2, "separatrix_6": 1e-6, "separatrix_12": 1e-12}.items():
        m1 = precise.Textbook(*made.start_of(CASES[name])).m1
        assert float(m1) == pytest.approx(complement / (1 + complement), rel=1e-14)  # rounding of one number


def test_the_brick_is_nasas(shipped):
    """Rates and attitude after 30 s as three foreign programs computed them from NASA's check case 2."""
    row = values(shipped["brick"])[160]
    assert shipped["brick"].time[160] == 30.0
    q = [-0.881147185310424, 0.470182527766693, 0.0117282523248712, 0.0486875394720838]
    np.testing.assert_allclose(row[:4] * np.sign(row[0] * q[0]), q, atol=1e-15)  # printed digits
    rates = [12.6183907759142, -17.3974747616114, 31.1195888869443]
    np.testing.assert_allclose(row[4:], rates, atol=6e-14)  # printed digits


EACH_MODE = ["sphere", "separatrix_12", "short_axis", "long_axis", "brick"]  # the rates of the brick are in degrees


@pytest.mark.parametrize("name", NAMES if ALL_CASES else EACH_MODE)
def test_every_format_holds_the_same_bits_and_passes(name, folder, shipped):
    expected, time = values(shipped[name]), shipped[name].time.values
    with xr.open_dataset(folder / f"{name}.nc") as read:
        np.testing.assert_array_equal(values(read), expected)
        np.testing.assert_array_equal(read.time, time)
        conditioning = read.conditioning_rad.item()
        assert read.error_bound_rad < 1e-12
    table = np.genfromtxt(folder / f"{name}.csv", delimiter=",", names=True, deletechars="")
    columns = [next(full for full in table.dtype.names if full.startswith(column)) for column in COLUMNS]
    np.testing.assert_array_equal(np.stack([table[column] for column in columns], 1), expected)
    assert f"\nCOMMENT I3 = {float(CASES[name].moments[2]):.17g} " in (folder / f"{name}.aem").read_text()
    with FileBytes(folder / f"{name}.aem") as file:
        (rows,) = AttitudeMessage(file).read_rows(range(8))
    np.testing.assert_array_equal(rows[:, 0], time)
    np.testing.assert_array_equal(rows[:, [4, 1, 2, 3]], expected[:, :4])
    unit = shipped[name].omega1.units
    np.testing.assert_array_equal(rows[:, 5:], expected[:, 4:] if unit == "deg s-1" else np.degrees(expected[:, 4:]))
    for suffix in motion.FORMATS:
        facts = sweeps.certify(folder / f"{name}{suffix}", [float(x) for x in CASES[name].moments]).attrs
        assert facts["verdict"] == "pass", suffix
        assert facts["diagnosis"] == ["none"]
        assert {entry.partition("=")[0] for entry in facts["columns"]} == {"time", "attitude", "rates"}
        # The kernels' rounding, and in a message that of rates in deg/s: less than what the start's digits leave open
        # times ten.
        assert facts["attitude_error_max_rad"] < 10 * conditioning
        if suffix == ".nc":
            assert facts["conditioning_rad"] == pytest.approx(conditioning, rel=0.3)  # differences of roundings


def test_the_table_lists_them(folder, shipped):
    lines = (folder / "cases.csv").read_text(encoding="utf-8").splitlines()
    assert [line.split(",")[0] for line in lines[1:]] == NAMES
    start = lines[1 + NAMES.index("separatrix_12")].split(",")
    assert start[1:8] == ["1", "2", "3", "9.5367431640625e-07", "0.95367431640625", "0", "rad s-1"]
    files = ["cases.csv", *(f"{name}{suffix}" for name in NAMES for suffix in motion.FORMATS)]
    assert sorted(path.name for path in folder.iterdir()) == sorted(files)


def test_cases_are_written_all_or_not_at_all(tmp_path, monkeypatch, capsys):
    (tmp_path / "file").write_text("mine")
    assert main(["cases", "-o", str(tmp_path / "file")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    write, written = motion.write_motion, []

    def fails(case, path):
        written.append(path)
        if len(written) > 20:
            raise OSError(28, "No space left on device", str(path))
        write(case, path)

    monkeypatch.setattr(motion, "write_motion", fails)
    assert main(["cases", "-o", str(tmp_path / "cases")]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES if ALL_CASES else ["sphere", "separatrix_2"])
def test_every_row_is_made_again(name, shipped):
    """All 1,001 rows by a Taylor series, with which the closed forms agree to 40 digits at each 50th row."""
    rows, apart = made.make(CASES[name], stride=50)
    assert apart < 1e-40
    np.testing.assert_array_equal(np.array(rows, dtype=np.float64), values(shipped[name]))
