"""Verdicts, errors and conditioning of `certify`, the command, and NASA's check case 2."""

import json
import os
import re
import shlex
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import planted_faults
import pytest
from calls import refusal_message
from scipy.spatial.transform import Rotation
from trajectories import BRICK, BRICK_START, exact_rows, integrate_rows, split_rows, table, write_csv

import sweeps
from sweeps.__main__ import main
from sweeps.certification import diagnosis
from sweeps.certification.reference import EARTH_RATE

FOLDER = os.environ.get("POLHODE_NESC_CASE_2", "")  # the folder Atmos_02_TumblingBrickNoDamping of nasa/simupy-flight
MOMENTS = ["--moments", *map(str, BRICK)]
TIMES = np.linspace(0.0, 30.0, 61)


def write_drifting_table():
    """The brick relative to north-east-down, as NASA's tools print it."""
    motion = exact_rows(BRICK, BRICK_START, TIMES)
    longitude = np.degrees(1e-9 * TIMES**3)
    turns = np.column_stack([EARTH_RATE * TIMES + np.radians(longitude), np.full(TIMES.size, -np.pi / 2)])
    frame = Rotation.from_euler("ZY", turns)
    attitude = Rotation.from_quat(motion["q"], scalar_first=True)
    angles = (frame.inv() * frame[0] * attitude).as_euler("ZYX", degrees=True).T
    names = ["Yaw", "Pitch", "Roll"]
    columns = {"time": TIMES, "longitude_deg": longitude, "latitude_deg": 0 * TIMES}
    columns |= {f"eulerAngle_deg_{name}": column for name, column in zip(names, angles, strict=True)}
    rates = np.degrees(motion["w"]).T
    return columns | {f"bodyAngularRateWrtEi_deg_s_{n}": c for n, c in zip(names[::-1], rates, strict=True)}


def test_a_local_frame_turns_with_the_earth(tmp_path, capsys):
    path = str(write_csv(tmp_path / "brick.csv", write_drifting_table()))
    assert main(["certify", path, *MOMENTS, "--frame", "local", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["verdict"] == "pass"
    assert facts["attitude_error_max_rad"] < 1e-13  # roundings of degrees, 30 s of motion
    # as if the local frame did not turn, the attitude is off by its rotation; with an axis of its own by the fall alone
    options = {"frame": "local", "frame_axis": [1, 0, 0]}
    for frame, error in (({}, EARTH_RATE * 30 + 1e-9 * 30**3), (options, 1e-9 * 30**3)):
        facts = sweeps.certify(write_drifting_table(), BRICK.tolist(), tolerance=0.01, **frame).attrs
        assert facts["attitude_error_end_rad"] == pytest.approx(error, rel=1e-6)


@pytest.mark.skipif(not FOLDER, reason="POLHODE_NESC_CASE_2 names no folder with NASA's files")
@pytest.mark.parametrize(("number", "degrees", "words"), [
    (1, 2.24e-9, {"none"}), (2, 3.71, {"kinematics", "first_order"}), (4, 5.22e-9, {"none"}),
    (5, 7.89e-5, {"energy_drift"}), (6, 2.83e-3, {"staggered"}),
])  # fmt: skip
def test_nasas_check_case_2(number, degrees, words, capsys):
    """Errors at 30 s. That of the first file is 3.49e-9 from the nominal start, and less from its own first row."""
    path = str(Path(FOLDER) / f"Atmos_02_sim_{number:02}.csv")
    status = main(["certify", path, *MOMENTS, "--frame", "local", "--json"])
    facts = json.loads(capsys.readouterr().out)
    assert status == (0 if facts["verdict"] == "pass" else 3)
    assert np.degrees(facts["attitude_error_end_rad"]) == pytest.approx(degrees, rel=5e-3)
    assert facts["diagnosis"][0] in words


def test_errors_are_those_of_the_file():
    motion = exact_rows(BRICK, BRICK_START, TIMES)
    error = Rotation.from_rotvec(np.outer(1e-4 * TIMES, [0.6, 0.0, 0.8]))
    motion["q"] = (error * Rotation.from_quat(motion["q"], scalar_first=True)).as_quat(scalar_first=True)
    facts = sweeps.certify(table(motion), BRICK.tolist(), tolerance=1e-3).attrs
    assert facts["verdict"] == "fail"
    assert facts["attitude_error_max_rad"] == pytest.approx(3e-3, rel=1e-9)
    assert facts["attitude_error_end_rad"] == pytest.approx(3e-3, rel=1e-9)
    assert facts["attitude_error_passes_tolerance_s"] == pytest.approx(10.5)
    assert facts["rates_error_max_relative"] < 1e-14
    assert (facts["growth_kind"], facts["growth_coefficient"]) == ("linear", pytest.approx(1e-4, rel=1e-6))
    assert facts["energy_error_relative"] < 1e-14
    # in the inertial frame L rotates with the error, except its component along the axis
    L = BRICK * BRICK_START / np.linalg.norm(BRICK * BRICK_START)
    along = L @ [0.6, 0.0, 0.8]
    assert facts["momentum_direction_error_rad"] == pytest.approx(3e-3 * np.sqrt(1 - along**2), rel=1e-5)


def test_attitudes_alone_have_their_rates_fitted_and_rates_alone_are_judged_by_rates():
    motion = exact_rows(BRICK, BRICK_START, TIMES)
    attitudes, rates = (sweeps.certify(table({"t": TIMES, x: motion[x]}), BRICK.tolist()).attrs for x in "qw")
    assert (attitudes["start"], attitudes["verdict"], rates["verdict"]) == ("rates_fitted", "pass", "pass")
    assert attitudes["attitude_error_max_rad"] < 1e-12
    assert "rates_error_max_relative" not in attitudes
    assert rates["rates_error_max_relative"] < 1e-14
    assert not {"attitude_error_max_rad", "conditioning_rad"} & rates.keys()
    assert 1e-16 < rates["conditioning_rates_relative"] < 1e-13


def test_fit_start_fits_the_start_and_says_so():
    motion = exact_rows(BRICK, BRICK_START, TIMES)
    motion["w"][0] *= 1 + 1e-5
    first, fitted = (
        sweeps.certify(table(motion), BRICK.tolist(), tolerance=0.01, fit_start=fit).attrs for fit in (False, True)
    )
    assert (first["start"], fitted["start"]) == ("first_row", "fitted")
    assert first["attitude_error_end_rad"] > 1e-4
    assert fitted["attitude_error_end_rad"] < 1e-6


def spread(start, step):
    """The largest angle between the brick's motion from a start and those from a step off in each component."""
    reference = Rotation.from_quat(exact_rows(BRICK, start, TIMES)["q"], scalar_first=True)
    neighbours = [exact_rows(BRICK, start + change, TIMES)["q"] for change in step * np.vstack([np.eye(3), -np.eye(3)])]
    return max((reference.inv() * Rotation.from_quat(q, scalar_first=True)).magnitude().max() for q in neighbours)


@pytest.mark.parametrize("is_single", [False, True])
@pytest.mark.parametrize(("engine", "tolerance"), [
    (integrate_rows, 1e-8), (partial(integrate_rows, method="RK45", rtol=1e-9), 1e-6), (split_rows, 3e-4),
])  # fmt: skip
def test_sound_files_of_three_engines_pass(engine, tolerance, is_single):
    ((moments, start, q0, _),) = planted_faults.bodies(1)
    run = table(engine(moments, start, q0, np.linspace(0.0, 4.0, 10)))
    if is_single:  # 2 ulp of the rates over 4 rad of motion, amplified some tenfold
        run = {name: column if name == "time" else column.astype(np.float32) for name, column in run.items()}
        tolerance = max(tolerance, 2e-4)
    facts = sweeps.certify(run, moments.tolist(), tolerance=tolerance).attrs
    assert (facts["verdict"], facts["diagnosis"]) == ("pass", ["none"])
    assert facts["attitude_error_max_rad"] > 1e-14  # it is an engine's


@pytest.mark.parametrize(("digits", "unit"), [(4, 1e-4), (6, 1e-6), (9, 1e-9)])
def test_conditioning_is_the_spread_of_motions_within_half_a_unit_of_the_last_digit(digits, unit, tmp_path):
    motion = exact_rows(BRICK, BRICK_START, TIMES)
    path = write_csv(tmp_path / "run.csv", table(motion), f"%.{digits}f")
    facts = sweeps.certify(path, BRICK.tolist(), tolerance=1e-12).attrs
    start = np.round(motion["w"][0], digits)
    assert facts["conditioning_rad"] == pytest.approx(spread(start, unit / 2), rel=1e-6)
    assert facts["verdict"] == "ill_conditioned"
    assert "ill-conditioned" in facts["warning"]


def test_conditioning_of_doubles_is_two_ulp_and_of_single_precision_its_own():
    motion = exact_rows(BRICK, BRICK_START, TIMES)
    facts = sweeps.certify(table(motion), BRICK.tolist()).attrs
    single = {name: column.astype(np.float32) for name, column in table(motion).items()}
    single = sweeps.certify(single | {"time": TIMES}, BRICK.tolist()).attrs
    assert 1e-15 < facts["conditioning_rad"] < 2e-14
    start = np.float32(motion["w"][0]).astype(float)
    expected = spread(start, 2 * float(np.spacing(np.float32(np.linalg.norm(start)))))
    assert single["conditioning_rad"] == pytest.approx(expected, rel=1e-6)


def test_an_ill_conditioned_file_warns_and_leaves_with_0(tmp_path, capsys):
    start = [1.2e-8, 1.0, 0.9e-8]  # about the intermediate axis: the second flip is lost in the 8 digits
    motion = exact_rows([1.0, 2.0, 3.0], start, np.linspace(0, 120, 500))
    path = write_csv(tmp_path / "run.csv", table(motion), "%.8f")
    assert main(["certify", str(path), "--moments", "1", "2", "3", "--json"]) == 0
    output = capsys.readouterr()
    facts = json.loads(output.out)
    assert facts["verdict"] == "ill_conditioned"
    assert facts["warning"] in output.err
    assert facts["conditioning_rad"] > 1


def test_a_quaternion_that_is_not_unit_fails():
    motion = exact_rows(BRICK, BRICK_START, TIMES)
    motion["q"] *= np.linspace(1.0, 1.01, TIMES.size)[:, None]
    facts = sweeps.certify(table(motion), BRICK.tolist()).attrs
    assert facts["attitude_error_max_rad"] < 1e-13
    assert facts["verdict"] == "fail"
    assert sweeps.certify(table(motion), BRICK.tolist(), tolerance=0.02).attrs["verdict"] == "pass"


def test_the_dataset_can_be_stored(tmp_path):
    ds = sweeps.certify(table(exact_rows(BRICK, BRICK_START, TIMES)), BRICK.tolist())
    ds.to_netcdf(tmp_path / "answer.nc")
    assert set(ds.data_vars) >= {"attitude_error", "rates_error", "omega1", "q0"}


PAGE = (Path(sweeps.__file__).parent / "handbook/text/howto/certify.md").read_text(encoding="utf-8")


def test_the_page_works_as_typed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = re.search(r"```sh\n(.*?)```", PAGE, re.DOTALL)[1].splitlines()
    for line in lines:
        assert main(shlex.split(line)[1:]) == 0
    assert (tmp_path / "errors.png").read_bytes()[:4] == b"\x89PNG"
    suite = ElementTree.parse(tmp_path / "certify.xml").getroot()
    assert (suite.tag, suite.get("tests"), suite.get("failures")) == ("testsuite", "1", "0")
    names = {}
    exec(re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)[1], names)
    names["test_free_rotation"]()


def test_every_word_of_the_page_is_one_that_the_diagnosis_has():
    source = "".join(path.read_text(encoding="utf-8") for path in Path(diagnosis.__file__).parent.glob("*.py"))
    words = re.findall(r"`(\w+)`", PAGE.partition("## The diagnosis")[2].partition("## In a test")[0])
    assert [word for word in words if word != "evidence" and f'"{word}"' not in source] == []
    assert len(set(words)) == 25  # `evidence` and the closed list without `none` and `unknown`


def test_junit_of_a_failed_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    motion = exact_rows(BRICK, BRICK_START, TIMES)
    write_csv(tmp_path / "run.csv", table(motion | {"w": -motion["w"]}))
    assert main(["certify", "run.csv", *MOMENTS, "--junit", "certify.xml"]) == 3
    suite = ElementTree.parse(tmp_path / "certify.xml").getroot()
    assert suite.get("failures") == "1"
    assert suite.find("testcase/failure").get("message") == "negated_rates"


HOSTILE = {
    "empty.csv": b"", "newlines.csv": b"\n\n\n", "binary.csv": bytes(range(256)) * 40, "zeros.nc": bytes(4096),
    "head.csv": b"time,q0,q1,q2,q3\n", "one.csv": b"time,q0,q1,q2,q3\n0,1,0,0,0\n",
    "line.csv": b"time,q0,q1,q2,q3\n" + b"1" * 2**20 + b",1,0,0,0\n", "heading.csv": b"x" * 2**20,
    "ragged.csv": b"time,q0,q1,q2,q3\n0,1,0,0,0\n1,1,0,0\n2,1,0,0,0,7,8\n",
    "words.csv": b"time,w1,w2,w3\n0,a,b,c\n1,d,e,f\n",
    "true.csv": b"time,w1,w2,w3\n0,1,2,3\n1,true,false,2\n", "utf16.csv": "time,w1,w2,w3\n0,1,2,3\n".encode("utf-16"),
    "huge.csv": b"time,w1,w2,w3\n0,1e400,2,3\n1,1,2,3\n", "fast.csv": b"time,w1,w2,w3\n0,1e200,2,3\n1,1e200,2,3\n",
    "junk.parquet": b"PAR1" + bytes(100), "junk.nc": b"\x89HDF\r\n\x1a\n" + bytes(100),
    "junk.aem": b"CCSDS_AEM_VERS = 1.0\n",
    "binary.aem": bytes(range(256)) * 40,
    "noquaternion.aem": b"CCSDS_AEM_VERS = 1.0\nATTITUDE_TYPE = SPIN\nDATA_START\n",
    "ragged.aem": b"CCSDS_AEM_VERS = 1.0\nDATA_START\n2026-01-01T00:00:00 0 0 0 1\n2026-01-01T00:00:01 0 0 1\n",
    "epoch.aem": b"CCSDS_AEM_VERS = 1.0\nDATA_START\nyesterday 0 0 0 1\ntoday 0 0 0 1\n",
    "two.aem": b"CCSDS_AEM_VERS = 1.0\nDATA_START\n2026-01-01T00:00:00 0 0 0 1\nDATA_STOP\nMETA_START\nMETA_STOP\n",
    "nul.csv": b"time,w1,w2,w3\n0,1,2,3\n\x00,\x00,\x00,\x00\n",
}  # fmt: skip


REFUSED = [
    ["nowhere.csv", *MOMENTS], ["run.csv"], ["run.txt", *MOMENTS], ["run.csv", "--moments", "1", "2", "9"],
    ["run.csv", *MOMENTS, "--columns", "time=a,b"], ["run.csv", *MOMENTS, "--json", "--tolerance", "-1"],
    *([place, *MOMENTS] for place in (".", "/dev/null", "pipe.csv")),
    *([name, *MOMENTS, "--json", "--junit", "certify.xml"] for name in HOSTILE),
]  # fmt: skip


@pytest.mark.parametrize("arguments", REFUSED, ids=" ".join)
def test_a_refusal_is_one_message_with_status_2(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe.csv")
    write_csv(tmp_path / "run.csv", table(exact_rows(BRICK, BRICK_START, TIMES)))
    name = arguments[0]
    if name in HOSTILE:
        Path(name).write_bytes(HOSTILE[name])
    message = refusal_message(capsys, "certify", *arguments)
    assert message.count("\n") == 1
    assert name not in HOSTILE or message.startswith(f"{name}: ")
    assert not Path("certify.xml").exists()
