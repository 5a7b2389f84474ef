"""Definitions and meshes with bytes turned into others: taken or refused in words, for as long as one wishes.

POLHODE_FUZZ_SECONDS=50 pytest tests/test_mutations.py

takes five minutes of one core; without the setting, some seconds.
"""

import os
import random
import time

import numpy as np
import pytest

from sweeps.points import catalogue, loading
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.rigid_body import inertia

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
    """Random numbers for one mutation after the other, until the time is over."""
    begun, number = time.monotonic(), 0
    while number < LEAST or time.monotonic() - begun < SECONDS:
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
    except inertia.InertiaError as refused:
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
