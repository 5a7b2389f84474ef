r"""The twist of a thrown racket: its rotation about the handle during one revolution of the handle.

*Angles.* The handle is axis 1, the axis of least moment (:math:`I_1\le I_2\le I_3`); theta is its angle to the momentum
L, phi its azimuth about L in space, and :math:`\chi = \mathrm{atan2}(L_3, L_2)` says which side of the racket L is on.
The throw starts at chi and theta with :math:`L = I_2\omega_0`. The twist is the change of chi while phi grows by 2 pi,
signed and unwound: half a turn, near pi, is what surprises people who throw a racket about axis 2.

*Theory.* With :math:`a = I_2/I_1 - 1, b = 1 - I_2/I_3, c = 2T I_2/L^2 - 1`

.. math:: \frac{d\chi}{d\phi} = \pm\frac{\sqrt{(a + b\sin^2\chi)(c + b\sin^2\chi)}}{1 - b\sin^2\chi},
          \qquad \sqrt{ab} = \sigma/\omega_0

the growth rate about axis 2 in units of the spin. On the separatrix (c = 0) a racket that starts at chi = -eps ends at
-(pi - eps) after one turn where

.. math:: \mathrm{artanh}\frac{\sqrt a\cos\epsilon}{\sqrt{a + b\sin^2\epsilon}} = \sqrt{ab}\left[\pi +
          \arcsin\left(\cos\epsilon\sqrt{b/(a+b)}\right)\right], \qquad
          \epsilon \approx 2\sqrt{\tfrac{a}{a+b}}\,e^{-\sqrt{ab}\,[\pi + \arctan\sqrt{b/a}]}

so the defect from half a turn, 2 eps, falls with :math:`e^{-\pi\sigma/\omega_0}`.

*Measuring.* The handle's azimuth phi is integrated until it has grown by 2 pi (:mod:`kernels.events.follower`); chi is
unwound by its crossings on the way. A first run with longer steps gives the error: three times the difference, and what
rounding grows to, the ratio of the fastest to the slowest change of w on the way.

*Exactly.* The same angle from the closed form of :mod:`kernels.free.attitude`, in which the time of phi = 2 pi is found
to rounding. The two share no code but the start.

Source: derived from Euler's equations; the differential equation should be that of Van Damme, Mardesic and Sugny,
Physica D 338 (2017) 17, with their psi = chi + pi/2.
"""

import math

import numpy as np

from kernels.compile.blocks import W
from kernels.compile.columns import arrays
from kernels.compile.jit import INNER, OPTIONS, njit
from kernels.events import follower
from kernels.events.follower import AZIMUTH, row
from kernels.free import attitude, elliptic, elliptic_constants

EPSILON = float(np.finfo(np.float64).eps)
TWO_PI = 2.0 * math.pi
STEPS_PER_TURN = 30.0  # The steps' error stays below the tolerance over so many of them, a typical number.
MAX_STEPS = 100_000  # A needle that takes more steps gets no result: its roundings exceed their estimate.
MAX_TURN_ERROR = 1e-9  # rad, largest distance of phi from 2 pi at the root; Newton's method ends far below it


@njit(**OPTIONS)
def start(I1, I2, I3, chi, theta):
    """Return the angular velocity at L/I2 = 1: ``L = (cos theta, sin theta cos chi, sin theta sin chi)``.

    Args:
        `I1`, `I2`, `I3` (float): Ascending moments in a common unit.
        chi, theta (float): Angles of L, rad: about the handle from axis 2, and to the handle.
    """
    sine = math.sin(theta)
    # half a right angle's cosine is 6e-17 in doubles; a throw across the handle has none
    along = math.cos(theta) if theta != 0.5 * math.pi else 0.0
    return along * (I2 / I1), sine * math.cos(chi), sine * math.sin(chi) * (I2 / I3)


@njit(**INNER)
def _largest_rate(moments, omega):
    """Return a bound on the rates of the motion, in L/I2: |w| never exceeds sqrt(2T/I1), and no rate exceeds it."""
    I1, I2, I3 = moments
    w1, w2, w3 = omega
    bound = math.sqrt(w1 * w1 + (I2 / I1) * w2 * w2 + (I3 / I1) * w3 * w3)
    rate = max(1.0, (I3 - I2) / I1, (I3 - I1) / I2)
    return rate * max(math.sqrt(w1 * w1 + w2 * w2 + w3 * w3), 0.5 * bound)


@njit(**INNER)
def _start_lane(S, lane, throws, i, step):
    """Put a lane at the start of throw i, to run until the handle has come round L; not at all along the handle."""
    I1, I2, I3, chi, theta = throws
    moments = scale_moments(I1[i], I2[i], I3[i])
    omega = start(*moments, chi[i], theta[i])
    L1, L2, L3 = moments[0] * omega[0], moments[1] * omega[1], moments[2] * omega[2]
    across = math.sqrt(L2 * L2 + L3 * L3)
    L = math.sqrt(L1 * L1 + across * across)
    # the fixed vector, of azimuth 0: at right angles to L, in the plane of L and the handle
    n = (across / L, -L1 * L2 / (across * L), -L1 * L3 / (across * L))
    follower.start_lane(S, lane, moments, omega, n, step / _largest_rate(moments, omega))
    S[row.azimuth + lane], S[row.due_azimuth + lane], S[row.max_steps + lane] = 0.0, follower.PERIOD, MAX_STEPS
    S[row.active + lane] = 1.0 if across > 0.0 else 0.0


@njit(**INNER)
def _rounding_error(S, lane):
    """Return an upper estimate of the roundings of a lane's steps at the end of its run, rad."""
    growth = math.sqrt(S[row.fastest + lane] / S[row.slowest + lane]) if S[row.slowest + lane] > 0.0 else 1.0
    return 4.0 * EPSILON * (4.0 + math.sqrt(S[row.steps + lane])) * (1.0 + growth)


@njit(**INNER)
def _azimuth_of_axis(m_d, m_j, m_k):
    """Return the azimuth about d of axis j after the shortest arc from m to d: of ``1 - m_j^2/(1 + m_d)`` and so on."""
    return math.atan2(-m_j * m_k, m_d + (m_d * m_d + m_k * m_k))


@njit(**INNER)
def _turn_angles(t, top, chi):
    """Return phi since the start, the change of chi, and the components L2 and L3 over L, a time t (s) after it.

    phi is the sum of psi of :mod:`kernels.free.attitude` and of the handle's azimuth about d, the encircled axis.
    """
    d, side, own_t = top.frame.d, top.frame.side, t * top.motion.unit
    m_d, m_j, m_k = attitude.direction(own_t, top)
    _, m2, m3 = attitude.by_cyclic_axes(d, side * m_d, m_j, side * m_k)
    change = _unwrap_change(math.atan2(m3, m2) - chi, t, top)
    azimuth = side * change if d == 1 else _azimuth_of_axis(m_d, m_j, m_k) - _azimuth_of_axis(*top.frame.m)
    return 2.0 * attitude.half_turn(own_t, top) + azimuth, change, m2, m3


@njit(**OPTIONS)
def exact_turn(moments, begin, chi):
    """Return twist and time of the first full turn of the handle about L, in closed form; NaN along the handle.

    phi grows between L/I_3 and L/I_2 a second, which bounds the time: Newton's method, halving if it leaves the bounds.

    Args:
        moments (tuple of 3 floats): Ascending moments near one.
        begin (tuple of 3 floats): Angular velocity at the start, near one.
        chi (float): Angle of L about the handle at the start, rad, from -pi to pi.
    """
    n1, n2, n3 = moments[0] * begin[0], moments[1] * begin[1], moments[2] * begin[2]
    if n2 == 0.0 and n3 == 0.0:
        return math.nan, math.nan
    if elliptic_constants.is_stationary(elliptic_constants.coefficients(*moments), begin):
        return 0.0, TWO_PI / math.sqrt(begin[0] ** 2 + begin[1] ** 2 + begin[2] ** 2)
    top = attitude.prepare(moments, begin)
    L = math.sqrt(n1 * n1 + (n2 * n2 + n3 * n3))
    low, high = TWO_PI * moments[1] / L, TWO_PI * moments[2] / L
    t, change, missing = low, 0.0, TWO_PI
    rounding = 1e-14 + 8.0 * EPSILON * abs(begin[0]) * high  # error of phi, and of turns about the handle
    for _ in range(100):
        phi, change, m2, m3 = _turn_angles(t, top, chi)
        previous, missing = missing, TWO_PI - phi
        low, high = (t, high) if missing > 0.0 else (low, t)
        t += missing / L * (m2 * m2 + m3 * m3) / (m2 * m2 / moments[1] + m3 * m3 / moments[2])
        if abs(missing) < 1e-14 or (abs(missing) < rounding and abs(missing) >= abs(previous)):
            break
        t = t if low < t < high else 0.5 * (low + high)
    return (change, t) if abs(missing) < MAX_TURN_ERROR else (math.nan, math.nan)


@njit(**INNER)
def _unwrap_change(change, t, top):
    """Return the change of chi with its whole turns: half a turn a half period where the handle is encircled."""
    p, m, m1, unit = top.motion.p, top.motion.m, top.motion.m1, top.motion.unit
    d, side = top.frame.d, top.frame.side
    change -= TWO_PI * math.floor(change / TWO_PI + 0.5)
    if d != 1 or m1 <= 0.0:
        return change
    sense = -side  # L revolves about the handle from axis 3 to axis 2 where w_1 > 0
    halves = math.floor(p * (t * unit) / (2.0 * elliptic.K(m, m1)))
    remainder = sense * change - math.pi * halves
    remainder -= TWO_PI * math.floor(remainder / TWO_PI)
    return sense * (math.pi * halves + (remainder - TWO_PI if remainder > 1.5 * math.pi else remainder))


@njit(**OPTIONS)
def defect_theory(I1, I2, I3):
    """Return the defect 2 eps on the separatrix, rad, of a body of ascending moments; NaN for a symmetric one.

    The equation of the module's docstring, as ``ln sin(eps)`` equal to a function that hardly depends on it.

    Args:
        `I1`, `I2`, `I3` (float): Ascending moments in a common unit.
    """
    a, b = (I2 - I1) / I1, (I3 - I2) / I3
    if not (a > 0.0 and b > 0.0):
        return math.nan
    rate, low = math.sqrt(a) * math.sqrt(b), -1.0
    for _ in range(500):
        s2 = math.exp(2.0 * low)
        cosine = math.sqrt(max(0.0, 1.0 - s2))
        x = math.sqrt(a / (a + b * s2)) * cosine
        final_azimuth = math.pi + math.asin(min(1.0, cosine * math.sqrt(b / (a + b))))
        new = min(0.0, math.log1p(x) - 0.5 * math.log((a + b) / (a + b * s2)) - rate * final_azimuth)
        shift = abs(new - low)
        low = new
        if shift < 1e-15 * max(1.0, abs(low)):
            break
    return 2.0 * math.asin(math.exp(low))


@njit(**OPTIONS)
def scale_moments(low, middle, high):
    """Return the ascending moments ``low``, ``middle``, ``high`` in a unit in which the middle one is 1 or less."""
    # a power of two if two moments agree to 1/32: it rounds nothing, so that the small difference keeps its digits
    close = min(middle - low, high - middle) < 0.03125 * high
    unit = elliptic_constants.unit_of(middle, middle, middle) if close else middle
    return low / unit, middle / unit, high / unit


@njit(**OPTIONS)
def wrap_angle(chi):
    """Return the equal angle between -pi and pi, rad; a result between them is not rounded."""
    return chi if abs(chi) <= math.pi else math.atan2(math.sin(chi), math.cos(chi))


@njit(nogil=True, **OPTIONS)
def fill_exact(throws, out):
    """Fill (3, n) with twist (rad), time of the turn (in I_mid/L) and the law's defect (rad), in closed form.

    Args:
        throws (tuple of 5 arrays, shape (n,)): Ascending moments in a common unit, chi and theta (rad).
        out (numpy.ndarray, shape (3, n)): Written.
    """
    I1, I2, I3, chi, theta = throws
    for i in range(I1.size):
        moments = scale_moments(I1[i], I2[i], I3[i])
        out[0, i], out[1, i] = exact_turn(moments, start(*moments, chi[i], theta[i]), wrap_angle(chi[i]))
        out[2, i] = defect_theory(*moments)


@njit(nogil=True, **OPTIONS)
def fill_measured(throws, tolerance, out):
    """Fill (4, n) with measured twist (rad) and time of the turn (in I_mid/L), then the errors of both.

    Args:
        throws (tuple of 5 arrays, shape (n,)): As for :func:`fill_exact`.
        tolerance (float): Error of the steps allowed in a turn, relative.
        out (numpy.ndarray, shape (4, n)): Written; NaN along the handle and if MAX_STEPS are too few.
    """
    S, crossings = follower.new_block()
    step = follower.largest_step(STEPS_PER_TURN, tolerance)
    chi = throws[3]
    for first in range(0, chi.size, W):
        points = np.arange(first, min(first + W, chi.size))
        for is_finer in (False, True):
            for lane in range(W):
                i = points[min(lane, points.size - 1)]
                _start_lane(S, lane, throws, i, follower.FINER * step if is_finer else step)
            follower.follow_lanes(S, crossings, True)
            for lane, i in enumerate(points):
                _, b, c = follower.omega_at(crossings, AZIMUTH, lane)
                angle = math.atan2(S[row.Ic + lane] * c, S[row.Ib + lane] * b) + TWO_PI * S[row.wraps + lane]
                values = angle - wrap_angle(chi[i]), crossings[AZIMUTH, follower.TIME, lane]
                rounding = _rounding_error(S, lane)
                for k in range(2):
                    error = 3.0 * abs(values[k] - out[k, i]) + rounding * max(1.0, abs(values[k]))
                    out[k, i], out[k + 2, i] = values[k], error


def survey(points, tolerance, measured=True):
    """Return all columns of points, in units.

    Args:
        points (mapping of str to array_like, shape (n,)): I1, I2, I3 (common unit, > 0, in any order: the axes are
            those of ascending moments), chi, theta (rad), omega0 (rad s-1, > 0: L = I_mid omega0).
        tolerance (float): Error of the steps allowed in the measured twist, before the motion amplifies it.
        measured (bool): Whether to integrate the motion, in addition to the closed form.

    Returns:
        dict of str to numpy.ndarray, shape (n,): twist_exact, twist_defect_theory (rad), time_of_turn_exact (s), growth
            (sigma/omega0, 1); if ``measured``, twist, twist_error, twist_defect (rad), time_of_turn, time_of_turn_error
            (s), ends_reversed (int8; -1 missing).
    """
    *moments, chi, theta, omega0 = arrays(*(points[name] for name in ("I1", "I2", "I3", "chi", "theta", "omega0")))
    low, middle, high = np.sort(moments, axis=0)
    throws, out = (low, middle, high, chi, theta), np.empty((3, omega0.size))
    fill_exact(throws, out)
    columns = {
        "twist_exact": out[0],
        "time_of_turn_exact": out[1] / omega0,
        "twist_defect_theory": out[2],
        "growth": np.sqrt((middle - low) / low) * np.sqrt((high - middle) / high),
    }
    if measured:
        turns = np.empty((4, omega0.size))
        fill_measured(throws, tolerance, turns)
        columns |= {
            "twist": turns[0],
            "twist_error": turns[2],
            "time_of_turn": turns[1] / omega0,
            "time_of_turn_error": turns[3] / omega0,
            "twist_defect": np.pi - np.abs(turns[0]),
            "ends_reversed": np.where(np.isnan(turns[0]), -1, np.cos(turns[0]) < 0.0).astype(np.int8),
        }
    return columns
