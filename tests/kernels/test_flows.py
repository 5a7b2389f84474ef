"""Samples of flows: means of neighbours in place of both."""

import numpy as np
import pytest

from kernels.compile.blocks import W

pytestmark = pytest.mark.slow  # compiling their kernels takes as long as compiling those of all quick tests


def test_means_stand_where_every_run_has_many_samples_and_first_samples_elsewhere():
    from kernels.flow import flows

    runs, count, n, num_rows = 2, 9, 3, 4
    rng = np.random.default_rng(1)
    num_samples = rng.integers(2, count + 1, (runs, W))
    weight = (np.arange(count)[None, :, None] < num_samples[:, None]).astype(float)
    Y = rng.normal(size=(runs, count, n, W)) * weight[:, :, None]
    rows, weights, h = Y.reshape(-1, W).copy(), weight.reshape(-1, W).copy(), np.full(W, 0.25)
    flows._average_neighbours(rows, weights, runs, count, n, num_samples.min(0).astype(float), h, num_rows)
    has_many = num_samples.min(0) > num_rows
    assert 5 < has_many.sum() < W - 5
    joint_weights = np.minimum(weight[:, 0:8:2], weight[:, 1:8:2])
    means = 0.5 * (Y[:, 0:8:2] + Y[:, 1:8:2]) * joint_weights[:, :, None]
    expected = np.where(has_many, means, Y[:, :num_rows])
    np.testing.assert_array_equal(rows[: runs * num_rows * n].reshape(expected.shape), expected)
    np.testing.assert_array_equal(
        weights[: runs * num_rows].reshape(runs, num_rows, W), np.where(has_many, joint_weights, weight[:, :num_rows])
    )
    np.testing.assert_array_equal(h, np.where(has_many, 0.5, 0.25))
