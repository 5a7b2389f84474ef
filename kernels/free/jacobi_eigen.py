r"""Principal moments and axes of many bodies near a body of known principal axes, by Jacobi's rotations.

A tensor of inertia T is first transformed to the known body's axes, :math:`A T A^\mathsf{T}` (A has them as rows), in
which it is nearly diagonal. Each rotation of a plane (p, q) by the angle φ of

.. math:: \tan\varphi = \frac{\mathrm{sign}\,\theta}{|\theta| + \sqrt{\theta^2 + 1}}, \qquad
          \theta = \frac{T_{qq} - T_{pp}}{2 T_{pq}}

makes T_pq vanish, and the sum of squares off the diagonal falls by 2 T_pq²; the rows of the product of all rotations
are the principal axes. Three planes are a sweep; two or three sweeps are enough, also for nearly equal moments.

The error of a moment is a few roundings of the largest moment, that of an axis the same over the gap between its
moment and the next: if two moments are equal to a rounding, any two axes in their plane are principal, and the
returned pair is arbitrary.

Source: Golub and Van Loan, Matrix Computations, section 8.5; Press et al., Numerical Recipes, section 11.1.
"""

import math

import numpy as np

from kernels.compile.jit import INLINE, OPTIONS, float64, njit, void

MAX_SWEEPS = 12  # A bound; convergence is quadratic and takes two or three.
NEGLIGIBLE_ENTRY = 2.0**-60  # off-diagonal over diagonal entries, below which no moment or axis changes by a rounding
PLANES = ((0, 1), (0, 2), (1, 2))
ORDERS = ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0))


@njit(**INLINE)
def _transform_tensor(entries, axes, T):
    """Write the tensor of six entries xx, yy, zz, xy, xz, yz, along axes (rows), into T, shape (3, 3)."""
    xx, yy, zz, xy, xz, yz = entries
    for i in range(3):
        a, b, c = axes[i, 0], axes[i, 1], axes[i, 2]
        x, y, z = xx * a + xy * b + xz * c, xy * a + yy * b + yz * c, xz * a + yz * b + zz * c
        for j in range(i + 1):
            T[i, j] = T[j, i] = x * axes[j, 0] + y * axes[j, 1] + z * axes[j, 2]


@njit(**INLINE)
def _rotate(T, rows, p, q):
    """Rotate the plane (p, q) so that T_pq vanishes, and the axes with it."""
    product = T[p, q]
    theta = (T[q, q] - T[p, p]) / (2.0 * product)
    t = math.copysign(1.0, theta) / (abs(theta) + math.sqrt(theta * theta + 1.0))
    c = 1.0 / math.sqrt(t * t + 1.0)
    s = t * c
    T[p, p] -= t * product
    T[q, q] += t * product
    T[p, q] = T[q, p] = 0.0
    r = 3 - p - q
    x, y = T[r, p], T[r, q]
    T[r, p] = T[p, r] = c * x - s * y
    T[r, q] = T[q, r] = s * x + c * y
    for k in range(3):
        x, y = rows[p, k], rows[q, k]
        rows[p, k], rows[q, k] = c * x - s * y, s * x + c * y


@njit(**INLINE)
def _diagonalise(T, rows):
    """Write principal moments onto the diagonal of T, and their axes into ``rows``."""
    for i in range(3):
        for k in range(3):
            rows[i, k] = 1.0 if i == k else 0.0
    for _ in range(MAX_SWEEPS):
        size = NEGLIGIBLE_ENTRY * (abs(T[0, 0]) + abs(T[1, 1]) + abs(T[2, 2]))
        if not max(abs(T[0, 1]), abs(T[0, 2]), abs(T[1, 2])) > size:
            break
        for p, q in PLANES:
            if T[p, q] != 0.0:
                _rotate(T, rows, p, q)


@njit(**INLINE)
def _nearest_order(rows):
    """Return the number of the row nearest to each coordinate axis: the first best of all permutations."""
    best, nearest = -1.0, ORDERS[0]
    for order in ORDERS:
        fit = abs(rows[order[0], 0]) + abs(rows[order[1], 1]) + abs(rows[order[2], 2])
        if fit > best:
            best, nearest = fit, order
    return nearest


@njit(**INLINE)
def _determinant(rows):
    """Return the determinant of three rows."""
    return (
        rows[0, 0] * (rows[1, 1] * rows[2, 2] - rows[1, 2] * rows[2, 1])
        - rows[0, 1] * (rows[1, 0] * rows[2, 2] - rows[1, 2] * rows[2, 0])
        + rows[0, 2] * (rows[1, 0] * rows[2, 1] - rows[1, 1] * rows[2, 0])
    )


@njit(void(float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[:, :, ::1]), nogil=True, **OPTIONS)
def axes_near(entries, axes, moments, rotations):
    """Fill principal moments and axes of tensors, numbered as the nearest axes of a known body.

    Args:
        entries (numpy.ndarray, shape (n, 6)): xx, yy, zz, xy, xz, yz of each tensor, in kg m2.
        axes (numpy.ndarray, shape (3, 3)): The known body's principal axes as rows, right-handed.
        moments (numpy.ndarray, shape (n, 3)): Written: principal moments, in kg m2, of any sign.
        rotations (numpy.ndarray, shape (n, 3, 3)): Written: rotation matrices from components along the known body's
            axes to those along the tensor's: row i is the tensor's axis i, within a right angle of the known axis,
            except for the third if right-handedness reverses it.
    """
    T, rows = np.empty((3, 3)), np.empty((3, 3))
    for n in range(entries.shape[0]):
        _transform_tensor(entries[n], axes, T)
        _diagonalise(T, rows)
        order = _nearest_order(rows)
        for i in range(3):
            j = order[i]
            sign = -1.0 if rows[j, i] < 0.0 else 1.0
            moments[n, i] = T[j, j]
            for k in range(3):
                rotations[n, i, k] = sign * rows[j, k]
        if _determinant(rotations[n]) < 0.0:
            for k in range(3):
                rotations[n, 2, k] = -rotations[n, 2, k]
