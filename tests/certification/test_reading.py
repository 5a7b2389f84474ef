"""Trajectories from files: names of columns, units, conventions, formats, and refusals."""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation
from trajectories import BRICK, BRICK_START, exact_rows, table, write_aem, write_csv

import sweeps

TIMES = np.linspace(5.0, 15.0, 41)
# Rounding of 17 digits, of degrees and of Euler angles: some 1e-15 rad, each amplified tenfold over the motion.
ROUNDING = 1e-13


def rows():
    rows = exact_rows(
        BRICK, BRICK_START, TIMES - TIMES[0], q0=Rotation.from_rotvec([0.3, -1.0, 2.0]).as_quat(scalar_first=True)
    )
    return rows | {"t": TIMES}


def rename_columns(names, columns=("q", "w")):
    values = np.column_stack([rows()[name] for name in columns])
    return {"time": TIMES} | dict(zip(names.split(), values.T, strict=True))


def certify_motion(run, **options):
    facts = sweeps.certify(run, BRICK.tolist(), **options).attrs
    worst = max(facts.get("attitude_error_max_rad", 0.0), facts.get("rates_error_max_relative", 0.0))
    return facts["verdict"], worst


@pytest.mark.parametrize(
    "names",
    [
        "q0 q1 q2 q3 w1 w2 w3",
        "qw qx qy qz wx wy wz",
        "q_w q_x q_y q_z omega_x omega_y omega_z",
        "Quat_W Quat_X Quat_Y Quat_Z p q r",
        "pose.orientation.w pose.orientation.x pose.orientation.y pose.orientation.z twist.angular.x twist.angular.y "
        "twist.angular.z",
        "e0 e1 e2 e3 ω1 ω2 ω3",
        "q[0] q[1] q[2] q[3] gyro[0] gyro[1] gyro[2]",
        "qs qx qy qz angularVelocityX angularVelocityY angularVelocityZ",
    ],
)
def test_columns_are_found_by_the_names_that_simulators_write(names):
    verdict, worst = certify_motion(rename_columns(names))
    assert verdict == "pass"
    assert worst < ROUNDING


def test_the_scalar_of_q1_to_q4_is_asked_for():
    columns = rename_columns("q1 q2 q3 q4 w1 w2 w3")
    with pytest.raises(sweeps.DefinitionError, match="--scalar first, --scalar last"):
        certify_motion(columns)
    assert certify_motion(columns, scalar="first")[1] < ROUNDING
    last = dict(zip(columns, [columns[n] for n in ("time", "q2", "q3", "q4", "q1", "w1", "w2", "w3")], strict=True))
    assert certify_motion(last, scalar="last")[1] < ROUNDING


@pytest.mark.parametrize(("names", "factor", "options"), [
    ("q0 q1 q2 q3 w1_deg_s w2_deg_s w3_deg_s", 180 / np.pi, {}),
    ("q0 q1 q2 q3 p-rad_sec q-rad_sec r-rad_sec", 1, {}),
    ("q0 q1 q2 q3 wx_[deg/s] wy_[deg/s] wz_[deg/s]", 180 / np.pi, {}),
    ("q0 q1 q2 q3 w1 w2 w3", 30 / np.pi, {"rate_unit": "rpm"}),
])  # fmt: skip
def test_units_of_rates_stand_in_names_or_options(names, factor, options):
    columns = rename_columns(names)
    for name in names.split()[4:]:
        columns[name] = columns[name] * factor
    assert certify_motion({n.replace("_[", " ["): c for n, c in columns.items()}, **options)[1] < ROUNDING


@pytest.mark.parametrize(("name", "factor", "options"), [
    ("time_ms", 1e3, {}), ("t (min)", 1 / 60, {}), ("Time [s]", 1, {}), ("time", 1e3, {"time_unit": "ms"}),
    ("t_sec", 1, {}),
])  # fmt: skip
def test_units_of_time_stand_in_its_name_or_in_an_option(name, factor, options):
    columns = table(rows())
    assert certify_motion({name: columns.pop("time") * factor} | columns, **options)[1] < ROUNDING


@pytest.mark.parametrize("sequence", ["ZYX", "XYZ", "zxy"])
def test_euler_angles_have_a_sequence(sequence):
    turns = Rotation.from_quat(rows()["q"], scalar_first=True)
    angles = dict(zip("ZYX", ("yaw_deg", "pitch_deg", "roll_deg"), strict=True))
    values = turns.as_euler(sequence, degrees=True).T
    columns = {angles[letter]: column for letter, column in zip(sequence.upper(), values, strict=True)}
    columns = table({"t": TIMES, "w": rows()["w"]}) | columns
    assert certify_motion(columns, sequence=sequence)[1] < ROUNDING
    if sequence == "ZYX":
        assert certify_motion(columns)[1] < ROUNDING


def test_euler_angles_by_other_names_need_a_sequence():
    turns = Rotation.from_quat(rows()["q"], scalar_first=True)
    columns = {"time": TIMES} | dict(zip(("phi", "theta", "psi"), turns.as_euler("ZXZ").T, strict=True))
    with pytest.raises(sweeps.DefinitionError, match="sequence: of the Euler angles is missing"):
        certify_motion(columns)
    options = {"sequence": "ZXZ", "columns": {"attitude": ["phi", "theta", "psi"]}}
    assert certify_motion(columns, **options)[1] < ROUNDING


def test_a_matrix_and_its_transpose():
    matrices = Rotation.from_quat(rows()["q"], scalar_first=True).as_matrix()
    for entries, options in ((matrices, {}), (matrices.transpose(0, 2, 1), {"direction": "space-to-body"})):
        columns = {f"r{i + 1}{j + 1}": entries[:, i, j] for i in range(3) for j in range(3)}
        assert certify_motion({"t": TIMES} | columns, **options)[1] < ROUNDING


def test_columns_of_any_name_are_given_by_options():
    names = ["zeit", "a", "b", "c", "d", "x1", "x2", "x3"]
    columns = dict(zip(names, table(rows()).values(), strict=True))
    roles = {"time": ["zeit"], "attitude": ["a", "b", "c", "d"], "rates": ["x1", "x2", "x3"]}
    assert certify_motion(columns, columns=roles)[1] < ROUNDING


def test_q_and_minus_q_are_one_attitude_and_rows_may_be_unevenly_spaced():
    uneven = np.sort(np.random.default_rng(5).uniform(3.0, 9.0, 50))
    motion = exact_rows(BRICK, BRICK_START, uneven - uneven[0])
    motion["q"] *= np.random.default_rng(6).choice([-1.0, 1.0], 50)[:, None]
    assert certify_motion(table(motion | {"t": uneven}))[1] < ROUNDING


@pytest.mark.parametrize(
    "kind", ["csv", "semicolons", "parquet", "nc", "aem", "aem_first", "aem_reversed", "aem_rates"]
)
def test_all_formats_give_the_same(kind, tmp_path):
    columns = table(rows())
    frame = pd.DataFrame(columns)
    if kind == "csv":
        path = write_csv(tmp_path / "run.csv", columns)
    elif kind == "semicolons":
        path = tmp_path / "run.csv"
        frame.assign(note="text").to_csv(path, sep=";", index=False)
    elif kind == "parquet":
        pytest.importorskip("pyarrow")
        path = tmp_path / "run.parquet"
        frame.assign(stamp=pd.Timestamp("2026-01-01"), word="x").to_parquet(path)
    elif kind == "nc":
        path = tmp_path / "run.nc"
        frame.set_index("time").to_xarray().assign_attrs(title="x").assign(I1=1.0).to_netcdf(path)
    else:
        reverse = kind == "aem_reversed"
        motion = rows() | ({"q": rows()["q"] * [1, -1, -1, -1]} if reverse else {})
        options = {"order": "FIRST" if kind == "aem_first" else "LAST", "direction": "B2A" if reverse else "A2B"}
        path = write_aem(
            tmp_path / "run.aem", motion, rates=kind == "aem_rates", epoch="2026-12-31T23:59:55", **options
        )
    verdict, worst = certify_motion(path)
    assert verdict == "pass"
    assert worst < (1e-13 if kind[:3] != "aem" else 1e-12)  # epochs have 15 decimals, and the rates are fitted


def test_a_tensor_turns_the_axes_of_the_file():
    rotation = Rotation.from_rotvec([0.4, 1.0, -0.3])  # from principal axes to those of the file
    tensor = rotation.as_matrix() @ np.diag([1.0, 2.0, 2.6]) @ rotation.as_matrix().T
    motion = exact_rows([1.0, 2.0, 2.6], [0.1, 1.0, 0.2], np.linspace(0, 20, 60))
    q = Rotation.from_quat(motion["q"], scalar_first=True) * rotation.inv()
    columns = table({"t": motion["t"], "q": q.as_quat(scalar_first=True), "w": rotation.apply(motion["w"])})
    facts = sweeps.certify(columns, tensor.tolist()).attrs
    assert facts["attitude_error_max_rad"] < 1e-12  # the tensor's eigenvalues and axes are rounded


def with_change(columns, name, row, value):
    columns = {n: np.array(c) for n, c in columns.items()}
    columns[name][row] = value
    return columns


@pytest.mark.parametrize(("columns", "words"), [
    (with_change(table(rows()), "q1", 7, np.nan), "row 8 of 'q1' is missing or not finite"),
    (with_change(table(rows()), "w3", 2, np.inf), "row 3 of 'w3' is missing or not finite"),
    (with_change(table(rows()), "time", 7, TIMES[6]), "row 8: the time repeats"),
    (with_change(table(rows()), "time", 7, 0.0), "row 8: the time goes back"),
    ({n: c[:1] for n, c in table(rows()).items()}, "has 1 rows"),
    ({n: c[:0] for n, c in table(rows()).items()}, "has 0 rows"),
    (table(rows()) | {f"q{i}": np.where(TIMES[9] == TIMES, 0.0, rows()["q"][:, i]) for i in range(4)},
     "row 10: the quaternion is zero"),
    ({n: c for n, c in table(rows()).items() if n != "q2"}, "3 of 4 columns of the attitude"),
    ({n: c for n, c in table(rows()).items() if n != "w2"}, "2 of 3 columns of the rates"),
    ({n: c for n, c in table(rows()).items() if n != "time"}, "there is no time"),
    ({"time": TIMES, "x": TIMES}, "neither attitude nor angular velocity"),
    (table(rows()) | {"omega1": TIMES, "omega2": TIMES, "omega3": TIMES}, "may each be the rates"),
    (table(rows() | {"w": 0 * rows()["w"]}), r"row 1: \|omega\| is 0 rad/s"),
    (table({"t": TIMES, "q": np.tile([1.0, 0, 0, 0], (41, 1))}), "a body that rotates"),
    ({"time": TIMES, "w1 (furlong)": TIMES, "w2": TIMES, "w3": TIMES}, "has the unit 'furlong'"),
])  # fmt: skip
def test_what_cannot_be_judged_is_refused(columns, words):
    with pytest.raises(sweeps.DefinitionError, match=words) as error:
        certify_motion(columns)
    assert "allowed: " in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("body", [[1, 2, 4], [1, 2, -1], [0, 1, 1], [1, 2], "nobody"])
def test_an_impossible_body_is_refused(body):
    with pytest.raises(sweeps.DefinitionError):
        sweeps.certify(table(rows()), body)


@pytest.mark.parametrize(("options", "words"), [
    ({"tolerance": 0}, "tolerance: 0; allowed: a finite number > 0"),
    ({"tolerance": "x"}, "tolerance: 'x'"),
    ({"frame": "lunar"}, "frame: 'lunar'"),
    ({"frame": "local"}, "the file has no longitude and latitude"),
    ({"frame_rate": 1.0}, "are of a local frame"),
    ({"frame": "local", "frame_axis": [0, 0, 0]}, "three finite numbers, not all 0"),
    ({"columns": {"attitude": ["q0", "q1"]}}, "allowed: ROLE=NAME"),
    ({"columns": {"speed": ["q0"]}}, "allowed: ROLE=NAME"),
    ({"columns": {"time": ["nowhere"]}}, "'nowhere' is no column of numbers"),
    ({"nonsense": 1}, "unknown argument 'nonsense'"),
])  # fmt: skip
def test_options_are_refused_in_words(options, words):
    with pytest.raises(sweeps.DefinitionError, match=words):
        certify_motion(table(rows()), **options)
