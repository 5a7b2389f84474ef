r"""Linear theory: the normal modes about an equilibrium, and a bound on every possible rate.

:math:`V'' v = \omega^2 a v` with :math:`v^{\mathsf T} a v = 1`, signed :math:`\omega^2` in ascending order, from
the symmetric eigenproblem of :math:`L^{-1}V''L^{-\mathsf T}`, :math:`a = LL^{\mathsf T}`.

The scale S of a point is no theory: :math:`S^2 = \lVert M\rVert / \lambda_{\min}(\bar a)`, M the sums of the absolute
values of the terms of V″ with each coordinate in units of :math:`a_{ii}^{-1/2}`, :math:`\bar a` the matrix a in the
same units, bounds every :math:`|\omega^2|` and stays put where terms cancel and a rate goes through zero. It sets how
long a run is and how closely it is sampled.

Source: Landau and Lifshitz, Mechanics, section 23.
"""

import numpy as np

from kernels.matrices import by_matrix


def normal_modes(hessian, a):
    """Return the signed ω² and the modes of many points.

    Args:
        hessian: V″, shape (points, n, n).
        a: kinetic matrix, shape (points, n, n), positive definite.

    Returns:
        ω² in s-2, shape (points, n), ascending, and the modes, shape (points, n, n), mode k in [:, :, k], its largest
        component positive; NaN where V″ or a is not finite or a is not positive.
    """
    points, n = hessian.shape[:2]
    if n == 1:
        with np.errstate(all="ignore"):
            mass = np.where(a > 0.0, a, np.nan)
            return hessian[:, 0] / mass[:, 0], 1.0 / np.sqrt(mass)
    squares, vectors = np.full((points, n), np.nan), np.full((points, n, n), np.nan)
    which = np.flatnonzero(np.isfinite(hessian).all(axis=(1, 2)) & positive(a))
    unit = 1.0 / np.sqrt(np.einsum("pii->pi", a[which]))
    pair = unit[:, :, None] * unit[:, None, :]
    inverse = by_matrix(lambda a: np.linalg.inv(np.linalg.cholesky(a)), a[which] * pair)
    sound = np.isfinite(inverse).all(axis=(1, 2))
    which, unit, inverse = which[sound], unit[sound], inverse[sound]
    turned = np.swapaxes(inverse, 1, 2)
    squares[which], directions = np.linalg.eigh(inverse @ (hessian[which] * pair[sound]) @ turned)
    vectors[which] = unit[:, :, None] * (turned @ directions)
    largest = np.take_along_axis(vectors, np.abs(vectors).argmax(axis=1)[:, None, :], axis=1)
    return squares, vectors * np.where(largest < 0.0, -1.0, 1.0)


def scale(hessian_terms, a):
    """Return S in s-1, shape (points,); NaN where a is not positive definite or V has no curvature."""
    pair, least = _in_own_units(a)
    with np.errstate(all="ignore"):
        bound = np.sqrt(np.square(hessian_terms * pair).sum(axis=(1, 2)))
        S = np.sqrt(bound / np.where(least > 0.0, least, np.nan))
    return np.where(bound == 0.0, np.nan, S)


def positive(a):
    """Return True where a is finite and positive definite, shape (points,)."""
    return _in_own_units(a)[1] > 0.0


def _in_own_units(a):
    """Return factors that give a a diagonal of one, and its least eigenvalue then, NaN where it is not finite."""
    with np.errstate(all="ignore"):
        unit = 1.0 / np.sqrt(np.einsum("pii->pi", a))
        pair = unit[:, :, None] * unit[:, None, :]
        unit_a, least = a * pair, np.full(len(a), np.nan)
    sound = np.isfinite(unit_a).all(axis=(1, 2))
    least[sound] = np.linalg.eigvalsh(unit_a[sound])[:, 0]
    return pair, least
