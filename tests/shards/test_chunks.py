import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sweeps.schema.iteration import tiles
from sweeps.shards import content_hash
from sweeps.shards.content_hash import chunk_shape


@given(st.lists(st.integers(1, 9), max_size=5).map(tuple))
def test_chunks_are_runs_of_values_in_c_order_and_fill_half_of_the_room_or_all_of_the_shape(shape):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(content_hash, "CHUNK_POINTS", 12)
        chunk = chunk_shape(shape)
    assert all(1 <= c <= n for c, n in zip(chunk, shape, strict=True))
    assert min(12, math.prod(shape)) / 2 < math.prod(chunk) <= 12
    numbers = np.arange(math.prod(shape)).reshape(shape)
    runs = [numbers[box].reshape(-1) for box in tiles(shape, chunk)]
    assert np.concatenate(runs).tolist() == list(range(numbers.size))
