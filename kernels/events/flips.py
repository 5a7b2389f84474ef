r"""The nonlinear motion that a perturbation grows into: time between flips and largest tilt, measured and exact.

*Flip period.* About the intermediate axis :math:`\omega_a` changes sign every 2K/p. Measured, it is the time from the
start forward to the first change of sign and backward to the last one: between later flips an offset of ε² has been
lost to rounding.

*Largest tilt.* The angle between ω and the end of the axis that it starts near is extreme when a transverse component
vanishes. About a stable axis both do within half a turn, and the larger of the two angles is the largest. If
:math:`\omega_a` changes sign, one component vanishes once between two flips, and the tilt is then least; half a turn
about the second transverse axis maps the motion onto itself one flip later, so the largest tilt is π minus that.

The search for these events (:mod:`kernels.events.follower`) uses neither the exact solution nor linear theory. It ends
after MAX_ROTATIONS, or after MAX_STEPS if a physically impossible body needs more of them.
Angular velocities are in units of the spin.
"""

import math

import numpy as np

from kernels.compile import columns
from kernels.compile.blocks import W
from kernels.compile.columns import Column
from kernels.compile.jit import INNER, OPTIONS, njit
from kernels.events import follower
from kernels.events.follower import TIME, A, B, C, row
from kernels.free import elliptic_constants, exact, rigid_body

MAX_ROTATIONS = 20_000  # A search ends after so many rotations of the spin each way.
MAX_STEPS = 2_000_000  # The search of a physically impossible body ends after so many steps each way.
STEPS_TO_A_FLIP = 20.0  # The steps' error stays below the tolerance over so many of them, a typical number.

COLUMNS = (  # The columns that :func:`fill_columns` writes, in the order of its rows.
    Column("flip_period", power=-1),
    Column("flip_period_exact", power=-1),
    Column("max_tilt", power=0),
    Column("max_tilt_exact", power=0),
    Column("frequency_exact", power=1),
)
MEASURED = tuple(column.name for column in COLUMNS)
AT = columns.numbers(MEASURED)


@njit(**OPTIONS)
def max_steps(c_a, c_b, c_c, h):
    """Return the steps after which a search ends; 0 if MAX_STEPS do not cover a radian of the fastest rotation.

    Args:
        c_a, c_b, c_c (float): Euler coefficients.
        `h` (float): Step, in radians of the spin.
    """
    steps = np.ceil(2.0 * math.pi * MAX_ROTATIONS / h)
    fastest = math.sqrt(max(abs(c_a * c_b), max(abs(c_b * c_c), abs(c_c * c_a))))
    return min(steps, float(MAX_STEPS)) if fastest * h * MAX_STEPS >= 1.0 else 0.0


@njit(**INNER)
def _moments_and_omega(points, i):
    """Return the moments of point i, spin axis first, and its angular velocity in units of the spin."""
    spin, epsilon, phase = (1.0 if points.omega0[i] > 0.0 else -1.0), points.epsilon[i], points.phase[i]
    moments = rigid_body.relabel(points.I1[i], points.I2[i], points.I3[i], points.axis[i])
    return moments, (spin, epsilon * math.cos(phase), epsilon * math.sin(phase))


@njit(**INNER)
def _start_lane(S, lane, points, i, step):
    """Put a lane at the start of point i, to run (backward if step < 0) until a, or b and c, have changed sign."""
    moments, omega = _moments_and_omega(points, i)
    c_a, c_b, c_c = rigid_body.euler_coefficients(*moments)
    rate = max(abs(c_a), abs(c_b), abs(c_c)) * math.sqrt(1.0 + points.epsilon[i] * points.epsilon[i])
    h = step / rate if rate > 0.0 else 1.0
    follower.start_lane(S, lane, moments, omega, (0.0, 0.0, 0.0), h)
    S[row.due_a + lane], S[row.due_b + lane], S[row.due_c + lane] = 0.0, 0.0, 0.0
    S[row.max_steps + lane] = max_steps(c_a, c_b, c_c, abs(h))
    S[row.active + lane] = 0.0 if elliptic_constants.is_stationary((c_a, c_b, c_c), omega) else 1.0


@njit(**INNER)
def _tilt(omega, spin):
    """Return the angle between omega and the end of the axis that has the sign of ``spin``."""
    a, b, c = omega
    return math.atan2(math.hypot(b, c), a if spin > 0.0 else -a)


@njit(**INNER)
def _tilt_at(crossings, event, lane, spin):
    """Return the tilt at an event of one lane; NaN if the event was not found."""
    return _tilt(follower.omega_at(crossings, event, lane), spin)


@njit(**INNER)
def _flip_and_tilt(forward, backward, lane, spin):
    """Return the time between two flips and the largest tilt of one lane, from its events forward and backward.

    The time is NaN if the body does not flip; both are NaN if the search did not finish.
    """
    b_tilt, c_tilt = _tilt_at(forward, B, lane, spin), _tilt_at(forward, C, lane, spin)
    flip = forward[A, TIME, lane]
    if math.isnan(flip):
        return math.nan, max(b_tilt, c_tilt) if b_tilt + c_tilt >= 0.0 else math.nan
    flip -= backward[A, TIME, lane]
    tilt = np.fmin(b_tilt, c_tilt)
    tilt = np.fmin(tilt, np.fmin(_tilt_at(backward, B, lane, spin), _tilt_at(backward, C, lane, spin)))
    return flip, math.pi - tilt if flip > 0.0 else math.nan


@njit(nogil=True, **OPTIONS)
def fill_columns(points, order, tolerance, out, at_limit):
    """Fill COLUMNS for points taken W at a time: each spin is followed forwards, then backwards, to its flips.

    Args:
        points (kernels.free.rigid_body.Spins): Points of n spins.
        order (numpy.ndarray of int64, shape (n,)): Order in which they are taken, which changes no result.
        tolerance (float): Relative error allowed in the measured columns.
        out (numpy.ndarray, shape (5, n)): COLUMNS: s, s, rad, rad, rad s-1; NaN where missing.
        at_limit (numpy.ndarray of bool, shape (n,)): Set to whether the search reached its bound.
    """
    (S, forward), (_, backward) = follower.new_block(), follower.new_block()
    step = follower.largest_step(STEPS_TO_A_FLIP, tolerance)
    for first in range(0, order.size, W):
        block = order[first : first + W]
        for lane in range(W):
            _start_lane(S, lane, points, block[min(lane, block.size - 1)], step)
        follower.follow_lanes(S, forward, False)
        for lane in range(W):
            _start_lane(S, lane, points, block[min(lane, block.size - 1)], -step)
            S[row.active + lane] = 1.0 if forward[A, TIME, lane] >= 0.0 else 0.0
        follower.follow_lanes(S, backward, False)
        for lane, i in enumerate(block):
            _write_columns(forward, backward, lane, points, i, out, at_limit)


@njit(**INNER)
def _write_columns(forward, backward, lane, points, i, out, at_limit):
    """Write the measured columns of point i from its lane's events, and the exact columns."""
    moments, omega = _moments_and_omega(points, i)
    spin = abs(points.omega0[i])
    if elliptic_constants.is_stationary(rigid_body.euler_coefficients(*moments), omega):  # a sphere, for example
        flip, tilt = math.nan, _tilt(omega, omega[0])
    else:
        flip, tilt = _flip_and_tilt(forward, backward, lane, omega[0])
    at_limit[i] = math.isnan(tilt)
    out[AT.flip_period, i], out[AT.max_tilt, i] = flip / spin, tilt
    top = exact.set_up(*moments, *omega)
    period = exact.flip_period(top)
    flips = top.axes[2] != 1 and math.isfinite(period)
    out[AT.flip_period_exact, i] = period / spin if flips else math.nan
    out[AT.max_tilt_exact, i] = exact.max_tilt(top, 1)
    out[AT.frequency_exact, i] = exact.frequency(top) * spin
