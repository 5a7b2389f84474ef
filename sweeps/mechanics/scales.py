"""What is large and what is small near an equilibrium, from V itself: no unit, and no other coordinate's stiffness.

*Terms.* The rates' bound S comes from what the terms of V″ amount to at the place (`landscape.magnitude`). Where they
vanish there with V″ itself (V = x⁴: a degenerate equilibrium) they say nothing; what they amount to within a nudge of
relative size one stands in their place, so that a rate which is but the nudge's own size looks as small as it is.

*Size.* A nudge of relative size one is what the description says. Left out, it is 1 for an angle in rad; else the
distance over which the terms of V″ stay within four times what they are at the place, at most half the bounds.

*Too wide.* A nudge that leaves the bounds, meets a pole, or over which V″ grows beyond thirty times its terms measures
some other place's motion.
"""

import numpy as np

NEIGHBOURHOOD = 4.0  # how much the terms of V″ may grow within a nudge of relative size one
HALVINGS = 100
NARROWEST = 40  # halvings of half the bounds: a place is known to no better, and what is smaller is no neighbourhood
VANISHED, NEARBY = 1e-6, 1e-3  # of what the terms amount to within so much of the size
WIDEST = 30.0


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
