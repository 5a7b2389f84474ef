"""Definitions that mean harm: words and exit status 2, or a map inside results/; never a traceback, never a shell."""

import json
import os
import time
from pathlib import Path

import damages
import pytest
import repeated
from hypothesis import example, given, settings
from hypothesis import strategies as st

import sweeps
from sweeps import systems
from sweeps.__main__ import main
from sweeps.pipeline import claims
from sweeps.points import estimate, loading
from sweeps.reading import definitions
from sweeps.schema.refusals import DefinitionError, RefusedError

FIELDS = {
    "title": "x",
    "system": "rigid_body",
    "axes": [1, 2],
    "grid": {"I1": {"start": 1.0, "stop": 2.0, "num": 3}, "I2": 2.0, "I3": [2.5, 3.0], "omega0": 1.0},
    "integration": {"propagator": "direct", "rotations": 4, "samples_per_rotation": 16, "tolerance": 1e-10},
    "shards": 2,
}
NUMBERS = st.sampled_from(
    [1e308, -1e308, 5e-324, 2.2250738585072014e-308, 1e-150, -0.0, 0, 1, -1, 2**53, 2**63, 2**64, 10**400, 1.5, True]
)
TEXTS = st.sampled_from(
    [
        *("", " ", "..", "../../etc/passwd", "/etc/passwd", "a/b", "a\nb", "a\x00b", "$(touch owned)", "`touch owned`"),
        *("; touch owned", "| touch owned", "-o owned", "--output=owned", "'\"", "{wildcards}", "{sweep}", "%s"),
        *("é", "𝔰", "\ud800", "\u202e", "a" * 5000, "<script>", "x.py", "nan"),
        "!!python/object/apply:os.system ['touch owned']",
    ]
)
SCALARS = NUMBERS | TEXTS | st.floats(allow_nan=True) | st.integers() | st.none() | st.text(max_size=8)
MODELS = [systems.resolve(name).model for name in systems.system_names()]
KEYS = ["I1", "omega0", "start", "num", "name", "ratios", "rotations"]
KEYS += [key for model in MODELS for key in model.model_fields]
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXTS | st.sampled_from(KEYS), inner, max_size=5),
    max_leaves=12,
)
YAML = st.text(alphabet="ab1:,-[]{}&*!|>'\"%@`#?~. \n\t\\ueE+\0\u2028", max_size=40)


def paths_of(value, at=()):
    """Every place in a nested value."""
    yield at
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from paths_of(item, (*at, key))


def with_change(value, at, new):
    """The value with something else at one place."""
    if not at:
        return new
    copy = dict(value) if isinstance(value, dict) else list(value)
    copy[at[0]] = with_change(value[at[0]], at[1:], new)
    return copy


PLACES = [at for at in paths_of(FIELDS) if at]


def is_accepted(source):
    """Whether a definition is taken; a refusal is words of bounded length that no terminal obeys."""
    try:
        estimate.estimate_needs(loading.read_sweep(source))
    except DefinitionError as refused:
        message = str(refused)
        assert 0 < len(message) < 20_000
        assert len(message.splitlines()) <= 11
        assert all(c.isprintable() or c == "\n" for c in message)
        assert "allowed" in message
        return False
    return True


@settings(max_examples=100)
@given(place=st.sampled_from([*PLACES, ()]), new=VALUES)
@example(("grid", "I1"), {"start": 5e-324, "stop": 1e308, "num": 2**53, "spacing": "log"})
@example(("system",), "/dev/stdin")
@example(("grid", "I1"), {"start": 1.0, "stop": 2.0, "num": 10**400})
def test_a_field_of_anything_is_taken_or_refused_of_a_mapping_and_of_a_file(tmp_path_factory, place, new):
    mapping = with_change(FIELDS, place, new)
    is_accepted(mapping)
    path = tmp_path_factory.getbasetemp() / "anything.yaml"
    path.write_bytes(json.dumps(mapping).encode("utf-8", "surrogatepass"))
    is_accepted(path)


@settings(max_examples=160)
@given(st.binary(max_size=200) | (YAML | st.text(max_size=200)).map(lambda s: s.encode("utf-8", "surrogatepass")))
@example(b"a: !!python/object/apply:os.system ['touch owned']")
@example(b"%YAML 9.9\n---\na")
@example(b"\xff\xfeg\x00r\x00")
@example(b"? {a: b}\n: c")
def test_bytes_of_any_kind_are_refused_in_words(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "bytes.yaml"
    path.write_bytes(content)
    assert not is_accepted(path)


BOMBS = {
    "laughs": "a: &a [x, x, x, x, x, x, x, x, x]\n"
    + "".join(f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)),
    "deep list": "[" * 400_000,
    "deep block": "".join(" " * k + "a:\n" for k in range(1200)),
    "long key": "? " + "a" * 900_000 + "\n: 1",
    "many keys": "".join(f"k{k}: 1\n" for k in range(90_000)),
    "one list": "axes: [" + "1," * 500_000 + "]",
    "many documents": "---\na\n" * 100_000,
    "huge num": "grid: {I1: {start: 1, stop: 2, num: 9007199254740992}, I2: 1.0, I3: 1.0, omega0: 1.0}",
    "three huge": "grid: {"
    + "".join(f"I{i}: {{start: 1, stop: 2, num: 9007199254740992}}, " for i in (1, 2, 3))
    + "omega0: 1.0}",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_takes_bounded_memory_and_time(folder, name):
    (folder / "bomb.yaml").write_text(BOMBS[name])

    def check():
        status, _, message = damages.run(["check", "bomb.yaml"])
        assert status == 2, message[-2000:]
        assert "Traceback" not in message
        assert "allowed" in message
        assert len(message) < 5000
        return 3

    assert damages.run_in_room(check, 2**31) == 3
    assert [path.name for path in folder.iterdir()] == ["bomb.yaml"]


def diagonal(value):
    return [[value * (row == column) for column in range(3)] for row in range(3)]


@pytest.mark.parametrize(
    ("size", "uncertainty"),
    [
        *((1e-200, "5 %"), (1e200, "5 %"), (1.0, 1e-200)),
        *((1e160, {"covariance": diagonal(1e290)}), (1e-140, {"covariance": diagonal(1e-290)})),
    ],
)
def test_a_variance_that_is_no_double_is_refused(size, uncertainty):
    """Not taken for zero, which would make the body exactly known."""
    body = {"name": "A", "I1": size, "I2": 1.9 * size, "I3": 2.0 * size, "uncertainty": uncertainty}
    with pytest.raises(DefinitionError, match="too large or too small for"):
        loading.read_sweep({"bodies": [body], "grid": {"omega0": 1.0}})


def test_more_values_than_yaml_is_read_for_are_refused(folder, monkeypatch):
    monkeypatch.setattr(definitions, "MAX_EVENTS", 100)
    (folder / "many.yaml").write_text("axes: [" + "1," * 100 + "]")
    with pytest.raises(DefinitionError, match=r"line 1: \(too much\) is too large; allowed: 100 values in YAML"):
        loading.read_sweep(folder / "many.yaml")


NAMES = ("..yaml", "-o owned.yaml", "$(touch owned).yaml", "a\nb.yaml", "\u202ea.yaml", "a{sweep}.yaml")
GOOD = "grid: {I1: 1.0, I2: 2.0, I3: [2.5, 3.0], omega0: 1.0}\n"


@pytest.mark.parametrize("name", NAMES)
def test_a_name_that_could_escape_is_refused(folder, name, capsys):
    (folder / "given").mkdir()
    (folder / "given" / name).write_text(GOOD)
    for command in ("check", "run"):
        assert main([command, f"given/{name}"]) == 2
        output = capsys.readouterr()
        assert "is no name for a sweep (a file's stem); allowed: " in output.err
        assert all(c.isprintable() or c == "\n" for c in output.err)
    assert [path.name for path in folder.iterdir()] == ["given"]
    assert [path.name for path in (folder / "given").iterdir()] == [name]


@settings(max_examples=60)
@given(st.text(min_size=1, max_size=70))
@example("..")
@example("a/../../b")
@example("a\n")
def test_whatever_name_is_taken_stays_below_results(name):
    try:
        accepted_name = loading.read_definition(
            json.loads('{"grid": {"I1": 1, "I2": 2, "I3": 3, "omega0": 1}}'), name
        ).name
    except RefusedError:
        return
    assert accepted_name == name
    assert Path("/r/results", accepted_name).resolve().parent == Path("/r/results")
    assert not set(accepted_name) & set(" \t\n;&|$`'\"\\*?[]{}()<>~#!%\0")


@pytest.mark.parametrize("name", ["a.b", "a-b_c.1", "A" * 64, "0"])
def test_odd_names_that_are_allowed_work(folder, name, capsys):
    (folder / f"{name}.yaml").write_text(GOOD)
    assert main(["check", f"{name}.yaml"]) == 0
    with claims.claim_folders([name]):
        assert [path.name for path in (folder / "results").iterdir()] == [name]


NO_FILES = ("/dev/zero", "/dev/stdin", "/proc/self/mem", "/", ".", "\0", "a" * 5000 + ".yaml", "fifo.yaml", "loop.yaml")


@pytest.mark.parametrize("source", NO_FILES)
def test_what_is_no_file_is_refused_at_once(folder, source, capsys):
    os.mkfifo("fifo.yaml")
    Path("loop.yaml").symlink_to("loop.yaml")
    begin = time.process_time()
    assert main(["check", source]) == 2
    assert time.process_time() - begin < 20  # no endless reading; some seconds are imports
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("name", ["a\\0b.py", "a" * 9000 + ".py", "/dev/zero.py", "."])
def test_a_system_that_is_no_file_is_refused_in_one_short_line(folder, name, capsys):
    (folder / "named.yaml").write_text(f'system: "{name}"\ngrid: {{}}\n')
    assert main(["check", "named.yaml"]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert "allowed" in message
    assert len(message) < 1000


def test_a_python_file_runs_only_where_a_person_names_it(folder, capsys):
    """A definition may name a system's file: that file is run, so a definition is as trusted as a program."""
    (folder / "evil.py").write_text("open('owned', 'w')\n")
    (folder / "named.yaml").write_text("system: ../evil.py\ngrid: {}\n")
    assert main(["check", "named.yaml"]) == 2
    assert not (folder / "owned").exists()
    capsys.readouterr()


# Maps that mean harm, at every door

GRID = {"axes": [2], "grid": {"I1": [1.0, 1.1], "I2": [1.9, 2.0], "I3": 3.0, "omega0": [1.0, 2.0]}}
FEW_PICTURES = {"integration": {"variables": ["omega_squared", "regime", "status"]}}


FINE = dict.fromkeys(damages.COMMANDS, 0)
REFUSED = dict.fromkeys(damages.COMMANDS, 2)
UNLIKE = FINE | {"verify": 1}  # it reports the differences between the map and the result of its definition
ATTRIBUTES = {
    "control characters": ({"title": "<script>owned=1</script>\x1b[31m"}, REFUSED),
    "bidirectional marks": ({"source": "Polhode \u202egnp.exe"}, REFUSED),
    "script": ({"title": "<script>owned=1</script>"}, FINE),
    "markup": ({"title": "[bold]x[/bold] [/] [link=http://x]y"}, FINE),
    "a formula that is none": ({"title": r"$\frac{$ x$^{$"}, FINE),
    "title of many lines": ({"title": "a\n" * 2000}, FINE),
    "numbers": ({"title": 7.5, "source": 3, "history": 2.0, "references": 1, "content_hash": 5}, UNLIKE),
    "definition of script": ({"definition": "</script><script>owned=1</script>"}, UNLIKE),
    "deep definition": ({"definition": "[" * 10_000}, UNLIKE),
    "odd definition": ({"definition": "integration: {tolerance: [], variables: 7}\nbodies: [{axis: 9}, 3]"}, UNLIKE),
    "a file": ({"system": "evil.py"}, REFUSED),  # of systems without an axis
    "two lines": ({"system": "rigid_body\n<b>"}, REFUSED),
}
QUICK = ("control characters", "script", "a file")
DRAWN = ("control characters", "a file", "a formula that is none", "title of many lines")  # pictures take seconds


@pytest.mark.usefixtures("few_frames")
@pytest.mark.parametrize("name", repeated.but(QUICK, ATTRIBUTES))
def test_attributes_of_any_kind_are_taken_or_refused_in_words_by_every_command(folder, name):
    attributes, expected = ATTRIBUTES[name]
    (folder / "evil.py").write_text("open('owned', 'w')\n")
    ds = sweeps.survey(GRID if "definition" in attributes else GRID | FEW_PICTURES)  # it lists the variables
    ds.assign_attrs(attributes).to_netcdf(folder / "map.nc")
    for command, words in damages.commands("map.nc").items():
        if command == "figures":
            if name not in DRAWN:
                continue
            words += ["--only", "stability"]
        end = damages.run(words)
        assert end[0] == expected[command], (command, end)
        assert damages.describe_fault(command, *end) == "", command
    assert not (folder / "owned").exists()


LARGE = {"one word": "x" * 1_000_000, "201 characters": "x" * 201}


@pytest.mark.parametrize("what", LARGE)
def test_a_name_of_a_megabyte_is_refused_in_a_line(folder, what, capsys):
    definition = {"bodies": [{"name": "A", "I1": 1.0, "I2": 2.0, "I3": 2.5}], "grid": {"omega0": 1.0}}
    sweeps.survey(definition).assign_coords(body=[LARGE[what]]).to_netcdf(folder / "map.nc")
    for door in ("show", "report"):
        assert main(damages.commands("map.nc")[door]) == 2
        message = capsys.readouterr().err
        assert message.count("\n") == 1
        assert len(message) < 300


def test_a_message_lists_some_of_many_names(folder, capsys):
    bodies = [{"name": f"{k:05d} {'x' * 90}", "I1": 1.0, "I2": 2.0, "I3": 2.5} for k in range(200)]
    sweeps.survey({"bodies": bodies, "grid": {"omega0": 1.0}, "axes": [2]}).to_netcdf(folder / "map.nc")
    for words in (["--body", "0"], ["--body", "nothing"], []):
        assert main(["point", "map.nc", *words]) == 2
        message = capsys.readouterr().err
        assert "(200 names)" in message
        assert len(message) < 11_000
