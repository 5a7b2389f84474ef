"""Principal axes of drawn tensors: they give the tensors back, and are numbered as the nearest nominal axes."""

import numpy as np
import pytest

from sweeps.systems.uncertain_bodies.possible import ENTRIES, ORDERS, find_axes

ROWS = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))[0]
AXES = ROWS * np.linalg.det(ROWS)  # a body's own axes: rows, right-handed, in no special place


def tensors_near(moments, spread, size=1.0, count=200):
    """Return tensors that scatter about one with moments along `AXES`, shape (count, 3, 3)."""
    noise = np.random.default_rng(3).normal(size=(count, 3, 3)) * spread
    return size * (AXES.T @ np.diag(moments) @ AXES + (noise + noise.transpose(0, 2, 1)) / 2)


def principal_axes(tensors):
    """Return moments and rotations of tensors, shape (n, 3, 3)."""
    return find_axes(np.stack([tensors[:, i, j] for i, j in ENTRIES.values()], axis=-1), AXES)


@pytest.mark.parametrize(
    ("moments", "spread", "size"),
    [
        *(((1.5, 2.6, 3.1), spread, 1.0) for spread in (0.0, 1e-12, 1e-3, 0.1, 3.0)),
        *(((1.5, 2.6, 3.1), 0.1, size) for size in (1e-30, 1e30)),
        *((moments, 1e-15, 1.0) for moments in ((1, 1, 1), (1, 1, 2), (1, 2, 2), (1, 0, -1), (0, 0, 0))),
    ],
)
def test_moments_and_axes_give_the_tensor_back(moments, spread, size):
    tensors = tensors_near(moments, spread, size)
    values, rotations = principal_axes(tensors)
    rows, largest = rotations @ AXES, np.abs(tensors).max()
    # some ten roundings of the largest entry
    assert np.abs(rows.transpose(0, 2, 1) @ (values[:, :, None] * rows) - tensors).max() <= 2e-14 * largest
    assert np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3)).max() <= 1e-14
    assert np.linalg.det(rotations) == pytest.approx(1.0, abs=1e-13)


def test_each_axis_is_the_one_that_lies_nearest():
    """Of all ways to share three axes out, none fits better; a body drawn near itself hardly turns."""
    _, rotations = principal_axes(tensors_near((1.5, 2.6, 3.1), 0.5))
    fits = [np.abs(rotations[:, order, range(3)]).sum(axis=1) for order in ORDERS]
    assert (fits[0] >= np.max(fits, axis=0) - 1e-12).all()
    assert (rotations[:, [0, 1], [0, 1]] >= 0.0).all()
    assert np.abs(principal_axes(tensors_near((1.5, 2.6, 3.1), 1e-9))[1] - np.eye(3)).max() < 1e-8
