r"""Linear theory: the normal modes about an equilibrium, and a bound on every possible rate.

:math:`V'' v = \omega^2 a v` with :math:`v^{\mathsf T} a v = 1`, signed :math:`\omega^2` in ascending order, from
the symmetric eigenproblem of :math:`L^{-1}V''L^{-\mathsf T}`, :math:`a = LL^{\mathsf T}`.

The scale S of a point is no theory: :math:`S^2 = \lVert M\rVert / \lambda_{\min}(\bar a)`, M the sums of the absolute
values of the terms of V″ with each coordinate in units of :math:`a_{ii}^{-1/2}`, :math:`\bar a` the matrix a in the
same units, bounds every :math:`|\omega^2|`, and does not vanish if terms cancel and a rate goes through zero. It
determines the length and the sampling of runs.

If these terms vanish with V″ (V = x⁴: a degenerate equilibrium), they are replaced by their values within a
perturbation of relative size one: so the bound is small if the rate depends on the perturbation's size alone.

*Size.* The description states the perturbation of relative size one. By default it is 1 for an angle in rad; else the
distance over which the terms of V″ grow at most fourfold, and at most half the bounds.

*Too wide.* A perturbation that leaves the bounds, meets a pole, or over which V″ grows beyond thirty times its terms
would measure the motion near another place.

Source: Landau and Lifshitz, Mechanics, section 23.
"""

import numpy as np

from kernels.flow.matrices import apply_by_matrix

MAX_TERM_GROWTH = 4.0  # growth of the terms of V″ within a perturbation of relative size one
MAX_HALVINGS = 100  # halvings of a distance until V″ is finite within it
MAX_SIZE_HALVINGS = 40  # halvings of half the bounds; smaller distances are within the rounding of the place
MAX_ZERO_TERMS, ZERO_CHECK_DISTANCE = 1e-6, 1e-3  # terms count as 0 below this, relative to |V″| within this many sizes
MAX_WIDE_GROWTH = 30.0  # growth of V″ within a perturbation, relative to its terms; beyond: perturbation_too_large


def normal_modes(hessian, a):
    """Return the signed ω² and the modes of many points, from V″ and kinetic matrices, shape (points, n, n).

    Returns:
        ω² in s-2, shape (points, n), ascending, and the modes, shape (points, n, n), mode k in [:, :, k], its largest
        component positive; NaN if V″ or a is not finite, or a not positive definite.
    """
    points, n = hessian.shape[:2]
    if n == 1:
        with np.errstate(all="ignore"):
            mass = np.where(a > 0.0, a, np.nan)
            return hessian[:, 0] / mass[:, 0], 1.0 / np.sqrt(mass)
    squares, vectors = np.full((points, n), np.nan), np.full((points, n, n), np.nan)
    rows = np.flatnonzero(np.isfinite(hessian).all(axis=(1, 2)) & is_positive_definite(a))
    unit = 1.0 / np.sqrt(np.einsum("pii->pi", a[rows]))
    pair = unit[:, :, None] * unit[:, None, :]
    inverse = apply_by_matrix(lambda a: np.linalg.inv(np.linalg.cholesky(a)), a[rows] * pair)
    is_regular = np.isfinite(inverse).all(axis=(1, 2))
    rows, unit, inverse = rows[is_regular], unit[is_regular], inverse[is_regular]
    inverse_transpose = np.swapaxes(inverse, 1, 2)
    squares[rows], directions = np.linalg.eigh(inverse @ (hessian[rows] * pair[is_regular]) @ inverse_transpose)
    vectors[rows] = unit[:, :, None] * (inverse_transpose @ directions)
    largest = np.take_along_axis(vectors, np.abs(vectors).argmax(axis=1)[:, None, :], axis=1)
    return squares, vectors * np.where(largest < 0.0, -1.0, 1.0)


def scale(hessian_terms, a):
    """Return S in s-1, shape (points,); NaN if a is not positive definite or V has no curvature."""
    pair, smallest = _scale_to_unit_diagonal(a)
    with np.errstate(all="ignore"):
        bound = np.sqrt(np.square(hessian_terms * pair).sum(axis=(1, 2)))
        S = np.sqrt(bound / np.where(smallest > 0.0, smallest, np.nan))
    return np.where(bound == 0.0, np.nan, S)


def is_positive_definite(a):
    """Return True if a is finite and positive definite, shape (points,)."""
    return _scale_to_unit_diagonal(a)[1] > 0.0


def _scale_to_unit_diagonal(a):
    """Return the factors 1/√(a_ii a_jj), shape (n, m, m), and the smallest eigenvalue of the scaled a."""
    with np.errstate(all="ignore"):
        unit = 1.0 / np.sqrt(np.einsum("pii->pi", a))
        pair = unit[:, :, None] * unit[:, None, :]
        unit_a, smallest = a * pair, np.full(len(a), np.nan)
    is_finite = np.isfinite(unit_a).all(axis=(1, 2))
    smallest[is_finite] = np.linalg.eigvalsh(unit_a[is_finite])[:, 0]
    return pair, smallest


# -- sizes


def largest_curvature(landscape, parameters, place, distance):
    """Return bounds on |V″| within distances of places, shape (points, n, n), infinite at poles.

    Args:
        landscape: F and its slopes.
        parameters: one array (points,) for each.
        place: shape (points, n).
        distance: of each coordinate, shape (points, n).
    """
    values, states = landscape.enclose(parameters, place - distance, place + distance)
    size = np.abs(values[:, :, 1:]).max(axis=-1)
    size[(states > 0) | ~np.isfinite(size).all(axis=(1, 2))] = np.inf
    return size


def sizes(landscape, parameters, place, terms):
    """Return perturbations of relative size one, shape (points, n).

    Args:
        landscape: F and its slopes.
        parameters: one array (points,) for each.
        place: equilibria, shape (points, n).
        terms: absolute terms of V″, shape (points, n, n).
    """
    sizes_described = landscape.sizes(parameters, list(place.T))
    for i, c in enumerate(landscape.equations.system.kept):
        if c.size is None:
            sizes_described[:, i] = 1.0 if c.unit == "rad" else _neighbourhood(landscape, parameters, place, terms, i)
    return sizes_described


def _neighbourhood(landscape, parameters, place, terms, i):
    """Return half the bounds, halved until V″ grows by less than MAX_TERM_GROWTH; not halved if its terms are 0."""
    bounds = landscape.bounds(parameters)[:, i]
    half = 0.5 * (bounds[:, 1] - bounds[:, 0])
    distance, size = np.zeros(place.shape), half.copy()
    scale = terms[:, i, i]
    rows = np.flatnonzero(np.isfinite(place).all(axis=1))
    for _ in range(MAX_SIZE_HALVINGS):
        distance[rows, i] = size[rows]
        curvature = largest_curvature(landscape, [p[rows] for p in parameters], place[rows], distance[rows])[:, i, i]
        rows = rows[curvature > MAX_TERM_GROWTH * scale[rows]]
        if not rows.size:
            return size
        size[rows] *= 0.5
    size[rows] = half[rows]
    return size


def bounding_terms(landscape, parameters, place, terms, sizes):
    """Return the terms of V″, with |V″| within the sizes for terms that vanish, and True for replaced terms.

    Args:
        landscape: F and its slopes.
        parameters: one array (points,) for each.
        place: equilibria, shape (points, n).
        terms: absolute terms of V″, shape (points, n, n).
        sizes: of :func:`sizes`.
    """
    near = np.einsum("pii->pi", largest_curvature(landscape, parameters, place, ZERO_CHECK_DISTANCE * sizes)) * sizes**2
    row = (terms * sizes[:, :, None] * sizes[:, None, :]).max(axis=2)
    is_zero = np.isfinite(near) & (near > 0.0) & (row <= MAX_ZERO_TERMS * near)
    rows = np.flatnonzero(is_zero.any(axis=1))
    zero_terms = is_zero[:, :, None] & np.eye(place.shape[1], dtype=bool)
    if not rows.size:
        return terms, zero_terms
    curvature = _finite_curvature(landscape, [p[rows] for p in parameters], place[rows], sizes[rows].copy())
    terms = terms.copy()
    terms[rows] = np.where(zero_terms[rows], curvature, terms[rows])
    return terms, zero_terms


def _finite_curvature(landscape, parameters, place, distance):
    """Return `largest_curvature` within distances that are halved until it is finite."""
    for _ in range(MAX_HALVINGS):
        curvature = largest_curvature(landscape, parameters, place, distance)
        is_infinite = ~np.isfinite(curvature).all(axis=(1, 2))
        if not is_infinite.any():
            break
        distance[is_infinite] *= 0.5
    return curvature


def is_too_wide(landscape, parameters, place, terms, perturbation):
    """Return True for perturbations with which V″ is not that of the equilibrium, shape (points,).

    These are wider than the bounds of a coordinate that is not periodic, or V″ within them may be larger than
    MAX_WIDE_GROWTH times its terms, or has a pole.

    Args:
        landscape: F and its slopes.
        parameters: one array (points,) for each.
        place: equilibria, shape (points, n).
        terms: absolute terms of V″, shape (points, n, n).
        perturbation: of each coordinate, shape (points, n).
    """
    bounds = landscape.bounds(parameters)
    is_periodic = np.array([c.periodic for c in landscape.equations.system.kept])
    is_outside = (perturbation > (bounds[..., 1] - bounds[..., 0])) & ~is_periodic
    with np.errstate(all="ignore"):
        near = largest_curvature(landscape, parameters, place, perturbation)
    return is_outside.any(axis=1) | ~(near.max(axis=(1, 2)) <= MAX_WIDE_GROWTH * terms.max(axis=(1, 2)))
