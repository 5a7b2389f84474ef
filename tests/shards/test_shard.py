"""Into which blocks a shard's pieces are gathered, and what a look in a child process may take."""

import mmap
import resource

import pytest

from sweeps.reading import sandbox
from sweeps.shards import chunks, shard
from sweeps.shards.chunks import Chunks


@pytest.mark.parametrize(("first", "after"), [(0, 36), (4, 31), (5, 6)])
def test_a_block_holds_as_many_pieces_as_there_is_room_for(monkeypatch, first, after):
    monkeypatch.setattr(chunks, "CHUNK_POINTS", 3)
    monkeypatch.setattr(shard, "BLOCK_POINTS", 10)
    pieces = shard.pieces(Chunks((4, 9)), first, after)
    blocks = list(shard._blocks(pieces))
    assert [index for block in blocks for index in block] == list(range(len(pieces)))
    points = [pieces[block[-1]].after - pieces[block[0]].first for block in blocks]
    assert max(points) <= 10
    assert sum(points) == after - first
    for block, held in zip(blocks[1:], points, strict=False):
        assert held + pieces[block[0]].after - pieces[block[0]].first > 10  # no room for the next piece


def test_a_piece_beyond_the_room_is_a_block(monkeypatch):
    monkeypatch.setattr(shard, "BLOCK_POINTS", 2)
    assert list(shard._blocks(shard.pieces(Chunks((4, 9)), 0, 36))) == [range(1)]


def test_a_look_has_seconds_of_its_own_and_more_for_a_large_file():
    def look():
        return {
            "seconds": resource.getrlimit(resource.RLIMIT_CPU)[0],
            "core": resource.getrlimit(resource.RLIMIT_CORE)[0],
        }

    assert sandbox.run_in_child(look, 2**20) == {"seconds": 9, "core": 0}  # eight and what begins
    assert sandbox.run_in_child(look, 3 * 2**30)["seconds"] == 11


def test_what_is_told_is_read_to_its_end_whatever_its_length():
    text = "x" * 300_000  # a pipe holds 65,536 bytes
    assert sandbox.run_in_child(lambda: {"text": text}, 0) == {"text": text}


def test_a_look_has_room_beside_what_its_parent_has_mapped():
    """Mapped is more than used: what the child may take counts from the former."""
    with mmap.mmap(-1, 2**31):
        assert sandbox.run_in_child(lambda: {"taken": len(bytearray(2**27))}, 0) == {"taken": 2**27}
    assert sandbox.run_in_child(lambda: {"taken": len(bytearray(2**30))}, 0) is None
