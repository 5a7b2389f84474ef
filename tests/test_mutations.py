"""Definitions and meshes with bytes turned into others: taken or refused in words, for as long as one wishes.

POLHODE_FUZZ_SECONDS=50 pytest tests/test_mutations.py

takes five minutes of one core; without the setting, some seconds.
"""

import os
import random

import numpy as np
import pytest

from sweeps.points import catalogue, loading
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.bodies import inertia

SECONDS = float(os.environ.get("POLHODE_FUZZ_SECONDS", 0.5))  # of each test, of which there are six
LEAST = 40  # mutations, however slow the machine
WORDS = [
    b"1e400",
    b"-1",
    b"0",
    b"nan",
    b".inf",
    b"9" * 400,
    b"[",
    b"]",
    b"{",
    b"&a",
    b"*a",
    b"!!",
    b"\x00",
    b"\xff\xfe",
]
WORDS += [b"4294967295", b"1000000000000", b"\n", b": ", b"- ", b"#", b"\x1b[31m", "\u202e".encode(), b"e9", b"~"]


def mutated(content, rng):
    """Some bytes changed, moved, doubled, left out, or replaced by what parsers stumble over."""
    content = bytearray(content)
    for _ in range(rng.choice([1, 1, 2, 5, 20])):
        at, size = rng.randrange(len(content) + 1), rng.choice([1, 1, 2, 8, 50])
        new = rng.choice([rng.choice(WORDS), rng.randbytes(size), b"", bytes(content[at : at + size]) * 2])
        content[at : at + rng.choice([0, size])] = new
        if not content:
            content = bytearray(b"x")
    return bytes(content)


def until_over(seed):
    """Random numbers for one mutation after the other, until so much of a processor's time is over, children's too."""
    begun, number = sum(os.times()[:4]), 0
    while number < LEAST or sum(os.times()[:4]) - begun < SECONDS:
        yield random.Random(f"{seed} {number}")
        number += 1


def test_mutated_definitions_are_taken_or_refused_in_words(tmp_path):
    sources = [path.read_bytes() for path in catalogue.shipped().values()]
    path = tmp_path / "mutated.yaml"
    for rng in until_over("definition"):
        content = mutated(rng.choice(sources), rng)
        if b".py" in content:  # which would be run, as its author means it to be
            continue
        path.write_bytes(content)
        try:
            loading.load(path, check=False)
        except DefinitionError as refused:
            said = str(refused)
            assert "allowed" in said, content
            assert len(said) < 20_000, content
            assert all(c.isprintable() or c == "\n" for c in said), content


def judged(path):
    """(Why a mesh is refused or "", its principal moments or zeros)."""
    try:
        return "", inertia.solid(path, 1000.0, None, "m").principal.moments
    except (inertia.InertiaError, inertia.MeshError) as refused:
        return f"{refused.wrong}; allowed: {refused.allowed}", (0.0, 0.0, 0.0)


@pytest.mark.parametrize("kind", ["stl", "obj", "ply", "off", "stl_ascii"])
def test_mutated_meshes_are_taken_or_refused_in_words(tmp_path, kind):
    trimesh = pytest.importorskip("trimesh")
    made = trimesh.creation.box((1.0, 2.0, 3.0)).export(file_type=kind)
    source = made if isinstance(made, bytes) else made.encode()
    path = tmp_path / f"mutated.{kind.partition('_')[0]}"
    for rng in until_over(kind):
        path.write_bytes(content := mutated(source, rng))
        said, moments = judged(path)
        assert all(c.isprintable() for c in said), content
        assert bool(said) != bool(min(moments) > 0 and np.isfinite(moments).all()), content


BOX = """ply
format ascii 1.0
element vertex 8
property float x
property float y
property float z
element face 12
property list uchar int vertex_indices
end_header
0 0 0\n0 0 1\n0 1 0\n0 1 1\n2 0 0\n2 0 1\n2 1 0\n2 1 1
3 1 3 0\n3 4 1 0\n3 0 3 2\n3 2 4 0\n3 1 7 3\n3 5 1 4\n3 5 7 1\n3 3 7 2\n3 6 4 2\n3 2 7 6\n3 6 5 4\n3 7 5 6
"""
MESHES = {
    "names a picture": BOX.replace("element vertex", "comment TextureFile ../secret.png\nelement vertex"),
    "infinite": BOX.replace("2 1 1", "2 1 1e400"),
    "beyond single precision": BOX.replace("2 1 1", "2 1 3e38").replace("float", "double"),
}


@pytest.mark.parametrize("name", MESHES)
def test_a_mesh_is_read_without_a_word_and_without_what_it_names(tmp_path, name, capfd, recwarn, monkeypatch):
    trimesh = pytest.importorskip("trimesh")
    monkeypatch.setattr(trimesh.resolvers.FilePathResolver, "get", lambda *_: pytest.fail("another file is read"))
    (tmp_path / "mesh").mkdir()
    (tmp_path / "mesh/box.ply").write_text(MESHES[name])
    said, _ = judged(tmp_path / "mesh/box.ply")
    assert bool(said) == (name != "names a picture")
    assert not [w for w in recwarn if issubclass(w.category, RuntimeWarning)]
    assert capfd.readouterr() == ("", "")
