r"""Integrator of free rotations until events, in blocks of lanes; each lane ends at its own last event.

*State.* The angular velocity :math:`\omega = (a, b, c)` in the body's principal axes; and, if it is carried, a vector
n = (x, y, z) that is fixed in space, at right angles to the angular momentum L, in the same axes. Both take Taylor
steps of order 12 (:mod:`kernels.free.taylor`).

*Azimuth.* Axis a revolves about L: from n on, the sine of its azimuth has the sign of :math:`s = (L\times n)_a = L_bz -
L_cy`, with :math:`\dot s = (L\times n)_b\,c - (L\times n)_c\,b`. The azimuth grows at :math:`|L|(bL_b + cL_c)/(L_b^2 +
L_c^2)`, between :math:`|L|/I_c` and :math:`|L|/I_b`, so s changes sign once every half turn and never jumps.

*Events.* a, b, c or s changes sign; ``due`` sets for each lane how many changes it takes. Newton's method on the length
of the last step gives time and state of an event to rounding. A lane ends with the event of a, or as soon as all
requested events of b, c and s are found; otherwise after its own maximum number of steps, without a result.

*On the way* a body's changes of sign, the turns of L about axis a in the body (``wraps``) and the extremes of
:math:`|\dot\omega|^2` are kept, up to its last event. The ratio of the latter bounds how much rounding grows.

Lanes as in :mod:`kernels.compile.blocks`; moments and angular velocities in any units, time in that of the step. No bit
of a lane depends on its neighbours. Source: the equations above.
"""

import math

import numpy as np

from kernels.compile import columns
from kernels.compile.blocks import W, scratch
from kernels.compile.jit import INLINE, INNER, OPTIONS, njit
from kernels.free import direct, rigid_body, taylor

A, B, C, AZIMUTH = range(4)  # events, numbered by the component that changes sign
EVENTS = 4
TIME, STATE, FIELDS = 0, 1, 7  # An event is stored as its time, then (a, b, c, x, y, z) at that time.
NEVER = math.inf  # An event that is not requested is due after so many changes of sign.
PERIOD = 3.0  # A component that rises from 0 changes sign so often in its period: at once, half way and at the end.

MAX_STEPS = 200_000  # A body that needs more steps is given up, unless its observable sets another limit.
MAX_STEP = 0.25  # A step is never longer, in radians of the largest rate, however large the tolerance.
FINER = 0.77  # A second run with steps shorter by this factor shows the steps' error.

_NAMES = (  # rows of the scratch array, W long each
    *("a", "b", "c", "azimuth", "x", "y", "z"),
    *("previous_a", "previous_b", "previous_c", "previous_azimuth", "previous_x", "previous_y", "previous_z"),
    *("changes_a", "changes_b", "changes_c", "changes_azimuth"),
    *("due_a", "due_b", "due_c", "due_azimuth"),
    *("ka", "kb", "kc", "h", "Ia", "Ib", "Ic", "wraps", "slowest", "fastest", "steps", "max_steps", "active"),
)
row = columns.numbers(_NAMES, width=W)


@njit(**OPTIONS)
def new_block():
    """Return the scratch array of a block and the array of its events, shape (EVENTS, FIELDS, W), NaN if not found."""
    return scratch(len(_NAMES)), np.full((EVENTS, FIELDS, W), math.nan)


@njit(**OPTIONS)
def largest_step(steps, tolerance):
    """Return the step, rad of the largest rate, at which ``steps`` steps make a tenth of the tolerance in error."""
    x = (tolerance / (10.0 * steps * direct.truncation(1.0, 12))) ** (1.0 / 13.0)
    return min(x, MAX_STEP)


@njit(**INNER)
def start_lane(S, lane, moments, omega, n, h):
    """Put a lane at its start, with no event requested.

    Args:
        `S` (numpy.ndarray): Scratch array of :func:`new_block`; written.
        lane (int): Lane, 0 to W - 1.
        moments (tuple of 3 floats): Principal moments in any unit.
        omega (tuple of 3 floats): Angular velocity (a, b, c).
        `n` (tuple of 3 floats): Vector fixed in space, at right angles to L; zeros if it is not carried.
        `h` (float): Step; backward in time if it is negative.
    """
    a, b, c = omega
    Ia, Ib, Ic = moments
    ka, kb, kc = rigid_body.euler_coefficients(Ia, Ib, Ic)
    S[row.a + lane], S[row.b + lane], S[row.c + lane] = a, b, c
    S[row.x + lane], S[row.y + lane], S[row.z + lane] = n
    S[row.azimuth + lane] = Ib * b * n[2] - Ic * c * n[1]
    S[row.Ia + lane], S[row.Ib + lane], S[row.Ic + lane] = moments
    S[row.ka + lane], S[row.kb + lane], S[row.kc + lane], S[row.h + lane] = ka * h, kb * h, kc * h, h
    for event in range(EVENTS):
        S[row.changes_a + event * W + lane], S[row.due_a + event * W + lane] = 0.0, NEVER
    S[row.wraps + lane], S[row.steps + lane], S[row.max_steps + lane] = 0.0, 0.0, MAX_STEPS
    S[row.slowest + lane], S[row.fastest + lane], S[row.active + lane] = math.inf, 0.0, 1.0


@njit(**INLINE)
def omega_at(crossings, event, lane):
    """Return the angular velocity at an ``event`` of a ``lane`` from ``crossings``; NaN if it was not found."""
    return crossings[event, STATE, lane], crossings[event, STATE + 1, lane], crossings[event, STATE + 2, lane]


@njit(**INLINE)
def vector_at(crossings, event, lane):
    """Return the fixed vector at an ``event`` of a ``lane`` from ``crossings``; NaN if it was not found."""
    return crossings[event, STATE + 3, lane], crossings[event, STATE + 4, lane], crossings[event, STATE + 5, lane]


@njit(**INNER)
def follow_lanes(S, crossings, carries):
    """Step until no lane is active, and write the events.

    Args:
        `S`, crossings (numpy.ndarray): Arrays of :func:`new_block`; written. At least one event of each lane is due.
        carries (bool): Whether the vector n is integrated, too.
    """
    crossings[:] = math.nan
    n, limit = 0.0, _next_limit(S, 0.0)  # doubles: Numba would compile for a literal 0 as well
    while n < limit:
        has_events = _step_with_vector(S) if carries else _step(S)
        for lane in range(W if has_events else 0):
            if S[row.active + lane] > 0.0:
                _record_events(S, crossings, lane, n, carries)
        n += 1.0
        if has_events or n >= limit:
            limit = _next_limit(S, n)


@njit(**INNER)
def _next_limit(S, n):
    """End the lanes with a limit of n steps or less; return the least limit of the active lanes, or 0."""
    limit = 0.0
    for lane in range(W):
        if S[row.active + lane] > 0.0 and not n < S[row.max_steps + lane]:
            S[row.active + lane] = 0.0
        if S[row.active + lane] > 0.0:
            limit = S[row.max_steps + lane] if limit == 0.0 else min(limit, S[row.max_steps + lane])
    return limit


@njit(**INNER)
def _step(S):
    """Take one step of every lane's angular velocity; return True if a component of an active lane changed sign."""
    events = 0
    for lane in range(W):
        a0, b0, c0 = S[row.a + lane], S[row.b + lane], S[row.c + lane]
        a, b, c = taylor.step_12(a0, b0, c0, S[row.ka + lane], S[row.kb + lane], S[row.kc + lane])
        S[row.previous_a + lane], S[row.previous_b + lane], S[row.previous_c + lane] = a0, b0, c0
        S[row.a + lane], S[row.b + lane], S[row.c + lane] = a, b, c
        crosses = ((a0 > 0.0) != (a > 0.0)) | ((b0 > 0.0) != (b > 0.0)) | ((c0 > 0.0) != (c > 0.0))
        events |= 1 if crosses & (S[row.active + lane] > 0.0) else 0
    return events > 0


@njit(**INNER)
def _step_with_vector(S):
    """Take one step of every lane and count on the way; return True if an active lane has an event of b or s."""
    events = 0
    for lane in range(W):
        a0, b0, c0, s0 = S[row.a + lane], S[row.b + lane], S[row.c + lane], S[row.azimuth + lane]
        x0, y0, z0 = S[row.x + lane], S[row.y + lane], S[row.z + lane]
        ka, kb, kc = S[row.ka + lane], S[row.kb + lane], S[row.kc + lane]
        a, b, c, x, y, z = taylor.carry_12(a0, b0, c0, x0, y0, z0, ka, kb, kc, S[row.h + lane])
        Ib, Ic = S[row.Ib + lane], S[row.Ic + lane]
        s = Ib * b * z - Ic * c * y
        S[row.previous_a + lane], S[row.previous_b + lane], S[row.previous_c + lane] = a0, b0, c0
        S[row.previous_x + lane], S[row.previous_y + lane], S[row.previous_z + lane] = x0, y0, z0
        S[row.previous_azimuth + lane] = s0
        S[row.a + lane], S[row.b + lane], S[row.c + lane], S[row.azimuth + lane] = a, b, c, s
        S[row.x + lane], S[row.y + lane], S[row.z + lane] = x, y, z
        weight = S[row.active + lane]
        b_crosses, s_crosses = (b0 > 0.0) != (b > 0.0), (s0 > 0.0) != (s > 0.0)
        S[row.changes_a + lane] += weight if (a0 > 0.0) != (a > 0.0) else 0.0
        S[row.changes_b + lane] += weight if b_crosses else 0.0
        S[row.changes_c + lane] += weight if (c0 > 0.0) != (c > 0.0) else 0.0
        S[row.changes_azimuth + lane] += weight if s_crosses else 0.0
        S[row.wraps + lane] += weight * _count_wrap(Ib * b0, Ic * c0, Ib * b, Ic * c)
        S[row.steps + lane] += weight
        da, db, dc = rigid_body.derivative(a0, b0, c0, ka, kb, kc)
        speed = da * da + db * db + dc * dc
        S[row.slowest + lane] = speed if (weight > 0.0) & (speed < S[row.slowest + lane]) else S[row.slowest + lane]
        S[row.fastest + lane] = speed if (weight > 0.0) & (speed > S[row.fastest + lane]) else S[row.fastest + lane]
        b_due = b_crosses & (S[row.changes_b + lane] >= S[row.due_b + lane])
        s_due = s_crosses & (S[row.changes_azimuth + lane] >= S[row.due_azimuth + lane])
        events |= 1 if (b_due | s_due) & (weight > 0.0) else 0
    return events > 0


@njit(**INLINE)
def _count_wrap(x0, y0, x, y):
    """Return 1 if (x, y) has passed the negative x axis since (x0, y0), -1 if it has passed it backward, else 0."""
    sense = (1.0 if (y < 0.0) & (y0 >= 0.0) else 0.0) - (1.0 if (y >= 0.0) & (y0 < 0.0) else 0.0)
    return sense if x + x0 < 0.0 else 0.0


@njit(**INNER)
def _record_events(S, crossings, lane, n, carries):
    """Write the events of one lane's last step, its step number n from 0; end the lane after its last event."""
    end, waits = 2.0, False
    for event in range(EVENTS):
        before, after = S[row.previous_a + event * W + lane], S[row.a + event * W + lane]
        is_due = S[row.changes_a + event * W + lane] >= S[row.due_a + event * W + lane]
        if (before > 0.0) != (after > 0.0) and is_due and math.isnan(crossings[event, TIME, lane]):
            share, state = _locate_event(S, lane, event, carries)
            end = share if event == A else end
            if share <= end:
                crossings[event, TIME, lane] = (n + share) * S[row.h + lane]
                for i in range(FIELDS - STATE):
                    crossings[event, STATE + i, lane] = state[i]
                if carries:
                    _subtract_counts(S, lane, state)
        waits |= event != A and S[row.due_a + event * W + lane] < NEVER and math.isnan(crossings[event, TIME, lane])
    if end <= 1.0 or not waits:
        S[row.active + lane] = 0.0


@njit(**INNER)
def _subtract_counts(S, lane, state):
    """Subtract the changes of sign and the wraps of a lane's last step after its event, at which its state is given."""
    _, b, c, _, y, z = state
    Lb, Lc = S[row.Ib + lane] * b, S[row.Ic + lane] * c
    after = S[row.azimuth + lane]
    S[row.changes_azimuth + lane] -= 1.0 if (Lb * z - Lc * y > 0.0) != (after > 0.0) else 0.0
    S[row.wraps + lane] -= _count_wrap(Lb, Lc, S[row.Ib + lane] * S[row.b + lane], S[row.Ic + lane] * S[row.c + lane])


@njit(**INNER)
def _locate_event(S, lane, event, carries):
    """Return the share of a lane's last step after which a component vanishes, and (a, b, c, x, y, z) there."""
    a0, b0, c0 = S[row.previous_a + lane], S[row.previous_b + lane], S[row.previous_c + lane]
    x0, y0, z0 = S[row.previous_x + lane], S[row.previous_y + lane], S[row.previous_z + lane]
    ka, kb, kc, h = S[row.ka + lane], S[row.kb + lane], S[row.kc + lane], S[row.h + lane]
    Ia, Ib, Ic = S[row.Ia + lane], S[row.Ib + lane], S[row.Ic + lane]
    before, after = S[row.previous_a + event * W + lane], S[row.a + event * W + lane]
    share = before / (before - after) if before != after else 0.0
    a, b, c, x, y, z = a0, b0, c0, x0, y0, z0
    for _ in range(8):
        if carries:
            a, b, c, x, y, z = taylor.carry_12(a0, b0, c0, x0, y0, z0, ka * share, kb * share, kc * share, h * share)
        else:
            a, b, c = taylor.step_12(a0, b0, c0, ka * share, kb * share, kc * share)
        da, db, dc = rigid_body.derivative(a, b, c, ka, kb, kc)
        La, Lb, Lc = Ia * a, Ib * b, Ic * c
        s, ds = Lb * z - Lc * y, h * ((Lc * x - La * z) * c - (La * y - Lb * x) * b)
        value, slope = (a, b, c, s)[event], (da, db, dc, ds)[event]
        if slope == 0.0:
            break
        share = min(max(share - value / slope, 0.0), 1.0)
        if abs(value) <= 1e-15 * abs(slope):
            break
    return share, (a, b, c, x, y, z)
