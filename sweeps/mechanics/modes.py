r"""Linear theory: the normal modes about an equilibrium, and a bound on every possible rate.

:math:`V'' v = \omega^2 a v` with :math:`v^{\mathsf T} a v = 1`, signed :math:`\omega^2` in ascending order, from
the symmetric eigenproblem of :math:`L^{-1}V''L^{-\mathsf T}`, :math:`a = LL^{\mathsf T}`.

The scale S of a point is no theory: :math:`S^2 = \lVert M\rVert / \lambda_{\min}(\bar a)`, M the sums of the absolute
values of the terms of V″ with each coordinate in units of :math:`a_{ii}^{-1/2}`, :math:`\bar a` the matrix a in the
same units, bounds every :math:`|\omega^2|` and stays put where terms cancel and a rate goes through zero. It sets how
long a run is and how closely it is sampled.

Where these terms vanish with V″ itself (V = x⁴: a degenerate equilibrium), what they amount to within a perturbation of
relative size one stands in their place: a rate that is but the perturbation's own size looks as small as it is.

*Size.* A perturbation of relative size one is what the description says. Left out, it is 1 for an angle in rad; else
the distance over which the terms of V″ stay within four times what they are at the place, at most half the bounds.

*Too wide.* A perturbation that leaves the bounds, meets a pole, or over which V″ grows beyond thirty times its terms
measures some other place's motion.

Source: Landau and Lifshitz, Mechanics, section 23.
"""

import numpy as np

from kernels.matrices import by_matrix

NEIGHBOURHOOD = 4.0  # how much the terms of V″ may grow within a perturbation of relative size one
HALVINGS = 100
NARROWEST = 40  # halvings of half the bounds: a place is known to no better, and what is smaller is no neighbourhood
VANISHED, NEARBY = 1e-6, 1e-3  # of what the terms amount to within so much of the size
WIDEST = 30.0


def normal_modes(hessian, a):
    """Return the signed ω² and the modes of many points, from V″ and kinetic matrices, shape (points, n, n).

    Returns:
        ω² in s-2, shape (points, n), ascending, and the modes, shape (points, n, n), mode k in [:, :, k], its largest
        component positive; NaN where V″ or a is not finite or a is not positive definite.
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


# -- sizes


def reach(landscape, parameters, place, distance):
    """Return the largest |V″| within a distance (points, n) of places (points, n), over terms: (points, n, n)."""
    values, states = landscape.enclosed(parameters, place - distance, place + distance)
    size = np.abs(values[:, :, 1:]).max(axis=-1)
    size[(states > 0) | ~np.isfinite(size).all(axis=(1, 2))] = np.inf
    return size


def sizes(landscape, parameters, place, terms):
    """Return sizes of a perturbation of relative size one, (points, n): as given, or found from V and the bounds."""
    given = landscape.sizes(parameters, list(place.T))
    for i, c in enumerate(landscape.equations.system.kept):
        if c.size is None:
            given[:, i] = 1.0 if c.unit == "rad" else _neighbourhood(landscape, parameters, place, terms, i)
    return given


def _neighbourhood(landscape, parameters, place, terms, i):
    """Return half the bounds, halved until the terms of V″ grow by less than NEIGHBOURHOOD; all where they vanish."""
    bounds = landscape.bounds(parameters)[:, i]
    half = 0.5 * (bounds[:, 1] - bounds[:, 0])
    distance, size = np.zeros(place.shape), half.copy()
    scale = terms[:, i, i]
    open_ = np.flatnonzero(np.isfinite(place).all(axis=1))
    for _ in range(NARROWEST):
        distance[open_, i] = size[open_]
        grown = reach(landscape, [p[open_] for p in parameters], place[open_], distance[open_])[:, i, i]
        open_ = open_[grown > NEIGHBOURHOOD * scale[open_]]
        if not open_.size:
            return size
        size[open_] *= 0.5
    size[open_] = half[open_]
    return size


def bounding_terms(landscape, parameters, place, terms, sizes):
    """Return the terms of V″, replaced by |V″| within the sizes where a coordinate's terms vanish, and where so."""
    near = np.einsum("pii->pi", reach(landscape, parameters, place, NEARBY * sizes)) * sizes**2
    row = (terms * sizes[:, :, None] * sizes[:, None, :]).max(axis=2)
    gone = np.isfinite(near) & (near > 0.0) & (row <= VANISHED * near)
    rows = np.flatnonzero(gone.any(axis=1))
    vanished = gone[:, :, None] & np.eye(place.shape[1], dtype=bool)
    if not rows.size:
        return terms, vanished
    whole, terms = _bounded(landscape, [p[rows] for p in parameters], place[rows], sizes[rows].copy()), terms.copy()
    terms[rows] = np.where(vanished[rows], whole, terms[rows])
    return terms, vanished


def _bounded(landscape, parameters, place, distance):
    """Return `reach` within distances that are halved until it is finite."""
    for _ in range(HALVINGS):
        whole = reach(landscape, parameters, place, distance)
        unbounded = ~np.isfinite(whole).all(axis=(1, 2))
        if not unbounded.any():
            break
        distance[unbounded] *= 0.5
    return whole


def too_wide(landscape, parameters, place, terms, nudge):
    """Return True where perturbations (points, n) leave the neighbourhood of places with terms of V″ (points, n, n)."""
    bounds = landscape.bounds(parameters)
    turning = np.array([c.periodic for c in landscape.equations.system.kept])
    outside = (nudge > (bounds[..., 1] - bounds[..., 0])) & ~turning
    with np.errstate(all="ignore"):
        near = reach(landscape, parameters, place, nudge)
    return outside.any(axis=1) | ~(near.max(axis=(1, 2)) <= WIDEST * terms.max(axis=(1, 2)))
