import pickle
import re

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import sweeps
from sweeps.__main__ import main
from sweeps.points import tables
from sweeps.points.in_memory_definitions import sweep_of
from sweeps.points.loading import read_sweep
from sweeps.reading import tables as formats
from sweeps.schema import units
from sweeps.schema.refusals import DefinitionError

ROWS = np.random.default_rng(0).uniform([0.5, 0.5, 0.1], [1.5, 1.0, 9.0], (40_000, 3))  # more than a block of rows
NAMES = ("I1", "I2", "omega0")
HEADING = "I1 (kg m2),omega0 [rpm],I2 (g·cm²)"


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "cache_folder", lambda: tmp_path / "cache")


def write(folder, content, name="bodies.csv", grid="{I3: 1.0}", more=""):
    """Write a definition next to its table."""
    (folder / name).write_bytes(content.encode(errors="surrogateescape"))
    (folder / "my.yaml").write_text(f"table: {name}\ngrid: {grid}\n{more}\n")
    return folder / "my.yaml"


def text(rows=ROWS[:50], heading=HEADING):
    lines = [",".join(map(repr, (a, w, 1e7 * b))) for a, b, w in rows.tolist()]
    return "\n".join([heading, *lines]) + "\n"


def points(path):
    grid = read_sweep(path).grid
    columns = grid.points(0, grid.size)
    return np.column_stack([columns[name][:: grid.shape[1]] for name in NAMES])


def test_rows_are_points_in_the_units_of_the_header(tmp_path):
    path = write(tmp_path, text(ROWS))
    sweep = read_sweep(path)
    assert sweep.grid.dims == ("point", "axis", "I3", "epsilon", "phase")
    assert sweep.grid.shape[0] == len(ROWS)
    theirs = pd.read_csv(tmp_path / "bodies.csv", float_precision="round_trip").to_numpy()
    table_points = points(path)
    assert np.array_equal(table_points[:, 0], theirs[:, 0])
    np.testing.assert_allclose(table_points[:, 1], theirs[:, 2] * 1e-7, rtol=1e-15)
    np.testing.assert_allclose(table_points[:, 2], theirs[:, 1] * np.pi / 30, rtol=1e-15)


def test_any_part_is_that_part_of_the_whole(tmp_path):
    path = write(tmp_path, text(ROWS))
    all_points = points(path)
    rows = pickle.loads(pickle.dumps(read_sweep(path))).definition.rows
    for start, stop in ((0, 0), (0, 1), (16_383, 16_385), (39_999, 40_000)):
        columns = rows.rows(start, stop)
        assert np.array_equal(np.column_stack([columns[name] for name in NAMES]), all_points[start:stop])


@pytest.mark.parametrize("parquet", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_csv_netcdf_and_parquet_hold_the_same(tmp_path, parquet):
    columns = {name: ROWS[:50, k] for k, name in enumerate(NAMES)}
    path = write(tmp_path, text(heading="I1,omega0,I2 (g cm2)"))
    expected = points(path)
    if parquet:
        pytest.importorskip("pyarrow")
        pd.DataFrame(columns).to_parquet(tmp_path / "rows.parquet", row_group_size=17)
    else:
        xr.Dataset({name: ("row", values) for name, values in columns.items()}).to_netcdf(tmp_path / "rows.nc")
    file = "rows.parquet" if parquet else "rows.nc"
    (tmp_path / "my.yaml").write_text(f"table: {file}\ngrid: {{I3: 1.0}}\n")
    np.testing.assert_allclose(points(path), expected, rtol=1e-15)


def test_an_edited_table_is_read_again(tmp_path):
    before = read_sweep(write(tmp_path, text())).definition.inputs
    edited_sweep = read_sweep(write(tmp_path, text(ROWS[:51])))
    assert edited_sweep.definition.inputs != before
    assert edited_sweep.grid.shape[0] == 51


def test_a_damaged_cache_is_never_read(tmp_path):
    path = write(tmp_path, text(ROWS))
    rows = read_sweep(path).definition.rows
    content = bytearray(rows.cache_file.read_bytes())
    content[500_000] ^= 1
    rows.cache_file.write_bytes(content)
    with pytest.raises(OSError, match="damaged"):
        rows.rows(0, len(ROWS))
    assert np.array_equal(points(path)[:, 0], ROWS[:, 0])
    rows.cache_file.write_bytes(content[:-5])
    assert np.array_equal(points(path)[:, 0], ROWS[:, 0])


PLAIN = "I1,omega0,I2\n1.5,2,1\n0.5,-3,1.25\n"
PLAIN_VALUES = {"I1": [1.5, 0.5], "I2": [1.0, 1.25], "omega0": [2.0, -3.0]}


@pytest.mark.parametrize(
    "content",
    [
        PLAIN.replace("\n", ",,\n"),
        PLAIN.replace("\n", ",\n").replace("I2,", "I2"),
        "\ufeff" + PLAIN.replace("\n", "\r\n") + "\r\n\r\n",
        PLAIN.replace(",", ";"),
        PLAIN.replace(",", '","').replace("\n", '"\n"').join(['"', ""]).removesuffix('"'),
        PLAIN.removesuffix("\n"),
    ],
    ids=["trailing commas", "trailing in rows", "BOM and CRLF and blank lines", "semicolons", "quotes", "no last end"],
)
def test_what_spreadsheets_write_is_read(tmp_path, content):
    table = read_sweep(write(tmp_path, content)).definition.rows
    rows = table.rows(0, table.num)
    assert {name: values.tolist() for name, values in rows.items()} == PLAIN_VALUES


def test_a_bad_row_is_named_however_far_down(tmp_path, monkeypatch):
    monkeypatch.setattr(formats, "PART_ROWS", 2**14)
    lines = text(ROWS).splitlines()
    lines[35_001] = "1,two,1e7"
    with pytest.raises(DefinitionError, match=r"row 35,001 \('two'\)"):
        read_sweep(write(tmp_path, "\n".join(lines)))


def with_row(row):
    """The text of a table with another third row."""
    lines = text().splitlines()
    return "\n".join([*lines[:3], row, *lines[4:]])


ROWS_REFUSED = {  # third row → words of the refusal
    "abc,2,1e7": "table.I1: row 3 ('abc') is no number; allowed: a number in every row",
    "1,,1e7": "table.omega0: row 3 is missing, or no finite number",
    "1,-inf,1e7": "table.omega0: row 3 is missing, or no finite number",
    "-1,2,1e7": "table.I1: row 3 (-1.0) is out of range; allowed: a positive number",
    "1,2,1e7,4": "table: row 3 (4 values) is no row of the table; allowed: 3 values in every row",
    "True,2,1e7": "table.I1: row 3 ('True') is no number; allowed: a number in every row",
    "1.0,2.0": "table.I2: row 3 is missing",
    '1.0,2.0,"3.0e6': "table",
    "1.0,2.0,\udcff": "is not UTF-8 text",
}
NAME = "name,I1,omega0,I2\nRacket,"
CONTENTS_REFUSED = {  # content of a CSV file → words of the refusal
    **{with_row(row): words for row, words in ROWS_REFUSED.items()},
    PLAIN.replace(",", ";").replace(".", ","): "row 1 ('1,5') is no number; allowed: a number in every row, with a dec",
    PLAIN.replace("\n", ",\n").replace("-3,1.25,", "-3,1.25,7"): "has more values in a row than names",
    text(heading="I1,omega,I2"): "'omega' is no column that is known (did you mean omega0?); allowed",
    text(heading="I1,I1,I2"): "'I1' is the name of two columns",
    text(heading="I1 (stone),omega0,I2"): "table.I1: 'stone' is a unit that is not known; allowed: kg",
    HEADING + "\n": "'bodies.csv' has no rows",
    "": "'bodies.csv' has no first line of names",
    f"{NAME}abc,2,1\n": "table.I1: row 1 ('abc') is no number",
    f"{NAME}1,2,1\nBook,True,2,1\n": "table.I1: row 2 ('True') is no number",
    f"{NAME}1,2,1\nBook,,2,1\n": "table.I1: row 2 is missing",
    "name,remark\nRacket,wooden\n": "has no column of a parameter",
}
REFUSED = [
    *(({"content": content}, words) for content, words in CONTENTS_REFUSED.items()),
    ({"content": text(), "grid": "{I3: 1.0, omega0: 2.0}"}, "table.omega0: 'omega0' is a column of the table and"),
    ({"content": text(), "more": "sample: {num: 3}"}, "is given beside sample"),
    ({"content": text(), "name": "bodies.xls"}, "is no table by its name"),
    ({"content": "no parquet", "name": "bodies.parquet"}, "table: 'bodies.parquet'"),
    ({"content": "no netcdf", "name": "bodies.nc"}, "is no netCDF file"),
]


@pytest.mark.parametrize(("settings", "words"), REFUSED, ids=[words[:30] for _, words in REFUSED])
def test_a_table_is_refused_in_words_and_nothing_is_kept(tmp_path, settings, words):
    with pytest.raises(DefinitionError, match=re.escape(words)):
        read_sweep(write(tmp_path, **settings))
    assert not [file for file in (tmp_path / "cache").rglob("*") if file.is_file()]


@pytest.mark.parametrize(
    ("unit", "target", "factor"),
    [
        ("", "kg m2", 1.0),
        ("kg·m²", "kg m2", 1.0),
        ("rad/s", "rad s-1", 1.0),
        ("deg/s", "rad s-1", np.pi / 180),
        ("Hz", "rad s-1", 2 * np.pi),
        ("deg", "rad", np.pi / 180),
        ("furlong", "rad s-1", None),
        ("kg", "m", None),
        ("turn/s", "rad s-1", 2 * np.pi),
        ("rad", "degree", 180 / np.pi),
        ("km/h", "m s-1", 1 / 3.6),
        ("N m", "kg m2 s-2", 1.0),
        ("rad s-1", "s-1", None),
        ("s-1", "rad s-1", 1.0),
        ("min-1", "rad s-1", None),  # radians or turns
    ],
)
def test_units(unit, target, factor):
    assert units.factor(unit, target) == factor


@pytest.mark.parametrize(
    ("text", "unit", "number"),
    [
        ("30 rpm", "rad s-1", np.pi),
        ("−2 deg/s", "rad s-1", -2 * (np.pi / 180)),
        ("12 kg cm²", "kg m2", 0.0012),  # rounded once
        ("5 %", "1", 0.05),
        ("1e999 h", "s", np.inf),
        ("2 1/ms", "s-1", 2000.0),
        ("21/ms", "s-1", 21000.0),
        ("1e3", "m", "1e3"),  # a quoted number stays text
        ("fast", "m", "fast"),
        (2, "m", 2),
    ],
)
def test_numbers_with_units(text, unit, number):
    assert units.number(text, unit) == number


TEXTS = {  # content of a CSV file, names of its points, columns of text that are ignored
    "a name before": ("name,I1,omega0,I2\nRacket,1.5,2,1\nBook,0.5,-3,1.25\n", ("Racket", "Book"), ()),
    "a name behind": ("I1,omega0,I2,name\n1.5,2,1,Racket\n0.5,-3,1.25,Book\n", ("Racket", "Book"), ()),
    "names of numbers": ("Name,I1,omega0,I2\n433,1.5,2,1\n99942,0.5,-3,1.25\n", ("433", "99942"), ()),
    "commas in quotes": (
        'name,I1,omega0,I2\n"Racket, wooden",1.5,2,1\n"Book, ""thin""",0.5,-3,1.25\n',
        ("Racket, wooden", 'Book, "thin"'),
        (),
    ),
    "other words": (
        "I1,remark,omega0,source,I2\n1.5,straße,2,Müller,1\n0.5,,-3,true,1.25\n",
        (),
        ("remark", "source"),
    ),
    "semicolons": ("name;I1;omega0;I2\nRacket;1.5;2;1\nBook;0.5;-3;1.25\n", ("Racket", "Book"), ()),
    "missing names": ("I1,omega0,I2,name\n1.5,2,1,\n0.5,-3,1.25,\n", (), ("name",)),
}


@pytest.mark.parametrize("case", TEXTS)
def test_columns_of_text_are_ignored(tmp_path, case):
    content, names, ignored = TEXTS[case]
    table = read_sweep(write(tmp_path, content)).definition.rows
    rows = table.rows(0, table.num)
    assert {key: values.tolist() for key, values in rows.items()} == PLAIN_VALUES
    assert (table.point_names, table.text_columns) == (names, ignored)


def test_names_of_parquet_and_frames_are_those_of_points(tmp_path):
    pytest.importorskip("pyarrow")
    frame = pd.DataFrame({"name": ["a", "b"], "I1": [1.5, 0.5], "I2": [1.0, 1.25], "omega0": [2.0, -3.0]})
    path = write(tmp_path, "", "rows.parquet")
    frame.to_parquet(tmp_path / "rows.parquet")
    for table in (read_sweep(path).definition.rows, sweep_of(frame, {"I3": 1.5}).definition.rows):
        assert (table.point_names, table.text_columns) == (("a", "b"), ())
        assert table.rows(0, 2)["I1"].tolist() == [1.5, 0.5]


def test_impossible_bodies_of_a_table_are_flagged_as_in_a_grid():
    frame = pd.DataFrame({"I1": [1.0, 0.5, 1.0, 3.0, 1.0], "I2": [1.2, 0.2, 0.1, 1.0, 9.0]})
    ds = sweeps.survey(frame, I3=1.5, omega0=1.0)
    for row, (I1, I2) in enumerate(frame.to_numpy().tolist()):
        grid = sweeps.survey(I1=I1, I2=I2, I3=1.5, omega0=1.0)
        assert (ds.triangle_margin.isel(point=row).values.min() < 0) == (row > 0)
        for name in ("triangle_margin", "status", "omega_squared", "regime"):
            of_table, of_grid = ds[name].isel(point=row).values.ravel(), grid[name].values.ravel()
            assert np.array_equal(of_table, of_grid, equal_nan=True)


# The column `name`

NAMED = ["Explorer 1", "Vesta", "Ceres, the largest", "Ω 3", "Vesta B"]
FRAME = pd.DataFrame(
    {"name": NAMED, "I1": [1.0, 1.0, 1.1, 0.9, 1.2], "I2": [2.0, 1.5, 1.2, 1.9, 1.4], "kind": list("abcde")}
)


@pytest.fixture(scope="module")
def map_with_names(tmp_path_factory):
    folder = tmp_path_factory.mktemp("named")
    FRAME.to_csv(folder / "bodies.csv", index=False)
    (folder / "my.yaml").write_text("table: bodies.csv\ngrid: {I3: 2.5, omega0: 1.0}\n")
    assert main(["shard", str(folder / "my.yaml"), "1", "1", "-o", str(folder / "1-of-1.nc")]) == 0
    assert main(["merge", str(folder / "my.yaml"), str(folder / "1-of-1.nc"), "-o", str(folder / "map.nc")]) == 0
    return folder / "map.nc"


def test_names_are_a_coordinate_of_survey_and_file_alike(map_with_names):
    with sweeps.open_map(map_with_names) as ds:
        assert ds["name"].dims == ("point",)
        assert ds["name"].values.tolist() == NAMED
        assert ds.content_hash == sweeps.survey(FRAME, I3=2.5, omega0=1.0).content_hash
        assert ds.isel(point=3)["name"].item() == "Ω 3"


@pytest.mark.parametrize(
    ("text", "number"), [("explorer", 1), ("Vesta", 2), ("largest", 3), ("Ω", 4), ("Vesta B", 5), ("VESTA", 2)]
)
def test_a_point_is_chosen_by_its_name(map_with_names, text, number):
    row = sweeps.point(map_with_names, name=text, axis=2)
    assert (row["point"].item(), row["name"].item()) == (number, NAMED[number - 1])


@pytest.mark.slow
def test_every_command_shows_the_names(map_with_names, tmp_path, capsys):
    for command, words in (
        (["show", map_with_names], "Vesta"),
        (["point", map_with_names, "--name", "Vesta B", "--axis", "2"], "name = Vesta B"),
        (["verify", map_with_names, "--definition", map_with_names.with_name("my.yaml"), "--points", "0"], "holds"),
        (["slice", map_with_names, "--point", "2", "-o", tmp_path / "slice.nc"], "slice.nc"),
        (["report", map_with_names, "-o", tmp_path / "report.html"], "report.html"),
        (["figures", map_with_names, "-o", tmp_path / "figures", "--only", "points"], "points.png"),
    ):
        status = main(list(map(str, command)))
        output = capsys.readouterr().out
        assert (status, words in output) == ((0, True) if command[0] != "slice" else (2, False)), command
    assert "Ceres, the largest" in (tmp_path / "report.html").read_text()
