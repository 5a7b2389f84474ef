r"""Zeros of a function carried along a piece of a way, as far as it is proved that each stays one and the same.

F(x, p) = 0 with parameters p that go straight from one place to another, t from 0 to 1. A box of half-widths r goes
along with the chord m(t) from the zero at the one end to Newton's at the other. It holds exactly one zero at every t if

.. math:: |Y F(m(t), p(t))| + |1 - Y J|\, r < r, \qquad
          F(m(t), p(t)) \in F(m(\tfrac12), p(\tfrac12)) + (t - \tfrac12)\,(J \Delta x + F_p \Delta p)

with Y near the inverse of J(m(1/2), p(1/2)), J and F_p enclosed over all that the box passes: Krawczyk's operator of
every t. J is then regular there, so these zeros are one smooth curve. A piece that cannot be passed so is halved; where
it is too short to be halved the zero has met something: a fold, a pitchfork, an end of where F is defined.

Source: Neumaier, Interval Methods for Systems of Equations, section 5.1; Allgower and Georg, Numerical Continuation
Methods, chapter 2.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kernels.codes import POLE
from kernels.matrices import by_matrix

HALVINGS = 8  # of a piece
NEWTON, FOUND = 6, 1e-13  # steps, and when no more are needed, over the range
LEAP = 0.25  # of the range, the most in one go
GROWTHS, LARGER = 3, 1.5  # of a box, how often, and than what is to lie inside
LEAST = 1e-10  # of the range: half a box
STALLED = 400
UNIT = 2.0**-52
SLACK = 1.0 + 1e-14


@dataclass
class Carried:
    """Where zeros have come to."""

    place: np.ndarray  #: shape (zeros, n), at the fraction of the path that each has reached
    share: np.ndarray  #: shape (zeros,), `end` for those that came through
    speed: np.ndarray  #: dx/ds over the last piece, shape (zeros, n); 0 for one that did not get away
    through: np.ndarray  #: shape (zeros,), whether each is proved to have become the one at `place`


def carried(slopes: Callable, way: Callable, owner, place, begin: float, end: float, width) -> Carried:
    """Follow zeros from one fraction of the path to another, forwards or backwards.

    Args:
        slopes: (low, high), shape (boxes, n + parameters) → enclosures (boxes, n, 1 + n + parameters, 2) of F and its
            derivatives by variables and parameters, and states (boxes,).
        way: (owner, share) → parameters, shape (zeros, parameters).
        owner: whose each zero is, as `way` takes it.
        place: where each is at `begin`, shape (zeros, n).
        begin: fraction of the path where they are.
        end: fraction of the path where they go.
        width: ranges of the variables, shape (zeros, n): what is small and what is large.
    """
    x, s = place.copy(), np.full(owner.size, begin)
    speed, step, careful = np.zeros(place.shape), np.full(owner.size, end - begin), np.zeros(owner.size, dtype=bool)
    shortest = abs(end - begin) * 2.0**-HALVINGS
    active = np.arange(owner.size)
    with np.errstate(all="ignore"):
        for _ in range(STALLED):
            if not active.size:
                break
            there = s[active] + step[active]
            there = np.where((there - end) * np.sign(step[active]) >= 0.0, end, there)
            ends = [way(owner[active], share) for share in (s[active], there)]
            guess = x[active] + speed[active] * (there - s[active])[:, None]
            arrived = _passed(slopes, x[active], guess, *ends, width[active])
            good = np.isfinite(arrived).all(axis=1)
            won = active[good]
            speed[won] = (arrived[good] - x[won]) / (there[good] - s[won])[:, None]
            x[won], s[won] = arrived[good], there[good]
            step[active] *= np.where(good, np.where(careful[active], 1.0, 2.0), 0.5)
            careful[active] = ~good  # one more of the same length before longer ones are tried again
            active = active[(s[active] != end) & (np.abs(step[active]) >= shortest)]
    return Carried(x, s, speed, s == end)


def _passed(slopes, x, guess, p, q, width):
    """Return the places at the ends of pieces from parameters p to q; NaN where identity of zeros is not proved."""
    y, n = guess, x.shape[1]
    for _ in range(NEWTON):
        at = np.concatenate([y, q], axis=1)
        step = _newton(slopes(at, at)[0][:, :, : 1 + n].mean(axis=-1))
        y = y - step
        if not (np.abs(step) > FOUND * width).any():
            break
    left = np.flatnonzero((np.abs(y - x) < LEAP * width).all(axis=1))  # no NaN
    arrived = np.full(x.shape, np.nan)
    if left.size:
        begin, end = (np.concatenate(z, axis=1)[left] for z in ((x, p), (y, q)))
        proved = left[_single(slopes, begin, end, width[left])]
        arrived[proved] = y[proved]
    return arrived


def _newton(values):
    """Return Newton's step from F and J, shape (zeros, n, 1 + n); NaN where J is singular."""
    values = np.where(np.isfinite(values).all(axis=(1, 2), keepdims=True), values, np.nan)
    return by_matrix(np.linalg.solve, values[:, :, 1:], values[:, :, :1])[..., 0]


def _single(slopes, begin, end, width):
    """Return whether a box on a straight way between places and parameters holds one zero all the way."""
    n, middle = width.shape[1], 0.5 * (begin + end)
    here, _ = slopes(middle, middle)
    F, J = here[:, :, 0], here[:, :, 1 : 1 + n].mean(axis=-1)
    proved, left = np.zeros(len(width), dtype=bool), np.flatnonzero(np.linalg.det(np.nan_to_num(J)) != 0.0)
    left = left[np.isfinite(J[left]).all(axis=(1, 2))]
    Y, r = np.linalg.inv(J[left]), LEAST * width[left]
    for _ in range(GROWTHS):
        if not left.size:
            break
        given, share = _needed(slopes, F[left], Y, begin[left], end[left], r)
        need = SLACK * (given + np.einsum("bij,bj->bi", share, r))
        inside = (need < r).all(axis=1)
        proved[left[inside]] = True
        open_ = np.flatnonzero(~inside & ((share @ r[:, :, None])[..., 0] < r).all(axis=1))  # no NaN
        larger = np.linalg.solve(np.eye(n) - share[open_], LARGER * given[open_][:, :, None])[..., 0]
        left, Y, r = left[open_], Y[open_], np.maximum(r[open_], larger)
        kept = (r < LEAP * width[left]).all(axis=1)
        left, Y, r = left[kept], Y[kept], r[kept]
    return proved


def _needed(slopes, F, Y, begin, end, r):
    """Return the size of Y F all the way, shape (boxes, n), and |1 - Y J| in the box; NaN where F breaks."""
    n, change = r.shape[1], np.abs(end - begin)
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    low[:, :n], high[:, :n] = low[:, :n] - SLACK * r, high[:, :n] + SLACK * r
    values, states = slopes(low, high)
    D, spread = 0.5 * (values[:, :, 1:].sum(axis=-1)), SLACK * 0.5 * (values[:, :, 1:, 1] - values[:, :, 1:, 0])
    absolute, size = np.abs(Y), np.abs(values[:, :, 1:]).max(axis=-1)
    rounding = (n + 8) * UNIT
    spread = spread + rounding * size
    moved = np.einsum("bij,bj->bi", D, end - begin)
    reach = np.einsum("bij,bj->bi", spread, change)
    drift = np.abs(np.einsum("bij,bj->bi", Y, moved)) + np.einsum("bij,bj->bi", absolute, reach)
    start = np.abs(np.einsum("bij,bj->bi", Y, F.mean(axis=-1)))
    start += np.einsum("bij,bj->bi", absolute, 0.5 * (F[..., 1] - F[..., 0]) + rounding * np.abs(F).max(axis=-1))
    bent = np.abs(np.eye(n) - Y @ D[:, :, :n]) + absolute @ spread[:, :, :n] + rounding * np.eye(n)
    bent[states >= POLE] = np.nan
    return SLACK * (start + 0.5 * drift), bent
