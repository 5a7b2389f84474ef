"""Rotations of free bodies by SciPy's DOP853, in the body's axes and in space: a reference of tests."""

import math

import numpy as np
from scipy.integrate import solve_ivp


def rotate(inertia, omega, end, axes=None, **options):
    """Return SciPy's solution until `end`: ω, then the axes of space in the body as rows, of Euler's equations.

    `inertia` has three moments, or a tensor; `axes` are those at the start, the body's own if left out.
    """
    tensor = np.diag(inertia) if np.ndim(inertia) == 1 else np.asarray(inertia)
    inverse = np.linalg.inv(tensor)

    def rates(_, y):
        w = y[:3]
        return np.concatenate([inverse @ np.cross(tensor @ w, w), np.cross(y[3:].reshape(3, 3), w).ravel()])

    start = np.concatenate([omega, np.ravel(np.eye(3) if axes is None else axes)])
    tight = {"rtol": 1e-12, "atol": 1e-14 * np.linalg.norm(omega)}
    return solve_ivp(rates, (0.0, end), start, "DOP853", **tight, **options)


def in_space(states, vector):
    """Return components in space, shape (n, 3), of a vector that turns with the body, from columns of states."""
    return states[3:].T.reshape(-1, 3, 3) @ vector


def azimuth(vectors, axis):
    """Return the continuous angle of vectors, shape (n, 3), about an axis."""
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    return np.unwrap(np.arctan2(vectors @ np.cross(axis / np.linalg.norm(axis), side), vectors @ side))


def spin(axis, omega0, epsilon, phase):
    """Return the angular velocity of a spin with its perturbation."""
    return np.roll(omega0 * np.array([1.0, epsilon * math.cos(phase), epsilon * math.sin(phase)]), axis - 1)
