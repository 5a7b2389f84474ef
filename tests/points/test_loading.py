import json
import math
import os
import pickle
import re
import sys

import numpy as np
import pytest
import repeated
from calls import python
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError
from strategies import ranges, sweeps

from kernels.free import triangle
from sweeps import systems as registry
from sweeps.points import catalogue
from sweeps.points.loading import read_definition, read_sweep
from sweeps.schema.refusals import DefinitionError, models_in
from sweeps.systems.rigid_body.system import PROPAGATORS, GridEntries, SpunBody

SHIPPED = sorted(catalogue.FOLDER.glob("*.yaml"))
MODELS = [registry.resolve(name).model for name in registry.system_names()]
GRID = "grid: {I1: 1, I2: 2, I3: 3, omega0: 1}\n"
LINE = re.compile(r"(?P<file>.+?): (?P<path>[^:]+): (?:(?P<value>.+?) )?(is|has|holds|makes|cannot) .*; allowed: .+")


def write_definition(folder, text, name="some.yaml"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refusal(source):
    """Return the message, and check that each line names a path, a value and the allowed values."""
    with pytest.raises(DefinitionError) as error:
        read_definition(source)
    message = str(error.value)
    for line in message.splitlines()[:10]:
        assert LINE.fullmatch(line), line
        assert line.isprintable()
    return message


def with_grid(**entries):
    return {"grid": {"I1": 1.0, "I2": 2.0, "I3": 3.0, "omega0": 1.0} | entries}


def with_body(**entries):
    return {"bodies": [{"name": "top", "I1": 1.0, "I2": 2.0, "I3": 3.0, "omega0": 1.0} | entries]}


# Results


def test_defaults_are_those_of_the_contract(tmp_path):
    sweep = read_definition(write_definition(tmp_path, GRID))
    assert (sweep.name, sweep.title, sweep.text) == ("some", "some", GRID)
    assert (sweep.system, sweep.axes, sweep.bodies, sweep.shards) == ("rigid_body", (1, 2, 3), (), "auto")
    assert (sweep.grid.epsilon, sweep.grid.phase) == (1e-6, 0.6)
    run = sweep.integration
    assert (run.propagator, run.rotations, run.samples_per_rotation, run.tolerance) == ("direct", 4, 16, 1e-10)
    assert run.samples == 64


def test_a_mapping_is_a_sweep_too():
    sweep = read_definition(
        with_grid(I1=np.linspace(1, 2, 3), I2=np.float32(0.5), I3=range(1, 4)) | {"axes": np.array([3, 1])}
    )
    assert (sweep.name, sweep.title) == ("sweep", "sweep")
    assert sweep.grid.I1 == (1.0, 1.5, 2.0)
    assert sweep.grid.I2 == 0.5
    assert sweep.grid.I3 == (1.0, 2.0, 3.0)
    assert sweep.axes == (1, 3)


def test_a_definition_is_frozen_hashable_and_travels_between_processes():
    sweep = read_definition(with_body(), name="tops")
    with pytest.raises(ValidationError):
        sweep.shards = 3
    twin = pickle.loads(pickle.dumps(sweep))
    assert twin == sweep
    assert hash(twin) == hash(sweep)
    assert (twin.name, twin.text) == ("tops", sweep.text)


@pytest.mark.parametrize(
    ("given_list", "expected"), [([1, 2, 3], (1, 2, 3)), ([3, 2, 1], (3, 2, 1)), ([2, 3, 1], (1, 2, 3)), ([5], (5,))]
)
def test_lists_become_monotonic(given_list, expected):
    assert expected == read_definition(with_grid(I2=given_list)).grid.I2


@given(sweeps)
@settings(max_examples=30, deadline=None, derandomize=True)
def test_the_text_of_a_mapping_is_that_sweep(tmp_path_factory, mapping):
    sweep = read_definition(mapping)
    path = write_definition(tmp_path_factory.mktemp("text"), sweep.text, "sweep.yaml")
    assert read_definition(path) == read_definition(path.parent / "sweep.yaml")
    assert read_definition(path).model_dump() == sweep.model_dump()


PRINTABLE = st.text(min_size=1, max_size=20).filter(lambda t: t.strip() and t.isprintable())
LOOKS_LIKE_ANOTHER_TYPE = st.sampled_from(
    [
        *("1e-6", "8e37", ".5", "1.", "no", "010", "1:30", "null", "~", "true", "1_000", "2001-01-01", "0o7"),
        *("<<", "=", ".nan"),
    ]
)


@given(PRINTABLE | LOOKS_LIKE_ANOTHER_TYPE)
@settings(max_examples=15, deadline=None, derandomize=True)
def test_text_stays_text_in_the_written_yaml(tmp_path_factory, title):
    mapping = with_grid() | {"title": title}
    path = write_definition(tmp_path_factory.mktemp("text"), read_definition(mapping).text)
    assert read_definition(path).title == title


# YAML 1.2, core schema: the table in section 10.3.2 of the specification, and JSON


NUMBERS = {"8e37": 8e37, "1e-6": 1e-6, "1e+160": 1e160, ".5": 0.5, "1.": 1.0, "+12.3": 12.3, "010": 10, "0o17": 15}
NUMBERS |= {"0xFF": 255, "-.5E-3": -5e-4, "-2E+05": -2e5}


@pytest.mark.parametrize(("scalar", "value"), NUMBERS.items())
def test_numbers_of_the_core_schema(tmp_path, scalar, value):
    phase = read_definition(write_definition(tmp_path, GRID.replace("}", f", phase: {scalar}}}"))).grid.phase
    assert type(phase) is float
    assert phase == value


TEXTS = "no yes on 1:30 1_000 2001-01-01 1e e5 0b1 1.5.2 << 1e5x 1__ ٣"


@pytest.mark.parametrize("scalar", TEXTS.split())
def test_text_of_the_core_schema(tmp_path, scalar):
    assert read_definition(write_definition(tmp_path, f"title: {scalar}\n{GRID}")).title == scalar


@pytest.mark.parametrize("scalar", ["null", "~", "", "true", "False", "1", "2.5", ".inf", "-.INF", ".nan"])
def test_scalars_that_are_no_text(tmp_path, scalar):
    assert "title: " in refusal(write_definition(tmp_path, f"title: {scalar}\n{GRID}"))


@pytest.mark.parametrize(
    "layout", [{}, {"indent": 2}, {"indent": "\t"}, {"ensure_ascii": False}, {"separators": (",", ":")}]
)
def test_json_is_a_definition(tmp_path, layout):
    mapping = with_grid(I1=[1e-6, 8e37], phase=-0.0) | {"title": "Läufer 🎾 / \\ \" 'x'"}
    sweep = read_definition(write_definition(tmp_path, json.dumps(mapping, **layout).replace("/", "\\/")))
    assert sweep.title == mapping["title"]
    assert sweep.model_dump() == read_definition(mapping).model_dump()


def test_quoted_surrogate_escapes_are_one_character(tmp_path):
    assert read_definition(write_definition(tmp_path, 'title: "\\ud83c\\udfbe"\n' + GRID)).title == "🎾"


def test_a_byte_order_mark_and_windows_lines(tmp_path):
    mark = b"\xef\xbb\xbf"
    assert read_definition(write_definition(tmp_path, mark + GRID.replace("\n", "\r\n").encode())).grid.I1 == 1.0
    json_text = json.dumps(with_grid(), indent="\t")
    assert read_definition(write_definition(tmp_path, mark + json_text.encode())).text == json_text


def test_an_alias_repeats_a_value(tmp_path):
    assert read_definition(write_definition(tmp_path, "grid: {I1: &a [1, 2], I2: *a, I3: *a, omega0: 1}")).grid.I3 == (
        1.0,
        2.0,
    )


# Refusals before anything is read as a sweep


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("---\n", "not a mapping"),
        ("[1, 2]", "[1, 2] is not a mapping"),
        (GRID + "---\n" + GRID, "line 2: --- is a second document"),
        (GRID + "...\n" + "x: 1", "line 3: --- is a second document"),
        ("grid: {I1: 1, I1: 2}", "grid.I1: 2 is under a key given twice"),
        ('{"grid": {"I1": 1, "I1": 2}}', "grid.I1: 2 is under a key given twice"),
        ("grid: {I1: !!float 1}", "line 1: 'tag:yaml.org,2002:float' is a tag"),
        ("grid: !custom {I1: 1}", "is a tag"),
        ("%YAML 1.1\n---\n" + GRID, "%YAML 1.1 is another YAML"),
        ("grid: {I1: *a}", "'*a' has no whole value"),
        ("grid: &a {I1: *a}", "'*a' has no whole value"),
        ("? [1, 2]\n: 3", "(top level): [1, 2] is a key"),
        ("grid: {1: 2}", "grid: 1 is a key"),
        ('"a\\nb": 2', "'a\\nb' is a key"),
        ('{"\\u0000range": 2}', "is a key"),
        ("grid: [1", "line 1: 'grid: [1' is not YAML"),
        (GRID + "a: b: c", "line 2: 'a: b: c' is not YAML"),
        ("\ta: 1", "line 1: 'a: 1' is not YAML"),
        ('title: "\\UFFFFFFFF"', "is not YAML"),
        ("title: \x1b[31m", "is not YAML"),
        ('title: "\\ud83d"\n' + GRID, "title: '\\ud83d' holds half a surrogate pair"),
        ('{"title": "\\ud83d"}', "title: '\\ud83d' holds half a surrogate pair"),
        (b"\xff\xfe\x00g", "byte 0 is not UTF-8"),
        ("a: " + "[" * 5000, "nested too deeply"),
        ('{"a":' * 20_000, "nested too deeply"),
        ('{"a":' * 30 + "1" + "}" * 30, "nested too deeply"),
        ("grid: {I1: " + "9" * 5000 + "}", "line 1: " + "9" * 59 + "… is a number of 5,000 digits"),
        ('{"grid": {"I1": ' + "9" * 5000 + "}}", "is a number of 5,000 digits"),
        ("x" * 2**20 + "x", "too large"),
        ("x" * 2**20, "(top level): 'xxx"),
        ("a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
            f"{y}: &{y} [{', '.join(['*' + x] * 9)}]\n" for x, y in zip("abcdefgh", "bcdefghi", strict=True)
        ), "too large"),
        ("a0: &a0 [1]\n" + "".join(f"a{n + 1}: &a{n + 1} [*a{n}]\n" for n in range(3000)), "too deeply"),
    ],
)  # fmt: skip
def test_files_that_are_no_definition(tmp_path, text, words):
    message = refusal(write_definition(tmp_path, text))
    assert words in message
    assert len(message.splitlines()) == 1


def test_a_file_without_permission(tmp_path, monkeypatch):
    def deny(*_, **__):
        raise PermissionError(13, "Permission denied")

    path = write_definition(tmp_path, GRID)
    monkeypatch.setattr(os, "open", deny)  # root opens whatever it likes
    assert "cannot be opened (Permission denied)" in refusal(path)


@pytest.mark.parametrize("source", [None, 3, b"a.yaml", [GRID], 10**400])
def test_sources_of_another_kind(source):
    assert "definition: (top level): " in refusal(source)


# Refusals in a sweep, each with its path, its value and the allowed values

NOT_A_NUMBER = [True, "1.0", None, {}, [], float("nan"), math.inf, -math.inf, 10**400, -(10**400), b"1", 1j]


@pytest.mark.parametrize("value", [*NOT_A_NUMBER, [1.0]], ids=lambda value: repr(value)[:9])
def test_numbers_elsewhere(value):
    for name in ("I1", "omega0", "epsilon", "phase", "axis"):
        assert f"bodies[0].{name}: " in refusal(with_body(**{name: value}))
    for name in ("rotations", "samples_per_rotation", "tolerance"):
        assert f"integration.{name}: " in refusal(with_grid() | {"integration": {name: value}})
    assert "bodies[0].observed.period_days: " in refusal(with_body(observed={"period_days": value, "what": "x"}))
    assert "axes[1]: " in refusal(with_grid() | {"axes": [1, value]})
    assert "shards: " in refusal(with_grid() | {"shards": value})
    for name in ("start", "stop", "num"):
        entry = {"start": 1.0, "stop": 2.0, "num": 3} | {name: value}
        assert f"grid.I1.{name}: " in refusal(with_grid(I1=entry))


RANGES = {  # quantity → allowed values in words, values outside, values at the edge
    "I1": ("a positive number", [0.0, -1.0, 2.2e-308, 5e-324], [sys.float_info.min, sys.float_info.max, 7]),
    "omega0": ("1e-150 ≤ |omega0| ≤ 1e150", [0.0, 9e-151, -2e150], [-1e150, 1e-150]),
    "epsilon": ("0 < epsilon < 1", [0.0, 1.0, -0.5], [1 - 2**-53, 1e-300]),
    "phase": ("", [], [-1e308, 0]),
}


@pytest.mark.parametrize(("name", "value"), [(name, value) for name in RANGES for value in RANGES[name][1]])
def test_quantities_out_of_range(name, value):
    for where, source in (
        (f"grid.{name}", with_grid(**{name: value})),
        (f"grid.{name}[1]", with_grid(**{name: [0.5, value]})),
        (f"grid.{name}.stop", with_grid(**{name: {"start": 0.5, "stop": value, "num": 2}})),
        (f"grid.{name}.start", with_grid(**{name: {"start": value, "stop": 0.5, "num": 2, "spacing": "log"}})),
        (f"bodies[0].{name}", with_body(**{name: value})),
    ):
        message = refusal(source)
        assert message.startswith(f"definition: {where}: {value!r} is out of range; allowed: ")
        assert RANGES[name][0] in message


@pytest.mark.parametrize(("name", "value"), [(name, value) for name in RANGES for value in RANGES[name][2]])
def test_quantities_at_the_edge_are_allowed(name, value):
    assert getattr(read_definition(with_grid(**{name: value})).grid, name) == value


OF_SWEEPS = [
    ({"grd": {}}, "grd: is an unknown key (did you mean grid?); allowed: the keys title"),
    ({"title": 5}, "title: 5 is not text"),
    ({"title": "a\x1b[31mb"}, "title: 'a\\x1b[31mb' is empty, too long or not printable"),
    ({"title": "x" * 201}, "title: '" + "x" * 58 + "… is empty, too long"),
    ({"system": "symmetric_topp"}, "system: 'symmetric_topp' is not available (did you mean symmetric_top?)"),
    ({"system": ["rigid_body"]}, "system: ['rigid_body'] is not available"),
    ({"axes": []}, "axes: [] is empty"),
    ({"axes": [1, 1]}, "axes: [1, 1] holds 1 twice"),
    ({"axes": [1, 4]}, "axes[1]: 4 is out of range; allowed: 1, 2 or 3"),
    ({"axes": [1.0]}, "axes[0]: 1.0 is not a whole number"),
    ({"grid": []}, "grid: [] is not a mapping; allowed: what is varied"),
    ({"grid": {}}, "grid.I2: is missing; allowed: moment of inertia about axis 2, kg m2"),
    ({"grid": {"I1": 1, "I2": 1, "I3": 1}}, "grid.omega0: is missing; allowed: spin rate"),
    ({"bodies": []}, "bodies: [] is empty"),
    ({"bodies": [3]}, "bodies[0]: 3 is not a mapping"),
    ({"shards": 0}, "shards: 0 is out of range; allowed: auto, or a whole number from 1"),
    ({"shards": "many"}, "shards: 'many' is neither auto nor a whole number"),
]
OF_INTEGRATIONS = [
    ({"propagator": "leapfrog"}, f"propagator: 'leapfrog' is not available; allowed: {', '.join(PROPAGATORS)}"),
    ({"variables": []}, "variables: [] is empty"),
    ({"variables": ["omega_squares"]}, "variables[0]: 'omega_squares' is not a variable of this sweep (did you mean"),
    ({"flips": 1}, "flips: 1 is"),
    ({"rotations": 0}, "rotations: 0 is out of range; allowed: a finite"),
    ({"rotations": 0.4}, "rotations: 0.4 makes 6.4 samples"),
    ({"samples_per_rotation": 3}, "samples_per_rotation: 3 is out of range"),
    ({"samples_per_rotation": 10**400}, "samples_per_rotation: a whole number of 1329 bits is out of range"),
    ({"tolerance": 9e-14}, "tolerance: 9e-14 is out of range; allowed: a"),
]
OF_MOMENTS = [
    ([], ": [] is empty"),
    ([1.0, 2.0, 1], ": [1.0, 2.0, 1] holds 1.0 twice"),
    ([1.0, [2.0]], "[1]: [2.0] is not a number"),
    ({"start": 1, "stop": 2}, ".num: is missing; allowed: number of values"),
    ({"start": 1, "stop": 2, "nums": 3}, ".nums: is an unknown key (did you mean num?)"),
    ({"start": 1, "stop": 2, "num": 0}, ".num: 0 is out of range"),
    ({"start": 1, "stop": 2, "num": 10**16}, ".num: 10000000000000000 is out of range"),
    ({"start": 1, "stop": 2, "num": 5, "spacing": "lin"}, ".spacing: 'lin' is not available (did you mean linear?)"),
]
OF_RANGES = [  # parameter, start, stop, num, spacing, message
    ("I1", 1, 2, 1, "linear", "has one value but two ends"),
    ("I1", 1, 1, 2, "linear", "has values that coincide"),
    ("I1", 1, 1 + 4e-16, 9, "linear", "has values that coincide"),
    ("I1", 1, 2, 9 * 10**15, "log", "has values that coincide"),
    ("omega0", -1.0, 1.0, 3, "linear", "holds the spin rate 0"),
    ("omega0", 0.7, -0.1, 9, "linear", "holds the spin rate 0"),
    ("omega0", -2e-150, 2e-150, 6, "linear", "holds the spin rate 0"),
    ("omega0", -1.0, 1.0, 4, "log", "has log spacing through zero"),
    ("phase", 0.0, 1.0, 4, "log", "has log spacing through zero"),
    ("phase", -1e308, 1e308, 4, "linear", "is wider than a double can hold"),
]
OF_BODIES = [
    ({"name": ""}, "name: '' is empty"),
    ({"name": "a\nb"}, "name: 'a\\nb' is empty, too long or not printable"),
    ({"ratios": {"I1": 1, "I2": 1, "I3": 1}}, "I3: 3.0 is given beside ratios"),
    ({"ratios": {"I1": 1, "I2": 1}}, "ratios.I3: is missing"),
    ({"axis": 4}, "axis: 4 is out of range; allowed: 1, 2 or 3"),
    ({"mass": 4}, "mass: is an unknown key; allowed: the keys name, I1"),
    ({"observed": {"period_days": 0, "what": "x"}}, "observed.period_days: 0 is out of range"),
    ({"note": "\x07"}, "note: '\\x07' is empty, too long or not printable"),
]
REFUSED = [
    *((with_grid() | changes, message) for changes, message in OF_SWEEPS),
    *((with_grid() | {"integration": changes}, f"integration.{message}") for changes, message in OF_INTEGRATIONS),
    *((with_grid(I1=entry), f"grid.I1{message}") for entry, message in OF_MOMENTS),
    *((with_body(**changes), f"bodies[0].{message}") for changes, message in OF_BODIES),
]


@pytest.mark.parametrize(("source", "message"), REFUSED, ids=[message[:40] for _, message in REFUSED])
def test_refusals_name_path_value_and_what_is_allowed(source, message):
    assert f"definition: {message}" in refusal(source)


@pytest.mark.parametrize(("name", "start", "stop", "num", "spacing", "words"), OF_RANGES)
def test_refusals_of_what_a_range_makes(name, start, stop, num, spacing, words):
    message = refusal(with_grid(**{name: {"start": start, "stop": stop, "num": num, "spacing": spacing}}))
    assert f"grid.{name}: " in message
    assert words in message


def test_bodies_and_grid_share_the_work():
    first, second = (
        {"name": "a", "I1": 1.0, "I2": 2.0, "I3": 3.0},
        {"name": "b", "ratios": {"I1": 1, "I2": 1, "I3": 1}},
    )
    bodies_with_rate = [first | {"omega0": 1.0}, second | {"omega0": 2.0}]
    assert "grid.I1: 1.0 is given beside bodies" in refusal({"bodies": bodies_with_rate, "grid": {"I1": 1.0}})
    assert "grid.omega0: 3.0 is given although every body" in refusal(
        {"bodies": bodies_with_rate, "grid": {"omega0": 3.0}}
    )
    assert "grid.omega0: is missing" in refusal({"bodies": [first, second]})
    assert "grid.omega0: is missing" in refusal({"bodies": [bodies_with_rate[0], second]})
    mixed_bodies = {"bodies": [bodies_with_rate[0], second], "grid": {"omega0": [1.0, 2.0]}}
    assert "grid.omega0: [1.0, 2.0] is a dimension, but 1 of 2 bodies have their own" in refusal(mixed_bodies)
    assert "bodies[0].I2: is missing" in refusal({"bodies": [{"name": "a", "I1": 1.0}], "grid": {"omega0": 1}})
    equal_bodies = {"bodies": [bodies_with_rate[0], bodies_with_rate[0]]}
    assert "bodies[1].name: 'a' is an earlier name" in refusal(equal_bodies)
    flat = {"name": "Plate B", "tensor": [[1.0, 0, 0], [0, 2.0, 0], [0, 0, 9.0]]}  # one of several is named
    assert "bodies[1] (Plate B).tensor: " in refusal({"bodies": [bodies_with_rate[0], flat]})
    assert read_definition({"bodies": bodies_with_rate}).bodies[1].moments == (1.0, 1.0, 1.0)
    assert read_definition({"bodies": [bodies_with_rate[0], second], "grid": {"omega0": 5}}).grid.omega0 == 5.0


def test_many_problems_fit_on_a_screen():
    message = refusal(with_grid(I1=[-n - 1.0 for n in range(500)], epsilon=2, omga0=3))
    assert len(message.splitlines()) == 11
    assert message.endswith("definition: and 492 more")


def test_every_problem_is_named_at_once():
    message = refusal(with_grid(I1=-1, epsilon=2) | {"axes": [4], "shards": 0, "grd": 1})
    for path in ("grid.I1", "grid.epsilon", "axes[0]", "shards", "grd"):
        assert f"definition: {path}: " in message


def in_itself():
    mapping = with_grid()
    mapping["integration"] = mapping
    return mapping


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (in_itself(), "nested too deeply"),
        (with_grid(I1=10**5000), "grid.I1: a whole number of 16610 bits is not finite"),
        (with_grid() | {"shards": -(10**5000)}, "shards: a whole number of 16610 bits is out of range"),
        (with_grid(I1=np.ones(300_000)), "is too large"),
        (with_grid(I1=range(1, 10**12)), "is too large"),
    ],
    ids=["itself", "a long number", "a long negative number", "an array", "a range"],
)
def test_values_beyond_all_bounds_are_refused(source, message):
    assert message in refusal(source)


# Ranges


@pytest.mark.parametrize(
    ("start", "stop", "num"),
    [(0.1, 1.0, 10), (1e-8, 1e-2, 7), (1.0, 3.0, 1000), (20.0, 2.5, 8), (-2.0, -7.0, 33), (1e-150, 1e150, 301)],
)
def test_ranges_are_numpys_in_any_part(start, stop, num):
    for spacing, numpys in (("linear", np.linspace), ("log", np.geomspace)):
        spacing_range = read_definition(
            with_grid(omega0={"start": start, "stop": stop, "num": num, "spacing": spacing})
        ).grid.omega0
        values = spacing_range.values(np.arange(num))
        # NumPy's pow is within 4 units in the last place
        np.testing.assert_allclose(values, numpys(start, stop, num), rtol=1e-15 if spacing == "log" else 0)
        assert (values[0], values[-1]) == (start, stop)
        for index in range(0, num, 7):
            assert spacing_range.values(index) == values[index]
            np.testing.assert_array_equal(spacing_range.values(np.arange(index, num)), values[index:])


@given(st.booleans(), ranges(1e-100, 1e100, max_num=50))
@settings(max_examples=50, deadline=None, derandomize=True)
def test_both_ends_of_any_range_are_exact(negative, entry):
    if negative:
        entry |= {"start": -entry["start"], "stop": -entry["stop"]}
    values = read_definition(with_grid(omega0=entry)).grid.omega0.values(np.arange(entry["num"]))
    assert (values[0], values[-1]) == (entry["start"], entry["stop"])
    steps = np.diff(values) * np.sign(entry["stop"] - entry["start"])
    assert np.all(steps > 0)


def test_decades_are_the_numbers_people_write():
    decades = read_definition(
        with_grid(omega0={"start": 1e-150, "stop": 1e150, "num": 301, "spacing": "log"})
    ).grid.omega0
    assert decades.values(np.arange(301)).tolist() == [float(f"1e{decade}") for decade in range(-150, 151)]


def test_the_largest_doubles_do_not_overflow():
    entry = {"start": sys.float_info.max * 0.999999, "stop": sys.float_info.max, "num": 60_000, "spacing": "log"}
    with pytest.raises(DefinitionError, match="coincide"):
        read_definition(with_grid(I1=entry | {"num": 10**12}))
    values = read_definition(with_grid(I1=entry)).grid.I1.values(np.arange(60_000))
    assert np.all(np.isfinite(values))


@pytest.mark.parametrize(
    "entry",
    [
        {"start": -1.0, "stop": 1.0, "num": 4},
        {"start": -1.0, "stop": 2.0, "num": 3},
        {"start": 1e-150, "stop": 1e150, "num": 10**13, "spacing": "log"},
        {"start": 1.0, "stop": 2.0, "num": 10**15},
        {"start": -1.0, "stop": 1.0, "num": 10**9},
    ],
)
def test_ranges_that_are_allowed_however_long(entry):
    assert read_definition(with_grid(omega0=entry)).grid.omega0.num == entry["num"]


# The models are the documentation, and light


def models(model):
    yield model
    for field in model.model_fields.values():
        for inner in models_in(field.annotation):
            yield from models(inner)


def test_every_key_says_what_it_is_and_in_which_unit():
    for model in {inner for outer in MODELS for inner in models(outer)}:
        assert issubclass(model, BaseModel)
        for name, field in model.model_fields.items():
            assert len(field.description) > 5, (model, name)
    for model in (GridEntries, SpunBody):
        for name, unit in (("I1", "kg m2"), ("omega0", "rad s-1"), ("phase", "rad")):
            assert unit in model.model_fields[name].description


def test_reading_a_definition_loads_nothing_heavy(tmp_path):
    """In an empty cache: code that further processes are storing would be checked with Numba."""
    tiny = str(catalogue.FOLDER / "tiny.yaml")
    code = f"import sys; from sweeps.points import catalogue; catalogue.plan_sweep({tiny!r}); print(*sys.modules)"
    modules = python(code, NUMBA_CACHE_DIR=str(tmp_path)).split()
    heavy = {"numba", "xarray", "netCDF4", "matplotlib", "scipy", "pandas", "snakemake"} & set(modules)
    assert not heavy


# The sweeps that ship


@pytest.mark.parametrize(
    "name", repeated.but(("tiny", "tennis_racket", "bodies", "symmetric", "twist"), [p.stem for p in SHIPPED])
)
def test_shipped_sweeps_load(name):
    path = catalogue.FOLDER / f"{name}.yaml"
    sweep = read_definition(path)
    assert sweep.name == path.stem
    assert sweep.text == path.read_text()
    assert "title" in sweep.text


def read_shipped(name):
    return read_definition(catalogue.FOLDER / f"{name}.yaml")


def test_the_racket_map_is_of_bodies_on_both_sides_of_the_boundary():
    grid = read_sweep(catalogue.FOLDER / "tennis_racket.yaml").grid
    assert (grid.size, grid.shape[0]) == (331_776, 3)
    points = grid.points(0, grid.size // 3)
    I1, I2, I3 = (points[name] for name in ("I1", "I2", "I3"))
    assert triangle.triangle_margin(I1, I2, I3).min() > 0
    assert (np.maximum(I1, I2) < I3).all()  # so every rotation about axis 3 is stable
    assert 0.2 < np.mean(I1 > I2) < 0.5
    assert (I1 != I2).all()  # and none is marginal


@pytest.mark.parametrize("name", ["bodies", "breakdown"])
def test_bodies_agree_with_what_is_published(name):
    bodies = {body.name: body for body in read_shipped(name).bodies}
    I1, I2, I3 = bodies["Earth"].moments
    rotations = math.sqrt(I1 * I2 / ((I3 - I1) * (I3 - I2)))
    assert rotations == pytest.approx(304.57, abs=0.005)  # its note, to the digits printed there
    I1, I2, I3 = bodies["Moon"].moments
    assert pytest.approx(631.0213e-6, rel=1e-6) == (I3 - I1) / I2  # Williams et al. (2014), 7 digits
    assert pytest.approx(227.7317e-6, rel=1e-6) == (I2 - I1) / I3
    days = 2 * math.pi / bodies["Moon"].omega0 / 86_400
    assert days == pytest.approx(27.32166, abs=5e-6)  # as its source is quoted, to the digits printed there
    years = math.sqrt(I1 * I2 / ((I3 - I1) * (I3 - I2))) * days / 365.25
    assert years == pytest.approx(148, abs=1)
    assert all(body.source and body.axis and body.omega0 for body in bodies.values())


def moments_of_a_solid(inside, half_edges, cells=120):
    """Midpoint sums over a grid of cells: independent of any formula for the shape."""
    x, y, z = np.meshgrid(
        *[(np.arange(cells) + 0.5) / cells * 2 * half - half for half in half_edges], indexing="ij", sparse=True
    )
    mask = inside(x, y, z)
    squares = [np.mean(np.where(mask, axis**2, 0.0)) for axis in (x, y, z)]
    return np.array([sum(squares) - square for square in squares])


@pytest.mark.parametrize(
    ("name", "inside", "half_edges"),
    [
        ("Brick 3 x 2 x 1", lambda x, y, z: x < 9, (1.5, 1.0, 0.5)),
        ("Ellipsoid 4 x 3 x 2", lambda x, y, z: (x / 4) ** 2 + (y / 3) ** 2 + (z / 2) ** 2 < 1, (4, 3, 2)),
        ("Plate 2 x 1", lambda x, y, z: x < 9, (1.0, 0.5, 0.0)),
        ("Cylinder three diameters long", lambda x, y, z: y**2 + z**2 < 1, (3, 1, 1)),
        ("Cube", lambda x, y, z: x < 9, (1.0, 1.0, 1.0)),
    ],
)
def test_ideal_shapes_have_their_moments(name, inside, half_edges):
    body = next(body for body in read_shipped("breakdown").bodies if body.name == name)
    moments = moments_of_a_solid(inside, half_edges)
    given_moments = np.array(body.moments)
    # 120 cells across put the surface wrong by 1e-3 at most; the nearest wrong integers differ by 4 %.
    np.testing.assert_allclose(given_moments / given_moments[2], moments / moments[2], rtol=2e-3)


@pytest.mark.parametrize("value", [{"gravity:": None}, {3: 1}, [1], "x", {"a": math.inf}, {"a": 10**400}, {"a": True}])
def test_where_a_report_opens_is_a_mapping_to_numbers_and_words(value):
    grid = {"grid": {"I1": 1.0, "I2": 1.5, "I3": 2.0, "omega0": 1.0}}
    at = {"axis": 2, "I1": 0.5, "body": "a"}
    assert read_definition({**grid, "start_at": at}).start_at == tuple(at.items())
    with pytest.raises(DefinitionError, match=r"start_at: .*; allowed: "):
        read_definition({**grid, "start_at": value})
