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
SMALL = DEFINITION | {"integration": {"variables": KINDS}}  # of each type, deflated and in one piece


def flipped(path, bit):
    with path.open("r+b") as file:
        file.seek(bit // 8)
        byte = file.read(1)[0]
        file.seek(bit // 8)
        file.write(bytes([byte ^ 1 << bit % 8]))


def outcome(opened, is_whole):
    """What becomes of a map with a bit turned over: refused, found by its hashes, without effect, or a text changed."""
    try:
        with opened() as ds:
            if content_hash.content_hash(ds) != ds.attrs.get("content_hash"):
                return "found"
    except RefusedError:
        return "refused"
    return "no effect" if is_whole() else "text"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return write(tmp_path_factory.mktemp("whole"), SMALL)


MANY = int(os.environ.get("POLHODE_FLIPS", 500))
LONG = [pytest.mark.slow, pytest.mark.faults]


@pytest.mark.parametrize("flips", [60, pytest.param(MANY * 7 // 10, marks=LONG)])
def test_a_bit_of_a_maps_numbers_is_noticed_or_changes_none(whole, tmp_path, flips):
    """Where numbers lie is told by other bytes, so the file is looked at once; equal content has equal hashes."""
    path, told = shutil.copy(whole, tmp_path / "flipped.nc"), hdf5.read_structure(FileBytes(whole))
    rng, ends = random.Random(flips), Counter()
    pieces = [(one.filters, *place[-2:]) for one in told.variables.values() for place in one.places.tolist()]
    for _ in range(flips):
        filters, address, size = rng.choice(pieces)
        bit = 8 * address + rng.randrange(8 * size)
        flipped(path, bit)
        # what is told and not found is the same as before: definitions, names and attributes were not touched
        end = outcome(lambda: validation.read_map(path, FileBytes(path), told, any_flags=True), lambda: True)
        ends[end, "deflated" if filters else "plain"] += 1
        flipped(path, bit)
    print(dict(ends))
    assert ends["no effect", "plain"] == 0  # each of these bits is a number's
    # of all 11,024 deflated bits 177: a run of bytes copied from another place where the same stand, and filling
    assert ends["no effect", "deflated"] < flips / 20


@pytest.mark.parametrize("flips", [8, pytest.param(MANY * 3 // 10, marks=LONG)])
def test_a_bit_anywhere_in_a_map_is_noticed_or_has_no_effect(whole, tmp_path, flips):
    path, known = shutil.copy(whole, tmp_path / "flipped.nc"), damages.known(whole)
    rng, ends = random.Random(flips), Counter()
    for _ in range(flips):
        bit = rng.randrange(8 * whole.stat().st_size)
        flipped(path, bit)
        ends[outcome(lambda: sweeps.open_map(path, any_flags=True), lambda: damages.known(path) == known)] += 1
        flipped(path, bit)
    print(dict(ends))
    assert ends["text"] == 0
    assert ends["found"] + ends["refused"] > 0


def parts(path):
    """Places in a shard of the numbers that a merge takes from it: (address, bytes)."""
    told = hdf5.read_structure(FileBytes(path))
    return [tuple(place[-2:]) for one in told.variables.values() for place in one.places.tolist()]


@pytest.mark.parametrize(
    ("flips", "number"), [(8, 1), *(pytest.param(MANY // 5, number, marks=LONG) for number in (1, 2))]
)
def test_a_bit_of_a_shard_is_noticed_or_has_no_effect(tmp_path, number, flips):
    """Half of them where a merge reads: there each is noticed. Elsewhere all that a merge takes stays as it was."""
    sweep, whole, path = read_sweep(SMALL), tmp_path / "shard.nc", tmp_path / "flipped.nc"
    shard.write_shard(sweep, number, 2, whole)
    shutil.copy(whole, path)

    def held():
        with shard.open_shard(path, sweep) as opened:
            taken = [{n: c.tobytes() for n, c in columns.items()} for columns in opened.blocks()]
            return taken, opened.first, opened.after, opened.motions

    right, places, rng, ends = held(), parts(whole), random.Random(flips), Counter()
    assert len(places) == len(KINDS)
    for k in range(flips):
        address, size = rng.choice(places) if k % 2 else (0, whole.stat().st_size)
        bit = 8 * address + rng.randrange(8 * size)
        inside = any(first <= bit // 8 < first + length for first, length in places)
        flipped(path, bit)
        try:
            end = "no effect" if held() == right else "wrong"
        except shard.DamagedError:
            end = "damaged"
        ends[end, "read" if inside else "beside"] += 1
        flipped(path, bit)
    print(dict(ends), f"{sum(size for _, size in places):,} of {whole.stat().st_size:,} bytes are read")
    assert ends["wrong", "read"] == ends["wrong", "beside"] == 0
    assert ends["no effect", "read"] == 0
    assert ends["damaged", "read"] >= flips / 2
