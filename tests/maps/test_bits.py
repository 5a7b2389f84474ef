"""Single bits that a disk turns over, in a finished map and in shards: noticed, or without any effect."""

import random
import shutil
from collections import Counter

import damages
import pytest
from maps import DEFINITION, write

import sweeps
from sweeps.maps import door
from sweeps.points.loading import read
from sweeps.schema.refusals import RefusedError
from sweeps.shards import content, shard


def flipped(path, bit):
    with path.open("r+b") as file:
        file.seek(bit // 8)
        byte = file.read(1)[0]
        file.seek(bit // 8)
        file.write(bytes([byte ^ 1 << bit % 8]))


def outcome(path, whole):
    """What becomes of a map with a bit turned over: refused, found by its hashes, without effect, or a text changed."""
    try:
        with sweeps.open_map(path, any_flags=True) as ds:
            if content.content_hash(ds) != ds.attrs.get("content_hash"):
                return "found"
    except RefusedError:
        return "refused"
    return "no effect" if damages.known(path) == whole else "text"


@pytest.mark.parametrize("flips", [150, pytest.param(5000, marks=[pytest.mark.slow, pytest.mark.faults])])
def test_a_bit_of_a_map_is_noticed_or_has_no_effect(tmp_path, flips):
    whole = write(tmp_path, DEFINITION)
    path, known = tmp_path / "flipped.nc", damages.known(whole)
    shutil.copy(whole, path)
    rng, ends = random.Random(flips), Counter()
    values = [place[-2:] for one in door.look(whole).variables.values() for place in one.places.tolist()]
    for k in range(flips):  # two of three in what holds numbers, the third anywhere
        address, size = (0, whole.stat().st_size) if k % 3 == 0 else rng.choice(values)
        bit = 8 * address + rng.randrange(8 * size)
        flipped(path, bit)
        ends[outcome(path, known)] += 1
        flipped(path, bit)
    print(dict(ends))
    assert ends["text"] == 0
    assert ends["found"] + ends["refused"] > flips / 2


@pytest.mark.parametrize("flips", [40, pytest.param(1000, marks=[pytest.mark.slow, pytest.mark.faults])])
def test_a_bit_of_a_shard_is_noticed_or_has_no_effect(tmp_path, flips):
    definition = read(DEFINITION)
    whole, path = tmp_path / "1-of-2.nc", tmp_path / "flipped.nc"
    shard.write_shard(definition, 1, 2, whole)
    shutil.copy(whole, path)

    def held():
        with shard.Shard(path, definition) as opened:
            return [(piece, stored) for piece, stored in opened.pieces()], opened.first, opened.after, opened.motions

    right, rng, ends = held(), random.Random(flips), Counter()
    for _ in range(flips):
        bit = rng.randrange(8 * whole.stat().st_size)
        flipped(path, bit)
        try:
            ends["no effect" if held() == right else "wrong"] += 1
        except shard.DamagedError:
            ends["damaged"] += 1
        flipped(path, bit)
    print(dict(ends))
    assert ends["wrong"] == 0
    assert ends["damaged"] > flips / 10  # 8 of 40 seen; the others left every piece as it was
