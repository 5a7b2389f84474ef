"""Damaged definitions, tables and meshes through the commands that read them: words, and no other file is touched.

    POLHODE_FUZZ_FILES=400 pytest -m faults tests/test_fuzz.py

takes so many files of each of eleven kinds; without the marker, two of each. The same numbers make the same files.
"""

import os
import random
import re
import sys
from functools import cache
from pathlib import Path

import damages
import h5py
import numpy as np
import pytest
from maps import BODIES, write

from sweeps.commands import program
from sweeps.points import tables

SECRET = "secret.txt"
GRID = "grid: {I2: 1.0, I3: 1.0, omega0: 1.0}\n"
MESH = "bodies: [{name: A, mesh: {file: FILE, unit: m, density: 1000.0}}]\ngrid: {omega0: 1.0}\n"
DEFINITIONS = {
    "yaml": "title: A\ngrid: {I1: {start: 0.5, stop: 1.5, num: 3}, I2: 1.0, I3: [1, 2], omega0: 1.0}\nshards: 2\n",
    "json": '{"bodies": [{"name": "A", "I1": 1, "I2": 2, "I3": 2.5, "uncertainty": "5 %"}], "grid": {"omega0": 1}}',
    "described": "system: pendulum\ngrid: {length: [0.5, 1.0], gravity: 9.8}\n",
}
SMALL_DEFINITION = {"integration": {"variables": ["omega_squared", "regime", "status"]}, "axes": [2]}
TABLES, MESHES = ("csv", "nc", "parquet"), ("stl", "ply", "obj", "off", "stl_ascii")
WORDS = [SECRET.encode(), f"../{SECRET}".encode(), b"/etc/passwd", b"file:///etc/passwd", b"[[", b"&a [*a]"]
WORDS += [b"1e400", b"-1", b"0", b"nan", b".inf", b"9" * 400]
WORDS += [b"[", b"]", b"{", b"&a", b"*a", b"!!", b"\x00", b"\xff\xfe"]
WORDS += [b"4294967295", b"1000000000000", b"\n", b": ", b"- ", b"#", b"\x1b[31m", "\u202e".encode(), b"e9", b"~"]


def mutate(content, rng):
    """Change, move, double or leave out some bytes, or put words in their place over which parsers stumble."""
    content = bytearray(content)
    for _ in range(rng.choice([1, 1, 2, 5, 20])):
        at, size = rng.randrange(len(content) + 1), rng.choice([1, 1, 2, 8, 50])
        new = rng.choice([rng.choice(WORDS), rng.randbytes(size), b"", bytes(content[at : at + size]) * 2])
        content[at : at + rng.choice([0, size])] = new
        content = content or bytearray(b"x")
    return bytes(content)


def splice(content, rng):
    """Put a part of a file into another place of it."""
    a, b, c = sorted(rng.randrange(len(content) + 1) for _ in range(3))
    return content[:a] + content[b:c] + content[a:]


def insert_words(content, rng):
    at = rng.randrange(len(content) + 1)
    return content[:at] + rng.choice(WORDS) + content[at + rng.choice([0, 0, 8]) :]


GENERATORS = (
    mutate,
    lambda content, rng: damages.noisy(content, rng.random()),
    lambda content, rng: content[: rng.randrange(len(content))],
    splice,
    insert_words,
)


def seeds(folder):
    """Return kind → (name of a file, its bytes, the definition that names it or "")."""
    trimesh, pyarrow = pytest.importorskip("trimesh"), pytest.importorskip("pyarrow")
    from pyarrow import parquet

    files = {f"definition {k}": (f"my.{k if k == 'json' else 'yaml'}", v.encode(), "") for k, v in DEFINITIONS.items()}
    (folder / "a.csv").write_text("I1,epsilon\n" + "".join(f"{1 + k / 100},{1e-6}\n" for k in range(50)))
    with h5py.File(folder / "a.nc", "w") as file:
        file.create_dataset("I1", data=np.linspace(1, 2, 500), chunks=(100,), compression="gzip")
    parquet.write_table(pyarrow.table({"I1": np.linspace(1, 2, 500)}), folder / "a.parquet")
    for kind in TABLES:
        files[f"table {kind}"] = f"a.{kind}", (folder / f"a.{kind}").read_bytes(), f"table: a.{kind}\n{GRID}"
    for kind in MESHES:
        mesh = trimesh.creation.box((1.0, 2.0, 3.0)).export(file_type=kind)
        name = f"a.{kind.partition('_')[0]}"
        files[f"mesh {kind}"] = name, mesh if isinstance(mesh, bytes) else mesh.encode(), MESH.replace("FILE", name)
    return files


def commands(kind, name):
    """Return name → words of the commands that read such a file."""
    definition = name if kind.startswith("definition") else "my.yaml"
    return {
        "check": ["check", definition],
        "shard": ["shard", definition, "1", "999999999", "-o", "s.nc"],
        "merge": ["merge", definition, "none.nc", "-o", "m.nc"],
        "verify": ["verify", "whole.nc", "--definition", definition, "--points", "1"],
    }


build_program = cache(program.build)  # the parser, made once
PATHS_READ = []  # paths that this process opens, by Python's audit events; a child of the reader can open nothing
sys.addaudithook(lambda event, args: event == "open" and PATHS_READ.append(args[0]))
QUICK, FILES = (
    2,
    int(os.environ.get("POLHODE_FUZZ_FILES", 10)),
)  # number of damaged files of each kind, in quick tests and in all


@pytest.fixture(scope="module")
def seed_files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("seeds")
    return seeds(folder), write(folder, BODIES | SMALL_DEFINITION, "whole.nc")


KINDS = [*(f"definition {k}" for k in DEFINITIONS), *(f"table {k}" for k in TABLES), *(f"mesh {k}" for k in MESHES)]


@pytest.mark.parametrize("number", [QUICK, pytest.param(FILES, marks=pytest.mark.faults)])
@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files_end_well_or_are_refused(kind, number, seed_files, tmp_path, monkeypatch):
    files, sound_map = seed_files
    name, content, definition = files[kind]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tables, "cache_folder", lambda: tmp_path / "cache")
    monkeypatch.setattr(program, "build", build_program)
    Path(SECRET).write_text("secret")
    Path("whole.nc").write_bytes(sound_map.read_bytes())
    words_of = commands(kind, name)
    for k in range(number):
        rng = random.Random(f"{kind} {k}")
        Path(name).write_bytes(damaged_content := rng.choice(GENERATORS)(content, rng))
        if name.startswith("my.") and b".py" in damaged_content:
            continue
        if definition:
            Path("my.yaml").write_text(definition)
        before = {*os.listdir()}
        PATHS_READ.clear()
        command = [*words_of][k % len(words_of)]
        faults = damages.one_by_one({word: words_of[word] for word in {command, next(iter(words_of))}})
        messages = {w for w in faults.values() if not re.match("[0-9]+ lines: .*allowed", w)}  # a line a problem
        assert not messages, (kind, k)
        outputs = {*os.listdir()} - before
        assert outputs <= {"s.nc", "m.nc", "cache"}, (kind, k)
        paths = {Path(os.fsdecode(p)).name for p in PATHS_READ if isinstance(p, str | bytes)}
        assert not paths & {SECRET, "passwd"}, (kind, k)
        for output in outputs - {"cache"}:
            Path(output).unlink()
