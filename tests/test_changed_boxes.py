import numpy as np

from sweeps.schema.boxes import changed


def test_what_changes_between_two_planes():
    before = np.zeros((5, 7), int)
    after = before.copy()
    after[1, 2] = after[3, 4] = 1
    assert changed(None, after) == (slice(0, 5), slice(0, 7))
    assert changed(before, after) == (slice(1, 4), slice(2, 5))
    assert changed(after, after) == (slice(0, 1), slice(0, 1))
