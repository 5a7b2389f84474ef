import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sweeps.schema.iteration import tiles
from sweeps.shards import content_hash
from sweeps.shards.content_hash import chunk_shape

shapes = st.lists(st.integers(1, 9), max_size=5).map(tuple)


@pytest.fixture
def small_chunks(monkeypatch):
    monkeypatch.setattr(content_hash, "CHUNK_POINTS", 12)


def test_chunks_never_exceed_the_shape_nor_the_room():
    for shape in [(1,), (3, 4, 4, 3, 3, 2, 1), (3, 1000, 1000), (2, 65537), (5, 65536), (70000, 3), (1, 1, 10**7)]:
        chunk = chunk_shape(shape)
        assert all(1 <= c <= n for c, n in zip(chunk, shape, strict=True))
        assert np.prod(chunk) <= content_hash.CHUNK_POINTS


@pytest.mark.usefixtures("small_chunks")
def test_chunks_fill_at_least_half_of_the_room_where_there_are_so_many_values():
    @given(shapes)
    @settings(max_examples=25, deadline=None)
    def check(shape):
        assert 2 * math.prod(chunk_shape(shape)) > min(content_hash.CHUNK_POINTS, math.prod(shape))

    check()


@pytest.mark.usefixtures("small_chunks")
def test_a_chunk_is_one_run_of_values_in_c_order():
    @given(shapes)
    @settings(max_examples=25, deadline=None)
    def check(shape):
        numbers = np.arange(math.prod(shape)).reshape(shape)
        runs = [numbers[box].reshape(-1) for box in tiles(shape, chunk_shape(shape))]
        assert np.concatenate(runs).tolist() == list(range(numbers.size))

    check()
