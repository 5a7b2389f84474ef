r"""The nonlinear motion that a nudge grows into: when the spin turns over, and how far it tilts, measured and exact.

*Flip period.* About the middle axis :math:`\omega_a` changes sign every 2K/p. Measured, it is the time from the start
forward to the first change of sign and backward to the last one: between later flips an offset of ε² has been lost to
rounding.

*Largest tilt.* The angle between ω and the end of the axis that it starts near is extreme where a transverse component
vanishes. About a stable axis both do within half a turn, and the larger of the two angles is the largest. Where
:math:`\omega_a` changes sign, one of them vanishes once between two flips and there the tilt is least; half a turn
about the other transverse axis maps the motion onto itself one flip later, so the largest tilt is π minus that.

The direct integrator, at order 12 and of one step length for motion of any amplitude, is followed until these events
have been passed; each is then found by Newton's method on the length of the last step, to rounding. Nothing here asks
the exact solution or linear theory. A search that has not ended after MOST_ROTATIONS, or MOST_STEPS where a body that
cannot exist asks for more of them, is given up, and says so.

Lanes as in :mod:`kernels.blocks`, in radians of spin and units of the nudge.
"""

import math

import numpy as np

from kernels import columns, direct, exact, rigid_body, taylor
from kernels.blocks import W
from kernels.columns import Column
from kernels.jit import INNER, OPTIONS, njit, whole_vectors
from kernels.solution import pick

MOST_ROTATIONS, MOST_STEPS = 20_000, 2_000_000

# Rows of the scratch array: state, the state one step before, the step, the start, and what has been found.
A, B, C, PA, PB, PC, KA, KB, KC, A0, B0, C0 = (W * r for r in range(12))
EPSILON, H, ACTIVE, FLIP, TILT_B, TILT_C = (W * r for r in range(12, 18))
LIMIT, GIVEN_UP = (W * r for r in range(18, 20))  # steps after which a search is given up, and whether it was
ROWS = 20

COLUMNS = (  # what :func:`fill` writes
    Column("flip_period", power=-1),
    Column("flip_period_exact", power=-1),
    Column("max_tilt", power=0),
    Column("max_tilt_exact", power=0),
    Column("frequency_exact", power=1),
)
MEASURED = tuple(column.name for column in COLUMNS)
AT = columns.numbers(MEASURED)


@njit(**OPTIONS)
def step_length(bound, epsilon, tolerance):
    """Return the step, rad of spin, whose error over a flip, some twenty steps, is a tenth of tolerance."""
    x = (tolerance / (200.0 * direct.truncation(1.0, 12))) ** (1.0 / 13.0)
    return min(x, 0.25) / (bound * math.sqrt(1.0 + epsilon * epsilon)) if bound > 0.0 else 1.0


@njit(**OPTIONS)
def most_steps(c_a, c_b, c_c, h):
    """Return the steps after which a search is given up; 0 where MOST_STEPS are no radian of the fastest turn."""
    steps = np.ceil(2.0 * math.pi * MOST_ROTATIONS / h)
    fastest = math.sqrt(max(abs(c_a * c_b), max(abs(c_b * c_c), abs(c_c * c_a))))
    return min(steps, float(MOST_STEPS)) if fastest * h * MOST_STEPS >= 1.0 else 0.0


@njit(**INNER)
def _begin(S, direction):
    """Put every lane at its start, to run forward (1) or backward (-1)."""
    whole_vectors()
    for lane in range(W):
        S[A + lane], S[B + lane], S[C + lane] = S[A0 + lane], S[B0 + lane], S[C0 + lane]
        S[KA + lane] *= direction
        S[KB + lane] *= direction
        S[KC + lane] *= direction


@njit(**INNER)
def _stride(S):
    """Take one step of every lane; return whether a component changed sign in any lane that is still active."""
    whole_vectors()
    events = 0
    for lane in range(W):
        a0, b0, c0 = S[A + lane], S[B + lane], S[C + lane]
        a, b, c = taylor.step_12(a0, b0, c0, S[KA + lane], S[KB + lane], S[KC + lane])
        S[PA + lane], S[PB + lane], S[PC + lane] = a0, b0, c0
        S[A + lane], S[B + lane], S[C + lane] = a, b, c
        changed = ((a0 > 0.0) != (a > 0.0)) | ((b0 > 0.0) != (b > 0.0)) | ((c0 > 0.0) != (c > 0.0))
        events |= 1 if changed & (S[ACTIVE + lane] > 0.0) else 0
    return events > 0


@njit(**INNER)
def _crossing(S, lane, component):
    """Return the share of the last step after which a component (1, 2, 3) vanishes, and the state there."""
    a0, b0, c0 = S[PA + lane], S[PB + lane], S[PC + lane]
    ka, kb, kc = S[KA + lane], S[KB + lane], S[KC + lane]
    before, after = pick(component, a0, b0, c0), pick(component, S[A + lane], S[B + lane], S[C + lane])
    share = before / (before - after) if before != after else 0.0
    a, b, c = a0, b0, c0
    for _ in range(8):
        a, b, c = taylor.step_12(a0, b0, c0, ka * share, kb * share, kc * share)
        da, db, dc = rigid_body.derivative(a, b, c, ka, kb, kc)
        value, slope = pick(component, a, b, c), pick(component, da, db, dc)
        if slope == 0.0:
            break
        correction = value / slope
        share = min(max(share - correction, 0.0), 1.0)
        if abs(correction) <= 1e-15:
            break
    return share, a, b, c


@njit(**INNER)
def _tilt(a, b, c, sense, epsilon):
    """Return angle between (a, epsilon b, epsilon c) and the end of the axis that has the sign of ``sense``."""
    return math.atan2(epsilon * math.hypot(b, c), a if sense > 0.0 else -a)


@njit(**INNER)
def _note(S, lane, before, turning):
    """Note the events of one lane's last step; ``before`` is the time before it. End the lane where all is known.

    Forward (``turning`` false) a lane also ends when both transverse components have vanished: it then turns about
    the axis it started near, and never flips.
    """
    epsilon, sense = S[EPSILON + lane], S[A0 + lane]
    share_flip = 2.0
    if (S[PA + lane] > 0.0) != (S[A + lane] > 0.0):
        share_flip, _, _, _ = _crossing(S, lane, 1)
    for component, row, now, was in ((2, TILT_B, B, PB), (3, TILT_C, C, PC)):
        if (S[was + lane] > 0.0) != (S[now + lane] > 0.0) and math.isnan(S[row + lane]):
            share, a, b, c = _crossing(S, lane, component)
            if share <= share_flip:
                S[row + lane] = _tilt(a, b, c, sense, epsilon)
    if share_flip <= 1.0:
        S[FLIP + lane] += before + share_flip * S[H + lane]
        S[ACTIVE + lane] = 0.0
    elif not turning and not (math.isnan(S[TILT_B + lane]) or math.isnan(S[TILT_C + lane])):
        S[FLIP + lane] = math.nan
        S[ACTIVE + lane] = 0.0


@njit(**INNER)
def _walk(S, turning):
    """Step until no lane is active; each is given up at its own limit."""
    whole_vectors()
    n, limit = 0, _next_limit(S, 0)
    while n < limit:
        has_events = _stride(S)
        for lane in range(W if has_events else 0):
            if S[ACTIVE + lane] > 0.0:
                _note(S, lane, n * S[H + lane], turning)
        n += 1
        if has_events or n >= limit:
            limit = _next_limit(S, n)


@njit(**INNER)
def _next_limit(S, n):
    """Give up the lanes whose limit is n steps or less; return the least limit of the active ones, or 0."""
    whole_vectors()
    limit = 0.0
    for lane in range(W):
        if S[ACTIVE + lane] > 0.0 and not n < S[LIMIT + lane]:
            S[ACTIVE + lane], S[GIVEN_UP + lane] = 0.0, 1.0
        if S[ACTIVE + lane] > 0.0:
            limit = S[LIMIT + lane] if limit == 0.0 else min(limit, S[LIMIT + lane])
    return limit


@njit(**INNER)
def _search(S):
    """Find the events of a block: forward for all lanes, backward for those that flipped."""
    whole_vectors()
    for lane in range(W):
        moving = (S[KA + lane] != 0.0) | (S[KB + lane] != 0.0) | (S[KC + lane] != 0.0)
        S[ACTIVE + lane] = 1.0 if moving else 0.0
        S[FLIP + lane] = 0.0 if moving else math.nan
        S[TILT_B + lane], S[TILT_C + lane] = math.nan, math.nan
        S[GIVEN_UP + lane] = 0.0
    _begin(S, 1.0)
    _walk(S, False)
    for lane in range(W):
        S[ACTIVE + lane] = 1.0 if S[FLIP + lane] > 0.0 else 0.0
    _begin(S, -1.0)
    _walk(S, True)


@njit(**INNER)
def _largest_tilt(S, lane):
    """Return largest tilt of one lane from its events."""
    least, other = S[TILT_B + lane], S[TILT_C + lane]
    if S[FLIP + lane] > 0.0:
        return math.pi - (least if math.isnan(other) else (other if math.isnan(least) else min(least, other)))
    if math.isnan(least) and math.isnan(other):  # a sphere: nothing moves
        return _tilt(S[A0 + lane], S[B0 + lane], S[C0 + lane], S[A0 + lane], S[EPSILON + lane])
    return max(least, other)


@njit(nogil=True, **OPTIONS)
def fill(points, order, tolerance, out, given_up):
    """Fill COLUMNS for Spins taken W at a time in the given order, which changes no result.

    Args:
        tolerance (float): Relative error allowed in the measured columns.
        out (numpy.ndarray, shape (5, n)): COLUMNS: s, s, rad, rad, rad s-1; NaN where missing.
        given_up (numpy.ndarray of bool, shape (n,)): Set where the search reached its bound.
    """
    whole_vectors()
    I1, I2, I3, axis, omega0, epsilon, phase = points
    S = np.zeros(ROWS * W)
    for first in range(0, order.size, W):
        count = min(W, order.size - first)
        for lane in range(W):
            i = order[first + min(lane, count - 1)]
            moments = rigid_body.relabel(I1[i], I2[i], I3[i], axis[i])
            c_a, c_b, c_c = rigid_body.euler_coefficients(*moments)
            h = step_length(max(abs(c_a), abs(c_b), abs(c_c)), epsilon[i], tolerance)
            e2 = epsilon[i] * epsilon[i]
            S[H + lane], S[EPSILON + lane], S[LIMIT + lane] = h, epsilon[i], most_steps(c_a, c_b, c_c, h)
            S[KA + lane], S[KB + lane], S[KC + lane] = c_a * e2 * h, c_b * h, c_c * h
            S[A0 + lane] = 1.0 if omega0[i] > 0.0 else -1.0
            S[B0 + lane], S[C0 + lane] = math.cos(phase[i]), math.sin(phase[i])
        _search(S)
        for lane in range(count):
            i = order[first + lane]
            spin, e = abs(omega0[i]), epsilon[i]
            given_up[i] = S[GIVEN_UP + lane] > 0.0
            out[AT.flip_period, i] = S[FLIP + lane] / spin if S[FLIP + lane] > 0.0 and not given_up[i] else math.nan
            out[AT.max_tilt, i] = _largest_tilt(S, lane) if not given_up[i] else math.nan
            moments = rigid_body.relabel(I1[i], I2[i], I3[i], axis[i])
            top = exact.set_up(*moments, S[A0 + lane], e * S[B0 + lane], e * S[C0 + lane])
            period = exact.flip_period(top)
            flips = top.axes[2] != 1 and math.isfinite(period)
            out[AT.flip_period_exact, i] = period / spin if flips else math.nan
            out[AT.max_tilt_exact, i] = exact.max_tilt(top, 1)
            out[AT.frequency_exact, i] = exact.frequency(top) * spin
