"""Samples of flows: means of neighbours in place of both."""

import numpy as np
import pytest

from kernels.compile.blocks import W

pytestmark = pytest.mark.slow  # compiling what they need takes as long as all that the quick tests need


def test_means_stand_where_every_run_has_many_samples_and_first_samples_elsewhere():
    from kernels.flow import flows

    runs, count, n, kept = 2, 9, 3, 4
    rng = np.random.default_rng(1)
    used = rng.integers(2, count + 1, (runs, W))
    weight = (np.arange(count)[None, :, None] < used[:, None]).astype(float)
    Y = rng.normal(size=(runs, count, n, W)) * weight[:, :, None]
    rows, weights, h = Y.reshape(-1, W).copy(), weight.reshape(-1, W).copy(), np.full(W, 0.25)
    flows._average_neighbours(rows, weights, runs, count, n, used.min(0).astype(float), h, kept)
    many = used.min(0) > kept
    assert 5 < many.sum() < W - 5
    both = np.minimum(weight[:, 0:8:2], weight[:, 1:8:2])
    means = 0.5 * (Y[:, 0:8:2] + Y[:, 1:8:2]) * both[:, :, None]
    expected = np.where(many, means, Y[:, :kept])
    np.testing.assert_array_equal(rows[: runs * kept * n].reshape(expected.shape), expected)
    np.testing.assert_array_equal(weights[: runs * kept].reshape(runs, kept, W), np.where(many, both, weight[:, :kept]))
    np.testing.assert_array_equal(h, np.where(many, 0.5, 0.25))
