r"""Branches: equilibria that keep their slots through folds and pitchforks.

Which root at one point corresponds to which root at another is defined only along a path between them. The path leads
from the parameters' defaults to the point, each parameter on a straight line (of its logarithm, if both ends are
positive). So a point's branches depend on the description and the point alone, and not on a sweep's further points,
their order, or the shard.

At each of `STEPS` steps all roots are searched anew, with the proof that these are all, and the previous roots are
continued to them, each with a proof of its identity (:func:`continue_roots`), until it meets another root. A root that
is stopped has met one, and so has a new root that is stopped while it is continued back. An old and a new root of this
kind are on one branch if each is near the extrapolation of its partner: a branch that passes straight through a
pitchfork, or crosses another branch, keeps its slot. A stopped root without a partner has vanished (a fold), and its
slot is free; a new root without a partner takes the first slot that is free at its appearance.

A point is reported as undecided if two roots are almost equally near one extrapolation, if a single root vanishes or
appears (folds have two), or if a search has no proof. Undetectable: if a loop around a cusp exchanges roots, the slots
of neighbouring points change somewhere on it.

*Continued roots* of F(x, p), with parameters p on a straight line, t from 0 to 1: a box of half-widths r moves along
the chord m(t) from the root at one end to Newton's root at the other end. It contains exactly one root at every t if

.. math:: |Y F(m(t), p(t))| + |1 - Y J|\, r < r, \qquad
          F(m(t), p(t)) \in F(m(\tfrac12), p(\tfrac12)) + (t - \tfrac12)\,(J \Delta x + F_p \Delta p)

with Y near the inverse of J(m(1/2), p(1/2)), J and F_p enclosed over all boxes: Krawczyk's operator at every t. J is
then regular, so these roots are one smooth curve. A piece for which that fails is halved; if it is too short to be
halved, the root has met a fold, a pitchfork, or an end of the domain of F.

Source: Neumaier, Interval Methods for Systems of Equations, section 5.1; Allgower and Georg, Numerical Continuation
Methods, chapter 2.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kernels.flow.matrices import apply_by_matrix
from kernels.search.codes import POLE, UNIT

STEPS = 8  # steps of the path from the defaults to a point
STEP_SHIFT = 0.381966  # steps end this much before round fractions of the path, at which roots often meet
SPARE_SLOTS = 8  # slots on the path in addition to those at its end
SAME_PLACE = 1e-6  # places closer than this, relative to the range, are the same
MAX_PAIR_DISTANCE = 0.05  # largest distance of a root from its partner's extrapolation, relative to the range
MAX_AMBIGUITY = 0.2  # a pair is certain if its distance is less than this fraction of the next larger one
MAX_HALVINGS = 8  # halvings of a step before a root counts as stopped
MAX_NEWTON_STEPS, NEWTON_TOLERANCE = 6, 1e-13  # Newton steps, and the last one relative to the range
MAX_STEP_DISTANCE = 0.25  # distance of a root over one piece, relative to the range
MAX_BOX_GROWTHS, BOX_GROWTH = 3, 1.5  # a box may grow this often, to this much more than it has to contain
MIN_BOX_HALF_WIDTH = 1e-10  # half-width of the first box, relative to the range
MAX_PIECES = 400  # pieces of one step
SLACK = 1.0 + 1e-14  # factor that covers the rounding of bounds
MAX_GAP = 64.0 / STEPS * 2.0**-MAX_HALVINGS  # fraction of the path between the ends of two roots of one pair


@dataclass
class ContinuedRoots:
    """Roots after their continuation."""

    place: np.ndarray  #: shape (zeros, n), at the reached fractions of the path
    share: np.ndarray  #: shape (zeros,), the fraction of the path that each has reached
    speed: np.ndarray  #: dx/ds over the last piece, shape (zeros, n); 0 if it did not move
    is_complete: np.ndarray  #: shape (zeros,), True if the root was continued to the end


def follow_branches(path, max_slots: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the index of each slot's root at the end of the path, and True for points at which that is decided.

    Args:
        path: the path to the points, an `equilibria.ParameterPath`.
        max_slots: number of slots.

    Returns:
        Indices, shape (points, max_slots), -1 for an empty slot; at points with more roots than slots some roots have
        none. Flags, shape (points,).
    """
    roots, is_decided = path.search(0.0)
    slots = np.full((len(roots), max_slots + SPARE_SLOTS), -1)
    for row, exists in zip(slots, ~np.isnan(roots).any(axis=-1), strict=True):
        assign_new_roots(row, [(j, 0.0) for j in np.flatnonzero(exists)], {})
    fractions = [0.0, *((step - STEP_SHIFT) / STEPS for step in range(1, STEPS)), 1.0]
    for begin, end in pairwise(fractions):
        next_roots, is_proved = path.search(end)
        slots, is_continued = _continue_step(path, roots, next_roots, slots, begin, end)
        roots, is_decided = next_roots, is_decided & is_proved & is_continued
    return _fill_free_slots(slots, max_slots), is_decided


def _fill_free_slots(slots, max_slots):
    """Return the first slots, with free slots filled from the spare ones."""
    new_slots = slots[:, :max_slots].copy()
    for spare in slots[:, max_slots:].T:
        can_fill = (spare >= 0) & (new_slots < 0).any(axis=1)
        new_slots[can_fill, (new_slots[can_fill] < 0).argmax(axis=1)] = spare[can_fill]
    return new_slots


def assign_new_roots(slots, new, free_from) -> None:
    """Store new roots in the first slots that are free at their appearance; a root without a free slot is left out.

    Args:
        slots: of one point; changed in place.
        new: (index of the root, fraction of the path at which it appears).
        free_from: slot → the fraction from which it is free; missing slots are free throughout.
    """
    fractions = sorted({fraction for _, fraction in new})
    joint_fraction: dict[float, float] = {}
    for k, fraction in enumerate(fractions):  # both roots of a fold appear together, up to rounding
        is_joint = k and fraction - fractions[k - 1] <= MAX_GAP
        joint_fraction[fraction] = joint_fraction[fractions[k - 1]] if is_joint else fraction
    for j, fraction in sorted(new, key=lambda root: (joint_fraction[root[1]], root[0])):
        free = [k for k, root in enumerate(slots) if root < 0 and free_from.get(k, -1.0) <= fraction + MAX_GAP]
        if free:
            slots[free[0]] = j


# -- one step


def _continue_step(path, old, new, slots, begin, end):
    """Return the slots with the indices of the new roots, and True for points at which that is decided."""
    point, slot = np.nonzero(slots >= 0)
    forward = continue_roots(path, point, old[point, slots[point, slot]], begin, end)
    root = _match_roots(path, new, point, forward, path.bounds(end))
    result, is_decided = np.full(slots.shape, -1), np.ones(len(slots), dtype=bool)
    result[point, slot] = root
    is_decided[point[forward.is_complete & (root < 0) & ~path.is_outside(forward.place, path.bounds(end)[point])]] = (
        False
    )
    is_matched = np.zeros(new.shape[:2], dtype=bool)
    is_matched[point[root >= 0], root[root >= 0]] = True
    new_points, number = np.nonzero(~is_matched & ~np.isnan(new).any(axis=-1))
    backward = continue_roots(path, new_points, new[new_points, number], end, begin)
    free_from = np.where(forward.is_complete, end, forward.share)  # a complete one has left the bounds
    for k in np.unique(np.concatenate([new_points, point[root < 0]])):
        old_rows, new_rows = np.flatnonzero((point == k) & (root < 0)), np.flatnonzero(new_points == k)
        old_places = old[k, slots[k, slot[old_rows]]]
        is_at_rest = np.array_equal(*(path.parameters(np.array([k]), share) for share in (begin, end)))
        pairs, is_certain = _pair_stopped_roots(
            path, old_places, (forward, old_rows), (backward, new_rows), path.bounds(end)[k], is_at_rest
        )
        is_decided[k] &= is_certain
        for i, j in pairs:
            result[k, slot[old_rows[i]]] = number[new_rows[j]]
        unpaired_rows = [j for j in range(new_rows.size) if j not in {pair[1] for pair in pairs}]
        assign_new_roots(
            result[k],
            [(number[new_rows[j]], backward.share[new_rows[j]]) for j in unpaired_rows],
            dict(zip(slot[old_rows], free_from[old_rows], strict=True)),
        )
    return result, is_decided


def _match_roots(path, new, point, forward, bounds):
    """Return the index of the new root that each continued root is, -1 for none."""
    width = (bounds[..., 1] - bounds[..., 0])[point]
    distance = path.distance(forward.place[:, None], new[point], width[:, None])
    distance = np.where(np.isnan(distance) | ~forward.is_complete[:, None], np.inf, distance)
    if not distance.size:
        return np.full(point.size, -1)
    return np.where(distance.min(axis=1) <= SAME_PLACE, distance.argmin(axis=1), -1)


def _pair_stopped_roots(path, old_places, forward_roots, backward_roots, bounds, is_at_rest):
    """Return (old, new) index pairs of a point's stopped roots that are on one branch, and whether that is certain.

    `old_places` has shape (roots, n); `forward_roots` and `backward_roots` are all continued roots, and the rows of
    this point; `is_at_rest`: the parameters do not change over the step.
    """
    (forward, old_rows), (backward, new_rows) = forward_roots, backward_roots
    is_stopped = ~forward.is_complete[old_rows]
    is_new = ~backward.is_complete[new_rows] | ~path.is_outside(backward.place[new_rows], bounds)
    width = bounds[:, 1] - bounds[:, 0]
    gap = (backward.share[new_rows] - forward.share[old_rows, None]) * (not is_at_rest)
    end_prediction = forward.place[old_rows, None] + forward.speed[old_rows, None] * gap[..., None]
    predicted_start = backward.place[new_rows] - backward.speed[new_rows] * gap[..., None]
    cost = np.maximum(
        path.distance(end_prediction, backward.place[new_rows], width),
        path.distance(predicted_start, forward.place[old_rows, None], width),
    )
    cost = np.where(is_stopped[:, None] & is_new & (np.abs(gap) <= MAX_GAP), cost, np.inf)
    is_same = backward.is_complete[new_rows] & (
        path.distance(old_places[:, None], backward.place[new_rows], width) <= SAME_PLACE
    )
    cost = np.where(is_same & is_stopped[:, None], 0.0, cost)
    pairs, is_certain = [], True
    while cost.size and cost.min() <= MAX_PAIR_DISTANCE:
        i, j = np.unravel_index(cost.argmin(), cost.shape)
        best, rivals = cost[i, j], np.concatenate([np.delete(cost[i], j), np.delete(cost[:, j], i)])
        is_certain &= bool((best <= MAX_AMBIGUITY * rivals).all())
        cost[i], cost[:, j] = np.inf, np.inf
        pairs.append((i, j))
    has_odd_count = (is_stopped.sum() - len(pairs)) % 2 or (is_new.sum() - len(pairs)) % 2
    return pairs, is_certain and not has_odd_count


# -- continuation of roots over a step


def continue_roots(path, owner, place, begin: float, end: float) -> ContinuedRoots:
    """Follow roots from one fraction of the path to another, forwards or backwards.

    Args:
        path: an `equilibria.ParameterPath`.
        owner: the point of each root, shape (zeros,).
        place: roots at `begin`, shape (zeros, n).
        begin: fraction of the path at the start; distances are relative to the bounds there.
        end: fraction of the path at the end.
    """
    width = np.ptp(path.bounds(begin)[owner], axis=-1)
    x, s = place.copy(), np.full(owner.size, begin)
    speed, step, is_careful = np.zeros(place.shape), np.full(owner.size, end - begin), np.zeros(owner.size, dtype=bool)
    shortest = abs(end - begin) * 2.0**-MAX_HALVINGS
    active = np.arange(owner.size)
    with np.errstate(all="ignore"):
        for _ in range(MAX_PIECES):
            if not active.size:
                break
            next_share = s[active] + step[active]
            next_share = np.where((next_share - end) * np.sign(step[active]) >= 0.0, end, next_share)
            end_parameters = [path.parameters(owner[active], share) for share in (s[active], next_share)]
            guess = x[active] + speed[active] * (next_share - s[active])[:, None]
            next_places = _advance_roots(path.slopes, x[active], guess, *end_parameters, width[active])
            is_passed = np.isfinite(next_places).all(axis=1)
            step_rows = active[is_passed]
            speed[step_rows] = (next_places[is_passed] - x[step_rows]) / (next_share[is_passed] - s[step_rows])[:, None]
            x[step_rows], s[step_rows] = next_places[is_passed], next_share[is_passed]
            step[active] *= np.where(is_passed, np.where(is_careful[active], 1.0, 2.0), 0.5)
            is_careful[active] = ~is_passed  # a further piece of this length before longer pieces
            active = active[(s[active] != end) & (np.abs(step[active]) >= shortest)]
    return ContinuedRoots(x, s, speed, s == end)


def _advance_roots(slopes, x, guess, p, q, width):
    """Return the roots at the ends of pieces from parameters p to q; NaN if their identity is not proved."""
    y, n = guess, x.shape[1]
    for _ in range(MAX_NEWTON_STEPS):
        at = np.concatenate([y, q], axis=1)
        values = slopes(at, at)[0][:, :, : 1 + n].mean(axis=-1)
        values[~np.isfinite(values).all(axis=(1, 2))] = np.nan
        step = apply_by_matrix(np.linalg.solve, values[:, :, 1:], values[:, :, :1])[..., 0]  # NaN if J is singular
        y = y - step
        if not (np.abs(step) > NEWTON_TOLERANCE * width).any():
            break
    candidates = np.flatnonzero((np.abs(y - x) < MAX_STEP_DISTANCE * width).all(axis=1))  # no NaN
    next_places = np.full(x.shape, np.nan)
    if candidates.size:
        begin, end = (np.concatenate(z, axis=1)[candidates] for z in ((x, p), (y, q)))
        unique = candidates[_is_unique_along(slopes, begin, end, width[candidates])]
        next_places[unique] = y[unique]
    return next_places


def _is_unique_along(slopes, begin, end, width):
    """Return True if a box that moves on the chord between places and parameters contains one root throughout."""
    n, middle = width.shape[1], 0.5 * (begin + end)
    middle_values, _ = slopes(middle, middle)
    F, J = middle_values[:, :, 0], middle_values[:, :, 1 : 1 + n].mean(axis=-1)
    is_proved, boxes = np.zeros(len(width), dtype=bool), np.flatnonzero(np.linalg.det(np.nan_to_num(J)) != 0.0)
    boxes = boxes[np.isfinite(J[boxes]).all(axis=(1, 2))]
    Y, r = np.linalg.inv(J[boxes]), MIN_BOX_HALF_WIDTH * width[boxes]
    for _ in range(MAX_BOX_GROWTHS):
        if not boxes.size:
            break
        start_size, share = _krawczyk_terms(slopes, F[boxes], Y, begin[boxes], end[boxes], r)
        min_radius = SLACK * (start_size + np.einsum("bij,bj->bi", share, r))
        is_inside = (min_radius < r).all(axis=1)
        is_proved[boxes[is_inside]] = True
        open_rows = np.flatnonzero(~is_inside & ((share @ r[:, :, None])[..., 0] < r).all(axis=1))  # no NaN
        larger = np.linalg.solve(np.eye(n) - share[open_rows], BOX_GROWTH * start_size[open_rows][:, :, None])[..., 0]
        boxes, Y, r = boxes[open_rows], Y[open_rows], np.maximum(r[open_rows], larger)
        is_small = (r < MAX_STEP_DISTANCE * width[boxes]).all(axis=1)
        boxes, Y, r = boxes[is_small], Y[is_small], r[is_small]
    return is_proved


def _krawczyk_terms(slopes, F, Y, begin, end, r):
    """Return the largest |Y F| along the chord, shape (boxes, n), and |1 - Y J| in the box; NaN outside F's domain."""
    n, change = r.shape[1], np.abs(end - begin)
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    low[:, :n], high[:, :n] = low[:, :n] - SLACK * r, high[:, :n] + SLACK * r
    values, states = slopes(low, high)
    D, spread = 0.5 * (values[:, :, 1:].sum(axis=-1)), SLACK * 0.5 * (values[:, :, 1:, 1] - values[:, :, 1:, 0])
    absolute, size = np.abs(Y), np.abs(values[:, :, 1:]).max(axis=-1)
    rounding = (n + 8) * UNIT
    spread = spread + rounding * size
    change_of_F = np.einsum("bij,bj->bi", D, end - begin)
    spread_of_F = np.einsum("bij,bj->bi", spread, change)
    drift = np.abs(np.einsum("bij,bj->bi", Y, change_of_F)) + np.einsum("bij,bj->bi", absolute, spread_of_F)
    start = np.abs(np.einsum("bij,bj->bi", Y, F.mean(axis=-1)))
    start += np.einsum("bij,bj->bi", absolute, 0.5 * (F[..., 1] - F[..., 0]) + rounding * np.abs(F).max(axis=-1))
    operator_spread = np.abs(np.eye(n) - Y @ D[:, :, :n]) + absolute @ spread[:, :, :n] + rounding * np.eye(n)
    operator_spread[states >= POLE] = np.nan
    return SLACK * (start + 0.5 * drift), operator_spread
