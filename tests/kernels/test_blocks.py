import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from kernels.compile.blocks import W, cut


@given(st.lists(st.integers(0, 40), min_size=1, max_size=200), st.integers(1, 7))
def test_blocks_hold_every_point_once_by_kind_and_sorted(keys, levels):
    keys = np.array(keys, dtype=np.int64)
    order, starts = cut(keys, levels)
    # the slow way: a stable sort, and a new block wherever the kind changes or a block is full
    assert order.tolist() == sorted(range(keys.size), key=lambda i: keys[i])
    expected, kinds = [0], keys[order] // levels
    for k in range(1, keys.size):
        if kinds[k] != kinds[k - 1] or k - expected[-1] == W:
            expected.append(k)
    assert starts.tolist() == [*expected, keys.size]
