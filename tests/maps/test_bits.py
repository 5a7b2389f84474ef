"""Single bits that a disk turns over, in a finished map and in shards: noticed, or without any effect.

POLHODE_FLIPS=5000 pytest -n 0 -m faults tests/maps/test_bits.py

turns as many in a map, and a fifth of it in each of two shards.
"""

import os
import random
import shutil
from collections import Counter

import damages
import pytest
from maps import DEFINITION, write

import sweeps
from sweeps.maps import validation
from sweeps.points.loading import read_sweep
from sweeps.reading import hdf5
from sweeps.reading.files import FileBytes
from sweeps.schema.refusals import RefusedError
from sweeps.shards import content_hash, shard

KINDS = ["omega_squared", "growth_rate_error", "regime", "status", "energy_drift", "samples_used"]
SMALL = DEFINITION | {"integration": {"variables": KINDS}}  # variables of each type, deflated and in one piece


def flip_bit(path, bit):
    with path.open("r+b") as file:
        file.seek(bit // 8)
        byte = file.read(1)[0]
        file.seek(bit // 8)
        file.write(bytes([byte ^ 1 << bit % 8]))


def outcome(open_file, is_whole):
    """Return the effect of a flipped bit on a map: refused, found by its hashes, no effect, or a changed text."""
    try:
        with open_file() as ds:
            if content_hash.content_hash(ds) != ds.attrs.get("content_hash"):
                return "found"
    except RefusedError:
        return "refused"
    return "no effect" if is_whole() else "text"


@pytest.fixture(scope="module")
def small_map(tmp_path_factory):
    return write(tmp_path_factory.mktemp("whole"), SMALL)


NUM_FLIPS = int(os.environ.get("POLHODE_FLIPS", 200))
LONG = [pytest.mark.slow, pytest.mark.faults]


@pytest.mark.parametrize("flips", [60, pytest.param(NUM_FLIPS * 7 // 10, marks=LONG)])
def test_a_bit_of_a_maps_numbers_is_noticed_or_changes_none(small_map, tmp_path, monkeypatch, flips):
    """Bytes other than those of numbers give their places, so the structure is read once."""
    path, structure = shutil.copy(small_map, tmp_path / "flipped.nc"), hdf5.read_structure(FileBytes(small_map))
    monkeypatch.setattr(validation, "read_structure", lambda file: structure)
    rng, ends = random.Random(flips), Counter()
    pieces = [
        (variable.filters, *place[-2:])
        for variable in structure.variables.values()
        for place in variable.places.tolist()
    ]
    for _ in range(flips):
        filters, address, size = rng.choice(pieces)
        bit = 8 * address + rng.randrange(8 * size)
        flip_bit(path, bit)
        # definitions, names and attributes were not touched, so that the structure is the same as before
        end = outcome(lambda: validation.open_file(path, any_flags=True), lambda: True)
        ends[end, "deflated" if filters else "plain"] += 1
        flip_bit(path, bit)
    print(dict(ends))
    assert ends["no effect", "plain"] == 0  # each of these bits is a number's
    # of all 11,024 deflated bits 177: a run of bytes copied from another place of equal bytes, and padding
    assert ends["no effect", "deflated"] < flips / 20


@pytest.mark.parametrize("flips", [8, pytest.param(NUM_FLIPS * 3 // 10, marks=LONG)])
def test_a_bit_anywhere_in_a_map_is_noticed_or_has_no_effect(small_map, tmp_path, flips):
    path, expected = shutil.copy(small_map, tmp_path / "flipped.nc"), damages.hash_of_content(small_map)
    rng, ends = random.Random(flips), Counter()
    for _ in range(flips):
        bit = rng.randrange(8 * small_map.stat().st_size)
        flip_bit(path, bit)
        ends[
            outcome(lambda: sweeps.open_map(path, any_flags=True), lambda: damages.hash_of_content(path) == expected)
        ] += 1
        flip_bit(path, bit)
    print(dict(ends))
    assert ends["text"] == 0
    assert ends["found"] + ends["refused"] > 0


@pytest.mark.parametrize(
    ("flips", "number"), [(8, 1), *(pytest.param(NUM_FLIPS // 5, number, marks=LONG) for number in (1, 2))]
)
def test_a_bit_of_a_shard_is_noticed_or_has_no_effect(tmp_path, number, flips):
    """Half of the bits are read by a merge: each is noticed. The rest of the file does not change the merged values."""
    sweep, sound_shard, path = read_sweep(SMALL), tmp_path / "shard.nc", tmp_path / "flipped.nc"
    shard.write_shard(sweep, number, 2, sound_shard)
    shutil.copy(sound_shard, path)

    def content():
        with shard.open_shard(path, sweep) as source:
            blocks = [{n: c.tobytes() for n, c in columns.items()} for columns in source.blocks()]
            return blocks, source.first, source.after, source.motions

    structure = hdf5.read_structure(FileBytes(sound_shard))
    places = [tuple(place[-2:]) for variable in structure.variables.values() for place in variable.places.tolist()]
    right, rng, ends = content(), random.Random(flips), Counter()
    assert len(places) == len(KINDS)
    for k in range(flips):
        address, size = rng.choice(places) if k % 2 else (0, sound_shard.stat().st_size)
        bit = 8 * address + rng.randrange(8 * size)
        inside = any(first <= bit // 8 < first + length for first, length in places)
        flip_bit(path, bit)
        try:
            end = "no effect" if content() == right else "wrong"
        except shard.DamagedError:
            end = "damaged"
        ends[end, "read" if inside else "beside"] += 1
        flip_bit(path, bit)
    print(dict(ends), f"{sum(size for _, size in places):,} of {sound_shard.stat().st_size:,} bytes are read")
    assert ends["wrong", "read"] == ends["wrong", "beside"] == 0
    assert ends["no effect", "read"] == 0
    assert ends["damaged", "read"] >= flips / 2
