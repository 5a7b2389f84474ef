import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sweeps.shards import chunks
from sweeps.shards.chunks import Chunks, chunk_shape

shapes = st.lists(st.integers(1, 9), max_size=5).map(tuple)


@pytest.fixture
def room(monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK_POINTS", 12)


def test_chunks_never_exceed_the_shape_nor_the_room():
    for shape in [(1,), (3, 4, 4, 3, 3, 2, 1), (3, 1000, 1000), (2, 65537), (5, 65536), (70000, 3), (1, 1, 10**7)]:
        chunk = chunk_shape(shape)
        assert all(1 <= c <= n for c, n in zip(chunk, shape, strict=True))
        assert np.prod(chunk) <= chunks.CHUNK_POINTS


@pytest.mark.usefixtures("room")
def test_chunks_fill_at_least_half_of_the_room_where_there_are_so_many_values():
    @given(shapes)
    @settings(max_examples=25, deadline=None)
    def check(shape):
        assert 2 * Chunks(shape).points > min(chunks.CHUNK_POINTS, math.prod(shape))

    check()


@pytest.mark.usefixtures("room")
def test_a_chunk_is_one_run_of_values_in_c_order():
    @given(shapes)
    @settings(max_examples=25, deadline=None)
    def check(shape):
        cut, numbers = Chunks(shape), np.arange(math.prod(shape)).reshape(shape)
        found = []
        for k in range(cut.holding(numbers.size - 1) + 1):
            first, after = cut.bounds(k)
            box = tuple(slice(at, at + length) for at, length in zip(cut.offset(k), cut.shape, strict=True))
            assert numbers[box].reshape(-1).tolist() == list(range(first, after))
            assert {cut.holding(first), cut.holding(after - 1)} == {k}
            assert all(at % length == 0 for at, length in zip(cut.offset(k), cut.shape, strict=True))
            found += range(first, after)
        assert found == list(range(numbers.size))

    check()


@pytest.mark.usefixtures("room")
def test_any_run_of_values_is_shared_out_among_chunks_once():
    @given(shapes, st.data())
    @settings(max_examples=25, deadline=None)
    def check(shape, data):
        cut, size = Chunks(shape), math.prod(shape)
        first = data.draw(st.integers(0, size))
        after = data.draw(st.integers(first, size))
        found = []
        for number, low, high in cut.between(first, after):
            begin, end = cut.bounds(number)
            assert begin <= low < high <= end
            found += range(low, high)
        assert found == list(range(first, after))

    check()


def test_numbers_beyond_64_bits_have_a_chunk():
    cut = Chunks((10**9, 10**9, 10**9))
    point = 10**26 + 12345
    first, after = cut.bounds(cut.holding(point))
    assert first <= point < after
    assert after - first <= chunks.CHUNK_POINTS
