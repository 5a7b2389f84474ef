import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sweeps.schema.iteration import tiles
from sweeps.shards import content_hash
from sweeps.shards.content_hash import chunk_shape

MAP_SHAPES = [(1,), (3, 4, 4, 3, 3, 2, 1), (3, 1000, 1000), (2, 65537), (5, 65536), (70000, 3), (1, 1, 10**7)]


def test_chunks_never_exceed_the_shape_nor_the_room():
    for shape in MAP_SHAPES:
        chunk = chunk_shape(shape)
        assert all(1 <= c <= n for c, n in zip(chunk, shape, strict=True))
        assert np.prod(chunk) <= content_hash.CHUNK_POINTS


@given(st.lists(st.integers(1, 9), max_size=5).map(tuple))
def test_chunks_are_runs_of_values_in_c_order_and_fill_half_of_the_room_or_all_of_the_shape(shape):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(content_hash, "CHUNK_POINTS", 12)
        chunk = chunk_shape(shape)
    assert 2 * math.prod(chunk) > min(12, math.prod(shape))
    numbers = np.arange(math.prod(shape)).reshape(shape)
    runs = [numbers[box].reshape(-1) for box in tiles(shape, chunk)]
    assert np.concatenate(runs).tolist() == list(range(numbers.size))
