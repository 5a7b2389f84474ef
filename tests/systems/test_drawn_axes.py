"""Principal axes of drawn tensors: they give the tensors back, and are numbered as the nearest nominal axes."""

import numpy as np
import pytest

from sweeps.systems.uncertain_bodies.possible import ENTRIES, ORDERS, find_axes

KNOWN = np.diag([1.5, 2.6, 3.1])


@pytest.fixture(scope="module")
def axes():
    """A body's own axes: rows, right-handed, in no special place."""
    rows = np.linalg.qr(np.random.default_rng(7).normal(size=(3, 3)))[0]
    return rows * np.linalg.det(rows)


def principal_axes(tensors, axes):
    """Moments and rotations of tensors, shape (n, 3, 3)."""
    entries = np.stack([tensors[:, i, j] for i, j in ENTRIES.values()], axis=-1)
    return find_axes(entries, axes)


def symmetric(spread, count=200, middle=KNOWN, axes=None):
    axes = np.eye(3) if axes is None else axes
    noise = np.random.default_rng(3).normal(size=(count, 3, 3)) * spread
    return axes.T @ middle @ axes + (noise + noise.transpose(0, 2, 1)) / 2


@pytest.mark.parametrize("spread", [0.0, 1e-12, 1e-3, 0.1, 3.0])
@pytest.mark.parametrize("size", [1e-30, 1.0, 1e30])
def test_moments_are_those_of_lapack_and_axes_give_the_tensor_back(axes, spread, size):
    tensors = size * symmetric(spread, axes=axes)
    moments, rotations = principal_axes(tensors, axes)
    largest = np.abs(tensors).max()
    # both take some ten roundings of the largest entry
    assert np.abs(np.sort(moments, axis=1) - np.linalg.eigvalsh(tensors)).max() <= 2e-14 * largest
    rows = rotations @ axes
    assert np.abs(rows.transpose(0, 2, 1) @ (moments[:, :, None] * rows) - tensors).max() <= 2e-14 * largest
    assert np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3)).max() <= 1e-14
    assert np.linalg.det(rotations) == pytest.approx(1.0, abs=1e-13)


def test_each_axis_is_the_one_that_lies_nearest(axes):
    """Of all ways to share three axes out, none fits better; a body drawn near itself hardly turns."""
    tensors = symmetric(0.5, axes=axes)
    _, rotations = principal_axes(tensors, axes)
    fits = [np.abs(rotations[:, order, range(3)]).sum(axis=1) for order in ORDERS]
    assert (fits[0] >= np.max(fits, axis=0) - 1e-12).all()
    assert (rotations[:, [0, 1], [0, 1]] >= 0.0).all()
    assert np.abs(principal_axes(symmetric(1e-9, axes=axes), axes)[1] - np.eye(3)).max() < 1e-8


@pytest.mark.parametrize(
    "middle",
    [np.eye(3), np.diag([1.0, 1.0, 2.0]), np.diag([1.0, 2.0, 2.0]), np.diag([1.0, 0.0, -1.0]), np.zeros((3, 3))],
)
def test_equal_and_vanishing_moments_still_give_axes(axes, middle):
    for spread in (0.0, 1e-17, 1e-15):
        tensors = symmetric(spread, 20, middle, axes)
        moments, rotations = principal_axes(tensors, axes)
        assert np.abs(np.sort(moments, axis=1) - np.sort(np.diag(middle))).max() <= 1e-14
        assert np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3)).max() <= 1e-14
        assert np.linalg.det(rotations) == pytest.approx(1.0, abs=1e-13)
